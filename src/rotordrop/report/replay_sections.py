"""The parts of a report that show the paper's route: replay beside the record, step by step."""

from __future__ import annotations

import numpy as np

from rotordrop.estimation.replayed import ReplayDrop, Replayed
from rotordrop.report.agreement_tables import contact_time_table, window_table
from rotordrop.report.content import Figure, Section, Statement, Table
from rotordrop.report.first_contact import FirstContact
from rotordrop.report.friction_sweep import friction_sweep_figure
from rotordrop.report.history import AirGap, BearingMotions, History, Motion, Role
from rotordrop.report.quantity import Quantity
from rotordrop.report.replay_tables import correlation_table, first_contact_table, support_table
from rotordrop.report.speed import speed_figure


def replay_motions(drop: ReplayDrop) -> tuple[BearingMotions, ...]:
    """Measured motion beside the simulated one as the sensors would show it, with the limits of the gap."""
    motions = []
    for b, name in enumerate(drop.values):
        measured = Motion(
            label="measured",
            time=drop.measured_time,
            displacement=drop.measured[:, b],
            role="measured",
        )
        simulated = _simulated(drop.middle, b, "simulated", "simulated")
        gap = AirGap(lower=float(drop.gap.lower[b]), upper=float(drop.gap.upper[b]))
        motions.append(BearingMotions(bearing=name, motions=(measured, simulated), air_gap=gap))
    return tuple(motions)


def gap_limit_motions(drop: ReplayDrop) -> tuple[BearingMotions, ...]:
    """Measured motion beside the simulations with the lower and the upper air gap (Neisi 2020, Fig. 14)."""
    motions = []
    for b, bearing in enumerate(replay_motions(drop)):
        lower = _simulated(drop.lower, b, "simulated, lower gap", "simulated, lower gap")
        upper = _simulated(drop.upper, b, "simulated, upper gap", "simulated")
        shown = (bearing.motions[0], lower, upper)
        motions.append(BearingMotions(bearing=bearing.bearing, motions=shown, air_gap=bearing.air_gap))
    return tuple(motions)


def _simulated(replayed: Replayed, bearing: int, label: str, role: Role) -> Motion:
    return Motion(label=label, time=replayed.time, displacement=replayed.displacement[:, bearing], role=role)


def measured_first_contacts(drop: ReplayDrop) -> dict[str, FirstContact]:
    """First contact of every bearing in the record, with the time of its deepest point."""
    found = {}
    for b, (name, contact) in enumerate(zip(drop.values, drop.contacts, strict=True)):
        time = drop.measured_time
        radius = np.hypot(*drop.measured[:, b].T)
        inside = (time >= contact.start) & (time <= contact.end)
        deepest = int(np.argmax(np.where(inside, radius, -np.inf)))
        found[name] = FirstContact(
            start=contact.start,
            end=contact.end,
            indentation=contact.indentation,
            deepest_time=float(time[deepest]),
        )
    return found


def stiffness_tables(drop: ReplayDrop) -> tuple[Table, ...]:
    """Table 3 of the paper for this drop."""
    return (first_contact_table(dict(zip(drop.values, drop.contacts, strict=True))),)


def support_section(drop: ReplayDrop) -> Section:
    """Supports with verdicts and correlations, or where they were taken from."""
    if drop.support is None:
        text = f"The supports were taken from {drop.fixed}; this drop did not change them."
        return Section(heading="Supports", statements=(Statement(text=text),))
    tables = [support_table(drop.support.values)]
    if drop.support.correlations:
        tables.append(correlation_table(drop.support.correlations))
    return Section(heading="Supports", tables=tuple(tables))


def friction_section(drop: ReplayDrop) -> tuple[Section, ...]:
    """The sweep of the friction coefficient, if there was one."""
    if drop.friction is None:
        return ()
    value = Quantity.of(drop.friction.value, "dimensionless", digits=2)
    start, end = (Quantity(value=t, kind="time", digits=3).text for t in drop.friction.window)
    figure = Figure(
        chart=friction_sweep_figure(drop.friction),
        caption=f"Distance of simulated and measured orbit from {start} to {end}; best {value.text} "
        f"(90 %: {value.interval_text}). A number in place of the paper's eye.",
    )
    return (Section(heading="Friction", figures=(figure,)),)


def agreement_section(drop: ReplayDrop) -> Section:
    """How far replay and record agree, and how long a comparison point by point means anything."""
    horizon = min(bearing.horizon for bearing in drop.agreement.bearings)
    expected = drop.agreement.expected_horizon
    text = (
        f"Replay and record stay within a tenth of the air gap for {1e3 * horizon:.0f} ms. A drop is "
        "chaotic: small differences grow tenfold in about 33 ms, so later only statistics can be compared."
    )
    if expected is not None:
        text += f" With everything that is uncertain here, {1e3 * expected:.0f} ms are to be expected."
    names = tuple(drop.values)
    tables = (window_table(drop.agreement, names), contact_time_table(drop.agreement, names))
    return Section(heading="Agreement with the record", text=(text,), tables=tables)


def replay_speed_section(drop: ReplayDrop) -> Section:
    """Recorded and simulated speed with the time constants found."""
    histories = [History(label="simulated", time=drop.simulated.time, values=drop.simulated.speed)]
    if drop.record.speed is not None and drop.record.measured_speed is not None:
        time = drop.record.time - drop.drop_instant.value
        inside = (time >= 0.0) & (time <= drop.simulated.time[-1])
        measured = History(
            label="measured", time=time[inside], values=drop.record.speed[inside], role="measured"
        )
        histories.insert(0, measured)
    fit = drop.speed
    constant = Quantity.of(fit.aero_time_constant, "duration")
    profile = Quantity(value=fit.profile_time_constant, kind="duration", digits=3).text
    text = (
        f"Aerodynamic time constant {constant.text} ({constant.interval_text or constant.status}); "
        f"a plain exponential through the record, friction included, has {profile}."
    )
    notes = (Statement(text=fit.note),) if fit.note else ()
    figure = Figure(chart=speed_figure(histories), caption="Speed of the rotor, measured and simulated.")
    return Section(heading="Speed", text=(text,), statements=notes, figures=(figure,))
