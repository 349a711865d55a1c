"""Damped whirling modes of a turning rotor on its supports, and its response to unbalance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array, ComplexArray
from rotordrop.errors import SimulationError
from rotordrop.rotor.assembly import RotorFE, modal_damping_matrix
from rotordrop.rotor.reduction import RotorBasis
from rotordrop.rotor.suspension import PlanarMatrices, Support, planar_matrices

LOWEST_FREQUENCY = 0.05  # [Hz]; slower motion is rigid drift of a free rotor
CLEAR_DIRECTION = 0.05
"""Whirl index below which an orbit is too flat to have a direction [1] (chosen)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WhirlModes:
    """Damped modes of a rotor that turns at one speed, lowest frequency first."""

    speed: float
    """Speed of the rotor [rad/s]."""
    eigenvalue: ComplexArray
    """λ with positive imaginary part [rad/s], shape (K,)."""
    whirl: Array
    """+1 circular forward (with the spin), −1 circular backward, 0 on a line; meaningless at standstill on
    equal supports, where both directions share a frequency, shape (K,)."""
    shapes: ComplexArray
    """Displacement (x, y) at the nodes, largest displacement 1, shape (K, N, 2)."""
    vectors: ComplexArray
    """Displacement in the coordinates of `planar_matrices`, unit modal mass, shape (2n, K)."""

    @property
    def frequency(self) -> Array:
        """Damped frequencies Im λ / 2π [Hz], shape (K,)."""
        return np.asarray(self.eigenvalue.imag / (2.0 * np.pi))

    @property
    def damping_ratio(self) -> Array:
        """Damping ratios ``−Re λ / |λ|`` [1], shape (K,)."""
        return np.asarray(-self.eigenvalue.real / np.abs(self.eigenvalue))

    @property
    def direction(self) -> tuple[str, ...]:
        """``"forward"``, ``"backward"`` or ``"mixed"`` for each mode."""
        return tuple(direction_name(value) for value in self.whirl)


def direction_name(whirl: float) -> str:
    """Name of a whirl index between −1 and +1."""
    if abs(whirl) < CLEAR_DIRECTION:
        return "mixed"
    return "forward" if whirl > 0.0 else "backward"


def matrices_of(rotor: RotorFE | RotorBasis, supports: Sequence[Support]) -> PlanarMatrices:
    """Matrices of a rotor, full or reduced, with its modal damping, on supports."""
    if isinstance(rotor, RotorBasis):
        damping = rotor.damping
    elif rotor.modal_damping > 0.0:
        damping = modal_damping_matrix(rotor)
    else:
        damping = np.zeros_like(rotor.mass)
    rows = [rotor.node_row(support.node) for support in supports]
    return planar_matrices(rotor.mass, rotor.stiffness, damping, rotor.polar, rows, supports)


def whirl_modes(
    rotor: RotorFE | RotorBasis, speed: float, supports: Sequence[Support] = (), count: int | None = None
) -> WhirlModes:
    """Damped modes of a rotor, full or reduced, that turns at a speed [rad/s] on supports, lowest first.

    Overdamped motion and the drift of a free rotor (below 0.05 Hz) are no modes.
    """
    system = matrices_of(rotor, supports)
    values, vectors = _eigenpairs(system, speed)
    kept = np.flatnonzero(values.imag > 2.0 * np.pi * LOWEST_FREQUENCY)
    kept = kept[np.argsort(values[kept].imag, kind="stable")][:count]
    values, vectors = values[kept], vectors[:, kept]
    vectors = vectors / np.sqrt(np.einsum("ik,ij,jk->k", vectors.conj(), system.mass, vectors).real)
    shapes = _at_nodes(rotor, system, vectors)
    flat = shapes.reshape(len(shapes), 2 * shapes.shape[1])
    largest = flat[np.arange(len(flat)), np.argmax(np.abs(flat), axis=1)]
    return WhirlModes(
        speed=speed,
        eigenvalue=values,
        whirl=_whirl_index(system, vectors) * (1.0 if speed >= 0.0 else -1.0),
        shapes=np.asarray(shapes / largest[:, None, None]),
        vectors=vectors,
    )


