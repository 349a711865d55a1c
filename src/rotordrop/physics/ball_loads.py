"""Load of every single ball of a bearing: from the displacement of its race, or from the force on it."""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.physics.ball_bearing import BearingConstants

_STEPS = 60
_LONGEST_STEP = 20e-6
"""Longest step [m] of the search for a displacement: a fraction of what any ball gives way under load."""
_SETTLED = 1e-9
"""Last step [m] above which the search has not found a displacement: a thousandth of what matters."""


def ball_loads(constants: BearingConstants, displacement: Array, rings: Array | float = 0.0) -> Array:
    """Load of every ball [N], shape (T, rows, Z), of a race displaced (x, y) from the outer ring [m], (T, 2).

    ``rings`` (T,) [m] is the way of outer rings from their balls, zero between rigid spacers.

    Source: Neisi 2020, eqs. (2)–(6), ball by ball.
    """
    return loads_and_angles(constants, displacement, rings)[0]


def loads_and_angles(
    constants: BearingConstants,
    displacement: Array,
    rings: Array | float = 0.0,
    along: Array | float = 0.0,
) -> tuple[Array, Array]:
    """Load of every ball [N] as `ball_loads`, and its contact angle [rad], shape (T, rows, Z).

    ``along`` (T,) [m] is the displacement of the race along the axis.

    Source: Neisi 2020, eqs. (2)–(6), ball by ball.
    """
    angles = constants.row_ball_angles
    radial = (
        constants.radial_offset
        + displacement[:, 0, None, None] * np.cos(angles)
        + displacement[:, 1, None, None] * np.sin(angles)
    )
    axial = np.asarray(constants.axial_offset - rings)[..., None, None]
    axial = axial + np.asarray(along)[..., None, None] * np.array(constants.axial_signs)[:, None]
    approach = np.maximum(np.hypot(radial, axial) - constants.groove_distance, 0.0)
    load = np.asarray(constants.ball_stiffness * approach * np.sqrt(approach))
    return load, np.arctan2(np.abs(axial), radial)


def displacement_under(constants: BearingConstants, force: Array) -> Array:
    """Displacement of the race (x, y) [m], (T, 2), at which its balls push back with a force [N], (T, 2).

    Damped Newton steps for all instants at once. ``force`` is the force *on* the race; balls push against its
    displacement. Without preload and without force a race may be anywhere in its play: it is left in the
    centre. Source: equilibrium of Neisi 2020, eqs. (2)–(6).

    Raises
    ------
    SimulationError
        If the search does not settle, which takes a force that no such bearing bears.
    """
    angles = constants.row_ball_angles.reshape(-1)
    cosine, sine = np.cos(angles), np.sin(angles)
    wanted = -np.asarray(force, dtype=np.float64)
    size = np.hypot(wanted[:, 0], wanted[:, 1])
    found = _between_two_balls(constants, wanted) if constants.radial_play > 0.0 else np.zeros_like(wanted)
    for _ in range(_STEPS):
        radial = constants.radial_offset + np.outer(found[:, 0], cosine) + np.outer(found[:, 1], sine)
        distance = np.hypot(radial, constants.axial_offset)
        approach = np.maximum(distance - constants.groove_distance, 0.0)
        load = constants.ball_stiffness * approach * np.sqrt(approach)
        share = radial / distance
        push = load * share
        stiffness = 1.5 * constants.ball_stiffness * np.sqrt(approach) * share * share
        stiffness += load * (1.0 - share * share) / distance
        k_xx, k_xy, k_yy = (
            stiffness @ (cosine * cosine),
            stiffness @ (cosine * sine),
            stiffness @ (sine * sine),
        )
        floor = 1e-9 * (k_xx + k_yy) + 1.0
        k_xx, k_yy = k_xx + floor, k_yy + floor
        miss = wanted - np.stack([push @ cosine, push @ sine], axis=1)
        determinant = k_xx * k_yy - k_xy * k_xy
        step = np.stack(
            [k_yy * miss[:, 0] - k_xy * miss[:, 1], k_xx * miss[:, 1] - k_xy * miss[:, 0]], axis=1
        )
        step /= determinant[:, None]
        length = np.hypot(step[:, 0], step[:, 1])
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(length, 1e-30))[:, None]
        found = found + step
        if math.sqrt(float(np.max(length, initial=0.0))) < 1e-7:
            break
    _refuse_unsettled(length, size)
    return found


def _between_two_balls(constants: BearingConstants, wanted: Array) -> Array:
    """Displacement (T, 2) [m] at which the two balls beside a push (T, 2) [N] bear it alone.

    A race with play that starts elsewhere has one ball in its way or none, and nothing leads it aside.
    """
    angles = np.unique(np.round(np.mod(constants.row_ball_angles, 2.0 * np.pi), 9))
    toward = np.mod(np.arctan2(wanted[:, 1], wanted[:, 0]), 2.0 * np.pi)
    after = np.searchsorted(angles, toward, side="right")
    first, second = angles[after - 1], angles[after % len(angles)]
    across = np.sin(second - first)
    size = np.hypot(wanted[:, 0], wanted[:, 1])
    ways = []
    for share in (np.sin(second - toward), np.sin(toward - first)):
        load = np.maximum(size * share / across, 0.0) / len(constants.row_ball_angles)
        ways.append(constants.radial_play + (load / constants.ball_stiffness) ** (2.0 / 3.0))
    x = (ways[0] * np.sin(second) - ways[1] * np.sin(first)) / across
    y = (ways[1] * np.cos(first) - ways[0] * np.cos(second)) / across
    return np.where(size[:, None] > 0.0, np.stack([x, y], axis=1), 0.0)


def _refuse_unsettled(last_step: Array, force: Array) -> None:
    """Refuse displacements that were still moving when the steps ran out."""
    lost = np.flatnonzero(~(last_step < _SETTLED))
    if len(lost):
        worst = float(np.max(force[lost]))
        raise SimulationError(
            f"no position of the race was found at which its balls push back with {worst:.4g} N "
            f"({len(lost)} of {len(force)} instants, after {_STEPS} steps); such a force is beyond any "
            "bearing of this size: check units of force and balls"
        )
