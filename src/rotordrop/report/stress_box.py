"""Box plot of the stress distribution within a drop (Neisi 2020, Fig. 16 and Table 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from rotordrop.arrays import Array
from rotordrop.report.content import Column, Table, table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import SERIES, axis_title, curve, panels, plain
from rotordrop.severity.statistics import Statistics

MEGA = 1e-6
DRAWN_OUTLIERS = 300
STATED = (
    ("mean", "mean", "pressure"),
    ("median", "median", "pressure"),
    ("lower quartile", "lower_quartile", "pressure"),
    ("upper quartile", "upper_quartile", "pressure"),
    ("lower whisker", "lower_whisker", "pressure"),
    ("upper whisker", "upper_whisker", "pressure"),
    ("standard deviation", "standard_deviation", "pressure"),
    ("maximum", "maximum", "pressure"),
    ("samples beyond the whiskers", "beyond_whiskers", "count"),
    ("samples above mean + 3 σ", "above_three_sigma", "count"),
    ("preload's share of the mean", "preload_share", "share"),
)
"""Lines of the table: label, field of the statistics, kind."""


@dataclass(frozen=True)
class StressBox:
    """Distribution of the stress at one bearing in one drop."""

    label: str
    """Drop, for example its speed."""
    bearing: str
    """Name of the bearing."""
    statistics: Statistics
    """Numbers of the box and of the table [Pa]."""
    outliers: Array
    """Values beyond the whiskers [Pa]."""


def stress_box(label: str, bearing: str, stress: Array, statistics: Statistics) -> StressBox:
    """Take the statistics of a stress history (T,) [Pa] as they are stated, with its outliers to draw."""
    beyond = (stress < statistics.lower_whisker) | (stress > statistics.upper_whisker)
    return StressBox(label, bearing, statistics, np.asarray(stress)[beyond])


def stress_box_figure(boxes: Sequence[StressBox]) -> go.Figure:
    """Draw the stated statistics as box plots, one box per drop and bearing (Neisi 2020, Fig. 16).

    Differs from the paper: its text calls values beyond three standard deviations outliers; here they are
    beyond whiskers at 1.5 interquartile ranges, with quartiles by Hazen's rule.
    """
    bearings = list(dict.fromkeys(box.bearing for box in boxes))
    figure = panels(bearings, height=360)
    for column, bearing in enumerate(bearings, start=1):
        for index, box in enumerate(box for box in boxes if box.bearing == bearing):
            _add_box(figure, box, column, SERIES[index % len(SERIES)])
    figure.update_yaxes(title_text=axis_title("max. Hertz stress", "MPa"), col=1)
    for column in range(2, len(bearings) + 1):  # an axis that matches itself would be ignored
        figure.layout[f"yaxis{column}"].matches = "y"
    drops = max(sum(box.bearing == bearing for box in boxes) for bearing in bearings)
    margin = max(0.6, 1.6 - 0.4 * drops)
    span = [-margin, drops - 1 + margin]
    figure.update_xaxes(title_text="drop", type="category", showgrid=False, range=span)
    return figure


def _add_box(figure: go.Figure, box: StressBox, column: int, colour: str) -> None:
    label, numbers = plain(box.label), box.statistics
    drawn = go.Box(
        x=[label],
        q1=[MEGA * numbers.lower_quartile],
        median=[MEGA * numbers.median],
        q3=[MEGA * numbers.upper_quartile],
        lowerfence=[MEGA * numbers.lower_whisker],
        upperfence=[MEGA * numbers.upper_whisker],
        mean=[MEGA * numbers.mean],
        boxpoints=False,
        width=0.45,
        line={"color": colour, "width": 1.6},
        name=label,
        showlegend=False,
    )
    figure.add_trace(drawn, row=1, col=column)
    outliers = thinned(MEGA * box.outliers)
    curve(
        figure,
        [label] * len(outliers),
        outliers,
        f"{box.label}: outliers",
        column=column,
        mode="markers",
        marker={"symbol": "cross-thin-open", "size": 5, "color": colour, "line": {"width": 0.8}},
        legend=False,
        hover="%{y:.0f} MPa",
    )


def thinned(values: Array) -> Array:
    """Outliers to draw: the lowest, the highest and no two that would be drawn on each other."""
    values = np.sort(np.asarray(values, dtype=np.float64))
    if len(values) <= DRAWN_OUTLIERS:
        return values
    step = (values[-1] - values[0]) / DRAWN_OUTLIERS or 1.0
    cells = np.floor((values - values[0]) / step)
    first_of_cell = np.concatenate([[True], np.diff(cells) > 0])
    first_of_cell[-1] = True
    return np.asarray(values[first_of_cell])


def stress_table(boxes: Sequence[StressBox]) -> Table:
    """State the numbers of the box plots (Neisi 2020, Table 5), with the share of the preload in the mean."""

    def of(box: StressBox) -> Column:
        def stated(row: tuple[str, str, str]) -> Quantity:
            _, field, kind = row
            return Quantity.of(getattr(box.statistics, field), kind, 3 if kind == "share" else 4)

        return Column(f"{box.bearing}, {box.label}", stated)

    known = any(box.statistics.preload_share is not None for box in boxes)
    rules = dict.fromkeys(box.statistics.rules() for box in boxes)
    head = Column("stress, peak of the contact ellipse", lambda row: row[0])
    rows = STATED if known else STATED[:-1]
    note = f"Rules in use: {'; '.join(rules)}."
    return table(rows, (head, *map(of, boxes)), "Distribution of the maximum Hertz stress", note)
