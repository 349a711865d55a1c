"""Impacts of one mass on one contact: closed forms, and the contact kernel integrated."""

import math

from scipy.integrate import solve_ivp

from rotordrop.physics.contact import contact_force, contact_law

_BISECTIONS = 200


def restitution(lam, v_0):
    """Coefficient of restitution [1] of the Hunt–Crossley contact at an impact speed, exact.

    λ [s/m] and impact speed [m/s]; it depends on their product only, for every exponent, stiffness and mass.
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


def damping_for_restitution(e, v_0):
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


def elastic_indentation(m, K, n, v_0):
    """Largest indentation [m] of a mass [kg] that meets a contact ``F = K δ^n`` [N/m^n] at a speed [m/s].

    Source: energy balance; Johnson, Contact Mechanics, section 11.4.
    """
    return float(((n + 1.0) * m * v_0**2 / (2.0 * K)) ** (1.0 / (n + 1.0)))


def elastic_contact_time(m, K, n, v_0):
    """Duration [s] of an undamped impact; arguments as in `elastic_indentation`.

    ``T = 2 (δ_max/v_0) B(1/(n+1), 1/2) / (n+1)``: π for n = 1, 2.9433 for n = 3/2.
    Source: Johnson, Contact Mechanics, section 11.4, for any n by Euler's Beta function.
    """
    p = 1.0 / (n + 1.0)
    beta = math.gamma(p) * math.gamma(0.5) / math.gamma(p + 0.5)
    return 2.0 * p * beta * elastic_indentation(m, K, n, v_0) / v_0


def fall_time(h, g=9.81):
    """Time [s] of a free fall from rest over a height [m] under gravity [m/s²]. Source: textbook."""
    return math.sqrt(2.0 * h / g)


def half_period_stiffness(m, T):
    """Equivalent stiffness [N/m] of a contact that lasts T [s] under a mass [kg], ``m (π/T)²``.

    Source: Neisi 2020, eq. (17) and section 5.1 (its Table 3). Biased: it forgets gravity.
    """
    return m * (math.pi / T) ** 2


def hunt_crossley_force(delta, rate, K, n, lam):
    """Normal force [N] of the contact kernel, none without indentation."""
    return contact_force(contact_law(K, n, lam), delta, rate)[0] if delta > 0.0 else 0.0


def strike(m, K, n, lam, v_0):
    """Contact time, rebound speed and peak force of one integrated impact of the contact kernel."""

    def motion(_, state):
        return [state[1], -hunt_crossley_force(state[0], state[1], K, n, lam) / m]

    def separation(t, state):
        return state[0] if t > 0 else 1.0

    separation.terminal = True
    separation.direction = -1
    delta = elastic_indentation(m, K, n, v_0)
    solution = solve_ivp(
        motion,
        (0, 6 * elastic_contact_time(m, K, n, v_0)),
        [0.0, v_0],
        events=separation,
        rtol=1e-11,
        atol=[1e-12 * delta, 1e-12 * v_0],
        method="DOP853",
    )
    forces = [hunt_crossley_force(*state, K, n, lam) for state in solution.y.T]
    return solution.t_events[0][0], -solution.y_events[0][0][1], max(forces)
