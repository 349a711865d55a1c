"""How the rotor landed on the faces of its races in a simulated drop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.race_bearing import Climb, numbers_of
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.load import load_now
from rotordrop.simulate.result import ContactLog, DropResult


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
