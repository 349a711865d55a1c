"""Spin of rotor and inner race: surface speed and race drag (Neisi 2020, eq. 12)."""

from __future__ import annotations

from rotordrop.physics._compile import inner_kernel
from rotordrop.physics.elementary import tanh


@inner_kernel
def surface_speed(v_tangential: float, omega_r: float, r_r: float, omega_i: float, R_i: float) -> float:
    """Speed [m/s] of the rotor surface over the race surface along the tangent.

    Parameters
    ----------
    v_tangential : float
        Velocity of the rotor centre relative to the race along the tangent [m/s].
    omega_r, omega_i : float
        Spin of rotor and race [rad/s].
    r_r, R_i : float
        Rotor radius and bore radius of the race [m].

    Returns
    -------
    float
        ``v + ω_r r_r − ω_i R_i`` [m/s].

    Notes
    -----
    Source: kinematics behind Neisi 2020, eqs. (11) and (12).
    """
    return v_tangential + omega_r * r_r - omega_i * R_i


@inner_kernel
def race_drag_torque(
    F_b: float, omega_i: float, drag_coefficient: float, D_pw: float, drag_speed: float
) -> float:
    """Torque [N m] with which bearing friction and the ball set brake the inner race.

    ``drag_coefficient · |F_b| · D_pw/2 · tanh(ω_i / drag_speed)``: coefficient [1], ball force on the race
    [N], race spin [rad/s], pitch diameter [m], regularisation speed [rad/s].

    Source: load-proportional bearing friction torque (Harris, Rolling Bearing Analysis), regularised at zero
    spin.
    """
    return drag_coefficient * F_b * 0.5 * D_pw * tanh(omega_i / drag_speed)
