"""The report on the frequencies of a coast-down, recorded or simulated."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.arrays import Array, ComplexArray
from rotordrop.estimate.bearing_drop import AirGap, History
from rotordrop.evidence.rest import STANDSTILL
from rotordrop.known import NINETY, Known
from rotordrop.report.content import (
    Column,
    Figure,
    ReportContent,
    Section,
    Statement,
    Table,
    table,
    verdict_column,
)
from rotordrop.report.drop_sections import speed_figure
from rotordrop.report.quantity import NO_BREAK, shown, with_error, written
from rotordrop.report.style import (
    COLOURS,
    FROM_POWER_OFF,
    MICRO,
    SERIES,
    TURN,
    add_gap_limits,
    axis_title,
    curve,
    finished,
    panels,
    single,
    square,
    words,
)
from rotordrop.spectrum.coast_down import (
    PAPER_WINDOW,
    RACES_SPUN_UP,
    SENSOR_NOISE,
    SHORTEST_LAW,
    DisplacementHistory,
    SpeedLaw,
)
from rotordrop.spectrum.lines import Line
from rotordrop.spectrum.orders import LEAST_APART, REVOLUTIONS, STEADY_APART, OrderTrack
from rotordrop.spectrum.waterfall import Waterfall

if TYPE_CHECKING:
    from rotordrop.spectrum.coast_down import CoastDownAnalysis

NO_SPEED = (
    "The record has no speed that falls: whether a line follows it stays open, and there are no tracked "
    "orders, no resonances and no speed law. Record the speed, or name its channel in a profile."
)
SHORT_SPEED = (
    f"The speed is known for less than {RACES_SPUN_UP + SHORTEST_LAW:g} s after power-off: too short for a "
    "speed law."
)
AS_READ = f" The simulated motion was given the noise of a usual sensor, {1e6 * SENSOR_NOISE:g} µm rms."
LINES_NOTE = (
    "Amplitudes are those in the direction and plane where they are largest, root mean square over the time "
    "the line was seen. ± is one standard error, never less than one over the time that holds its power, "
    "divided by √12; of an order half a turn over the turns in it, so far may a resonance turn it. "
    "X is the order, the multiple of the rotor's speed."
)
BODE = (
    "Bode plot of 1X and 2X in x and y, zero-to-peak with 90 % intervals. The phase counts from the angle "
    "of the shaft since power-off, by its recorded speed."
)
POLAR = (
    "polar plot of the same vectors; the angle is that of the phase, numbers are shaft speeds [Hz]. Nothing "
    "is taken off for slow roll."
)
NO_LINE = "No line stands out: a short record is too short for one."
SAID = 5
"""Lines that stand in the verdict (chosen)."""


def waterfall_page(
    analysis: CoastDownAnalysis,
    *,
    title: str,
    facts: tuple[tuple[str, str], ...] = (),
    simulated: str = "",
    against: str = "time",
    drawn: bool = True,
) -> ReportContent:
    """Build the report on the frequencies of a coast-down, with its sections where they are wanted.

    Waterfalls go upwards with the time or the speed (``against``), as far as anything happens.
    """
    return ReportContent(
        title=title,
        subtitle="times count from power-off",
        simulated=simulated,
        verdict=_verdict(analysis),
        facts=facts,
        sections=frequency_sections(analysis, against) if drawn else (),
    )


def frequency_sections(analysis: CoastDownAnalysis, against: str = "time") -> tuple[Section, ...]:
    """Displacement, waterfalls, lines, orders with the resonances they pass, and the speed law."""
    role = "measured" if analysis.signal.recorded else "simulated"
    histories = {name: plane.history for name, plane in analysis.planes.items()}
    displacement = Figure(
        displacement_history_figure(histories, role),
        f"Distance of the rotor from the bearing centre over the whole coast-down, {role}, with the "
        "air-gap window (Neisi 2020, Fig. 17).",
    )
    lines = analysis.lines
    reasons = tuple(f"{line.label}: {line.reason}." for line in lines if line.named)
    tracked = any(plane.track is not None for plane in analysis.planes.values())
    return (
        Section("Displacement over the coast-down", figures=(displacement,)),
        _waterfall_section(analysis, against),
        Section("Lines", reasons if lines else (NO_LINE,), tables=(line_table(analysis),) if lines else ()),
        *((_order_section(analysis),) if tracked else ()),
        *(() if analysis.speed_law is None else (_law_section(analysis, analysis.speed_law),)),
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
            f"{said}{shown(last, 'speed')}: it ends before standstill, and nothing is known below.",
            "warning",
        ),
    )


def _verdict(analysis: CoastDownAnalysis) -> tuple[Statement, ...]:
    histories = {name: plane.history for name, plane in analysis.planes.items()}
    clear = [name for name, history in histories.items() if history.held_clearly]
    said: list[Statement] = []
    if clear:
        text = f"The first {PAPER_WINDOW:g} s held the largest displacement at {' and '.join(clear)}."
        said.append(Statement(text, "good"))
    for name, history in histories.items():
        if name not in clear:
            held = history.held_maximum
            said.append(Statement(f"{name}: {history.statement}", "good" if held else "warning"))
    said += _covered(analysis)
    lines = analysis.lines
    largest = ", ".join(
        f"{line.label if line.named else 'no name'} {where_of(line)} ({shown(line.amplitude, 'length', 3)})"
        for line in lines[:SAID]
    )
    count = f"{len(lines)} line{'s' * (len(lines) > 1)}, {sum(line.named for line in lines)} named"
    said.append(Statement(f"{count}; the strongest: {largest}." if lines else NO_LINE))
    if analysis.signal.profile is None:
        said.append(Statement(NO_SPEED, "warning"))
    else:
        law = analysis.speed_law
        said.append(Statement(SHORT_SPEED if law is None else _standstill(law.standstill)))
    return tuple(said)


def _standstill(stop: Known) -> str:
    if stop.status != "determined":
        turned = stop.value if stop.lower is None else stop.lower
        return f"When the rotor stopped is open: {stop.status}. It turned until {turned:.1f} s at least."
    if stop.interval_90 is None:
        return f"The rotor stopped {stop.value:.2f} s after power-off."
    return (
        f"The rotor stopped {stop.value:.1f} s after power-off (90 %: {stop.low:.1f} to {stop.high:.1f} s)."
    )


def line_table(analysis: CoastDownAnalysis) -> Table:
    """Every line with frequency or order, amplitude, width and confidence."""

    def seen(line: Line) -> str:
        return f"{line.first_seen:.3g} to {line.last_seen:.3g} s".replace(" ", NO_BREAK)

    columns = (
        Column("name", "label"),
        Column("where", where_of),
        Column("amplitude, zero-to-peak", "amplitude", "length", 3),
        Column("× floor", lambda line: f"{line.ratio:.0f}"),
        Column("width", lambda line: f"{line.width:.2f} Hz" if line.width else "below resolution"),
        Column("seen", seen),
        Column("confidence of the name", lambda line: line.confidence if line.named else None, "probability"),
    )
    return table(analysis.lines, columns, "Lines found, strongest first", LINES_NOTE)


def where_of(line: Line) -> str:
    """Order or frequency of a line with its error; from where to where one moves that is a sum of both."""
    if line.kind == "combination":
        first, *_, last = line.path.frequency
        return f"{first:.0f} to {last:.0f} Hz".replace(" ", NO_BREAK)
    matches = line.matches
    # Where the speed changed too little to tell, the name says which of the two it is.
    an_order = line.kind == "order" or bool(matches and matches[0].candidate.kind == "order")
    if line.order is None or not an_order:
        return with_error(line.frequency, line.frequency_error, "Hz").replace(" ", NO_BREAK)
    return with_error(line.order, line.order_error, "X").replace(" ", NO_BREAK)


def _waterfall_section(analysis: CoastDownAnalysis, against: str) -> Section:
    figures, top = [], highest_shown(analysis)
    for name, plane in analysis.planes.items():
        lines = [line for line in analysis.lines if name in line.forward and line.named]
        for fall in plane.waterfalls:
            caption = (
                f"{name}, {COMPONENTS[fall.component]}: amplitude {fall.amplitude_kind} of frames of "
                f"{fall.points} points, Hann window, {100 * fall.overlap:.0f} % overlap, "
                f"lines {fall.resolution:.3f} Hz apart (Neisi 2020, Fig. 18). A falling speed smears the "
                "orders here; their true amplitude is below."
            )
            chart = waterfall_figure(fall, name, lines, against=against, highest=top)
            figures.append(Figure(chart, caption))
    text = () if figures else ("The signal is shorter than one frame.",)
    return Section("Waterfall", text, figures=tuple(figures))


def _order_section(analysis: CoastDownAnalysis) -> Section:
    tracks = {name: plane.track for name, plane in analysis.planes.items() if plane.track is not None}
    figures = []
    for name, track in tracks.items():
        caption = (
            f"{name}: amplitude of the orders, zero-to-peak, tracked in the angle the rotor really turned "
            f"through, over windows of {track.revolutions:g} turns. Gaps: a steady line lies too close to "
            "tell it from the order."
        )
        recorded = analysis.signal.recorded
        figures.append(Figure(order_figure(track, name), caption + ("" if recorded else AS_READ)))
        if recorded and vectors_of(track):
            figures.append(Figure(bode_figure(track, name), f"{name}: {BODE}"))
            figures.append(Figure(polar_figure(track, name), f"{name}: {POLAR}"))
    found = [(name, resonance) for name in tracks for resonance in analysis.planes[name].resonances]
    rows = [row for row in found if row[1].certain]
    said = list(_short(next(iter(tracks.values()))))
    if crossed := len(found) - len(rows):
        text = f"{crossed} rises are left out: a steady line crosses the order there and makes part of them."
        said.append(Statement(text))
    if not rows:
        said.append(Statement("No order rises above its surroundings on the way down."))
    columns = (
        Column("plane", lambda row: row[0]),
        Column("order", lambda row: f"{row[1].order:g}X"),
        Column("excited at", lambda row: f"{row[1].frequency:.1f} ± {row[1].frequency_error:.1f} Hz"),
        Column("rotor speed", lambda row: f"{row[1].speed / TURN:.1f} Hz"),
        Column("amplitude, zero-to-peak", lambda row: row[1].amplitude, "length", 3),
        Column("rise", lambda row: f"{row[1].rise:.1f}"),
        Column("mode", lambda row: row[1].name.label),
    )
    passed = (table(rows, columns, "Resonances passed on the way down"),) if rows else ()
    return Section("Orders and resonances", (), tuple(said), tuple(figures), passed)


def _short(track: OrderTrack) -> tuple[Statement, ...]:
    """What the orders of a short signal cannot tell."""
    if track.revolutions >= REVOLUTIONS:
        return ()
    close, steady = (turns / track.revolutions for turns in (LEAST_APART, STEADY_APART))
    have = ", ".join(f"{order:g}X" for order in track.orders)
    return (
        Statement(
            f"The signal is short: orders ({have}) are tracked over {track.revolutions:.3g} turns in place "
            f"of {REVOLUTIONS:g}. Two orders less than {close:.2g}X apart, and an "
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

    def value(row: tuple[str, Known, float, str]) -> str:
        _, known, scale, unit = row
        if known.interval_90 is None:
            return f"{written(scale * known.value, 2)} {unit}"
        places = max(0, 1 - math.floor(math.log10(max(0.5 * scale * (known.high - known.low), 1e-4))))
        number, low, high = (written(scale * end, places) for end in (known.value, known.low, known.high))
        return f"{number} ({low} to {high}) {unit}"

    columns = (
        Column("quantity", lambda row: row[0]),
        Column("value (90 %)", value),
        verdict_column(lambda row: row[1].status),
    )
    return table(rows, columns, "Speed law")


def _law_section(analysis: CoastDownAnalysis, law: SpeedLaw) -> Section:
    time, speed = analysis.signal.speed_time, analysis.signal.speed
    assert time is not None and speed is not None
    fitted = time[time >= law.exponential.start]
    one, drag = law.exponential.speed_at(fitted), law.drag.speed_at(fitted)
    histories = (
        History(label="as it was", time=time, values=speed, role="measured"),
        History(label="one time constant", time=fitted, values=one, role="cross-check"),
        History(label="dry, linear and quadratic drag", time=fitted, values=drag, role="estimated"),
    )
    caption = "Speed with the exponential fit of the paper and a fit of dry, linear and quadratic drag."
    text = (law.exponential.statement, law.drag.statement)
    figure = Figure(speed_figure(histories), caption)
    return Section("Speed law", text, figures=(figure,), tables=(law_table(law),))


MOST_COLUMNS = 900
LOWEST_SHARE = 1e-5
"""Amplitudes below this share of the largest [1], or below the median, take the darkest colour."""
LEAST_DISTANCE = 0.03
"""Distance of two marked lines as a share of the width [1]; of closer ones only the stronger is marked."""
COMPONENTS = {
    "x": "horizontal, x",
    "y": "vertical, y",
    "full": "full spectrum of x + jy, forward to the right, backward to the left",
}
TITLE_SHIFT = 40
"""Room above a waterfall [px] for the frequencies of the lines, below its title."""
DRAWN_ORDERS = (0.5, 1.0, 2.0, 3.0)
"""Multiples of the speed whose course is drawn over a waterfall [1]."""
VECTORS = (1.0, 2.0)
"""Orders that are drawn as vectors [1]: unbalance and bow, misalignment and stiffness that turns."""
MARKED = 7
"""Speeds that are named along a polar plot, about [1]; chosen, not measured."""
BEYOND = 1.2
"""How far a waterfall is drawn beyond the last thing in it [1]."""
WHITE = "#fff"
"""On a map, whose colours are the same on dark paper."""


def highest_shown(analysis: CoastDownAnalysis) -> float:
    """Highest frequency worth drawing [Hz]: a little beyond the lines found, and beyond twice the speed."""
    falls = [fall for plane in analysis.planes.values() for fall in plane.waterfalls]
    reached = [float(np.max(line.path.frequency)) for line in analysis.lines]
    reached += [2.0 * float(np.max(fall.speed)) / TURN for fall in falls if fall.speed is not None]
    most = max((float(fall.frequency[-1]) for fall in falls), default=math.inf)
    return min(BEYOND * max(reached, default=most), most)


def waterfall_figure(
    fall: Waterfall,
    plane: str,
    lines: Sequence[Line] = (),
    *,
    against: str = "time",
    highest: float | None = None,
) -> go.Figure:
    """Draw a waterfall as a map: frequency to the right, time or speed upwards, amplitude as colour.

    Named steady lines are marked above the map. Amplitudes are in µm; the colour bar says whether
    zero-to-peak or peak-to-peak.
    """
    if highest is not None:
        kept = np.abs(fall.frequency) <= highest
        fall = replace(fall, frequency=fall.frequency[kept], amplitude=fall.amplitude[:, kept])
    figure = panels((f"{plane}: {COMPONENTS[fall.component]}",), height=380)
    frequency, amplitude = _thinned(fall)
    order = np.arange(len(fall.time))
    if against == "speed" and fall.speed is not None:
        order = np.argsort(fall.speed)
        level, title = fall.speed[order] / TURN, axis_title("rotor speed", "Hz")
    else:
        level, title = fall.time, FROM_POWER_OFF
    floor = max(float(np.median(amplitude)), LOWEST_SHARE * float(np.max(amplitude)))
    drawn = np.log10(MICRO * np.maximum(amplitude[order], floor))
    ticks = list(range(math.ceil(float(np.min(drawn))), math.floor(float(np.max(drawn))) + 1))
    heading = f"amplitude, {fall.amplitude_kind} [µm]"
    figure.add_trace(
        go.Heatmap(
            x=single(frequency),
            y=single(level),
            z=single(drawn),
            customdata=single(MICRO * amplitude[order]),
            colorscale="Viridis",
            colorbar={
                "title": {"text": heading, "side": "right", "font": {"size": 12.5}},
                "tickvals": ticks,
                "ticktext": [f"{10.0**tick:g}" for tick in ticks],
                "thickness": 14,
            },
            hovertemplate="%{x:.1f} Hz, %{y:.4~g}: %{customdata:.3~g} µm "
            + fall.amplitude_kind
            + "<extra></extra>",
        )
    )
    _mark_lines(figure, fall, lines)
    _mark_orders(figure, fall, level, order)
    sense = ", negative: backward" if fall.component == "full" else ""
    figure.update_xaxes(title_text=axis_title("frequency", "Hz") + sense)
    figure.update_yaxes(title_text=title)
    return figure


def _thinned(fall: Waterfall) -> tuple[Array, Array]:
    """Frequencies and amplitudes with the largest of neighbouring lines kept, as many as can be seen."""
    factor = max(1, math.ceil(fall.frequency.size / MOST_COLUMNS))
    whole = fall.frequency.size // factor * factor
    blocks = fall.amplitude[:, :whole].reshape(len(fall.time), -1, factor)
    middle = fall.frequency[:whole].reshape(-1, factor).mean(axis=1)
    return np.asarray(middle), np.asarray(blocks.max(axis=2))


def _mark_orders(figure: go.Figure, fall: Waterfall, level: Array, rows: NDArray[np.intp]) -> None:
    """Draw where the multiples of the speed are, and name them where they begin."""
    if fall.speed is None:
        return
    turning = fall.speed[rows] / TURN
    for k in [*(-k for k in DRAWN_ORDERS if fall.component == "full"), *DRAWN_ORDERS]:
        inside = (k * turning >= fall.frequency[0]) & (k * turning <= fall.frequency[-1])
        if not inside.any():
            continue
        at, up = k * turning[inside], level[inside]
        curve(figure, at, up, colour=WHITE, width=1.0, dash="dash", hover=None)
        first = int(np.flatnonzero(inside)[np.argmax(turning[inside])])
        begins = float(k * turning[first])
        at_edge = fall.frequency[-1] - begins < LEAST_DISTANCE * (fall.frequency[-1] - fall.frequency[0])
        beside: dict[str, Any] = {"xanchor": "right" if at_edge else "left", "yanchor": "bottom"}
        name = f"{k:g}X".replace("-", "\N{MINUS SIGN}")
        words(figure, begins, float(level[first]), name, colour=WHITE, **beside)


def _mark_lines(figure: go.Figure, fall: Waterfall, lines: Sequence[Line]) -> None:
    lowest, highest = float(fall.frequency[0]), float(fall.frequency[-1])
    figure.update_annotations(yshift=TITLE_SHIFT)
    figure.update_layout(
        margin_t=figure.layout.margin.t + TITLE_SHIFT, height=figure.layout.height + TITLE_SHIFT
    )
    marked: list[float] = []
    for line in sorted(lines, key=lambda line: -line.amplitude):
        if line.kind != "steady" or not lowest <= line.frequency <= highest:
            continue
        if any(abs(line.frequency - other) < LEAST_DISTANCE * (highest - lowest) for other in marked):
            continue
        marked.append(line.frequency)
        dots = {"color": WHITE, "width": 0.8, "dash": "dot"}
        figure.add_vline(x=line.frequency, line=dots, opacity=0.6)
        above: dict[str, Any] = {"yref": "y domain", "yanchor": "bottom", "xanchor": "left"}
        words(figure, line.frequency, 1.0, f"{line.frequency:.1f}", size=10.5, textangle=-60, **above)


def order_figure(track: OrderTrack, plane: str) -> go.Figure:
    """Draw the longest half axis of the orbit of each tracked order, zero-to-peak, against the speed."""
    figure = panels((plane,), height=300)
    for index, order in enumerate(track.orders.tolist()):
        amplitude = np.where(track.separable[:, index], MICRO * track.major_axis[:, index], np.nan)
        colour, hover = SERIES[index % len(SERIES)], "%{x:.2f} Hz: %{y:.3~g} µm"
        curve(figure, track.speed / TURN, amplitude, f"{order:g}X", colour=colour, hover=hover)
    # Without the powers the axis would show "100µ" beside its unit µm.
    figure.update_yaxes(type="log", exponentformat="power", dtick=1)
    return finished(figure, "rotor speed [Hz]", "amplitude, zero-to-peak [µm]")


def vectors_of(track: OrderTrack) -> dict[float, tuple[ComplexArray, Array]]:
    """Vectors (x, y) of 1X and 2X with their standard errors [m], shapes (F, 2), by order, where tracked.

    Where a steady line lies too close to an order the vector would hold both: it is not a number there.
    """
    found = {}
    for order in VECTORS:
        if np.isclose(track.orders, order).any():
            k = track.of(order)
            vector = np.where(track.separable[:, k, None], track.amplitude[:, k], np.nan)
            found[order] = (vector, track.standard_error[:, k])
    return found


def bode_figure(track: OrderTrack, plane: str) -> go.Figure:
    """Draw amplitude with its 90 % intervals, and phase, of 1X and 2X in x and y against the speed."""
    vectors = vectors_of(track)
    titles = [f"{plane}: {order:g}X" for order in vectors]
    figure = panels([*titles, *("" for _ in titles)], rows=2, columns=len(vectors), height=220)
    for column, (vector, error) in enumerate(vectors.values(), start=1):
        for axis, colour in enumerate(SERIES[:2]):
            amplitude, half = MICRO * np.abs(vector[:, axis]), MICRO * NINETY * error[:, axis]
            place: dict[str, Any] = {"column": column, "colour": colour}
            name: dict[str, Any] = {"name": "xy"[axis], "width": 1.8}
            band = {"array": half, "arrayminus": np.minimum(half, amplitude), "thickness": 0.5, "width": 0}
            curve(
                figure,
                track.speed / TURN,
                amplitude,
                error_y=band,
                hover="%{x:.2f} Hz: %{y:.3~g} µm",
                legend=column == 1,
                **name,
                **place,
            )
            phase = np.degrees(np.angle(vector[:, axis]))
            turned = np.flatnonzero(np.abs(np.diff(phase)) > 180.0) + 1  # no line across the picture
            at, phase = np.insert(track.speed / TURN, turned, np.nan), np.insert(phase, turned, np.nan)
            curve(
                figure, at, phase, hover="%{x:.2f} Hz: %{y:.0f}°", row=2, **name | {"legend": False}, **place
            )
    figure.update_yaxes(title_text="amplitude, zero-to-peak [µm]", rangemode="tozero", row=1, col=1)
    figure.update_yaxes(range=[-180, 180], dtick=90, row=2)
    figure.update_yaxes(title_text="phase [°]", row=2, col=1)
    return finished(figure, "rotor speed [Hz]", row=2)


def polar_figure(track: OrderTrack, plane: str) -> go.Figure:
    """Draw the ends of the vectors of 1X and 2X in x and y, with the speed [Hz] beside some of them."""
    vectors = vectors_of(track)
    figure = panels([f"{plane}: {order:g}X" for order in vectors], height=380, spacing=0.12)
    for column, (vector, _) in enumerate(vectors.values(), start=1):
        for axis, colour in enumerate(SERIES[:2]):
            ends, speed = MICRO * vector[:, axis], track.speed / TURN
            words = [""] * len(ends)
            known = np.flatnonzero(np.isfinite(ends))
            levels = np.linspace(speed[known].max(), speed[known].min(), MARKED) if known.size else ()
            for level in levels:
                at = known[np.abs(speed[known] - level).argmin()]
                words[at] = f"{speed[at]:.0f}"
            curve(
                figure,
                ends.real,
                ends.imag,
                "xy"[axis],
                column=column,
                colour=colour,
                mode="lines+markers+text",
                marker={"size": [6 if word else 0 for word in words], "color": colour},
                text=words,
                textposition="top right",
                textfont={"size": 11, "color": colour},
                customdata=single(speed),
                hover="%{customdata:.2f} Hz: %{x:.3~g}, %{y:.3~g} µm",
                legend=column == 1,
            )
        square(figure, column, 1.15 * MICRO * float(np.nanmax(np.abs(vector), initial=1e-9)))
    return finished(figure, "real part [µm]", "imaginary part [µm]")


def displacement_history_figure(histories: Mapping[str, DisplacementHistory], role: str) -> go.Figure:
    """Draw the distance from the centre over the coast-down, from smallest to largest (Neisi 2020, Fig. 17).

    One row a plane, with the air-gap window.
    """
    figure = panels(list(histories), rows=len(histories), columns=1, height=240)
    edge = {"width": 0.6, "color": COLOURS["measured" if role == "measured" else "simulated"]}
    ring = {"color": SERIES[4], "size": 8, "symbol": "circle-open", "line": {"width": 2}}
    for row, history in enumerate(histories.values(), start=1):
        lowest, highest = MICRO * history.lowest, MICRO * history.highest
        named: dict[str, Any] = {"row": row, "legend": row == 1}
        envelope, hover = f"{role}, smallest to largest", "%{x:.2f} s: up to %{y:.4~g} µm"
        curve(figure, history.time, lowest, hover=None, line=edge, row=row)
        curve(figure, history.time, highest, envelope, hover=hover, line=edge, fill="tonexty", **named)
        add_gap_limits(figure, AirGap.of(history.air_gap), **named)
        largest = ([history.largest_time], [MICRO * history.largest])
        hover = "%{y:.4~g} µm at %{x:.4f} s"
        curve(figure, *largest, "largest", mode="markers", marker=ring, hover=hover, **named)
    return finished(figure, FROM_POWER_OFF, "displacement [µm]", row=len(histories))
