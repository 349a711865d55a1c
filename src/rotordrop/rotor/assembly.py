"""From the description of a rotor to the mass, stiffness and polar matrices of its finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.beam import element_factors, is_beam
from rotordrop.errors import UsageError
from rotordrop.physics import timoshenko
from rotordrop.physics.linear_algebra import product
from rotordrop.physics.timoshenko import Section

if TYPE_CHECKING:
    from rotordrop.elements.rotor import Rotor
    from rotordrop.machine import Machine

Array = NDArray[np.float64]

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
    """Assemble shaft sections and point masses.

    Parameters
    ----------
    node_positions : sequence of float, length N
        Positions along z [m], increasing.
    sections : sequence of Section, length N − 1
        Cross-section between each node and the next.
    point_masses : sequence of PointMass
        Discs and masses on nodes.
    modal_damping : float
        Damping ratio of the free-free flexible modes [1].
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
    densities, stiffnesses = element_factors(rotor) if is_beam(rotor) else (None, None)
    sections = []
    for e, element in enumerate(rotor.elements):
        outer = float(element.outer_diameter)
        heavier = 1.0 if densities is None else float(densities[e])
        stiffer = factor if stiffnesses is None else factor * float(stiffnesses[e])
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
