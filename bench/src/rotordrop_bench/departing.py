"""The right-hand side of a machine that departs from any estimator's model: the package's, with other parts.

What a touchdown bearing may have beyond it (departing support, gap, contact law and race) is a row of
numbers behind its own and twelve states behind the books, where what the filter estimates ends. What an
extension of the estimator models too (turned axes, a hardening support, a foundation) has other equations
here: a recording that is estimated must not share the equation it was made with. A part has name, arguments
and units of the one whose place it takes.
"""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.physics import columns as L
from rotordrop.physics import contact, touch
from rotordrop.physics._compile import Form, inner_kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import contact_energy
from rotordrop.physics.elementary import cube_root, exp, sine_cosine
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate._histories import ball_energy as energy_of_balls
from rotordrop.simulate._loop import Control, scaled_error
from rotordrop.simulate._loop import race_loads as loads_of_race
from rotordrop.simulate._loop import step_error as error_of_step
from rotordrop.simulate._rhs import (
    BALL_SET,
    DRAG,
    IN_CONTACT,
    SLIDING,
    SUPPORT,
    Scratch,
    add_contact,
    add_race,
    add_rings,
    landing_torque,
    relative_motion,
)
from rotordrop.simulate._rhs import ball_force as force_of_balls
from rotordrop.simulate._rhs import race_deflection as deflection_of_race
from rotordrop.simulate._rhs import race_velocity as velocity_of_race
from rotordrop.simulate._rhs import true_motion as motion_in_bearing

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


NUMBERS, STATES_AT = L.N_BEARING_COLUMNS, L.N_BEARING_PLACES
"""First column of a departure in a row of ``bearing``; column of ``bearing_at`` of its first state."""


class DepartingParameters(KernelParameters):
    """Parameters with a departure behind the numbers and places of every bearing."""

    __slots__ = ()

    @property
    def departure(self) -> Array:
        """Departures of all bearings [SI], shape (B, C)."""
        return self.bearing[:, NUMBERS:]

    @property
    def form(self) -> Form:
        """The package's kernels with the parts of this module."""
        return FORM


class _Layout(StateLayout):
    """Layout with the states of every departure behind the books."""

    def __post_init__(self) -> None:
        super().__post_init__()
        kinds = np.concatenate([self.kinds, np.tile(KINDS, self.n_bearings)])
        object.__setattr__(self, "kinds", kinds)

    def bearing_at(self) -> Integers:
        """Places of the states of each bearing, shape (B, 10): those of its departure last."""
        first = self.work_in + 1 + N_STATES * np.arange(self.n_bearings)
        return np.column_stack([super().bearing_at(), first])


class DepartingModel(DropModel):
    """A model whose bearings depart from it."""

    parameters: DepartingParameters

    def at_rest(self) -> Array:
        """State, shape (n,), of a centred rotor with all at rest; loose bearings lie in their seats."""
        state, p = super().at_rest(), self.parameters
        for b, bearing in enumerate(self.machine.touchdown_bearings):
            weight, loose = p.bearing[b, L.RACE_WEIGHT], p.departure[b, LOOSE_WAY]
            if loose > 0.0:
                sag = weight / p.bearing[b, L.SUPPORT_STIFFNESS_Y]
                state[self.layout.race][2 * b + 1] = numbers_of(bearing).seat(weight)[1] - loose - sag
        return state


def departures_in(model: DropModel) -> Array:
    """Departures of all bearings of a model [SI], shape (B, C); (0, C) where it does not depart."""
    p = model.parameters
    return p.departure if isinstance(p, DepartingParameters) else np.zeros((0, N_COLUMNS))


