"""The right-hand side of a machine that departs from any estimator's model: the package's, with other parts.

Every bearing has a row of `rotordrop_bench.departure` behind its numbers, and its states behind the books,
where what the filter estimates ends. A part has name, arguments and units of the one whose place it takes.
"""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.physics import columns as L
from rotordrop.physics import touch
from rotordrop.physics._compile import Form, inner_kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import contact_energy
from rotordrop.physics.elementary import cube_root
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
from rotordrop_bench import departure as D

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
        kinds = np.concatenate([self.kinds, np.tile(D.KINDS, self.n_bearings)])
        object.__setattr__(self, "kinds", kinds)

    def bearing_at(self) -> Integers:
        """Places of the states of each bearing, shape (B, 10): those of its departure last."""
        first = self.work_in + 1 + D.N_STATES * np.arange(self.n_bearings)
        return np.column_stack([super().bearing_at(), first])


class DepartingModel(DropModel):
    """A model whose bearings depart from it."""

    parameters: DepartingParameters

    def at_rest(self) -> Array:
        """State, shape (n,), of a centred rotor with all at rest; loose bearings lie in their seats."""
        state, p = super().at_rest(), self.parameters
        for b, bearing in enumerate(self.machine.touchdown_bearings):
            weight, loose = p.bearing[b, L.RACE_WEIGHT], p.departure[b, D.LOOSE_WAY]
            if loose > 0.0:
                sag = weight / p.bearing[b, L.SUPPORT_STIFFNESS_Y]
                state[self.layout.race][2 * b + 1] = numbers_of(bearing).seat(weight)[1] - loose - sag
        return state


def departures_in(model: DropModel) -> Array:
    """Departures of all bearings of a model [SI], shape (B, C); (0, C) where it does not depart."""
    p = model.parameters
    return p.departure if isinstance(p, DepartingParameters) else np.zeros((0, D.N_COLUMNS))


def departing(model: DropModel, rows: Array) -> DropModel:
    """The same model whose bearings depart from it by rows (B, C) of `rotordrop_bench.departure`, if any."""
    departs, bearing = len(rows) > 0, model.parameters.bearing[:, :NUMBERS]
    own = {item.name: getattr(model.layout, item.name) for item in fields(model.layout) if item.init}
    layout = (_Layout if departs else StateLayout)(**own)
    parameters = (DepartingParameters if departs else KernelParameters)(*model.parameters)._replace(
        bearing=np.hstack([bearing, rows]) if departs else np.ascontiguousarray(bearing),
        rotor_at=layout.rotor_at(),
        bearing_at=layout.bearing_at(),
    )
    parts = {item.name: getattr(model, item.name) for item in fields(model)}
    return (DepartingModel if departs else DropModel)(**parts | {"layout": layout, "parameters": parameters})


@inner_kernel
def departing_at(b: int, y: Array, p: KernelParameters) -> tuple[Array, Array]:
    """Numbers and states of what departs at one bearing."""
    first = p.bearing_at[b, STATES_AT]
    return p.bearing[b, NUMBERS:], y[first : first + D.N_STATES]


@inner_kernel
def true_motion(c: int, b: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float]:
    """Motion of the landing sleeve against a bore that stands off the axis of the magnets and tilts."""
    ux, uy, vx, vy = motion_in_bearing(c, b, y, p)
    s, own = departing_at(b, y, p)
    angle, spin = y[p.rotor_at[L.ROTOR_ANGLE]], y[p.rotor_at[L.ROTOR_SPEED]]
    return D.against_bore(s, own, angle, spin, ux, uy, vx, vy)


@inner_kernel
def gap_at(t: float, b: int, y: Array, p: KernelParameters) -> float:
    """Air gap that drifts and closes."""
    s, own = departing_at(b, y, p)
    return D.gap_now(s, own, t, p.bearing[b, L.AIR_GAP])


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
    at = D.law_at(s, math.sqrt(ux * ux + uy * uy) - gap)
    law = s[at : at + D.LAW_UNTIL] if at >= 0 else law
    left, omega = D.friction_left(s, own), y[p.rotor_at[L.ROTOR_SPEED]]
    delta, F_r, F_mu, nx, ny, sliding, lost = touch.touch(numbers, gap, law, ux, uy, vx, vy, omega, omega_i)
    return delta, F_r, left * F_mu, nx, ny, left * sliding, lost


