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
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics import touch
from rotordrop.physics._compile import Form, inner_kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import cube_root
from rotordrop.physics.spin import race_drag_torque
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
    modal_parts,
    project,
    relative_motion,
)
from rotordrop.simulate._rhs import ball_force as force_of_balls
from rotordrop.simulate._rhs import race_deflection as deflection_of_race
from rotordrop.simulate._rhs import race_velocity as velocity_of_race
from rotordrop.simulate._rhs import rises_with_travel as rises_along
from rotordrop.simulate._rhs import true_motion as motion_in_bearing
from rotordrop_bench import departure

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
        kinds = np.concatenate([self.kinds, np.tile(departure.KINDS, self.n_bearings)])
        object.__setattr__(self, "kinds", kinds)

    def bearing_at(self) -> Integers:
        """Places of the states of each bearing, shape (B, 10): those of its departure last."""
        first = self.work_in + 1 + departure.N_STATES * np.arange(self.n_bearings)
        return np.column_stack([super().bearing_at(), first])

    def names(self, bearings: tuple[TouchdownBearing, ...]) -> tuple[str, ...]:
        """Name of every state, in order."""
        count = range(1, departure.N_STATES + 1)
        return *super().names(bearings), *(f"departure {one.name} {k}" for one in bearings for k in count)


class DepartingModel(DropModel):
    """A model whose bearings depart from it."""

    parameters: DepartingParameters

    def with_machine(self, machine: Machine) -> DropModel:
        """The same model, which departs in the same way, of a machine with other bearings or values."""
        rows = self.parameters.departure
        return departing(departing(self, rows[:0]).with_machine(machine), rows)

    def at_rest(self) -> Array:
        """State, shape (n,), of a centred rotor with all at rest; loose bearings lie in their seats."""
        state, p = super().at_rest(), self.parameters
        for b, bearing in enumerate(self.machine.touchdown_bearings):
            weight, loose = p.bearing[b, L.RACE_WEIGHT], p.departure[b, departure.LOOSE_WAY]
            if loose > 0.0:
                sag = weight / p.bearing[b, L.SUPPORT_STIFFNESS_Y]
                state[self.layout.race][2 * b + 1] = numbers_of(bearing).seat(weight)[1] - loose - sag
        return state


def departures_in(model: DropModel) -> Array:
    """Departures of all bearings of a model [SI], shape (B, C); (0, C) where it does not depart."""
    p = model.parameters
    return p.departure if isinstance(p, DepartingParameters) else np.zeros((0, departure.N_COLUMNS))


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
    return p.bearing[b, NUMBERS:], y[first : first + departure.N_STATES]


@inner_kernel
def true_motion(c: int, b: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float]:
    """Motion of the landing sleeve against a bore that stands off the axis of the magnets and tilts."""
    ux, uy, vx, vy = motion_in_bearing(c, b, y, p)
    s, own = departing_at(b, y, p)
    angle, spin = y[p.rotor_at[L.ROTOR_ANGLE]], y[p.rotor_at[L.ROTOR_SPEED]]
    return departure.against_bore(s, own, angle, spin, ux, uy, vx, vy)


@inner_kernel
def gap_at(t: float, b: int, y: Array, p: KernelParameters) -> float:
    """Air gap that drifts and closes."""
    s, own = departing_at(b, y, p)
    return departure.gap_now(s, own, t, p.bearing[b, L.AIR_GAP])


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
    at = departure.law_at(s, math.sqrt(ux * ux + uy * uy) - gap)
    law = s[at : at + departure.LAW_UNTIL] if at >= 0 else law
    left, omega = departure.friction_left(s, own), y[p.rotor_at[L.ROTOR_SPEED]]
    delta, F_r, F_mu, nx, ny, sliding, lost = touch.touch(numbers, gap, law, ux, uy, vx, vy, omega, omega_i)
    return delta, F_r, left * F_mu, nx, ny, left * sliding, lost