def departing(model: DropModel, rows: Array) -> DropModel:
    """The same model whose bearings depart from it by rows (B, C), if any.

    Races that are loose in their seats lie in them by their weight.
    """
    departs, bearing = len(rows) > 0, model.parameters.bearing[:, :NUMBERS]
    own = {item.name: getattr(model.layout, item.name) for item in fields(model.layout) if item.init}
    layout = (_Layout if departs else StateLayout)(**own)
    bearing = np.hstack([bearing, rows]) if departs else np.ascontiguousarray(bearing)
    for row in bearing[: len(rows)]:
        if row[NUMBERS + LOOSE_WAY] > 0.0:
            row[L.RACE_WEIGHT] = row[L.RACE_MASS] * float(model.machine.gravity)
    parameters = (DepartingParameters if departs else KernelParameters)(*model.parameters)._replace(
        bearing=bearing,
        rotor_at=layout.rotor_at(),
        bearing_at=layout.bearing_at(),
    )
    parts = {item.name: getattr(model, item.name) for item in fields(model)}
    return (DepartingModel if departs else DropModel)(**parts | {"layout": layout, "parameters": parameters})


@inner_kernel
def departing_at(b: int, y: Array, p: KernelParameters) -> tuple[Array, Array]:
    """Numbers and states of what departs at one bearing."""
    first = p.bearing_at[b, STATES_AT]
    return p.bearing[b, NUMBERS:], y[first : first + N_STATES]


@inner_kernel
def true_motion(c: int, b: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float]:
    """Motion of the landing sleeve against a bore that stands off the axis of the magnets and tilts.

    Source: kinematics, and that of `sleeve`.
    """
    x, z, vx, vz = motion_in_bearing(c, b, y, p)
    s, own = departing_at(b, y, p)
    x, z = x - own[TILT] - s[CENTRE_X], z - own[TILT + 1] - s[CENTRE_Y]
    vx, vz = vx - own[TILT + 2], vz - own[TILT + 3]
    if s[SLEEVE_OFF] == 0.0 and s[SLEEVE_OVAL] == 0.0:
        return x, z, vx, vz
    off_x, off_z, by_x, by_z = sleeve(s, y[p.rotor_at[L.ROTOR_ANGLE]], x, z)
    spin = y[p.rotor_at[L.ROTOR_SPEED]]
    return x + off_x, z + off_z, vx + spin * by_x, vz + spin * by_z


@inner_kernel
def gap_at(t: float, b: int, y: Array, p: KernelParameters) -> float:
    """Air gap that drifts and closes."""
    s, own = departing_at(b, y, p)
    return gap_now(s, own, t, p.bearing[b, L.AIR_GAP])


