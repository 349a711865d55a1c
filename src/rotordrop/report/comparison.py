"""Several drops beside each other: one headline number per drop and bearing, with its interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop.report.quantity import Quantity, display_unit
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels, plain


def comparison_figure(drops: Sequence[str], values: Mapping[str, Sequence[Quantity]], name: str) -> go.Figure:
    """Draw a number of several drops as points with their 90 % intervals.

    Parameters
    ----------
    drops : sequence of str
        Names of the drops.
    values : mapping
        By bearing, one quantity per drop.
    name : str
        What is compared, for example ``"peak bearing force"``.
    """
    figure = panels(tuple(values), height=290)
    unit = ""
    for column, (bearing, quantities) in enumerate(values.items(), start=1):
        scale, unit = display_unit(quantities[0].kind)
        shown = np.array([quantity.value for quantity in quantities]) / scale
        limits = np.array([_limits(quantity) for quantity in quantities]) / scale
        figure.add_trace(
            go.Scatter(
                x=[plain(drop) for drop in drops],
                y=shown,
                error_y={
                    "type": "data",
                    "symmetric": False,
                    "array": limits[:, 1] - shown,
                    "arrayminus": shown - limits[:, 0],
                    "thickness": 1.6,
                    "width": 6,
                },
                mode="markers",
                marker={"size": 9, "color": SERIES[0]},
                name=f"{name}, 90 % interval",
                showlegend=column == 1,
                hovertemplate=f"%{{x}}: %{{y:.4~g}} {unit}<extra>{plain(bearing)}</extra>",
            ),
            row=1,
            col=column,
        )
    figure.update_xaxes(type="category", range=[-0.6, len(drops) - 0.4])
    figure.update_yaxes(title_text=axis_title(name, unit), col=1)
    figure.update_yaxes(rangemode="tozero")
    return fit_legend(figure)


def _limits(quantity: Quantity) -> tuple[float, float]:
    return quantity.interval_90 or (quantity.value, quantity.value)