@inner_kernel
def race_deflection(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Deflection in the axes of the balls, which the cage has turned."""
    x, z = deflection_of_race(b, y, p)
    _, own = departing_at(b, y, p)
    return departure.turned(own[departure.CAGE_ANGLE], x, z)


@inner_kernel
def race_velocity(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Velocity that is damped: none while the bearing is loose in its seat."""
    x, z = deflection_of_race(b, y, p)
    s, _ = departing_at(b, y, p)
    held = departure.held_share(s, x, z)
    wx, wy = velocity_of_race(b, y, p)
    return held * wx, held * wy


@inner_kernel
def rises_with_travel(b: int, p: KernelParameters) -> bool:
    """Not where a thrust presses on the face of the race."""
    rises: bool = rises_along(b, p) and p.bearing[b, NUMBERS + departure.THRUST] == 0.0
    return rises


@lean_kernel
def ball_force(b: int, y: Array, p: KernelParameters, work: Scratch) -> tuple[float, float, float]:
    """Force of balls by a table, of a pair of rows under a thrust, or of those in a cage that has turned."""
    s, own = departing_at(b, y, p)
    back = -own[departure.CAGE_ANGLE]
    x, z = race_deflection(b, y, p)
    way = math.sqrt(x * x + z * z)
    if s[departure.TABLE_SPEEDS] > 0.0:
        force = departure.from_table(s, departure.TABLE_FORCE, way, y[p.bearing_at[b, L.RACE_SPIN]])
    elif s[departure.THRUST] > 0.0:
        force = departure.ring_of_balls(s, way, own[departure.AXIAL + 1])[0]
    else:
        F_x, F_y, by_spin = force_of_balls(b, y, p, work)
        if p.bearing[b, L.FAST_SPEED_STEP] > 0.0:
            return F_x, F_y, by_spin
        F_x, F_y = departure.turned(back, F_x, F_y)
        return F_x, F_y, 0.0
    rise = force / max(way, 1e-15)
    F_x, F_y = departure.turned(back, rise * x, rise * z)
    return F_x, F_y, 0.0


@inner_kernel
def race_loads(b: int, y: Array, p: KernelParameters) -> tuple[float, float, float]:
    """Loads of balls by a table, or under a thrust."""
    s, own = departing_at(b, y, p)
    x, z = race_deflection(b, y, p)
    way = math.sqrt(x * x + z * z)
    if s[departure.TABLE_SPEEDS] > 0.0:
        spin = y[p.bearing_at[b, L.RACE_SPIN]]
        load = max(departure.from_table(s, departure.TABLE_LOAD, way, spin), 0.0)
    elif s[departure.THRUST] > 0.0:
        load = departure.hardest_ball(s, way, own[departure.AXIAL + 1])
    else:
        return loads_of_race(b, y, p)
    return load, p.bearing[b, L.STRESS_COEFFICIENT] * cube_root(load), 0.0


@lean_kernel
def add_departing_thrust(
    t: float, b: int, y: Array, p: KernelParameters, dy: Array
) -> tuple[float, float, float, float, float]:
    """Add the axial motion of rotor and race that a departing thrust makes, and the friction of the face.

    Returns the torque on the race [N m] and the power that sliding, the face, the balls and drag take [W].
    """
    n_q, r, spin = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.RACE], p.bearing_at[b, L.RACE_SPIN]
    s, own = departing_at(b, y, p)
    _, rates = departing_at(b, dy, p)
    row, shape, at = p.bearing[b], p.bearing_shape[b], departure.AXIAL
    if s[departure.THRUST] == 0.0:
        rates[at : at + 4] = 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0
    _, _, sx, sy = modal_parts(y, p)
    _, _, ax, ay = modal_parts(dy, p)
    vx, vy = project(shape, sx) - y[n_q + r], project(shape, sy) - y[n_q + r + 1]
    slip = y[p.rotor_at[L.ROTOR_SPEED]] - y[spin]
    push, F_x, F_y, torque, sliding, lost = departure.landed(s, own, vx, vy, slip)
    for k in range(shape.shape[0]):
        ax[k] -= shape[k] * F_x
        ay[k] -= shape[k] * F_y
    dy[n_q + r] += F_x / row[L.RACE_MASS]
    dy[n_q + r + 1] += F_y / row[L.RACE_MASS]
    x, z = race_deflection(b, y, p)
    held = departure.ring_of_balls(s, math.sqrt(x * x + z * z), own[at + 1])[1]
    drag = race_drag_torque(
        abs(held), y[spin], row[L.DRAG_COEFFICIENT], row[L.PITCH_DIAMETER], row[L.DRAG_SPEED]
    )
    dy[spin] += (torque - drag) / row[L.RACE_INERTIA]
    thrust = 0.0 if t < p.spin[L.POWER_OFF_DELAY] else s[departure.THRUST]
    damped = s[departure.ALONG] * row[L.BEARING_DAMPING] * own[at + 3]
    rates[at], rates[at + 1] = own[at + 2], own[at + 3]
    rates[at + 2] = (thrust - push) / p.spin[L.ROTOR_MASS]
    rates[at + 3] = (push - held - damped) / row[L.RACE_MASS]
    dy[p.rotor_at[L.WORK_IN]] += thrust * own[at + 2]
    return torque, sliding, lost, damped * own[at + 3], drag * y[spin]