@lean_kernel
def contact_values(
    t: float, c: int, b: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """One contact with a law of its own and friction that wears off."""
    ux, uy, vx, vy = relative_motion(c, b, y, p)
    spin = p.contact_at[c, L.CONTACT_SPIN]
    omega_i = y[spin] if spin >= 0 else 0.0
    row, gap = p.bearing[b], gap_at(t, b, y, p)
    numbers, law = row[L.TOUCH : L.TOUCH_END], row[L.CONTACT : L.CONTACT_END]
    s, own = departing_at(b, y, p)
    at = law_at(s, math.sqrt(ux * ux + uy * uy) - gap)
    law = s[at : at + LAW_UNTIL] if at >= 0 else law
    left, omega = friction_left(s, own), y[p.rotor_at[L.ROTOR_SPEED]]
    delta, F_r, F_mu, nx, ny, sliding, lost = touch.touch(numbers, gap, law, ux, uy, vx, vy, omega, omega_i)
    return delta, F_r, left * F_mu, nx, ny, left * sliding, lost


@inner_kernel
def race_deflection(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Deflection in the axes of the balls, which the cage has turned."""
    x, z = deflection_of_race(b, y, p)
    _, own = departing_at(b, y, p)
    sine, cosine = sine_cosine(own[CAGE_ANGLE])
    return cosine * x + sine * z, cosine * z - sine * x


@inner_kernel
def race_velocity(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Velocity that is damped: none while the bearing is loose in its seat."""
    x, z = deflection_of_race(b, y, p)
    s, _ = departing_at(b, y, p)
    held = 0.0 if x * x + z * z < s[LOOSE_WAY] * s[LOOSE_WAY] else 1.0
    wx, wy = velocity_of_race(b, y, p)
    return held * wx, held * wy


@lean_kernel
def ball_force(b: int, y: Array, p: KernelParameters, work: Scratch) -> tuple[float, float, float]:
    """Force of balls by a table, or of those in a cage that has turned."""
    s, own = departing_at(b, y, p)
    x, z = race_deflection(b, y, p)
    way = math.sqrt(x * x + z * z)
    if s[LOOSE_WAY] > 0.0:
        rise = from_table(s, TABLE_FORCE, way) / max(way, 1e-15)
        F_x, F_y = rise * x, rise * z
    else:
        F_x, F_y, by_spin = force_of_balls(b, y, p, work)
        if p.bearing[b, L.FAST_SPEED_STEP] > 0.0:
            return F_x, F_y, by_spin
    sine, cosine = sine_cosine(-own[CAGE_ANGLE])
    return cosine * F_x + sine * F_y, cosine * F_y - sine * F_x, 0.0


@inner_kernel
def race_loads(b: int, y: Array, p: KernelParameters) -> tuple[float, float, float]:
    """Loads of balls by a table."""
    s, _ = departing_at(b, y, p)
    if s[LOOSE_WAY] == 0.0:
        return loads_of_race(b, y, p)
    x, z = race_deflection(b, y, p)
    load = max(from_table(s, TABLE_LOAD, math.sqrt(x * x + z * z)), 0.0)
    return load, p.bearing[b, L.STRESS_COEFFICIENT] * cube_root(load), 0.0


@lean_kernel
def sleeve_torque(b: int, y: Array, p: KernelParameters, dy: Array) -> float:
    """Torque on the rotor [N m] of the contact force that ``dy`` holds so far, beside that of friction.

    Source: virtual work of `sleeve`.
    """
    s, own = departing_at(b, y, p)
    if s[SLEEVE_OFF] == 0.0 and s[SLEEVE_OVAL] == 0.0:
        return 0.0
    c = p.bearing_at[b, L.CONTACTS]
    x, z, _vx, _vz = motion_in_bearing(c, b, y, p)
    x, z = x - own[TILT] - s[CENTRE_X], z - own[TILT + 1] - s[CENTRE_Y]
    _x, _z, by_x, by_z = sleeve(s, y[p.rotor_at[L.ROTOR_ANGLE]], x, z)
    at = p.rotor_at[L.N_COORDINATES] + p.contact_at[c, L.CONTACT_BODY]
    torque: float = -by_x * dy[at] - by_z * dy[at + 1]
    return torque


@lean_kernel
def add_mode(
    b: int, mode: int, first: int, F_x: float, F_y: float, y: Array, p: KernelParameters, dy: Array
) -> float:
    """Rates of foundation or tilt, by first column and state, under a force [N]; power it takes [W].

    Source: a mode that the force drives, ``u'' = F/M - ω² u - 2ζω u'``.
    """
    s, own = departing_at(b, y, p)
    _, rates = departing_at(b, dy, p)
    compliance, lost = s[mode + COMPLIANCE], 0.0
    for axis in range(2):
        force = F_x if axis == 0 else F_y
        u, v = own[first + axis], own[first + 2 + axis]
        brake = s[mode + DECAY_X + axis] * v
        rates[first + axis] = v
        rates[first + 2 + axis] = compliance * force - s[mode + SQUARE_X + axis] * u - brake
        lost += brake * v
    power: float = lost / compliance if compliance > 0.0 else 0.0
    return power


@lean_kernel
def add_support(b: int, F_x: float, F_y: float, y: Array, p: KernelParameters, dy: Array) -> float:
    """Rates of a support that departs, and of its foundation, under a force [N]; power that they take [W].

    Source: principal axes turned by an angle; the gradient of ``(1 + k h²/2)`` times the energy of the linear
    springs, with h the whole deflection; slip of a bristle of Dahl 1968, ``z' = (v - |v| z) / travel``.
    Not validated.
    """
    n_q, h, row = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], p.bearing[b]
    s, own = departing_at(b, y, p)
    _, rates = departing_at(b, dy, p)
    x, z = y[h] - own[FOUNDATION], y[h + 1] - own[FOUNDATION + 1]
    vx, vz = y[n_q + h] - own[FOUNDATION + 2], y[n_q + h + 1] - own[FOUNDATION + 3]
    cosine, sine, k = s[AXIS_COSINE], s[AXIS_SINE], s[HARDENING]
    along, across = cosine * x + sine * z, cosine * z - sine * x
    first, second = row[L.SUPPORT_STIFFNESS_X] * along, row[L.SUPPORT_STIFFNESS_Y] * across
    share = 1.0 + 0.5 * k * (along * along + across * across)
    pull = 0.5 * k * (first * along + second * across)
    first, second = first * share + pull * along, second * share + pull * across
    damp_first = row[L.SUPPORT_DAMPING_X] * (cosine * vx + sine * vz)
    damp_second = row[L.SUPPORT_DAMPING_Y] * (cosine * vz - sine * vx)
    c_x, c_y = cosine * damp_first - sine * damp_second, cosine * damp_second + sine * damp_first
    speed, slip = math.sqrt(vx * vx + vz * vz), s[SLIP_FORCE]
    slip_x, slip_y = own[SLIP_X], own[SLIP_Y]
    rates[SLIP_X] = (vx - speed * slip_x) / s[SLIP_TRAVEL]
    rates[SLIP_Y] = (vz - speed * slip_y) / s[SLIP_TRAVEL]
    lost = c_x * vx + c_y * vz + slip * speed * (slip_x * slip_x + slip_y * slip_y)
    k_x = cosine * first - sine * second + slip * slip_x
    k_y = cosine * second + sine * first + slip * slip_y
    dy[n_q + h] = (F_x - c_x - k_x) / row[L.SUPPORT_MASS_X]
    dy[n_q + h + 1] = (F_y - c_y - k_y) / row[L.SUPPORT_MASS_Y]
    total: float = lost + add_mode(b, FOUNDATION_MODE, FOUNDATION, k_x + c_x, k_y + c_y, y, p, dy)
    return total


@lean_kernel
def bearing_accelerations(
    t: float, b: int, y: Array, p: KernelParameters, dy: Array, work: Scratch
) -> tuple[float, float]:
    """Forces at one bearing whose race tilts and whose support departs."""
    n_q, h = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT]
    r, spin = n_q + p.bearing_at[b, L.RACE], p.bearing_at[b, L.RACE_SPIN]
    s, _ = departing_at(b, y, p)
    _, rates = departing_at(b, dy, p)
    friction = sliding = lost = 0.0
    for c in range(p.bearing_at[b, L.CONTACTS], p.bearing_at[b, L.CONTACTS_END]):
        force, by_sliding, by_law = add_contact(t, c, b, y, p, dy)
        friction += force
        sliding += by_sliding
        lost += by_law
    F_x, F_y, by_balls, by_drag, by_fit = 0.0, 0.0, 0.0, 0.0, 0.0
    by_tilt = add_mode(b, TILT_MODE, TILT, dy[r], dy[r + 1], y, p, dy)
    by_sleeve = sleeve_torque(b, y, p, dy)
    if p.bearing[b, L.NOT_ROUND] != 0.0:
        by_sleeve += landing_torque(b, y, p, dy)
    if p.bearing_at[b, L.RACE] >= 0:
        F_x, F_y, by_balls, by_drag = add_race(b, friction, y, p, dy, work)
    else:
        dy[spin] = 0.0
    if p.bearing_at[b, L.RING_STATES] >= 0:
        by_rings, by_fit = add_rings(b, math.sqrt(F_x * F_x + F_y * F_y), y, p, dy, work.balls)
        by_balls += by_rings
    rates[HEAT], rates[CAGE_ANGLE] = sliding, s[CAGE_RATIO] * y[spin]
    by_support = by_tilt + add_support(b, F_x + dy[n_q + h], F_y + dy[n_q + h + 1], y, p, dy) + by_fit
    power = work.power[b]
    power[SLIDING], power[IN_CONTACT] = sliding, lost
    power[BALL_SET], power[SUPPORT], power[DRAG] = by_balls, by_support, by_drag
    torque = by_sleeve - friction * p.bearing[b, L.ROTOR_RADIUS]
    return torque, by_balls + by_drag + by_support + (sliding + lost)


