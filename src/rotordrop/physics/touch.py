"""Rotor in a round bore: normal force and friction from the motion against the bore.

The numbers of a contact are a short array that only this module reads; its last entries are the law of
`rotordrop.physics.contact`, the columns of `rotordrop.physics.columns` hold it.
"""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics import contact
from rotordrop.physics._compile import inner_kernel
from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.physics.spin import surface_speed

# Entries of a contact; SI units.
AIR_GAP, ROTOR_RADIUS, BORE_RADIUS, FRICTION_STATIC, FRICTION_DYNAMIC, STRIBECK_SPEED = range(6)
SMOOTHING_SPEED, LAW = range(6, 8)
N_ENTRIES = LAW + contact.N_ENTRIES


@inner_kernel
def touch(
    numbers: Array,
    gap: float,
    law: Array,
    ux: float,
    uy: float,
    vx: float,
    vy: float,
    omega: float,
    omega_i: float,
) -> tuple[float, float, float, float, float, float, float]:
    """Contact of a rotor with the bore around it.

    Parameters
    ----------
    numbers : ndarray, shape (N_ENTRIES,)
        Gap and radii [m], friction, law.
    gap : float
        The air gap now [m], which is that of the numbers where nothing departs; so is the law.
    law : ndarray, shape (3,)
        Law of the contact, K [N/m^n], n [1] and λ [s/m].
    ux, uy, vx, vy : float
        Displacement [m] and velocity [m/s] of the rotor against the bore.
    omega, omega_i : float
        Spin of rotor and bore [rad/s].

    Returns
    -------
    tuple of float
        Indentation [m], normal and signed friction force [N], normal (x, y) [1] from bore to rotor, power
        that sliding takes and power that the law takes in the normal direction [W]. The tangent is the normal
        turned by 90° in the sense of positive spin.

    Notes
    -----
    Source: Neisi 2020, eqs. (8)–(12).
    """
    e_r = math.sqrt(ux * ux + uy * uy)
    delta = e_r - gap
    if delta <= 0.0:
        return delta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # Unit vectors instead of angles: no branch at an azimuth, no sign to set by hand.
    nx = ux / e_r
    ny = uy / e_r
    delta_dot = vx * nx + vy * ny
    F_r, elastic = contact.contact_force(law, delta, delta_dot)
    v_t = surface_speed(vy * nx - vx * ny, omega, numbers[ROTOR_RADIUS], omega_i, numbers[BORE_RADIUS])
    F_mu = F_r * stribeck_coefficient(
        v_t,
        numbers[FRICTION_STATIC],
        numbers[FRICTION_DYNAMIC],
        numbers[STRIBECK_SPEED],
        numbers[SMOOTHING_SPEED],
    )
    return delta, F_r, F_mu, nx, ny, F_mu * v_t, (F_r - elastic) * delta_dot
