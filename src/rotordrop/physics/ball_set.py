"""All balls between race and support: force, stiffness, energy, load and stress of one touchdown bearing.

Whoever needs one of these hands over the bearing's numbers and its balls and does not know what stands behind
the race. The numbers are a short array that only this module reads: `ball_set_entries` makes it and the
columns of `rotordrop.physics.columns` hold it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics._compile import inner_kernel, lean_kernel
from rotordrop.physics.ball_bearing import BearingConstants
from rotordrop.physics.ball_bearing_planar import (
    largest_ball_load,
    planar_ball_energy,
    planar_ball_force,
    planar_ball_gradient,
)
from rotordrop.physics.elementary import cos_each, cube_root, magnitude, sin_each
from rotordrop.physics.linear_algebra import solve

Array = NDArray[np.float64]
LANES = 8

LEAST_DAMPING = 1e-9
"""Share of a loaded ball's stiffness [1] added to what holds a loose race, sideways perhaps nothing."""

# Entries of a ball set; SI units.
BALL_STIFFNESS = 0
GROOVE_DISTANCE = 1
RADIAL_OFFSET = 2
AXIAL_OFFSET = 3
STRESS_COEFFICIENT = 4
N_ENTRIES = 5

# Rows of the array of balls.
COSINE = 0
SINE = 1
COUNT = 2


def ball_set_entries(constants: BearingConstants) -> Array:
    """Numbers of a ball set, shape (5,): stiffness [N/m^1.5], three lengths [m], stress coefficient [Pa/N^⅓].

    Source: Neisi 2020, eqs. (2)–(7).
    """
    entries = np.empty(N_ENTRIES)
    entries[BALL_STIFFNESS] = constants.ball_stiffness
    entries[GROOVE_DISTANCE] = constants.groove_distance
    entries[RADIAL_OFFSET] = constants.radial_offset
    entries[AXIAL_OFFSET] = constants.axial_offset
    entries[STRESS_COEFFICIENT] = constants.stress_coefficient_inner
    return entries


