"""Outer rings that springs press against their balls: they give way axially where rigid spacers would not.

A radial push wedges the rings of an angular-contact pair apart. Both rings, or the one of a single row, move
by the same way ``q`` [m] from their balls; what springs, stop and the fit in the housing say against it
stands here, the force of the balls in `rotordrop.physics.ball_set`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel
from rotordrop.physics.ball_set import AXIAL_OFFSET, BALL_STIFFNESS, GROOVE_DISTANCE, RADIAL_OFFSET
from rotordrop.physics.elementary import tanh

if TYPE_CHECKING:
    from rotordrop.physics.ball_bearing import BearingConstants


# Entries of the rings that springs press on; SI units. Mass zero is a preload by rigid spacers. GROWN is what
# heat adds to the radial offset of the balls, and no part of what the springs were set to. DAMPING is that of
# a ring over that of dashpots along the lines of contact.
MASS, RATE, TRAVEL, STOP, FRICTION, BALLS, ROWS, GROWN, DAMPING, N_ENTRIES = range(10)

SMOOTHING_SPEED = 1e-2
"""Speed of a ring [m/s] below which the friction of its fit is smoothed: chosen, not measured. A hundredth of
it moves the first peak of a pair of size 7016 by 4 % at most, and takes three times the steps."""

STOP_STIFFNESS = 10.0
"""Stiffness of a stop over the axial stiffness of a row at its preload [1]: chosen, as good as rigid."""


def row_rigidity(constants: BearingConstants) -> float:
    """Axial stiffness of one row at its preload [N/m]. Source: Neisi 2020, eqs. (3)–(6), differentiated."""
    from rotordrop.physics.ball_bearing import row_axial_stiffness

    stiffness = constants.ball_count * constants.ball_stiffness
    approach, groove = constants.preload_approach, constants.groove_distance
    return float(row_axial_stiffness(approach, stiffness, groove, constants.contact_angle))


@inner_kernel
def preload_force(numbers: Array, entries: Array) -> float:
    """Force [N] of the springs on one ring where the race is centred: what its row says at its offset.

    ``numbers`` (9,) as they are listed above, ``entries`` (5,) of the ball set. Source: Neisi 2020, eqs.
    (3)–(6), for an axial displacement.
    """
    radial, axial = entries[RADIAL_OFFSET] - numbers[GROWN], entries[AXIAL_OFFSET]
    A = math.sqrt(radial * radial + axial * axial)
    delta = max(A - entries[GROOVE_DISTANCE], 0.0)
    force: float = numbers[BALLS] * entries[BALL_STIFFNESS] * delta * math.sqrt(delta) * axial / A
    return force


@inner_kernel
def spring_force(numbers: Array, entries: Array, q: float) -> tuple[float, float]:
    """Force [N] of springs and stop on one ring that has moved by q [m], and its slope [N/m].

    ``F_V + rate · q``, never negative: springs push; beyond the travel the stop holds in addition. Arguments
    as of `preload_force`. Source: definition.
    """
    force, rate = preload_force(numbers, entries) + numbers[RATE] * q, numbers[RATE]
    if force <= 0.0:
        return 0.0, 0.0
    beyond = q - numbers[TRAVEL]
    if beyond > 0.0:
        force += numbers[STOP] * beyond
        rate += numbers[STOP]
    return force, rate


@inner_kernel
def fit_friction(numbers: Array, F: float, v: float) -> float:
    """Friction [N] of one ring in its housing.

    Parameters
    ----------
    numbers : ndarray, shape (9,)
        Rings of the bearing; coefficient [1] on the share of each ring of the radial force.
    F : float
        Radial force through all rings [N].
    v : float
        Speed of the ring from its balls [m/s].

    Notes
    -----
    Coulomb's friction, smoothed: ``µ F / rows · tanh(v / v0)``. A ring that would stick creeps instead.
    Source: definition. Not validated against a measured ring.
    """
    friction: float = numbers[FRICTION] / numbers[ROWS] * F * tanh(v / SMOOTHING_SPEED)
    return friction


@inner_kernel
def ring_energy(numbers: Array, entries: Array, q: float, v: float) -> float:
    """Energy [J] of motion, springs and stop of all rings that have moved by q [m] at a speed v [m/s].

    Source: integral of `spring_force`.
    """
    preload, rate = preload_force(numbers, entries), numbers[RATE]
    way = max(q, -preload / rate)
    energy = 0.5 * numbers[MASS] * v * v + preload * way + 0.5 * rate * way * way
    beyond = max(q - numbers[TRAVEL], 0.0)
    energy += 0.5 * numbers[STOP] * beyond * beyond
    return float(numbers[ROWS] * energy)


def seat_on_springs(constants: BearingConstants, numbers: Array, force: Array) -> Array:
    """Where race and rings come to rest under forces of the balls on the race (x, y) [N], (T, 2).

    Returns x, y of the race and the way of the rings [m], (T, 3), without friction of the fit: the state that
    slow loads and vibration lead to. Damped Newton steps for all instants at once.
    Source: equilibrium of Neisi 2020, eqs. (2)–(6), and `spring_force`.
    """
    angles = constants.row_ball_angles.reshape(-1)
    direction = np.stack([np.cos(angles), np.sin(angles)])
    entries = np.zeros(AXIAL_OFFSET + 1)
    entries[BALL_STIFFNESS], entries[GROOVE_DISTANCE] = constants.ball_stiffness, constants.groove_distance
    entries[RADIAL_OFFSET], entries[AXIAL_OFFSET] = constants.radial_offset, constants.axial_offset
    wanted = -np.asarray(force, dtype=np.float64)
    found = np.zeros((len(wanted), 3))
    for _ in range(_STEPS):
        miss, tangent = _out_of_balance(constants, numbers, entries, direction, wanted, found)
        floor = 1e-9 * np.trace(tangent, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        step = np.linalg.solve(tangent + floor, miss[..., None])[..., 0]
        length = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(length, 1e-30))[:, None]
        found = found + step
        if float(np.max(length, initial=0.0)) < _SETTLED:
            break
    return found


_STEPS, _LONGEST_STEP, _SETTLED = 200, 20e-6, 1e-16
"""Steps of the search, the longest of them and the one it ends at [m]."""


def _out_of_balance(
    constants: BearingConstants,
    numbers: Array,
    entries: Array,
    direction: Array,
    wanted: Array,
    found: Array,
) -> tuple[Array, Array]:
    """Force that is missing (T, 3) [N] and tangent stiffness (T, 3, 3) [N/m] by x, y and way of the rings."""
    radial = constants.radial_offset + found[:, :2] @ direction
    axial = (constants.axial_offset - found[:, 2])[:, None]
    distance = np.hypot(radial, axial)
    approach = np.maximum(distance - constants.groove_distance, 0.0)
    load = constants.ball_stiffness * approach * np.sqrt(approach)
    along, across = 1.5 * constants.ball_stiffness * np.sqrt(approach), load / distance
    cosine, sine = radial / distance, axial / distance
    # motion of a groove along and across its line of contact, by x, y and the way of the rings
    ones = np.ones_like(radial)
    moves = np.stack([ones * direction[0], ones * direction[1], np.zeros_like(radial)], axis=-1)
    leads = np.stack([np.zeros_like(radial), np.zeros_like(radial), -ones], axis=-1)
    by_line = cosine[..., None] * moves + sine[..., None] * leads
    by_side = cosine[..., None] * leads - sine[..., None] * moves
    tangent = np.einsum("tz,tzi,tzj->tij", along, by_line, by_line)
    tangent += np.einsum("tz,tzi,tzj->tij", across, by_side, by_side)
    held = np.array([spring_force(numbers, entries, q) for q in found[:, 2]]).reshape(-1, 2)
    miss = -np.einsum("tz,tzi->ti", load, by_line)
    miss[:, :2] += wanted
    miss[:, 2] -= numbers[ROWS] * held[:, 0]
    tangent[:, 2, 2] += numbers[ROWS] * held[:, 1]
    return miss, tangent
