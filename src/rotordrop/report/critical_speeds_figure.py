"""Critical speed map (Neisi 2020, Fig. 19), Campbell diagrams and mode shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.report.style import (
    INK,
    LIMIT,
    LOG_LABELS,
    MUTED,
    SERIES,
    axis_title,
    fit_legend,
    panels,
    plain,
    single,
)
from rotordrop.rotor.campbell import CampbellDiagram, StabilityMap
from rotordrop.rotor.critical_speeds import CriticalSpeedMap

Array = NDArray[np.float64]
TURN = 2.0 * math.pi
MM = 1e3
DIRECTIONS = {"forward": SERIES[0], "backward": SERIES[1], "mixed": SERIES[2]}
_DASHES = {"tangent": "solid", "simple": "dash"}
_EQUAL = 0.005


def critical_speed_figure(found: CriticalSpeedMap) -> go.Figure:
    """Draw natural frequencies against the equivalent stiffness of the supports (Neisi 2020, Fig. 19).

    Parameters
    ----------
    found : CriticalSpeedMap
        The map, with the machine's own stiffness of every bearing.

    Returns
    -------
    Figure
        Without mass of the supports as in the paper, and with it; vertical lines at the machine's equivalent
        stiffness by the tangent and by the simple formula.
    """
    titles = ("supports without mass, as in the paper", "with the mass of the supports")
    figure = panels(titles, height=430, spacing=0.06)
    for column, frequencies in enumerate((found.massless, found.with_support_mass), start=1):
        for k in range(frequencies.shape[1]):
            figure.add_trace(
                go.Scatter(
                    x=single(found.stiffness),
                    y=single(frequencies[:, k]),
                    mode="lines",
                    line={"color": SERIES[k % len(SERIES)], "width": 1.6},
                    name=f"line {k + 1}",
                    showlegend=False,
                    hovertemplate="%{x:.3~g} N/m: %{y:.1f} Hz<extra>" + f"line {k + 1}</extra>",
                ),
                row=1,
                col=column,
            )
        _add_stiffness_lines(figure, found, column)
    figure.update_xaxes(
        title_text=axis_title("equivalent stiffness", "N/m"), type="log", exponentformat="power", dtick=1
    )
    figure.update_yaxes(type="log", range=[1.0, math.log10(1000.0)], **LOG_LABELS)
    what = "natural frequency" if found.whirl == "standstill" else "critical speed"
    figure.update_yaxes(title_text=axis_title(what, "Hz"), col=1)
    return fit_legend(figure)


def _add_stiffness_lines(figure: go.Figure, found: CriticalSpeedMap, column: int) -> None:
    for index, part in enumerate(found.lines):
        colour = (INK, "#b3261e")[index % 2]
        for formula, dash in _DASHES.items():
            stiffness = part.equivalent(formula)
            figure.add_trace(
                go.Scatter(
                    x=[stiffness, stiffness],
                    y=[10.0, 1000.0],
                    mode="lines",
                    line={"color": colour, "width": 1.3, "dash": dash},
                    name=plain(f"{part.bearing}, {formula}"),
                    legendgroup=f"{index} {formula}",
                    showlegend=column == 1,
                    hovertemplate=plain(f"{part.bearing}, {formula}: {stiffness:.3g} N/m")
                    + "<extra></extra>",
                ),
                row=1,
                col=column,
            )


def campbell_figure(diagram: CampbellDiagram, highest: float, nominal: float | None = None) -> go.Figure:
    """Draw damped frequencies and damping ratios against the rotor speed.

    Parameters
    ----------
    diagram : CampbellDiagram
        Lines that keep their shape from speed to speed.
    highest : float
        Highest frequency drawn [Hz].
    nominal : float, optional
        Nominal speed, for an upright line [rad/s].

    Returns
    -------
    Figure
        Frequencies left with the line of the rotor's own speed, damping ratios right; colour is direction.
    """
    figure = panels(("damped frequencies", "damping ratios"), height=360, spacing=0.1)
    speed = diagram.speed / TURN
    shown: set[str] = set()
    for k in range(diagram.frequency.shape[1]):
        if not np.any(np.isfinite(diagram.whirl[:, k])):
            continue
        direction = diagram.direction(k)
        line = {"color": DIRECTIONS[direction], "width": 1.5}
        for column, values in ((1, diagram.frequency[:, k]), (2, 100.0 * diagram.damping_ratio[:, k])):
            hidden = values > highest if column == 1 else diagram.frequency[:, k] > highest
            figure.add_trace(
                go.Scatter(
                    x=single(speed),
                    y=single(np.where(hidden, np.nan, values)),
                    mode="lines",
                    line=line,
                    name=direction,
                    legendgroup=direction,
                    showlegend=column == 1 and direction not in shown,
                    hovertemplate="%{x:.1f} Hz: %{y:.4~g}<extra>" + direction + "</extra>",
                ),
                row=1,
                col=column,
            )
        shown.add(direction)
    _add_own_speed(figure, diagram, highest)
    if nominal is not None:
        for column in (1, 2):
            line = {"color": LIMIT, "width": 1.2, "dash": "dash"}
            figure.add_vline(x=nominal / TURN, line=line, row=1, col=column)
    figure.update_xaxes(title_text=axis_title("rotor speed, × 60 in rpm", "Hz"))
    figure.update_yaxes(title_text=axis_title("frequency", "Hz"), range=[0.0, highest], col=1)
    figure.update_yaxes(title_text=axis_title("damping ratio", "%"), rangemode="tozero", col=2)
    return fit_legend(figure)


def _add_own_speed(figure: go.Figure, diagram: CampbellDiagram, highest: float) -> None:
    top = min(highest, float(diagram.speed[-1]) / TURN)
    own = {"color": MUTED, "width": 1.0, "dash": "dash"}
    figure.add_trace(
        go.Scatter(x=[0.0, top], y=[0.0, top], mode="lines", line=own, name="1X", hoverinfo="skip"),
        row=1,
        col=1,
    )
    crossings = [crossing for crossing in diagram.crossings if crossing.speed / TURN <= highest]
    if crossings:
        at = [crossing.speed / TURN for crossing in crossings]
        figure.add_trace(
            go.Scatter(
                x=at,
                y=at,
                mode="markers",
                marker={"color": INK, "size": 7, "symbol": "circle-open", "line": {"width": 1.8}},
                name="critical speed",
                hovertemplate="critical speed: %{x:.1f} Hz<extra></extra>",
            ),
            row=1,
            col=1,
        )


def stability_figure(found: Sequence[StabilityMap]) -> go.Figure:
    """Draw the least logarithmic decrement against cross-coupled stiffness, a line for each suspension."""
    figure = panels(("least logarithmic decrement of the lowest modes",), height=320)
    for k, one in enumerate(found):
        figure.add_trace(
            go.Scatter(
                x=single(1e-6 * one.coupling),
                y=single(one.decrement),
                mode="lines",
                line={"color": SERIES[k], "width": 1.5},
                name=one.suspension,
                hovertemplate="%{x:.4~g} N/µm: %{y:.3~g}<extra>" + plain(one.suspension) + "</extra>",
            )
        )
    figure.add_hline(y=0.0, line={"color": LIMIT, "width": 1.2, "dash": "dash"})
    figure.update_xaxes(title_text=axis_title("cross-coupled stiffness in mid-span", "N/µm"))
    figure.update_yaxes(title_text=axis_title("logarithmic decrement", ""))
    return fit_legend(figure)


def mode_shape_figure(
    diagram: CampbellDiagram, bearings: Sequence[tuple[str, float]], count: int
) -> go.Figure:
    """Draw the shapes of the lowest modes at the lowest speed, as the largest deflection along the rotor.

    Parameters
    ----------
    diagram : CampbellDiagram
        Modes with their shapes.
    bearings : sequence of (str, float)
        Touchdown bearings and their positions [m].
    count : int
        Number of shapes; of two of one frequency only the first is drawn.

    Returns
    -------
    Figure
        Deflection in the plane of its largest value, without unit (largest 1), against the position in mm.
    """
    figure = panels(("",), height=320)
    z = MM * diagram.node_positions
    for index, k in enumerate(_distinct(diagram.frequency[0])[:count]):
        shape = diagram.shapes[0, k]
        plane = int(np.argmax(np.max(np.abs(shape), axis=0)))
        label = f"{diagram.frequency[0, k]:.1f} Hz"
        figure.add_trace(
            go.Scatter(
                x=single(z),
                y=single(shape[:, plane].real),
                mode="lines",
                name=label,
                line={"color": SERIES[index % len(SERIES)], "width": 1.6},
                hovertemplate="%{x:.0f} mm: %{y:.3f}<extra>" + label + "</extra>",
            )
        )
    for name, position in bearings:
        figure.add_vline(x=MM * position, line={"color": MUTED, "width": 1, "dash": "dot"})
        figure.add_annotation(
            x=MM * position, y=1.0, yref="paper", text=plain(name), showarrow=False, yanchor="bottom"
        )
    figure.update_xaxes(title_text=axis_title("position from node 1", "mm"))
    figure.update_yaxes(title_text=axis_title("deflection, largest 1", "1"))
    return fit_legend(figure)


def _distinct(frequency: Array) -> list[int]:
    """Indices of frequencies that differ from the one before, lowest first."""
    chosen: list[int] = []
    for k in np.argsort(frequency):
        known = chosen and abs(frequency[k] - frequency[chosen[-1]]) <= _EQUAL * frequency[k]
        if np.isfinite(frequency[k]) and not known:
            chosen.append(int(k))
    return chosen
