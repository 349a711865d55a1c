"""The impacts of a drop: when, where around the race, how hard (table and figure)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from rotordrop.report.content import Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import axis_title, panels, single
from rotordrop.simulation.result import ContactLog

LISTED = 24
CONTACT_FORCE = "contact force"
LATE, EARLY = "#cfe2f5", "#0b3d73"


@dataclass(frozen=True, kw_only=True)
class Impact:
    """One impact; every number with its interval where one is known.

    Attributes
    ----------
    bearing : str
        Name of the bearing.
    time, duration : Quantity
        Time of the peak from power-off and length of the contact [s].
    azimuth : Quantity
        Direction from the race's centre to the rotor [rad ccw from +x]; −90° is the bottom.
    peak_force, impulse, dissipated_energy : Quantity
        Peak normal force or ball force [N], normal impulse [N s], energy lost in contact and friction [J].
    """

    bearing: str
    time: Quantity
    duration: Quantity
    azimuth: Quantity
    peak_force: Quantity
    impulse: Quantity
    dissipated_energy: Quantity


def impacts_of(contacts: ContactLog, bearing_names: Sequence[str]) -> tuple[Impact, ...]:
    """List the contacts of a simulated drop as impacts, bearing by bearing, without intervals."""
    return tuple(
        Impact(
            bearing=bearing_names[int(contacts.bearing[i])],
            time=Quantity(value=float(contacts.peak_time[i]), kind="time"),
            duration=Quantity(value=float(contacts.duration[i]), kind="time", digits=3),
            azimuth=Quantity(value=_signed(float(contacts.azimuth[i])), kind="angle", digits=3),
            peak_force=Quantity(value=float(contacts.peak_force[i]), kind="force"),
            impulse=Quantity(value=float(contacts.impulse[i]), kind="impulse", digits=3),
            dissipated_energy=Quantity(value=float(contacts.dissipated_energy[i]), kind="energy", digits=3),
        )
        for i in np.argsort(contacts.bearing, kind="stable")
    )


def _signed(angle: float) -> float:
    """Angle brought to −π … π."""
    return float(np.angle(np.exp(1j * angle)))


def impact_table(impacts: Sequence[Impact], *, force: str = CONTACT_FORCE, listed: int = LISTED) -> Table:
    """List the strongest impacts in the order of time.

    Parameters
    ----------
    impacts : sequence of Impact
        All impacts of the drop.
    force : str
        Name of the force whose peak is stated.
    listed : int
        Number of impacts in the table; the strongest are kept.
    """
    strongest = sorted(impacts, key=lambda impact: -impact.peak_force.value)[:listed]
    rows = tuple(
        (
            impact.bearing,
            impact.time,
            impact.azimuth,
            impact.peak_force,
            impact.impulse,
            impact.dissipated_energy,
            impact.duration,
        )
        for impact in sorted(strongest, key=lambda impact: impact.time.value)
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


def impact_figure(impacts: Sequence[Impact], *, force: str = CONTACT_FORCE) -> go.Figure:
    """Draw the peak force of every impact over its azimuth, the earlier the darker, with known intervals."""
    bearings = list(dict.fromkeys(impact.bearing for impact in impacts))
    figure = panels(bearings, height=310)
    latest = max(impact.time.value for impact in impacts)
    for column, bearing in enumerate(bearings, start=1):
        _add_impacts(figure, [impact for impact in impacts if impact.bearing == bearing], column, latest)
    figure.update_xaxes(title_text=axis_title("azimuth from +x, −90° at the bottom", "°"))
    figure.update_xaxes(tick0=0, dtick=tick_spacing(np.ptp([impact.azimuth.value for impact in impacts])))
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


def _add_impacts(figure: go.Figure, impacts: Sequence[Impact], column: int, latest: float) -> None:
    force = np.array([impact.peak_force.value for impact in impacts])
    time = np.array([1e3 * impact.time.value for impact in impacts])
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
        "visible": bool(known.any()),
    }
    figure.add_trace(
        go.Scatter(
            x=single(np.degrees([impact.azimuth.value for impact in impacts])),
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
