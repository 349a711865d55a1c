"""Contact of rotor and inner race: the one place that knows its law (Neisi 2020, eqs. 8–10).

A law is a short array of numbers that only this module reads: `contact_law` makes it, a row of
`rotordrop.physics.columns` holds it, and whoever needs force, derivative, energy, depth or tangent hands it
back.
"""

from __future__ import annotations

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel, kernel
from rotordrop.physics.elementary import power

# Entries of a contact law; SI units.
STIFFNESS, EXPONENT, DAMPING, N_ENTRIES = range(4)


def contact_law(stiffness: float, exponent: float, damping: float) -> Array:
    """Contact law of Hunt and Crossley, shape (3,), from K [N/m^n], n [1] and λ [s/m].

    Source: Neisi 2020, eq. (8) with b = 3/2 λ K.
    """
    law = np.empty(N_ENTRIES)
    law[STIFFNESS], law[EXPONENT], law[DAMPING] = stiffness, exponent, damping
    return law


@inner_kernel
def contact_force(law: Array, delta: float, delta_dot: float) -> tuple[float, float]:
    """Normal force [N] pressing rotor and race apart, and its elastic part [N].

    Parameters
    ----------
    law : ndarray, shape (3,)
        K [N/m^n], n [1] and λ [s/m], from `contact_law`.
    delta : float
        Indentation ``e_r - c_r`` [m]; positive, for there is no force without it.
    delta_dot : float
        Rate of indentation [m/s].

    Returns
    -------
    tuple of float
        ``max(0, K δ^n (1 + 1.5 λ δ̇))`` and ``K δ^n`` [N].

    Notes
    -----
    λ sets the coefficient of restitution, e ≈ 1 − λ v at a small impact speed v (Hunt & Crossley 1975).
    Source: Neisi 2020, eq. (8). Differs from the paper: the printed "and" of the zero branch is read as "or",
    so the force never pulls.
    """
    elastic: float = law[STIFFNESS] * power(delta, law[EXPONENT])
    return max(0.0, elastic * (1.0 + 1.5 * law[DAMPING] * delta_dot)), elastic


@inner_kernel
def contact_energy(law: Array, delta: float) -> float:
    """Energy [J] stored in the contact at a positive indentation [m]: ``K δ^(n+1) / (n+1)``.

    Source: integral of the elastic part of Neisi 2020, eq. (8).
    """
    n = law[EXPONENT]
    energy: float = law[STIFFNESS] * delta * power(delta, n) / (n + 1.0)
    return energy


@kernel
def depth_at(law: Array, load: float) -> float:
    """Indentation [m] at which the contact at rest carries a load [N].

    Source: inverse of the elastic part of Neisi 2020, eq. (8).
    """
    return power(load / law[STIFFNESS], 1.0 / law[EXPONENT])


@kernel
def contact_tangent(law: Array, load: float) -> float:
    """Slope [N/m] of the law at rest under a load [N]: ``n K^(1/n) F^(1-1/n)``.

    Source: Neisi 2020, eq. (8), differentiated at the depth of the load.
    """
    n = law[EXPONENT]
    slope: float = n * power(law[STIFFNESS], 1.0 / n) * power(load, 1.0 - 1.0 / n)
    return slope


def stiffness_of_exponent(law: Array, load: float, exponent: float) -> float:
    """Stiffness [N/m^n] that another exponent [1] takes for the same indentation under a load [N].

    Source: Neisi 2020, eq. (8), both laws through one point.
    """
    return float(load / power(depth_at(law, load), exponent))
