"""Derivative of the right-hand side by the state: what the filter needs beside the value.

Every derivative is analytic and tested against finite differences away from switches. Left out, because they
are tiny and would make the matrix full: the dependence of the ω̇ terms of eq. (1) on the contact torque. Left
out too is the torque of a landing sleeve that is not round, some hundredth of that of friction.
"""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.physics import aerodynamics, ball_table, face, landing_sleeve, mount, ring, support
from rotordrop.physics import columns as L
from rotordrop.physics._compile import OPTIONAL_PARTS, inner_kernel, kernel, lean_kernel
from rotordrop.physics.ball_set import (
    ball_set_axial_gradient,
    ball_set_gradient,
    row_axial_damping,
    two_row_axial_damping,
)
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import sine_cosine
from rotordrop.physics.spin import race_drag_gradient
from rotordrop.physics.touch import touch_gradient
from rotordrop.simulate._rhs import (
    aerodynamic_deceleration,
    mount_states,
    race_deflection,
    race_travel,
    relative_motion,
    ring_travel,
    rows_of,
    support_deflection,
    true_motion,
)

FACE_STEP = 1e-9
"""Step [m], [m/s] of the difference by which the law of a face is differentiated."""

Slopes = tuple[float, float, float]
PRESCRIBED = aerodynamics.PRESCRIBED_SPEED
OF_SPEED = aerodynamics.FUNCTION_OF_SPEED


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
def _contact_jacobian(c: int, g: Array, p: KernelParameters, J: Array) -> None:
    """Spread the gradient of one contact over the columns of rotor modes, body and spins."""
    x, z, n_q = p.rotor_at[L.MODES_X], p.rotor_at[L.MODES_Y], p.rotor_at[L.N_COORDINATES]
    b, body, spin = (
        p.contact_at[c, L.CONTACT_BEARING],
        p.contact_at[c, L.CONTACT_BODY],
        p.contact_at[c, L.CONTACT_SPIN],
    )
    i_w, row, shape = p.rotor_at[L.ROTOR_SPEED], p.bearing[b], p.bearing_shape[b]
    m = shape.shape[0]
    for i in range(4 + 2 * m):
        if i < 2:
            mass = row[L.RACE_MASS] if body == p.bearing_at[b, L.RACE] else row[L.SUPPORT_MASS_X + i]
            place, force, factor = n_q + body + i, i, 1.0 / mass
        elif i == 2:
            place, force, factor = spin, 2, row[L.BORE_RADIUS] / row[L.RACE_INERTIA]
        elif i == 3:
            place, force, factor = i_w, 2, -row[L.ROTOR_RADIUS] / p.spin[L.POLAR_INERTIA]
        elif i < 4 + m:
            place, force, factor = n_q + x + i - 4, 0, -shape[i - 4]
        else:
            place, force, factor = n_q + z + i - 4 - m, 1, -shape[i - 4 - m]
        if place < 0 or (i == 3 and p.flags[L.SPIN_MODE] == PRESCRIBED):
            continue
        for part in range(4):
            slope = factor * g[force, part]
            modes = (x if part % 2 == 0 else z) + (part // 2) * n_q
            for k in range(m):
                J[place, modes + k] += slope * shape[k]
            J[place, body + part % 2 + (part // 2) * n_q] -= slope
        J[place, i_w] += factor * g[force, 4]
        J[place, p.rotor_at[L.ROTOR_ANGLE]] += factor * g[force, 6]
        if spin >= 0:
            J[place, spin] += factor * g[force, 5]


@lean_kernel
def _couple(J: Array, place: int, weight: float, at: int, rate: int, i: int, k: Slopes, c: Slopes) -> None:
    """Add to an acceleration along axis ``i`` what springs ``k_xx, k_xy, k_yy`` and dampers make of a body.

    The body's displacement stands at ``at``, its velocity at ``rate``, x before y.
    """
    for j in range(2):
        stiffness, damping = k[1], c[1]
        if i == j:
            stiffness, damping = (k[0], c[0]) if i == 0 else (k[2], c[2])
        J[place, at + j] += weight * stiffness
        J[place, rate + j] += weight * damping


@lean_kernel
def _race_jacobian(b: int, y: Array, p: KernelParameters, J: Array) -> None:
    """Add balls and drag of a race."""
    n_q = p.rotor_at[L.N_COORDINATES]
    r, h, spin = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.RACE_SPIN]
    row = p.bearing[b]
    dx, dy = race_deflection(b, y, p)
    w_x = w_y = 0.0
    if OPTIONAL_PARTS and row[L.FAST_SPEED_STEP] > 0.0:
        grid = row[L.FAST : L.FAST_END]
        F_x, F_y, k_xx, k_xy, k_yy, w_x, w_y = ball_table.fast_gradient(
            grid, p.ball_table[b], p.balls[b], dx, dy, y[spin]
        )
    elif OPTIONAL_PARTS and p.bearing_at[b, L.FACE_STATES] >= 0:
        entries, along = row[L.BALL_SET : L.BALL_SET_END], race_travel(b, y, p)
        loaded, relieved = rows_of(b, p)
        F_x, F_y, k_xx, k_xy, k_yy = ball_set_gradient(entries, loaded, dx, dy, -along)
        G_x, G_y, g_xx, g_xy, g_yy = ball_set_gradient(entries, relieved, dx, dy, along)
        F_x, F_y, k_xx, k_xy, k_yy = F_x + G_x, F_y + G_y, k_xx + g_xx, k_xy + g_xy, k_yy + g_yy
    else:
        entries, way = row[L.BALL_SET : L.BALL_SET_END], ring_travel(b, y, p)
        F_x, F_y, k_xx, k_xy, k_yy = ball_set_gradient(entries, p.balls[b], dx, dy, way)
    k, c = (k_xx, k_xy, k_yy), (row[L.BEARING_DAMPING], 0.0, row[L.BEARING_DAMPING])
    for i in range(2):
        m_h = row[L.SUPPORT_MASS_X + i]
        _couple(J, n_q + r + i, -1.0 / row[L.RACE_MASS], r, n_q + r, i, k, c)
        _couple(J, n_q + r + i, 1.0 / row[L.RACE_MASS], h, n_q + h, i, k, c)
        _couple(J, n_q + h + i, 1.0 / m_h, r, n_q + r, i, k, c)
        _couple(J, n_q + h + i, -1.0 / m_h, h, n_q + h, i, k, c)
    F = math.sqrt(F_x * F_x + F_y * F_y)
    by_force, by_spin = race_drag_gradient(
        F + row[L.PRESSED], y[spin], row[L.DRAG_COEFFICIENT], row[L.PITCH_DIAMETER], row[L.DRAG_SPEED]
    )
    J[spin, spin] -= by_spin / row[L.RACE_INERTIA]
    if F > 0.0:
        for j in range(2):
            along = F_x * k_xx + F_y * k_xy if j == 0 else F_x * k_xy + F_y * k_yy
            J[spin, r + j] -= by_force / row[L.RACE_INERTIA] * along / F
            J[spin, h + j] += by_force / row[L.RACE_INERTIA] * along / F
    if OPTIONAL_PARTS and row[L.FAST_SPEED_STEP] > 0.0:
        for i in range(2):
            slope = w_x if i == 0 else w_y
            J[n_q + r + i, spin] -= slope / row[L.RACE_MASS]
            J[n_q + h + i, spin] += slope / row[L.SUPPORT_MASS_X + i]
        if F > 0.0:
            J[spin, spin] -= by_force / row[L.RACE_INERTIA] * (F_x * w_x + F_y * w_y) / F
    if OPTIONAL_PARTS and p.bearing_at[b, L.RING_STATES] >= 0:
        _ring_jacobian(b, y, p, J, (F_x, F_y), k)


@lean_kernel
def _ring_jacobian(
    b: int, y: Array, p: KernelParameters, J: Array, F: tuple[float, float], k: Slopes
) -> None:
    """Add sprung rings: their own motion, and what their way changes of the force [N] on race and support.

    ``k`` are the slopes of the force of the balls by the deflection of the race.
    """
    n_q, at = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.RING_STATES]
    r, h, spin = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.RACE_SPIN]
    row = p.bearing[b]
    entries, numbers = row[L.BALL_SET : L.BALL_SET_END], row[L.RING : L.RING_END]
    dx, dy = race_deflection(b, y, p)
    _pushed, k_ax, k_ay, k_aa = ball_set_axial_gradient(entries, p.balls[b], dx, dy, y[at])
    _held, rate = ring.spring_force(numbers, entries, y[at])
    C = row[L.BEARING_DAMPING]
    total_x = F[0] + C * (y[n_q + r] - y[n_q + h])
    total_y = F[1] + C * (y[n_q + r + 1] - y[n_q + h + 1])
    size = math.sqrt(total_x * total_x + total_y * total_y)
    _friction, by_force, by_speed = ring.fit_friction(numbers, size, y[at + 1])
    mass, rows = numbers[ring.MASS], numbers[ring.ROWS]
    along_x, along_y = (total_x / size, total_y / size) if size > 0.0 else (0.0, 0.0)
    elastic = math.sqrt(F[0] * F[0] + F[1] * F[1])
    share = numbers[ring.DAMPING] / numbers[ring.ROWS]
    damping, by_way = row_axial_damping(row[L.ROLLING : L.ROLLING_END], share, y[at])
    by_drag, _by_spin = race_drag_gradient(
        elastic + row[L.PRESSED], y[spin], row[L.DRAG_COEFFICIENT], row[L.PITCH_DIAMETER], row[L.DRAG_SPEED]
    )
    J[at, at + 1] = 1.0
    J[at + 1, at] -= (k_aa / rows + rate - by_force * (along_x * k_ax + along_y * k_ay)) / mass
    J[at + 1, at] -= by_way * y[at + 1] / mass
    J[at + 1, at + 1] -= (by_speed + damping) / mass
    for j in range(2):
        axial, along = (k_ax, along_x) if j == 0 else (k_ay, along_y)
        # as the rings give way, the force of the balls falls
        J[n_q + r + j, at] += axial / row[L.RACE_MASS]
        J[n_q + h + j, at] -= axial / row[L.SUPPORT_MASS_X + j]
        if elastic > 0.0:
            J[spin, at] += by_drag / row[L.RACE_INERTIA] * F[j] * axial / elastic
        radial = along_x * k[0] + along_y * k[1] if j == 0 else along_x * k[1] + along_y * k[2]
        slope = (axial / rows - by_force * radial) / mass
        J[at + 1, r + j] += slope
        J[at + 1, h + j] -= slope
        J[at + 1, n_q + r + j] -= by_force * along * C / mass
        J[at + 1, n_q + h + j] += by_force * along * C / mass


