"""The impacts of a drop: when, where around the race, how hard (table and figure)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimation.bearing_drop import BearingDrop, Impact
from rotordrop.report.content import Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import axis_title, panels, single

LISTED = 24
LATE, EARLY, INTERVAL = "#9cc3e8", "#0b3d73", "#7a8896"


def impact_table(bearings: Sequence[BearingDrop], *, force: str, listed: int = LISTED) -> Table:
    """List the strongest impacts in the order of time.

    Parameters
    ----------
    bearings : sequence of BearingDrop
        The drop.
    force : str
        Name of the force whose peak is stated.
    listed : int
        Number of impacts in the table; the strongest are kept.
    """
    impacts = [(bearing.name, impact) for bearing in bearings for impact in bearing.impacts]
    strongest = sorted(impacts, key=lambda item: -item[1].peak_force.value)[:listed]
    rows = tuple(
        (
            name,
            Quantity(value=impact.peak_time, kind="time"),
            Quantity(value=impact.azimuth, kind="angle", digits=3),
            Quantity.of(impact.peak_force, "force"),
            Quantity.of(impact.impulse, "impulse", digits=3),
            Quantity.of(impact.dissipated_energy, "energy", digits=3),
            Quantity(value=impact.end - impact.start, kind="time", digits=3),
        )
        for name, impact in sorted(strongest, key=lambda item: item[1].peak_time)
    )
    left_out = len(impacts) - len(rows)
    rest = f" {left_out} weaker ones are left out." if left_out else ""
    return Table(
        columns=(
            "bearing",
            "time of peak",
            "azimuth",
            f"peak {force}",
            "impulse",
            "dissipated energy",
            "duration",
        ),
        rows=rows,
        caption=f"Impacts ({len(rows)} of {len(impacts)})",
        note=f"Azimuth counter-clockwise from +x, −90° is the bottom.{rest}",
    )


def tick_spacing(span: float) -> float:
    """Distance of azimuth ticks [°] for azimuths that span an angle [rad]: three labels at least."""
    return next((step for step in (15.0, 30.0, 45.0) if math.degrees(span) <= 6.0 * step), 90.0)


def impact_figure(bearings: Sequence[BearingDrop], *, force: str) -> go.Figure:
    """Draw the peak force of every impact over its azimuth, the earlier the darker, with known intervals."""
    figure = panels([bearing.name for bearing in bearings], height=310)
    impacts = [impact for bearing in bearings for impact in bearing.impacts]
    latest = max(impact.peak_time for impact in impacts)
    for column, bearing in enumerate(bearings, start=1):
        _add_impacts(figure, bearing.impacts, column)
    figure.update_xaxes(title_text=axis_title("azimuth from +x, −90° at the bottom", "°"))
    figure.update_xaxes(tick0=0, dtick=tick_spacing(np.ptp([impact.azimuth for impact in impacts])))
    figure.update_yaxes(title_text=axis_title(f"peak {force}", "N"), col=1)
    figure.update_yaxes(rangemode="tozero")
    figure.update_layout(
        coloraxis={
            "colorscale": [[0.0, EARLY], [1.0, LATE]],
            "cmin": 0.0,
            "cmax": 1e3 * latest,
            "colorbar": {
                "title": {"text": "time [ms]", "font": {"size": 13}},
                "thickness": 12,
                "outlinewidth": 0,
            },
        }
    )
    return figure


def _add_impacts(figure: go.Figure, impacts: Sequence[Impact], column: int) -> None:
    force = np.array([impact.peak_force.value for impact in impacts])
    time = np.array([1e3 * impact.peak_time for impact in impacts])
    limits = np.array([impact.peak_force.interval_90 or (np.nan, np.nan) for impact in impacts]).reshape(
        -1, 2
    )
    known = np.all(np.isfinite(limits), axis=1)
    error = {
        "type": "data",
        "symmetric": False,
        "array": single(np.where(known, limits[:, 1] - force, 0.0)),
        "arrayminus": single(np.where(known, force - limits[:, 0], 0.0)),
        "thickness": 1,
        "width": 3,
        "color": INTERVAL,  # else it would be taken from the marker's, which is a row of numbers
        "visible": bool(known.any()),
    }
    figure.add_trace(
        go.Scatter(
            x=single(np.degrees([impact.azimuth for impact in impacts])),
            y=single(force),
            error_y=error,
            mode="markers",
            marker={
                "color": single(time),
                "coloraxis": "coloraxis",
                "size": 8,
                "line": {"color": "#ffffff", "width": 0.6},
            },
            customdata=single(time),
            showlegend=False,
            hovertemplate="%{y:.0f} N at %{x:.0f}°, %{customdata:.2f} ms<extra></extra>",
        ),
        row=1,
        col=column,
    )
