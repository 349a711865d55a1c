"""Right-hand side of a drop: rotor modes, contact, friction, races, balls, supports, spin.

Numbers below, names above: everything arrives as the flat arrays of
`rotordrop.rotor.parameters.KernelParameters`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics import (
    aerodynamics,
    ball_table,
    face,
    landing_sleeve,
    magnet,
    mount,
    ring,
    support,
    touch,
)
from rotordrop.physics import columns as L
from rotordrop.physics._compile import OPTIONAL_PARTS, inner_kernel, kernel, lean_kernel
from rotordrop.physics.aerodynamics import exponential_deceleration, speed_dependent_deceleration
from rotordrop.physics.ball_set import (
    ball_set_axial_force,
    ball_set_force,
    bearing_reaction,
    row_axial_damping,
    two_row_axial_damping,
    two_row_axial_force,
    two_row_force,
)
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import sine_cosine
from rotordrop.physics.load import load_now
from rotordrop.physics.magnet import remanent_fraction
from rotordrop.physics.spin import race_drag_torque

PRESCRIBED = aerodynamics.PRESCRIBED_SPEED
IN_TIME = aerodynamics.EXPONENTIAL_IN_TIME
OF_SPEED = aerodynamics.FUNCTION_OF_SPEED

# Places where power is lost: columns of `Scratch.power`, a row for each bearing; the last row is the rotor's.
SLIDING, IN_CONTACT, BALL_SET, SUPPORT, DRAG = range(5)
N_PLACES = 5
BENDING, RUBBING, COILS = range(3)


class Scratch(NamedTuple):
    """What a right-hand side writes beside the rates: ``balls`` (2, Z8), ``power`` (B + 1, 5) lost [W], and
    ``blend`` (3, T) of a table of balls at speed.
    """

    balls: Array
    power: Array
    blend: Array


@kernel
def scratch_of(p: KernelParameters) -> Scratch:
    """Scratch for the right-hand sides of a machine."""
    power, blend = np.zeros((p.bearing.shape[0] + 1, N_PLACES)), np.empty((3, p.ball_table.shape[4]))
    return Scratch(np.empty((2, p.balls.shape[2])), power, blend)


@lean_kernel
def project(shape: Array, amplitudes: Array) -> float:
    """Physical displacement or velocity of a node from modal amplitudes: one row of mode shapes times
    amplitudes.
    """
    total = 0.0
    for k in range(shape.shape[0]):
        total += shape[k] * amplitudes[k]
    return total


@inner_kernel
def modal_parts(y: Array, p: KernelParameters) -> tuple[Array, Array, Array, Array]:
    """Views of the modal amplitudes in x and in y and of their velocities in a state or its derivative.

    For lean kernels alone: one that counts references would let go of what it never took hold of.
    """
    m = p.eigenvalue.shape[0]
    x, z, n_q = p.rotor_at[L.MODES_X], p.rotor_at[L.MODES_Y], p.rotor_at[L.N_COORDINATES]
    return y[x : x + m], y[z : z + m], y[n_q + x : n_q + x + m], y[n_q + z : n_q + z + m]


@inner_kernel
def true_motion(c: int, b: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float]:
    """Displacement [m] and velocity [m/s] of the rotor against the bore of contact ``c`` of bearing ``b``.

    The bearing is handed in: looked up in the table of contacts it costs 3 % of a right-hand side.
    """
    n_q, r = p.rotor_at[L.N_COORDINATES], p.contact_at[c, L.CONTACT_BODY]
    shape = p.bearing_shape[b]
    qx, qy, sx, sy = modal_parts(y, p)
    ux = uy = vx = vy = 0.0
    for k in range(shape.shape[0]):
        ux += shape[k] * qx[k]
        uy += shape[k] * qy[k]
        vx += shape[k] * sx[k]
        vy += shape[k] * sy[k]
    return ux - y[r], uy - y[r + 1], vx - y[n_q + r], vy - y[n_q + r + 1]


@inner_kernel
def relative_motion(c: int, b: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float]:
    """The same of a round rotor that would touch as this one does, whatever its landing sleeve."""
    ux, uy, vx, vy = true_motion(c, b, y, p)
    if p.bearing[b, L.NOT_ROUND] != 0.0:
        numbers = p.bearing[b, L.LANDING_SLEEVE : L.LANDING_SLEEVE_END]
        angle, spin = y[p.rotor_at[L.ROTOR_ANGLE]], y[p.rotor_at[L.ROTOR_SPEED]]
        return landing_sleeve.as_round(numbers, angle, spin, ux, uy, vx, vy)
    return ux, uy, vx, vy


@inner_kernel
def gap_at(t: float, b: int, y: Array, p: KernelParameters) -> float:
    """Air gap [m] of one bearing now."""
    gap: float = p.bearing[b, L.AIR_GAP]
    return gap


@inner_kernel
def depth_now(t: float, c: int, b: int, y: Array, p: KernelParameters) -> float:
    """Indentation [m] of contact ``c`` of bearing ``b`` by the motion alone; negative in flight."""
    ux, uy, _vx, _vy = relative_motion(c, b, y, p)
    return math.sqrt(ux * ux + uy * uy) - gap_at(t, b, y, p)


@lean_kernel
def contact_values(
    t: float, c: int, b: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """One contact of a bearing in a state, in the order of `rotordrop.physics.touch.touch`."""
    ux, uy, vx, vy = relative_motion(c, b, y, p)
    spin = p.contact_at[c, L.CONTACT_SPIN]
    omega_i = y[spin] if spin >= 0 else 0.0
    row, gap = p.bearing[b], gap_at(t, b, y, p)
    numbers, law = row[L.TOUCH : L.TOUCH_END], row[L.CONTACT : L.CONTACT_END]
    omega = y[p.rotor_at[L.ROTOR_SPEED]]
    return touch.touch(numbers, gap, law, ux, uy, vx, vy, omega, omega_i)


@inner_kernel
def race_deflection(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Displacement [m] of the race of one bearing relative to its support, in the axes of its balls."""
    r, h = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT]
    return y[r] - y[h], y[r + 1] - y[h + 1]