@inner_kernel
def race_deflection(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Deflection in the axes of the balls, which the cage has turned."""
    x, z = deflection_of_race(b, y, p)
    _, own = departing_at(b, y, p)
    return D.turned(own[D.CAGE_ANGLE], x, z)


@inner_kernel
def race_velocity(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Velocity that is damped: none while the bearing is loose in its seat."""
    x, z = deflection_of_race(b, y, p)
    s, _ = departing_at(b, y, p)
    held = 0.0 if x * x + z * z < s[D.LOOSE_WAY] * s[D.LOOSE_WAY] else 1.0
    wx, wy = velocity_of_race(b, y, p)
    return held * wx, held * wy


@lean_kernel
def ball_force(b: int, y: Array, p: KernelParameters, work: Scratch) -> tuple[float, float, float]:
    """Force of balls by a table, or of those in a cage that has turned."""
    s, own = departing_at(b, y, p)
    back = -own[D.CAGE_ANGLE]
    x, z = race_deflection(b, y, p)
    way = math.sqrt(x * x + z * z)
    if s[D.LOOSE_WAY] > 0.0:
        rise = D.from_table(s, D.TABLE_FORCE, way) / max(way, 1e-15)
        F_x, F_y = rise * x, rise * z
    else:
        F_x, F_y, by_spin = force_of_balls(b, y, p, work)
        if p.bearing[b, L.FAST_SPEED_STEP] > 0.0:
            return F_x, F_y, by_spin
    F_x, F_y = D.turned(back, F_x, F_y)
    return F_x, F_y, 0.0


@inner_kernel
def race_loads(b: int, y: Array, p: KernelParameters) -> tuple[float, float, float]:
    """Loads of balls by a table."""
    s, _ = departing_at(b, y, p)
    if s[D.LOOSE_WAY] == 0.0:
        return loads_of_race(b, y, p)
    x, z = race_deflection(b, y, p)
    load = max(D.from_table(s, D.TABLE_LOAD, math.sqrt(x * x + z * z)), 0.0)
    return load, p.bearing[b, L.STRESS_COEFFICIENT] * cube_root(load), 0.0


@lean_kernel
def sleeve_torque(b: int, y: Array, p: KernelParameters, dy: Array) -> float:
    """Torque on the rotor [N m] of the contact force that ``dy`` holds so far, beside that of friction.

    Source: virtual work of `D.sleeve`.
    """
    s, own = departing_at(b, y, p)
    if s[D.SLEEVE_OFF] == 0.0 and s[D.SLEEVE_OVAL] == 0.0:
        return 0.0
    c = p.bearing_at[b, L.CONTACTS]
    x, z, _vx, _vz = motion_in_bearing(c, b, y, p)
    x, z = x - own[D.TILT] - s[D.CENTRE_X], z - own[D.TILT + 1] - s[D.CENTRE_Y]
    _x, _z, by_x, by_z = D.sleeve(s, y[p.rotor_at[L.ROTOR_ANGLE]], x, z)
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
    compliance, lost = s[mode + D.COMPLIANCE], 0.0
    for axis in range(2):
        force = F_x if axis == 0 else F_y
        u, v = own[first + axis], own[first + 2 + axis]
        brake = s[mode + D.DECAY_X + axis] * v
        rates[first + axis] = v
        rates[first + 2 + axis] = compliance * force - s[mode + D.SQUARE_X + axis] * u - brake
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
    x, z = y[h] - own[D.FOUNDATION], y[h + 1] - own[D.FOUNDATION + 1]
    vx, vz = y[n_q + h] - own[D.FOUNDATION + 2], y[n_q + h + 1] - own[D.FOUNDATION + 3]
    cosine, sine, k = s[D.AXIS_COSINE], s[D.AXIS_SINE], s[D.HARDENING]
    along, across = cosine * x + sine * z, cosine * z - sine * x
    first, second = row[L.SUPPORT_STIFFNESS_X] * along, row[L.SUPPORT_STIFFNESS_Y] * across
    share = 1.0 + 0.5 * k * (along * along + across * across)
    pull = 0.5 * k * (first * along + second * across)
    first, second = first * share + pull * along, second * share + pull * across
    damp_first = row[L.SUPPORT_DAMPING_X] * (cosine * vx + sine * vz)
    damp_second = row[L.SUPPORT_DAMPING_Y] * (cosine * vz - sine * vx)
    c_x, c_y = cosine * damp_first - sine * damp_second, cosine * damp_second + sine * damp_first
    speed, slip = math.sqrt(vx * vx + vz * vz), s[D.SLIP_FORCE]
    slip_x, slip_y = own[D.SLIP_X], own[D.SLIP_Y]
    rates[D.SLIP_X] = (vx - speed * slip_x) / s[D.SLIP_TRAVEL]
    rates[D.SLIP_Y] = (vz - speed * slip_y) / s[D.SLIP_TRAVEL]
    lost = c_x * vx + c_y * vz + slip * speed * (slip_x * slip_x + slip_y * slip_y)
    k_x = cosine * first - sine * second + slip * slip_x
    k_y = cosine * second + sine * first + slip * slip_y
    dy[n_q + h] = (F_x - c_x - k_x) / row[L.SUPPORT_MASS_X]
    dy[n_q + h + 1] = (F_y - c_y - k_y) / row[L.SUPPORT_MASS_Y]
    total: float = lost + add_mode(b, D.FOUNDATION_MODE, D.FOUNDATION, k_x + c_x, k_y + c_y, y, p, dy)
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
    by_tilt = add_mode(b, D.TILT_MODE, D.TILT, dy[r], dy[r + 1], y, p, dy)
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
    rates[D.HEAT], rates[D.CAGE_ANGLE] = sliding, s[D.CAGE_RATIO] * y[spin]
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
    if s[D.LOOSE_WAY] == 0.0:
        return energy_of_balls(b, y, p)
    x, z = race_deflection(b, y, p)
    way, steps, energy = math.sqrt(x * x + z * z), 64, 0.0
    for k in range(steps + 1):
        weight = 1.0 if k in (0, steps) else (4.0 if k % 2 == 1 else 2.0)
        energy += weight * D.from_table(s, D.TABLE_FORCE, way * k / steps)
    return energy * way / (3.0 * steps)


@lean_kernel
def touch_energy(b: int, delta: float, p: KernelParameters) -> float:
    """Energy in a contact, piece by piece where its law has pieces."""
    row = p.bearing[b]
    pieces, energy, low = int(row[NUMBERS + D.LAW_PIECES]), 0.0, 0.0
    if delta > 0.0 and pieces == 0:
        return contact_energy(row[L.CONTACT : L.CONTACT_END], delta)
    for i in range(pieces if delta > 0.0 else 0):
        at = NUMBERS + D.LAW + i * D.LAW_WIDTH
        piece = row[at : at + D.LAW_UNTIL]
        high = delta if i == pieces - 1 else min(delta, row[at + D.LAW_UNTIL])
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
    x, z = y[h] - own[D.FOUNDATION], y[h + 1] - own[D.FOUNDATION + 1]
    cosine, sine, k = s[D.AXIS_COSINE], s[D.AXIS_SINE], s[D.HARDENING]
    along, across = cosine * x + sine * z, cosine * z - sine * x
    first, second = row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y]
    first, second = 0.5 * first * along * along, 0.5 * second * across * across
    energy: float = (first + second) * (1.0 + 0.5 * k * (x * x + z * z))
    energy += 0.5 * s[D.SLIP_FORCE] * s[D.SLIP_TRAVEL] * (own[D.SLIP_X] ** 2 + own[D.SLIP_Y] ** 2)
    for mode, place in ((D.FOUNDATION_MODE, D.FOUNDATION), (D.TILT_MODE, D.TILT)):
        stored = 0.0
        for axis in range(2):
            stored += s[mode + D.SQUARE_X + axis] * own[place + axis] ** 2 + own[place + 2 + axis] ** 2
        if s[mode + D.COMPLIANCE] > 0.0:
            energy += 0.5 * stored / s[mode + D.COMPLIANCE]
    return energy


PARTS = (
    *(true_motion, gap_at, contact_values, race_deflection, race_velocity, ball_force, race_loads),
    *(bearing_accelerations, step_error, ball_energy, touch_energy, spring_energy),
)
FORM = Form(
    name="departing", parts={part.__name__: part for part in PARTS}, beside=Path(__file__).resolve().parent
)
