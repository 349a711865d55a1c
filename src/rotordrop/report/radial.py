"""Radial displacement of the rotor, simulated for both limits of the air gap (Neisi 2020, Fig. 14)."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from rotordrop.report.history import BearingMotions
from rotordrop.report.style import (
    MICRO,
    add_gap_limits,
    add_history,
    axis_title,
    fit_legend,
    label_time,
    panels,
)


def radial_figure(bearings: Sequence[BearingMotions]) -> go.Figure:
    """Draw the distance of the rotor from the bearing centre against time (Neisi 2020, Fig. 14).

    Parameters
    ----------
    bearings : sequence of BearingMotions
        Measured motion and the simulations with the lower and the upper air gap.

    Returns
    -------
    Figure
        One panel per bearing, one above the other, in µm; beyond the strip of the air gap the rotor indents.
    """
    figure = panels([b.bearing for b in bearings], rows=len(bearings), columns=1, height=240)
    for row, bearing in enumerate(bearings, start=1):
        for motion in bearing.motions:
            add_history(figure, motion.radial, MICRO, "µm", row=row, legend=row == 1)
        if bearing.air_gap is not None:
            add_gap_limits(figure, bearing.air_gap, row=row, legend=row == 1)
    figure.update_yaxes(title_text=axis_title("radial displacement", "µm"), rangemode="tozero")
    label_time(figure, row=len(bearings))
    return fit_legend(figure)