@inner_kernel
def race_velocity(b: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Velocity [m/s] of the race of one bearing against its support, which its balls damp."""
    n_q = p.rotor_at[L.N_COORDINATES]
    r, h = n_q + p.bearing_at[b, L.RACE], n_q + p.bearing_at[b, L.SUPPORT]
    return y[r] - y[h], y[r + 1] - y[h + 1]


@inner_kernel
def ring_travel(b: int, y: Array, p: KernelParameters) -> float:
    """Way [m] of the sprung outer rings of one bearing from their balls; zero between rigid spacers."""
    at = p.bearing_at[b, L.RING_STATES]
    return y[at] if OPTIONAL_PARTS and at >= 0 else 0.0


@inner_kernel
def rows_of(b: int, p: KernelParameters) -> tuple[Array, Array]:
    """Balls of a bearing whose race moves axially: the rows loaded by motion towards +z, and the others."""
    return p.balls[b], p.balls[p.bearing.shape[0] + b]


@inner_kernel
def rises_with_travel(b: int, p: KernelParameters) -> bool:
    """Whether the force of a bearing grows with the travel of its race, whatever else stands in the state.

    What gives way axially and balls that press outwards leave no order between the two.
    """
    carried: bool = p.bearing_at[b, L.RACE] >= 0 and p.bearing_at[b, L.RING_STATES] < 0
    slow: bool = p.bearing[b, L.FAST_SPEED_STEP] == 0.0 and p.bearing_at[b, L.FACE_STATES] < 0
    return carried and slow


@inner_kernel
def race_travel(b: int, y: Array, p: KernelParameters) -> float:
    """Axial displacement [m] of the race of one bearing; zero of one that has no face."""
    at = p.bearing_at[b, L.FACE_STATES]
    return y[at] if OPTIONAL_PARTS and at >= 0 else 0.0


@inner_kernel
def deflected_force(
    b: int, x: float, z: float, way: float, along: float, spin: float, p: KernelParameters, work: Scratch
) -> tuple[float, float, float]:
    """`ball_force` of a race deflected by (x, z) and moved by ``along`` [m], at a spin [rad/s], whose sprung
    rings have gone a ``way`` [m].
    """
    if OPTIONAL_PARTS and p.bearing[b, L.FAST_SPEED_STEP] > 0.0:
        grid = p.bearing[b, L.FAST : L.FAST_END]
        return ball_table.fast_force(grid, p.ball_table[b], p.balls[b], x, z, spin, work.balls[0], work.blend)
    numbers = p.bearing[b][L.ROLLING : L.ROLLING_END]
    if OPTIONAL_PARTS and p.bearing_at[b, L.FACE_STATES] >= 0:
        F_x, F_y = two_row_force(numbers, rows_of(b, p), x, z, along, work.balls)
    else:
        F_x, F_y = ball_set_force(numbers, p.balls[b], x, z, work.balls, way)
    return F_x, F_y, 0.0


@lean_kernel
def ball_force(b: int, y: Array, p: KernelParameters, work: Scratch) -> tuple[float, float, float]:
    """Force of the balls of one bearing [N] against the deflection of its race, x and y.

    The last number is the slope of their energy by the speed of the race [J s], of balls with inertia.
    """
    x, z = race_deflection(b, y, p)
    spin, along = y[p.bearing_at[b, L.RACE_SPIN]], race_travel(b, y, p)
    return deflected_force(b, x, z, ring_travel(b, y, p), along, spin, p, work)


@inner_kernel
def support_deflection(b: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float]:
    """Deflection [m] and its rate [m/s] of a support, x and y, against the foundation if that gives way."""
    n_q, h, own = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    x, z, vx, vz = y[h], y[h + 1], y[n_q + h], y[n_q + h + 1]
    if own < 0:
        return x, z, vx, vz
    return x - y[own], z - y[own + 1], vx - y[own + 2], vz - y[own + 3]


@inner_kernel
def mount_states(b: int, p: KernelParameters) -> tuple[int, int]:
    """Place of the first state of a mount and the one behind its last; equal where it has none."""
    first = max(p.bearing_at[b, L.MOUNT_STATES], 0)
    return first, first + int(p.bearing[b, L.MOUNT + mount.STATES])


@inner_kernel
def gyroscopic_forces(
    polar: Array,
    ux: Array,
    uy: Array,
    vx: Array,
    vy: Array,
    omega: float,
    omega_dot: float,
    gx: Array,
    gy: Array,
) -> None:
    """Fill modal gyroscopic and spin-up forces ``gx, gy`` (m,) from the symmetric polar inertia (m, m)."""
    for k in range(gx.shape[0]):
        gx[k] = 0.0
        gy[k] = 0.0
    for j in range(polar.shape[0]):
        row = polar[j]
        along = omega * vy[j] + omega_dot * uy[j]
        across = omega * vx[j] + omega_dot * ux[j]
        for k in range(row.shape[0]):
            gx[k] += row[k] * along
            gy[k] += row[k] * across


@inner_kernel
def add_rotor_accelerations(
    y: Array, omega: float, omega_dot: float, p: KernelParameters, dy: Array
) -> tuple[float, float]:
    """Add modal accelerations from stiffness, damping, gyroscopics, unbalance, gravity and the
    side force, which is a share of it.

    Returns the power dissipated by modal damping and that put in by unbalance, spin-up and side force [W].
    """
    s, c = sine_cosine(y[p.rotor_at[L.ROTOR_ANGLE]])
    # The unbalance pulls outwards with ω² and, while the rotor slows down, backwards with its deceleration.
    w2 = omega * omega
    along = w2 * c + omega_dot * s
    across = w2 * s - omega_dot * c
    ux, uy, vx, vy = modal_parts(y, p)
    # The rates of the modes are written last of all; until then their places hold the gyroscopic forces.
    gx, gy, ax, ay = modal_parts(dy, p)
    gyroscopic_forces(p.polar, ux, uy, vx, vy, omega, omega_dot, gx, gy)
    dissipated = 0.0
    put_in = 0.0
    side = p.spin[L.SIDE_FORCE]
    for k in range(p.eigenvalue.shape[0]):
        fx = p.unbalance_cos[k] * along - p.unbalance_sin[k] * across - side * p.gravity[k]
        fy = p.unbalance_cos[k] * across + p.unbalance_sin[k] * along
        ax[k] += fx - p.eigenvalue[k] * ux[k] - p.damping[k] * vx[k] - gx[k]
        ay[k] += fy + p.gravity[k] - p.eigenvalue[k] * uy[k] - p.damping[k] * vy[k] + gy[k]
        dissipated += p.damping[k] * (vx[k] * vx[k] + vy[k] * vy[k])
        put_in += (fx - gx[k]) * vx[k] + (fy + gy[k]) * vy[k]
    return dissipated, put_in


@lean_kernel
def add_magnet_forces(t: float, y: Array, p: KernelParameters, dy: Array) -> float:
    """Add holding, spring, damper and remanent forces of the AMBs; returns the power they put in [W].

    An AMB that stays on holds for ever.
    """
    qx, qy, sx, sy = modal_parts(y, p)
    _, _, ax, ay = modal_parts(dy, p)
    holds = t < p.spin[L.POWER_OFF_DELAY]
    left = remanent_fraction(t, p.spin[L.POWER_OFF_DELAY], p.spin[L.REMANENCE_TIME_CONSTANT])
    put_in = 0.0
    for a in range(p.magnet.shape[0]):
        shape = p.magnet_shape[a]
        vx = project(shape, sx)
        vy = project(shape, sy)
        fx = left * p.magnet[a, L.REMANENT_X]
        fy = left * p.magnet[a, L.REMANENT_Y]
        if holds or p.magnet[a, L.AMB_STAYS] != 0.0:
            ux = project(shape, qx) - p.magnet[a, L.AMB_REFERENCE_X]
            uy = project(shape, qy) - p.magnet[a, L.AMB_REFERENCE_Y]
            fx += (
                p.magnet[a, L.HOLDING_X] - p.magnet[a, L.AMB_STIFFNESS] * ux - p.magnet[a, L.AMB_DAMPING] * vx
            )
            fy += (
                p.magnet[a, L.HOLDING_Y] - p.magnet[a, L.AMB_STIFFNESS] * uy - p.magnet[a, L.AMB_DAMPING] * vy
            )
        for k in range(shape.shape[0]):
            ax[k] += shape[k] * fx
            ay[k] += shape[k] * fy
        put_in += fx * vx + fy * vy
    return put_in


@lean_kernel
def plane_motion(shape: Array, axis: int, y: Array, p: KernelParameters) -> tuple[float, float]:
    """Displacement [m] and velocity [m/s] of the rotor along one axis, 0 or 1, in a plane of a shape (m,)."""
    qx, qy, sx, sy = modal_parts(y, p)
    if axis == 0:
        return project(shape, qx), project(shape, sx)
    return project(shape, qy), project(shape, sy)


@lean_kernel
def magnet_axis(a: int, axis: int, y: Array, p: KernelParameters) -> tuple[float, float, float, float, float]:
    """Force of one axis of a magnet in the loop [N], rates of its two currents [A/s], electrical power put in
    and heat of its coils [W].
    """
    own, first = p.magnet_at[a, L.MAGNET_OWN] + 2 * axis, p.magnet_at[a, L.MAGNET_MEMORY]
    kept = p.memory[first + axis * magnet.N_AXIS : first + (axis + 1) * magnet.N_AXIS]
    u, v = plane_motion(p.magnet_shape[a], axis, y, p)
    numbers = p.magnet[a, L.LOOP : L.LOOP_END]
    return magnet.axis_rates(numbers, kept, u, v, y[own], y[own + 1])


@lean_kernel
def add_loops(y: Array, p: KernelParameters, dy: Array, power: Array) -> float:
    """Add magnets in the loop to the rotor, and the rates of their currents; heat of the coils [W]."""
    _, _, ax, ay = modal_parts(dy, p)
    heat = 0.0
    for a in range(p.magnet.shape[0]):
        shape, own = p.magnet_shape[a], p.magnet_at[a, L.MAGNET_OWN]
        for axis in range(2):
            force, plus, minus, put_in, lost = magnet_axis(a, axis, y, p)
            rates = ax if axis == 0 else ay
            for k in range(shape.shape[0]):
                rates[k] += shape[k] * force
            dy[own + 2 * axis], dy[own + 2 * axis + 1] = plus, minus
            dy[p.rotor_at[L.WORK_IN]] += put_in
            heat += lost
    power[COILS] = heat
    return heat


@lean_kernel
def add_loads(t: float, y: Array, p: KernelParameters, dy: Array) -> float:
    """Add the loads on the rotor, and on everything the inertia force of a ground that accelerates.

    Returns the power they put in [W]. Motion is against the ground.
    """
    n_q = p.rotor_at[L.N_COORDINATES]
    _, _, sx, sy = modal_parts(y, p)
    _, _, ax, ay = modal_parts(dy, p)
    put_in = 0.0
    for j in range(p.load.shape[0]):
        row, shape = p.load[j], p.load_shape[j]
        x, z = load_now(row, p.load_points, t, y[p.rotor_at[L.ROTOR_SPEED]])
        for k in range(shape.shape[0]):
            ax[k] += shape[k] * x
            ay[k] += shape[k] * z
        put_in += x * project(shape, sx) + z * project(shape, sy)
        if row[L.LOAD_OF_BASE] == 0.0:
            continue
        for b in range(p.bearing.shape[0]):
            numbers = p.bearing[b]
            r, h, own = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
            for axis in range(2):
                a = x if axis == 0 else z
                if r >= 0:
                    dy[n_q + r + axis] -= a
                    put_in -= numbers[L.RACE_MASS] * a * y[n_q + r + axis]
                dy[n_q + h + axis] -= a
                put_in -= numbers[L.SUPPORT_MASS_X + axis] * a * y[n_q + h + axis]
                if own >= 0:
                    dy[own + 2 + axis] -= a
                    share = numbers[L.SUPPORT_FORM + support.FOUNDATION_SHARE]
                    if share > 0.0:
                        put_in -= numbers[L.SUPPORT_MASS_Y] / share * a * y[own + 2 + axis]
    return put_in


@lean_kernel
def add_support_form(b: int, y: Array, p: KernelParameters, dy: Array) -> float:
    """Add what form and mount of a support change: its force, and the motion of its foundation.

    Returns what support and foundation dissipate [W].
    """
    n_q, h, own = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    row = p.bearing[b]
    x, z, vx, vz = support_deflection(b, y, p)
    k_x, k_y = row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y]
    c_x, c_y = row[L.SUPPORT_DAMPING_X], row[L.SUPPORT_DAMPING_Y]
    form = row[L.SUPPORT_FORM : L.SUPPORT_FORM_END]
    F_x, F_y, dissipated = support.support_force(form, k_x, k_y, c_x, c_y, x, z, vx, vz)
    if OPTIONAL_PARTS and row[L.MOUNT] != 0.0:
        first, last = mount_states(b, p)
        numbers = row[L.MOUNT : L.MOUNT_END]
        beside_x, beside_y, lost = mount.mount_force(numbers, x, z, vx, vz, y[first:last], dy[first:last])
        F_x += beside_x
        F_y += beside_y
        dissipated += lost
    sx, sy = y[n_q + h], y[n_q + h + 1]
    dy[n_q + h] += (c_x * sx + k_x * y[h] - F_x) / row[L.SUPPORT_MASS_X]
    dy[n_q + h + 1] += (c_y * sy + k_y * y[h + 1] - F_y) / row[L.SUPPORT_MASS_Y]
    if own < 0:
        return dissipated
    speed, share = form[support.FOUNDATION_SPEED], max(form[support.FOUNDATION_SHARE], 0.0)
    damping, mobility = 2.0 * form[support.FOUNDATION_DAMPING] * speed, share / row[L.SUPPORT_MASS_Y]
    for axis in range(2):
        force = F_x if axis == 0 else F_y
        u, v = y[own + axis], y[own + 2 + axis]
        dy[own + axis] = v
        dy[own + 2 + axis] = mobility * force - speed * speed * u - damping * v
        if mobility > 0.0:
            dissipated += damping * v * v / mobility
    return dissipated


@inner_kernel
def add_contact(
    t: float, c: int, b: int, y: Array, p: KernelParameters, dy: Array
) -> tuple[float, float, float]:
    """Add the force of one contact to the rotor and the body it touches.

    Returns the friction force [N] and the power that sliding and law take [W].
    """
    delta, F_r, F_mu, nx, ny, sliding, lost = contact_values(t, c, b, y, p)
    if delta <= 0.0:
        return 0.0, 0.0, 0.0
    x = F_r * nx - F_mu * ny
    z = F_r * ny + F_mu * nx
    shape = p.bearing_shape[b]
    body = p.rotor_at[L.N_COORDINATES] + p.contact_at[c, L.CONTACT_BODY]
    _, _, ax, ay = modal_parts(dy, p)
    for k in range(shape.shape[0]):
        ax[k] -= shape[k] * x
        ay[k] -= shape[k] * z
    dy[body] += x
    dy[body + 1] += z
    return F_mu, sliding, lost


@lean_kernel
def rub_values(
    i: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """One contact of the rotor with its housing, in the order of `rotordrop.physics.touch.touch`."""
    numbers, shape = p.rub[i, : touch.N_ENTRIES], p.rub[i, touch.N_ENTRIES :]
    qx, qy, sx, sy = modal_parts(y, p)
    ux, uy, vx, vy = project(shape, qx), project(shape, qy), project(shape, sx), project(shape, sy)
    gap, law = numbers[touch.AIR_GAP], numbers[touch.LAW :]
    return touch.touch(numbers, gap, law, ux, uy, vx, vy, y[p.rotor_at[L.ROTOR_SPEED]], 0.0)


@lean_kernel
def add_rubs(y: Array, p: KernelParameters, dy: Array, power: Array) -> tuple[float, float]:
    """Add the contacts of the rotor with its housing, which stands still.

    Returns the friction torque on the rotor [N m] and the power lost [W], which stands in ``power`` too.
    """
    _, _, ax, ay = modal_parts(dy, p)
    torque = 0.0
    total = 0.0
    for i in range(p.rub.shape[0]):
        delta, F_r, F_mu, nx, ny, sliding, lost = rub_values(i, y, p)
        if delta <= 0.0:
            continue
        shape, x, z = p.rub[i, touch.N_ENTRIES :], F_r * nx - F_mu * ny, F_r * ny + F_mu * nx
        for k in range(shape.shape[0]):
            ax[k] -= shape[k] * x
            ay[k] -= shape[k] * z
        torque -= F_mu * p.rub[i, touch.ROTOR_RADIUS]
        total += sliding + lost
    power[RUBBING] = total
    return torque, total


@inner_kernel
def add_race(
    b: int, friction: float, y: Array, p: KernelParameters, dy: Array, work: Scratch
) -> tuple[float, float, float, float]:
    """Rates of a race under its contacts and its balls.

    Returns the force of the balls on the support, x and y [N], and the power that the damping of the ball set
    and the drag take [W].
    """
    n_q = p.rotor_at[L.N_COORDINATES]
    r, spin = p.bearing_at[b, L.RACE], p.bearing_at[b, L.RACE_SPIN]
    row = p.bearing[b]
    F_x, F_y, exchanged = ball_force(b, y, p, work)
    wx, wy = race_velocity(b, y, p)
    numbers = row[L.ROLLING : L.ROLLING_END]
    F_x, F_y, drag, by_balls, by_drag = bearing_reaction(numbers, F_x, F_y, wx, wy, y[spin])
    dy[n_q + r] = (dy[n_q + r] - F_x) / row[L.RACE_MASS]
    dy[n_q + r + 1] = (dy[n_q + r + 1] - F_y - row[L.RACE_WEIGHT]) / row[L.RACE_MASS]
    dy[spin] = (friction * row[L.BORE_RADIUS] - drag) / row[L.RACE_INERTIA]
    # what the balls gain in energy while the race changes its speed comes from its orbit, not from a push
    dy[p.rotor_at[L.WORK_IN]] += exchanged * dy[spin]
    return F_x, F_y, by_balls, by_drag


@lean_kernel
def add_rings(
    b: int, F: float, y: Array, p: KernelParameters, dy: Array, balls: Array
) -> tuple[float, float]:
    """Rates of sprung outer rings under a radial force F [N]; power that balls and fit take of them [W]."""
    at, row = p.bearing_at[b, L.RING_STATES], p.bearing[b]
    x, z = race_deflection(b, y, p)
    numbers = row[L.RING : L.RING_END]
    pushed = ball_set_axial_force(row[L.ROLLING : L.ROLLING_END], p.balls[b], x, z, balls, y[at])
    held, _rate = ring.spring_force(numbers, row[L.ROLLING : L.ROLLING_END], y[at])
    friction = ring.fit_friction(numbers, F, y[at + 1])
    rows = numbers[ring.ROWS]
    dy[at] = y[at + 1]
    share = numbers[ring.DAMPING] / rows
    damped = row_axial_damping(row[L.ROLLING : L.ROLLING_END], share, y[at]) * y[at + 1]
    dy[at + 1] = (pushed / rows - held - friction - damped) / numbers[ring.MASS]
    return float(rows * damped * y[at + 1]), float(rows * friction * y[at + 1])


@lean_kernel
def face_values(
    b: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """Contact of the rotor with the face of one race, in the order of `physics.face.face_contact`."""
    at, own = p.rotor_at[L.AXIAL], p.bearing_at[b, L.FACE_STATES]
    _ux, _uy, vx, vy = true_motion(p.bearing_at[b, L.CONTACTS], b, y, p)
    slip = y[p.rotor_at[L.ROTOR_SPEED]] - y[p.bearing_at[b, L.RACE_SPIN]]
    numbers = p.bearing[b, L.FACE : L.FACE_END]
    return face.face_contact(numbers, y[at] - y[own], y[at + 1] - y[own + 1], vx, vy, slip)


@lean_kernel
def add_axial_motion(
    t: float, y: Array, p: KernelParameters, dy: Array, work: Scratch
) -> tuple[float, float]:
    """Add the axial motion of the rotor and of the races that it lands on.

    Returns the friction torque on the rotor [N m] and the power lost [W], which stands in ``work.power`` too.
    """
    n_q, at = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.AXIAL]
    _, _, ax, ay = modal_parts(dy, p)
    z, speed = y[at], y[at + 1]
    force = torque = total = 0.0
    levitated = t < p.spin[L.POWER_OFF_DELAY]
    if levitated:
        force = p.spin[L.AXIAL_HOLDING] - p.spin[L.AXIAL_STIFFNESS] * z - p.spin[L.AXIAL_DAMPING] * speed
    for j in range(p.load.shape[0]):
        if p.load[j, L.LOAD_AXIAL] != 0.0:
            along, _ = load_now(p.load[j], p.load_points, t, y[p.rotor_at[L.ROTOR_SPEED]])
            force += along
    if levitated and p.spin[L.AXIAL_STIFFNESS] == 0.0:
        force = 0.0  # nobody described what holds the rotor, so that no load moves it
    dy[p.rotor_at[L.WORK_IN]] += force * speed
    for b in p.faces:
        own, row, shape = p.bearing_at[b, L.FACE_STATES], p.bearing[b], p.bearing_shape[b]
        _depth, push, F_x, F_y, turning, sliding, lost = face_values(b, y, p)
        for k in range(shape.shape[0]):
            ax[k] -= shape[k] * F_x
            ay[k] -= shape[k] * F_y
        race = n_q + p.bearing_at[b, L.RACE]
        dy[race] += F_x / row[L.RACE_MASS]
        dy[race + 1] += F_y / row[L.RACE_MASS]
        force -= push
        torque -= turning
        dx, dz = race_deflection(b, y, p)
        numbers, moved = row[L.ROLLING : L.ROLLING_END], y[own + 1]
        held = two_row_axial_force(numbers, rows_of(b, p), dx, dz, y[own], work.balls)
        damped = two_row_axial_damping(numbers, rows_of(b, p), y[own]) * moved
        spin = p.bearing_at[b, L.RACE_SPIN]
        # balls roll under the sum of their loads: the drag of the axial force comes on top
        drag = race_drag_torque(
            abs(held), y[spin], row[L.DRAG_COEFFICIENT], row[L.PITCH_DIAMETER], row[L.DRAG_SPEED]
        )
        dy[spin] += (turning - drag) / row[L.RACE_INERTIA]
        dy[own] = moved
        dy[own + 1] = (push - held - damped) / row[L.RACE_MASS]
        power = work.power[b]
        power[SLIDING] += sliding
        power[IN_CONTACT] += lost
        power[BALL_SET] += damped * moved
        power[DRAG] += drag * y[spin]
        total += sliding + lost + damped * moved + drag * y[spin]
    dy[at], dy[at + 1] = speed, force / p.spin[L.ROTOR_MASS]
    return torque, total


@lean_kernel
def landing_torque(b: int, y: Array, p: KernelParameters, dy: Array) -> float:
    """Torque on the rotor [N m] of the normal force that ``dy`` holds so far: it misses the rotor's axis."""
    c = p.bearing_at[b, L.CONTACTS]
    x, z, _vx, _vz = true_motion(c, b, y, p)
    numbers = p.bearing[b, L.LANDING_SLEEVE : L.LANDING_SLEEVE_END]
    arm, nx, ny = landing_sleeve.turning_arm(numbers, y[p.rotor_at[L.ROTOR_ANGLE]], x, z)
    at = p.rotor_at[L.N_COORDINATES] + p.contact_at[c, L.CONTACT_BODY]
    torque: float = arm * (nx * dy[at] + ny * dy[at + 1])
    return torque


@inner_kernel
def carried_accelerations(
    b: int, friction: float, y: Array, p: KernelParameters, dy: Array, work: Scratch
) -> tuple[float, float, float]:
    """Motion of race, rings and support under the contact forces that ``dy`` holds and their friction [N].

    Returns the power that balls, support and drag take [W].
    """
    n_q, h = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT]
    row = p.bearing[b]
    F_x, F_y, by_balls, by_drag = 0.0, 0.0, 0.0, 0.0
    if not OPTIONAL_PARTS or p.bearing_at[b, L.RACE] >= 0:
        F_x, F_y, by_balls, by_drag = add_race(b, friction, y, p, dy, work)
    else:
        dy[p.bearing_at[b, L.RACE_SPIN]] = 0.0
    sprung = p.bearing_at[b, L.RING_STATES] >= 0
    by_fit = 0.0
    if OPTIONAL_PARTS and sprung:
        by_rings, by_fit = add_rings(b, math.sqrt(F_x * F_x + F_y * F_y), y, p, dy, work.balls)
        by_balls += by_rings
    sx = y[n_q + h]
    sy = y[n_q + h + 1]
    by_support = row[L.SUPPORT_DAMPING_X] * sx * sx + row[L.SUPPORT_DAMPING_Y] * sy * sy
    F_x, F_y = F_x + dy[n_q + h], F_y + dy[n_q + h + 1]
    dy[n_q + h] = (F_x - row[L.SUPPORT_DAMPING_X] * sx - row[L.SUPPORT_STIFFNESS_X] * y[h]) / row[
        L.SUPPORT_MASS_X
    ]
    dy[n_q + h + 1] = (F_y - row[L.SUPPORT_DAMPING_Y] * sy - row[L.SUPPORT_STIFFNESS_Y] * y[h + 1]) / row[
        L.SUPPORT_MASS_Y
    ]
    if row[L.SUPPORT_FORM + support.PRESENT] != 0.0:
        by_support = add_support_form(b, y, p, dy)
    if OPTIONAL_PARTS and sprung:
        by_support += by_fit
    return by_balls, by_support, by_drag


