"""Horizontal and vertical displacement of all bearings side by side (Neisi 2020, Fig. 13)."""

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


def displacement_pair_figure(bearings: Sequence[BearingMotions]) -> go.Figure:
    """Draw horizontal and vertical displacement of every bearing, one bearing per row (Neisi 2020, Fig. 13).

    Parameters
    ----------
    bearings : sequence of BearingMotions
        Motions to compare, for example measured and simulated.

    Returns
    -------
    Figure
        One row per bearing: horizontal (x) left, vertical (y) right, in µm; all panels share the time axis.
    """
    titles = [f"{b.bearing}: {axis}" for b in bearings for axis in ("horizontal, x", "vertical, y")]
    figure = panels(titles, rows=len(bearings), columns=2, height=250)
    for row, bearing in enumerate(bearings, start=1):
        for motion in bearing.motions:
            add_history(figure, motion.horizontal, MICRO, "µm", row=row, column=1, legend=row == 1)
            add_history(figure, motion.vertical, MICRO, "µm", row=row, column=2, legend=False)
        if bearing.air_gap is not None:
            add_gap_limits(figure, bearing.air_gap, sign=-1.0, row=row, column=2, legend=row == 1)
        figure.update_yaxes(title_text=axis_title("displacement", "µm"), row=row, col=1)
    label_time(figure, row=len(bearings))
    figure.update_xaxes(matches="x")
    return fit_legend(figure)