@lean_kernel
def _axial_jacobian(y: Array, p: KernelParameters, J: Array) -> None:
    """Add the axial motion of rotor and races: faces, balls, and what the balls make of both motions.

    Left out are the friction of a face and the drag that the axial force of the balls puts on the race.
    """
    n_q, at = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.AXIAL]
    J[at, at + 1] = 1.0
    for b in p.faces:
        own, r, h = p.bearing_at[b, L.FACE_STATES], p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT]
        row, (loaded, relieved) = p.bearing[b], rows_of(b, p)
        numbers, entries = row[L.FACE : L.FACE_END], row[L.BALL_SET : L.BALL_SET_END]
        dx, dy = race_deflection(b, y, p)
        z, vz = y[at] - y[own], y[at + 1] - y[own + 1]
        above = face.face_contact(numbers, z + FACE_STEP, vz, 0.0, 0.0, 0.0)[1]
        stiff = above - face.face_contact(numbers, z - FACE_STEP, vz, 0.0, 0.0, 0.0)[1]
        above = face.face_contact(numbers, z, vz + FACE_STEP, 0.0, 0.0, 0.0)[1]
        loss = above - face.face_contact(numbers, z, vz - FACE_STEP, 0.0, 0.0, 0.0)[1]
        _one, k_ax, k_ay, k_aa = ball_set_axial_gradient(entries, loaded, dx, dy, -y[own])
        _other, g_ax, g_ay, g_aa = ball_set_axial_gradient(entries, relieved, dx, dy, y[own])
        damping, by_way = two_row_axial_damping(row[L.ROLLING : L.ROLLING_END], (loaded, relieved), y[own])
        J[own, own + 1] = 1.0
        for part in range(2):
            slope = (stiff if part == 0 else loss) / (2.0 * FACE_STEP)
            held = k_aa + g_aa + by_way * y[own + 1] if part == 0 else damping
            J[at + 1, at + part] -= slope / p.spin[L.ROTOR_MASS]
            J[at + 1, own + part] += slope / p.spin[L.ROTOR_MASS]
            J[own + 1, at + part] += slope / row[L.RACE_MASS]
            J[own + 1, own + part] -= (slope + held) / row[L.RACE_MASS]
        for j in range(2):
            slope = k_ax - g_ax if j == 0 else k_ay - g_ay
            J[own + 1, r + j] -= slope / row[L.RACE_MASS]
            J[own + 1, h + j] += slope / row[L.RACE_MASS]
            J[n_q + r + j, own] -= slope / row[L.RACE_MASS]
            J[n_q + h + j, own] += slope / row[L.SUPPORT_MASS_X + j]


