"""Magnitude of the bearing force against time, with its interval (Neisi 2020, Fig. 15)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import plotly.graph_objects as go

from rotordrop.report.history import BearingHistories, between
from rotordrop.report.quantity import written
from rotordrop.report.style import (
    INK,
    MILLI,
    MUTED,
    add_band,
    add_history,
    add_level,
    axis_title,
    fit_legend,
    label_time,
    panels,
)


@dataclass(frozen=True, kw_only=True)
class Peak:
    """Highest point of a history: time [s], value in SI units, 90 % interval where there is one."""

    time: float
    value: float
    interval_90: tuple[float, float] | None = None


def force_figure(
    bearings: Sequence[BearingHistories],
    *,
    peaks: Mapping[str, Peak] | None = None,
    static_loads: Mapping[str, float] | None = None,
    until: float | None = None,
) -> go.Figure:
    """Draw the magnitude of the ball force on the race at every bearing (Neisi 2020, Fig. 15).

    Parameters
    ----------
    bearings : sequence of BearingHistories
        Force magnitudes [N], with the band of their 90 % interval where known.
    peaks : mapping, optional
        Peak force by bearing, marked with its value and interval.
    static_loads : mapping, optional
        Share of the weight by bearing [N], which the force settles to.
    until : float, optional
        End of the window to draw [s]; the whole history by default.

    Returns
    -------
    Figure
        One panel per bearing, one above the other.
    """
    figure = history_panels(bearings, 1.0, "N", until)
    for row, bearing in enumerate(bearings, start=1):
        peak = (peaks or {}).get(bearing.bearing)
        if peak is not None and (until is None or peak.time <= until):
            mark_peak(figure, peak, 1.0, "N", row)
        load = (static_loads or {}).get(bearing.bearing)
        if load is not None:
            add_level(figure, load, "share of the weight", row=row, col=1, legend=row == 1)
    figure.update_yaxes(title_text=axis_title("bearing force", "N"), rangemode="tozero")
    return fit_legend(figure)


def history_panels(
    bearings: Sequence[BearingHistories], scale: float, unit: str, until: float | None = None
) -> go.Figure:
    """Panels one above the other with the histories and bands of every bearing, up to a time [s]."""
    figure = panels([b.bearing for b in bearings], rows=len(bearings), columns=1, height=240)
    for row, whole in enumerate(bearings, start=1):
        bearing = whole if until is None else _until(whole, until)
        if bearing.band is not None:
            add_band(figure, bearing.band, scale, unit, row=row, legend=row == 1)
        for history in bearing.histories:
            add_history(figure, history, scale, unit, row=row, legend=row == 1)
    label_time(figure, row=len(bearings))
    return figure


def _until(bearing: BearingHistories, until: float) -> BearingHistories:
    band = bearing.band
    if band is not None:
        inside = band.time <= until
        band = replace(band, time=band.time[inside], lower=band.lower[inside], upper=band.upper[inside])
    cut = tuple(between(history, -np.inf, until) for history in bearing.histories)
    return replace(bearing, histories=cut, band=band)


def mark_peak(figure: go.Figure, peak: Peak, scale: float, unit: str, row: int) -> None:
    """Mark a peak with its value and the 90 % interval."""
    text = f"peak {written(scale * peak.value, 0)} {unit} at {MILLI * peak.time:.2f} ms"
    if peak.interval_90 is not None:
        low, high = (written(scale * limit, 0) for limit in peak.interval_90)
        text += f" (90 %: {low} to {high} {unit})"
    figure.add_annotation(
        x=MILLI * peak.time,
        y=scale * peak.value,
        text=text,
        showarrow=True,
        arrowhead=2,
        arrowcolor=MUTED,
        ax=34,
        ay=4,
        xanchor="left",
        bgcolor="rgba(255,255,255,0.85)",
        font={"size": 11.5, "color": INK},
        row=row,
        col=1,
    )
