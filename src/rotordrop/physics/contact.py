"""Hunt–Crossley contact between rotor and inner race (Neisi 2020, eqs. 8–10)."""

from __future__ import annotations

from rotordrop.physics._compile import inner_kernel, kernel


@inner_kernel
def elastic_contact_force(delta: float, K: float, n: float) -> float:
    """Elastic part [N] of the contact force, ``K δ^n``, at a positive indentation [m].

    Source: Neisi 2020, eq. (8) without damping.
    """
    force: float = K * delta**n
    return force


@inner_kernel
def damped_contact_force(elastic: float, delta_dot: float, lam: float) -> float:
    """Normal force [N] from its elastic part [N] and the rate of indentation [m/s]; never pulls.

    Source: Neisi 2020, eq. (8), ``max(0, K δ^n (1 + 1.5 λ δ̇))``.
    """
    force: float = elastic * (1.0 + 1.5 * lam * delta_dot)
    return max(0.0, force)


@inner_kernel
def hunt_crossley_force(delta: float, delta_dot: float, K: float, n: float, lam: float) -> float:
    """Normal force [N] pressing rotor and race apart at an indentation and its rate.

    Parameters
    ----------
    delta : float
        Indentation ``e_r - c_r`` [m]; no force at or below zero.
    delta_dot : float
        Rate of indentation [m/s].
    K : float
        Contact stiffness [N/m^n].
    n : float
        Exponent [1]; 10/9 for line contact.
    lam : float
        Hunt–Crossley damping parameter λ [s/m].

    Returns
    -------
    float
        ``max(0, K δ^n (1 + 1.5 λ δ̇))`` [N].

    Notes
    -----
    Source: Neisi 2020, eq. (8) with b = 3/2 λ K. Differs from the paper: the printed "and" of the zero branch
    is read as "or", so the force never pulls.
    """
    if delta <= 0.0:
        return 0.0
    return damped_contact_force(elastic_contact_force(delta, K, n), delta_dot, lam)


@kernel
def hunt_crossley_gradient(
    delta: float, delta_dot: float, K: float, n: float, lam: float
) -> tuple[float, float, float]:
    """Normal force [N] with its derivatives by indentation [N/m] and by rate of indentation [N s/m].

    Source: Neisi 2020, eq. (8), differentiated.
    """
    if delta <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = K * delta**n
    growth = 1.0 + 1.5 * lam * delta_dot
    if growth <= 0.0:
        return 0.0, 0.0, 0.0
    return elastic * growth, n * elastic / delta * growth, elastic * 1.5 * lam


@kernel
def elastic_contact_energy(delta: float, K: float, n: float) -> float:
    """Energy [J] stored in the contact at an indentation [m]: ``K δ^(n+1) / (n+1)``.

    Source: integral of the elastic part of Neisi 2020, eq. (8).
    """
    if delta <= 0.0:
        return 0.0
    energy: float = K * delta ** (n + 1.0) / (n + 1.0)
    return energy