@lean_kernel
def add_tilt(b: int, y: Array, p: KernelParameters, dy: Array) -> float:
    """Rates of the tilt of a race under the contact force that ``dy`` holds so far; power it takes [W]."""
    race = p.rotor_at[L.N_COORDINATES] + p.bearing_at[b, L.RACE]
    s, own = departing_at(b, y, p)
    _, rates = departing_at(b, dy, p)
    lost: float = departure.mode_rates(
        s[departure.TILT_MODE : departure.TILT_MODE + departure.MODE_WIDTH],
        dy[race],
        dy[race + 1],
        own[departure.TILT : departure.TILT + 4],
        rates[departure.TILT : departure.TILT + 4],
    )
    return lost


@lean_kernel
def sleeve_torque(b: int, y: Array, p: KernelParameters, dy: Array) -> float:
    """Torque on the rotor [N m] of the contact force that ``dy`` holds so far, beside that of friction.

    Source: virtual work of `departure.sleeve`.
    """
    s, own = departing_at(b, y, p)
    if s[departure.SLEEVE_OFF] == 0.0 and s[departure.SLEEVE_OVAL] == 0.0:
        return 0.0
    body = p.contact_at[p.bearing_at[b, L.CONTACTS], L.CONTACT_BODY]
    qx, qy, _sx, _sy = modal_parts(y, p)
    x = project(p.bearing_shape[b], qx) - y[body] - own[departure.TILT] - s[departure.CENTRE_X]
    z = project(p.bearing_shape[b], qy) - y[body + 1] - own[departure.TILT + 1] - s[departure.CENTRE_Y]
    _x, _z, by_x, by_z = departure.sleeve(s, y[p.rotor_at[L.ROTOR_ANGLE]], x, z)
    at = p.rotor_at[L.N_COORDINATES] + body
    torque: float = -by_x * dy[at] - by_z * dy[at + 1]
    return torque


@lean_kernel
def add_departing_support(
    b: int, F_x: float, F_y: float, sliding: float, y: Array, p: KernelParameters, dy: Array
) -> float:
    """Rates of a support that departs, its foundation, the heat of sliding and the cage; power lost [W].

    ``F_x, F_y`` is the force on the support [N], ``sliding`` the heat of friction [W].
    """
    n_q, h = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT]
    row = p.bearing[b]
    s, own = departing_at(b, y, p)
    _, rates = departing_at(b, dy, p)
    k_x, k_y, c_x, c_y, lost = departure.support_force(
        s,
        own,
        rates,
        row[L.SUPPORT_STIFFNESS_X : L.SUPPORT_STIFFNESS_Y + 1],
        row[L.SUPPORT_DAMPING_X : L.SUPPORT_DAMPING_Y + 1],
        y[h],
        y[h + 1],
        y[n_q + h],
        y[n_q + h + 1],
    )
    dy[n_q + h] = (F_x - c_x - k_x) / row[L.SUPPORT_MASS_X]
    dy[n_q + h + 1] = (F_y - c_y - k_y) / row[L.SUPPORT_MASS_Y]
    rates[departure.HEAT] = sliding
    rates[departure.CAGE_ANGLE] = s[departure.CAGE_RATIO] * y[p.bearing_at[b, L.RACE_SPIN]]
    return lost + departure.mode_rates(
        s[departure.FOUNDATION_MODE : departure.FOUNDATION_MODE + departure.MODE_WIDTH],
        k_x + c_x,
        k_y + c_y,
        own[departure.FOUNDATION : departure.FOUNDATION + 4],
        rates[departure.FOUNDATION : departure.FOUNDATION + 4],
    )