@lean_kernel
def bearing_accelerations(
    t: float, b: int, y: Array, p: KernelParameters, dy: Array, work: Scratch
) -> tuple[float, float]:
    """Forces at one touchdown bearing, added to rotor, race, support and spin; power lost, in its row.

    Returns the friction torque on the rotor [N m] (positive drives it) and all power lost here [W]. A bearing
    without a race has the rotor touch its support.
    """
    friction = 0.0
    sliding = 0.0
    lost = 0.0
    for c in range(p.bearing_at[b, L.CONTACTS], p.bearing_at[b, L.CONTACTS_END]):
        force, by_sliding, by_law = add_contact(t, c, b, y, p, dy)
        friction += force
        sliding += by_sliding
        lost += by_law
    by_sleeve = 0.0
    if p.bearing[b, L.NOT_ROUND] != 0.0:
        by_sleeve = landing_torque(b, y, p, dy)
    by_balls, by_support, by_drag = carried_accelerations(b, friction, y, p, dy, work)
    power = work.power[b]
    power[SLIDING], power[IN_CONTACT] = sliding, lost
    power[BALL_SET], power[SUPPORT], power[DRAG] = by_balls, by_support, by_drag
    torque = by_sleeve - friction * p.bearing[b, L.ROTOR_RADIUS]
    return torque, by_balls + by_drag + by_support + (sliding + lost)


