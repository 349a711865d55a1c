"""Waterfall: amplitude over frequency against time or speed (Neisi 2020, Fig. 18), and the tracked orders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.errors import UsageError
from rotordrop.report.style import INK, MICRO, SERIES, axis_title, fit_legend, panels, plain, single
from rotordrop.spectrum.lines import Line
from rotordrop.spectrum.orders import OrderTrack
from rotordrop.spectrum.waterfall import Waterfall

if TYPE_CHECKING:
    from rotordrop.spectrum.coast_down import CoastDownAnalysis

Array = NDArray[np.float64]

MOST_COLUMNS = 900
LOWEST_SHARE = 1e-5
"""Amplitudes below this share of the largest [1], or below the median, take the darkest colour."""
LEAST_DISTANCE = 0.03
"""Distance of two marked lines as a share of the width [1]; of closer ones only the stronger is marked."""
COMPONENT_TITLES = {"x": "horizontal, x", "y": "vertical, y", "full": "full spectrum of x + jy"}
TURN = 2.0 * math.pi

TITLE_SHIFT = 40
"""Room above a waterfall [px] for the frequencies of the lines, below its title."""


DRAWN_ORDERS = (0.5, 1.0, 2.0, 3.0)
"""Multiples of the speed whose course is drawn over a waterfall [1]."""
BEYOND = 1.2
"""How far a waterfall is drawn beyond the last thing in it [1]."""


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

    Parameters
    ----------
    fall : Waterfall
        The amplitudes.
    plane : str
        Name of the plane, for the title.
    lines : sequence of Line
        Named steady lines to be marked above the map.
    against : {"time", "speed"}
        What goes upwards.
    highest : float, optional
        Highest frequency drawn [Hz].

    Returns
    -------
    Figure
        Amplitudes in µm; the colour bar says whether zero-to-peak or peak-to-peak.
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
        level, title = fall.time, axis_title("time from power-off", "s")
    floor = max(float(np.median(amplitude)), LOWEST_SHARE * float(np.max(amplitude)))
    shown = np.log10(MICRO * np.maximum(amplitude[order], floor))
    figure.add_trace(
        go.Heatmap(
            x=single(frequency),
            y=single(level),
            z=single(shown),
            customdata=single(MICRO * amplitude[order]),
            colorscale="Viridis",
            colorbar=_colour_bar(shown, fall.amplitude_kind),
            hovertemplate=(
                "%{x:.1f} Hz, %{y:.4~g}: %{customdata:.3~g} µm " + fall.amplitude_kind + "<extra></extra>"
            ),
        )
    )
    _mark_lines(figure, fall, lines)
    _mark_orders(figure, fall, level, order)
    sense = ", negative: backward" if fall.component == "full" else ""
    figure.update_xaxes(title_text=axis_title("frequency", "Hz") + sense)
    figure.update_yaxes(title_text=title)
    return figure


def order_figure(track: OrderTrack, plane: str) -> go.Figure:
    """Draw the amplitude of every tracked order against the rotor speed.

    Parameters
    ----------
    track : OrderTrack
        Amplitudes that a falling speed does not smear.
    plane : str
        Name of the plane.

    Returns
    -------
    Figure
        Longest half axis of the orbit of each order, zero-to-peak, in µm.
    """
    figure = panels((plane,), height=300)
    for index, order in enumerate(track.orders.tolist()):
        clear = track.separable[:, index]
        figure.add_trace(
            go.Scatter(
                x=single(track.speed / TURN),
                y=single(np.where(clear, MICRO * track.major_axis[:, index], np.nan)),
                mode="lines",
                name=f"{order:g}X",
                line={"color": SERIES[index % len(SERIES)], "width": 1.5},
                hovertemplate=f"%{{x:.2f}} Hz: %{{y:.3~g}} µm<extra>{order:g}X</extra>",
            )
        )
    figure.update_xaxes(title_text=axis_title("rotor speed", "Hz"))
    # Without the powers the axis would show "100µ" beside its unit µm.
    figure.update_yaxes(
        title_text=axis_title("amplitude, zero-to-peak", "µm"), type="log", exponentformat="power", dtick=1
    )
    return fit_legend(figure)


def _thinned(fall: Waterfall) -> tuple[Array, Array]:
    """Frequencies and amplitudes with the largest of neighbouring lines kept, as many as can be seen."""
    count = fall.frequency.size
    factor = max(1, math.ceil(count / MOST_COLUMNS))
    if factor == 1:
        return fall.frequency, fall.amplitude
    whole = count // factor * factor
    blocks = fall.amplitude[:, :whole].reshape(len(fall.time), -1, factor)
    middle = fall.frequency[:whole].reshape(-1, factor).mean(axis=1)
    return np.asarray(middle), np.asarray(blocks.max(axis=2))


def _colour_bar(shown: Array, kind: str) -> dict[str, object]:
    low, high = math.ceil(float(np.min(shown))), math.floor(float(np.max(shown)))
    ticks = list(range(low, high + 1))
    return {
        "title": {"text": f"amplitude, {kind} [µm]", "side": "right", "font": {"size": 12.5}},
        "tickvals": ticks,
        "ticktext": [f"{10.0**tick:g}" for tick in ticks],
        "thickness": 14,
    }


def _mark_orders(figure: go.Figure, fall: Waterfall, level: Array, rows: NDArray[np.intp]) -> None:
    """Draw where the multiples of the speed are, and name them where they begin."""
    if fall.speed is None:
        return
    turning = fall.speed[rows] / TURN
    for k in [*(-k for k in DRAWN_ORDERS if fall.component == "full"), *DRAWN_ORDERS]:
        inside = (k * turning >= fall.frequency[0]) & (k * turning <= fall.frequency[-1])
        if not inside.any():
            continue
        figure.add_trace(
            go.Scatter(
                x=single(k * turning[inside]),
                y=single(level[inside]),
                mode="lines",
                line={"color": "#ffffff", "width": 1.0, "dash": "dash"},
                showlegend=False,
                hoverinfo="skip",
            )
        )
        first = int(np.flatnonzero(inside)[np.argmax(turning[inside])])
        figure.add_annotation(
            x=float(k * turning[first]),
            y=float(level[first]),
            text=plain(f"{k:g}X".replace("-", "\N{MINUS SIGN}")),
            showarrow=False,
            xanchor="left",
            yanchor="bottom",
            font={"size": 11, "color": "#ffffff"},
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
        figure.add_vline(
            x=line.frequency, line={"color": "#ffffff", "width": 0.8, "dash": "dot"}, opacity=0.6
        )
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
