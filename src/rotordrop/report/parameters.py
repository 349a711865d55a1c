"""What was known before and what the record says about each parameter: prior, estimate, interval, verdict."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import plotly.graph_objects as go

from rotordrop.report.content import Column, Table, table, verdict_column
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import COLOURS, axis_title, bars, curve, fit_legend, panels, plain, upright

ROW_HEIGHT = 24
TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.85, 1, 1.2, 1.5, 2, 3, 5, 10, 20, 50, 100)


class ParameterRow(NamedTuple):
    """One parameter: its prior (or start and bounds), the estimate and the verdict of the identification."""

    name: str
    prior: Quantity
    estimate: Quantity
    verdict: str


def parameter_table(rows: Sequence[ParameterRow], *, caption: str = "Parameters", note: str = "") -> Table:
    """Set prior, estimate, 90 % interval and a verdict where it is not determined side by side."""
    columns = (
        Column("parameter", "name"),
        Column("prior or start", "prior"),
        Column("estimate (90 % interval)", "estimate"),
        verdict_column(lambda row: row.verdict),
    )
    return table(rows, columns, caption, note)


def parameter_figure(rows: Sequence[ParameterRow]) -> go.Figure:
    """Draw every estimate with its interval relative to its prior, over the prior's own range.

    A parameter without a positive prior or estimate cannot be set in relation and is left out.
    """
    drawn = [row for row in rows if row.prior.value > 0.0 and row.estimate.value > 0.0]
    figure = panels(("estimate relative to prior",), height=70 + ROW_HEIGHT * len(drawn))
    for label, colour, size, width in (("prior", "#b9c3cd", 6, 9), ("estimate", COLOURS["estimated"], 9, 3)):
        ratios = [_ratios(getattr(row, label), row.prior.value) for row in drawn]
        curve(
            figure,
            [value for value, _, _ in ratios],
            [plain(row.name) for row in drawn],
            f"{label} with 90 % interval",
            mode="markers",
            marker={"color": colour, "size": size},
            error_x=bars(ratios, 1.0, thickness=width, width=0, color=colour),
            hover="%{x:.3f} × prior, %{y}",
        )
    upright(figure, 1.0, "#5b6875", "dot")
    figure.update_xaxes(title_text=axis_title("value divided by prior", "1"), type="log", tickvals=TICKS)
    figure.update_yaxes(autorange="reversed", type="category", showgrid=False)
    return fit_legend(figure)


def _ratios(quantity: Quantity, reference: float) -> tuple[float, float, float]:
    """Value, lower and upper limit divided by the reference; limits equal the value where none are known."""
    value, low, high = (max(x, 1e-3 * reference) / reference for x in (quantity.value, *quantity.ends))
    return value, min(low, value), max(high, value)
