"""What the paper's route adds: first contact (Table 3), agreement, confounded values, friction, speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.agreement import Agreement
from rotordrop.estimate.bearing_drop import History
from rotordrop.estimate.estimate import Estimate, FrictionSweep, ReplaySteps, TimedContact
from rotordrop.known import Correlation
from rotordrop.report.content import Column, Figure, Section, Table, table
from rotordrop.report.drop_sections import speed_figure
from rotordrop.report.quantity import Quantity, shown
from rotordrop.report.style import BAND_FILL, MICRO, SERIES, axis_title, curve, fit_legend, panels

CONFOUNDED = 0.9
"""Correlation from which two parameters count as confounded [1]; chosen, not measured."""
HALF_PERIOD = (
    "Eq. (17) takes the contact for half a period; gravity lengthens it, and one contact can be two. Both "
    "stiffnesses serve as a start of the search only."
)
DISTANCES = (
    "Distances are root mean square; a bounce counts from the rest position; comparable means closer than a "
    "tenth of the air gap."
)


def first_contact_table(names: Sequence[str], contacts: Sequence[TimedContact]) -> Table:
    """State first contact and half-period stiffness of every bearing (Neisi 2020, Table 3)."""

    def stiffness(row: tuple[str, TimedContact]) -> Quantity:
        value, error = row[1].equivalent_stiffness, row[1].standard_error
        return Quantity(value=value, kind="stiffness", standard_error=error, digits=3)

    columns = (
        Column("bearing", lambda row: row[0]),
        Column("t₁", lambda row: row[1].start, "time"),
        Column("t₂", lambda row: row[1].end, "time"),
        Column("T", lambda row: row[1].duration, "time", 3),
        Column("beyond the gap", lambda row: row[1].indentation, "length", 3),
        Column("mass", lambda row: row[1].mass, "mass"),
        Column("stiffness, eq. (17)", stiffness),
        Column("gravity-corrected", lambda row: row[1].corrected_stiffness, "stiffness", 3),
    )
    error = max((contact.timing_error for contact in contacts), default=None)
    timing = "" if error is None else f"Standard error of t₁ and t₂: {shown(error, 'time', 2)} or less. "
    rows = zip(names, contacts, strict=True)
    return table(rows, columns, "First contact (Neisi 2020, Table 3)", f"{timing}{HALF_PERIOD}")


def correlation_table(correlations: Sequence[Correlation]) -> Table:
    """Say which parameters the record cannot tell apart."""

    def meaning(pair: Correlation) -> str:
        apart = abs(pair.value) < CONFOUNDED
        return "told apart" if apart else "confounded: only their combination is known"

    columns = (
        Column("parameters", lambda pair: f"{pair.first} and {pair.second}"),
        Column("correlation", "value", "dimensionless", 2),
        Column("meaning", meaning),
    )
    return table(sorted(correlations, key=lambda pair: -abs(pair.value)), columns, "Correlations")


def agreement_section(agreement: Agreement, names: Sequence[str]) -> Section:
    """How far a replay follows the record, and how long a comparison point by point means anything."""
    horizon = min(bearing.horizon for bearing in agreement.bearings)
    text = (
        f"Replay and record stay within a tenth of the air gap for {1e3 * horizon:.0f} ms. A drop is "
        "chaotic: small differences grow tenfold in about 33 ms, so later only statistics can be compared."
    )
    if agreement.expected_horizon is not None:
        expected = 1e3 * agreement.expected_horizon
        text += f" With everything that is uncertain here, {expected:.0f} ms are to be expected."
    tables = (window_table(agreement, names), contact_time_table(agreement, names))
    return Section("Agreement with the record", (text,), tables=tables)


def window_table(agreement: Agreement, bearings: Sequence[str]) -> Table:
    """State the distance of the orbits by window, the bounce heights and the horizon of every bearing."""
    rows = [
        (f"distance of the orbits, {window.name}", [float(value) for value in window.rms], "length")
        for window in agreement.windows
    ]
    rows += [
        (label, [getattr(bearing, field) for bearing in agreement.bearings], kind)
        for label, field, kind in (
            ("first bounce, measured", "measured_bounce", "length"),
            ("first bounce, simulated", "simulated_bounce", "length"),
            ("comparable up to", "horizon", "time"),
        )
    ]

    def at(index: int) -> Column:
        return Column(bearings[index], lambda row: Quantity.of(row[1][index], row[2], 3))

    columns = (Column("agreement", lambda row: row[0]), *map(at, range(len(bearings))))
    return table(rows, columns, "Agreement in windows", DISTANCES)


def contact_time_table(agreement: Agreement, bearings: Sequence[str]) -> Table:
    """Set begin and end of the first contacts side by side, measured and simulated."""
    rows = [
        (f"{name}, contact {k + 1}", k, bearing)
        for name, bearing in zip(bearings, agreement.bearings, strict=True)
        for k in range(max(len(bearing.measured_contacts), len(bearing.simulated_contacts)))
    ]

    def at(whose: str, end: str) -> Column:
        def time(row: tuple[str, int, object]) -> float | None:
            times = getattr(row[2], f"{whose}_contacts")
            return float(times[row[1]][int(end == "end")]) if row[1] < len(times) else None

        return Column(f"{whose} {end}", time, "time")

    ends = (at(whose, end) for whose in ("measured", "simulated") for end in ("begin", "end"))
    return table(rows, (Column("contact", lambda row: row[0]), *ends), "Contact times")


def friction_section(sweep: FrictionSweep) -> Section:
    """The sweep of the friction coefficient."""
    value = Quantity.of(sweep.value, "dimensionless", 2)
    start, end = (shown(t, "time", 3) for t in sweep.window)
    caption = (
        f"Distance of simulated and measured orbit from {start} to {end}; best {value.text} "
        f"(90 %: {value.interval_text}). A number in place of the paper's eye."
    )
    return Section("Friction", figures=(Figure(friction_sweep_figure(sweep), caption),))


def friction_sweep_figure(sweep: FrictionSweep) -> go.Figure:
    """Draw how far the simulated orbit lies from the measured one over the dynamic friction coefficient.

    The best value is marked with its 90 % interval.
    """
    figure = panels(("orbit agreement over friction",), height=250)
    curve(
        figure,
        sweep.coefficients,
        MICRO * sweep.disagreement,
        "distance of the orbits",
        mode="lines+markers",
        marker={"size": 6},
        hover="μ %{x:.3f}: %{y:.2f} µm",
    )
    line, named = {"color": SERIES[4], "width": 1.3}, {"showlegend": True}
    figure.add_vline(x=sweep.value.value, line=line, name="best", **named)
    if sweep.value.interval_90 is not None:
        low, high = sweep.value.interval_90
        figure.add_vrect(x0=low, x1=high, fillcolor=BAND_FILL, line_width=0, name="90 % interval", **named)
    figure.update_xaxes(title_text=axis_title("dynamic friction coefficient", "1"))
    figure.update_yaxes(title_text=axis_title("orbit distance, weighted rms", "µm"), rangemode="tozero")
    return fit_legend(figure)


def speed_section(estimate: Estimate, steps: ReplaySteps) -> Section:
    """Recorded and simulated speed with the time constants found."""
    record = estimate.record
    histories = [History(label="simulated", time=steps.speed_time, values=steps.speed_simulated)]
    if record.speed is not None and record.measured_speed is not None:
        time = np.asarray(record.time) - estimate.drop_instant.value
        measured = History(label="measured", time=time, values=np.asarray(record.speed), role="measured")
        histories.insert(0, measured.between(0.0, float(steps.speed_time[-1])))
    constant = Quantity.of(steps.speed.aero_time_constant, "duration")
    text = (
        f"Aerodynamic time constant {constant.text} ({constant.interval_text or constant.status}); "
        "a plain exponential through the record, friction included, has "
        f"{shown(steps.speed.profile_time_constant, 'duration', 3)}."
    )
    figure = Figure(speed_figure(histories), "Speed of the rotor, measured and simulated.", "speed")
    return Section("Speed", (text,), figures=(figure,))
