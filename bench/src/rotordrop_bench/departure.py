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
HARDENING, RADIAL = 2, 3  # k in F = K h (1 + k h²) [1/m²]; h along the axis, or the whole where RADIAL is 1
SLIP_FORCE, SLIP_TRAVEL = 4, 5  # [N], [m]
FOUNDATION_MODE, TILT_MODE = 6, 11  # of each: 1/M [1/kg], ω² along x and y [1/s²], 2ζω along x and y [1/s]
COMPLIANCE, SQUARE_X, SQUARE_Y, DECAY_X, DECAY_Y, MODE_WIDTH = 0, 1, 2, 3, 4, 5
CENTRE_X, CENTRE_Y = 16, 17  # centre of the bearing in the axes of the magnets [m]
GAP_DRIFT, GAP_DRIFT_TIME = 18, 19  # [m] within [s]
GAP_CLOSING, GAP_HEAT = 20, 21  # [m] when much more than [J] were rubbed
CAGE_RATIO = 22  # turn of the cage per turn of the race
LAW_PIECES, LAW = 23, 24
LAW_UNTIL, LAW_WIDTH = contact.N_ENTRIES, contact.N_ENTRIES + 1  # behind a contact law, its end [m]
MOST_PIECES = 8
# Landing sleeve: its centre off the axis, half the difference of its largest and smallest radius [m], angle
# of both from the mark of the rotor [rad]. Share of the friction that wears off, after much more than [J].
SLEEVE_OFF = LAW + MOST_PIECES * LAW_WIDTH
SLEEVE_OVAL, SLEEVE_ANGLE, WEAR, WEAR_HEAT = range(SLEEVE_OFF + 1, SLEEVE_OFF + 5)
# Stop around the support: travel up to it [m], stiffness [N/m], damping [N s/m]. Ribbon: stiffness of its
# springs before they slip [N/m], force at which all slip [N]. Way of the race within which its bearing is
# loose in its seat [m]. Balls by a table over the deflection of the race, at speeds of it [rad/s] that are
# evenly apart: force and largest load of a ball [N].
STOP_GAP, STOP_STIFFNESS, STOP_DAMPING, RIBBON_STIFFNESS, RIBBON_SLIP = range(SLEEVE_OFF + 5, SLEEVE_OFF + 10)
LOOSE_WAY = SLEEVE_OFF + 10
# Axial force on the rotor [N] that no magnet holds after power-off, and the face of the race that it lands
# on: gap [m], stiffness [N/m], damping [N s/m], friction [1] and its arm [m]. Axial damping of a pair of rows
# over the radial one [1]; one ball of it [N/m^1.5], distance of its grooves, their radial and their axial
# offset [m], places in half a ring that stand for the balls of a row, and how many balls each stands for.
THRUST, FACE_GAP, FACE_STIFFNESS, FACE_DAMPING, FACE_FRICTION, FACE_ARM = range(LOOSE_WAY + 1, LOOSE_WAY + 7)
ALONG, RING_BALL, RING_GROOVES, RING_RADIAL, RING_AXIAL, RING_PLACES, RING_SHARE = range(
    LOOSE_WAY + 7, LOOSE_WAY + 14
)
TABLE_SPEEDS, TABLE_SPEED_STEP, TABLE_WAY_STEP, TABLE = range(LOOSE_WAY + 14, LOOSE_WAY + 18)
MOST_SPEEDS, TABLE_POINTS = 6, 128
TABLE_FORCE, TABLE_LOAD = 0, 1
N_COLUMNS = TABLE + MOST_SPEEDS * 2 * TABLE_POINTS

FACE_POINTS = 12
"""Points of the ring at which a shoulder slides on a face [1]: chosen."""
STANDS = 1e-3
"""Speed [m/s] below which the friction of a face is smoothed: chosen."""
YIELDS = np.array([0.25, 0.75, 1.25, 1.75])
"""Travels at which the springs of a ribbon slip, over their mean [1]: chosen."""