def unbalance_response(
    rotor: RotorFE | RotorBasis,
    speeds: ArrayLike,
    unbalances: Mapping[int, complex],
    supports: Sequence[Support] = (),
) -> ComplexArray:
    """Steady synchronous motion (x, y) at the nodes [m], ``Re(value · e^(jωt))``, at speeds [rad/s], shape
    (S, N, 2).

    Unbalances [kg m] by node number are complex: magnitude and angle from +x at rotor angle 0.
    """
    system = matrices_of(rotor, supports)
    force = _turning_force(rotor, system, unbalances)
    grid = np.atleast_1d(np.asarray(speeds, dtype=np.float64))
    return _at_nodes(rotor, system, np.array([_steady(system, force, omega) for omega in grid]).T)


def _turning_force(
    rotor: RotorFE | RotorBasis, system: PlanarMatrices, unbalances: Mapping[int, complex]
) -> ComplexArray:
    n, m = system.plane_size, system.rotor_size
    force = np.zeros(2 * n, dtype=np.complex128)
    for node, unbalance in unbalances.items():
        force[:m] += unbalance * rotor.node_row(node)
        force[n : n + m] += -1j * unbalance * rotor.node_row(node)
    return force


def _steady(system: PlanarMatrices, force: ComplexArray, omega: float) -> ComplexArray:
    coupling = system.damping + omega * system.gyroscopic
    stiffness = system.stiffness_at(1j * omega) if system.relaxing else system.stiffness
    dynamic = stiffness - omega**2 * system.mass + 1j * omega * coupling
    return np.asarray(np.linalg.solve(dynamic, omega**2 * force))


def _eigenpairs(system: PlanarMatrices, speed: float) -> tuple[ComplexArray, ComplexArray]:
    n = len(system.mass)
    try:
        lower = np.linalg.cholesky(system.mass)
    except np.linalg.LinAlgError:
        raise SimulationError(
            "the rotor has nodes without mass or inertia, so its whirling modes are not all finite. Give the "
            "shaft a density, or reduce the rotor to its rigid modes."
        ) from None
    inverse = np.linalg.inv(lower)
    stiffness = inverse @ system.stiffness @ inverse.T
    coupling = inverse @ (system.damping + speed * system.gyroscopic) @ inverse.T
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -coupling]])
    if system.relaxing:
        # the stretch of what relaxes is a state of its own: exact, where a complex stiffness at the frequency
        # of a mode would have to be iterated for each
        rows = np.vstack([rows for rows, _ in system.relaxing]) @ inverse.T
        springs = np.repeat([branch.stiffness for _, branch in system.relaxing], 2)
        rates = np.repeat([1.0 / branch.time for _, branch in system.relaxing], 2)
        none = np.zeros((n, len(rows)))
        above = np.hstack([state, np.vstack([none, -rows.T * springs])])
        state = np.vstack([above, np.hstack([none.T, rows, -np.diag(rates)])])
    values, vectors = np.linalg.eig(state)
    return values.astype(np.complex128), (inverse.T @ vectors[:n]).astype(np.complex128)


def _whirl_index(system: PlanarMatrices, vectors: ComplexArray) -> Array:
    n = system.plane_size
    x, y = vectors[:n], vectors[n:]
    mass = system.mass[:n, :n]
    forward, backward = x + 1j * y, x - 1j * y
    with_spin = np.einsum("ik,ij,jk->k", forward.conj(), mass, forward).real
    against = np.einsum("ik,ij,jk->k", backward.conj(), mass, backward).real
    return np.asarray((with_spin - against) / (with_spin + against))


def _at_nodes(rotor: RotorFE | RotorBasis, system: PlanarMatrices, vectors: ComplexArray) -> ComplexArray:
    """Displacement (x, y) at the nodes for vectors (2n, K): shape (K, N, 2)."""
    n, m = system.plane_size, system.rotor_size
    planes = [vectors[:m], vectors[n : n + m]]
    if isinstance(rotor, RotorBasis):
        planes = [rotor.shapes @ plane for plane in planes]
    return np.stack([plane[0::2].T for plane in planes], axis=-1)
