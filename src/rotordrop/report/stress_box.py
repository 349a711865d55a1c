"""Box plot of the stress distribution within a drop (Neisi 2020, Fig. 16 and Table 5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.report.content import Column, Table, table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import SERIES, axis_title, curve, panels, plain

MEGA = 1e-6
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


def stress_box_figure(bearings: Sequence[BearingDrop]) -> go.Figure:
    """Draw the distribution of the stress at every bearing as a box plot (Neisi 2020, Fig. 16).

    Differs from the paper: its text calls values beyond three standard deviations outliers; here they are
    beyond whiskers at 1.5 interquartile ranges, with quartiles by Hazen's rule.
    """
    figure = panels([""], height=360)
    for index, bearing in enumerate(bearings):
        box, stress, colour = bearing.statistics, bearing.stress.values, SERIES[index % len(SERIES)]
        name = plain(bearing.name)
        stated = {
            "q1": box.lower_quartile,
            "median": box.median,
            "q3": box.upper_quartile,
            "lowerfence": box.lower_whisker,
            "upperfence": box.upper_whisker,
            "mean": box.mean,
        }
        look: dict[str, Any] = {"boxpoints": False, "width": 0.45, "line": {"color": colour, "width": 1.6}}
        numbers = {key: [MEGA * value] for key, value in stated.items()}
        figure.add_trace(go.Box(x=[name], name=name, showlegend=False, **numbers, **look))
        beyond = stress[(stress < box.lower_whisker) | (stress > box.upper_whisker)]
        outliers = np.unique(np.round(MEGA * beyond))  # none that would be drawn on another
        cross = {"symbol": "cross-thin-open", "size": 5, "color": colour, "line": {"width": 0.8}}
        at, label = [name] * len(outliers), f"{bearing.name}: outliers"
        curve(figure, at, outliers, label, mode="markers", marker=cross, legend=False, hover="%{y:.0f} MPa")
    figure.update_yaxes(title_text=axis_title("max. Hertz stress", "MPa"))
    figure.update_xaxes(title_text="touchdown bearing", type="category", showgrid=False)
    return figure


def stress_table(bearings: Sequence[BearingDrop]) -> Table:
    """State the numbers of the box plots (Neisi 2020, Table 5), with the share of the preload in the mean."""
    found = {bearing.name: bearing.statistics for bearing in bearings}

    def of(name: str) -> Column:
        def stated(row: tuple[str, str, str]) -> Quantity:
            _, field, kind = row
            return Quantity.of(getattr(found[name], field), kind, 3 if kind == "share" else 4)

        return Column(name, stated)

    known = any(one.preload_share is not None for one in found.values())
    rules = dict.fromkeys(one.rules() for one in found.values())
    head = Column("stress, peak of the contact ellipse", lambda row: row[0])
    rows = STATED if known else STATED[:-1]
    note = f"Rules in use: {'; '.join(rules)}."
    return table(rows, (head, *map(of, found)), "Distribution of the maximum Hertz stress", note)
