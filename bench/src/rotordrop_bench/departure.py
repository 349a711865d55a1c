"""What a touchdown bearing may have and no estimator models: departing support, gap, contact law and race.

A departure is a row of numbers and twelve states that stand behind the books of the state. What an extension
of the estimator models too (turned axes, a hardening support, a foundation) has other equations here: a
recording that is estimated must not share the equation it was made with.
"""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.physics import contact
from rotordrop.physics._compile import inner_kernel, lean_kernel
from rotordrop.physics.elementary import exp, sine_cosine

# Columns of a departure, one row per bearing; SI units.
AXIS_COSINE, AXIS_SINE = 0, 1  # of the angle from horizontal to the first principal axis of the support
HARDENING = 2  # k in the factor 1 + k h²/2 on the energy of the linear springs [1/m²], h the deflection
SLIP_FORCE, SLIP_TRAVEL = 3, 4  # [N], [m]
FOUNDATION_MODE, TILT_MODE = 5, 10  # of each: 1/M [1/kg], ω² along x and y [1/s²], 2ζω along x and y [1/s]
COMPLIANCE, SQUARE_X, SQUARE_Y, DECAY_X, DECAY_Y, MODE_WIDTH = 0, 1, 2, 3, 4, 5
CENTRE_X, CENTRE_Y = 15, 16  # centre of the bearing in the axes of the magnets [m]
GAP_DRIFT, GAP_DRIFT_TIME = 17, 18  # [m] within [s]
GAP_CLOSING, GAP_HEAT = 19, 20  # [m] when much more than [J] were rubbed
CAGE_RATIO = 21  # turn of the cage per turn of the race
LAW_PIECES, LAW = 22, 23
LAW_UNTIL, LAW_WIDTH = contact.N_ENTRIES, contact.N_ENTRIES + 1  # behind a contact law, its end [m]
MOST_PIECES = 8
# Landing sleeve: its centre off the axis, half the difference of its largest and smallest radius [m], angle
# of both from the mark of the rotor [rad]. Share of the friction that wears off, after much more than [J].
SLEEVE_OFF = LAW + MOST_PIECES * LAW_WIDTH
SLEEVE_OVAL, SLEEVE_ANGLE, WEAR, WEAR_HEAT = range(SLEEVE_OFF + 1, SLEEVE_OFF + 5)
# Way of the race within which its bearing is loose in its seat [m], and behind it a table over the deflection
# of the race: force, then largest load of a ball [N].
LOOSE_WAY, TABLE_WAY_STEP, TABLE = range(SLEEVE_OFF + 5, SLEEVE_OFF + 8)
TABLE_FORCE, TABLE_LOAD, TABLE_POINTS = 0, 1, 128
N_COLUMNS = TABLE + 2 * TABLE_POINTS

# States of a departure: displacement, then velocity of foundation and of tilt (x, y), slip over its travel
# [1], heat rubbed into the contact [J], angle of the cage [rad].
FOUNDATION, TILT, SLIP_X, SLIP_Y, HEAT, CAGE_ANGLE, N_STATES = 0, 4, 8, 9, 10, 11, 12
KINDS = (
    *(L.POSITION, L.POSITION, L.VELOCITY, L.VELOCITY) * 2,
    *(L.INTERNAL, L.INTERNAL, L.HEAT, L.ANGLE),
)
"""Kind of each of these states."""


def no_departure() -> Array:
    """Row of a bearing that departs in nothing [its columns in SI], shape (C,).

    Source: by definition; it gives the bits of a bearing without a row.
    """
    row = np.zeros(N_COLUMNS)
    row[[AXIS_COSINE, SLIP_TRAVEL, GAP_DRIFT_TIME, GAP_HEAT, WEAR_HEAT]] = 1.0
    return row


