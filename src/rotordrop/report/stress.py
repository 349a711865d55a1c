"""Maximum Hertz stress at the inner race against time, with its interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import plotly.graph_objects as go

from rotordrop.report.force import Peak, history_panels, mark_peak
from rotordrop.report.history import BearingHistories
from rotordrop.report.style import add_level, axis_title, fit_legend

MEGA = 1e-6


def stress_figure(
    bearings: Sequence[BearingHistories],
    *,
    peaks: Mapping[str, Peak] | None = None,
    preload_stress: Mapping[str, float] | None = None,
) -> go.Figure:
    """Draw the largest Hertz stress at the inner race of every bearing against time.

    Parameters
    ----------
    bearings : sequence of BearingHistories
        Stresses [Pa], with the band of their 90 % interval where known.
    peaks : mapping, optional
        Peak stress by bearing, marked with its value and interval.
    preload_stress : mapping, optional
        Stress of the preload alone by bearing [Pa]: what the drop adds is above it.
    """
    figure = history_panels(bearings, MEGA, "MPa")
    for row, bearing in enumerate(bearings, start=1):
        peak = (peaks or {}).get(bearing.bearing)
        if peak is not None:
            mark_peak(figure, peak, MEGA, "MPa", row)
        preload = (preload_stress or {}).get(bearing.bearing)
        if preload is not None:
            add_level(figure, MEGA * preload, "preload alone", row=row, col=1, legend=row == 1)
    figure.update_yaxes(title_text=axis_title("max. Hertz stress", "MPa"))
    return fit_legend(figure)