@inner_kernel
def _entry(matrix: mount.Matrix, i: int, j: int) -> float:
    """Entry of a matrix of x and y."""
    if i == 0:
        return matrix[0] if j == 0 else matrix[1]
    return matrix[2] if j == 0 else matrix[3]


@lean_kernel
def _mount_jacobian(b: int, y: Array, p: KernelParameters, J: Array) -> None:
    """Add stop, ribbon and branches of a mount: their forces on support and foundation, and their states."""
    n_q, h, own = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    row = p.bearing[b]
    numbers = row[L.MOUNT : L.MOUNT_END]
    x, z, vx, vz = support_deflection(b, y, p)
    first, last = mount_states(b, p)
    mobility = max(row[L.SUPPORT_FORM + support.FOUNDATION_SHARE], 0.0) / row[L.SUPPORT_MASS_Y]
    k, c = mount.stop_tangent(numbers, x, z, vx, vz)
    for i in range(2):
        for body in range(1 if own < 0 else 2):  # the force acts on the support and back on its foundation
            place = n_q + h + i if body == 0 else own + 2 + i
            weight = -1.0 / row[L.SUPPORT_MASS_X + i] if body == 0 else mobility
            for j in range(2):
                J[place, h + j] += weight * _entry(k, i, j)
                J[place, n_q + h + j] += weight * _entry(c, i, j)
                if own >= 0:
                    J[place, own + j] -= weight * _entry(k, i, j)
                    J[place, own + 2 + j] -= weight * _entry(c, i, j)
            for state in range(first + i, last, 2):
                J[place, state] += weight * mount.stiffness_of_state(numbers, state - first)
    for state in range(first, last, 2):
        by_stretch, by_rate = mount.stretch_gradient(numbers, state - first, y[state], y[state + 1], vx, vz)
        for i in range(2):
            for j in range(2):
                J[state + i, state + j] += _entry(by_stretch, i, j)
                J[state + i, n_q + h + j] += _entry(by_rate, i, j)
                if own >= 0:
                    J[state + i, own + 2 + j] -= _entry(by_rate, i, j)


