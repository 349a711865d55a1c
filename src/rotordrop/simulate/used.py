"""What a simulated drop used of the parts of its machine: clearances, stops, faces of races, ribbons."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import Climb, numbers_of
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.load import load_now
from rotordrop.rotor.layout import StateLayout
from rotordrop.simulate.result import ContactLog, DropResult, stop_of

SLIPS = 0.5
"""Slip over motion along the stretch [1] from which a ribbon counts as slipping: half of it (chosen)."""


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
    """Every contact there; None where no force acts."""

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


@dataclass(frozen=True, kw_only=True)
class Landing:
    """What happened at the face of one bearing."""

    name: str
    """Name of the bearing."""
    gap: float
    """Axial clearance of each side [m]."""
    rotor_travel: float
    """Largest axial displacement of the rotor from the middle [m]."""
    travel: float
    travel_time: float
    """Largest axial displacement of the rotor against the race [m], of either sense, and when [s]."""
    contacts: ContactLog
    """Every contact there."""
    acceleration: Array
    """What the thrust accelerates the free rotor by at the begin of each [m/s²], shape (K,)."""
    climb: Climb
    """How far the balls climbed."""
    edge_time: float
    """When the edge of a contact lay highest [s]."""

    @property
    def contact_angle(self) -> float:
        """Largest contact angle of a ball [rad]."""
        return float(np.max(self.climb.angle))

    @property
    def edge_angle(self) -> float:
        """Largest angle of the edge of a contact ellipse [rad]."""
        return float(self.climb.edge[self.climb.highest])


def landings(machine: Machine, result: DropResult) -> tuple[Landing, ...]:
    """Landing at every face of a machine, in the order of its bearings."""
    found = []
    for b, bearing in enumerate(machine.touchdown_bearings):
        if bearing.face is None:
            continue
        along = result.race_axial_displacement(b)
        moved = result.race_displacement[:, b] - result.support_displacement[:, b]
        climb, way = numbers_of(bearing).climb(moved, along), np.abs(result.axial_displacement - along)
        furthest = int(np.argmax(way))
        contacts = result.contacts_at(f"{bearing.name}.face")
        assert contacts is not None
        found.append(
            Landing(
                name=bearing.name,
                gap=float(bearing.face.gap),
                rotor_travel=float(np.max(np.abs(result.axial_displacement))),
                travel=float(way[furthest]),
                travel_time=float(result.time[furthest]),
                contacts=contacts,
                acceleration=np.abs(_thrust(machine, result, contacts.start)) / machine.rotor.mass,
                climb=climb,
                edge_time=float(result.time[climb.highest]),
            )
        )
    return tuple(found)


def _thrust(machine: Machine, result: DropResult, time: Array) -> Array:
    """Loads along the axis together [N], towards higher nodes, shape (K,)."""
    speed, found = np.interp(time, result.time, result.speed), np.zeros(len(time))
    for load in machine.loads:
        if load.along is not None:
            row, points = load.course(float(machine.speed.nominal))
            row[L.LOAD_END] = len(points)
            found += [load_now(row, points, t, omega)[0] for t, omega in zip(time, speed, strict=True)]
    return found


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
