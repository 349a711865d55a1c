"""Closed-form impacts: restitution, contact time, bounces. References for the contact kernels.

One mass against one contact or one spring.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BISECTIONS = 200


def restitution(lam: float, v_0: float) -> float:
    """Coefficient of restitution [1] of the Hunt–Crossley contact at an impact speed, exact.

    Parameters
    ----------
    lam : float
        λ [s/m].
    v_0 : float
        Impact speed [m/s].

    Returns
    -------
    float
        Rebound speed over impact speed [1]. It depends on λ·v_0 only, for every exponent, stiffness and mass.

    Notes
    -----
    Source: Hunt & Crossley 1975, ``e ≈ 1 − λ v_0``; the first integral of Neisi 2020, eq. (8):
    ``v₀/a − ln(1 + a v₀)/a² = −v₁/a − ln(1 − a v₁)/a²`` with a = 1.5 λ.
    """
    u = 1.5 * lam * v_0
    if u < 1e-5:
        return 1.0 - 2.0 / 3.0 * u
    approach = u - math.log1p(u)
    low, high = 0.0, min(u, 1.0)
    for _ in range(_BISECTIONS):
        w = 0.5 * (low + high)
        if w in (low, high):
            break
        low, high = (w, high) if -w - math.log1p(-w) < approach else (low, w)
    return 0.5 * (low + high) / u


def damping_for_restitution(e: float, v_0: float) -> float:
    """Hunt–Crossley λ [s/m] that returns a wanted coefficient of restitution 0 < e ≤ 1 [1] at a speed [m/s].

    Source: inverse of `restitution`, Hunt & Crossley 1975.
    """
    low, high = 0.0, 1.0
    while restitution(high, v_0) > e:
        high *= 2.0
    for _ in range(_BISECTIONS):
        lam = 0.5 * (low + high)
        if lam in (low, high):
            break
        low, high = (lam, high) if restitution(lam, v_0) > e else (low, lam)
    return 0.5 * (low + high)


def elastic_indentation(m: float, K: float, n: float, v_0: float) -> float:
    """Largest indentation [m] of a mass [kg] that meets a contact ``F = K δ^n`` [N/m^n] at a speed [m/s].

    Source: energy balance; Johnson, Contact Mechanics, section 11.4.
    """
    return float(((n + 1.0) * m * v_0**2 / (2.0 * K)) ** (1.0 / (n + 1.0)))


def elastic_peak_force(m: float, K: float, n: float, v_0: float) -> float:
    """Largest force [N] of an undamped impact; arguments as in `elastic_indentation`.

    Source: Johnson, Contact Mechanics, section 11.4.
    """
    return float(K * elastic_indentation(m, K, n, v_0) ** n)


def elastic_contact_time(m: float, K: float, n: float, v_0: float) -> float:
    """Duration [s] of an undamped impact; arguments as in `elastic_indentation`.

    ``T = 2 (δ_max/v_0) B(1/(n+1), 1/2) / (n+1)``: π for n = 1, 2.9433 for n = 3/2.
    Source: Johnson, Contact Mechanics, section 11.4, for any n by Euler's Beta function.
    """
    p = 1.0 / (n + 1.0)
    beta = math.gamma(p) * math.gamma(0.5) / math.gamma(p + 0.5)
    return 2.0 * p * beta * elastic_indentation(m, K, n, v_0) / v_0


def fall_time(h: float, g: float = 9.81) -> float:
    """Time [s] of a free fall from rest over a height [m] under gravity [m/s²]. Source: textbook."""
    return math.sqrt(2.0 * h / g)


def bounce_times(h: float, e: float, count: int, g: float = 9.81) -> Array:
    """Times [s] of the first impacts of a mass dropped from rest; shape (count,).

    Height [m], coefficient of restitution [1], number of impacts [1], gravity [m/s²].
    Source: textbook, geometric series of flights.
    """
    flights = 2.0 * e ** np.arange(1, count) * fall_time(h, g)
    return fall_time(h, g) + np.concatenate([[0.0], np.cumsum(flights)])


def bounce_heights(h: float, e: float, count: int) -> Array:
    """Heights [m] of the first bounces, ``h e^(2k)``; arguments as in `bounce_times`; shape (count,).

    Source: textbook.
    """
    heights: Array = h * e ** (2.0 * np.arange(1, count + 1, dtype=np.float64))
    return heights


def time_to_rest(h: float, e: float, g: float = 9.81) -> float:
    """Time [s] after which a bouncing mass has come to rest, e < 1; arguments as in `bounce_times`.

    Source: textbook, sum of the geometric series.
    """
    return fall_time(h, g) * (1.0 + e) / (1.0 - e)


def spring_contact_time(omega: float, v_0: float, g: float = 9.81) -> float:
    """Duration [s] of the contact of a falling mass with a spring: ``(2/ω)(π − atan(ω v_0/g))``.

    Natural frequency of mass on spring [rad/s], impact speed [m/s], gravity [m/s²]; gravity lengthens it.
    Source: exact solution. Differs from the paper: its half period ``π/ω`` (section 5.1) forgets gravity.
    """
    return 2.0 / omega * (math.pi - math.atan(omega * v_0 / g))


def spring_peak_force(m: float, omega: float, v_0: float, g: float = 9.81) -> float:
    """Largest force [N] of a spring that catches a falling mass [kg]; others as in `spring_contact_time`.

    Source: exact solution, ``m g + m sqrt(g² + (ω v_0)²)``.
    """
    return m * (g + math.hypot(g, omega * v_0))


def half_period_stiffness(m: float, T: float) -> float:
    """Equivalent stiffness [N/m] of a contact that lasts T [s] under a mass [kg], ``m (π/T)²``.

    Source: Neisi 2020, eq. (17) and section 5.1 (its Table 3). Biased; see `contact_time_stiffness`.
    """
    return m * (math.pi / T) ** 2


def contact_time_stiffness(m: float, T: float, v_0: float, g: float = 9.81) -> float:
    """Equivalent stiffness [N/m] of a contact of duration T [s], with gravity in the account.

    Mass [kg], impact speed [m/s], gravity [m/s²]. Bisection in ω of `spring_contact_time`, whose value
    lies between π/ω and 2π/ω.
    Source: Neisi 2020, eq. (17). Differs from the paper: the contact time of the exact solution.
    """
    low = math.pi / T
    high = 2.0 * low
    for _ in range(_BISECTIONS):
        omega = 0.5 * (low + high)
        if omega in (low, high):
            break
        low, high = (omega, high) if spring_contact_time(omega, v_0, g) > T else (low, omega)
    return m * (0.5 * (low + high)) ** 2