@inner_kernel
def against_bore(
    s: Array, own: Array, angle: float, spin: float, x: float, y: float, vx: float, vy: float
) -> tuple[float, float, float, float]:
    """Motion of the landing sleeve against the tilted bore [m], [m/s] from that of rotor against race.

    ``angle`` [rad] and ``spin`` [rad/s] are those of the rotor. Source: kinematics of a bore that stands off
    the axis of the magnets and tilts where the rotor touches, and of `sleeve`.
    """
    x, y = x - own[TILT] - s[CENTRE_X], y - own[TILT + 1] - s[CENTRE_Y]
    vx, vy = vx - own[TILT + 2], vy - own[TILT + 3]
    if s[SLEEVE_OFF] == 0.0 and s[SLEEVE_OVAL] == 0.0:
        return x, y, vx, vy
    off_x, off_y, by_x, by_y = sleeve(s, angle, x, y)
    return x + off_x, y + off_y, vx + spin * by_x, vy + spin * by_y


@lean_kernel
def sleeve(s: Array, angle: float, x: float, y: float) -> tuple[float, float, float, float]:
    """How far a sleeve that is eccentric and oval reaches beyond a round one [m], and its rate per spin [m].

    At a rotor angle [rad] and a displacement of the rotor against the bore [m]. Source: a circle about
    another centre; the support function of the radius ``R + a cos 2β`` in a bore, to the first order of ``a``
    over the displacement: the place of contact moves by ``-2 a sin 2β`` along the bore.
    """
    sine, cosine = sine_cosine(angle + s[SLEEVE_ANGLE])
    e, a = s[SLEEVE_OFF], s[SLEEVE_OVAL]
    r = math.sqrt(x * x + y * y)
    nx, ny = (x / r, y / r) if r > 0.0 else (0.0, 0.0)
    c, z = cosine * nx + sine * ny, cosine * ny - sine * nx  # of β, from the long axis to the contact
    once, twice = a * (c * c - z * z), 2.0 * a * (2.0 * c * z)
    return (
        e * cosine + once * nx + twice * ny,
        e * sine + once * ny - twice * nx,
        twice * nx - e * sine,
        twice * ny + e * cosine,
    )


@lean_kernel
def friction_left(s: Array, own: Array) -> float:
    """Share of the friction that wear has left [1], by the heat rubbed in so far.

    Source: chosen, not measured: as a surface that runs in, to a limit.
    """
    left: float = 1.0 - s[WEAR] * (1.0 - exp(-own[HEAT] / s[WEAR_HEAT]))
    return left


@lean_kernel
def gap_now(s: Array, own: Array, t: float, nominal: float) -> float:
    """Air gap [m] at a time [s], from the nominal one: it drifts, and closes with the heat of friction.

    Source: chosen, not measured: even drift, and growth that saturates with the heat.
    """
    drift = s[GAP_DRIFT] * min(max(t, 0.0) / s[GAP_DRIFT_TIME], 1.0)
    gap: float = nominal + drift - s[GAP_CLOSING] * (1.0 - exp(-own[HEAT] / s[GAP_HEAT]))
    return gap


@lean_kernel
def law_at(s: Array, delta: float) -> int:
    """Column of the piece of a departing contact law at an indentation [m]; -1 where the law stays.

    Source: a law through given points, a power of the depth between two of them.
    """
    pieces = int(s[LAW_PIECES])
    at = LAW if pieces > 0 else -1
    for _ in range(pieces - 1):
        if delta > s[at + LAW_UNTIL]:
            at += LAW_WIDTH
    return at


@lean_kernel
def turned(angle: float, x: float, y: float) -> tuple[float, float]:
    """A vector in axes turned by an angle [rad]; in its own unit.

    Source: rotation of axes; the balls stand where the cage has taken them.
    """
    sine, cosine = sine_cosine(angle)
    return cosine * x + sine * y, cosine * y - sine * x


@lean_kernel
def from_table(s: Array, what: int, way: float) -> float:
    """Force or largest ball load [N] of a race deflected by a way [m].

    Source: table of the row, by cubics through its points.
    """
    place = way / s[TABLE_WAY_STEP]
    i = min(int(place), TABLE_POINTS - 3)
    u, at = place - i, TABLE + what * TABLE_POINTS + i
    b, c, d = s[at], s[at + 1], s[at + 2]
    # the force of a race that goes the other way has the other sign
    a = s[at - 1] if i > 0 else (-c if what == TABLE_FORCE else c)
    bent = 2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)
    found: float = b + 0.5 * u * (c - a + u * bent)
    return found
