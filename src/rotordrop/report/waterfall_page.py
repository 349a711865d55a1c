"""The report on the frequencies of a coast-down, recorded or simulated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop._version import __version__
from rotordrop.evidence.rest import STANDSTILL
from rotordrop.known import Known
from rotordrop.record.impacts import CONTACT_FROM
from rotordrop.report.content import (
    Card,
    Column,
    Figure,
    KeyFigure,
    ReportContent,
    Section,
    Statement,
    Table,
    table,
    verdict_column,
)
from rotordrop.report.quantity import NO_BREAK, Quantity, shown, with_error, written
from rotordrop.report.style import TURN
from rotordrop.report.waterfall_figure import (
    displacement_history_figure,
    highest_shown,
    order_figure,
    speed_law_figure,
    waterfall_figure,
)
from rotordrop.spectrum.coast_down import RACES_SPUN_UP, SENSOR_NOISE, SHORTEST_LAW
from rotordrop.spectrum.indentation import held_maximum
from rotordrop.spectrum.orders import LEAST_APART, STANDARD_SETTINGS, STEADY_APART

if TYPE_CHECKING:
    from rotordrop.spectrum.coast_down import CoastDownAnalysis, PlaneAnalysis, SpeedLaw
    from rotordrop.spectrum.lines import Line
    from rotordrop.spectrum.orders import OrderTrack

NO_SPEED = (
    "The record has no speed that falls: whether a line follows it stays open, and there are no tracked "
    "orders, no resonances and no speed law. Record the speed, or name its channel in a profile."
)
SHORT_SPEED = (
    f"The speed is known for less than {RACES_SPUN_UP + SHORTEST_LAW:g} s after power-off: too short for a "
    "speed law."
)
AS_READ = f" The simulated motion was given the noise of a usual sensor, {1e6 * SENSOR_NOISE:g} µm rms."
NO_WATERFALL = "The signal is shorter than one frame; there is no waterfall."
LINES_NOTE = (
    "Amplitudes are those in the direction and plane where they are largest, root mean square over the time "
    "the line was seen. ± is one standard error, never less than what a line seen that long can be told "
    "apart by: one over that time (for an order, one over the turns in it), divided by √12. X is the order, "
    "the multiple of the rotor's speed."
)
LINES = "Lines"
BY_DISPLACEMENT, FROM_POWER_OFF = "by the displacement alone", "from power-off"
_IN_WHOLE_SECONDS = 10.0
"""Time from which on whole seconds say when a line was seen [s] (chosen)."""
_COMPONENTS = {
    "x": "horizontal",
    "y": "vertical",
    "full": "forward (right) and backward (left) parts",
}


def waterfall_page(
    analysis: CoastDownAnalysis,
    *,
    title: str,
    facts: tuple[tuple[str, str], ...] = (),
    simulated: str = "",
    against: str = "time",
    highest: float | None = None,
    drawn: bool = True,
) -> ReportContent:
    """Build the report on the frequencies of a coast-down, with its sections where they are wanted.

    Waterfalls go upwards with the time or the speed (``against``), as far as anything happens, or up to a
    ``highest`` frequency [Hz].
    """
    cards = []
    for name, plane in analysis.planes.items():
        history, settled = plane.history, plane.settling
        at = f"at {shown(history.largest_time, 'duration', 3)}"
        last = math.nan if settled.contact_from is None else settled.contact_from
        figures = tuple(
            KeyFigure(label, Quantity(value=value, kind=kind, interval_90=between, digits=3), note)
            for label, value, kind, between, note in (
                ("Largest displacement", history.largest, "length", history.largest_interval_90, at),
                (
                    "Beyond the air gap",
                    history.largest_indentation,
                    "length",
                    history.largest_indentation_interval_90,
                    "",
                ),
                (
                    "Largest after 0.2 s",
                    history.largest_later,
                    "length",
                    history.largest_later_interval_90,
                    "",
                ),
                ("Impacts", len(settled.touched), "count", settled.count_interval_90, BY_DISPLACEMENT),
                (
                    CONTACT_FROM.capitalize(),
                    last,
                    "duration",
                    settled.contact_from_interval_90,
                    FROM_POWER_OFF,
                ),
            )
        )
        cards.append(Card(f"{name} plane", figures))
    return ReportContent(
        title=title,
        subtitle="times count from power-off",
        simulated=simulated,
        verdict=_verdict(analysis),
        cards=tuple(cards),
        facts=(*facts, ("rotordrop", __version__)),
        summary=(line_table(analysis),),
        sections=tuple(
            replace(section, tables=()) if section.heading == LINES else section  # it stands in the summary
            for section in (frequency_sections(analysis, against, highest) if drawn else ())
        ),
    )


def frequency_sections(
    analysis: CoastDownAnalysis, against: str = "time", highest: float | None = None
) -> tuple[Section, ...]:
    """Displacement, waterfalls, lines, orders with the resonances they pass, and the speed law."""
    role = "measured" if analysis.signal.recorded else "simulated"
    histories = {name: plane.history for name, plane in analysis.planes.items()}
    displacement = Figure(
        displacement_history_figure(histories, role),
        f"Distance of the rotor from the bearing centre over the whole coast-down, {role}, with the "
        "air-gap window (Neisi 2020, Fig. 17).",
    )
    reasons = tuple(f"{line.label}: {line.reason}." for line in analysis.lines)
    tracked = any(plane.track is not None for plane in analysis.planes.values())
    return (
        Section("Displacement over the coast-down", figures=(displacement,)),
        _waterfall_section(analysis, against, highest),
        Section(LINES, reasons, tables=(line_table(analysis),)),
        *((_order_section(analysis),) if tracked else ()),
        *(() if analysis.speed_law is None else (_law_section(analysis, analysis.speed_law, role),)),
    )


def _covered(analysis: CoastDownAnalysis) -> tuple[Statement, ...]:
    """From which speed to which the signal reaches, and what it cannot show where it ends turning."""
    signal = analysis.signal
    if signal.profile is None:
        return ()
    lasts = next(iter(signal.planes.values())).shape[0] / signal.sampling_rate
    ends = (signal.start_time, signal.start_time + lasts)
    first, last = (abs(float(speed)) for speed in signal.profile.speed_at(ends))
    what = "record" if signal.recorded else "simulation"
    said = f"The {what} covers the {lasts:.1f} s after power-off, from {shown(first, 'speed')} to "
    if last <= STANDSTILL:
        return (Statement(f"{said}standstill."),)
    return (
        Statement(
            f"{said}{shown(last, 'speed')}: it ends before standstill, and says nothing of largest motion, "
            "lines and resonances below that speed.",
            "warning",
        ),
    )


def _verdict(analysis: CoastDownAnalysis) -> tuple[Statement, ...]:
    said = [*_covered(analysis)]
    for name, plane in analysis.planes.items():
        held = held_maximum(plane.history)
        said.append(Statement(f"{name}: {plane.history.statement}", "good" if held else "warning"))
        said.append(settling_statement(name, plane))
    count, unnamed = len(analysis.lines), sum(not line.named for line in analysis.lines)
    which = "it" if unnamed == 1 else "them"
    why = f": nothing in the machine description or the mains explains {which} well enough" if unnamed else ""
    lines = f"{count} line{'' if count == 1 else 's'} found"
    said.append(Statement(f"{lines}, {count - unnamed} named, {unnamed} without a name{why}."))
    said += [Statement(text) for text in analysis.force_statements()]
    if analysis.signal.profile is None:
        said.append(Statement(NO_SPEED, "warning"))
    else:
        law = analysis.speed_law
        said.append(Statement(SHORT_SPEED if law is None else _standstill(law.standstill)))
    return tuple(said)


def settling_statement(name: str, plane: PlaneAnalysis) -> Statement:
    """When the rotor came to lie in its bearing for good."""
    settled = plane.settling.contact_from is not None
    return Statement(f"{name}: {plane.settling_words}.", "good" if settled else "notice")


def _standstill(stop: Known) -> str:
    if stop.status != "determined":
        turned = stop.value if stop.lower is None else stop.lower
        return f"When the rotor stopped is open: {stop.status}. It turned until {turned:.1f} s at least."
    if stop.interval_90 is None:
        return f"The rotor stopped {stop.value:.2f} s after power-off."
    return (
        f"The rotor stopped {stop.value:.1f} s after power-off (90 %: {stop.low:.1f} to {stop.high:.1f} s)."
    )


def seen_of(line: Line, lines: Sequence[Line]) -> str:
    """From when to when a line was seen; in whole seconds where any of the lines was seen for long."""
    longest = max((one.last_seen for one in lines), default=0.0)
    places = 0 if longest >= _IN_WHOLE_SECONDS else 2
    return f"{line.first_seen:.{places}f} to {line.last_seen:.{places}f} s"


def line_table(analysis: CoastDownAnalysis) -> Table:
    """Every line with frequency or order, amplitude, width, confidence and the reason for its name."""
    columns = (
        Column("name", "label"),
        Column("where", where_of),
        Column("amplitude, zero-to-peak", "amplitude", "length", 3),
        Column("× floor", lambda line: f"{line.ratio:.0f}"),
        Column("width", lambda line: f"{line.width:.2f} Hz" if line.width else "below resolution"),
        Column("seen", lambda line: seen_of(line, analysis.lines).replace(" ", NO_BREAK)),
        Column("confidence", lambda line: line.confidence if line.named else None, "probability"),
    )
    return table(analysis.lines, columns, "Lines found, strongest first", LINES_NOTE)


def where_of(line: Line) -> str:
    """Order or frequency of a line with its error."""
    matches = line.name.matches
    # Where the speed changed too little to tell, the name says which of the two it is.
    an_order = line.kind == "order" or bool(matches and matches[0].candidate.kind == "order")
    if line.order is None or not an_order:
        return with_error(line.frequency, line.frequency_error, "Hz").replace(" ", NO_BREAK)
    return with_error(line.order, line.order_error, "X").replace(" ", NO_BREAK)


def _waterfall_section(analysis: CoastDownAnalysis, against: str, highest: float | None) -> Section:
    figures = []
    top = highest_shown(analysis) if highest is None else highest
    for name, plane in analysis.planes.items():
        lines = [line for line in analysis.lines if name in line.forward and line.named]
        for fall in plane.waterfalls:
            caption = (
                f"{name}, {_COMPONENTS[fall.component]}: amplitude {fall.amplitude_kind} of frames of "
                f"{fall.settings.points} points, Hann window, {100 * fall.settings.overlap:.0f} % overlap, "
                f"lines {fall.resolution:.3f} Hz apart (Neisi 2020, Fig. 18). A falling speed smears the "
                "orders here; their true amplitude is below."
            )
            chart = waterfall_figure(fall, name, lines, against=against, highest=top)
            figures.append(Figure(chart, caption))
    if not figures:
        return Section("Waterfall", statements=(Statement(NO_WATERFALL),))
    return Section("Waterfall", figures=tuple(figures))


def _order_section(analysis: CoastDownAnalysis) -> Section:
    heading, figures = "Orders and resonances", []
    for name, plane in analysis.planes.items():
        if plane.track is not None:
            caption = (
                f"{name}: amplitude of the orders, zero-to-peak, tracked in the angle the rotor really "
                f"turned through, over windows of {plane.track.revolutions:g} turns. Gaps: a steady line "
                "lies too close to tell it from the order."
            )
            chart = order_figure(plane.track, name)
            figures.append(Figure(chart, caption + ("" if analysis.signal.recorded else AS_READ)))
    tracked = [(name, plane) for name, plane in analysis.planes.items() if plane.track is not None]
    found = [(name, resonance) for name, plane in tracked for resonance in plane.resonances]
    rows = [row for row in found if row[1].certain]
    crossed = len(found) - len(rows)
    short = next((_short(plane.track) for _, plane in tracked if plane.track is not None), ())
    if not rows:
        but = f", but where it crosses a steady line ({crossed} times)" if crossed else ""
        none = Statement(f"No order rises above its surroundings on the way down{but}.")
        return Section(heading, statements=(*short, none), figures=tuple(figures))
    columns = (
        Column("plane", lambda row: row[0]),
        Column("order", lambda row: f"{row[1].order:g}X"),
        Column("excited at", lambda row: f"{row[1].frequency:.1f} ± {row[1].frequency_error:.1f} Hz"),
        Column("rotor speed", lambda row: f"{row[1].speed / TURN:.1f} Hz"),
        Column("amplitude, zero-to-peak", lambda row: row[1].amplitude, "length", 3),
        Column("rise", lambda row: f"{row[1].rise:.1f}"),
        Column("mode", lambda row: row[1].name.label),
    )
    passed = table(rows, columns, "Resonances passed on the way down")
    left_out = (
        f"{crossed} more rises are left out: a steady line crosses the order there and makes part of them."
    )
    return Section(
        heading,
        (left_out,) if crossed else (),
        statements=short,
        figures=tuple(figures),
        tables=(passed,),
    )


def _short(track: OrderTrack) -> tuple[Statement, ...]:
    """What the orders of a short signal cannot tell."""
    if track.revolutions >= STANDARD_SETTINGS.revolutions:
        return ()
    close, steady = (turns / track.revolutions for turns in (LEAST_APART, STEADY_APART))
    have = ", ".join(f"{order:g}X" for order in track.orders)
    return (
        Statement(
            f"The signal is short: orders ({have}) are tracked over {track.revolutions:.3g} turns in place "
            f"of {STANDARD_SETTINGS.revolutions:g}. Two orders less than {close:.2g}X apart, and an "
            f"order and a steady line less than {steady:.2g}X apart, are not told apart.",
            "notice",
        ),
    )


def law_table(law: SpeedLaw) -> Table:
    """Time constant, what each drag takes from the speed per second, and standstill, with their intervals."""
    drag = law.drag
    speed = drag.initial_speed.value
    at = f"slowing at {speed / TURN:.1f} Hz"
    rows = (
        ("time constant of the exponential fit", law.exponential.time_constant, 1.0, "s"),
        (f"dry drag (balls and races): {at}", drag.constant, 1.0 / TURN, "Hz/s"),
        (f"linear drag: {at}", drag.linear, speed / TURN, "Hz/s"),
        (f"quadratic drag: {at}", drag.quadratic, speed**2 / TURN, "Hz/s"),
        ("standstill", law.standstill, 1.0, "s"),
    )

    def places(known: Known, scale: float) -> int:
        half = max(0.5 * scale * (known.high - known.low), 1e-4)
        return 2 if known.interval_90 is None else max(0, 1 - int(np.floor(np.log10(half))))

    def value(row: tuple[str, Known, float, str]) -> str:
        _, known, scale, unit = row
        return f"{written(scale * known.value, places(known, scale))} {unit}"

    def interval(row: tuple[str, Known, float, str]) -> str:
        _, known, scale, unit = row
        if known.interval_90 is None:
            return "–"
        low, high = (written(scale * end, places(known, scale)) for end in known.interval_90)
        return f"{low} to {high} {unit}"

    columns = (
        Column("quantity", lambda row: row[0]),
        Column("value", value),
        Column("90 % interval", interval),
        verdict_column(lambda row: row[1].status),
    )
    return table(rows, columns, "Speed law")


def _law_section(analysis: CoastDownAnalysis, law: SpeedLaw, role: str) -> Section:
    time, speed = analysis.signal.speed_time, analysis.signal.speed
    assert time is not None and speed is not None
    figure = Figure(
        speed_law_figure(time, speed, law, role),
        "Speed with the exponential fit of the paper and a fit of dry, linear and quadratic drag; "
        "below what each leaves over.",
    )
    text = (law.exponential.statement, law.drag.statement)
    return Section("Speed law", text, figures=(figure,), tables=(law_table(law),))
