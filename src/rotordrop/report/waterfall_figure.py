"""Figures of a coast-down: waterfall (Neisi 2020, Fig. 18), displacement (Fig. 17), orders, speed law."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.estimate.bearing_drop import AirGap
from rotordrop.report.style import (
    COLOURS,
    FROM_POWER_OFF,
    INK,
    MICRO,
    SERIES,
    TURN,
    add_gap_limits,
    axis_title,
    curve,
    fit_legend,
    panels,
    plain,
    single,
)
from rotordrop.spectrum.coast_down import SpeedLaw
from rotordrop.spectrum.indentation import DisplacementHistory
from rotordrop.spectrum.lines import Line
from rotordrop.spectrum.orders import OrderTrack
from rotordrop.spectrum.waterfall import Waterfall

if TYPE_CHECKING:
    from rotordrop.spectrum.coast_down import CoastDownAnalysis

MOST_COLUMNS = 900
LOWEST_SHARE = 1e-5
"""Amplitudes below this share of the largest [1], or below the median, take the darkest colour."""
LEAST_DISTANCE = 0.03
"""Distance of two marked lines as a share of the width [1]; of closer ones only the stronger is marked."""
COMPONENT_TITLES = {"x": "horizontal, x", "y": "vertical, y", "full": "full spectrum of x + jy"}
TITLE_SHIFT = 40
"""Room above a waterfall [px] for the frequencies of the lines, below its title."""
DRAWN_ORDERS = (0.5, 1.0, 2.0, 3.0)
"""Multiples of the speed whose course is drawn over a waterfall [1]."""
BEYOND = 1.2
"""How far a waterfall is drawn beyond the last thing in it [1]."""
NEAR = 0.97
"""Share of the air gap at which the enlarged panel begins [1]."""
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
    if against == "speed" and fall.speed is None:
        raise UsageError("a waterfall against speed needs the rotor speed; this signal has none")
    if highest is not None:
        kept = np.abs(fall.frequency) <= highest
        fall = replace(fall, frequency=fall.frequency[kept], amplitude=fall.amplitude[:, kept])
    figure = panels((f"{plane}: {COMPONENT_TITLES[fall.component]}",), height=380)
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
    if factor == 1:
        return fall.frequency, fall.amplitude
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
        figure.add_annotation(
            x=begins,
            y=float(level[first]),
            text=plain(f"{k:g}X".replace("-", "\N{MINUS SIGN}")),
            showarrow=False,
            xanchor="right" if at_edge else "left",
            yanchor="bottom",
            font={"size": 11, "color": WHITE},
        )


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
        figure.add_annotation(
            x=line.frequency,
            y=1.0,
            yref="paper",
            text=plain(f"{line.frequency:.1f}"),
            textangle=-60,
            showarrow=False,
            yanchor="bottom",
            xanchor="left",
            font={"size": 10.5, "color": INK},
        )


def order_figure(track: OrderTrack, plane: str) -> go.Figure:
    """Draw the longest half axis of the orbit of each tracked order, zero-to-peak, against the speed."""
    figure = panels((plane,), height=300)
    for index, order in enumerate(track.orders.tolist()):
        amplitude = np.where(track.separable[:, index], MICRO * track.major_axis[:, index], np.nan)
        colour, hover = SERIES[index % len(SERIES)], "%{x:.2f} Hz: %{y:.3~g} µm"
        curve(figure, track.speed / TURN, amplitude, f"{order:g}X", colour=colour, hover=hover)
    figure.update_xaxes(title_text=axis_title("rotor speed", "Hz"))
    # Without the powers the axis would show "100µ" beside its unit µm.
    figure.update_yaxes(
        title_text=axis_title("amplitude, zero-to-peak", "µm"), type="log", exponentformat="power", dtick=1
    )
    return fit_legend(figure)


def displacement_history_figure(histories: Mapping[str, DisplacementHistory], role: str) -> go.Figure:
    """Draw the distance from the centre over the coast-down, from smallest to largest (Neisi 2020, Fig. 17).

    One row a plane, with the air-gap window and enlarged near the air gap.
    """
    titles = [title for name in histories for title in (name, f"{name}: near the air gap")]
    figure = panels(titles, rows=len(histories), columns=2, height=240, spacing=0.07)
    edge = {"width": 0.6, "color": COLOURS["measured" if role == "measured" else "simulated"]}
    ring = {"color": SERIES[4], "size": 8, "symbol": "circle-open", "line": {"width": 2}}
    for row, history in enumerate(histories.values(), start=1):
        lowest, highest = MICRO * history.lowest, MICRO * history.highest
        for column in (1, 2):
            place: dict[str, Any] = {"row": row, "column": column}
            named = place | {"legend": row == column == 1}
            envelope, hover = f"{role}, smallest to largest", "%{x:.2f} s: up to %{y:.4~g} µm"
            curve(figure, history.time, lowest, hover=None, line=edge, **place)
            curve(figure, history.time, highest, envelope, hover=hover, line=edge, fill="tonexty", **named)
            add_gap_limits(figure, AirGap.of(history.air_gap), **named)
            curve(
                figure,
                [history.largest_time],
                [MICRO * history.largest],
                "largest",
                mode="markers",
                marker=ring,
                hover="%{y:.4~g} µm at %{x:.4f} s",
                **named,
            )
        near = MICRO * np.array([NEAR * history.air_gap, history.largest + (1.0 - NEAR) * history.air_gap])
        figure.update_yaxes(range=near.tolist(), row=row, col=2)
    figure.update_yaxes(title_text=axis_title("displacement", "µm"), rangemode="tozero", col=1)
    figure.update_xaxes(title_text=FROM_POWER_OFF, row=len(histories))
    return fit_legend(figure)


def speed_law_figure(time: Array, speed: Array, law: SpeedLaw, role: str) -> go.Figure:
    """Draw the speed [rad/s] in Hz with the exponential and the drag fit, below what each leaves over."""
    figure = panels(("speed", "residual"), rows=2, columns=1, height=230)
    every = max(1, len(time) // 2000)
    inside = time >= law.exponential.start
    t, fitted_to = time[inside][::every], speed[inside][::every]
    curve(figure, time[::every], speed[::every] / TURN, role, colour=COLOURS["measured"], width=1.1)
    for name, fitted, colour in (
        ("one time constant", law.exponential.speed_at(t), SERIES[1]),
        ("dry, linear and quadratic drag", law.drag.speed_at(t), SERIES[0]),
    ):
        curve(figure, t, fitted / TURN, name, colour=colour, width=1.4)
        curve(figure, t, (fitted_to - fitted) / TURN, name, row=2, colour=colour, width=1.4, legend=False)
    figure.update_yaxes(title_text=axis_title("speed", "Hz"), row=1)
    figure.update_yaxes(title_text=axis_title("residual", "Hz"), row=2)
    figure.update_xaxes(title_text=FROM_POWER_OFF, row=2)
    return fit_legend(figure)
