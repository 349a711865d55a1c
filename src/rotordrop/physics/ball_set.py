"""All balls between race and support: force, torque, stiffness, energy, load and stress of one bearing.

Whoever needs one of these hands over the bearing's numbers and its balls, the motion of the race and its
spin, and does not know what rolls behind the race. The numbers are a short array that only this module reads:
`ball_set_entries` makes what it says of the balls, the columns of `rotordrop.physics.columns` hold it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel, lean_kernel
from rotordrop.physics.elementary import cos_each, cube_root, magnitude, sin_each
from rotordrop.physics.spin import race_drag_torque

if TYPE_CHECKING:
    from rotordrop.physics.ball_bearing import BearingConstants

LANES = 8

# Entries of a ball set; SI units.
BALL_STIFFNESS, GROOVE_DISTANCE, RADIAL_OFFSET, AXIAL_OFFSET, STRESS_COEFFICIENT, N_ENTRIES = range(6)

# Entries of a rolling bearing: its ball set, then its drag and damping, then the axial force of its rows that
# brakes the race beside the radial one (zero unless the bearing warms), then the dashpots along the lines of
# contact of all balls over the radial damping [1]; SI units.
DRAG_COEFFICIENT, DRAG_SPEED, PITCH_DIAMETER, DAMPING = range(N_ENTRIES, N_ENTRIES + 4)
PRESSED, LINES, ROLLING_N_ENTRIES = range(N_ENTRIES + 4, N_ENTRIES + 7)

LEAST_DAMPING = 1e-9
"""Share of a loaded ball's stiffness [1] added to what holds a loose race, sideways perhaps nothing."""


# Rows of the array of balls.
COSINE, SINE, COUNT = range(3)


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


def balls_of(constants: BearingConstants, places: int = 0, facing: float = 0.0) -> Array:
    """Direction cosine, sine [1] and number of balls at each place, shape (3, Z8).

    Rows of balls that coincide are one place with a count; places are padded with count zero to whole lanes
    of eight, to ``places`` at least. With ``facing`` [1] only the rows of that axial sign, +1 or -1.
    Source: Neisi 2020, eq. (2), angles of the balls.
    """
    angles, counts = _merged_angles(constants)
    if facing != 0.0:
        angles = constants.row_ball_angles[np.array(constants.axial_signs) == facing].reshape(-1)
        counts = np.ones(len(angles))
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
def lane_sum(values: Array) -> float:
    """Sum of an array whose length is a multiple of eight, in eight partial sums of fixed order.

    Unit of the values; shape (8 k,). Source: explicit partial sums keep strict floating point and vectorise.
    """
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    for k in range(0, values.shape[0], 8):
        s0 += values[k]
        s1 += values[k + 1]
        s2 += values[k + 2]
        s3 += values[k + 3]
        s4 += values[k + 4]
        s5 += values[k + 5]
        s6 += values[k + 6]
        s7 += values[k + 7]
    return ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7))


@inner_kernel
def ball_set_force(
    entries: Array, balls: Array, dx: float, dy: float, work: Array, ring: float = 0.0
) -> tuple[float, float]:
    """Restoring force [N] of a race moved by (dx, dy) [m], x and y; the force *on* the race is its negative.

    ``entries`` (5,) and ``balls`` (3, Z8) as `ball_set_entries` and `balls_of` make them, ``work`` (2, Z8) is
    scratch; ``ring`` [m] is the way of sprung outer rings from their balls.

    Source: Neisi 2020, eqs. (2)–(6). Differs from the paper: axial offset of an angular-contact row;
    algebraic form, the distance of the groove centres instead of contact angles: no ``atan``, no ``cos``.
    """
    K, A_0 = entries[BALL_STIFFNESS], entries[GROOVE_DISTANCE]
    radial_offset, axial_offset = entries[RADIAL_OFFSET], entries[AXIAL_OFFSET] - ring
    cosines, sines, weights = balls[COSINE], balls[SINE], balls[COUNT]
    axial2 = axial_offset * axial_offset
    for j in range(cosines.shape[0]):
        radial = radial_offset + dx * cosines[j] + dy * sines[j]
        A = math.sqrt(radial * radial + axial2)
        delta = max(A - A_0, 0.0)
        q = weights[j] * K * delta * math.sqrt(delta) * radial / A
        work[0, j] = q * cosines[j]
        work[1, j] = q * sines[j]
    return lane_sum(work[0]), lane_sum(work[1])


