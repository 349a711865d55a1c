"""What is kept of every drop of a study: one row of numbers, each with its unit and its meaning."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.description import unknown_key
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.physics.whirl_spells import WhirlSpell, whirl_spells
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.losses import losses
from rotordrop.simulate.result import DropResult
from rotordrop.units import si_unit

Array = NDArray[np.float64]

SPUN_UP = 0.95
"""Share of the rotor's surface speed from which a race counts as spun up [1]."""


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


BEARING_QUANTITIES: tuple[Quantity, ...] = (
    Quantity(name="peak_force", kind="force", meaning="largest force of the balls on the race"),
    Quantity(name="peak_force_time", kind="time", meaning="time of the largest force from power-off"),
    Quantity(name="mean_force", kind="force", meaning="mean force after the first contact"),
    Quantity(name="peak_contact_force", kind="force", meaning="largest normal force between rotor and race"),
    Quantity(name="peak_stress", kind="pressure", meaning="largest Hertz stress at the inner race"),
    Quantity(name="stress_50", kind="pressure", meaning="median in time of the largest Hertz stress"),
    Quantity(name="stress_90", kind="pressure", meaning="90 % quantile in time of the largest Hertz stress"),
    Quantity(name="stress_99", kind="pressure", meaning="99 % quantile in time of the largest Hertz stress"),
    Quantity(name="contacts", kind="dimensionless", meaning="contacts that began"),
    Quantity(name="impulse", kind="impulse", meaning="impulse of the normal force over all contacts"),
    Quantity(
        name="contact_energy", kind="energy", meaning="energy dissipated by contact damping and friction"
    ),
    Quantity(name="sliding_energy", kind="energy", meaning="heat of sliding between rotor and race"),
    Quantity(name="damping_energy", kind="energy", meaning="energy lost in the normal direction of contacts"),
    Quantity(name="ball_set_energy", kind="energy", meaning="energy lost between race and support"),
    Quantity(name="support_energy", kind="energy", meaning="energy lost in support and foundation"),
    Quantity(name="drag_energy", kind="energy", meaning="energy lost to the drag of the race"),
    Quantity(
        name="spin_up_energy",
        kind="energy",
        meaning="work of friction on the spin of the race, drag included",
    ),
    Quantity(name="largest_radius", kind="dimensionless", meaning="largest displacement over the air gap"),
    Quantity(name="forward_whirl", kind="dimensionless", meaning="share of the time in forward whirl"),
    Quantity(name="backward_whirl", kind="dimensionless", meaning="share of the time in backward whirl"),
    Quantity(
        name="whirl_frequency",
        kind="frequency",
        meaning="mean frequency of whirl, negative backward; missing without whirl",
    ),
    Quantity(
        name="spin_up_time",
        kind="time",
        meaning="time until the race has 95 % of the rotor's surface speed; missing when it never has",
    ),
    Quantity(
        name="settling_time",
        kind="time",
        meaning="begin of the contact that lasts to the end; missing when the rotor is in flight there",
    ),
)
DROP_QUANTITIES: tuple[Quantity, ...] = (
    Quantity(name="dissipated", kind="energy", meaning="energy dissipated in all places"),
    Quantity(name="bending_energy", kind="energy", meaning="energy lost to the damping of the rotor"),
    Quantity(name="final_speed", kind="speed", meaning="rotor speed at the end"),
    Quantity(
        name="energy_residual",
        kind="dimensionless",
        meaning="error of the energy balance over the energy turned over",
    ),
)


def columns_of(machine: Machine) -> tuple[Quantity, ...]:
    """All columns of a study of a machine, in order: per bearing, per magnet, per drop."""
    bearings = [
        Quantity(name=f"{bearing.name}.{q.name}", kind=q.kind, meaning=f"{bearing.name}: {q.meaning}")
        for bearing in machine.touchdown_bearings
        for q in BEARING_QUANTITIES
    ]
    magnets = [
        Quantity(
            name=f"{amb.name}.largest_displacement",
            kind="length",
            meaning=f"largest displacement of the rotor in the magnet {amb.name}: rubs there beyond its gap",
        )
        for amb in machine.ambs
    ]
    return (*bearings, *magnets, *DROP_QUANTITIES)


def column_of(machine: Machine, name: str) -> Quantity:
    """A column of a study by its name; refuses a name there is none of."""
    columns = {q.name: q for q in columns_of(machine)}
    if name not in columns:
        raise UsageError(unknown_key(name, tuple(columns)))
    return columns[name]


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
    certificate = result.certificate
    values += [
        float(result.state[-1, list(result.state_names).index("dissipated energy")]),
        lost.bending,
        float(result.speed[-1]),
        certificate.energy_residual / max(certificate.energy_scale, 1e-300),
    ]
    return np.array(values)


def _bearing_numbers(machine: Machine, result: DropResult, b: int) -> dict[str, float]:
    gap = float(machine.touchdown_bearings[b].air_gap)
    log = result.contacts
    mine = log.bearing == b
    force = result.bearing_force_magnitude[:, b]
    peak, when = result.peak_force(b)
    after = result.time >= (float(log.start[mine][0]) if mine.any() else math.inf)
    stress = result.max_stress[:, b]
    median, high, highest = np.quantile(stress, (0.5, 0.9, 0.99), method="hazen").tolist()
    spells = whirl_spells(result.time, result.displacement[:, b], gap, spin=float(result.speed[0]))
    radius = np.hypot(result.displacement[:, b, 0], result.displacement[:, b, 1])
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
        "forward_whirl": _share(result, spells, lambda f: f > 0.0),
        "backward_whirl": _share(result, spells, lambda f: f < 0.0),
        "whirl_frequency": _mean_frequency(spells),
        "spin_up_time": _spin_up(machine, result, b, gap),
        "settling_time": _settling(result, b),
    }


def _share(result: DropResult, spells: tuple[WhirlSpell, ...], wanted: Callable[[float], bool]) -> float:
    return sum(spell.duration for spell in spells if wanted(spell.frequency)) / float(result.time[-1])


def _mean_frequency(spells: tuple[WhirlSpell, ...]) -> float:
    whole = sum(spell.duration for spell in spells)
    return sum(spell.frequency * spell.duration for spell in spells) / whole if whole else math.nan


def _spin_up(machine: Machine, result: DropResult, b: int, gap: float) -> float:
    bore = float(machine.touchdown_bearings[b].bore_radius)
    reached = np.abs(result.race_speed[:, b]) * bore >= SPUN_UP * np.abs(result.speed) * (bore - gap)
    return float(result.time[np.argmax(reached)]) if reached.any() else math.nan


def _settling(result: DropResult, b: int) -> float:
    flight = np.flatnonzero(result.indentation[:, b] <= 0.0)
    if len(flight) == 0:
        return 0.0
    last = int(flight[-1])
    return float(result.time[last + 1]) if last + 1 < len(result.time) else math.nan
