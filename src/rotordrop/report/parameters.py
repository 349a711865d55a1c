"""What was known before and what the record says about each parameter: prior, estimate, interval, verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from rotordrop.report.content import Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import COLOURS, axis_title, fit_legend, panels, plain

ROW_HEIGHT = 24
TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.85, 1, 1.2, 1.5, 2, 3, 5, 10, 20, 50, 100)


@dataclass(frozen=True, kw_only=True)
class ParameterRow:
    """One parameter: its prior (or start and bounds), the estimate and the verdict of the identification."""

    name: str
    prior: Quantity
    estimate: Quantity
    verdict: str


def parameter_table(rows: Sequence[ParameterRow], *, caption: str = "Parameters", note: str = "") -> Table:
    """Set prior, estimate, 90 % interval and verdict side by side."""
    return Table(
        columns=("parameter", "prior or start", "estimate (90 % interval)", "verdict"),
        rows=tuple((row.name, row.prior, row.estimate, row.verdict) for row in rows),
        caption=caption,
        note=note,
    )


def parameter_figure(rows: Sequence[ParameterRow]) -> go.Figure:
    """Draw every estimate with its interval relative to its prior, over the prior's own range.

    Parameters
    ----------
    rows : sequence of ParameterRow
        Parameters; one without a positive prior or estimate cannot be set in relation and is left out.
    """
    drawn = [row for row in rows if row.prior.value > 0.0 and row.estimate.value > 0.0]
    figure = panels(("estimate relative to prior",), height=70 + ROW_HEIGHT * len(drawn))
    names = [plain(row.name) for row in drawn]
    for label, colour, quantity, width in (
        ("prior", "#b9c3cd", "prior", 9),
        ("estimate", COLOURS["estimated"], "estimate", 3),
    ):
        ratios = [_ratios(getattr(row, quantity), row.prior.value) for row in drawn]
        figure.add_trace(
            go.Scatter(
                x=[ratio[0] for ratio in ratios],
                y=names,
                mode="markers",
                name=f"{label} with 90 % interval",
                marker={"color": colour, "size": 9 if label == "estimate" else 6},
                error_x={
                    "type": "data",
                    "symmetric": False,
                    "array": [ratio[2] - ratio[0] for ratio in ratios],
                    "arrayminus": [ratio[0] - ratio[1] for ratio in ratios],
                    "thickness": width,
                    "width": 0,
                    "color": colour,
                },
                hovertemplate=f"{label} %{{x:.3f}} × prior<extra>%{{y}}</extra>",
            )
        )
    figure.add_vline(x=1.0, line={"color": "#5b6875", "width": 1, "dash": "dot"})
    figure.update_xaxes(title_text=axis_title("value divided by prior", "1"), type="log", tickvals=TICKS)
    figure.update_yaxes(autorange="reversed", type="category", showgrid=False)
    return fit_legend(figure)


def _ratios(quantity: Quantity, reference: float) -> tuple[float, float, float]:
    """Value, lower and upper limit divided by the reference; limits equal the value where none are known."""
    low, high = quantity.interval_90 or (quantity.value, quantity.value)
    floor = 1e-3 * reference
    value, low, high = (max(number, floor) / reference for number in (quantity.value, low, high))
    return float(value), float(np.minimum(low, value)), float(np.maximum(high, value))
