"""Derivative of the right-hand side by the state: what the filter needs beside the value.

What bearings do is differentiated by one-sided differences of the right-hand side's own parts; the rest is
analytic. Left out, because they are tiny and would make the matrix full: the dependence of the ω̇ terms of
eq. (1) on the contact torque. Left out too is the torque of a landing sleeve that is not round, some
hundredth of that of friction.
"""

from __future__ import annotations

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics._compile import OPTIONAL_PARTS, inner_kernel, kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import sine_cosine
from rotordrop.simulate._rhs import (
    Scratch,
    add_axial_motion,
    aerodynamic_deceleration,
    carried_accelerations,
    contact_values,
    mount_states,
    scratch_of,
)

PLACE_STEP, RATE_STEP, SPIN_STEP = 1e-11, 1e-7, 1e-6
"""Steps [m], [m/s] and [rad/s] or [rad] of the differences: far below the depth of any contact that counts,
and far above rounding (chosen)."""

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
def _add_column(
    t: float,
    owner: int,
    i: int,
    step: float,
    rates: Array,
    y: Array,
    p: KernelParameters,
    J: Array,
    work: Scratch,
) -> None:
    """Add to column ``i`` what a step of that state changes of the rates of `_rates_of`, ``rates[0]``."""
    n_b, kept = p.bearing.shape[0], y[i]
    y[i] = kept + step
    _rates_of(t, owner, y, p, rates[1], work)
    step = y[i] - kept
    y[i] = kept
    # bearings: races and supports and all behind; axial motion: behind the spins
    first = 2 * p.rotor_at[L.N_COORDINATES] + (n_b if owner == n_b else -4 * n_b)
    for r in range(first, J.shape[0]):
        J[r, i] += (rates[1, r] - rates[0, r]) / step


@lean_kernel
def _rates_of(t: float, owner: int, y: Array, p: KernelParameters, dy: Array, work: Scratch) -> None:
    """Rates of what one bearing carries, contacts left out, or of axial motion behind the last bearing."""
    for i in range(dy.shape[0]):
        dy[i] = 0.0
    if owner < p.bearing.shape[0]:
        carried_accelerations(owner, 0.0, y, p, dy, work)
    elif OPTIONAL_PARTS:
        add_axial_motion(t, y, p, dy, work)


@lean_kernel
def _bearing_jacobian(
    t: float, b: int, y: Array, p: KernelParameters, J: Array, rates: Array, work: Scratch
) -> None:
    """Add what one bearing carries: race, rings, support, foundation and mount."""
    n_q = p.rotor_at[L.N_COORDINATES]
    r, h, own = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    _rates_of(t, b, y, p, rates[0], work)
    for j in range(2):
        _add_column(t, b, h + j, PLACE_STEP, rates, y, p, J, work)
        _add_column(t, b, n_q + h + j, RATE_STEP, rates, y, p, J, work)
        if not OPTIONAL_PARTS or r >= 0:
            _add_column(t, b, r + j, PLACE_STEP, rates, y, p, J, work)
            _add_column(t, b, n_q + r + j, RATE_STEP, rates, y, p, J, work)
        if own >= 0:
            _add_column(t, b, own + j, PLACE_STEP, rates, y, p, J, work)
            _add_column(t, b, own + 2 + j, RATE_STEP, rates, y, p, J, work)
    if not OPTIONAL_PARTS or r >= 0:
        _add_column(t, b, p.bearing_at[b, L.RACE_SPIN], SPIN_STEP, rates, y, p, J, work)
    if OPTIONAL_PARTS:
        first, last = mount_states(b, p)
        for i in range(first, last):
            _add_column(t, b, i, PLACE_STEP, rates, y, p, J, work)
        ring, face = p.bearing_at[b, L.RING_STATES], p.bearing_at[b, L.FACE_STATES]
        if ring >= 0:
            _add_column(t, b, ring, PLACE_STEP, rates, y, p, J, work)
            _add_column(t, b, ring + 1, RATE_STEP, rates, y, p, J, work)
        if face >= 0:
            _add_column(t, b, face, PLACE_STEP, rates, y, p, J, work)


@lean_kernel
def _axial_jacobian(t: float, y: Array, p: KernelParameters, J: Array, rates: Array, work: Scratch) -> None:
    """Add the axial motion of rotor and races.

    Left out are the friction of a face and the drag that the axial force of the balls puts on the race.
    """
    owner, at = p.bearing.shape[0], p.rotor_at[L.AXIAL]
    _rates_of(t, owner, y, p, rates[0], work)
    _add_column(t, owner, at, PLACE_STEP, rates, y, p, J, work)
    _add_column(t, owner, at + 1, RATE_STEP, rates, y, p, J, work)
    for b in p.faces:
        own, r, h = p.bearing_at[b, L.FACE_STATES], p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT]
        _add_column(t, owner, own, PLACE_STEP, rates, y, p, J, work)
        _add_column(t, owner, own + 1, RATE_STEP, rates, y, p, J, work)
        for j in range(2):
            _add_column(t, owner, r + j, PLACE_STEP, rates, y, p, J, work)
            _add_column(t, owner, h + j, PLACE_STEP, rates, y, p, J, work)


