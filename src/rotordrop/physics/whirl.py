"""Closed forms of whirl and spin-up: how fast rolling would be, what it costs, when sliding ends."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics._compile import kernel
from rotordrop.physics.elementary import atan2

Array = NDArray[np.float64]


def rolling_whirl_speed(omega_r: float, R_i: float, c_r: float) -> float:
    """Backward whirl speed [rad/s] of a rotor that rolls without sliding in a fixed bore, ``ω_r R_i / c_r``.

    Rotor speed [rad/s], bore radius [m], air gap [m]. Never reached in a drop: a real whirl locks to a
    coupled natural frequency of rotor and support far below.
    Source: Black 1968; Bartha 1998 (dry friction whirl).
    """
    return omega_r * R_i / c_r


def whirl_force(m: float, c_r: float, omega_w: float) -> float:
    """Contact force [N] that keeps a mass [kg] on a circle of radius c_r [m] at a whirl speed [rad/s].

    Source: ``m c ω²``.
    """
    return m * c_r * omega_w**2


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


@kernel
def circling_spells(  # noqa: C901  one compiled loop
    x: Array, y: Array, nearest: float, turns: float, spells: Array
) -> int:
    """Find the stretches of a path on which it circles the origin without turning back.

    A path circles while its polar angle advances in one direction; going back by less than a quarter turn
    (a bounce) does not end a stretch, coming nearer to the origin than ``nearest`` does, because there the
    angle says nothing.

    Parameters
    ----------
    x, y : ndarray, shape (T,)
        The path [m].
    nearest : float
        Smallest radius that counts [m].
    turns : float
        Turns that a stretch has at least [1].
    spells : ndarray, shape (S, 3)
        Filled with first sample, last sample and angle turned [rad] (positive from x to y) of each stretch.

    Returns
    -------
    int
        Number of stretches found; those beyond S are counted but not written.

    Notes
    -----
    Source: own definition; a pendulum swings back and never circles.
    """
    count = 0
    start = far = -1
    angle = start_angle = far_angle = 0.0
    previous = 0.0
    for i in range(x.shape[0] + 1):
        inside = i < x.shape[0] and x[i] * x[i] + y[i] * y[i] >= nearest * nearest
        if inside and start < 0:
            start = far = i
            previous = atan2(y[i], x[i])
            angle = start_angle = far_angle = previous
            continue
        back = False
        if inside:
            polar = atan2(y[i], x[i])
            step = polar - previous
            if step > math.pi:
                step -= 2.0 * math.pi
            elif step < -math.pi:
                step += 2.0 * math.pi
            previous = polar
            angle += step
            advance = far_angle - start_angle
            if (angle - far_angle) * advance >= 0.0:
                far, far_angle = i, angle
            back = abs(angle - far_angle) > 0.5 * math.pi
        if start >= 0 and (back or not inside):
            turned = far_angle - start_angle
            if abs(turned) >= 2.0 * math.pi * turns:
                if count < spells.shape[0]:
                    spells[count, 0] = start
                    spells[count, 1] = far
                    spells[count, 2] = turned
                count += 1
            start = -1
            if back:  # the next stretch begins where this one turned back
                start, start_angle = far, far_angle
                far, far_angle = i, angle
    return count
