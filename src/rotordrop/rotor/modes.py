"""Undamped modes of the rotor at standstill: free-free and on springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import SimulationError
from rotordrop.physics.linear_algebra import generalised_eigen, product
from rotordrop.rotor.assembly import RotorFE

Array = NDArray[np.float64]

N_RIGID = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarModes:
    """Undamped modes of one plane, lowest first, normalised to unit modal mass."""

    omega: Array
    """Natural frequencies [rad/s], shape (m,)."""
    shapes: Array
    """Displacement and slope per node; the largest displacement of each mode is positive, shape (2N, m)."""

    @property
    def frequency(self) -> Array:
        """Natural frequencies [Hz], shape (m,)."""
        return self.omega / (2.0 * np.pi)


def rigid_modes(fe: RotorFE) -> Array:
    """The rigid modes with unit modal mass, shape (2N, 2): shift, and turn about the centre of gravity."""
    shift, turn = fe.rigid_shapes.T
    about_centre = turn - fe.centre_of_gravity * shift
    return np.column_stack([shift / np.sqrt(fe.total_mass), about_centre / np.sqrt(fe.diametral_inertia)])


def free_free_modes(fe: RotorFE, count: int | None = None) -> PlanarModes:
    """Modes of the free rotor: two rigid ones with frequency exactly 0, then bending.

    Parameters
    ----------
    fe : RotorFE
        The rotor.
    count : int, optional
        Number of modes, the rigid ones included; all by default.
    """
    count = fe.size if count is None else count
    if not N_RIGID <= count <= fe.size:
        raise SimulationError(
            f"{count} modes per plane were asked for; this rotor has {fe.size}, of which {N_RIGID} are rigid "
            f"and always needed. Choose {N_RIGID} to {fe.size}."
        )
    rigid = rigid_modes(fe)
    if count == N_RIGID:
        return PlanarModes(omega=np.zeros(N_RIGID), shapes=rigid)
    eigenvalues, vectors = _eigenpairs(fe.stiffness, fe.mass, count)
    bending = vectors[:, N_RIGID:]
    bending = bending - product(rigid, product(product(rigid.T, fe.mass), bending))
    shapes = np.column_stack([rigid, with_positive_peak(bending)])
    omega = np.sqrt(np.concatenate([np.zeros(N_RIGID), eigenvalues[N_RIGID:]]))
    return PlanarModes(omega=omega, shapes=shapes)


def modes_on_springs(fe: RotorFE, springs: dict[int, float], count: int | None = None) -> PlanarModes:
    """Modes of one plane with the rotor on springs to the ground at standstill.

    Parameters
    ----------
    fe : RotorFE
        The rotor.
    springs : dict
        Stiffness [N/m] by node number, counted from 1.
    count : int, optional
        Number of modes; all by default.
    """
    stiffness = fe.stiffness.copy()
    for node, value in springs.items():
        i = fe.node_index(node)
        stiffness[i, i] += value
    eigenvalues, vectors = _eigenpairs(stiffness, fe.mass, fe.size if count is None else count)
    return PlanarModes(omega=np.sqrt(np.maximum(eigenvalues, 0.0)), shapes=with_positive_peak(vectors))


def modal_damping_matrix(fe: RotorFE) -> Array:
    """Damping matrix [N s/m] that gives every free-free bending mode the modal damping, shape (2N, 2N)."""
    modes = free_free_modes(fe)
    momentum = product(fe.mass, modes.shapes)
    return product(momentum * (2.0 * fe.modal_damping * modes.omega), momentum.T)


def with_positive_peak(shapes: Array) -> Array:
    """The same shapes (2N, m) with signs such that each largest displacement is positive."""
    displacement = shapes[0::2]
    peak = np.argmax(np.abs(displacement), axis=0)
    signs = np.sign(displacement[peak, np.arange(shapes.shape[1])])
    return shapes * np.where(signs == 0.0, 1.0, signs)


def _eigenpairs(stiffness: Array, mass: Array, count: int) -> tuple[Array, Array]:
    try:
        values, vectors = generalised_eigen(stiffness, mass)
    except np.linalg.LinAlgError:
        bare = [1 + i // 2 for i in range(0, len(mass), 2) if min(mass[i, i], mass[i + 1, i + 1]) <= 0.0]
        where = f"at node {bare[0]}" if bare else "somewhere"
        raise SimulationError(
            f"the rotor has neither mass nor inertia {where}, so not all of its modes are finite. "
            "Give the shaft a density, or ask for the 2 rigid modes only."
        ) from None
    return values[:count], vectors[:, :count]
