"""How the rotor landed on the faces of its races in a simulated drop."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.elements.race_bearing import Excess, numbers_of
from rotordrop.machine import Machine
from rotordrop.simulate.result import ContactLog, DropResult

SHOULDER = "shoulder of the race"
"""Kind of excess of balls that climb out of their grooves."""


@dataclass(frozen=True, kw_only=True)
class Landing:
    """What happened at the face of one bearing."""

    name: str
    """Name of the bearing."""
    gap: float
    """Axial clearance of each side [m]."""
    travel: float
    travel_time: float
    """Largest axial displacement of the rotor against the race [m], of either sense, and when [s]."""
    contacts: ContactLog
    """Every contact there."""
    contact_angle: float
    edge_angle: float
    edge_time: float
    """Largest contact angle of a ball and of the edge of its contact ellipse [rad], and when [s]."""
    shoulder_angle: float
    """Angle [rad] at which the groove ends."""

    @property
    def peak(self) -> tuple[float, float]:
        """Largest axial force there [N] and when [s]; zero and NaN where it does not land."""
        if not len(self.contacts):
            return 0.0, math.nan
        hardest = int(np.argmax(self.contacts.peak_force))
        return float(self.contacts.peak_force[hardest]), float(self.contacts.peak_time[hardest])

    @property
    def excess(self) -> Excess | None:
        """What lies beyond the shoulder, where the contact of a ball reaches over it."""
        if self.edge_angle <= self.shoulder_angle:
            return None
        reach, room, angle = (
            f"{math.degrees(one):.3g}°" for one in (self.edge_angle, self.shoulder_angle, self.contact_angle)
        )
        text = (
            f"the contact of a ball reaches {reach} up its groove (contact angle {angle}), and the shoulder "
            f"stands at {room}; the model takes the groove to go on: force and stress are not those of a "
            "contact cut off there"
        )
        return Excess(kind=SHOULDER, value=self.edge_angle, limit=self.shoulder_angle, text=text)


def landings(machine: Machine, result: DropResult) -> tuple[Landing, ...]:
    """Landing at every face of a machine, in the order of its bearings."""
    found = []
    for b, bearing in enumerate(machine.touchdown_bearings):
        if bearing.face is None:
            continue
        along = result.race_axial_displacement(b)
        moved = result.race_displacement[:, b] - result.support_displacement[:, b]
        climb, way = numbers_of(bearing).climb(moved, along), np.abs(result.axial_displacement - along)
        highest, furthest = int(np.argmax(climb.edge)), int(np.argmax(way))
        contacts = result.contacts_at(f"{bearing.name}.face")
        assert contacts is not None
        found.append(
            Landing(
                name=bearing.name,
                gap=float(bearing.face.gap),
                travel=float(way[furthest]),
                travel_time=float(result.time[furthest]),
                contacts=contacts,
                contact_angle=float(np.max(climb.angle)),
                edge_angle=float(climb.edge[highest]),
                edge_time=float(result.time[highest]),
                shoulder_angle=climb.shoulder,
            )
        )
    return tuple(found)