@inner_kernel
def bearing_reaction(
    numbers: Array, F_x: float, F_y: float, vx: float, vy: float, spin: float
) -> tuple[float, float, float, float, float]:
    """Force on the support, torque on the race and power lost of a bearing whose balls push back.

    Parameters
    ----------
    numbers : ndarray, shape (11,)
        Ball set, drag, pitch diameter [m], damping [N s/m] and axial force of the rows [N].
    F_x, F_y : float
        Force of the balls [N], from `ball_set_force`.
    vx, vy : float
        Velocity of the race against the support [m/s].
    spin : float
        Spin of the race [rad/s].

    Returns
    -------
    tuple of float
        Force on the support along x and y [N], torque that brakes the race [N m], power that the damping of
        the balls and the drag take [W].

    Notes
    -----
    Source: Neisi 2020, eq. (12) with `rotordrop.physics.spin.race_drag_torque`; damping in proportion to the
    velocity.
    """
    drag = race_drag_torque(
        math.sqrt(F_x * F_x + F_y * F_y) + numbers[PRESSED],
        spin,
        numbers[DRAG_COEFFICIENT],
        numbers[PITCH_DIAMETER],
        numbers[DRAG_SPEED],
    )
    C_b = numbers[DAMPING]
    return F_x + C_b * vx, F_y + C_b * vy, drag, C_b * (vx * vx + vy * vy), drag * spin


def centred_row(entries: Array, ring: float, ball_count: float) -> tuple[float, float]:
    """Axial force of a row [N] with the race in the middle, and the loads of all its balls together [N].

    ``ring`` [m] is the way of the outer ring from its balls. Source: Neisi 2020, eqs. (3)–(6).
    """
    radial, axial = float(entries[RADIAL_OFFSET]), float(entries[AXIAL_OFFSET]) - ring
    A = math.sqrt(radial * radial + axial * axial)
    delta = max(A - float(entries[GROOVE_DISTANCE]), 0.0)
    load = ball_count * float(entries[BALL_STIFFNESS]) * delta * math.sqrt(delta)
    return load * axial / A, load


@inner_kernel
def ball_set_axial_force(
    entries: Array, balls: Array, dx: float, dy: float, work: Array, ring: float
) -> float:
    """Axial force [N] with which all balls push the outer rings away, at a displacement of the race [m].

    Arguments as of `ball_set_force`. Source: Neisi 2020, eqs. (2)–(6), with the axial offset of a row.
    """
    K, A_0 = entries[BALL_STIFFNESS], entries[GROOVE_DISTANCE]
    radial_offset, axial_offset = entries[RADIAL_OFFSET], entries[AXIAL_OFFSET] - ring
    cosines, sines, weights = balls[COSINE], balls[SINE], balls[COUNT]
    axial2 = axial_offset * axial_offset
    for j in range(cosines.shape[0]):
        radial = radial_offset + dx * cosines[j] + dy * sines[j]
        A = math.sqrt(radial * radial + axial2)
        delta = max(A - A_0, 0.0)
        work[0, j] = weights[j] * K * delta * math.sqrt(delta) * axial_offset / A
    return lane_sum(work[0])


@lean_kernel
def two_row_force(
    entries: Array, rows: tuple[Array, Array], dx: float, dy: float, dz: float, work: Array
) -> tuple[float, float]:
    """Restoring force [N], x and y, of a race that has moved by (dx, dy, dz) [m].

    ``rows`` are the balls (3, Z8) that motion towards +z loads and those that it relieves; other arguments as
    of `ball_set_force`. Source: Neisi 2020, eqs. (2)–(6), with the axial offset of a row.
    """
    F_x, F_y = ball_set_force(entries, rows[0], dx, dy, work, -dz)
    G_x, G_y = ball_set_force(entries, rows[1], dx, dy, work, dz)
    return F_x + G_x, F_y + G_y


@lean_kernel
def two_row_axial_force(
    entries: Array, rows: tuple[Array, Array], dx: float, dy: float, dz: float, work: Array
) -> float:
    """Restoring force [N] along z of a race that has moved by (dx, dy, dz) [m]; arguments as `two_row_force`.

    Source: Neisi 2020, eqs. (2)–(6), with the axial offset of a row.
    """
    one = ball_set_axial_force(entries, rows[0], dx, dy, work, -dz)
    return one - ball_set_axial_force(entries, rows[1], dx, dy, work, dz)


def lines_of_contact(constants: BearingConstants) -> float:
    """Equal dashpots c along the lines of contact of all N balls together, over the radial damping [1].

    A radial motion meets ``N c cos²α / 2`` of them, with the angle α of the row at rest. Source: projection.
    """
    slope = constants.axial_offset / constants.radial_offset
    return 2.0 * (1.0 + slope * slope)


