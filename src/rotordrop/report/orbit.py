"""Orbit of the rotor against the clearance circle (Neisi 2020, Fig. 12)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import BearingDrop, BearingMotions
from rotordrop.report.decimation import peak_indices
from rotordrop.report.style import (
    LIMIT,
    MICRO,
    MILLI,
    axis_title,
    compared_style,
    curve,
    fit_legend,
    line_style,
    panels,
    single,
    square,
)

CIRCLE = np.linspace(0.0, 2.0 * np.pi, 181)
ORBIT_BLOCKS = 450
ORBIT_POINTS = 4000
"""Samples at even steps that an orbit is drawn with: 40 a turn at 200 Hz in half a second."""


def orbit_figure(bearings: Sequence[BearingMotions | BearingDrop]) -> go.Figure:
    """Draw the path of the rotor centre in each bearing inside its clearance circle (Neisi 2020, Fig. 12).

    One panel per bearing in µm at one scale, x to the right and y up; the circle is the upper air gap, with
    the lower one dashed where they differ.
    """
    figure = panels([b.name for b in bearings], height=470, spacing=0.12)
    for column, bearing in enumerate(bearings, start=1):
        compared = len(bearing.motions) > 1
        for motion in sorted(bearing.motions, key=lambda one: compared and one.role == "measured"):
            x, y = motion.displacement[:, 0], motion.displacement[:, 1]
            # extremes alone would join points of different turns by chords that the rotor never went
            even = np.arange(0, len(x), -(-len(x) // ORBIT_POINTS))
            chosen = np.union1d(peak_indices(x, y, np.hypot(x, y), blocks=ORBIT_BLOCKS), even)
            curve(
                figure,
                MICRO * x[chosen],
                MICRO * y[chosen],
                motion.label,
                column=column,
                legend=column == 1,
                customdata=single(MILLI * motion.time[chosen]),
                line=compared_style(motion.role) if compared else line_style(motion.role),
                hover="x %{x:.1f} µm, y %{y:.1f} µm at %{customdata:.2f} ms",
            )
        _add_circles(figure, bearing, column)
        radii = [float(np.nanmax(np.abs(motion.displacement))) for motion in bearing.motions]
        reach = 1.08 * MICRO * max([*radii, bearing.air_gap.upper if bearing.air_gap else 0.0])
        square(figure, column, reach)
    figure.update_xaxes(title_text=axis_title("displacement x", "µm"))
    figure.update_yaxes(title_text=axis_title("displacement y", "µm"), col=1)
    return fit_legend(figure)


def _add_circles(figure: go.Figure, bearing: BearingMotions | BearingDrop, column: int) -> None:
    gap = bearing.air_gap
    if gap is None:
        return
    circles = [(gap.upper, "clearance circle", "solid")]
    if gap.lower < gap.upper:
        circles = [
            (gap.upper, "clearance circle, upper limit", "solid"),
            (gap.lower, "clearance circle, lower limit", "dash"),
        ]
    for radius, name, dash in circles:
        curve(
            figure,
            MICRO * radius * np.cos(CIRCLE),
            MICRO * radius * np.sin(CIRCLE),
            name,
            column=column,
            legend=column == 1,
            line={"color": LIMIT, "width": 1.2, "dash": dash},
            hover=f"{MICRO * radius:.1f} µm",
        )
