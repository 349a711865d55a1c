"""Right-hand side of the drop of a hidden machine, whose bearings hold more than any estimator models.

Written apart from the kernels of simulation and filter wherever a structure acts; rotor, balls and friction
are those of `rotordrop.physics`. With every structure absent it gives the bits of the simulated drop.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.physics._compile import inner_kernel, kernel
from rotordrop.physics.ball_set import ball_set_force, ball_set_load
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import contact_force
from rotordrop.physics.elementary import exp, sine_cosine
from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.physics.spin import race_drag_torque, surface_speed
from rotordrop.simulate._rhs import (
    add_rotor_rates,
    modal_parts,
)

Array = NDArray[np.float64]

# Columns of the structure of a bearing, one row each; SI units. All zero but AXIS_COSINE, SLIP_TRAVEL,
# GAP_DRIFT_TIME and GAP_HEAT is a bearing without any.
AXIS_COSINE, AXIS_SINE = 0, 1  # of the angle from horizontal to the first principal axis of the support
HARDENING, RADIAL = 2, 3  # k in F = K h (1 + k h²) [1/m²]; h along the axis, or the whole where RADIAL is 1
SLIP_FORCE, SLIP_TRAVEL = 4, 5  # [N], [m]
FOUNDATION_COMPLIANCE = 6  # 1/M [1/kg]
FOUNDATION_SQUARE_X, FOUNDATION_SQUARE_Y = 7, 8  # ω² [1/s²]
FOUNDATION_DECAY_X, FOUNDATION_DECAY_Y = 9, 10  # 2ζω [1/s]
TILT_COMPLIANCE, TILT_SQUARE, TILT_DECAY = 11, 12, 13
CENTRE_X, CENTRE_Y = 14, 15  # centre of the bearing in the axes of the magnets [m]
GAP_DRIFT, GAP_DRIFT_TIME = 16, 17  # [m] within [s]
GAP_CLOSING, GAP_HEAT = 18, 19  # [m] when much more than [J] were rubbed
CAGE_RATIO = 20  # turn of the cage per turn of the race
LAW_PIECES, LAW = 21, 22
LAW_STIFFNESS, LAW_EXPONENT, LAW_DAMPING, LAW_UNTIL, LAW_WIDTH = 0, 1, 2, 3, 4
MOST_PIECES = 8
N_COLUMNS = LAW + MOST_PIECES * LAW_WIDTH

# States of the structure of a bearing, behind the states of the drop.
FOUNDATION_X, FOUNDATION_Y, FOUNDATION_VX, FOUNDATION_VY = 0, 1, 2, 3
TILT_X, TILT_Y, TILT_VX, TILT_VY = 4, 5, 6, 7
SLIP_X, SLIP_Y = 8, 9
HEAT = 10
CAGE_ANGLE = 11
N_STATES = 12

# Columns of the histories.
H_DELTA, H_CONTACT, H_FRICTION, H_FORCE_X, H_FORCE_Y, H_LOAD, H_STRESS, H_NORMAL_X, H_NORMAL_Y = range(9)
N_HISTORIES = 9


@inner_kernel
def first_state(b: int, p: KernelParameters) -> int:
    """Place of the first state of the structure of one bearing."""
    place: int = p.rotor_at[L.N_STATES] + b * N_STATES
    return place


@inner_kernel
def motion_on_race(b: int, y: Array, p: KernelParameters, s: Array) -> tuple[float, float, float, float]:
    """Displacement [m] and velocity [m/s] of the rotor against the bore that it touches, x and y."""
    n_q, r, e = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.RACE], first_state(b, p)
    shape = p.bearing_shape[b]
    qx, qy, sx, sy = modal_parts(y, p)
    ux = uy = vx = vy = 0.0
    for k in range(shape.shape[0]):
        ux += shape[k] * qx[k]
        uy += shape[k] * qy[k]
        vx += shape[k] * sx[k]
        vy += shape[k] * sy[k]
    return (
        ux - y[r] - y[e + TILT_X] - s[b, CENTRE_X],
        uy - y[r + 1] - y[e + TILT_Y] - s[b, CENTRE_Y],
        vx - y[n_q + r] - y[e + TILT_VX],
        vy - y[n_q + r + 1] - y[e + TILT_VY],
    )


@inner_kernel
def gap_now(t: float, heat: float, nominal: float, s: Array) -> float:
    """Air gap [m] at a time [s] after so much friction heat [J]."""
    drift = s[GAP_DRIFT] * min(max(t, 0.0) / s[GAP_DRIFT_TIME], 1.0)
    gap: float = nominal + drift - s[GAP_CLOSING] * (1.0 - exp(-heat / s[GAP_HEAT]))
    return gap


@inner_kernel
def normal_force(law: Array, s: Array, delta: float, delta_dot: float) -> tuple[float, float]:
    """Normal force and its elastic part [N], by the pieces of the law where it has some."""
    pieces = int(s[LAW_PIECES])
    if pieces == 0:
        return contact_force(law, delta, delta_dot)
    i = LAW
    for _ in range(pieces - 1):
        if delta > s[i + LAW_UNTIL]:
            i += LAW_WIDTH
    return contact_force(s[i : i + LAW_UNTIL], delta, delta_dot)


@inner_kernel
def touch(
    t: float, b: int, y: Array, p: KernelParameters, s: Array
) -> tuple[float, float, float, float, float, float, float, float]:
    """Indentation [m], normal and friction force [N], normal (x, y), sliding speed [m/s], rate of indentation
    [m/s] and elastic part of the normal force [N].
    """
    row = p.bearing[b]
    ux, uy, vx, vy = motion_on_race(b, y, p, s)
    e_r = math.sqrt(ux * ux + uy * uy)
    delta = e_r - gap_now(t, y[first_state(b, p) + HEAT], row[L.AIR_GAP], s[b])
    if delta <= 0.0:
        return delta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    nx = ux / e_r
    ny = uy / e_r
    delta_dot = vx * nx + vy * ny
    F_r, elastic = normal_force(row[L.CONTACT : L.CONTACT_END], s[b], delta, delta_dot)
    omega, omega_i = y[p.rotor_at[L.ROTOR_SPEED]], y[p.bearing_at[b, L.RACE_SPIN]]
    v_t = surface_speed(vy * nx - vx * ny, omega, row[L.ROTOR_RADIUS], omega_i, row[L.BORE_RADIUS])
    mu = stribeck_coefficient(
        v_t,
        row[L.FRICTION_STATIC],
        row[L.FRICTION_DYNAMIC],
        row[L.STRIBECK_SPEED],
        row[L.SMOOTHING_SPEED],
    )
    return delta, F_r, mu * F_r, nx, ny, v_t, delta_dot, elastic


@inner_kernel
def balls_carry(b: int, y: Array, p: KernelParameters, s: Array, work: Array) -> tuple[float, float]:
    """Force of the balls between race and support [N], x and y; they stand where the cage has taken them."""
    r, h = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT]
    dx = y[r] - y[h]
    dy = y[r + 1] - y[h + 1]
    entries = p.bearing[b, L.BALL_SET : L.BALL_SET_END]
    if s[b, CAGE_RATIO] == 0.0:
        return ball_set_force(entries, p.balls[b], dx, dy, work)
    sine, cosine = sine_cosine(y[first_state(b, p) + CAGE_ANGLE])
    along, across = ball_set_force(
        entries, p.balls[b], cosine * dx + sine * dy, cosine * dy - sine * dx, work
    )
    return cosine * along - sine * across, cosine * across + sine * along


@inner_kernel
def support_holds(
    b: int, y: Array, p: KernelParameters, s: Array, dy: Array
) -> tuple[float, float, float, float, float]:
    """Spring force (x, y) with the slip in it and damper force (x, y) of the support [N]; power it
    dissipates [W].

    Also fills the rates of the slip, z' = (v - |v| z) / travel.
    """
    n_q, h, e = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], first_state(b, p)
    row = p.bearing[b]
    hx = y[h] - y[e + FOUNDATION_X]
    hy = y[h + 1] - y[e + FOUNDATION_Y]
    vx = y[n_q + h] - y[e + FOUNDATION_VX]
    vy = y[n_q + h + 1] - y[e + FOUNDATION_VY]
    c, z = s[b, AXIS_COSINE], s[b, AXIS_SINE]
    along = c * hx + z * hy
    across = c * hy - z * hx
    first, second = row[L.SUPPORT_STIFFNESS_X] * along, row[L.SUPPORT_STIFFNESS_Y] * across
    k = s[b, HARDENING]
    if s[b, RADIAL] == 0.0:
        first *= 1.0 + k * along * along
        second *= 1.0 + k * across * across
    else:  # the gradient of (1 + k h²/2) times the energy of the linear springs: no force without a potential
        share = 1.0 + 0.5 * k * (along * along + across * across)
        pull = 0.5 * k * (first * along + second * across)
        first = first * share + pull * along
        second = second * share + pull * across
    damp_first = row[L.SUPPORT_DAMPING_X] * (c * vx + z * vy)
    damp_second = row[L.SUPPORT_DAMPING_Y] * (c * vy - z * vx)
    damp_x = c * damp_first - z * damp_second
    damp_y = c * damp_second + z * damp_first
    speed = math.sqrt(vx * vx + vy * vy)
    zx, zy = y[e + SLIP_X], y[e + SLIP_Y]
    dy[e + SLIP_X] = (vx - speed * zx) / s[b, SLIP_TRAVEL]
    dy[e + SLIP_Y] = (vy - speed * zy) / s[b, SLIP_TRAVEL]
    slip = s[b, SLIP_FORCE]
    lost = damp_x * vx + damp_y * vy + slip * speed * (zx * zx + zy * zy)
    return c * first - z * second + slip * zx, c * second + z * first + slip * zy, damp_x, damp_y, lost


@inner_kernel
def hidden_bearing(
    t: float, b: int, y: Array, p: KernelParameters, s: Array, dy: Array, work: Array
) -> tuple[float, float]:
    """Forces at one bearing, added to rotor, race, support, foundation and spin.

    Returns the friction torque on the rotor [N m] (positive drives it) and the power dissipated [W].
    """
    n_q, e = p.rotor_at[L.N_COORDINATES], first_state(b, p)
    r, h, spin = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.RACE_SPIN]
    row, shape = p.bearing[b], p.bearing_shape[b]
    delta, F_r, F_mu, nx, ny, v_t, delta_dot, elastic = touch(t, b, y, p, s)
    F_x, F_y = balls_carry(b, y, p, s, work)
    drag = race_drag_torque(
        math.sqrt(F_x * F_x + F_y * F_y),
        y[spin],
        row[L.DRAG_COEFFICIENT],
        row[L.PITCH_DIAMETER],
        row[L.DRAG_SPEED],
    )
    wx = y[n_q + r] - y[n_q + h]
    wy = y[n_q + r + 1] - y[n_q + h + 1]
    C_b = row[L.BEARING_DAMPING]
    F_x += C_b * wx
    F_y += C_b * wy
    spring_x, spring_y, damp_x, damp_y, lost = support_holds(b, y, p, s, dy)
    dissipated = C_b * (wx * wx + wy * wy) + drag * y[spin] + lost
    contact_x = 0.0
    contact_y = 0.0
    if delta > 0.0:
        contact_x = F_r * nx - F_mu * ny
        contact_y = F_r * ny + F_mu * nx
        dissipated += F_mu * v_t + (F_r - elastic) * delta_dot
        _, _, ax, ay = modal_parts(dy, p)
        for k in range(shape.shape[0]):
            ax[k] -= shape[k] * contact_x
            ay[k] -= shape[k] * contact_y
    dy[n_q + r] = (contact_x - F_x) / row[L.RACE_MASS]
    dy[n_q + r + 1] = (contact_y - F_y - row[L.RACE_WEIGHT]) / row[L.RACE_MASS]
    dy[n_q + h] = (F_x - damp_x - spring_x) / row[L.SUPPORT_MASS_X]
    dy[n_q + h + 1] = (F_y - damp_y - spring_y) / row[L.SUPPORT_MASS_Y]
    dy[spin] = (F_mu * row[L.BORE_RADIUS] - drag) / row[L.RACE_INERTIA]
    dissipated += foundation_moves(spring_x + damp_x, spring_y + damp_y, e, y, s[b], dy)
    dissipated += race_tilts(contact_x, contact_y, e, y, s[b], dy)
    dy[e + HEAT] = F_mu * v_t
    dy[e + CAGE_ANGLE] = s[b, CAGE_RATIO] * y[spin]
    return -F_mu * row[L.ROTOR_RADIUS], dissipated


@inner_kernel
def foundation_moves(force_x: float, force_y: float, e: int, y: Array, s: Array, dy: Array) -> float:
    """Rates of the mode of the foundation under the force of the support [N]; power it dissipates [W]."""
    vx, vy = y[e + FOUNDATION_VX], y[e + FOUNDATION_VY]
    brake_x = s[FOUNDATION_DECAY_X] * vx
    brake_y = s[FOUNDATION_DECAY_Y] * vy
    compliance = s[FOUNDATION_COMPLIANCE]
    dy[e + FOUNDATION_X] = vx
    dy[e + FOUNDATION_Y] = vy
    dy[e + FOUNDATION_VX] = compliance * force_x - s[FOUNDATION_SQUARE_X] * y[e + FOUNDATION_X] - brake_x
    dy[e + FOUNDATION_VY] = compliance * force_y - s[FOUNDATION_SQUARE_Y] * y[e + FOUNDATION_Y] - brake_y
    return (brake_x * vx + brake_y * vy) / compliance if compliance > 0.0 else 0.0


@inner_kernel
def race_tilts(force_x: float, force_y: float, e: int, y: Array, s: Array, dy: Array) -> float:
    """Rates of the tilt of the race under the contact force [N]; power it dissipates [W]."""
    vx, vy = y[e + TILT_VX], y[e + TILT_VY]
    compliance = s[TILT_COMPLIANCE]
    dy[e + TILT_X] = vx
    dy[e + TILT_Y] = vy
    dy[e + TILT_VX] = compliance * force_x - s[TILT_SQUARE] * y[e + TILT_X] - s[TILT_DECAY] * vx
    dy[e + TILT_VY] = compliance * force_y - s[TILT_SQUARE] * y[e + TILT_Y] - s[TILT_DECAY] * vy
    return s[TILT_DECAY] * (vx * vx + vy * vy) / compliance if compliance > 0.0 else 0.0


@inner_kernel
def hidden_derivative(t: float, y: Array, p: KernelParameters, s: Array, dy: Array, work: Array) -> None:
    """Time derivative of the state of a hidden machine; bearings first, for their torque turns the rotor."""
    n_q = p.rotor_at[L.N_COORDINATES]
    for i in range(n_q, 2 * n_q):
        dy[i] = 0.0
    torque = 0.0
    dissipated = 0.0
    for b in range(p.bearing.shape[0]):
        drives, lost = hidden_bearing(t, b, y, p, s, dy, work)
        torque += drives
        dissipated += lost
    add_rotor_rates(t, y, torque, dissipated, p, dy)


@kernel
def hidden_rates(t: float, y: Array, p: KernelParameters, s: Array) -> Array:
    """Time derivative of one state, as a new array."""
    dy = np.zeros(y.shape[0])
    hidden_derivative(t, y, p, s, dy, np.empty((2, p.balls.shape[2])))
    return dy


@kernel
def hidden_histories(times: Array, states: Array, p: KernelParameters, s: Array, out: Array) -> None:
    """Fill ``out`` (T, B, 9) from times [s] and states (T, n); SI units, columns ``H_*``."""
    work = np.empty((2, p.balls.shape[2]))
    for i in range(states.shape[0]):
        y = states[i]
        for b in range(p.bearing.shape[0]):
            delta, F_r, F_mu, nx, ny, _, _, _ = touch(times[i], b, y, p, s)
            F_x, F_y = balls_carry(b, y, p, s, work)
            dx, dy = y[p.bearing_at[b, L.RACE]], y[p.bearing_at[b, L.RACE] + 1]
            dx -= y[p.bearing_at[b, L.SUPPORT]]
            dy -= y[p.bearing_at[b, L.SUPPORT] + 1]
            sine, cosine = sine_cosine(y[first_state(b, p) + CAGE_ANGLE])
            load, stress = ball_set_load(
                p.bearing[b, L.BALL_SET : L.BALL_SET_END],
                p.balls[b],
                cosine * dx + sine * dy,
                cosine * dy - sine * dx,
            )
            out[i, b, H_DELTA] = delta
            out[i, b, H_CONTACT] = F_r
            out[i, b, H_FRICTION] = F_mu
            out[i, b, H_FORCE_X] = -F_x
            out[i, b, H_FORCE_Y] = -F_y
            out[i, b, H_LOAD] = load
            out[i, b, H_STRESS] = stress
            out[i, b, H_NORMAL_X] = nx
            out[i, b, H_NORMAL_Y] = ny
