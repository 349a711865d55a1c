"""Panels of quantities against time, with bands, limits and a marked peak: one way to draw them all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import AirGap, Band, History, Peak
from rotordrop.report.quantity import written
from rotordrop.report.style import (
    INK,
    MILLI,
    MUTED,
    OVER,
    add_band,
    add_gap_limits,
    add_history,
    add_level,
    axis_title,
    compared_style,
    fit_legend,
    in_seconds,
    label_time,
    line_style,
    panels,
)

LONG = 3.0
"""Time [s] from which on an axis counts seconds."""


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One panel of a figure against time."""

    title: str
    """Above the panel."""
    axis: str
    """What the vertical axis shows."""
    histories: tuple[History, ...]
    """The curves."""
    band: Band | None = None
    """The 90 % band of the first."""
    air_gap: AirGap | None = None
    """Drawn as horizontal limits, with the signs in ``gap_signs``."""
    gap_signs: tuple[float, ...] = (1.0,)
    """1 above zero, −1 below."""
    levels: tuple[tuple[str, float], ...] = ()
    """Further horizontal limits with their names."""
    peak: Peak | None = None
    """Marked with its value, time and interval."""
    certain: bool = True
    """Whether the value of the peak holds; else it is marked with its interval alone."""
    series: bool = False
    """Whether the curves take the colours of a series instead of those of their roles."""

    def around(self, before: float, after: float) -> Panel:
        """The panel around its peak, from so long before it to so long after it [s]."""
        assert self.peak is not None
        start, end = self.peak.time - before, self.peak.time + after
        return replace(
            self,
            histories=tuple(history.between(start, end) for history in self.histories),
            band=None if self.band is None else self.band.between(start, end),
            levels=(),
        )


def time_panels(
    rows: Sequence[Sequence[Panel]],
    scale: float,
    unit: str,
    *,
    height: int = 240,
    from_zero: bool = False,
    together: bool = False,
    from_power_off: bool = True,
) -> go.Figure:
    """Draw rows of panels of a height [px] against the time from power-off, scaled from SI to a unit.

    The vertical axes begin at zero with ``from_zero``; all panels zoom ``together`` in time, else those of a
    column; without ``from_power_off`` every panel begins at its own first sample.
    """
    columns = len(rows[0])
    titles = [panel.title for row in rows for panel in row]
    figure = panels(titles, rows=len(rows), columns=columns, height=height)
    legend: set[str] = set()
    for i, row in enumerate(rows, start=1):
        for j, panel in enumerate(row, start=1):
            _draw(figure, panel, scale, unit, i, j, legend)
            if j == 1 or panel.axis != row[j - 2].axis:  # one title for neighbours that show the same
                figure.update_yaxes(title_text=axis_title(panel.axis, unit), row=i, col=j)
    label_time(figure, row=len(rows))
    drawn = [history.time for row in rows for panel in row for history in panel.histories]
    if any(float(np.ptp(time)) > LONG for time in drawn if len(time)):
        in_seconds(figure)
    if not from_power_off:
        figure.update_xaxes(rangemode="normal", matches=None, showticklabels=True)
    figure.update_yaxes(rangemode="tozero" if from_zero else "normal")
    if together:  # the panels of a column follow its lowest one; the lowest ones follow the first of them
        first = (len(rows) - 1) * columns + 1
        for number in range(first + 1, first + columns):
            figure.layout[f"xaxis{number}"].matches = "x" if first == 1 else f"x{first}"
    return fit_legend(figure)


def _draw(
    figure: go.Figure, panel: Panel, scale: float, unit: str, row: int, column: int, legend: set[str]
) -> None:
    def first(name: str) -> bool:
        """Whether a name stands in the legend for the first time."""
        new = name not in legend
        legend.add(name)
        return new

    place: dict[str, Any] = {"row": row, "column": column}
    if panel.band is not None:
        add_band(figure, panel.band, scale, unit, **place, legend=first(panel.band.label))
    compared = len({history.role for history in panel.histories}) > 1
    ordered = sorted(enumerate(panel.histories), key=lambda entry: compared and entry[1].role == "measured")
    for index, history in ordered:
        line = line_style(history.role, index + 4 * (column - 1)) if panel.series else None
        if compared and not panel.series:
            line = compared_style(history.role)
        add_history(figure, history, scale, unit, **place, legend=first(history.label), line=line)
    if panel.air_gap is not None:
        for sign in panel.gap_signs:
            add_gap_limits(figure, panel.air_gap, sign=sign, **place, legend=first("air gap"))
    for name, level in panel.levels:
        add_level(figure, scale * level, name, **place, legend=first(name))
    if panel.peak is not None:
        _mark(figure, panel.peak, scale, unit, row, column, certain=panel.certain)


def _mark(
    figure: go.Figure, peak: Peak, scale: float, unit: str, row: int, column: int, *, certain: bool
) -> None:
    """Mark a peak with its value, time and 90 % interval, or with the interval alone."""
    said = [f"peak {written(scale * peak.value, 0)} {unit} at {MILLI * peak.time:.2f} ms"] if certain else []
    if peak.interval_90 is not None:
        low, high = (written(scale * limit, 0) for limit in peak.interval_90)
        said.append(f"{'' if certain else 'peak, '}90 %: {low} to {high} {unit}")
    if not said:
        return
    figure.add_annotation(
        x=MILLI * peak.time,
        y=scale * peak.value,
        text="<br>".join(said),
        showarrow=True,
        arrowhead=2,
        arrowcolor=MUTED,
        ax=34,
        ay=4,
        xanchor="left",
        align="left",
        bgcolor=OVER,
        font={"size": 11.5, "color": INK},
        row=row,
        col=column,
    )
