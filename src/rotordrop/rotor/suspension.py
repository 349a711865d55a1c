"""What holds a machine's rotor, made linear: its AMBs, or the touchdown bearings it has settled in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import UsageError
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.physics.contact import contact_tangent
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.rotor.supports import Support, in_series, link, spring

Array = NDArray[np.float64]

SUSPENSIONS = ("free-free", "AMBs", "touchdown bearings")
FORMULAS = ("tangent", "simple")


@dataclass(frozen=True, kw_only=True)
class EquivalentStiffness:
    """How stiff one touchdown bearing holds the settled rotor, vertically, part by part."""

    bearing: str
    """Name of the touchdown bearing."""
    node: int
    """Its node, counted from 1."""
    load: float
    """Static load [N]."""
    tangent: float
    simple: float
    """Radial stiffness of the bearing at that load [N/m]: slope of its forces with any preload, and the
    simple engineering formula, which knows no preload."""
    support: float
    """Stiffness of the support [N/m]."""
    contact: float
    """Slope of the contact law between rotor and race at that load [N/m]."""

    def equivalent(self, formula: str = "tangent", *, contact: bool = False) -> float:
        """Bearing and support in series [N/m], with the contact if asked (Neisi 2020, section 5.4)."""
        if formula not in FORMULAS:
            raise UsageError(f"unknown bearing stiffness {formula!r}; choose one of {', '.join(FORMULAS)}")
        parts = [self.tangent if formula == "tangent" else self.simple, self.support]
        return in_series(*parts, *([self.contact] if contact else []))


def equivalent_stiffness(
    machine: Machine, loads: Sequence[float] | None = None
) -> tuple[EquivalentStiffness, ...]:
    """Stiffness of each touchdown bearing under the settled rotor, in the machine's order.

    Parameters
    ----------
    machine : Machine
        The machine.
    loads : sequence of float, length B, optional
        Static load of each bearing [N]; the load shares of the weight by default.
    """
    shares = bearing_load_shares(machine) if loads is None else loads
    pairs = zip(machine.touchdown_bearings, shares, strict=True)
    return tuple(_of_bearing(bearing, float(load)) for bearing, load in pairs)


def _of_bearing(bearing: TouchdownBearing, load: float) -> EquivalentStiffness:
    if load <= 0.0:
        raise UsageError(
            f"touchdown bearing {bearing.name!r} carries {load:.3g} N of the rotor's weight and is not "
            "loaded; its stiffness is not defined"
        )
    numbers = numbers_of(bearing)
    return EquivalentStiffness(
        bearing=bearing.name,
        node=bearing.node,
        load=load,
        tangent=numbers.tangent_stiffness(load),
        simple=numbers.simple_stiffness(load),
        support=float(bearing.support.stiffness),
        contact=contact_tangent(bearing.contact.law, load),
    )


def suspension_of(machine: Machine, name: str) -> tuple[Support, ...]:
    """Supports of a machine's rotor by the name of what holds it, one of `SUSPENSIONS`."""
    if name == "free-free":
        return ()
    if name == "AMBs":
        return amb_supports(machine)
    if name == "touchdown bearings":
        return touchdown_supports(machine)
    raise UsageError(f"unknown suspension {name!r}; choose one of {', '.join(map(repr, SUSPENSIONS))}")


def amb_supports(machine: Machine) -> tuple[Support, ...]:
    """Springs and dampers of the AMBs.

    Not validated: a controller's stiffness depends on frequency; the machine file knows one number.
    """
    if not machine.ambs:
        raise UsageError(f"machine {machine.name!r} has no AMBs; add their nodes to the machine file")
    return tuple(spring(amb.node, float(amb.stiffness), float(amb.damping)) for amb in machine.ambs)


def touchdown_supports(
    machine: Machine, formula: str = "tangent", loads: Sequence[float] | None = None
) -> tuple[Support, ...]:
    """Contact, race, bearing and support under the settled rotor, with their masses and damping.

    The bearing damping of a formula is the machine's damping time times the tangent stiffness.
    Differs from the paper: its critical speed map has neither the contact nor the masses. The contact holds
    the rotor in both directions here; the slow swing along the race is the pendulum's, not a mode.
    """
    if formula not in FORMULAS:
        raise UsageError(f"unknown bearing stiffness {formula!r}; choose one of {', '.join(FORMULAS)}")
    supports = []
    for bearing, parts in zip(machine.touchdown_bearings, equivalent_stiffness(machine, loads), strict=True):
        ground = bearing.support
        race = parts.tangent if formula == "tangent" else parts.simple
        links = (
            link(parts.contact),
            link(race, float(bearing.damping_time) * parts.tangent),
            link(
                (float(ground.stiffness_horizontal), float(ground.stiffness)),
                (float(ground.damping_horizontal), float(ground.damping)),
            ),
        )
        masses = (float(bearing.race.mass), float(ground.mass))
        supports.append(Support(node=bearing.node, links=links, masses=masses))
    return tuple(supports)