@lean_kernel
def _support_jacobian(b: int, y: Array, p: KernelParameters, J: Array) -> None:
    """Add a support with what its form changes, and its foundation."""
    n_q, h, own = p.rotor_at[L.N_COORDINATES], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    row = p.bearing[b]
    form = row[L.SUPPORT_FORM : L.SUPPORT_FORM_END]
    k_x, k_y = row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y]
    c_x, c_y = row[L.SUPPORT_DAMPING_X], row[L.SUPPORT_DAMPING_Y]
    k, c = (k_x, 0.0, k_y), (c_x, 0.0, c_y)
    if form[support.PRESENT] != 0.0:
        x, z, vx, vz = support_deflection(b, y, p)
        k, c = support.support_tangent(form, k_x, k_y, c_x, c_y, x, z, vx, vz)
    for i in range(2):
        m_h = row[L.SUPPORT_MASS_X + i]
        _couple(J, n_q + h + i, -1.0 / m_h, h, n_q + h, i, k, c)
        if own < 0:
            continue
        mobility = max(form[support.FOUNDATION_SHARE], 0.0) / row[L.SUPPORT_MASS_Y]
        speed = form[support.FOUNDATION_SPEED]
        _couple(J, n_q + h + i, 1.0 / m_h, own, own + 2, i, k, c)
        _couple(J, own + 2 + i, mobility, h, n_q + h, i, k, c)
        _couple(J, own + 2 + i, -mobility, own, own + 2, i, k, c)
        J[own + i, own + 2 + i] = 1.0
        J[own + 2 + i, own + i] -= speed * speed
        J[own + 2 + i, own + 2 + i] -= 2.0 * form[support.FOUNDATION_DAMPING] * speed
    if OPTIONAL_PARTS and row[L.MOUNT] != 0.0:
        _mount_jacobian(b, y, p, J)


