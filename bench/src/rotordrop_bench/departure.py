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
from rotordrop.physics.contact import contact_energy
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
def energy_in_contact(s: Array, law: Array, delta: float) -> float:
    """Energy [J] of the contact at a positive indentation [m], piece by piece where its law has pieces.

    Source: integral of `law_at`.
    """
    pieces = int(s[LAW_PIECES])
    if pieces == 0:
        return contact_energy(law, delta)
    energy, low = 0.0, 0.0
    for i in range(pieces):
        at = LAW + i * LAW_WIDTH
        piece = s[at : at + LAW_UNTIL]
        high = delta if i == pieces - 1 else min(delta, s[at + LAW_UNTIL])
        energy += contact_energy(piece, high) - (contact_energy(piece, low) if low > 0.0 else 0.0)
        if high == delta:
            break
        low = high
    return energy


@lean_kernel
def turned(angle: float, x: float, y: float) -> tuple[float, float]:
    """A vector in axes turned by an angle [rad]; in its own unit.

    Source: rotation of axes; the balls stand where the cage has taken them.
    """
    sine, cosine = sine_cosine(angle)
    return cosine * x + sine * y, cosine * y - sine * x


@lean_kernel
def support_force(
    s: Array,
    own: Array,
    rates: Array,
    springs: Array,
    dampers: Array,
    x: float,
    y: float,
    vx: float,
    vy: float,
) -> tuple[float, float, float, float, float]:
    """Forces of a departing support [N] at a deflection [m] and its rate [m/s], and the power it takes [W].

    Parameters
    ----------
    s, own, rates : ndarray
        Departure [SI], its states and their rates, of which those of the slip are filled [1/s].
    springs, dampers : ndarray, shape (2,)
        Stiffness [N/m] and damping [N s/m] along the first axis and across.
    x, y, vx, vy : float
        Displacement [m] and velocity [m/s] of the support.

    Returns
    -------
    tuple of float
        Force of the springs, slip included, and of the dampers along x and y [N]; power lost [W].

    Notes
    -----
    Source: principal axes turned by an angle; ``K h (1 + k h²)`` along each, or the gradient of
    ``(1 + k h²/2)`` times the energy of the linear springs, with h the whole deflection; slip of a bristle of
    Dahl 1968, ``z' = (v - |v| z) / travel``. Not validated.
    """
    x, y, vx, vy = x - own[0], y - own[1], vx - own[2], vy - own[3]
    c, z = s[AXIS_COSINE], s[AXIS_SINE]
    along = c * x + z * y
    across = c * y - z * x
    first, second = springs[0] * along, springs[1] * across
    k = s[HARDENING]
    if s[RADIAL] == 0.0:
        first *= 1.0 + k * along * along
        second *= 1.0 + k * across * across
    else:  # no force without a potential
        share = 1.0 + 0.5 * k * (along * along + across * across)
        pull = 0.5 * k * (first * along + second * across)
        first = first * share + pull * along
        second = second * share + pull * across
    damp_first = dampers[0] * (c * vx + z * vy)
    damp_second = dampers[1] * (c * vy - z * vx)
    damp_x = c * damp_first - z * damp_second
    damp_y = c * damp_second + z * damp_first
    speed = math.sqrt(vx * vx + vy * vy)
    zx, zy = own[SLIP_X], own[SLIP_Y]
    rates[SLIP_X] = (vx - speed * zx) / s[SLIP_TRAVEL]
    rates[SLIP_Y] = (vy - speed * zy) / s[SLIP_TRAVEL]
    slip = s[SLIP_FORCE]
    lost = damp_x * vx + damp_y * vy + slip * speed * (zx * zx + zy * zy)
    stop_x, stop_y, by_stop = stop_force(s, x, y, vx, vy)
    held_x, held_y, by_ribbon = ribbon_force(s, own, rates, vx, vy)
    F_x = c * first - z * second + slip * zx + stop_x + held_x
    F_y = c * second + z * first + slip * zy + stop_y + held_y
    return F_x, F_y, damp_x, damp_y, lost + by_stop + by_ribbon


@lean_kernel
def stop_force(s: Array, x: float, y: float, vx: float, vy: float) -> tuple[float, float, float]:
    """Force of a stop [N] on a support moved by (x, y) [m] at a rate [m/s], and the power it takes [W].

    Source: spring and dashpot in parallel (Kelvin and Voigt) beyond a gap, which do not pull.
    """
    h = math.sqrt(x * x + y * y)
    depth = h - s[STOP_GAP]
    if s[STOP_STIFFNESS] == 0.0 or depth <= 0.0:
        return 0.0, 0.0, 0.0
    rate = (x * vx + y * vy) / h
    elastic = s[STOP_STIFFNESS] * depth
    force = max(elastic + s[STOP_DAMPING] * rate, 0.0)
    return force * x / h, force * y / h, (force - elastic) * rate


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
def held_share(s: Array, x: float, y: float) -> float:
    """Share of the damping of the balls that acts on a race moved by (x, y) [m]: none while it is loose.

    Source: a bearing that its seat does not press moves freely in it.
    """
    return 0.0 if x * x + y * y < s[LOOSE_WAY] * s[LOOSE_WAY] else 1.0


