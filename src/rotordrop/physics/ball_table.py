"""Balls at speed in the drop model: force, energy and loads of a ball from a table over place and speed.

A Newton search inside a right-hand side would need a memory that a right-hand side has not. The table holds
what `rotordrop.physics.fast_balls` finds, with slopes, over the signed root of the way from where slow balls
just touch (their load, its 3/2 power, is a cubic there) and over the speed of the race; Hermite's cubics
between. All balls of a bearing share the speed of their cage, that of a centred ball.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel, lean_kernel
from rotordrop.physics.ball_set import COSINE, COUNT, SINE

if TYPE_CHECKING:
    from rotordrop.physics.fast_balls import FastBalls


# Entries of a table of balls at speed; SI units. A step of the speed of zero is balls without inertia.
SPEED_STEP, TOUCH, FIRST, STEP, OUTER_STRESS, N_ENTRIES = range(6)

PLACES, SPEEDS = 129, 97
"""Nodes of the table: forces come out within 1e-6 of the largest one, and so does their change with speed."""

REACH = 0.2
"""Way of the race that the table covers both ways, over the distance of the groove centres [1]; balls are
pressed beyond 5 GPa there. Further out its last cubic goes on."""

# What is tabulated.
FORCE, ENERGY, INNER, OUTER = range(4)


@dataclass(frozen=True, kw_only=True, eq=False)
class BallTable:
    """A table of balls at speed."""

    entries: Array
    """Its entries in the row of a bearing, shape (5,): steps of speed [rad/s] and of the root of the way
    [√m], touch [m], first root [√m], stress on the outer race [Pa/N^⅓]."""
    values: Array
    """Speeds, quantities; value and its slopes by a step in place, in speed, in both; places: shape (W, 4, 4,
    T)."""


def ball_table(balls: FastBalls, fastest: float, outer_stress: float) -> BallTable:
    """Table of the balls of a preloaded row for a race that turns up to a speed [rad/s].

    ``outer_stress`` is the stress on the outer race over the third root of a load [Pa/N^⅓]. Source:
    `ball_equilibrium` on a grid.
    """
    from rotordrop.physics.fast_balls import ball_equilibrium, centred_balls

    A_0 = balls.inner_groove + balls.outer_groove
    touch = math.sqrt(A_0 * A_0 - balls.axial_offset * balls.axial_offset) - balls.radial_offset
    least, most = -math.sqrt(REACH * A_0 + touch), math.sqrt(REACH * A_0 - touch)
    step = (most - least) / (PLACES - 1)
    root = (np.arange(PLACES) - math.ceil(-least / step)) * step  # a node where slow balls touch
    speed_step = fastest / (SPEEDS - 1)
    speeds = np.arange(SPEEDS + 2) * speed_step
    centred = [centred_balls(balls, float(omega)) for omega in speeds]
    force = np.array([float(balls.centrifugal_force(orbit)) for _, orbit in centred])
    radial = balls.radial_offset + touch + root * np.abs(root)
    grid = np.repeat(force, PLACES), np.tile(radial, len(speeds))
    state = ball_equilibrium(balls, balls.axial_offset, grid[1], grid[0])
    middle = np.repeat([float(ball.energy[0]) for ball, _ in centred], PLACES)
    quantities = (
        (state.radial_force, state.radial_stiffness),
        (state.energy - middle, state.radial_force),
        (state.inner_load, state.inner_slope),
        (state.outer_load, state.outer_slope),
    )
    by_root = np.tile(2.0 * np.abs(root) * step, len(speeds))  # slope of the way by a step of its root
    values = np.empty((SPEEDS, len(quantities), 4, PLACES))
    for k, (value, slope) in enumerate(quantities):
        for j, one in enumerate((value, slope * by_root)):
            over = one.reshape(len(speeds), PLACES)
            values[:, k, j], values[:, k, 2 + j] = over[:SPEEDS], _slope_by_speed(over)
    entries = np.zeros(N_ENTRIES)
    entries[SPEED_STEP], entries[TOUCH], entries[OUTER_STRESS] = speed_step, touch, outer_stress
    entries[FIRST], entries[STEP] = root[0], step
    return BallTable(entries=entries, values=values)


def _slope_by_speed(over: Array) -> Array:
    """Change by a step of speed at all nodes but the last two, of fourth order; even about standstill."""
    whole = np.concatenate([over[2:0:-1], over])
    return np.asarray((whole[:-4] - 8.0 * whole[1:-3] + 8.0 * whole[3:-1] - whole[4:]) / 12.0)


@inner_kernel
def _speed_cell(grid: Array, table: Array, spin: float) -> tuple[int, float]:
    """Cell of the speed of a race [rad/s] and the place in it [1]."""
    v = abs(spin) / grid[SPEED_STEP]
    j = min(int(v), table.shape[0] - 2)
    return j, v - j


@inner_kernel
def _place_cell(grid: Array, table: Array, way: float) -> tuple[int, float, float]:
    """Cell of the way of a race towards a ball [m], the place in it [1], the root of the way [√m]."""
    x = way - grid[TOUCH]
    t = math.sqrt(abs(x))
    u = max(((t if x > 0.0 else -t) - grid[FIRST]) / grid[STEP], 0.0)
    i = min(int(u), table.shape[3] - 2)
    return i, u - i, t


@inner_kernel
def _weights(v: float) -> tuple[float, float, float, float]:
    """Weights of Hermite's cubic [1]: value and slope at the lower end, value and slope at the upper one."""
    w = 1.0 - v
    return (1.0 + 2.0 * v) * w * w, v * w * w, v * v * (3.0 - 2.0 * v), -v * v * w


