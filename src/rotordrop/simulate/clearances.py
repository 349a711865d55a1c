"""How much of the clearances of a machine a simulated drop used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.machine import Machine
from rotordrop.simulate.result import DropResult


@dataclass(frozen=True, kw_only=True)
class ClearanceUse:
    """What a drop used of one clearance."""

    name: str
    node: int
    """Name and node of the clearance."""
    gap: float
    """Radial gap [m]."""
    travel: float
    """Largest displacement of the rotor there [m]."""
    time: float
    """When [s], from power-off."""

    @property
    def share(self) -> float:
        """Travel over gap [1]; the rotor touches from one on."""
        return self.travel / self.gap


def clearance_uses(machine: Machine, result: DropResult) -> tuple[ClearanceUse, ...]:
    """Use of every clearance of a machine, from the output grid; the bending of the rotor counts."""
    clearances = machine.clearances
    if not clearances:
        return ()
    moved = result.at_nodes([clearance.node for clearance in clearances])
    radius = np.hypot(moved[..., 0], moved[..., 1])
    latest = np.argmax(radius, axis=0)
    return tuple(
        ClearanceUse(
            name=clearance.name,
            node=clearance.node,
            gap=float(clearance.gap),
            travel=float(radius[latest[i], i]),
            time=float(result.time[latest[i]]),
        )
        for i, clearance in enumerate(clearances)
    )
