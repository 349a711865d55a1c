"""Hertz contact of ball and race: from curvatures to stiffness, contact ellipse and pressure.

The exact solution with complete elliptic integrals. The curvatures decide the shape of the ellipse, the two
materials only its scale, so that ceramic balls on steel rings need nothing special.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics.elementary import cos_each, cube_root_each, exp_each, ln_each

_MEANS = 8
"""The arithmetic and the geometric mean agree to the last bit after six steps from 1 and 1e-6."""

_DUPLICATIONS = 9
"""Each brings the arguments four times closer; the series then leaves the sixth power of what is left."""


def complete_second(q: float | Array) -> Any:
    """Complete elliptic integral of the second kind E(k) [1], from q = 1 − k² > 0.

    Source: arithmetic-geometric mean, DLMF 19.8.6.
    """
    of_minor = np.asarray(q, dtype=np.float64)
    a, b, total, weight = np.ones_like(of_minor), np.sqrt(of_minor), 0.5 * (1.0 - of_minor), 1.0
    for _ in range(_MEANS):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        total = total + weight * c * c
        weight *= 2.0
    return (0.5 * math.pi / a * (1.0 - total))[()]


def carlson_d(y: float | Array, z: float | Array) -> Any:
    """Carlson's symmetric integral R_D(0, y, z) [1].

    Source: duplication theorem; Carlson, Numerical Algorithms 10 (1995) 13, algorithm 4.
    """
    y, z = np.broadcast_arrays(np.asarray(y, dtype=np.float64), np.asarray(z, dtype=np.float64))
    x = np.zeros_like(y)
    total, weight = np.zeros_like(y), 1.0
    for _ in range(_DUPLICATIONS):
        root = np.sqrt(z)
        shift = np.sqrt(x) * np.sqrt(y) + np.sqrt(x) * root + np.sqrt(y) * root
        total = total + weight / (root * (z + shift))
        weight *= 0.25
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
    mean = 0.2 * (x + y + 3.0 * z)
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -(dx + dy) / 3.0
    e_2, e_3 = dx * dy - 6.0 * dz * dz, (3.0 * dx * dy - 8.0 * dz * dz) * dz
    series = 1.0 - 3.0 / 14.0 * e_2 + e_3 / 6.0 + 9.0 / 88.0 * e_2 * e_2
    return (3.0 * total + weight * series / (mean * np.sqrt(mean)))[()]


ArrayLike = float | Array

_SECANT_STEPS = 40


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Point contact of two bodies, ready to be loaded: all its laws are powers of the load.

    Notes
    -----
    Source: Hertz; Harris, Rolling Bearing Analysis, chapter on contact stress and deformation.
    """

    stiffness: ArrayLike
    """``Q = stiffness · δ^1.5`` [N/m^1.5]."""
    semi_major_coefficient: ArrayLike
    semi_minor_coefficient: ArrayLike
    """``a, b = coefficient · Q^(1/3)`` [m/N^(1/3)]."""

    @property
    def stress_coefficient(self) -> ArrayLike:
        """Largest pressure per cube root of the load [Pa/N^(1/3)]. Source: Neisi 2020, eq. (7)."""
        return 1.5 / (math.pi * self.semi_major_coefficient * self.semi_minor_coefficient)

    def semi_axes(self, Q: ArrayLike) -> tuple[ArrayLike, ArrayLike]:
        """Half length and half width [m] of the contact ellipse under a load [N].

        Source: Harris, Rolling Bearing Analysis.
        """
        root = cube_root_each(Q)
        return self.semi_major_coefficient * root, self.semi_minor_coefficient * root

    def approach(self, Q: ArrayLike) -> Any:
        """Approach of the two bodies [m] under a load [N]. Source: inverse of Neisi 2020, eq. (6)."""
        root = cube_root_each(Q / self.stiffness)
        return root * root

    def maximum_pressure(self, Q: ArrayLike) -> Any:
        """Largest Hertz pressure [Pa], at the centre of the ellipse, under a load [N].

        Source: Neisi 2020, eq. (7); a* and b* there are the dimensional semi-axes.
        """
        return self.stress_coefficient * cube_root_each(Q)


