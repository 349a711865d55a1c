"""Box plot of the stress distribution within a drop (Neisi 2020, Fig. 16 and Table 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.report.content import Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import SERIES, axis_title, panels, plain, single
from rotordrop.severity.statistics import StressStatistics

Array = NDArray[np.float64]

MEGA = 1e-6
DRAWN_OUTLIERS = 300


@dataclass(frozen=True, kw_only=True)
class StressBox:
    """Distribution of the stress at one bearing in one drop."""

    label: str
    """Drop, for example its speed."""
    bearing: str
    """Name of the bearing."""
    statistics: StressStatistics
    """Numbers of the box and of the table [Pa]."""
    outliers: Array
    """Values beyond the whiskers [Pa]."""


def stress_box(label: str, bearing: str, stress: Array, statistics: StressStatistics) -> StressBox:
    """Take the statistics of a stress history (T,) [Pa], with its outliers to draw.

    Parameters
    ----------
    label : str
        Drop, for example its speed.
    bearing : str
        Name of the bearing.
    stress : ndarray, shape (T,)
        Stress at equidistant times [Pa].
    statistics : StressStatistics
        Its statistics, as they are stated.
    """
    beyond = (stress < statistics.lower_whisker) | (stress > statistics.upper_whisker)
    return StressBox(label=label, bearing=bearing, statistics=statistics, outliers=np.asarray(stress)[beyond])


def stress_box_figure(boxes: Sequence[StressBox]) -> go.Figure:
    """Draw the distribution of the stress as box plots, one box per drop and bearing (Neisi 2020, Fig. 16).

    Parameters
    ----------
    boxes : sequence of StressBox
        Statistics as they are stated in the table; the figure draws these numbers and computes none.

    Notes
    -----
    Quartiles by Hazen's rule, whiskers at 1.5 interquartile ranges. Differs from the paper: its text calls
    values beyond three standard deviations outliers.
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
    figure.update_xaxes(
        title_text="drop", type="category", showgrid=False, range=[-margin, drops - 1 + margin]
    )
    return figure


def _add_box(figure: go.Figure, box: StressBox, column: int, colour: str) -> None:
    label, numbers = plain(box.label), box.statistics
    figure.add_trace(
        go.Box(
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
        ),
        row=1,
        col=column,
    )
    outliers = thinned(MEGA * box.outliers)
    figure.add_trace(
        go.Scatter(
            x=[label] * len(outliers),
            y=single(outliers),
            mode="markers",
            marker={"symbol": "cross-thin-open", "size": 5, "color": colour, "line": {"width": 0.8}},
            name=f"{label}: outliers",
            showlegend=False,
            hovertemplate="outlier %{y:.0f} MPa<extra></extra>",
        ),
        row=1,
        col=column,
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
    rows: list[tuple[str | Quantity, ...]] = [
        (name, *(_stress(getattr(box.statistics, field)) for box in boxes)) for name, field in STRESSES
    ]
    rows += [
        (name, *(Quantity(value=getattr(box.statistics, field), kind="count") for box in boxes))
        for name, field in COUNTS
    ]
    shares = [box.statistics.preload_share for box in boxes]
    if any(share is not None for share in shares):
        cells = [Quantity.of(share, "share", digits=3) for share in shares]
        rows.append(("preload's share of the mean", *cells))
    rules = dict.fromkeys(box.statistics.rules() for box in boxes)
    return Table(
        columns=("stress, peak of the contact ellipse", *(f"{box.bearing}, {box.label}" for box in boxes)),
        rows=tuple(rows),
        caption="Distribution of the maximum Hertz stress",
        note=f"Rules in use: {'; '.join(rules)}.",
    )


STRESSES = (
    ("mean", "mean"),
    ("median", "median"),
    ("lower quartile", "lower_quartile"),
    ("upper quartile", "upper_quartile"),
    ("lower whisker", "lower_whisker"),
    ("upper whisker", "upper_whisker"),
    ("standard deviation", "standard_deviation"),
    ("maximum", "maximum"),
)
COUNTS = (
    ("samples beyond the whiskers", "beyond_whiskers"),
    ("samples above mean + 3 σ", "above_three_sigma"),
)


def _stress(value: float) -> Quantity:
    return Quantity(value=value, kind="pressure", digits=4)
