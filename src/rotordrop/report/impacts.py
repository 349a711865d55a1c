"""The impacts of a drop: when, where around the race, how hard (table and figure)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import BearingDrop, Impact
from rotordrop.report.content import Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import MUTED, axis_title, panels, single

LISTED = 24
LATE, EARLY, INTERVAL, RING = "#9cc3e8", "#0b3d73", "#5b6875", "#cbd4dc"


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


def impact_figure(bearings: Sequence[BearingDrop], *, force: str) -> go.Figure:
    """Draw the peak force of every impact round the race as it was hit, with known intervals.

    The distance from the centre is the force, on the same scale for all bearings; the earlier the darker.
    """
    figure = panels([bearing.name for bearing in bearings], height=420, spacing=0.1)
    impacts = [impact for bearing in bearings for impact in bearing.impacts]
    latest = max(impact.peak_time for impact in impacts)
    highest = max((impact.peak_force.interval_90 or (0.0, impact.peak_force.value))[1] for impact in impacts)
    rings = ring_forces(highest)
    for column, bearing in enumerate(bearings, start=1):
        _add_rings(figure, rings, column)
        _add_impacts(figure, bearing.impacts, column)
        reach = 1.12 * rings[-1]
        anchor = "x" if column == 1 else f"x{column}"
        figure.update_yaxes(scaleanchor=anchor, constrain="domain", range=[-reach, reach], col=column)
        figure.update_xaxes(constrain="domain", range=[-reach, reach], col=column)
    bare = {"showticklabels": False, "ticks": "", "showgrid": False, "showline": False}
    figure.update_xaxes(title_text=axis_title(f"peak {force}, from the centre", "N"), **bare)
    figure.update_yaxes(**bare)
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


def ring_forces(highest: float) -> list[float]:
    """Forces of the rings [N]: three to five round numbers, the last above the highest force."""
    step = 10.0 ** math.floor(math.log10(highest))
    step = next(size * step for size in (0.2, 0.5, 1.0, 2.0, 5.0) if highest <= 5.0 * size * step)
    return [step * number for number in range(1, math.ceil(highest / step) + 1)]


def _add_rings(figure: go.Figure, rings: Sequence[float], column: int) -> None:
    """Rings of equal force with their numbers, and azimuths every 45 degrees."""
    axes = {"xref": "x" if column == 1 else f"x{column}", "yref": "y" if column == 1 else f"y{column}"}
    line = {"color": RING, "width": 1}
    at = math.radians(67.5)  # between two azimuths, where no number stands
    for force in rings:
        ends = {"x0": -force, "x1": force, "y0": -force, "y1": force}
        figure.add_shape(type="circle", line=line, layer="below", **ends, **axes)
        place = {"x": force * math.cos(at), "y": force * math.sin(at)}
        words = f"{force:,.6g}".replace(",", "\u202f")
        figure.add_annotation(text=words, showarrow=False, font={"size": 11, "color": MUTED}, **place, **axes)
    for degrees in range(0, 360, 45):
        x, y = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        figure.add_shape(
            type="line", x0=0, y0=0, x1=rings[-1] * x, y1=rings[-1] * y, line=line, layer="below", **axes
        )
        words = f"{degrees if degrees <= 180 else degrees - 360}°".replace("-", "−")
        figure.add_annotation(
            x=1.06 * rings[-1] * x,
            y=1.06 * rings[-1] * y,
            text=words,
            showarrow=False,
            font={"size": 11},
            **axes,
        )


def _add_impacts(figure: go.Figure, impacts: Sequence[Impact], column: int) -> None:
    force = np.array([impact.peak_force.value for impact in impacts])
    azimuth = np.array([impact.azimuth for impact in impacts])
    time = np.array([1e3 * impact.peak_time for impact in impacts])
    bars: list[list[float]] = []
    for impact in impacts:
        if impact.peak_force.interval_90 is not None:
            bars += [[limit, impact.azimuth] for limit in impact.peak_force.interval_90]
            bars.append([math.nan, math.nan])
    if bars:
        limit, at = np.array(bars).T
        figure.add_trace(
            go.Scatter(
                x=single(limit * np.cos(at)),
                y=single(limit * np.sin(at)),
                mode="lines",
                line={"color": INTERVAL, "width": 1.4},
                showlegend=False,
                hoverinfo="skip",
                name="90 % interval",
            ),
            row=1,
            col=column,
        )
    figure.add_trace(
        go.Scatter(
            x=single(force * np.cos(azimuth)),
            y=single(force * np.sin(azimuth)),
            mode="markers",
            marker={
                "color": single(time),
                "coloraxis": "coloraxis",
                "size": 8,
                "line": {"color": "#ffffff", "width": 0.6},
            },
            customdata=np.stack([force, np.degrees(azimuth), time], axis=1).astype(np.float32),
            showlegend=False,
            name="impacts",
            hovertemplate="%{customdata[0]:.0f} N at %{customdata[1]:.0f}°, "
            "%{customdata[2]:.2f} ms<extra></extra>",
        ),
        row=1,
        col=column,
    )