@inner_kernel
def _contact_force(
    t: float, c: int, b: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float]:
    """Indentation [m], force on the bore along x and y and friction force [N] of a contact."""
    delta, F_r, F_mu, nx, ny, _sliding, _lost = contact_values(t, c, b, y, p)
    return delta, F_r * nx - F_mu * ny, F_r * ny + F_mu * nx, F_mu


@lean_kernel
def contact_gradient(t: float, c: int, y: Array, p: KernelParameters, g: Array) -> bool:
    """Derivatives of a contact; False and ``g`` untouched where the rotor flies.

    ``g`` (3, 7): rows force on the bore in x, in y [N] and friction force [N]; columns by displacement [m]
    and velocity [m/s] of the rotor against the bore, spin of rotor and of bore [rad/s], rotor angle [rad].
    """
    b, body, spin = (
        p.contact_at[c, L.CONTACT_BEARING],
        p.contact_at[c, L.CONTACT_BODY],
        p.contact_at[c, L.CONTACT_SPIN],
    )
    delta, F_x, F_y, F_mu = _contact_force(t, c, b, y, p)
    if delta <= 0.0:
        return False
    for k in range(7):
        i, step = body + k % 2, PLACE_STEP
        if k >= 4:
            i, step = spin, SPIN_STEP
            if k != 5:
                i = p.rotor_at[L.ROTOR_SPEED] if k == 4 else p.rotor_at[L.ROTOR_ANGLE]
        elif k >= 2:
            i, step = i + p.rotor_at[L.N_COORDINATES], RATE_STEP
        g[0, k] = g[1, k] = g[2, k] = 0.0
        if i < 0 or (k == 6 and p.bearing[b, L.NOT_ROUND] == 0.0):
            continue
        kept = y[i]
        y[i] = kept + step
        _delta, x, z, friction = _contact_force(t, c, b, y, p)
        step = y[i] - kept if k >= 4 else kept - y[i]  # the bore moves where the rotor should
        y[i] = kept
        g[0, k], g[1, k], g[2, k] = (x - F_x) / step, (z - F_y) / step, (friction - F_mu) / step
    return True


@kernel
def drop_jacobian(t: float, y: Array, p: KernelParameters, J: Array) -> None:
    """Derivative of `drop_derivative` by the state, shape (s, s) with s up to and including the rotor angle.

    The energies behind the rotor angle are left out.
    """
    n_c = p.contact_at.shape[0]
    g = np.zeros((n_c, 3, 7))
    touching = np.zeros(n_c, dtype=np.int64)
    drop_jacobian_parts(t, y, p, J, g, touching, np.empty((2, y.shape[0])), scratch_of(p))
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
    t: float,
    y: Array,
    p: KernelParameters,
    J: Array,
    g: Array,
    touching: Integers,
    rates: Array,
    work: Scratch,
) -> None:
    """`drop_jacobian` with the contacts apart, because a contact fills the rows and columns of all modes.

    ``J`` (s, s) is filled with everything but the contacts and the ω̇ terms of eq. (1), which are some
    hundred thousand times smaller than gyroscopics; ``g`` (C, 3, 7) with the gradients of each contact (see
    `contact_gradient`), valid where ``touching`` (C,) is not zero. ``rates`` (2, n) is scratch.
    """
    n_q, i_w = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.ROTOR_SPEED]
    J[:, :] = 0.0
    for i in range(n_q):
        J[i, n_q + i] = 1.0
    for b in range(p.bearing.shape[0]):
        _bearing_jacobian(t, b, y, p, J, rates, work)
    for c in range(p.contact_at.shape[0]):
        touching[c] = 1 if contact_gradient(t, c, y, p, g[c]) else 0
    _rotor_jacobian(y, p, J)
    J[p.rotor_at[L.ROTOR_ANGLE], i_w] = 1.0
    if p.flags[L.SPIN_MODE] == OF_SPEED:
        J[i_w, i_w] += aerodynamics.speed_dependent_slope(
            y[i_w], p.spin[L.AERO_LINEAR], p.spin[L.AERO_QUADRATIC]
        )
    if OPTIONAL_PARTS and p.rotor_at[L.AXIAL] >= 0:
        _axial_jacobian(t, y, p, J, rates, work)
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