@lean_kernel
def table_energy(s: Array, way: float, spin: float) -> float:
    """Energy [J] of a race deflected by a way [m] at a spin [rad/s]. Source: Simpson's rule on the force."""
    steps = 64
    energy = 0.0
    for k in range(steps + 1):
        weight = 1.0 if k in (0, steps) else (4.0 if k % 2 == 1 else 2.0)
        energy += weight * from_table(s, TABLE_FORCE, way * k / steps, spin)
    return energy * way / (3.0 * steps)


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
def face_depth(s: Array, own: Array) -> float:
    """How deep the shoulder stands in the face of the race [m]; negative before it lands.

    Source: definition.
    """
    depth: float = own[AXIAL] - own[AXIAL + 1] - s[FACE_GAP]
    return depth


@lean_kernel
def landed(
    s: Array, own: Array, vx: float, vy: float, slip: float
) -> tuple[float, float, float, float, float, float]:
    """Force of a shoulder on the face of its race along the axis, x and y [N] and torque on the race [N m].

    ``vx, vy`` is the velocity of the rotor against the race [m/s], ``slip`` what it turns faster [rad/s]. The
    powers that sliding and the face take [W] come last. Source: spring and dashpot in parallel (Kelvin and
    Voigt) that do not pull; Coulomb's friction at points of a ring.
    """
    depth = face_depth(s, own)
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


@lean_kernel
def axial_energy(s: Array, own: Array, rotor_mass: float, race_mass: float) -> float:
    """Energy [J] of the axial motion of rotor and race, of masses [kg], and of the face between them.

    Source: integral of `landed`.
    """
    depth = max(face_depth(s, own), 0.0)
    energy: float = rotor_mass * own[AXIAL + 2] ** 2 + race_mass * own[AXIAL + 3] ** 2
    energy += s[FACE_STIFFNESS] * depth * depth
    return 0.5 * energy


@lean_kernel
def mode_rates(mode: Array, force_x: float, force_y: float, own: Array, rates: Array) -> float:
    """Fill the rates of foundation or tilt, (4,), under a force [N]; returns the power that it takes [W].

    ``mode`` (5,) as in the columns. Source: a mode that the force drives, ``u'' = F/M - ω² u - 2ζω u'``.
    """
    lost = 0.0
    for axis in range(2):
        force = force_x if axis == 0 else force_y
        u, v = own[axis], own[2 + axis]
        brake = mode[DECAY_X + axis] * v
        rates[axis] = v
        rates[2 + axis] = mode[COMPLIANCE] * force - mode[SQUARE_X + axis] * u - brake
        lost += brake * v
    power: float = lost / mode[COMPLIANCE] if mode[COMPLIANCE] > 0.0 else 0.0
    return power


@lean_kernel
def mode_energy(mode: Array, own: Array) -> float:
    """Energy [J] of foundation or tilt in its displacement and velocity (4,).

    Source: integral of `mode_rates`.
    """
    if mode[COMPLIANCE] == 0.0:
        return 0.0
    energy = 0.0
    for axis in range(2):
        energy += mode[SQUARE_X + axis] * own[axis] ** 2 + own[2 + axis] ** 2
    stored: float = 0.5 * energy / mode[COMPLIANCE]
    return stored


@lean_kernel
def stored_energy(s: Array, own: Array, springs: Array, x: float, y: float) -> float:
    """Energy [J] of a departing support at a displacement [m], of its slip, of foundation and tilt.

    ``springs`` (2,) as in `support_force`. Source: integral of `support_force` and `mode_rates`.
    """
    x, y = x - own[0], y - own[1]
    c, z, k = s[AXIS_COSINE], s[AXIS_SINE], s[HARDENING]
    along, across = c * x + z * y, c * y - z * x
    first, second = 0.5 * springs[0] * along * along, 0.5 * springs[1] * across * across
    if s[RADIAL] > 0.0:
        energy = (first + second) * (1.0 + 0.5 * k * (x * x + y * y))
    else:
        energy = first * (1.0 + 0.5 * k * along * along) + second * (1.0 + 0.5 * k * across * across)
    depth = math.sqrt(x * x + y * y) - s[STOP_GAP]
    if depth > 0.0:
        energy += 0.5 * s[STOP_STIFFNESS] * depth * depth
    for i in range(STRETCH, AXIAL):
        energy += 0.5 * s[RIBBON_STIFFNESS] / YIELDS.shape[0] * own[i] * own[i]
    energy += 0.5 * s[SLIP_FORCE] * s[SLIP_TRAVEL] * (own[SLIP_X] ** 2 + own[SLIP_Y] ** 2)
    energy += mode_energy(s[FOUNDATION_MODE : FOUNDATION_MODE + MODE_WIDTH], own[FOUNDATION : FOUNDATION + 4])
    energy += mode_energy(s[TILT_MODE : TILT_MODE + MODE_WIDTH], own[TILT : TILT + 4])
    stored: float = energy
    return stored
