"""The rotor at rest under its weight: load shares, its contact with a race, sag levitated and settled."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import SimulationError
from rotordrop.physics import columns as L
from rotordrop.physics.hertz import LineContact
from rotordrop.physics.linear_algebra import product, solve
from rotordrop.physics.load import load_now
from rotordrop.rotor.assembly import N_RIGID, RotorFE, build_rotor_fe, free_free_modes

if TYPE_CHECKING:
    from rotordrop.elements.touchdown_bearing import TouchdownBearing
    from rotordrop.machine import Machine


def weight_vector(fe: RotorFE, gravity: float) -> Array:
    """Nodal forces of gravity in y [N, N m], shape (2N,); gravity [m/s²] acts towards −y."""
    return -gravity * product(fe.mass, fe.rigid_shapes[:, 0])


def load_vectors(fe: RotorFE, machine: Machine, time: float, speed: float) -> Array:
    """Nodal forces of loads across the axis in x and y [N, N m], (2, 2N), at a time [s] and speed [rad/s]."""
    found = np.zeros((2, fe.size))
    for load in machine.loads:
        row, points = load.course(float(machine.speed.nominal))
        row[L.LOAD_END] = len(points)
        if load.along is None:
            found += np.outer(load_now(row, points, time, speed), fe.node_row(load.node))
    return found


def rest_on(
    fe: RotorFE,
    nodes: Sequence[int],
    gravity: float,
    compliance: Sequence[float] | None = None,
    beside: Array | None = None,
) -> tuple[Array, Array]:
    """Shape in y (2N,) [m, rad] of a rotor under its weight, and upward reactions [N], (P,), held at P nodes.

    Gravity in m/s²; each support gives way by its compliance [m/N], or is rigid. ``beside`` (2N,) are nodal
    forces beside the weight [N, N m]; without gravity the plane may be any.
    """
    held = len(set(nodes))
    if held < 2 or held < len(nodes):
        listed = ", ".join(map(str, nodes)) or "none"
        raise SimulationError(
            f"a rotor at rest must be held at two or more different nodes; it is held at: {listed}"
        )
    rows = np.array([fe.node_row(node) for node in nodes])
    give = np.diag(np.zeros(held) if compliance is None else np.asarray(compliance, dtype=np.float64))
    # reactions scaled to the stiffness of the shaft, so that the system is well conditioned
    scale = float(np.max(np.diag(fe.stiffness)))
    system = np.block([[fe.stiffness, -scale * rows.T], [-scale * rows, -(scale**2) * give]])
    pulled = weight_vector(fe, gravity) + (0.0 if beside is None else beside)
    right = np.concatenate([pulled, np.zeros(held)])
    try:
        solution = solve(system, right)
    except np.linalg.LinAlgError as error:
        raise SimulationError(
            "the shaft cannot hold its own weight: some of it is too thin or soft beside the rest for the "
            "numbers of a computer; check the diameters of the sections and the moduli of the materials"
        ) from error
    return solution[: fe.size], scale * solution[fe.size :]


def bearing_load_shares(machine: Machine, fe: RotorFE | None = None) -> Array:
    """Weight each touchdown bearing carries when the rotor rests on them [N], shape (B,).

    With two bearings it follows from the centre of gravity; with more, the bearings count as level and rigid.
    """
    fe = build_rotor_fe(machine) if fe is None else fe
    nodes = [bearing.node for bearing in machine.touchdown_bearings]
    gravity = float(machine.gravity)
    if len(nodes) == 1:
        return np.array([fe.total_mass * gravity])
    return rest_on(fe, nodes, gravity)[1]


def rotor_on_race(machine: Machine, bearing: TouchdownBearing) -> LineContact:
    """Line contact of the rotor, of the material of the shaft at its node, with one touchdown bearing."""
    beside = machine.rotor.elements[max(0, bearing.node - 2)]
    return numbers_of(bearing).rotor_contact(bearing, (beside.youngs_modulus, beside.poisson_ratio))


def levitated_sag(fe: RotorFE, machine: Machine) -> Array:
    """Static shape of the levitated rotor in y, shape (2N,) [m, rad].

    AMBs with integral action hold their nodes exactly; the others give way like springs of their stiffness.
    """
    nodes = [amb.node for amb in machine.ambs]
    if len(set(nodes)) < 2:
        raise SimulationError(
            f"the machine has {len(nodes)} AMB planes; the sag of the levitated rotor needs two. "
            "Give the AMB nodes in the machine file, or start the drop from given displacements."
        )
    compliance = [0.0 if amb.integral_action else 1.0 / float(amb.stiffness) for amb in machine.ambs]
    return rest_on(fe, nodes, float(machine.gravity), compliance)[0]


def settled_sag(fe: RotorFE, machine: Machine) -> Array:
    """Static shape in y of the rotor that rests on its touchdown bearings, shape (2N,) [m, rad].

    Measured from the straight line through the rotor's centre at the bearings (with one bearing: from the
    level through it, for a rotor that stays horizontal).
    """
    return _sag_on(fe, tuple(bearing.node for bearing in machine.touchdown_bearings), float(machine.gravity))


@lru_cache(maxsize=8)
def _sag_on(fe: RotorFE, nodes: tuple[int, ...], gravity: float) -> Array:
    """Found once for a rotor: a fit asks for it hundreds of times."""
    if len(nodes) == 1:
        return _inertia_relief(fe, nodes[0], gravity)
    return rest_on(fe, nodes, gravity)[0]


def _inertia_relief(fe: RotorFE, node: int, gravity: float) -> Array:
    modes = free_free_modes(fe)
    bending, eigenvalues = modes.shapes[:, N_RIGID:], modes.omega[N_RIGID:] ** 2
    force = weight_vector(fe, gravity) + fe.total_mass * gravity * fe.node_row(node)
    shape = product(bending, product(bending.T, force) / eigenvalues)
    lift = fe.rigid_shapes[:, 0] * shape[fe.node_index(node)]
    return np.asarray(shape - lift)