@inner_kernel
def step_error(
    h: float, y: Array, y_new: Array, k: Array, e: Array, rule: Control, p: KernelParameters, scratch: Array
) -> float:
    """What departs has a norm of its own: at rest it must not loosen the control.

    A mean over twice as many states as there are, as when the recordings of the lists were first made.
    """
    n = p.rotor_at[L.WORK_IN] + 1
    error, total = error_of_step(h, y, y_new, k, e, rule, p, scratch), 0.0
    scale = rule.scale[n:]
    scaled_error(h, y[n:], y_new[n:], k[:, n:], e, scale, rule.tolerance, scratch)
    for i in range(scale.shape[0]):  # squares of what each is off
        total += scratch[i]
    return max(error, math.sqrt(total / (2 * scale.shape[0])) / rule.tolerance)


@lean_kernel
def ball_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy of balls by a table: Simpson's rule on the force."""
    s, _ = departing_at(b, y, p)
    if s[LOOSE_WAY] == 0.0:
        return energy_of_balls(b, y, p)
    x, z = race_deflection(b, y, p)
    way, steps, energy = math.sqrt(x * x + z * z), 64, 0.0
    for k in range(steps + 1):
        weight = 1.0 if k in (0, steps) else (4.0 if k % 2 == 1 else 2.0)
        energy += weight * from_table(s, TABLE_FORCE, way * k / steps)
    return energy * way / (3.0 * steps)


