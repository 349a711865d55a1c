"""Displacement of the rotor in a touchdown bearing against time (Neisi 2020, Figs 7 and 8)."""

from __future__ import annotations

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


def displacement_figure(bearing: BearingMotions) -> go.Figure:
    """Draw vertical and horizontal displacement of the rotor at one bearing (Neisi 2020, Figs 7 and 8).

    Parameters
    ----------
    bearing : BearingMotions
        Motions at the bearing, measured, simulated or estimated, and its air gap.

    Returns
    -------
    Figure
        Above vertical (y, up), below horizontal (x), in µm from the bearing centre.

    Notes
    -----
    Differs from the paper: vertical is y and horizontal is x here, z runs along the rotor.
    """
    name = bearing.bearing
    figure = panels((f"{name}: vertical, y", f"{name}: horizontal, x"), rows=2, columns=1, height=235)
    for row in (1, 2):
        for motion in bearing.motions:
            history = motion.vertical if row == 1 else motion.horizontal
            add_history(figure, history, MICRO, "µm", row=row, legend=row == 1)
        if bearing.air_gap is not None:
            add_gap_limits(figure, bearing.air_gap, sign=-1.0, row=row, legend=row == 1)
    if bearing.air_gap is not None:
        add_gap_limits(figure, bearing.air_gap, row=2)
    label_time(figure, row=2)
    figure.update_yaxes(title_text=axis_title("displacement y", "µm"), row=1)
    figure.update_yaxes(title_text=axis_title("displacement x", "µm"), row=2)
    return fit_legend(figure)
