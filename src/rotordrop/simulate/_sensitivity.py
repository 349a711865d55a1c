"""Derivative of the right-hand side by the state: what the filter needs beside the value.

Every derivative is analytic and tested against finite differences away from switches. Left out, because they
are tiny and would make the matrix full: the dependence of the ω̇ terms of eq. (1) on the contact torque.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import aerodynamics, contact, support
from rotordrop.physics import columns as L
from rotordrop.physics._compile import kernel, lean_kernel
from rotordrop.physics.ball_set import ball_set_gradient
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import sine_cosine, tanh
from rotordrop.physics.friction import stribeck_gradient
from rotordrop.physics.spin import surface_speed
from rotordrop.simulate._rhs import (
    aerodynamic_deceleration,
    race_deflection,
    relative_motion,
    support_deflection,
)

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
PRESCRIBED = aerodynamics.PRESCRIBED_SPEED
OF_SPEED = aerodynamics.FUNCTION_OF_SPEED


@lean_kernel
def contact_gradient(
    ux: float, uy: float, vx: float, vy: float, omega: float, omega_i: float, bearing: Array, g: Array
) -> bool:
    """Derivatives of contact force and friction force at one bearing; False and untouched when there is no
    contact.

    ``g`` (3, 6): rows force on the race in x, in y [N] and friction force [N]; columns by ``ux, uy`` [m],
    ``vx, vy`` [m/s] (rotor relative to race), rotor spin and race spin [rad/s].
    """
    r = math.sqrt(ux * ux + uy * uy)
    delta = r - bearing[L.AIR_GAP]
    if delta <= 0.0:
        return False
    nx = ux / r
    ny = uy / r
    tx = -ny
    ty = nx
    v_n = vx * nx + vy * ny
    v_s = vx * tx + vy * ty
    F, F_d, F_v = contact.contact_gradient(bearing[L.CONTACT : L.CONTACT_END], delta, v_n)
    v_t = surface_speed(v_s, omega, bearing[L.ROTOR_RADIUS], omega_i, bearing[L.BORE_RADIUS])
    mu, mu_v = stribeck_gradient(
        v_t,
        bearing[L.FRICTION_STATIC],
        bearing[L.FRICTION_DYNAMIC],
        bearing[L.STRIBECK_SPEED],
        bearing[L.SMOOTHING_SPEED],
    )
    for c in range(6):
        dn = 0.0
        dt = 0.0
        d_force = 0.0
        d_slip = 0.0
        if c < 2:
            dn = nx if c == 0 else ny
            dt = tx if c == 0 else ty
            d_force = F_d * dn + F_v * v_s / r * dt
            d_slip = -v_n / r * dt
        elif c < 4:
            d_force = F_v * (nx if c == 2 else ny)
            d_slip = tx if c == 2 else ty
        elif c == 4:
            d_slip = bearing[L.ROTOR_RADIUS]
        else:
            d_slip = -bearing[L.BORE_RADIUS]
        d_friction = mu * d_force + F * mu_v * d_slip
        turn = dt / r
        g[0, c] = nx * d_force + tx * d_friction + F * turn * (tx - mu * nx)
        g[1, c] = ny * d_force + ty * d_friction + F * turn * (ty - mu * ny)
        g[2, c] = d_friction
    return True


@lean_kernel
def _rotor_jacobian(y: Array, p: KernelParameters, J: Array) -> None:
    m = p.eigenvalue.shape[0]
    x, z, n_q = p.rotor_at[L.MODES_X], p.rotor_at[L.MODES_Y], p.rotor_at[L.N_COORDINATES]
    i_w, i_a = p.rotor_at[L.ROTOR_SPEED], p.rotor_at[L.ROTOR_ANGLE]
    omega = y[i_w]
    s, c = sine_cosine(y[i_a])
    w2 = omega * omega
    for k in range(m):
        rx = n_q + x + k
        ry = n_q + z + k
        J[rx, x + k] -= p.eigenvalue[k]
        J[ry, z + k] -= p.eigenvalue[k]
        J[rx, rx] -= p.damping[k]
        J[ry, ry] -= p.damping[k]
        turn_x = 0.0
        turn_y = 0.0
        for j in range(m):
            g = p.polar[k, j]
            J[rx, n_q + z + j] -= omega * g
            J[ry, n_q + x + j] += omega * g
            turn_x -= g * y[n_q + z + j]
            turn_y += g * y[n_q + x + j]
        uc = p.unbalance_cos[k]
        us = p.unbalance_sin[k]
        J[rx, i_w] += turn_x + 2.0 * omega * (uc * c - us * s)
        J[ry, i_w] += turn_y + 2.0 * omega * (uc * s + us * c)
        J[rx, i_a] += w2 * (-uc * s - us * c)
        J[ry, i_a] += w2 * (uc * c - us * s)


@lean_kernel
def _contact_jacobian(b: int, g: Array, p: KernelParameters, J: Array) -> None:
    x, z, n_q = p.rotor_at[L.MODES_X], p.rotor_at[L.MODES_Y], p.rotor_at[L.N_COORDINATES]
    r, spin = p.bearing_at[b, L.RACE], p.bearing_at[b, L.RACE_SPIN]
    row = p.bearing[b]
    shape = p.bearing_shape[b]
    prescribed = p.flags[L.SPIN_MODE] == PRESCRIBED
    for i in range(4):
        if i < 2:
            place = n_q + r + i
            factor = 1.0 / row[L.RACE_MASS]
            source = i
        elif i == 2:
            place = spin
            factor = row[L.BORE_RADIUS] / row[L.RACE_INERTIA]
            source = 2
        else:
            if prescribed:
                continue
            place = p.rotor_at[L.ROTOR_SPEED]
            factor = -row[L.ROTOR_RADIUS] / p.spin[L.POLAR_INERTIA]
            source = 2
        _spread(place, factor, g[source], b, p, J)
    for k in range(shape.shape[0]):
        _spread(n_q + x + k, -shape[k], g[0], b, p, J)
        _spread(n_q + z + k, -shape[k], g[1], b, p, J)


@lean_kernel
def _spread(place: int, factor: float, g: Array, b: int, p: KernelParameters, J: Array) -> None:
    """Add one row of the contact derivatives to the columns of rotor modes, race and spins."""
    x, z, n_q = p.rotor_at[L.MODES_X], p.rotor_at[L.MODES_Y], p.rotor_at[L.N_COORDINATES]
    r = p.bearing_at[b, L.RACE]
    shape = p.bearing_shape[b]
    fx = factor * g[0]
    fy = factor * g[1]
    gx = factor * g[2]
    gy = factor * g[3]
    for k in range(shape.shape[0]):
        J[place, x + k] += fx * shape[k]
        J[place, z + k] += fy * shape[k]
        J[place, n_q + x + k] += gx * shape[k]
        J[place, n_q + z + k] += gy * shape[k]
    J[place, r] -= fx
    J[place, r + 1] -= fy
    J[place, n_q + r] -= gx
    J[place, n_q + r + 1] -= gy
    J[place, p.rotor_at[L.ROTOR_SPEED]] += factor * g[4]
    J[place, p.bearing_at[b, L.RACE_SPIN]] += factor * g[5]


@lean_kernel
def _support_form_jacobian(b: int, y: Array, p: KernelParameters, J: Array) -> None:
    """Add the derivative of `add_support_form`."""
    n_q, h, own = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    row = p.bearing[b]
    form = row[L.SUPPORT_FORM : L.SUPPORT_FORM_END]
    x, z, _vx, _vz = support_deflection(b, y, p)
    k_xx, k_xy, k_yy = support.support_tangent(
        form, row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y], x, z
    )
    mobility = max(form[support.FOUNDATION_SHARE], 0.0) / row[L.SUPPORT_MASS_Y]
    for i in range(2):
        m_h = row[L.SUPPORT_MASS_X + i]
        J[n_q + h + i, h + i] += row[L.SUPPORT_STIFFNESS_X + i] / m_h
        J[n_q + h + i, n_q + h + i] += row[L.SUPPORT_DAMPING_X + i] / m_h
        for j in range(2):
            k, c = k_xy, 0.0
            if i == j:
                k = k_xx if i == 0 else k_yy
                c = row[L.SUPPORT_DAMPING_X + i]
            J[n_q + h + i, h + j] -= k / m_h
            J[n_q + h + i, n_q + h + j] -= c / m_h
            if own >= 0:
                J[n_q + h + i, own + j] += k / m_h
                J[n_q + h + i, own + 2 + j] += c / m_h
                J[own + 2 + i, h + j] += mobility * k
                J[own + 2 + i, n_q + h + j] += mobility * c
                J[own + 2 + i, own + j] -= mobility * k
                J[own + 2 + i, own + 2 + j] -= mobility * c
        if own >= 0:
            speed = form[support.FOUNDATION_SPEED]
            J[own + i, own + 2 + i] = 1.0
            J[own + 2 + i, own + i] -= speed * speed
            J[own + 2 + i, own + 2 + i] -= 2.0 * form[support.FOUNDATION_DAMPING] * speed


@lean_kernel
def _bearing_jacobian(b: int, y: Array, p: KernelParameters, J: Array, g: Array) -> bool:
    n_q = p.rotor_at[L.N_COORDINATES]
    r, h, spin = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.RACE_SPIN]
    row = p.bearing[b]
    ux, uy, vx, vy = relative_motion(b, y, p)
    touches = contact_gradient(ux, uy, vx, vy, y[p.rotor_at[L.ROTOR_SPEED]], y[spin], row, g)
    dx, dy = race_deflection(b, y, p)
    F_x, F_y, k_xx, k_xy, k_yy = ball_set_gradient(row[L.BALL_SET : L.BALL_SET_END], p.balls[b], dx, dy)
    C_b = row[L.BEARING_DAMPING]
    for i in range(2):
        race = n_q + r + i
        hold = n_q + h + i
        m_h = row[L.SUPPORT_MASS_X + i]
        for j in range(2):
            k = k_xy
            if i == j:
                k = k_xx if i == 0 else k_yy
            J[race, r + j] -= k / row[L.RACE_MASS]
            J[race, h + j] += k / row[L.RACE_MASS]
            J[hold, r + j] += k / m_h
            J[hold, h + j] -= k / m_h
        J[race, race] -= C_b / row[L.RACE_MASS]
        J[race, hold] += C_b / row[L.RACE_MASS]
        J[hold, race] += C_b / m_h
        J[hold, hold] -= (C_b + row[L.SUPPORT_DAMPING_X + i]) / m_h
        J[hold, h + i] -= row[L.SUPPORT_STIFFNESS_X + i] / m_h
    if row[L.SUPPORT_FORM + support.PRESENT] != 0.0:
        _support_form_jacobian(b, y, p, J)
    F = math.sqrt(F_x * F_x + F_y * F_y)
    half = 0.5 * row[L.DRAG_COEFFICIENT] * row[L.PITCH_DIAMETER] / row[L.RACE_INERTIA]
    level = tanh(y[spin] / row[L.DRAG_SPEED])
    J[spin, spin] -= half * F * (1.0 - level * level) / row[L.DRAG_SPEED]
    if F > 0.0:
        by_x = half * level * (F_x * k_xx + F_y * k_xy) / F
        by_y = half * level * (F_x * k_xy + F_y * k_yy) / F
        J[spin, r] -= by_x
        J[spin, r + 1] -= by_y
        J[spin, h] += by_x
        J[spin, h + 1] += by_y
    return touches


@kernel
def drop_jacobian(t: float, y: Array, p: KernelParameters, J: Array) -> None:
    """Derivative of `drop_derivative` by the state, shape (s, s) with s up to and including the rotor angle.

    The energies behind the rotor angle are left out.
    """
    n_b = p.bearing.shape[0]
    g = np.zeros((n_b, 3, 6))
    touching = np.zeros(n_b, dtype=np.int64)
    drop_jacobian_parts(t, y, p, J, g, touching)
    for b in range(n_b):
        if touching[b] != 0:
            _contact_jacobian(b, g[b], p, J)
    _deceleration_jacobian(t, y, p, J)


@lean_kernel
def _deceleration_jacobian(t: float, y: Array, p: KernelParameters, J: Array) -> None:
    m = p.eigenvalue.shape[0]
    x, z, n_q = p.rotor_at[L.MODES_X], p.rotor_at[L.MODES_Y], p.rotor_at[L.N_COORDINATES]
    omega_dot = aerodynamic_deceleration(t, y[p.rotor_at[L.ROTOR_SPEED]], p)
    for k in range(m):
        for j in range(m):
            J[n_q + x + k, z + j] -= omega_dot * p.polar[k, j]
            J[n_q + z + k, x + j] += omega_dot * p.polar[k, j]


@lean_kernel
def drop_jacobian_parts(
    t: float, y: Array, p: KernelParameters, J: Array, g: Array, touching: IntArray
) -> None:
    """`drop_jacobian` with the contacts apart, because a contact fills the rows and columns of all modes.

    ``J`` (s, s) is filled with everything but the contacts and the ω̇ terms of eq. (1), which are some
    hundred thousand times smaller than gyroscopics; ``g`` (B, 3, 6) with the gradients of each contact (see
    `contact_gradient`), valid where ``touching`` (B,) is not zero.
    """
    n_q, i_w = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.ROTOR_SPEED]
    J[:, :] = 0.0
    for i in range(n_q):
        J[i, n_q + i] = 1.0
    for b in range(p.bearing.shape[0]):
        touching[b] = 1 if _bearing_jacobian(b, y, p, J, g[b]) else 0
    _rotor_jacobian(y, p, J)
    J[p.rotor_at[L.ROTOR_ANGLE], i_w] = 1.0
    if p.flags[L.SPIN_MODE] == OF_SPEED:
        J[i_w, i_w] -= p.spin[L.AERO_LINEAR] + 2.0 * p.spin[L.AERO_QUADRATIC] * abs(y[i_w])
    if p.flags[L.MAGNETS_ACT] != 0 and t < p.spin[L.POWER_OFF_DELAY]:
        _magnet_jacobian(p, J)


@lean_kernel
def _magnet_jacobian(p: KernelParameters, J: Array) -> None:
    m, n_q = p.eigenvalue.shape[0], p.rotor_at[L.N_COORDINATES]
    for a in range(p.magnet.shape[0]):
        for k in range(m):
            for j in range(m):
                shapes = p.magnet_shape[a, k] * p.magnet_shape[a, j]
                for axis in (L.MODES_X, L.MODES_Y):
                    first = p.rotor_at[axis]
                    J[n_q + first + k, first + j] -= p.magnet[a, L.AMB_STIFFNESS] * shapes
                    J[n_q + first + k, n_q + first + j] -= p.magnet[a, L.AMB_DAMPING] * shapes
