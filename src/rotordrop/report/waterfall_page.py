"""The report on the frequencies of a coast-down, recorded or simulated."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop._version import __version__
from rotordrop.report.coast_down_figures import displacement_history_figure, speed_law_figure
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement, Table
from rotordrop.report.quantity import Quantity, with_error, written
from rotordrop.report.waterfall_figure import highest_shown, order_figure, waterfall_figure
from rotordrop.spectrum.coast_down import RACES_SPUN_UP, SENSOR_NOISE, SHORTEST_LAW
from rotordrop.spectrum.indentation import held_maximum

if TYPE_CHECKING:
    from rotordrop.spectrum.coast_down import CoastDownAnalysis, PlaneAnalysis, SpeedLaw
    from rotordrop.spectrum.lines import Line

NO_SPEED = (
    "The record has no speed that falls: whether a line follows it stays open, and there are no tracked "
    "orders, no resonances and no speed law. Record the speed, or name its channel in a profile."
)
SHORT_SPEED = (
    f"The speed is known for less than {RACES_SPUN_UP + SHORTEST_LAW:g} s after power-off: too short for a "
    "speed law."
)
AS_READ = f" The simulated motion was given the noise of a usual sensor, {1e6 * SENSOR_NOISE:g} µm rms."
LINES = "Lines"
NO_BREAK = "\u00a0"
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
) -> ReportContent:
    """Build the report on the frequencies of a coast-down.

    Parameters
    ----------
    analysis : CoastDownAnalysis
        What was found.
    title : str
        Whose coast-down this is.
    facts : tuple of (str, str)
        Machine and record.
    simulated : str
        Sentence that says the record is simulated; empty for a measured one.
    against : {"time", "speed"}
        What goes upwards in the waterfalls.
    highest : float, optional
        Highest frequency drawn [Hz]; as far as anything happens by default.
    """
    return ReportContent(
        title=title,
        simulated=simulated,
        verdict=_verdict(analysis),
        cards=tuple(_card(name, plane) for name, plane in analysis.planes.items()),
        facts=(*facts, ("rotordrop", __version__)),
        summary=(line_table(analysis),),
        sections=tuple(
            replace(section, tables=()) if section.heading == LINES else section  # it stands in the summary
            for section in frequency_sections(analysis, against, highest)
        ),
    )


def frequency_sections(
    analysis: CoastDownAnalysis, against: str = "time", highest: float | None = None
) -> tuple[Section, ...]:
    """Displacement, waterfalls, lines, orders with the resonances they pass, and the speed law."""
    sections = [
        _displacement_section(analysis),
        _waterfall_section(analysis, against, highest),
        _line_section(analysis),
    ]
    if any(plane.track is not None for plane in analysis.planes.values()):
        sections.append(_order_section(analysis))
    if analysis.speed_law is not None:
        sections.append(_law_section(analysis, analysis.speed_law))
    return tuple(sections)


def _verdict(analysis: CoastDownAnalysis) -> tuple[Statement, ...]:
    statements = []
    for name, plane in analysis.planes.items():
        held = held_maximum(plane.history)
        statements.append(
            Statement(text=f"{name}: {plane.history.statement}", level="good" if held else "warning")
        )
        statements.append(
            Statement(
                text=f"{name}: {plane.settling.statement}",
                level="good" if plane.settling.settled else "notice",
            )
        )
    unnamed = sum(not line.named for line in analysis.lines)
    which = "it" if unnamed == 1 else "them"
    why = f": nothing in the machine description or the mains explains {which} well enough" if unnamed else ""
    count = len(analysis.lines)
    statements.append(
        Statement(text=f"{count} lines found, {count - unnamed} named, {unnamed} without a name{why}.")
    )
    statements += [Statement(text=text) for text in analysis.force_statements()]
    if analysis.signal.profile is None:
        statements.append(Statement(text=NO_SPEED, level="warning"))
    elif analysis.speed_law is None:
        statements.append(Statement(text=SHORT_SPEED))
    else:
        statements.append(Statement(text=_standstill(analysis.speed_law)))
    return tuple(statements)


def _standstill(law: SpeedLaw) -> str:
    stop = law.standstill
    if stop.status != "determined":
        turned = stop.value if stop.lower is None else stop.lower
        return f"When the rotor stopped is open: {stop.status}. It turned until {turned:.1f} s at least."
    if stop.interval_90 is None:
        return f"The rotor stopped {stop.value:.2f} s after power-off."
    low, high = stop.interval_90
    return f"The rotor stopped {stop.value:.1f} s after power-off (90 %: {low:.1f} to {high:.1f} s)."


def _card(name: str, plane: PlaneAnalysis) -> Card:
    history = plane.history
    figures = [
        KeyFigure(
            label="Largest displacement",
            value=Quantity(value=history.largest, kind="length"),
            note=f"at {Quantity(value=history.largest_time, kind='duration', digits=3).text}",
        ),
        KeyFigure(
            label="Beyond the air gap",
            value=Quantity(value=history.largest_indentation, kind="length", digits=3),
        ),
        KeyFigure(
            label="Largest after 0.2 s", value=Quantity(value=history.largest_later, kind="length", digits=4)
        ),
        KeyFigure(
            label="Last lift-off",
            value=Quantity(value=plane.settling.last_lift_off, kind="duration", digits=3),
        ),
    ]
    return Card(title=f"{name} plane", figures=tuple(figures))


def line_table(analysis: CoastDownAnalysis) -> Table:
    """Every line with frequency or order, amplitude, width, confidence and the reason for its name."""
    rows = []
    for line in analysis.lines:
        rows.append(
            (
                line.label,
                where_of(line),
                Quantity(value=line.amplitude, kind="length", digits=3),
                f"{line.ratio:.0f}",
                "below resolution" if line.width == 0.0 else f"{line.width:.2f} Hz",
                f"{line.first_seen:.0f} to {line.last_seen:.0f} s".replace(" ", NO_BREAK),
                Quantity(value=line.confidence if line.named else np.nan, kind="probability"),
            )
        )
    return Table(
        columns=("name", "where", "amplitude, zero-to-peak", "× floor", "width", "seen", "confidence"),
        rows=tuple(rows),
        caption="Lines found, strongest first",
        note="Amplitudes are those in the direction and plane where they are largest, root mean "
        "square over the time the line was seen. ± is one standard error, never less than what a line "
        "seen that long can be told apart by: one over that time (for an order, one over the turns in it), "
        "divided by √12. X is the order, the multiple of the rotor's speed.",
    )


def where_of(line: Line) -> str:
    """Order or frequency of a line with its error."""
    matches = line.name.matches
    # Where the speed changed too little to tell, the name says which of the two it is.
    an_order = line.kind == "order" or bool(matches and matches[0].candidate.kind == "order")
    if line.order is None or not an_order:
        return with_error(line.frequency, line.frequency_error, "Hz").replace(" ", NO_BREAK)
    return with_error(line.order, line.order_error, "X").replace(" ", NO_BREAK)


def _displacement_section(analysis: CoastDownAnalysis) -> Section:
    role = "measured" if analysis.signal.recorded else "simulated"
    histories = {name: plane.history for name, plane in analysis.planes.items()}
    figure = Figure(
        chart=displacement_history_figure(histories, role),
        caption=f"Distance of the rotor from the bearing centre over the whole coast-down, {role}, with the "
        "air-gap window (Neisi 2020, Fig. 17).",
    )
    return Section(heading="Displacement over the coast-down", figures=(figure,))


def _waterfall_section(analysis: CoastDownAnalysis, against: str, highest: float | None) -> Section:
    figures = []
    shown = highest_shown(analysis) if highest is None else highest
    for name, plane in analysis.planes.items():
        for fall in plane.waterfalls:
            lines = [line for line in analysis.lines if name in line.forward and line.named]
            figures.append(
                Figure(
                    chart=waterfall_figure(fall, name, lines, against=against, highest=shown),
                    caption=f"{name}, {_COMPONENTS[fall.component]}: amplitude {fall.amplitude_kind} of "
                    f"frames of {fall.settings.points} points, Hann window, "
                    f"{100 * fall.settings.overlap:.0f} % overlap, lines "
                    f"{fall.resolution:.3f} Hz apart (Neisi 2020, Fig. 18). A falling speed "
                    "smears the orders here; their true amplitude is below.",
                )
            )
    if not figures:
        short = Statement(text="The signal is shorter than one frame; there is no waterfall.", level="notice")
        return Section(heading="Waterfall", statements=(short,))
    return Section(heading="Waterfall", figures=tuple(figures))


def _line_section(analysis: CoastDownAnalysis) -> Section:
    reasons = tuple(f"{line.label}: {line.reason}." for line in analysis.lines)
    return Section(heading=LINES, text=reasons, tables=(line_table(analysis),))


def _order_section(analysis: CoastDownAnalysis) -> Section:
    figures, rows, crossed = [], [], 0
    for name, plane in analysis.planes.items():
        if plane.track is None:
            continue
        figures.append(
            Figure(
                chart=order_figure(plane.track, name),
                caption=f"{name}: amplitude of the orders, zero-to-peak, tracked in the angle the rotor "
                "really turned through. Gaps: a steady line lies too close to tell it from the order."
                + ("" if analysis.signal.recorded else AS_READ),
            )
        )
        rows += [
            (
                name,
                f"{r.order:g}X",
                f"{r.frequency:.1f} ± {r.frequency_error:.1f} Hz",
                f"{r.speed / (2 * np.pi):.1f} Hz",
                Quantity(value=r.amplitude, kind="length", digits=3),
                f"{r.rise:.1f}",
                r.name.label,
            )
            for r in plane.resonances
            if r.certain
        ]
        crossed += sum(not r.certain for r in plane.resonances)
    table = Table(
        columns=("plane", "order", "excited at", "rotor speed", "amplitude, zero-to-peak", "rise", "mode"),
        rows=tuple(rows),
        caption="Resonances passed on the way down",
    )
    if not rows:
        none = "No order rises above its surroundings on the way down"
        but = f", but where it crosses a steady line ({crossed} times)" if crossed else ""
        left_out = (Statement(text=f"{none}{but}."),)
        return Section(heading="Orders and resonances", statements=left_out, figures=tuple(figures))
    text: tuple[str, ...] = ()
    if crossed:
        words = "a steady line crosses the order there and makes part of them"
        text = (f"{crossed} more rises are left out: {words}.",)
    return Section(heading="Orders and resonances", text=text, figures=tuple(figures), tables=(table,))


def _law_rows(law: SpeedLaw) -> list[tuple[str, ...]]:
    """Time constant, what each drag takes from the speed per second, and standstill, with their intervals."""
    drag, turn = law.drag, 2.0 * np.pi
    speed = drag.initial_speed.value
    at = f"slowing at {speed / turn:.1f} Hz"
    values = (
        ("time constant of the exponential fit", law.exponential.time_constant, 1.0, "s"),
        (f"dry drag (balls and races): {at}", drag.constant, 1.0 / turn, "Hz/s"),
        (f"linear drag: {at}", drag.linear, speed / turn, "Hz/s"),
        (f"quadratic drag: {at}", drag.quadratic, speed**2 / turn, "Hz/s"),
        ("standstill", law.standstill, 1.0, "s"),
    )
    rows: list[tuple[str, ...]] = []
    for label, value, scale, unit in values:
        number, interval = value.value * scale, value.interval_90
        if interval is None:
            rows.append((label, f"{written(number, 2)} {unit}", "–", value.status))
            continue
        low, high = (limit * scale for limit in interval)
        half = max(0.5 * (high - low), 1e-4)
        places = max(0, 1 - int(np.floor(np.log10(half))))
        limits = f"{written(low, places)} to {written(high, places)} {unit}"
        rows.append((label, f"{written(number, places)} {unit}", limits, value.status))
    return rows


def _law_section(analysis: CoastDownAnalysis, law: SpeedLaw) -> Section:
    time, speed = analysis.signal.speed_time, analysis.signal.speed
    assert time is not None and speed is not None
    role = "measured" if analysis.signal.recorded else "simulated"
    figure = Figure(
        chart=speed_law_figure(time, speed, law, role),
        caption="Speed with the exponential fit of the paper and a fit of dry, linear and quadratic drag; "
        "below what each leaves over.",
    )
    table = Table(
        columns=("quantity", "value", "90 % interval", "verdict"),
        rows=tuple(_law_rows(law)),
        caption="Speed law",
    )
    text = (law.exponential.statement, law.drag.statement)
    return Section(heading="Speed law", text=text, figures=(figure,), tables=(table,))