@inner_kernel
def aerodynamic_deceleration(t: float, omega: float, p: KernelParameters) -> float:
    """Deceleration [rad/s²] by air alone, in the mode of the case; zero without a speed model."""
    mode = p.flags[L.SPIN_MODE]
    if mode == IN_TIME or mode == PRESCRIBED:  # noqa: SIM109  compiled
        return exponential_deceleration(t, p.spin[L.INITIAL_SPEED], p.spin[L.AERO_TIME_CONSTANT])
    if mode == OF_SPEED:
        return speed_dependent_deceleration(omega, p.spin[L.AERO_LINEAR], p.spin[L.AERO_QUADRATIC])
    return 0.0


@lean_kernel
def drop_derivative(t: float, y: Array, p: KernelParameters, dy: Array, work: Scratch) -> None:
    """Time derivative of the state of a drop; the power lost by place stands in ``work.power`` afterwards.

    Bearings come first, then the rotor's spin, then its lateral motion, because the ω̇ terms of eq. (1) need
    the angular acceleration that friction causes.
    """
    n_q = p.rotor_at[L.N_COORDINATES]
    accelerations = dy[n_q : 2 * n_q]
    for i in range(n_q):
        accelerations[i] = 0.0
    dy[p.rotor_at[L.WORK_IN]] = 0.0
    contact_torque = 0.0
    dissipated = 0.0
    if OPTIONAL_PARTS and p.rub.shape[0] > 0:  # first, where no value of a bearing is held in a register
        contact_torque, dissipated = add_rubs(y, p, dy, work.power[p.bearing.shape[0]])
    for b in range(p.bearing.shape[0]):
        torque, lost = bearing_accelerations(t, b, y, p, dy, work)
        contact_torque += torque
        dissipated += lost
    if OPTIONAL_PARTS and p.rotor_at[L.AXIAL] >= 0:
        torque, lost = add_axial_motion(t, y, p, dy, work)
        contact_torque += torque
        dissipated += lost
    if OPTIONAL_PARTS and p.flags[L.LOOPS_ACT] != 0:
        dissipated += add_loops(y, p, dy, work.power[p.bearing.shape[0]])
    work.power[p.bearing.shape[0], BENDING] = add_rotor_rates(t, y, contact_torque, dissipated, p, dy)


