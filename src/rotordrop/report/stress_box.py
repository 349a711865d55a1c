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

Array = NDArray[np.float64]

MEGA = 1e-6
DRAWN_OUTLIERS = 300
RULE = (
    "Quartiles by Hazen's rule (as in Matlab); whiskers reach the last value within 1.5 times the "
    "interquartile range; outliers lie beyond them."
)
PAPER_RULE = (
    "The paper's text calls values beyond three standard deviations outliers; its figures use the rule above."
)


@dataclass(frozen=True, kw_only=True)
class StressBox:
    """Distribution of the stress at one bearing in one drop, all in Pa.

    Attributes
    ----------
    label : str
        Drop, for example its speed.
    bearing : str
        Name of the bearing.
    mean, median, lower_quartile, upper_quartile, lower_whisker, upper_whisker : float
        Numbers of the box.
    standard_deviation, maximum : float
        Spread and largest value.
    outliers : ndarray
        Values beyond the whiskers.
    preload : float, optional
        Stress of the preload alone.
    """

    label: str
    bearing: str
    mean: float
    median: float
    lower_quartile: float
    upper_quartile: float
    lower_whisker: float
    upper_whisker: float
    standard_deviation: float
    maximum: float
    outliers: Array
    preload: float | None = None


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
    figure.update_yaxes(matches="y")
    drops = max(sum(box.bearing == bearing for box in boxes) for bearing in bearings)
    margin = max(0.6, 1.6 - 0.4 * drops)
    figure.update_xaxes(
        title_text="drop", type="category", showgrid=False, range=[-margin, drops - 1 + margin]
    )
    return figure


def _add_box(figure: go.Figure, box: StressBox, column: int, colour: str) -> None:
    label = plain(box.label)
    figure.add_trace(
        go.Box(
            x=[label],
            q1=[MEGA * box.lower_quartile],
            median=[MEGA * box.median],
            q3=[MEGA * box.upper_quartile],
            lowerfence=[MEGA * box.lower_whisker],
            upperfence=[MEGA * box.upper_whisker],
            mean=[MEGA * box.mean],
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
    columns = tuple(f"{box.bearing}, {box.label}" for box in boxes)
    rows: list[tuple[str | Quantity, ...]] = [
        ("mean", *(_stress(box.mean) for box in boxes)),
        ("median", *(_stress(box.median) for box in boxes)),
        ("lower quartile", *(_stress(box.lower_quartile) for box in boxes)),
        ("upper quartile", *(_stress(box.upper_quartile) for box in boxes)),
        ("lower whisker", *(_stress(box.lower_whisker) for box in boxes)),
        ("upper whisker", *(_stress(box.upper_whisker) for box in boxes)),
        ("standard deviation", *(_stress(box.standard_deviation) for box in boxes)),
        ("maximum", *(_stress(box.maximum) for box in boxes)),
        ("outliers", *(Quantity(value=len(box.outliers), kind="count") for box in boxes)),
    ]
    if any(box.preload is not None for box in boxes):
        shares = (np.nan if box.preload is None else box.preload / box.mean for box in boxes)
        rows.append(
            ("preload's share of the mean", *(Quantity(value=s, kind="share", digits=3) for s in shares))
        )
    return Table(
        columns=("stress, peak of the contact ellipse", *columns),
        rows=tuple(rows),
        caption="Distribution of the maximum Hertz stress",
        note=f"{RULE} {PAPER_RULE}",
    )


def _stress(value: float) -> Quantity:
    return Quantity(value=value, kind="pressure", digits=4)