@inner_kernel
def _between(weights: tuple[float, float, float, float], a: float, b: float, c: float, d: float) -> float:
    """Sum of value and slope at both ends."""
    return weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d


@lean_kernel
def fast_force(
    grid: Array, table: Array, balls: Array, dx: float, dy: float, spin: float, places: Array, blend: Array
) -> tuple[float, float, float]:
    """Restoring force [N] of a race moved by (dx, dy) [m] that spins [rad/s], and slope of the energy [J s].

    ``grid`` (5,) and ``table`` (W, 4, 4, T) as `ball_table` makes them, ``balls`` (3, Z8) as
    `rotordrop.physics.ball_set.balls_of` does; ``places`` (Z8,) and ``blend`` (3, T) are scratch. The slope
    is that of `fast_energy` by the spin. Source: Jones 1960, by `ball_table`.
    """
    j, v = _speed_cell(grid, table, spin)
    a, b, c, d = _weights(v)
    low, high = table[j, FORCE], table[j + 1, FORCE]
    turn_low, turn_high = table[j, ENERGY], table[j + 1, ENERGY]
    # between speeds first, for the places that the race can have got to: nodes lie side by side there
    reach = math.sqrt(dx * dx + dy * dy)
    first = max(int((-math.sqrt(reach + abs(grid[TOUCH])) - grid[FIRST]) / grid[STEP]) - 1, 0)
    last = int((math.sqrt(reach + abs(grid[TOUCH])) - grid[FIRST]) / grid[STEP]) + 3
    for k in range(first, min(last, table.shape[3])):
        blend[0, k] = a * low[0, k] + b * low[2, k] + c * high[0, k] + d * high[2, k]
        blend[1, k] = a * low[1, k] + b * low[3, k] + c * high[1, k] + d * high[3, k]
        blend[2, k] = (1.0 - v) * turn_low[2, k] + v * turn_high[2, k]
    for k in range(balls.shape[1]):
        x = dx * balls[COSINE, k] + dy * balls[SINE, k] - grid[TOUCH]
        places[k] = max((math.copysign(math.sqrt(abs(x)), x) - grid[FIRST]) / grid[STEP], 0.0)
    top = np.uint64(table.shape[3] - 2)
    F_x = F_y = by_spin = 0.0
    for k in range(balls.shape[1]):
        i = min(np.uint64(places[k]), top)  # no sign: a negative place would count from the end
        u = places[k] - i
        w = 1.0 - u
        f, g = blend[0, i], blend[0, i + np.uint64(1)]
        bent = u * w * (w * blend[1, i] - u * blend[1, i + np.uint64(1)])
        force = balls[COUNT, k] * (f + u * u * (3.0 - 2.0 * u) * (g - f) + bent)
        # between the nodes on a straight line: this only closes the books
        by_spin += balls[COUNT, k] * (w * blend[2, i] + u * blend[2, i + np.uint64(1)])
        F_x += force * balls[COSINE, k]
        F_y += force * balls[SINE, k]
    return F_x, F_y, by_spin * (1.0 if spin >= 0.0 else -1.0) / grid[SPEED_STEP]


