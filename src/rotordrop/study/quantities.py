"""What is kept of every drop of a study: one row of numbers, each with its unit and its meaning."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.machine import Machine
from rotordrop.physics.whirl_spells import whirl_spells
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.losses import losses
from rotordrop.simulate.result import DropResult
from rotordrop.simulate.used import clearance_uses, landings, share_column, stopped
from rotordrop.units import si_unit

LIFT = "lift"
"""Column that says whether the magnets lifted the rotor again, of machines with magnets in the loop."""
SPUN_UP = 0.95
"""Share of the rotor's surface speed from which a race counts as spun up [1]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One number of a drop: name, kind as in `rotordrop.units.KINDS`, meaning."""

    name: str
    kind: str
    meaning: str

    @property
    def unit(self) -> str:
        """SI unit, a turn per second as Hz."""
        return "Hz" if self.kind == "frequency" else si_unit(self.kind) or "1"


def _quantities(*rows: tuple[str, str, str]) -> tuple[Quantity, ...]:
    return tuple(Quantity(name=name, kind=kind, meaning=meaning) for name, kind, meaning in rows)


BEARING_QUANTITIES: tuple[Quantity, ...] = _quantities(
    ("peak_force", "force", "largest force of the balls on the race"),
    ("peak_force_time", "time", "time of the largest force from power-off"),
    ("mean_force", "force", "mean force after the first contact"),
    ("peak_contact_force", "force", "largest normal force between rotor and race"),
    ("peak_stress", "pressure", "largest Hertz stress at the inner race"),
    ("stress_50", "pressure", "median in time of the largest Hertz stress"),
    ("stress_90", "pressure", "90 % quantile in time of the largest Hertz stress"),
    ("stress_99", "pressure", "99 % quantile in time of the largest Hertz stress"),
    ("contacts", "dimensionless", "contacts that began"),
    ("impulse", "impulse", "impulse of the normal force over all contacts"),
    ("contact_energy", "energy", "energy dissipated by contact damping and friction"),
    ("sliding_energy", "energy", "heat of sliding between rotor and race"),
    ("damping_energy", "energy", "energy lost in the normal direction of contacts"),
    ("ball_set_energy", "energy", "energy lost between race and support"),
    ("support_energy", "energy", "energy lost in support and foundation"),
    ("drag_energy", "energy", "energy lost to the drag of the race"),
    ("spin_up_energy", "energy", "work of friction on the spin of the race, drag included"),
    ("largest_radius", "dimensionless", "largest displacement over the air gap"),
    ("forward_whirl", "dimensionless", "share of the time in forward whirl"),
    ("backward_whirl", "dimensionless", "share of the time in backward whirl"),
    ("whirl_frequency", "frequency", "mean frequency of whirl, negative backward; missing without whirl"),
    (
        "spin_up_time",
        "time",
        "time until the race has 95 % of the rotor's surface speed; missing when it never has",
    ),
    (
        "settling_time",
        "time",
        "begin of the contact that lasts to the end; missing when the rotor is in flight there",
    ),
)
DROP_QUANTITIES: tuple[Quantity, ...] = _quantities(
    ("dissipated", "energy", "energy dissipated in all places"),
    ("bending_energy", "energy", "energy lost to the damping of the rotor"),
    ("final_speed", "speed", "rotor speed at the end"),
    ("energy_residual", "dimensionless", "error of the energy balance over the energy turned over"),
)


def columns_of(machine: Machine) -> tuple[Quantity, ...]:
    """All columns of a study of a machine, in order: per bearing, per magnet, per clearance, per drop."""
    names = [bearing.name for bearing in machine.touchdown_bearings]
    rubs = "largest displacement of the rotor in the magnet {}: rubs there beyond its gap"
    of_parts = [(f"{b}.{q.name}", q.kind, f"{b}: {q.meaning}") for b in names for q in BEARING_QUANTITIES]
    of_parts += [(f"{a.name}.largest_displacement", "length", rubs.format(a.name)) for a in machine.ambs]
    used = "largest displacement over the gap of the clearance {}: touches there from one on"
    of_parts += [
        (share_column(one.name, False), "dimensionless", used.format(one.name)) for one in machine.clearances
    ]
    way = "largest deflection of the support over the gap of the stop of {}: stopped from one on"
    of_parts += [(share_column(b, True), "dimensionless", way.format(b)) for b in stopped(machine)]
    for b in (one.name for one in machine.touchdown_bearings if one.face is not None):
        of_parts += [
            (f"{b}.face.peak_force", "force", f"{b}: largest axial force on the face of the race"),
            (
                f"{b}.face.edge_over_shoulder",
                "dimensionless",
                f"{b}: angle of the edge of a ball's contact over that of the shoulder: cut off from one on",
            ),
        ]
    for b in (one.name for one in machine.touchdown_bearings if one.thermal is not None):
        of_parts += [
            (f"{b}.heat.race", "temperature", f"{b}: largest mean temperature of the race above the start"),
            (f"{b}.heat.preload", "force", f"{b}: axial force of a row at the end, race in the middle"),
        ]
    if machine.has_loops:
        of_parts += [
            (LIFT, "dimensionless", "one where the magnets lifted the rotor again, else zero"),
            ("lift_time", "time", "time from their begin until it touched nothing any more"),
        ]
    return (*_quantities(*of_parts), *DROP_QUANTITIES)


