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
    MILLI,
    MUTED,
    SERIES,
    TURN,
    axis_title,
    curve,
    fit_legend,
    panels,
    plain,
    upright,
)
from rotordrop.rotor.campbell import CampbellDiagram, StabilityMap
from rotordrop.rotor.critical_speeds import CriticalSpeedMap

Array = NDArray[np.float64]
DIRECTIONS = {"forward": SERIES[0], "backward": SERIES[1], "mixed": SERIES[2]}
_DASHES = {"tangent": "solid", "simple": "dash"}
_EQUAL = 0.005


def critical_speed_figure(found: CriticalSpeedMap) -> go.Figure:
    """Draw natural frequencies against the equivalent stiffness of the supports (Neisi 2020, Fig. 19).

    Left without mass of the supports as in the paper, right with it; vertical lines at the machine's own
    equivalent stiffness by the tangent and by the simple formula.
    """
    titles = ("supports without mass, as in the paper", "with the mass of the supports")
    figure = panels(titles, height=430, spacing=0.06)
    for column, frequencies in enumerate((found.massless, found.with_support_mass), start=1):
        for k in range(frequencies.shape[1]):
            curve(
                figure,
                found.stiffness,
                frequencies[:, k],
                f"line {k + 1}",
                column=column,
                colour=SERIES[k % len(SERIES)],
                width=1.6,
                legend=False,
                hover="%{x:.3~g} N/m: %{y:.1f} Hz",
            )
        for index, part in enumerate(found.lines):
            for formula, dash in _DASHES.items():
                stiffness = part.equivalent(formula)
                curve(
                    figure,
                    [stiffness, stiffness],
                    [10.0, 1000.0],
                    f"{part.bearing}, {formula}",
                    column=column,
                    colour=(INK, LIMIT)[index % 2],
                    width=1.3,
                    dash=dash,
                    legend=column == 1,
                    hover=f"{stiffness:.3g} N/m",
                )
    figure.update_xaxes(
        title_text=axis_title("equivalent stiffness", "N/m"), type="log", exponentformat="power", dtick=1
    )
    figure.update_yaxes(type="log", range=[1.0, math.log10(1000.0)], **LOG_LABELS)
    what = "natural frequency" if found.whirl == "standstill" else "critical speed"
    figure.update_yaxes(title_text=axis_title(what, "Hz"), col=1)
    return fit_legend(figure)


def campbell_figure(diagram: CampbellDiagram, highest: float, nominal: float | None = None) -> go.Figure:
    """Draw damped frequencies up to a highest one [Hz] and damping ratios against the rotor speed.

    Lines keep their shape from speed to speed; their colour is the direction. The nominal speed [rad/s] is
    an upright line.
    """
    figure = panels(("damped frequencies", "damping ratios"), height=360, spacing=0.1)
    shown: set[str] = set()
    for k in range(diagram.frequency.shape[1]):
        if not np.any(np.isfinite(diagram.whirl[:, k])):
            continue
        direction, frequency = diagram.direction(k), diagram.frequency[:, k]
        for column, values in ((1, frequency), (2, 100.0 * diagram.damping_ratio[:, k])):
            curve(
                figure,
                diagram.speed / TURN,
                np.where(frequency > highest, np.nan, values),
                direction,
                column=column,
                colour=DIRECTIONS[direction],
                legend=column == 1 and direction not in shown,
                hover="%{x:.1f} Hz: %{y:.4~g}",
            )
        shown.add(direction)
    top = min(highest, float(diagram.speed[-1]) / TURN)
    curve(figure, [0.0, top], [0.0, top], "1X", colour=MUTED, width=1.0, dash="dash", hover=None)
    at = [crossing.speed / TURN for crossing in diagram.crossings if crossing.speed / TURN <= highest]
    if at:
        marker = {"color": INK, "size": 7, "symbol": "circle-open", "line": {"width": 1.8}}
        curve(figure, at, at, "critical speed", mode="markers", marker=marker, hover="%{x:.1f} Hz")
    if nominal is not None:
        for column in (1, 2):
            upright(figure, nominal / TURN, row=1, col=column)
    figure.update_xaxes(title_text=axis_title("rotor speed, × 60 in rpm", "Hz"))
    figure.update_yaxes(title_text=axis_title("frequency", "Hz"), range=[0.0, highest], col=1)
    figure.update_yaxes(title_text=axis_title("damping ratio", "%"), rangemode="tozero", col=2)
    return fit_legend(figure)


def stability_figure(found: Sequence[StabilityMap]) -> go.Figure:
    """Draw the least logarithmic decrement against cross-coupled stiffness, a line for each suspension."""
    figure = panels(("least logarithmic decrement of the lowest modes",), height=320)
    for k, one in enumerate(found):
        hover = "%{x:.4~g} N/µm: %{y:.3~g}"
        curve(figure, 1e-6 * one.coupling, one.decrement, one.suspension, colour=SERIES[k], hover=hover)
    figure.add_hline(y=0.0, line={"color": LIMIT, "width": 1.2, "dash": "dash"})
    figure.update_xaxes(title_text=axis_title("cross-coupled stiffness in mid-span", "N/µm"))
    figure.update_yaxes(title_text=axis_title("logarithmic decrement", ""))
    return fit_legend(figure)


def mode_shape_figure(
    diagram: CampbellDiagram, bearings: Sequence[tuple[str, float]], count: int
) -> go.Figure:
    """Draw the shapes of the lowest modes at the lowest speed, in the plane of their largest deflection.

    Bearings are marked at their positions [m]; of two modes of one frequency only the first is drawn.
    """
    figure = panels(("",), height=320)
    for index, k in enumerate(_distinct(diagram.frequency[0])[:count]):
        shape = diagram.shapes[0, k]
        plane = int(np.argmax(np.max(np.abs(shape), axis=0)))
        curve(
            figure,
            MILLI * diagram.node_positions,
            shape[:, plane].real,
            f"{diagram.frequency[0, k]:.1f} Hz",
            colour=SERIES[index % len(SERIES)],
            width=1.6,
            hover="%{x:.0f} mm: %{y:.3f}",
        )
    for name, position in bearings:
        upright(figure, MILLI * position, MUTED, "dot")
        figure.add_annotation(
            x=MILLI * position, y=1.0, yref="paper", text=plain(name), showarrow=False, yanchor="bottom"
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