# States of a departure: displacement, then velocity of foundation and of tilt (x, y), slip over its travel
# [1], heat rubbed into the contact [J], angle of the cage [rad], stretch of each spring of a ribbon [m],
# displacement of rotor and race along the axis [m], then their velocities.
FOUNDATION, TILT, SLIP_X, SLIP_Y, HEAT, CAGE_ANGLE, STRETCH = 0, 4, 8, 9, 10, 11, 12
AXIAL = STRETCH + 2 * len(YIELDS)
N_STATES = AXIAL + 4
KINDS = (
    *(L.POSITION, L.POSITION, L.VELOCITY, L.VELOCITY) * 2,
    *(L.INTERNAL, L.INTERNAL, L.HEAT, L.ANGLE),
    *(L.INTERNAL,) * (2 * len(YIELDS)),
    *(L.POSITION, L.POSITION, L.VELOCITY, L.VELOCITY),
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
def ribbon_force(s: Array, own: Array, rates: Array, vx: float, vy: float) -> tuple[float, float, float]:
    """Force of a ribbon [N] on its support at a velocity [m/s], and the power it takes [W].

    Its springs stick until each is stretched by a travel of its own and slide then. Fills the rates of their
    stretches [m/s]. Source: Iwan 1966, Jenkins elements in parallel, isotropic in the plane.
    """
    count = YIELDS.shape[0]
    spring = s[RIBBON_STIFFNESS] / count
    F_x = F_y = lost = 0.0
    for i in range(count):
        at = STRETCH + 2 * i
        zx, zy = own[at], own[at + 1]
        rates[at], rates[at + 1] = vx, vy
        if spring == 0.0:
            rates[at] = rates[at + 1] = 0.0
            continue
        stretch, outwards = math.sqrt(zx * zx + zy * zy), zx * vx + zy * vy
        if outwards > 0.0 and stretch >= YIELDS[i] * s[RIBBON_SLIP] / s[RIBBON_STIFFNESS]:
            slide = outwards / (stretch * stretch)
            rates[at], rates[at + 1] = vx - slide * zx, vy - slide * zy
            lost += spring * outwards
        F_x += spring * zx
        F_y += spring * zy
    return F_x, F_y, lost


@lean_kernel
def from_table(s: Array, what: int, way: float, spin: float) -> float:
    """Force or largest ball load [N] of a race deflected by a way [m] that turns [rad/s].

    Source: table of the row, by cubics through its points and straight between its speeds.
    """
    place = way / s[TABLE_WAY_STEP]
    i = min(int(place), TABLE_POINTS - 3)
    u = place - i
    speeds = int(s[TABLE_SPEEDS])
    turn = min(abs(spin) / s[TABLE_SPEED_STEP], speeds - 1.0)
    j = min(int(turn), max(speeds - 2, 0))
    found = 0.0
    for k in range(min(speeds, 2)):
        share = turn - j if k == 1 else 1.0 - (turn - j)
        at = TABLE + ((j + k) * 2 + what) * TABLE_POINTS + i
        b, c, d = s[at], s[at + 1], s[at + 2]
        # the force of a race that goes the other way has the other sign
        a = s[at - 1] if i > 0 else (-c if what == TABLE_FORCE else c)
        bent = 2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)
        found += share * (b + 0.5 * u * (c - a + u * bent))
    return found


@lean_kernel
def ring_of_balls(s: Array, way: float, along: float) -> tuple[float, float, float]:
    """Radial and axial force [N] and energy [J] of a pair of rows whose race has moved by (way, along) [m].

    Source: Hertz's contacts of a smooth ring of balls, summed up over half of it.
    """
    places = int(s[RING_PLACES])
    across = lengthwise = energy = 0.0
    for i in range(places):
        _, cosine = sine_cosine(math.pi * (i + 0.5) / places)
        radial = s[RING_RADIAL] + way * cosine
        for row in range(2):
            sense = 1.0 - 2.0 * row
            axial = s[RING_AXIAL] + sense * along
            apart = math.sqrt(radial * radial + axial * axial)
            pressed = apart - s[RING_GROOVES]
            if pressed > 0.0:
                load = s[RING_SHARE] * s[RING_BALL] * pressed * math.sqrt(pressed)
                across += load * radial / apart * cosine
                lengthwise += sense * load * axial / apart
                energy += 0.4 * load * pressed
    return across, lengthwise, energy


@lean_kernel
def hardest_ball(s: Array, way: float, along: float) -> float:
    """Load [N] of the ball towards which the race has moved by (way, along) [m]. Source: `ring_of_balls`."""
    radial, axial = s[RING_RADIAL] + way, s[RING_AXIAL] + abs(along)
    pressed = max(math.sqrt(radial * radial + axial * axial) - s[RING_GROOVES], 0.0)
    load: float = s[RING_BALL] * pressed * math.sqrt(pressed)
    return load


@lean_kernel
def landed(
    s: Array, own: Array, vx: float, vy: float, slip: float
) -> tuple[float, float, float, float, float, float]:
    """Force of a shoulder on the face of its race along the axis, x and y [N] and torque on the race [N m].

    ``vx, vy`` is the velocity of the rotor against the race [m/s], ``slip`` what it turns faster [rad/s]. The
    powers that sliding and the face take [W] come last. Source: spring and dashpot in parallel (Kelvin and
    Voigt) that do not pull; Coulomb's friction at points of a ring.
    """
    depth = own[AXIAL] - own[AXIAL + 1] - s[FACE_GAP]
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    elastic, rate = s[FACE_STIFFNESS] * depth, own[AXIAL + 2] - own[AXIAL + 3]
    push = max(elastic + s[FACE_DAMPING] * rate, 0.0)
    F_x = F_y = torque = sliding = 0.0
    for i in range(FACE_POINTS):
        sine, cosine = sine_cosine(2.0 * math.pi * (i + 0.5) / FACE_POINTS)
        tx, ty = vx - slip * s[FACE_ARM] * sine, vy + slip * s[FACE_ARM] * cosine
        pull = s[FACE_FRICTION] * push / (FACE_POINTS * math.sqrt(tx * tx + ty * ty + STANDS * STANDS))
        F_x += pull * tx
        F_y += pull * ty
        torque += pull * s[FACE_ARM] * (ty * cosine - tx * sine)
        sliding += pull * (tx * tx + ty * ty)
    return push, F_x, F_y, torque, sliding, (push - elastic) * rate
