"""Orbit of the rotor against the clearance circle (Neisi 2020, Fig. 12)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import BearingDrop, BearingMotions, Motion
from rotordrop.report.decimation import peak_indices
from rotordrop.report.style import (
    LIMIT,
    MICRO,
    MILLI,
    axis_title,
    compared_style,
    fit_legend,
    line_style,
    panels,
    plain,
    single,
)

CIRCLE = np.linspace(0.0, 2.0 * np.pi, 181)
ORBIT_BLOCKS = 450
ORBIT_POINTS = 4000
"""Samples at even steps that an orbit is drawn with: 40 a turn at 200 Hz in half a second."""


def orbit_figure(bearings: Sequence[BearingMotions | BearingDrop]) -> go.Figure:
    """Draw the path of the rotor centre in each bearing inside its clearance circle (Neisi 2020, Fig. 12).

    Parameters
    ----------
    bearings : sequence of BearingDrop
        Motions to lay over each other, for example measured and simulated; the circle is the upper air gap.

    Returns
    -------
    Figure
        One panel per bearing in µm, x to the right and y up as seen from the last bearing, same scale.
    """
    figure = panels([b.name for b in bearings], height=470, spacing=0.12)
    for column, bearing in enumerate(bearings, start=1):
        compared = len(bearing.motions) > 1
        for motion in sorted(bearing.motions, key=lambda one: compared and one.role == "measured"):
            _add_orbit(figure, motion, column, compared_style(motion.role) if compared else None)
        _add_circle(figure, bearing, column)
        anchor, reach = "x" if column == 1 else f"x{column}", _reach(bearing)
        figure.update_yaxes(scaleanchor=anchor, constrain="domain", range=[-reach, reach], row=1, col=column)
        figure.update_xaxes(constrain="domain", range=[-reach, reach], row=1, col=column)
    figure.update_xaxes(title_text=axis_title("horizontal displacement x", "µm"))
    figure.update_yaxes(title_text=axis_title("vertical displacement y", "µm"))
    return fit_legend(figure)


def _add_orbit(figure: go.Figure, motion: Motion, column: int, line: dict[str, Any] | None) -> None:
    x, y = motion.displacement[:, 0], motion.displacement[:, 1]
    radius = np.hypot(x, y)
    # extremes alone would join points of different turns by chords that the rotor never went
    even = np.arange(0, len(x), -(-len(x) // ORBIT_POINTS))
    chosen = np.union1d(peak_indices(x, y, radius, blocks=ORBIT_BLOCKS), even)
    label = plain(motion.label)
    figure.add_trace(
        go.Scatter(
            x=single(MICRO * x[chosen]),
            y=single(MICRO * y[chosen]),
            customdata=single(MILLI * motion.time[chosen]),
            mode="lines",
            name=label,
            legendgroup=label,
            showlegend=column == 1,
            line=line or line_style(motion.role),
            hovertemplate=f"x %{{x:.1f}} µm, y %{{y:.1f}} µm at %{{customdata:.2f}} ms<extra>{label}</extra>",
        ),
        row=1,
        col=column,
    )


def _reach(bearing: BearingMotions | BearingDrop) -> float:
    """Half width of the panel [µm]: a little more than the circle and every motion."""
    radii = [float(np.nanmax(np.abs(motion.displacement))) for motion in bearing.motions]
    return 1.08 * MICRO * max([*radii, bearing.air_gap.upper if bearing.air_gap else 0.0])


def _add_circle(figure: go.Figure, bearing: BearingMotions | BearingDrop, column: int) -> None:
    if bearing.air_gap is None:
        return
    gap = bearing.air_gap
    circles = [(gap.upper, "clearance circle", "solid")]
    if gap.lower < gap.upper:
        circles = [
            (gap.upper, "clearance circle, upper limit", "solid"),
            (gap.lower, "clearance circle, lower limit", "dash"),
        ]
    for radius, name, dash in circles:
        figure.add_trace(
            go.Scatter(
                x=single(MICRO * radius * np.cos(CIRCLE)),
                y=single(MICRO * radius * np.sin(CIRCLE)),
                mode="lines",
                name=name,
                legendgroup=name,
                showlegend=column == 1,
                line={"color": LIMIT, "width": 1.2, "dash": dash},
                hovertemplate=f"air gap {MICRO * radius:.1f} µm<extra></extra>",
            ),
            row=1,
            col=column,
        )
