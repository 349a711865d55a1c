"""Fewer coordinates for the rotor: free-free modes, and attachment modes for its static flexibility.

The contact force of a drop acts at the touchdown bearings. What the truncated modes would still give way
there under a static force, the residual flexibility, is one extra shape per bearing node; with it a
handful of modes does what four times as many plain ones do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.physics.contact import contact_tangent
from rotordrop.physics.linear_algebra import orthonormal, product, symmetric_eigen
from rotordrop.require import require
from rotordrop.rotor.assembly import (
    N_RIGID,
    PlanarModes,
    RotorFE,
    build_rotor_fe,
    free_free_modes,
    rigid_modes,
    with_positive_peak,
)
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.units import GRAVITY

_DEPENDENT = 1e-8
"""Share of a shape below which what is left of it beside the others is arithmetic [1] (chosen)."""

_FEWEST_MODES = 6
"""Free-free modes, the two rigid ones included, at least."""

_SAG = 1e-7
"""Deflection g/ω² of a mode [m] from which it is among them: a fifth of the noise of a good sensor.

Source: with six modes the fall of a rotor of 5 t that bends at 39 Hz and more was dated 0.21 ms early, six of
its standard errors, and another one 0.38 ms; with the modes of this limit by 0.001 and 0.004 ms.
"""


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """How many shapes describe the rotor in each plane."""

    modes: int | None = 14
    """Free-free modes, the two rigid ones included; None for all finite-element coordinates."""
    attachment: bool = True
    """Whether residual-flexibility modes at the touchdown bearings are added."""

    def __post_init__(self) -> None:
        require(self.modes, "modes", int, none=True, least=N_RIGID)
        require(self.attachment, "attachment", bool)


PRESETS = {
    "accurate": Reduction(modes=14, attachment=True),
    "quick": Reduction(modes=6, attachment=True),
    "full": Reduction(modes=None, attachment=False),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class RotorBasis:
    """Shapes of the reduced rotor, the same in both planes, with unit modal mass and diagonal stiffness."""

    shapes: Array
    """Displacement [1/sqrt(kg)] and slope per node; amplitudes have the unit sqrt(kg) m, shape (2N, m)."""
    eigenvalues: Array
    """Modal stiffness [rad²/s²]; exactly 0 for the rigid modes, which come first, shape (m,)."""
    polar: Array
    """Polar inertia matrix [1], shape (m, m)."""
    damping: Array
    """Modal damping of the free-free flexible modes, projected [1/s], shape (m, m)."""
    reduction: Reduction
    """The choice that made it."""
    n_rigid: int = N_RIGID
    """Number of rigid modes."""

    @property
    def size(self) -> int:
        """Coordinates per plane."""
        return int(self.shapes.shape[1])

    @property
    def mass(self) -> Array:
        """Mass matrix of the coordinates: unity, shape (m, m)."""
        return np.eye(self.size)

    @property
    def stiffness(self) -> Array:
        """Stiffness matrix of the coordinates [rad²/s²], diagonal, shape (m, m)."""
        return np.diag(self.eigenvalues)

    @property
    def description(self) -> str:
        """The reduction in words."""
        if self.reduction.modes is None:
            return f"all {self.size} finite-element coordinates per plane"
        extra = self.size - self.reduction.modes
        text = f"{self.reduction.modes} free-free modes"
        return f"{text} and {extra} attachment modes per plane" if extra else f"{text} per plane"

    def node_row(self, node: int) -> Array:
        """Displacement at a node (counted from 1) per unit amplitude, shape (m,)."""
        return np.asarray(self.shapes[self._index(node)])

    def slope_row(self, node: int) -> Array:
        """Slope at a node (counted from 1) per unit amplitude, shape (m,)."""
        return np.asarray(self.shapes[self._index(node) + 1])

    def _index(self, node: int) -> int:
        count = len(self.shapes) // 2
        if not 1 <= node <= count:
            raise UsageError(f"node {node} is not on the rotor, which has nodes 1 to {count}")
        return 2 * (node - 1)


def modes_that_sag(fe: RotorFE) -> int:
    """Number of free-free modes that sensors see give way when the rotor is let go."""
    seen = np.count_nonzero(free_free_modes(fe).omega ** 2 < GRAVITY / _SAG)
    return min(max(_FEWEST_MODES, int(seen)), fe.size - N_RIGID)


def reduction_of(choice: str | Reduction) -> Reduction:
    """The reduction of a preset name, or the reduction itself."""
    if isinstance(choice, Reduction):
        return choice
    require(choice, "reduction", str, among=PRESETS, hint="Or give Reduction(modes=…, attachment=…)")
    return PRESETS[choice]


def reduce_rotor(
    fe: RotorFE, reduction: str | Reduction = "accurate", attachment_nodes: Sequence[int] = ()
) -> RotorBasis:
    """Reduce a rotor to free-free modes and attachment modes at nodes (counted from 1), Ritz-orthonormalised.

    The shapes have ``shapesᵀ M shapes = 1`` and ``shapesᵀ K shapes = diag(eigenvalues)``.
    """
    choice = reduction_of(reduction)
    if choice.modes is not None:  # a rotor of few nodes has fewer
        choice = replace(choice, modes=min(choice.modes, fe.size))
    nodes = tuple(dict.fromkeys(attachment_nodes)) if choice.attachment else ()
    if choice.modes is None or not nodes:
        modes = free_free_modes(fe, choice.modes)
        rate = 2.0 * fe.modal_damping * modes.omega
        return _basis(fe, modes.shapes, modes.omega**2, np.diag(rate), choice)
    everything = free_free_modes(fe)
    kept = choice.modes
    inner, eigenvalues, damping = attachment_coordinates(fe, everything, kept, nodes)
    extra = with_positive_peak(product(everything.shapes[:, kept:], inner))
    signs = np.sign(np.sum(extra * product(fe.mass, product(everything.shapes[:, kept:], inner)), axis=0))
    shapes = np.column_stack([everything.shapes[:, :kept], extra])
    projected = np.zeros((shapes.shape[1], shapes.shape[1]))
    projected[:kept, :kept] = np.diag(2.0 * fe.modal_damping * everything.omega[:kept])
    projected[kept:, kept:] = signs[:, None] * damping * signs
    values = np.concatenate([everything.omega[:kept] ** 2, eigenvalues])
    return _basis(fe, shapes, values, projected, choice)


def attachment_coordinates(
    fe: RotorFE, modes: PlanarModes, kept: int, nodes: tuple[int, ...]
) -> tuple[Array, Array, Array]:
    """Attachment modes from truncated ones: coefficients (t, a), eigenvalues (a,), damping (a, a)."""
    rows = np.array([fe.node_row(node) for node in nodes])
    omega = modes.omega[kept:]
    residual = product(modes.shapes[:, kept:].T, rows.T) / omega[:, None] ** 2
    basis = orthonormal(residual, _DEPENDENT)
    eigenvalues, rotation = symmetric_eigen(product(basis.T, omega[:, None] ** 2 * basis))
    inner = product(basis, rotation)
    damping = product(inner.T, 2.0 * fe.modal_damping * omega[:, None] * inner)
    return inner, eigenvalues, damping


def _basis(
    fe: RotorFE, shapes: Array, eigenvalues: Array, damping: Array, reduction: Reduction
) -> RotorBasis:
    polar = product(product(shapes.T, fe.polar), shapes)
    return RotorBasis(
        shapes=shapes,
        eigenvalues=eigenvalues,
        polar=np.asarray(0.5 * (polar + polar.T)),
        damping=damping,
        reduction=reduction,
    )


PEAK_OVER_WEIGHT = 10.0
"""Usual ratio of the largest force of a drop to the static load [1]: 11 to 17 on machines of 13 to 130 kg."""


def contact_frequency(machine: Machine, fe: RotorFE | None = None) -> float:
    """Frequency [Hz] of rotor and support against each other in contact, of the stiffest bearing."""
    fe = build_rotor_fe(machine) if fe is None else fe
    rigid = rigid_modes(fe)
    found = []
    for bearing, share in zip(machine.touchdown_bearings, bearing_load_shares(machine, fe), strict=True):
        force = PEAK_OVER_WEIGHT * float(share)
        contact = contact_tangent(bearing.contact.law, force)
        stiffness = 1.0 / (1.0 / contact + 1.0 / numbers_of(bearing).tangent_stiffness(force))
        rotor = float(np.sum(rigid[2 * (bearing.node - 1)] ** 2))
        found.append(math.sqrt(stiffness * (rotor + 1.0 / float(bearing.support.mass))) / (2.0 * math.pi))
    return max(found)


def reduction_for_contact(machine: Machine, *, least: int, reach: float) -> Reduction:
    """Basis with the modes up to ``reach`` times the contact frequency, and ``least`` modes (two rigid ones
    included).
    """
    fe = build_rotor_fe(machine)
    frequency = free_free_modes(fe).frequency
    needed = int(np.searchsorted(frequency, reach * contact_frequency(machine, fe))) + 1
    return Reduction(modes=min(max(least, needed), fe.size), attachment=True)