@lean_kernel
def bearing_accelerations(
    t: float, b: int, y: Array, p: KernelParameters, dy: Array, work: Scratch
) -> tuple[float, float]:
    """Forces at one bearing whose race tilts and is pushed along, and whose support departs."""
    n_q, h = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT]
    friction = sliding = lost = 0.0
    for c in range(p.bearing_at[b, L.CONTACTS], p.bearing_at[b, L.CONTACTS_END]):
        force, by_sliding, by_law = add_contact(t, c, b, y, p, dy)
        friction += force
        sliding += by_sliding
        lost += by_law
    F_x, F_y, by_balls, by_drag = 0.0, 0.0, 0.0, 0.0
    by_tilt, by_sleeve = add_tilt(b, y, p, dy), sleeve_torque(b, y, p, dy)
    if p.bearing[b, L.NOT_ROUND] != 0.0:
        by_sleeve += landing_torque(b, y, p, dy)
    if p.bearing_at[b, L.RACE] >= 0:
        F_x, F_y, by_balls, by_drag = add_race(b, friction, y, p, dy, work)
    else:
        dy[p.bearing_at[b, L.RACE_SPIN]] = 0.0
    by_face, rubbed, by_landing, by_moving, by_rolling = add_departing_thrust(t, b, y, p, dy)
    by_balls += by_moving
    by_fit = 0.0
    if p.bearing_at[b, L.RING_STATES] >= 0:
        by_rings, by_fit = add_rings(b, math.sqrt(F_x * F_x + F_y * F_y), y, p, dy, work.balls)
        by_balls += by_rings
    F_x, F_y = F_x + dy[n_q + h], F_y + dy[n_q + h + 1]
    by_support = by_tilt + add_departing_support(b, F_x, F_y, sliding, y, p, dy) + by_fit
    power = work.power[b]
    sliding, lost, by_drag = sliding + rubbed, lost + by_landing, by_drag + by_rolling
    power[SLIDING], power[IN_CONTACT] = sliding, lost
    power[BALL_SET], power[SUPPORT], power[DRAG] = by_balls, by_support, by_drag
    torque = by_sleeve - by_face - friction * p.bearing[b, L.ROTOR_RADIUS]
    return torque, by_balls + by_drag + by_support + (sliding + lost)


@inner_kernel
def step_error(
    h: float, y: Array, y_new: Array, k: Array, e: Array, rule: Control, p: KernelParameters, scratch: Array
) -> float:
    """What departs has a norm of its own: at rest it must not loosen the control."""
    n = p.rotor_at[L.WORK_IN] + 1
    error = error_of_step(h, y, y_new, k, e, rule, p, scratch)
    scale, tolerance = rule.scale[n:], rule.tolerance
    return max(error, scaled_error(h, y[n:], y_new[n:], k[:, n:], e, scale, tolerance, scratch))


@lean_kernel
def ball_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy of balls by a table, or of a pair of rows under a thrust with what moves axially."""
    s, own = departing_at(b, y, p)
    x, z = race_deflection(b, y, p)
    way = math.sqrt(x * x + z * z)
    if s[departure.TABLE_SPEEDS] > 0.0:
        return departure.table_energy(s, way, y[p.bearing_at[b, L.RACE_SPIN]])
    if s[departure.THRUST] > 0.0:
        pressed: float = departure.ring_of_balls(s, way, own[departure.AXIAL + 1])[2]
        return pressed + departure.axial_energy(s, own, p.spin[L.ROTOR_MASS], p.bearing[b, L.RACE_MASS])
    return energy_of_balls(b, y, p)


@lean_kernel
def touch_energy(b: int, delta: float, p: KernelParameters) -> float:
    """Energy in a contact with a law of its own."""
    row = p.bearing[b]
    law = row[L.CONTACT : L.CONTACT_END]
    return departure.energy_in_contact(row[NUMBERS:], law, delta) if delta > 0.0 else 0.0


@lean_kernel
def spring_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy of a support that departs, of foundation and tilt."""
    s, own = departing_at(b, y, p)
    h, springs = p.bearing_at[b, L.SUPPORT], p.bearing[b, L.SUPPORT_STIFFNESS_X : L.SUPPORT_STIFFNESS_Y + 1]
    return departure.stored_energy(s, own, springs, y[h], y[h + 1])


PARTS = (
    *(true_motion, gap_at, contact_values, race_deflection, race_velocity, rises_with_travel, ball_force),
    *(race_loads, bearing_accelerations, step_error, ball_energy, touch_energy, spring_energy),
)
FORM = Form(
    name="departing", parts={part.__name__: part for part in PARTS}, beside=Path(__file__).resolve().parent
)