def curvature_difference_of_ellipticity(kappa: ArrayLike) -> Any:
    """Curvature difference F(ρ) [1] of a contact ellipse with the axis ratio κ = a/b ≥ 1 [1].

    The textbook form ``((κ²+1) E − 2 K) / ((κ²−1) E)`` written with Carlson's integrals, which stays exact
    down to the circle. Source: Harris, Rolling Bearing Analysis, with DLMF 19.25.
    """
    q = 1.0 / np.square(kappa)
    return q * (carlson_d(1.0, q) - carlson_d(q, 1.0)) / (3.0 * complete_second(q))


def ellipticity(F_rho: ArrayLike) -> Any:
    """Axis ratio κ = a/b ≥ 1 [1] of the contact ellipse whose curvature difference is F(ρ) [1].

    Solved by secants in ``ln κ`` against ``atanh F``, nearly a straight line.
    Source: inverse of `curvature_difference_of_ellipticity`.
    """
    wanted = _artanh(np.asarray(F_rho, dtype=float))
    x_old, x = np.zeros_like(wanted), wanted / 0.75
    f_old = -wanted
    for _ in range(_SECANT_STEPS):
        f = _artanh(curvature_difference_of_ellipticity(exp_each(x))) - wanted
        slope = f - f_old
        step = np.divide(f * (x - x_old), slope, out=np.zeros_like(x), where=slope != 0.0)
        x_old, f_old, x = x, f, np.maximum(x - step, 0.0)
        if np.all(np.abs(step) <= 1e-15 * (1.0 + x)):
            break
    return exp_each(x)


def _artanh(x: Array) -> Any:
    return 0.5 * ln_each((1.0 + x) / (1.0 - x))


def contact_parameters(F_rho: ArrayLike) -> tuple[Any, Any, Any]:
    """Dimensionless contact parameters a*, b*, δ* [1] of a curvature difference F(ρ) [1].

    Source: Harris, Rolling Bearing Analysis, table of dimensionless contact parameters.
    """
    kappa = ellipticity(F_rho)
    q = 1.0 / np.square(kappa)
    E = complete_second(q)
    K = E + (1.0 - q) * carlson_d(q, 1.0) / 3.0
    square = kappa * kappa
    a_star = cube_root_each(2.0 * square * E / math.pi)
    b_star = cube_root_each(2.0 * E / (math.pi * kappa))
    delta_star = (2.0 * K / math.pi) * cube_root_each(math.pi / (2.0 * square * E))
    return a_star, b_star, delta_star


def compliance(E_1: float, nu_1: float, E_2: float, nu_2: float) -> float:
    """Contact compliance of a material pair [1/Pa], ``(1 − ν₁²)/E₁ + (1 − ν₂²)/E₂``.

    Young's moduli [Pa], Poisson ratios [1]. Source: Johnson, Contact Mechanics, ch. 4.
    """
    return (1.0 - nu_1 * nu_1) / E_1 + (1.0 - nu_2 * nu_2) / E_2


def point_contact(curvature_sum: ArrayLike, curvature_difference: ArrayLike, eta: float) -> Contact:
    """Stiffness and ellipse of a contact: curvature sum [1/m] and difference [1], material compliance [1/Pa].

    Source: Harris, Rolling Bearing Analysis, ch. on contact stress; Neisi 2020, eqs. (6) and (7).
    """
    a_star, b_star, delta_star = contact_parameters(curvature_difference)
    scale = cube_root_each(1.5 * eta / curvature_sum)
    approach = 0.5 * delta_star * scale * scale * curvature_sum
    return Contact(
        stiffness=1.0 / (approach * np.sqrt(approach)),
        semi_major_coefficient=a_star * scale,
        semi_minor_coefficient=b_star * scale,
    )


