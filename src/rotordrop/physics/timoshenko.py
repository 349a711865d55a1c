"""Element matrices of a rotating Timoshenko beam: stiffness, consistent mass, polar inertia.

One plane at a time, degrees of freedom ``[u_1, ψ_1, u_2, ψ_2]``: displacement [m] and inclination of the
cross-section towards +u [rad] at both ends. Both planes of a round shaft share the matrices.
The shape functions are the exact static solution, so nodes deflect exactly under loads at nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics.linear_algebra import product

_INNER, _OUTER = (math.sqrt(3.0 / 7.0 + sign * 2.0 / 7.0 * math.sqrt(1.2)) for sign in (-1.0, 1.0))
_GAUSS_POINTS = np.array([-_OUTER, -_INNER, _INNER, _OUTER])
_GAUSS_WEIGHTS = np.array([18.0 + sign * math.sqrt(30.0) for sign in (-1.0, 1.0, 1.0, -1.0)]) / 36.0
"""Gauss' rule with four points, in closed form: exact to degree seven; the mass matrix has six."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """Cross-section of a shaft, as stiffnesses and as inertias per length.

    Notes
    -----
    Source: Timoshenko beam theory.
    """

    bending_stiffness: float
    """E I [N m²]."""
    shear_stiffness: float
    """κ G A [N]; infinite for a beam that does not shear."""
    mass: float
    """ρ A [kg/m]."""
    diametral_inertia: float
    """ρ I [kg m]; zero switches rotary inertia off."""
    polar_inertia: float
    """ρ I_p [kg m]; zero switches the gyroscopic effect off."""


def shear_coefficient(nu: float, diameter_ratio: float = 0.0) -> float:
    """Shear coefficient κ [1] of a round section by Cowper, from ν [1] and inner over outer diameter [1].

    Source: Cowper 1966, ``6 (1+ν)(1+m²)² / ((7+6ν)(1+m²)² + (20+12ν) m²)``; solid: ``6 (1+ν)/(7+6ν)``.
    """
    ratio = diameter_ratio * diameter_ratio
    square = (1.0 + ratio) * (1.0 + ratio)
    return 6.0 * (1.0 + nu) * square / ((7.0 + 6.0 * nu) * square + (20.0 + 12.0 * nu) * ratio)


def round_section(D: float, d: float, E: float, nu: float, rho: float) -> Section:
    """Section of a solid or hollow round shaft.

    Parameters
    ----------
    D, d : float
        Outer and inner diameter [m].
    E : float
        Young's modulus [Pa].
    nu : float
        Poisson ratio [1].
    rho : float
        Density [kg/m³].

    Returns
    -------
    Section
        Stiffnesses [N m², N] and inertias per length [kg/m, kg m].

    Notes
    -----
    Source: Timoshenko beam theory with Cowper's shear coefficient.
    """
    outer, inner = D * D, d * d
    area = 0.25 * math.pi * (outer - inner)
    second_moment = math.pi / 64.0 * (outer * outer - inner * inner)
    shear_modulus = E / (2.0 * (1.0 + nu))
    return Section(
        bending_stiffness=E * second_moment,
        shear_stiffness=shear_coefficient(nu, d / D) * shear_modulus * area,
        mass=rho * area,
        diametral_inertia=rho * second_moment,
        polar_inertia=2.0 * rho * second_moment,
    )


def with_layer(section: Section, D: float, D_layer: float, rho_layer: float) -> Section:
    """Section with a layer from diameter D to D_layer [m] that adds inertia but no stiffness.

    Laminations and magnet bands; density [kg/m³]. Source: definition.
    """
    outer, inner = D_layer * D_layer, D * D
    second_moment = math.pi / 64.0 * (outer * outer - inner * inner)
    return replace(
        section,
        mass=section.mass + rho_layer * 0.25 * math.pi * (outer - inner),
        diametral_inertia=section.diametral_inertia + rho_layer * second_moment,
        polar_inertia=section.polar_inertia + 2.0 * rho_layer * second_moment,
    )


def shear_parameter(section: Section, length: float) -> float:
    """Shear over bending flexibility [1] of an element of a length [m], ``Φ = 12 E I / (κ G A L²)``.

    Source: Przemieniecki, Theory of Matrix Structural Analysis.
    """
    return 12.0 * section.bending_stiffness / (section.shear_stiffness * length * length)


def shape_functions(xi: Array, length: float, phi: float) -> tuple[Array, Array]:
    """Displacement [m] and inclination [rad] along an element for unit values of its four degrees of freedom.

    Parameters
    ----------
    xi : ndarray, shape (P,)
        Places along the element, 0 to 1 [1].
    length : float
        Length of the element [m].
    phi : float
        Shear parameter Φ [1].

    Returns
    -------
    tuple of ndarray, each shape (P, 4)
        ``N_u`` [m/m, m/rad] and ``N_ψ`` [rad/m, rad/rad].

    Notes
    -----
    Source: static solution of the Timoshenko beam (Przemieniecki; Friswell et al., Dynamics of Rotating
    Machines, ch. 5).
    """
    L = length
    square = xi * xi
    cube = square * xi
    N_u = [
        1.0 - 3.0 * square + 2.0 * cube + phi * (1.0 - xi),
        L * (xi - 2.0 * square + cube + 0.5 * phi * (xi - square)),
        3.0 * square - 2.0 * cube + phi * xi,
        L * (cube - square - 0.5 * phi * (xi - square)),
    ]
    N_psi = [
        6.0 / L * (square - xi),
        1.0 - 4.0 * xi + 3.0 * square + phi * (1.0 - xi),
        6.0 / L * (xi - square),
        3.0 * square - 2.0 * xi + phi * xi,
    ]
    return np.stack(N_u, axis=-1) / (1.0 + phi), np.stack(N_psi, axis=-1) / (1.0 + phi)


def element_stiffness(section: Section, length: float) -> Array:
    """Stiffness matrix [N/m, N, N m] of an element of a length [m]; shape (4, 4).

    Source: exact for loads at nodes; Przemieniecki, Theory of Matrix Structural Analysis.
    """
    L, phi = length, shear_parameter(section, length)
    near, far = (4.0 + phi) * L * L, (2.0 - phi) * L * L
    matrix = np.array(
        [
            [12.0, 6.0 * L, -12.0, 6.0 * L],
            [6.0 * L, near, -6.0 * L, far],
            [-12.0, -6.0 * L, 12.0, -6.0 * L],
            [6.0 * L, far, -6.0 * L, near],
        ]
    )
    return matrix * (section.bending_stiffness / (L * L * L * (1.0 + phi)))


def element_mass(section: Section, length: float) -> Array:
    """Consistent mass matrix of an element of a length [m], with rotary inertia; shape (4, 4).

    Units [kg, kg m, kg m²]. ``∫ (ρA N_uᵀ N_u + ρI N_ψᵀ N_ψ) dz``. Source: Nelson 1980; Neisi 2020, eq. (1).
    """
    N_u, N_psi, weight = _at_gauss_points(section, length)
    translation, rotation = _products(weight, N_u), _products(weight, N_psi)
    return np.asarray(section.mass * translation + section.diametral_inertia * rotation)


def element_polar(section: Section, length: float) -> Array:
    """Polar inertia matrix [kg, kg m, kg m²] of an element of a length [m]; shape (4, 4).

    ``∫ ρI_p N_ψᵀ N_ψ dz``: times the speed it couples the planes, ``+ω P q̇_y`` in the equation of x and
    ``−ω P q̇_x`` in that of y. Source: Nelson 1980; Neisi 2020, eq. (1), gyroscopic matrix.
    """
    _, N_psi, weight = _at_gauss_points(section, length)
    return np.asarray(section.polar_inertia * _products(weight, N_psi))


def _at_gauss_points(section: Section, length: float) -> tuple[Array, Array, Array]:
    xi = 0.5 * (1.0 + _GAUSS_POINTS)
    N_u, N_psi = shape_functions(xi, length, shear_parameter(section, length))
    return N_u, N_psi, 0.5 * length * _GAUSS_WEIGHTS


def _products(weight: Array, N: Array) -> Array:
    """``∫ Nᵀ N dz``, symmetric to the last bit."""
    whole = product((N * weight[:, None]).T, N)
    return 0.5 * (whole + whole.T)
