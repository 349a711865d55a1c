"""Frictional heat of a drop, to judge whether leaving it out is right; no drop is computed with it."""

from __future__ import annotations

from rotordrop.physics.whirl import race_spin_up_time

STEEL_HEAT_CAPACITY = 460.0
"""Specific heat of bearing steel [J/(kg K)]."""

STEEL_EXPANSION = 12e-6
"""Thermal expansion of bearing steel [1/K]."""


def friction_heat(
    *,
    F_r: float,
    mu: float,
    omega_r: float,
    R_i: float,
    race_inertia: float,
    drag_coefficient: float,
    D_pw: float,
    duration: float,
) -> tuple[float, float]:
    """Heat [J] of the rotor sliding on the race, and of the balls rolling, from rest of the race.

    Parameters
    ----------
    F_r : float
        Steady normal force between rotor and race [N].
    mu : float
        Dynamic friction coefficient [1].
    omega_r : float
        Rotor speed, taken as constant [rad/s].
    R_i : float
        Bore radius [m].
    race_inertia : float
        Polar inertia of the race with what spins with it [kg m²].
    drag_coefficient : float
        Drag torque of the race over force and half the pitch diameter [1].
    D_pw : float
        Pitch diameter [m].
    duration : float
        Time from the first contact [s].

    Returns
    -------
    tuple of float
        Heat of sliding and heat of rolling [J].

    Notes
    -----
    Sliding: ``μ F (ω R t − ½ α R t²)`` with the race's angular acceleration ``α = μ F R / I``, until the race
    has spun up; then ``½ I ω²`` in all. Rolling: ``k F D_pw/2 ω_i`` summed over the race's spin.
    Source: energy balance of Neisi 2020, eqs. (11) and (12), at constant rotor speed and without bounce.
    Not validated: against a measured temperature.
    """
    if mu * F_r <= 0.0:
        return 0.0, 0.0
    spin_up = race_spin_up_time(race_inertia, mu, F_r, R_i, omega_r)
    slip_time = min(duration, spin_up)
    acceleration = omega_r / spin_up
    sliding = mu * F_r * R_i * (omega_r * slip_time - 0.5 * acceleration * slip_time**2)
    turned = 0.5 * acceleration * slip_time**2 + omega_r * (duration - slip_time)
    return sliding, drag_coefficient * F_r * 0.5 * D_pw * turned


def growth_of_race(heat: float, mass: float, R_i: float) -> tuple[float, float]:
    """Warming [K] and radial growth [m] of a steel race of a mass [kg] and bore radius [m] by a heat [J].

    All of the heat stays in the race.
    Source: heat capacity and thermal expansion of bearing steel, 460 J/(kg K) and 12e-6 1/K.
    """
    warming = heat / (mass * STEEL_HEAT_CAPACITY)
    return warming, STEEL_EXPANSION * warming * R_i