def balls_of(constants: BearingConstants, places: int = 0) -> Array:
    """Direction cosine, sine [1] and number of balls at each place, shape (3, Z8).

    Rows of balls that coincide are one place with a count; places are padded with count zero to whole lanes
    of eight, to ``places`` at least. Source: Neisi 2020, eq. (2), angles of the balls.
    """
    angles, counts = _merged_angles(constants)
    balls = np.zeros((3, LANES * max(1, -(-max(len(angles), places) // LANES))))
    balls[COSINE] = 1.0
    balls[COSINE, : len(angles)] = cos_each(angles)
    balls[SINE, : len(angles)] = sin_each(angles)
    balls[COUNT, : len(angles)] = counts
    return balls


def _merged_angles(constants: BearingConstants) -> tuple[Array, Array]:
    first = np.asarray(constants.ball_angles, dtype=np.float64)
    if len(constants.axial_signs) == 1:
        return first, np.ones(len(first))
    if constants.second_row_offset == 0.0:
        return first, np.full(len(first), float(len(constants.axial_signs)))
    shift = constants.second_row_offset * 2.0 * math.pi / len(first)
    both = np.concatenate([first, first + shift])
    return both, np.ones(len(both))


@inner_kernel
def ball_set_force(entries: Array, balls: Array, dx: float, dy: float, work: Array) -> tuple[float, float]:
    """Restoring force [N] of a race moved by (dx, dy) [m], x and y; the force *on* the race is its negative.

    ``work`` (2, Z8) is scratch. Source: Neisi 2020, eqs. (2)–(6).
    """
    return planar_ball_force(
        dx,
        dy,
        entries[RADIAL_OFFSET],
        entries[AXIAL_OFFSET],
        entries[GROOVE_DISTANCE],
        entries[BALL_STIFFNESS],
        balls[COSINE],
        balls[SINE],
        balls[COUNT],
        work,
    )


@lean_kernel
def ball_set_gradient(
    entries: Array, balls: Array, dx: float, dy: float
) -> tuple[float, float, float, float, float]:
    """Restoring force ``F_x, F_y`` [N], stiffness ``k_xx, k_xy, k_yy`` [N/m] of a race moved (dx, dy) [m].

    Source: Neisi 2020, eqs. (2)–(6), differentiated.
    """
    return planar_ball_gradient(
        dx,
        dy,
        entries[RADIAL_OFFSET],
        entries[AXIAL_OFFSET],
        entries[GROOVE_DISTANCE],
        entries[BALL_STIFFNESS],
        balls[COSINE],
        balls[SINE],
        balls[COUNT],
    )


@lean_kernel
def ball_set_energy(entries: Array, balls: Array, dx: float, dy: float) -> float:
    """Elastic energy [J] of a race moved by (dx, dy) [m]. Source: integral of Neisi 2020, eq. (6)."""
    return planar_ball_energy(
        dx,
        dy,
        entries[RADIAL_OFFSET],
        entries[AXIAL_OFFSET],
        entries[GROOVE_DISTANCE],
        entries[BALL_STIFFNESS],
        balls[COSINE],
        balls[SINE],
        balls[COUNT],
    )


@inner_kernel
def ball_set_load(entries: Array, balls: Array, dx: float, dy: float) -> tuple[float, float]:
    """Largest load of a single ball [N] and its Hertz pressure on the inner race [Pa].

    Source: Neisi 2020, eqs. (6) and (7).
    """
    load = largest_ball_load(
        dx,
        dy,
        entries[RADIAL_OFFSET],
        entries[AXIAL_OFFSET],
        entries[GROOVE_DISTANCE],
        entries[BALL_STIFFNESS],
        balls[COSINE],
        balls[SINE],
        balls[COUNT],
    )
    return load, entries[STRESS_COEFFICIENT] * cube_root(load)


def static_deflection(constants: BearingConstants, load: float) -> tuple[float, float]:
    """Downward deflection [m] of the race under a vertical load [N], and tangent stiffness there [N/m].

    Source: equilibrium of Neisi 2020, eqs. (2)–(6), by Newton steps.
    """
    entries, balls = ball_set_entries(constants), balls_of(constants)
    if not constants.preloaded:
        return _loose_deflection(constants, entries, balls, load)
    dy = 0.0
    for _ in range(50):
        _, force, _, _, stiffness = ball_set_gradient(entries, balls, 0.0, dy)
        step = (-load - force) / stiffness
        dy += step
        if abs(step) < 1e-18:
            break
    return -dy, float(ball_set_gradient(entries, balls, 0.0, dy)[4])


def loose_race_seat(constants: BearingConstants, load: float) -> tuple[float, float]:
    """Where a race without preload comes to rest on its balls under a downward load [N]: x and y [m].

    The lowest energy; the race rolls sideways into the gap of its lowest balls wherever the first one stands.
    Source: equilibrium of Neisi 2020, eqs. (2)–(6).
    """
    return _loose_seat(constants, ball_set_entries(constants), balls_of(constants), load)


def _loose_deflection(
    constants: BearingConstants, entries: Array, balls: Array, load: float
) -> tuple[float, float]:
    if load == 0.0:
        return constants.radial_play, 0.0
    dx, dy = _loose_seat(constants, entries, balls, load)
    _, _, k_xx, k_xy, k_yy = ball_set_gradient(entries, balls, dx, dy)
    # The race is free to give way sideways; on a single ball nothing holds it there, and nothing couples.
    aside = k_xy * k_xy / k_xx if k_xx > LEAST_DAMPING * k_yy else 0.0
    return -dy, float(k_yy - aside)


def _loose_seat(
    constants: BearingConstants, entries: Array, balls: Array, load: float
) -> tuple[float, float]:
    """Newton steps on the convex energy of the balls and the load, damped until it falls."""
    root = cube_root(abs(load) / constants.ball_stiffness)
    single = root * root
    # Deep enough for the two lowest balls of any bearing (three balls: twice the play) to be loaded at once.
    at = np.array([0.0, -math.copysign(2.0 * constants.radial_play + 4.0 * single, load)])

    def energy_at(place: Array) -> float:
        return float(ball_set_energy(entries, balls, place[0], place[1])) + load * float(place[1])

    # The spring of one loaded ball: the size of stiffness a step is damped with.
    spring = 1.5 * abs(load) / single
    damping, energy = LEAST_DAMPING, energy_at(at)
    for _ in range(200):
        f_x, f_y, k_xx, k_xy, k_yy = ball_set_gradient(entries, balls, at[0], at[1])
        left = np.array([-f_x, -load - f_y])
        if magnitude(*left) <= 1e-13 * abs(load):
            break
        tangent = np.array([[k_xx, k_xy], [k_xy, k_yy]]) + damping * spring * np.eye(2)
        trial = at + solve(tangent, left)
        if energy_at(trial) <= energy + 1e-13 * abs(load * at[1]):
            at, energy, damping = trial, energy_at(trial), max(0.1 * damping, LEAST_DAMPING)
        else:
            damping = max(4.0 * damping, 1e-3)
    return float(at[0]), float(at[1])
