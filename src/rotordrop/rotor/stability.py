"""Stability map: how much cross-coupled stiffness in mid-span a rotor bears before it whirls by itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.machine import Machine
from rotordrop.rotor.assembly import RotorFE, build_rotor_fe
from rotordrop.rotor.campbell import REDUCTION
from rotordrop.rotor.reduction import RotorBasis, reduce_rotor
from rotordrop.rotor.supports import Support, spring
from rotordrop.rotor.suspension import suspension_of
from rotordrop.rotor.whirl import whirl_modes

Array = NDArray[np.float64]

MODES = 8
"""Lowest modes that are looked at."""
LEAST, MOST = 1e2, 1e11
"""Cross-coupled stiffness [N/m] from which, and up to which, the limit is sought."""
POINTS, BEYOND = 26, 1.25
"""Points of the map, and how far it goes beyond the limit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StabilityMap:
    """Least logarithmic decrement of a rotor at one speed against cross-coupled stiffness."""

    suspension: str
    """What holds the rotor."""
    speed: float
    """Speed of the rotor [rad/s]."""
    node: int
    """Node where the coupling acts, counted from 1."""
    coupling: Array
    """Cross-coupled stiffness q [N/m]: the force is −q y horizontally, q x vertically, shape (Q,)."""
    decrement: Array
    """Least logarithmic decrement of the lowest modes [1]; negative where the rotor whirls by itself, shape
    (Q,)."""
    limit: float
    """Coupling at which it is zero [N/m]; infinite where none is found."""


def stability_map(machine: Machine, suspension: str = "AMBs") -> StabilityMap:
    """Stability map of a machine at its nominal speed, coupled at the node in the middle of its bearings.

    So API 617, part 1, screens a rotor (level I): what seals and impellers do to it stands as one
    cross-coupled stiffness in mid-span. What they do is not known here, so only the limit is given.
    """
    supports = suspension_of(machine, suspension)
    z, planes = machine.rotor.node_positions, machine.touchdown_bearings
    middle = 0.5 * (z[planes[0].node - 1] + z[planes[-1].node - 1])
    node = int(np.argmin(np.abs(np.array(z) - middle))) + 1
    basis = reduce_rotor(build_rotor_fe(machine), REDUCTION, [*(s.node for s in supports), node])
    return stability_of(basis, float(machine.speed.nominal), supports, node, suspension)


def stability_of(
    rotor: RotorFE | RotorBasis,
    speed: float,
    supports: Sequence[Support],
    node: int,
    suspension: str = "given supports",
) -> StabilityMap:
    """Stability map of a rotor on any supports at a speed [rad/s]; the coupling acts at a node."""

    def least(coupling: float) -> float:
        cross = spring(node, np.array([[0.0, coupling], [-coupling, 0.0]]))
        ratio = whirl_modes(rotor, speed, [*supports, cross], MODES).damping_ratio
        lowest = float(np.min(ratio))
        return 2.0 * math.pi * lowest / math.sqrt(max(1.0 - lowest * lowest, 1e-300))

    low, high = 0.0, LEAST
    while least(high) > 0.0 and high < MOST:
        low, high = high, 4.0 * high
    if high >= MOST:
        coupling = np.concatenate([[0.0], np.geomspace(LEAST, MOST, POINTS - 1)])
        limit = math.inf
    else:
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if least(middle) > 0.0 else (low, middle)
        limit = 0.5 * (low + high)
        coupling = np.linspace(0.0, BEYOND * limit, POINTS)
    return StabilityMap(
        suspension=suspension,
        speed=speed,
        node=node,
        coupling=coupling,
        decrement=np.array([least(float(q)) for q in coupling]),
        limit=limit,
    )
