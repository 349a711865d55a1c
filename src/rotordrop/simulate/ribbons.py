"""What the ribbons of soft mounts bore in a simulated drop, and whether they slipped."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.rotor.layout import StateLayout
from rotordrop.simulate.result import DropResult

SLIPS = 0.5
"""Slip over motion along the stretch [1] from which a ribbon counts as slipping: half of it (chosen)."""


@dataclass(frozen=True, kw_only=True)
class RibbonUse:
    """What the ribbon in the mount of one bearing bore."""

    name: str
    """Name of the bearing."""
    slip_force: float
    """Force at which it slips [N]."""
    peak_force: float
    peak_time: float
    """Largest force of the spring that slips [N], and when [s] from power-off."""
    slipped: float
    """How long it slipped in all [s]."""
    first_slip: float
    """When it slipped first [s]; NaN where it never did."""
    dissipated: float
    """Energy that its slip took [J]."""

    @property
    def share(self) -> float:
        """Largest force over slip force [1]."""
        return self.peak_force / self.slip_force


def ribbon_uses(machine: Machine, result: DropResult) -> tuple[RibbonUse, ...]:
    """What every ribbon of a machine bore, in the order of its bearings.

    Source: the power of `rotordrop.physics.mount.ribbon_slip`, over the instants of the histories.
    """
    layout = StateLayout.of_machine(machine, result.shapes.shape[1])
    rates = result.state[:, layout.velocity_of(layout.support)].reshape(len(result.time), -1, 2)
    found = []
    for b, (bearing, at) in enumerate(zip(machine.touchdown_bearings, layout.bearing_at(), strict=True)):
        ribbon = bearing.mount.ribbon
        if ribbon is None:
            continue
        first, own = at[L.MOUNT_STATES], at[L.BEARING_OWN]
        e = result.state[:, first : first + 2]  # the stretch of the ribbon stands before those of branches
        v = rates[:, b] if own < 0 else rates[:, b] - result.state[:, own + 2 : own + 4]
        stiffness, force = ribbon.friction_stiffness.value, ribbon.slip_force.value
        bears = stiffness * np.hypot(e[:, 0], e[:, 1])
        along = np.maximum(np.sum(e * v, axis=1), 0.0)
        slip = (bears / force) ** ribbon.sharpness.value
        slips = (slip >= SLIPS) & (along > 0.0)
        hardest = int(np.argmax(bears))
        found.append(
            RibbonUse(
                name=bearing.name,
                slip_force=force,
                peak_force=float(bears[hardest]),
                peak_time=float(result.time[hardest]),
                slipped=float(np.sum(np.gradient(result.time)[slips])),
                first_slip=float(result.time[np.argmax(slips)]) if np.any(slips) else math.nan,
                dissipated=float(np.trapezoid(stiffness * slip * along, result.time)),
            )
        )
    return tuple(found)