@kernel
def drop_jacobian(t: float, y: Array, p: KernelParameters, J: Array) -> None:
    """Derivative of `drop_derivative` by the state, shape (s, s) with s up to and including the rotor angle.

    The energies behind the rotor angle are left out.
    """
    n_c = p.contact_at.shape[0]
    g = np.zeros((n_c, 3, 7))
    touching = np.zeros(n_c, dtype=np.int64)
    drop_jacobian_parts(t, y, p, J, g, touching)
    for c in range(n_c):
        if touching[c] != 0:
            _contact_jacobian(c, g[c], p, J)
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
    t: float, y: Array, p: KernelParameters, J: Array, g: Array, touching: Integers
) -> None:
    """`drop_jacobian` with the contacts apart, because a contact fills the rows and columns of all modes.

    ``J`` (s, s) is filled with everything but the contacts and the ω̇ terms of eq. (1), which are some
    hundred thousand times smaller than gyroscopics; ``g`` (C, 3, 7) with the gradients of each contact (see
    `touch_gradient`), valid where ``touching`` (C,) is not zero.
    """
    n_q, i_w = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.ROTOR_SPEED]
    J[:, :] = 0.0
    for i in range(n_q):
        J[i, n_q + i] = 1.0
    for b in range(p.bearing.shape[0]):
        if not OPTIONAL_PARTS or p.bearing_at[b, L.RACE] >= 0:
            _race_jacobian(b, y, p, J)
        _support_jacobian(b, y, p, J)
    for c in range(p.contact_at.shape[0]):
        b = p.contact_at[c, L.CONTACT_BEARING]
        ux, uy, vx, vy = relative_motion(c, b, y, p)
        spin = p.contact_at[c, L.CONTACT_SPIN]
        omega_i = y[spin] if spin >= 0 else 0.0
        numbers = p.bearing[b, L.TOUCH : L.TOUCH_END]
        touching[c] = 1 if touch_gradient(numbers, ux, uy, vx, vy, y[i_w], omega_i, g[c]) else 0
        if touching[c] != 0 and p.bearing[b, L.NOT_ROUND] != 0.0:
            sleeve = p.bearing[b, L.LANDING_SLEEVE : L.LANDING_SLEEVE_END]
            ux, uy, _vx, _vy = true_motion(c, b, y, p)
            angle = y[p.rotor_at[L.ROTOR_ANGLE]]
            landing_sleeve.of_true_motion(sleeve, angle, y[i_w], ux, uy, g[c])
    _rotor_jacobian(y, p, J)
    J[p.rotor_at[L.ROTOR_ANGLE], i_w] = 1.0
    if p.flags[L.SPIN_MODE] == OF_SPEED:
        J[i_w, i_w] += aerodynamics.speed_dependent_slope(
            y[i_w], p.spin[L.AERO_LINEAR], p.spin[L.AERO_QUADRATIC]
        )
    if OPTIONAL_PARTS and p.rotor_at[L.AXIAL] >= 0:
        _axial_jacobian(y, p, J)
    if p.flags[L.MAGNETS_ACT] != 0:
        _magnet_jacobian(t < p.spin[L.POWER_OFF_DELAY], p, J)


@lean_kernel
def _magnet_jacobian(all_hold: bool, p: KernelParameters, J: Array) -> None:
    m, n_q = p.eigenvalue.shape[0], p.rotor_at[L.N_COORDINATES]
    for a in range(p.magnet.shape[0]):
        if not all_hold and p.magnet[a, L.AMB_STAYS] == 0.0:
            continue
        for k in range(m):
            for j in range(m):
                shapes = p.magnet_shape[a, k] * p.magnet_shape[a, j]
                for axis in (L.MODES_X, L.MODES_Y):
                    first = p.rotor_at[axis]
                    J[n_q + first + k, first + j] -= p.magnet[a, L.AMB_STIFFNESS] * shapes
                    J[n_q + first + k, n_q + first + j] -= p.magnet[a, L.AMB_DAMPING] * shapes
