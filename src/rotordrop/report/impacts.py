"""The impacts of a drop: when, where around the race, how hard (table and figure)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import BearingDrop, Impact
from rotordrop.record.impacts import HOP, shortest_flight
from rotordrop.report.content import Column, Table, table
from rotordrop.report.quantity import Quantity, places_of, round_steps
from rotordrop.report.style import MUTED, axis_title, curve, panels, square
from rotordrop.units import percent

LISTED = 24
AZIMUTH = "Azimuth counter-clockwise from +x, −90° is the bottom. "
LATE, EARLY, INTERVAL, RING = "#9cc3e8", "#0b3d73", "#5b6875", "#cbd4dc"


def impact_rule(gaps: Sequence[float], *, seen: bool = False) -> str:
    """The rule of an impact in words, with the shortest flight for these air gaps [m].

    Where displacement alone is seen it asks for more.
    """
    times = dict.fromkeys(f"{1e3 * shortest_flight(gap):.2g}" for gap in sorted(gaps))
    after = f"at least {' to '.join([*times][:: max(len(times) - 1, 1)])} ms" if times else "a time"
    leaves, swing = "", ""
    if seen:
        leaves = f", in which the rotor leaves the race by {percent(0.5 * HOP, 1)} of the gap or more"
        swing = ", and a swing along the race is none"
    return (
        f"An impact is a return to the race after {after} of free flight, as long as a hop of "
        f"{percent(HOP)} of the air gap under gravity lasts{leaves}; the first touch of a fall is one too. "
        f"Shorter hops belong to the impact before{swing}."
    )


def impact_table(bearings: Sequence[BearingDrop], *, force: str, listed: int = LISTED) -> Table:
    """List the strongest impacts in the order of time, with the name of the force whose peak is stated."""
    impacts = [
        (bearing.name, impact, after)
        for bearing in bearings
        for impact, after in zip(bearing.impacts, bearing.after_flight, strict=True)
    ]
    count = sum(after for *_, after in impacts)
    strongest = sorted(impacts, key=lambda item: -item[1].peak_force.value)[:listed]
    left_out = len(impacts) - len(strongest)
    gaps = [0.5 * (one.air_gap.lower + one.air_gap.upper) for one in bearings if one.air_gap is not None]
    rest = f" {left_out} weaker ones are left out." if left_out else ""

    def number(label: str, field: str, kind: str) -> Column:
        """A number of the impacts, with as many places in every line as the largest needs."""
        places = places_of((getattr(impact, field).value for _, impact, _ in strongest), kind)
        return Column(label, lambda row: replace(Quantity.of(getattr(row[1], field), kind), places=places))

    # where an impact hit, and for how long, has no known error in an estimate
    exact = all(impact.peak_force.interval_90 is None for _, impact, _ in impacts)
    place = Column("azimuth", lambda row: row[1].azimuth, "angle", 3)
    lasted = Column("duration", lambda row: row[1].end - row[1].start, "time", 3)
    columns = (
        Column("bearing", lambda row: row[0]),
        Column("time of peak", lambda row: row[1].peak_time, "time"),
        *((place,) if exact else ()),
        number(f"peak {force}", "peak_force", "force"),
        number("impulse", "impulse", "impulse"),
        number("dissipated energy", "dissipated_energy", "energy"),
        *((lasted,) if exact else ()),
        Column("impact", lambda row: "yes" if row[2] else ""),
    )
    return table(
        sorted(strongest, key=lambda item: item[1].peak_time),
        columns,
        f"Contacts ({len(strongest)} of {len(impacts)}), {count} of them impacts",
        f"{AZIMUTH if exact else ''}{impact_rule(gaps)}{rest}",
    )


def impact_figure(bearings: Sequence[BearingDrop], *, force: str) -> go.Figure:
    """Draw the peak force of every impact round the race as it was hit, with known intervals.

    The distance from the centre is the force, on the same scale for all bearings; the earlier the darker.
    """
    figure = panels([bearing.name for bearing in bearings], height=420, spacing=0.1)
    impacts = [impact for bearing in bearings for impact in bearing.impacts]
    latest = max(impact.peak_time for impact in impacts)
    rings = round_steps(max(impact.peak_force.high for impact in impacts))
    for column, bearing in enumerate(bearings, start=1):
        _add_rings(figure, rings, column)
        _add_impacts(figure, bearing.impacts, column)
        square(figure, column, 1.12 * rings[-1])
    bare = {"showticklabels": False, "ticks": "", "showgrid": False, "showline": False}
    figure.update_xaxes(title_text=axis_title(f"peak {force}, from the centre", "N"), **bare)
    figure.update_yaxes(**bare)
    heading = {"text": "time [ms]", "font": {"size": 13}}
    figure.update_layout(
        coloraxis={
            "colorscale": [[0.0, EARLY], [1.0, LATE]],
            "cmin": 0.0,
            "cmax": 1e3 * latest,
            "colorbar": {"title": heading, "thickness": 12, "outlinewidth": 0},
        }
    )
    return figure


def _add_rings(figure: go.Figure, rings: Sequence[float], column: int) -> None:
    """Rings of equal force with their numbers, and azimuths every 45 degrees."""
    axes = {"xref": "x" if column == 1 else f"x{column}", "yref": "y" if column == 1 else f"y{column}"}
    words: dict[str, Any] = {"showarrow": False}
    line: dict[str, Any] = {"line": {"color": RING, "width": 1}, "layer": "below"}
    at = math.radians(67.5)  # between two azimuths, where no number stands
    for force in rings:
        ends = {"x0": -force, "x1": force, "y0": -force, "y1": force}
        figure.add_shape(type="circle", **ends, **line, **axes)
        place = {"x": force * math.cos(at), "y": force * math.sin(at), "font": {"size": 11, "color": MUTED}}
        figure.add_annotation(text=f"{force:,.6g}".replace(",", "\u202f"), **place, **words, **axes)
    for degrees in range(0, 360, 45):
        x, y = rings[-1] * math.cos(math.radians(degrees)), rings[-1] * math.sin(math.radians(degrees))
        figure.add_shape(type="line", x0=0, y0=0, x1=x, y1=y, **line, **axes)
        text = f"{degrees if degrees <= 180 else degrees - 360}°".replace("-", "−")
        figure.add_annotation(x=1.06 * x, y=1.06 * y, text=text, font={"size": 11}, **words, **axes)


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
        x, y = limit * np.cos(at), limit * np.sin(at)
        grey: dict[str, Any] = {"colour": INTERVAL, "width": 1.4, "legend": False, "hover": None}
        curve(figure, x, y, "90 % interval", column=column, **grey)
    marker = {
        "color": time.astype(np.float32),
        "coloraxis": "coloraxis",
        "size": 8,
        "line": {"color": "#ffffff", "width": 0.6},
    }
    curve(
        figure,
        force * np.cos(azimuth),
        force * np.sin(azimuth),
        "impacts",
        column=column,
        mode="markers",
        marker=marker,
        customdata=np.stack([force, np.degrees(azimuth), time], axis=1).astype(np.float32),
        legend=False,
        hover="%{customdata[0]:.0f} N at %{customdata[1]:.0f}°, %{customdata[2]:.2f} ms",
    )
