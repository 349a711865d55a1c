"""How much of its clearances and of the stops of its mounts a simulated drop used."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.machine import Machine
from rotordrop.rotor.layout import StateLayout
from rotordrop.simulate.result import ContactLog, DropResult, stop_of


@dataclass(frozen=True, kw_only=True)
class ClearanceUse:
    """What a drop used of one clearance, or of the way of a mount up to its stop."""

    name: str
    node: int
    """Name and node of the clearance; of a stop those of its bearing."""
    stop: bool
    """Whether it is the stop of a mount."""
    gap: float
    """Radial gap [m]."""
    travel: float
    """Largest displacement of the rotor there, or of the support, [m]."""
    time: float
    """When [s], from power-off."""
    contacts: ContactLog | None
    """Every contact there; None where no force acts, or in files of before."""

    @property
    def share(self) -> float:
        """Travel over gap [1]; it touches from one on."""
        return self.travel / self.gap

    @property
    def count(self) -> int | None:
        """Number of contacts."""
        return None if self.contacts is None else len(self.contacts)

    @property
    def peak_force(self) -> float:
        """Largest normal force there [N]; zero where it does not touch, NaN where no force acts."""
        return math.nan if self.contacts is None else self.contacts.peak[0]


def share_column(name: str, stop: bool) -> str:
    """Name of the column of a study that holds travel over gap."""
    return f"{stop_of(name) if stop else name}.travel_over_gap"


def stopped(machine: Machine) -> list[str]:
    """Names of the bearings whose mount has a stop."""
    return [bearing.name for bearing in machine.touchdown_bearings if bearing.mount.stop is not None]


def clearance_uses(machine: Machine, result: DropResult) -> tuple[ClearanceUse, ...]:
    """Use of every clearance of a machine, then of every stop; the bending of the rotor counts."""
    places: list[tuple[str, int, bool, float, Array]] = []
    if machine.clearances:
        moved = result.at_nodes([one.node for one in machine.clearances])
        for i, one in enumerate(machine.clearances):
            places.append((one.name, one.node, False, float(one.gap), moved[:, i]))
    layout = StateLayout.of_machine(machine, result.shapes.shape[1])
    for b, bearing in enumerate(machine.touchdown_bearings):
        if bearing.mount.stop is not None:
            moved, gap = layout.support_deflection(result.state, b), float(bearing.mount.stop.gap)
            places.append((bearing.name, bearing.node, True, gap, moved))
    uses = []
    for name, node, stop, gap, moved in places:
        radius = np.hypot(moved[:, 0], moved[:, 1])
        contacts = result.contacts_at(stop_of(name) if stop else name)
        latest = int(np.argmax(radius))
        uses.append(
            ClearanceUse(
                name=name,
                node=node,
                stop=stop,
                gap=gap,
                travel=float(radius[latest]),
                time=float(result.time[latest]),
                contacts=contacts,
            )
        )
    return tuple(uses)
