"""Forces, loads and stress of every bearing from the states of a drop."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.model import layout as L
from rotordrop.model.layout import KernelParameters
from rotordrop.physics._compile import kernel, lean_kernel
from rotordrop.physics.ball_bearing_planar import largest_ball_load, planar_ball_energy, planar_ball_force
from rotordrop.physics.contact import elastic_contact_energy
from rotordrop.simulation._loop import contact_at
from rotordrop.simulation._rhs import relative_motion

Array = NDArray[np.float64]

# Last axis of the history array.
H_DELTA = 0
H_CONTACT_FORCE = 1
H_FRICTION_FORCE = 2
H_NORMAL_X = 3
H_NORMAL_Y = 4
H_CONTACT_POWER = 5
H_BEARING_FORCE_X = 6
H_BEARING_FORCE_Y = 7
H_BALL_LOAD = 8
H_STRESS = 9
N_HISTORIES = 10


@kernel
def bearing_histories(states: Array, p: KernelParameters, out: Array) -> None:
    """Fill ``out`` (T, B, 10) from ``states`` (T, n); SI units, columns ``H_*``; the ball force is that on
    the race.
    """
    m = p.eigenvalue.shape[0]
    n_b = p.bearing.shape[0]
    work = np.empty((2, p.ball_cos.shape[1]))
    for i in range(states.shape[0]):
        y = states[i]
        for b in range(n_b):
            contact_at(b, y, p, out[i, b])
            row = p.bearing[b]
            r = 2 * m + 2 * b
            h = r + 2 * n_b
            dx = y[r] - y[h]
            dy = y[r + 1] - y[h + 1]
            F_x, F_y = planar_ball_force(
                dx,
                dy,
                row[L.RADIAL_OFFSET],
                row[L.AXIAL_OFFSET],
                row[L.GROOVE_DISTANCE],
                row[L.BALL_STIFFNESS],
                p.ball_cos[b],
                p.ball_sin[b],
                p.ball_weight[b],
                work,
            )
            load = largest_ball_load(
                dx,
                dy,
                row[L.RADIAL_OFFSET],
                row[L.AXIAL_OFFSET],
                row[L.GROOVE_DISTANCE],
                row[L.BALL_STIFFNESS],
                p.ball_cos[b],
                p.ball_sin[b],
                p.ball_weight[b],
            )
            out[i, b, H_BEARING_FORCE_X] = -F_x
            out[i, b, H_BEARING_FORCE_Y] = -F_y
            out[i, b, H_BALL_LOAD] = load
            out[i, b, H_STRESS] = row[L.STRESS_COEFFICIENT] * np.cbrt(load)


@lean_kernel
def stored_energy(y: Array, p: KernelParameters, with_rotor_spin: bool) -> float:
    """Energy [J] of a state: motion, bending, contacts, balls, supports, gravity and spin."""
    m = p.eigenvalue.shape[0]
    n_b = p.bearing.shape[0]
    n_q = 2 * m + 4 * n_b
    energy = 0.0
    for k in range(m):
        energy += 0.5 * (y[n_q + k] ** 2 + y[n_q + m + k] ** 2)
        energy += 0.5 * p.eigenvalue[k] * (y[k] ** 2 + y[m + k] ** 2) - p.gravity[k] * y[m + k]
    for b in range(n_b):
        row = p.bearing[b]
        r = 2 * m + 2 * b
        h = r + 2 * n_b
        ux, uy, _vx, _vy = relative_motion(b, y, p)
        delta = math.sqrt(ux * ux + uy * uy) - row[L.AIR_GAP]
        energy += elastic_contact_energy(delta, row[L.CONTACT_STIFFNESS], row[L.CONTACT_EXPONENT])
        energy += planar_ball_energy(
            y[r] - y[h],
            y[r + 1] - y[h + 1],
            row[L.RADIAL_OFFSET],
            row[L.AXIAL_OFFSET],
            row[L.GROOVE_DISTANCE],
            row[L.BALL_STIFFNESS],
            p.ball_cos[b],
            p.ball_sin[b],
            p.ball_weight[b],
        )
        energy += row[L.RACE_WEIGHT] * y[r + 1]
        energy += 0.5 * row[L.RACE_MASS] * (y[n_q + r] ** 2 + y[n_q + r + 1] ** 2)
        energy += (
            0.5 * row[L.SUPPORT_MASS_X] * y[n_q + h] ** 2 + 0.5 * row[L.SUPPORT_MASS_Y] * y[n_q + h + 1] ** 2
        )
        energy += (
            0.5 * row[L.SUPPORT_STIFFNESS_X] * y[h] ** 2 + 0.5 * row[L.SUPPORT_STIFFNESS_Y] * y[h + 1] ** 2
        )
        energy += 0.5 * row[L.RACE_INERTIA] * y[2 * n_q + b] ** 2
    if with_rotor_spin:
        energy += 0.5 * p.spin[L.POLAR_INERTIA] * y[2 * n_q + n_b] ** 2
    return energy


@kernel
def stored_energies(states: Array, p: KernelParameters, with_rotor_spin: bool, out: Array) -> None:
    """Fill ``out`` (T,) with the energy [J] of each of the ``states`` (T, n)."""
    for i in range(states.shape[0]):
        out[i] = stored_energy(states[i], p, with_rotor_spin)