def race_curvatures(
    D_w: ArrayLike, D_pw: ArrayLike, f: ArrayLike, alpha: ArrayLike, *, inner: bool
) -> tuple[ArrayLike, ArrayLike]:
    """Curvature sum Σρ [1/m] and difference F(ρ) [1] of ball and race.

    Parameters
    ----------
    D_w, D_pw : float or ndarray
        Ball and pitch diameter [m].
    f : float or ndarray
        Groove conformity, groove radius over ball diameter [1].
    alpha : float or ndarray
        Nominal contact angle [rad].
    inner : bool
        Inner race (convex along the rolling direction) or outer race (concave).

    Returns
    -------
    tuple of float or ndarray
        Σρ [1/m], F(ρ) [1].

    Notes
    -----
    Source: Harris, Rolling Bearing Analysis, eqs. for ball-raceway curvature.
    """
    gamma = D_w * cos_each(alpha) / D_pw
    rolling = 2.0 * gamma / (1.0 - gamma) if inner else -2.0 * gamma / (1.0 + gamma)
    total = 4.0 - 1.0 / f + rolling
    return total / D_w, (1.0 / f + rolling) / total


def race_contact(
    D_w: ArrayLike, D_pw: ArrayLike, f: ArrayLike, alpha: ArrayLike, eta: float, *, inner: bool
) -> Contact:
    """Contact of a ball with the inner or outer race; arguments as in `race_curvatures`, compliance [1/Pa].

    Source: Harris, Rolling Bearing Analysis; Neisi 2020, eqs. (6) and (7).
    """
    return point_contact(*race_curvatures(D_w, D_pw, f, alpha, inner=inner), eta)


def contacts_in_series(K_i: ArrayLike, K_o: ArrayLike) -> Any:
    """Stiffness [N/m^1.5] of two Hertz contacts that carry the same load, inner and outer [N/m^1.5].

    ``K_tot = (K_i^(−2/3) + K_o^(−2/3))^(−3/2)``.
    Source: Harris, Rolling Bearing Analysis; Neisi 2020, eq. (6).
    """
    inner, outer = 1.0 / cube_root_each(K_i), 1.0 / cube_root_each(K_o)
    total = inner * inner + outer * outer
    return 1.0 / (total * np.sqrt(total))


@dataclass(frozen=True, kw_only=True)
class LineContact:
    """Two parallel cylinders, one perhaps hollow around the other, pressed together over a length.

    Notes
    -----
    Source: Johnson, Contact Mechanics, ch. 4.
    """

    radius: float
    """Relative radius R [m], ``1/R = 1/R₁ + 1/R₂``; a bore counts negative."""
    length: float
    """Length of the contact [m]."""
    compliance: float
    """Compliance of the material pair, 1/E* [1/Pa], see `compliance`."""

    def maximum_pressure(self, F: ArrayLike) -> Any:
        """Largest Hertz pressure ``p₀ = √(F' E* / (π R))`` [Pa] under a load [N], F' per length.

        Source: Johnson, Contact Mechanics, ch. 4. Not validated: ends of the contact and misalignment, which
        raise it; waviness.
        """
        return np.sqrt(F / (math.pi * self.length * self.compliance * self.radius))

    def half_width(self, F: ArrayLike) -> Any:
        """Half width ``√(4 F' R / (π E*))`` [m] of the contact strip under a load [N].

        Source: Johnson, Contact Mechanics, ch. 4. Valid while it is small against both radii.
        """
        return np.sqrt(4.0 * F * self.radius * self.compliance / (math.pi * self.length))


def cylinder_in_bore(R_rotor: float, R_bore: float, length: float, eta: float) -> LineContact:
    """Contact of a shaft in a bore: radii and length [m], compliance of the pair [1/Pa].

    ``1/R = 1/R_rotor − 1/R_bore``. Source: Johnson, Contact Mechanics, ch. 4.
    """
    return LineContact(radius=R_rotor * R_bore / (R_bore - R_rotor), length=length, compliance=eta)