@inner_kernel
def _looked_up(
    table: Array,
    j: int,
    i: int,
    what: int,
    by_speed: tuple[float, float, float, float],
    by_place: tuple[float, float, float, float],
) -> float:
    """One quantity in a cell, by the weights of speed and place."""
    p, q = table[j, what], table[j + 1, what]
    return _between(
        by_place,
        _between(by_speed, p[0, i], p[2, i], q[0, i], q[2, i]),
        _between(by_speed, p[1, i], p[3, i], q[1, i], q[3, i]),
        _between(by_speed, p[0, i + 1], p[2, i + 1], q[0, i + 1], q[2, i + 1]),
        _between(by_speed, p[1, i + 1], p[3, i + 1], q[1, i + 1], q[3, i + 1]),
    )


@lean_kernel
def fast_energy(grid: Array, table: Array, balls: Array, dx: float, dy: float, spin: float) -> float:
    """Energy [J] of all balls less that with the race centred at the same spin [rad/s].

    Elastic energy less the work of the centrifugal forces; the force of `fast_force` is its gradient by the
    displacement. Source: `rotordrop.physics.fast_balls.ball_equilibrium`.
    """
    j, v = _speed_cell(grid, table, spin)
    energy = 0.0
    for b in range(balls.shape[1]):
        i, u, _ = _place_cell(grid, table, dx * balls[COSINE, b] + dy * balls[SINE, b])
        energy += balls[COUNT, b] * _looked_up(table, j, i, ENERGY, _weights(v), _weights(u))
    return energy


@lean_kernel
def fast_loads(
    grid: Array, table: Array, balls: Array, dx: float, dy: float, spin: float
) -> tuple[float, float]:
    """Largest load of a ball [N] on the inner and on the outer race. Source: `ball_equilibrium`."""
    j, v = _speed_cell(grid, table, spin)
    inner = outer = 0.0
    for b in range(balls.shape[1]):
        if balls[COUNT, b] > 0.0:
            i, u, _ = _place_cell(grid, table, dx * balls[COSINE, b] + dy * balls[SINE, b])
            inner = max(inner, _looked_up(table, j, i, INNER, _weights(v), _weights(u)))
            outer = max(outer, _looked_up(table, j, i, OUTER, _weights(v), _weights(u)))
    return inner, outer


def fast_centred_row(grid: Array, table: Array, spin: float, ball_count: float) -> tuple[float, float]:
    """Axial force of a row [N] whose race turns centred [rad/s], and all loads on its inner race [N].

    Source: `ball_equilibrium`; the load of a ball less its radial part.
    """
    j, v = _speed_cell(grid, table, spin)
    i, u, _ = _place_cell(grid, table, 0.0)
    load = max(_looked_up(table, j, i, INNER, _weights(v), _weights(u)), 0.0)
    radial = _looked_up(table, j, i, FORCE, _weights(v), _weights(u))
    return ball_count * math.sqrt(max(load * load - radial * radial, 0.0)), ball_count * load
