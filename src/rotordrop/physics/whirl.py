"""Closed forms of whirl and spin-up: how fast rolling would be, what it costs, when sliding ends."""

from __future__ import annotations


def race_spin_up_time(
    race_inertia: float, mu: float, F_r: float, R_i: float, omega_r: float, r_r: float | None = None
) -> float:
    """Time [s] a race needs from rest to the surface speed of the rotor under a steady sliding contact.

    Parameters
    ----------
    race_inertia : float
        Polar inertia of the race with what spins with it [kg m²].
    mu : float
        Friction coefficient [1].
    F_r : float
        Normal force [N].
    R_i : float
        Bore radius [m].
    omega_r : float
        Rotor speed [rad/s].
    r_r : float, optional
        Rotor radius [m]; the bore radius by default.

    Returns
    -------
    float
        ``I ω_r r_r / (μ F_r R_i²)`` [s].

    Notes
    -----
    Source: Neisi 2020, eqs. (11) and (12), without race drag and at constant rotor speed.
    """
    radius = R_i if r_r is None else r_r
    return race_inertia * omega_r * radius / (mu * F_r * R_i**2)
