"""Tables and figure of the paper's route: first contact (Table 3), agreement, confounded values, friction."""

from __future__ import annotations

import math
from collections.abc import Sequence

import plotly.graph_objects as go

from rotordrop.estimate.agreement import Agreement
from rotordrop.estimate.estimate import FrictionSweep, TimedContact
from rotordrop.known import Correlation
from rotordrop.report.content import Cell, Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import BAND_FILL, MICRO, SERIES, axis_title, fit_legend, panels, single

CONFOUNDED = 0.9
"""Correlation from which two parameters count as confounded [1]."""


def first_contact_table(names: Sequence[str], contacts: Sequence[TimedContact]) -> Table:
    """State first contact and half-period stiffness of every bearing (Neisi 2020, Table 3)."""
    rows = tuple(
        (
            name,
            Quantity(value=contact.start, kind="time", digits=4),
            Quantity(value=contact.end, kind="time", digits=4),
            Quantity(value=contact.duration, kind="time", digits=3),
            Quantity(value=contact.indentation, kind="length", digits=3),
            Quantity(value=contact.mass, kind="mass"),
            Quantity(
                value=contact.equivalent_stiffness,
                kind="stiffness",
                standard_error=contact.standard_error,
                digits=3,
            ),
            Quantity(value=contact.corrected_stiffness, kind="stiffness", digits=3),
        )
        for name, contact in zip(names, contacts, strict=True)
    )
    return Table(
        columns=(
            "bearing",
            "t₁",
            "t₂",
            "T",
            "beyond the gap",
            "mass",
            "stiffness, eq. (17)",
            "gravity-corrected",
        ),
        rows=rows,
        caption="First contact (Neisi 2020, Table 3)",
        note=f"{_timing(contacts)}Eq. (17) takes the contact for half a period; gravity lengthens it, and "
        "one contact can be two. Both stiffnesses serve as a start of the search only.",
    )


def _timing(contacts: Sequence[TimedContact]) -> str:
    """Standard error of the contact times, the largest of all bearings."""
    if not contacts:
        return ""
    error = Quantity(value=max(contact.timing_error for contact in contacts), kind="time", digits=2)
    return f"Standard error of t₁ and t₂: {error.text} or less. "


def correlation_table(correlations: Sequence[Correlation]) -> Table:
    """Say which parameters the record cannot tell apart."""
    rows = tuple(
        (
            f"{pair.first} and {pair.second}",
            Quantity(value=pair.value, kind="dimensionless", digits=2),
            "confounded: only their combination is known" if abs(pair.value) >= CONFOUNDED else "told apart",
        )
        for pair in sorted(correlations, key=lambda pair: -abs(pair.value))
    )
    return Table(columns=("parameters", "correlation", "meaning"), rows=rows, caption="Correlations")


def window_table(agreement: Agreement, bearings: Sequence[str]) -> Table:
    """State the distance of the orbits by window, the bounce heights and the horizon of every bearing."""
    rows: list[tuple[Cell, ...]] = [
        (
            f"distance of the orbits, {window.name}",
            *(Quantity(value=float(value), kind="length", digits=3) for value in window.rms),
        )
        for window in agreement.windows
    ]
    for label, field in (
        ("first bounce, measured", "measured_bounce"),
        ("first bounce, simulated", "simulated_bounce"),
    ):
        rows.append(
            (label, *(Quantity(value=getattr(b, field), kind="length", digits=3) for b in agreement.bearings))
        )
    rows.append(
        ("comparable up to", *(Quantity(value=b.horizon, kind="time", digits=3) for b in agreement.bearings))
    )
    return Table(
        columns=("agreement", *bearings),
        rows=tuple(rows),
        caption="Agreement in windows",
        note="Distances are root mean square; a bounce counts from the rest position; comparable means "
        "closer than a tenth of the air gap.",
    )


def contact_time_table(agreement: Agreement, bearings: Sequence[str]) -> Table:
    """Set begin and end of the first contacts side by side, measured and simulated."""
    rows: list[tuple[Cell, ...]] = []
    for name, bearing in zip(bearings, agreement.bearings, strict=True):
        seen, made = bearing.measured_contacts, bearing.simulated_contacts
        for k in range(max(len(seen), len(made))):
            cells = [
                Quantity(value=float(times[k][i]) if k < len(times) else math.nan, kind="time", digits=4)
                for times in (seen, made)
                for i in (0, 1)
            ]
            rows.append((f"{name}, contact {k + 1}", *cells))
    return Table(
        columns=("contact", "measured begin", "measured end", "simulated begin", "simulated end"),
        rows=tuple(rows),
        caption="Contact times",
    )


def friction_sweep_figure(sweep: FrictionSweep) -> go.Figure:
    """Draw how far the simulated orbit lies from the measured one over the dynamic friction coefficient.

    Parameters
    ----------
    sweep : FrictionSweep
        The sweep; its best value is marked with its 90 % interval.
    """
    figure = panels(("orbit agreement over friction",), height=250)
    figure.add_trace(
        go.Scatter(
            x=single(sweep.coefficients),
            y=single(MICRO * sweep.disagreement),
            mode="lines+markers",
            marker={"size": 6},
            line={"color": SERIES[0], "width": 1.5},
            name="distance of the orbits",
            hovertemplate="μ %{x:.3f}: %{y:.2f} µm<extra></extra>",
        )
    )
    figure.add_vline(
        x=sweep.value.value, line={"color": SERIES[4], "width": 1.3}, name="best", showlegend=True
    )
    if sweep.value.interval_90 is not None:
        low, high = sweep.value.interval_90
        figure.add_vrect(
            x0=low, x1=high, fillcolor=BAND_FILL, line_width=0, name="90 % interval", showlegend=True
        )
    figure.update_xaxes(title_text=axis_title("dynamic friction coefficient", "1"))
    figure.update_yaxes(title_text=axis_title("orbit distance, weighted rms", "µm"), rangemode="tozero")
    return fit_legend(figure)
