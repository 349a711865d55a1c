"""From the description of a rotor to the mass, stiffness and polar matrices of its finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.elements.rotor import element_factors
from rotordrop.errors import SimulationError, UsageError
from rotordrop.physics import timoshenko
from rotordrop.physics.linear_algebra import generalised_eigen, product
from rotordrop.physics.timoshenko import Section

if TYPE_CHECKING:
    from rotordrop.elements.rotor import Rotor
    from rotordrop.machine import Machine

DEFAULT_MODAL_DAMPING = 0.005


@dataclass(frozen=True, kw_only=True)
class PointMass:
    """A disc or mass that sits on one node, small against the rotor's length."""

    node: int
    """Node, counted from 1."""
    mass: float
    """Mass [kg]."""
    polar_inertia: float = 0.0
    diametral_inertia: float = 0.0
    """Inertia about the rotor axis and about a diameter [kg m²]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RotorFE:
    """Finite elements of a free rotor; the two planes share the matrices.

    ``M q̈x + K qx + ω P q̇y + ω̇ P qy = fx`` and ``M q̈y + K qy − ω P q̇x − ω̇ P qx = fy``.
    """

    node_positions: Array
    """Positions along z [m]; node 1 of the files is index 0, shape (N,)."""
    mass: Array
    stiffness: Array
    polar: Array
    """M, K and P in ``[u_1, u_1', u_2, u_2', …]``, displacement [m] and slope [rad] per node, shape (2N, 2N).
    """
    modal_damping: float = DEFAULT_MODAL_DAMPING
    """Damping ratio of the free-free flexible modes [1]."""

    @property
    def size(self) -> int:
        """Degrees of freedom per plane."""
        return len(self.mass)

    @property
    def rigid_shapes(self) -> Array:
        """Shift by 1 m and turn by 1 rad about z = 0, shape (2N, 2)."""
        shapes = np.zeros((self.size, 2))
        shapes[0::2, 0] = 1.0
        shapes[0::2, 1] = self.node_positions
        shapes[1::2, 1] = 1.0
        return shapes

    @cached_property
    def _rigid_mass(self) -> Array:
        return product(product(self.rigid_shapes.T, self.mass), self.rigid_shapes)

    @property
    def total_mass(self) -> float:
        """Mass of the rotor [kg]."""
        return float(self._rigid_mass[0, 0])

    @property
    def centre_of_gravity(self) -> float:
        """Position of the centre of gravity along z [m]."""
        return float(self._rigid_mass[0, 1] / self._rigid_mass[0, 0])

    @property
    def diametral_inertia(self) -> float:
        """Inertia about a diameter through the centre of gravity [kg m²]."""
        return float(self._rigid_mass[1, 1] - self._rigid_mass[0, 1] * self.centre_of_gravity)

    @property
    def polar_inertia(self) -> float:
        """Inertia about the rotor axis [kg m²], which drives the spin."""
        return float(product(product(self.rigid_shapes[:, 1], self.polar), self.rigid_shapes[:, 1]))

    def as_json(self) -> dict[str, Any]:
        """Mass, centre of gravity and inertias, ready for JSON [SI]."""
        return stated(
            self, "mass_kg=total_mass centre_of_gravity_m polar_inertia_kg_m2 diametral_inertia_kg_m2"
        )

    def node_index(self, node: int) -> int:
        """Index of the displacement of a node (counted from 1) among the degrees of freedom of a plane."""
        count = len(self.node_positions)
        if not 1 <= node <= count:
            raise UsageError(f"node {node} is not on the rotor, which has nodes 1 to {count}")
        return 2 * (node - 1)

    def node_row(self, node: int) -> Array:
        """Row that picks the displacement of a node (counted from 1), shape (2N,)."""
        row = np.zeros(self.size)
        row[self.node_index(node)] = 1.0
        return row

    def slope_row(self, node: int) -> Array:
        """Row that picks the slope of a node (counted from 1), shape (2N,)."""
        row = np.zeros(self.size)
        row[self.node_index(node) + 1] = 1.0
        return row


def assemble(
    node_positions: Sequence[float] | Array,
    sections: Sequence[Section],
    point_masses: Sequence[PointMass] = (),
    *,
    modal_damping: float = DEFAULT_MODAL_DAMPING,
) -> RotorFE:
    """Assemble N − 1 sections between nodes at increasing positions [m], (N,), with discs and masses on
    nodes.
    """
    z = np.asarray(node_positions, dtype=np.float64)
    if len(sections) != len(z) - 1:
        raise UsageError(f"{len(z)} nodes need {len(z) - 1} sections between them, not {len(sections)}")
    if not np.all(np.diff(z) > 0.0):
        bad = int(np.argmin(np.diff(z))) + 1
        raise UsageError(
            f"node positions must increase: node {bad} is at {z[bad - 1]} m, node {bad + 1} at {z[bad]} m"
        )
    mass, stiffness, polar = (np.zeros((2 * len(z), 2 * len(z))) for _ in range(3))
    for e, section in enumerate(sections):
        length = float(z[e + 1] - z[e])
        here = slice(2 * e, 2 * e + 4)
        mass[here, here] += timoshenko.element_mass(section, length)
        stiffness[here, here] += timoshenko.element_stiffness(section, length)
        polar[here, here] += timoshenko.element_polar(section, length)
    fe = RotorFE(node_positions=z, mass=mass, stiffness=stiffness, polar=polar, modal_damping=modal_damping)
    for body in point_masses:
        i = fe.node_index(body.node)
        mass[i, i] += body.mass
        mass[i + 1, i + 1] += body.diametral_inertia
        polar[i + 1, i + 1] += body.polar_inertia
    return fe


def build_rotor_fe(machine: Machine) -> RotorFE:
    """Finite elements of a machine's rotor: shaft, layers, discs (Neisi 2020, eq. (1))."""
    return rotor_fe(machine.rotor)


def rotor_fe(rotor: Rotor) -> RotorFE:
    """Finite elements of a rotor alone. Source: Neisi 2020, eq. (1)."""
    factor = 1.0 if rotor.stiffness_factor is None else float(rotor.stiffness_factor)
    densities, stiffnesses = element_factors(rotor)
    sections = []
    for e, element in enumerate(rotor.elements):
        outer = float(element.outer_diameter)
        heavier, stiffer = float(densities[e]), factor * float(stiffnesses[e])
        section = timoshenko.round_section(
            outer,
            float(element.inner_diameter),
            stiffer * float(element.youngs_modulus),
            float(element.poisson_ratio),
            heavier * float(element.density),
        )
        if element.layer_diameter is not None:
            section = timoshenko.with_layer(
                section, outer, float(element.layer_diameter), heavier * float(element.layer_density)
            )
        sections.append(section)
    discs = [
        PointMass(
            node=disc.node,
            mass=float(disc.mass),
            polar_inertia=float(disc.polar_inertia),
            diametral_inertia=float(disc.diametral_inertia),
        )
        for disc in rotor.discs
    ]
    return assemble(rotor.node_positions, sections, discs, modal_damping=float(rotor.modal_damping))


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
    """Modes of the free rotor: two rigid ones with frequency exactly 0, then bending; all of them without a
    count.
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
    """Modes of one plane with the rotor on springs to the ground at standstill, [N/m] by node from 1."""
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
