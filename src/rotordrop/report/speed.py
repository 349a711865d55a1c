"""Speed of rotor and races during a drop."""

from __future__ import annotations

import math
from collections.abc import Sequence

import plotly.graph_objects as go

from rotordrop.report.history import History
from rotordrop.report.style import add_history, axis_title, fit_legend, label_time, panels

PER_TURN = 1.0 / (2.0 * math.pi)


def speed_figure(rotor: Sequence[History], races: Sequence[History] = ()) -> go.Figure:
    """Draw the speed of the rotor (left) and of the bearings' inner races (right) against time.

    Parameters
    ----------
    rotor : sequence of History
        Rotor speed [rad/s], for example measured and simulated.
    races : sequence of History
        Spin of the races [rad/s], one per bearing.

    Returns
    -------
    Figure
        Speeds in Hz; the axis says how to read them in rpm.
    """
    figure = panels(("rotor", "inner races") if races else ("rotor",), height=250, spacing=0.12)
    for history in rotor:
        add_history(figure, history, PER_TURN, "Hz")
    for index, history in enumerate(races):
        dash = "solid" if index == 0 else "8px,4px"
        line = {"color": "#5d6d1e" if index == 0 else "#8e44ad", "width": 1.5, "dash": dash}
        add_history(figure, history, PER_TURN, "Hz", column=2, line=line)
    label_time(figure)
    figure.update_yaxes(title_text=f"{axis_title('speed', 'Hz')}, × 60 in rpm", col=1)
    if races:
        figure.update_yaxes(title_text=f"{axis_title('race speed', 'Hz')}, × 60 in rpm", col=2)
    return fit_legend(figure)