@inner_kernel
def add_rotor_rates(
    t: float, y: Array, contact_torque: float, dissipated: float, p: KernelParameters, dy: Array
) -> float:
    """Add what is the rotor's own to the forces of the bearings: its spin, its lateral motion, the books.

    ``contact_torque`` [N m] is what the bearings drive it with, ``dissipated`` [W] what is lost there.
    Returns the power that modal damping takes [W].
    """
    n_q, i_w = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.ROTOR_SPEED]
    omega = y[i_w]
    rates, velocities = dy[:n_q], y[n_q : 2 * n_q]
    air = aerodynamic_deceleration(t, omega, p)
    omega_dot = air
    put_in = p.spin[L.POLAR_INERTIA] * air * omega
    if p.flags[L.SPIN_MODE] != PRESCRIBED:
        omega_dot += contact_torque / p.spin[L.POLAR_INERTIA]
    else:
        put_in -= contact_torque * omega
    lost, gained = add_rotor_accelerations(y, omega, omega_dot, p, dy)
    if p.flags[L.MAGNETS_ACT] != 0:
        gained += add_magnet_forces(t, y, p, dy)
    if OPTIONAL_PARTS and p.flags[L.LOADS_ACT] != 0:
        gained += add_loads(t, y, p, dy)
    for i in range(n_q):
        rates[i] = velocities[i]
    dy[i_w] = omega_dot
    dy[p.rotor_at[L.ROTOR_ANGLE]] = omega
    dy[p.rotor_at[L.DISSIPATED]] = dissipated + lost
    dy[p.rotor_at[L.WORK_IN]] += put_in + gained
    return lost