def row_of(model: DropModel, result: DropResult) -> Array:
    """Numbers of one drop in the order of `columns_of`, shape (Q,), SI; NaN where there is none."""
    machine, lost = model.machine, losses(model, result)
    values: list[float] = []
    for b in range(len(machine.touchdown_bearings)):
        found = _bearing_numbers(machine, result, b) | {
            "sliding_energy": lost.sliding[b],
            "damping_energy": lost.contact[b],
            "ball_set_energy": lost.ball_set[b],
            "support_energy": lost.support[b],
            "drag_energy": lost.drag[b],
            "spin_up_energy": lost.spin_up[b],
        }
        values += [found[q.name] for q in BEARING_QUANTITIES]
    if machine.ambs:
        moved = result.at_nodes([amb.node for amb in machine.ambs])
        values += np.max(np.hypot(moved[..., 0], moved[..., 1]), axis=0).tolist()
    values += [use.share for use in clearance_uses(machine, result)]
    for one in landings(machine, result):
        values += [one.contacts.peak[0], one.edge_angle / one.climb.shoulder]
    if result.heat is not None:
        for b in result.heat.warmed:
            values += [result.heat.hottest(b)[0], float(result.heat.preload[-1, b])]
    if machine.has_loops:
        lift = result.lift
        took = math.nan if lift is None or lift.free_from is None else lift.free_from - lift.begun
        succeeded = lift is not None and lift.succeeded
        values += [math.nan if lift is None else float(succeeded), took if succeeded else math.nan]
    certificate = result.certificate
    values += [
        float(result.state[-1, list(result.state_names).index("dissipated energy")]),
        lost.bending,
        float(result.speed[-1]),
        certificate.energy_residual / max(certificate.energy_scale, 1e-300),
    ]
    return np.array(values)


def _bearing_numbers(machine: Machine, result: DropResult, b: int) -> dict[str, float]:
    bearing = machine.touchdown_bearings[b]
    gap, bore, end = float(bearing.air_gap), float(bearing.bore_radius), float(result.time[-1])
    log = result.contacts
    mine = log.bearing == b
    force = result.bearing_force_magnitude[:, b]
    peak, when = result.peak_force(b)
    after = result.time >= (float(log.start[mine][0]) if mine.any() else math.inf)
    stress = result.max_stress[:, b]
    median, high, highest = np.quantile(stress, (0.5, 0.9, 0.99), method="hazen").tolist()
    radius = np.hypot(result.displacement[:, b, 0], result.displacement[:, b, 1])
    spells = whirl_spells(result.time, result.displacement[:, b], gap, spin=float(result.speed[0]))
    whirl = sum(spell.duration for spell in spells)
    spun_up = np.abs(result.race_speed[:, b]) * bore >= SPUN_UP * np.abs(result.speed) * (bore - gap)
    # the sample after the last one in flight; the first where the rotor never flies
    settled = int(np.flatnonzero(np.append(True, result.indentation[:, b] <= 0.0))[-1])
    return {
        "peak_force": peak,
        "peak_force_time": when,
        "mean_force": float(force[after].mean()) if after.any() else math.nan,
        "peak_contact_force": float(np.max(log.peak_force[mine])) if mine.any() else 0.0,
        "peak_stress": float(stress.max()),
        "stress_50": median,
        "stress_90": high,
        "stress_99": highest,
        "contacts": float(np.count_nonzero(mine)),
        "impulse": float(np.sum(log.impulse[mine])),
        "contact_energy": float(np.sum(log.dissipated_energy[mine])),
        "largest_radius": float(radius.max()) / gap,
        "forward_whirl": sum(spell.duration for spell in spells if spell.frequency > 0.0) / end,
        "backward_whirl": sum(spell.duration for spell in spells if spell.frequency < 0.0) / end,
        "whirl_frequency": sum(s.frequency * s.duration for s in spells) / whirl if whirl else math.nan,
        "spin_up_time": float(result.time[np.argmax(spun_up)]) if spun_up.any() else math.nan,
        "settling_time": float(result.time[settled]) if settled < len(result.time) else math.nan,
    }