@inner_kernel
def row_axial_damping(numbers: Array, share: float, ring: float) -> float:
    """Damping [N s/m] of a row against axial motion.

    Parameters
    ----------
    numbers : ndarray, shape (11,)
        Ball set, drag, damping [N s/m] and lines of contact [1], as of `bearing_reaction`.
    share : float
        Share of the row of all balls [1].
    ring : float
        Way of the outer ring from its balls [m], as of `ball_set_force`.

    Notes
    -----
    Of the dashpots of `lines_of_contact` an axial motion meets ``c sin²φ``, with the angle φ of now and the
    race in the middle: at rest ``2 tan²α`` of the radial damping for all rows together. Deep grooves have
    no angle, and no damping, until the race has moved along. Source: projection.
    """
    radial2 = numbers[RADIAL_OFFSET] * numbers[RADIAL_OFFSET]
    axial = numbers[AXIAL_OFFSET] - ring
    damping: float = share * numbers[LINES] * numbers[DAMPING] * axial * axial / (radial2 + axial * axial)
    return damping


@inner_kernel
def two_row_axial_damping(numbers: Array, rows: tuple[Array, Array], dz: float) -> float:
    """Damping [N s/m] against axial motion of a race that has moved by dz [m].

    ``numbers`` (11,) as of `row_axial_damping`, ``rows`` as of `two_row_force`. Source: `row_axial_damping`.
    """
    loaded, relieved = lane_sum(rows[0][COUNT]), lane_sum(rows[1][COUNT])
    C = row_axial_damping(numbers, loaded / (loaded + relieved), -dz)
    return C + row_axial_damping(numbers, relieved / (loaded + relieved), dz)


@lean_kernel
def ball_set_gradient(
    entries: Array, balls: Array, dx: float, dy: float, ring: float = 0.0
) -> tuple[float, float, float, float, float]:
    """Restoring force ``F_x, F_y`` [N], stiffness ``k_xx, k_xy, k_yy`` [N/m] of a race moved (dx, dy) [m].

    Source: Neisi 2020, eqs. (2)–(6), differentiated.
    """
    K, axial_offset = entries[BALL_STIFFNESS], entries[AXIAL_OFFSET] - ring
    cosines, sines, weights = balls[COSINE], balls[SINE], balls[COUNT]
    f_x = f_y = k_xx = k_xy = k_yy = 0.0
    axial2 = axial_offset * axial_offset
    for j in range(cosines.shape[0]):
        radial = entries[RADIAL_OFFSET] + dx * cosines[j] + dy * sines[j]
        A = math.sqrt(radial * radial + axial2)
        delta = A - entries[GROOVE_DISTANCE]
        if delta <= 0.0:
            continue
        root = math.sqrt(delta)
        cos_phi = radial / A
        q = weights[j] * K * delta * root
        k = weights[j] * K * 1.5 * root * cos_phi * cos_phi + q * (1.0 - cos_phi * cos_phi) / A
        q *= cos_phi
        f_x += q * cosines[j]
        f_y += q * sines[j]
        k_xx += k * cosines[j] * cosines[j]
        k_xy += k * cosines[j] * sines[j]
        k_yy += k * sines[j] * sines[j]
    return f_x, f_y, k_xx, k_xy, k_yy


@lean_kernel
def ball_set_energy(entries: Array, balls: Array, dx: float, dy: float, ring: float = 0.0) -> float:
    """Elastic energy [J] of a race moved by (dx, dy) [m]: ``Σ 2/5 K δ^(5/2)``.

    Source: integral of Neisi 2020, eq. (6).
    """
    K, axial_offset = entries[BALL_STIFFNESS], entries[AXIAL_OFFSET] - ring
    energy = 0.0
    for j in range(balls.shape[1]):
        radial = entries[RADIAL_OFFSET] + dx * balls[COSINE, j] + dy * balls[SINE, j]
        delta = math.sqrt(radial * radial + axial_offset * axial_offset) - entries[GROOVE_DISTANCE]
        if delta > 0.0:
            energy += balls[COUNT, j] * 0.4 * K * delta * delta * math.sqrt(delta)
    return energy


@inner_kernel
def ball_set_load(
    entries: Array, balls: Array, dx: float, dy: float, ring: float = 0.0
) -> tuple[float, float]:
    """Largest load of a single ball [N] and its Hertz pressure on the inner race [Pa].

    Source: Neisi 2020, eqs. (6) and (7).
    """
    axial_offset = entries[AXIAL_OFFSET] - ring
    largest = 0.0
    for j in range(balls.shape[1]):
        if balls[COUNT, j] > 0.0:
            radial = entries[RADIAL_OFFSET] + dx * balls[COSINE, j] + dy * balls[SINE, j]
            largest = max(largest, radial * radial)
    delta = max(math.sqrt(largest + axial_offset * axial_offset) - entries[GROOVE_DISTANCE], 0.0)
    load = entries[BALL_STIFFNESS] * delta * math.sqrt(delta)
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
    from rotordrop.physics.linear_algebra import solve  # none that reads entries needs it

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