@lean_kernel
def touch_energy(b: int, delta: float, p: KernelParameters) -> float:
    """Energy in a contact, piece by piece where its law has pieces."""
    row = p.bearing[b]
    pieces, energy, low = int(row[NUMBERS + LAW_PIECES]), 0.0, 0.0
    if delta > 0.0 and pieces == 0:
        return contact_energy(row[L.CONTACT : L.CONTACT_END], delta)
    for i in range(pieces if delta > 0.0 else 0):
        at = NUMBERS + LAW + i * LAW_WIDTH
        piece = row[at : at + LAW_UNTIL]
        high = delta if i == pieces - 1 else min(delta, row[at + LAW_UNTIL])
        energy += contact_energy(piece, high) - (contact_energy(piece, low) if low > 0.0 else 0.0)
        if high == delta:
            break
        low = high
    return energy


@lean_kernel
def spring_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy of a support that departs, of foundation and tilt."""
    s, own = departing_at(b, y, p)
    h, row = p.bearing_at[b, L.SUPPORT], p.bearing[b]
    x, z = y[h] - own[FOUNDATION], y[h + 1] - own[FOUNDATION + 1]
    cosine, sine, k = s[AXIS_COSINE], s[AXIS_SINE], s[HARDENING]
    along, across = cosine * x + sine * z, cosine * z - sine * x
    first, second = row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y]
    first, second = 0.5 * first * along * along, 0.5 * second * across * across
    energy: float = (first + second) * (1.0 + 0.5 * k * (x * x + z * z))
    energy += 0.5 * s[SLIP_FORCE] * s[SLIP_TRAVEL] * (own[SLIP_X] ** 2 + own[SLIP_Y] ** 2)
    for mode, place in ((FOUNDATION_MODE, FOUNDATION), (TILT_MODE, TILT)):
        stored = 0.0
        for axis in range(2):
            stored += s[mode + SQUARE_X + axis] * own[place + axis] ** 2 + own[place + 2 + axis] ** 2
        if s[mode + COMPLIANCE] > 0.0:
            energy += 0.5 * stored / s[mode + COMPLIANCE]
    return energy


PARTS = (
    *(true_motion, gap_at, contact_values, race_deflection, race_velocity, ball_force, race_loads),
    *(bearing_accelerations, step_error, ball_energy, touch_energy, spring_energy),
)
FORM = Form(
    name="departing", parts={part.__name__: part for part in PARTS}, beside=Path(__file__).resolve().parent
)
