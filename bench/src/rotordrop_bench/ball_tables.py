"""Force over deflection of ball bearings by solutions of their own: held preload, fast balls, play; thrust.

A pair of rows is a smooth ring of balls, whose loads follow from where the grooves go.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import BearingNumbers, numbers_of
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.errors import UsageError
from rotordrop.rotor.parameters import FASTEST
from rotordrop_bench import departure as D
from rotordrop_bench.violations import BallsViolation, FaceViolation

LARGEST_LOADS = 60.0
"""Load over the static load of a bearing up to which its table goes, with room besides [1]; chosen."""
SMEARED = 4
"""Places per ball at which the ring of balls is summed up [1]; chosen."""
NEWTON_STEPS = 80

Solved = tuple[float, float]
"""Radial force of a bearing, largest load of a ball on its inner race [N]."""


def table_row(bearing: TouchdownBearing, balls: BallsViolation, load: float, nominal: float) -> Array:
    """Entries of a departure from `TABLE_SPEEDS` on: force and ball load [N] over the deflection.

    ``load`` is its static load [N], ``nominal`` the nominal speed of the machine [rad/s].
    """
    numbers, constants = _pair(bearing, "held_preload, inertia and seat_play of balls")
    turn = (FASTEST * nominal / (D.MOST_SPEEDS - 1)) if balls.inertia else 1.0
    speeds = turn * np.arange(D.MOST_SPEEDS if balls.inertia else 1)
    free = constants.groove_distance * (1.0 - math.cos(constants.contact_angle))
    step = (4.0 * numbers.deflection(LARGEST_LOADS * load)[0] + free) / (D.TABLE_POINTS - 1)
    row = np.zeros(D.N_COLUMNS - D.TABLE_SPEEDS)
    row[:3] = len(speeds), turn, step
    for j, omega in enumerate(speeds):
        solve = _solution(bearing, constants, balls, float(omega))
        found = np.array([solve(step * i) for i in range(D.TABLE_POINTS)])
        at = D.TABLE - D.TABLE_SPEEDS + 2 * j * D.TABLE_POINTS
        row[at : at + 2 * D.TABLE_POINTS] = found.T.ravel()
    return row


def face_row(bearing: TouchdownBearing, face: FaceViolation) -> Array:
    """Entries of a departure from `THRUST` up to `TABLE_SPEEDS`: a face and the pair of rows behind it."""
    _, constants = _pair(bearing, "a thrust on its face")
    slope, row = constants.axial_offset / constants.radial_offset, np.zeros(D.TABLE_SPEEDS)
    face.fill(row)
    loss = math.sqrt(float(face.stiffness) * float(bearing.race.mass))
    row[D.FACE_DAMPING] = 2.0 * float(face.damping) * loss
    row[D.ALONG] = 2.0 * slope * slope  # equal dashpots along the lines of contact
    row[[D.RING_BALL, D.RING_GROOVES]] = constants.ball_stiffness, constants.groove_distance
    row[[D.RING_RADIAL, D.RING_AXIAL]] = constants.radial_offset, constants.axial_offset
    places = SMEARED * len(constants.ball_angles) // 2
    row[[D.RING_PLACES, D.RING_SHARE]] = places, len(constants.ball_angles) / places
    return row[D.THRUST :]


def _pair(bearing: TouchdownBearing, what: str) -> tuple[BearingNumbers, Any]:
    """Numbers and constants of a preloaded pair of rows, which what a violation asks for needs."""
    numbers = numbers_of(bearing)
    constants = numbers.constants
    if not (constants.preloaded and len(constants.axial_signs) == 2):
        raise UsageError(
            f"{bearing.name}: {what} needs a preloaded pair of rows, which this bearing is not; leave "
            "it out of its violations"
        )
    return numbers, constants


def _solution(
    bearing: TouchdownBearing, constants: Any, balls: BallsViolation, omega: float
) -> Callable[[float], Solved]:
    if balls.inertia:
        return lambda way: fast_pair(bearing, constants, way, omega)
    if balls.held_preload:
        return lambda way: held_pair(constants, way)
    play = float(balls.seat_play)
    return lambda way: thrust_pair(constants, max(way - play, 0.0), 0.0)[:2]


def _ring(constants: Any) -> tuple[Array, float]:
    """Cosines of the places that stand for the balls of a row, and how many balls each stands for."""
    places = SMEARED * len(constants.ball_angles)
    return np.cos(2.0 * math.pi * (np.arange(places) + 0.5) / places), 1.0 / SMEARED


def _row(constants: Any, way: float, axial: float) -> tuple[float, float, float, float]:
    """Radial and axial force, slope of the axial one, largest ball load of a row with its grooves apart."""
    cosine, share = _ring(constants)
    radial = constants.radial_offset + way * cosine
    apart = np.hypot(radial, axial)
    pressed = np.maximum(apart - constants.groove_distance, 0.0)
    load = constants.ball_stiffness * pressed**1.5
    slope = 1.5 * constants.ball_stiffness * np.sqrt(pressed) * (axial / apart) ** 2
    slope += load / apart * (radial / apart) ** 2
    force = share * load / apart
    return (
        float(force @ (radial * cosine)),
        float(np.sum(force) * axial),
        share * float(np.sum(slope)),
        max(load),
    )


def held_pair(constants: Any, way: float) -> Solved:
    """A pair whose rows are pressed with the preload whatever the race does: outer rings move freely."""
    axial = constants.axial_offset
    for _ in range(NEWTON_STEPS):
        radial, pressed, slope, load = _row(constants, way, axial)
        step = (constants.preload - pressed) / max(slope, 1e-3 * constants.preload / constants.axial_offset)
        axial = max(axial + step, 1e-3 * constants.axial_offset)
        if abs(step) < 1e-13:
            break
    return 2.0 * radial, load


def thrust_pair(constants: Any, way: float, thrust: float) -> tuple[float, float, float]:
    """A rigid pair whose race carries a thrust [N] too: one row gains what the other loses.

    Radial force, largest load of a ball [N], way along the axis [m].
    """
    along = 0.0
    for _ in range(NEWTON_STEPS):
        one = _row(constants, way, constants.axial_offset + along)
        other = _row(constants, way, constants.axial_offset - along)
        step = (thrust - (one[1] - other[1])) / (one[2] + other[2])
        along += step
        if abs(step) < 1e-13:
            break
    return one[0] + other[0], max(one[3], other[3]), along


def fast_pair(bearing: TouchdownBearing, constants: Any, way: float, omega: float) -> Solved:
    """A rigid pair whose balls orbit: each lies where both contacts and its centrifugal force balance.

    Source: Jones 1960 without the gyroscopic moment, the orbit by the nominal contact angle. The load is that
    of the inner race which makes the larger of both stresses.
    """
    part, (cosine, share) = bearing.bearing, _ring(constants)
    D_w, d_m = float(part.ball_diameter), float(part.pitch_diameter)
    orbit = 0.5 * omega * (1.0 - D_w / d_m * math.cos(constants.contact_angle))
    outwards = float(part.ball_density) * math.pi / 12.0 * D_w**3 * d_m * orbit**2
    grooves = [(float(f) - 0.5) * D_w for f in (part.conformity_outer, part.conformity_inner)]
    stiff = (constants.outer_stiffness, constants.inner_stiffness)
    inner = np.column_stack(
        [constants.radial_offset + way * cosine, np.full(len(cosine), constants.axial_offset)]
    )
    ball = inner * grooves[0] / sum(grooves)
    push = np.array([outwards, 0.0])
    for _ in range(NEWTON_STEPS):
        lack, slopes = np.tile(push, (len(ball), 1)), np.zeros((len(ball), 2, 2))
        for arm, groove, K in zip((ball, ball - inner), grooves, stiff, strict=True):
            length = np.linalg.norm(arm, axis=1)
            pressed = np.maximum(length - groove, 0.0)
            along, load = arm / length[:, None], K * pressed**1.5
            lack = lack - load[:, None] * along
            both = along[:, :, None] * along[:, None, :]
            slopes += (1.5 * K * np.sqrt(pressed))[:, None, None] * both
            slopes += (load / length)[:, None, None] * (np.eye(2) - both)
        slopes += 1e-9 * K * math.sqrt(groove) * np.eye(2)
        step = np.linalg.solve(slopes, lack[:, :, None])[:, :, 0]
        size = np.linalg.norm(step, axis=1, keepdims=True)
        ball = ball + step * np.minimum(1.0, 0.05 * sum(grooves) / np.maximum(size, 1e-300))
        if np.max(size) < 1e-14:
            break
    arms = ball, ball - inner
    loads = [
        K * np.maximum(np.linalg.norm(arm, axis=1) - groove, 0.0) ** 1.5
        for arm, groove, K in zip(arms, grooves, stiff, strict=True)
    ]
    pulled = -loads[1] * arms[1][:, 0] / np.linalg.norm(arms[1], axis=1)
    harder = (constants.stress_coefficient_outer / constants.stress_coefficient_inner) ** 3
    return 2.0 * share * float(pulled @ cosine), float(max(np.max(loads[1]), harder * np.max(loads[0])))
