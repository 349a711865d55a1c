"""Forces, loads and stress of every bearing from the states of a drop."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics import ball_table, face, magnet, mount, ring, support, touch
from rotordrop.physics import columns as L
from rotordrop.physics._compile import OPTIONAL_PARTS, inner_kernel, kernel, lean_kernel
from rotordrop.physics.ball_set import ball_set_energy
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import contact_energy
from rotordrop.physics.elementary import magnitude
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate._loop import borne, contact_at
from rotordrop.simulate._rhs import (
    Scratch,
    depth_now,
    face_values,
    modal_parts,
    mount_states,
    plane_motion,
    project,
    race_deflection,
    ring_travel,
    rows_of,
    rub_values,
    scratch_of,
    support_deflection,
)

# Last axis of the history array.
H_DELTA, H_CONTACT_FORCE, H_FRICTION_FORCE, H_NORMAL_X, H_NORMAL_Y, H_CONTACT_POWER = range(6)
H_BEARING_FORCE_X, H_BEARING_FORCE_Y, H_BALL_LOAD, H_STRESS, H_INNER_STRESS = range(6, 11)
H_OUTER_STRESS, N_HISTORIES = range(11, 13)


@inner_kernel
def fill_history(t: float, b: int, y: Array, p: KernelParameters, work: Scratch, out: Array) -> None:
    """Fill ``out`` (12,) with what one bearing does in a state."""
    contact_at(t, p.bearing_at[b, L.CONTACTS], y, p, out)
    F_x, F_y, load, inner, outer = borne(t, b, y, p, work)
    out[H_BEARING_FORCE_X], out[H_BEARING_FORCE_Y], out[H_BALL_LOAD] = F_x, F_y, load
    out[H_STRESS], out[H_INNER_STRESS], out[H_OUTER_STRESS] = max(inner, outer), inner, outer


@kernel
def bearing_histories(times: Array, states: Array, p: KernelParameters, out: Array) -> None:
    """Fill ``out`` (T, B, 12) from ``times`` (T,) [s] and ``states`` (T, n); SI units, columns ``H_*``.

    The ball force is that on the race.
    """
    work = scratch_of(p)
    for i in range(states.shape[0]):
        for b in range(p.bearing.shape[0]):
            fill_history(times[i], b, states[i], p, work, out[i, b])


def named(model: DropModel, states: Array, histories: Array) -> dict[str, Any]:
    """What both a drop and a coast-down keep of states (T, n) and histories (T, B, 12), by its name there."""
    layout = model.layout
    return {
        "displacement": node_displacements(states, model.parameters.bearing_shape),
        "race_displacement": layout.bore(states),
        "indentation": histories[..., H_DELTA],
        "contact_force": histories[..., H_CONTACT_FORCE],
        "bearing_force": histories[..., H_BEARING_FORCE_X : H_BEARING_FORCE_Y + 1],
        "max_stress": histories[..., H_STRESS],
        "speed": states[:, layout.rotor_speed],
        "race_speed": states[:, layout.race_spin],
    }


def peak_values(histories: Array) -> Array:
    """Indentation [m], ball force [N] and Hertz stress [Pa] of histories (T, B, 12), shape (T, B, 3)."""
    force = magnitude(histories[..., H_BEARING_FORCE_X], histories[..., H_BEARING_FORCE_Y])
    return np.stack([histories[..., H_DELTA], force, histories[..., H_STRESS]], axis=-1)


@kernel
def face_forces(states: Array, p: KernelParameters) -> Array:
    """Axial force of the rotor on the face of every race [N], shape (T, B), from states (T, n)."""
    out = np.zeros((states.shape[0], p.bearing.shape[0]))
    for i in range(states.shape[0]):
        for b in p.faces:
            out[i, b] = face_values(b, states[i], p)[1]
    return out


@kernel
def node_displacements(states: Array, shapes: Array) -> Array:
    """Displacement of nodes [m], shape (T, P, 2), from states (T, n) and their rows of mode shapes (P, m)."""
    m = shapes.shape[1]
    out = np.empty((states.shape[0], shapes.shape[0], 2))
    for i in range(states.shape[0]):
        for k in range(shapes.shape[0]):
            out[i, k, 0] = project(shapes[k], states[i, :m])
            out[i, k, 1] = project(shapes[k], states[i, m : 2 * m])
    return out


@lean_kernel
def support_form_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy [J] that the form of a support adds to that of a plain one, its foundation included."""
    h, own = p.bearing_at[b, L.SUPPORT], p.bearing_at[b, L.BEARING_OWN]
    row = p.bearing[b]
    form = row[L.SUPPORT_FORM : L.SUPPORT_FORM_END]
    k_x, k_y = row[L.SUPPORT_STIFFNESS_X], row[L.SUPPORT_STIFFNESS_Y]
    x, z, _vx, _vz = support_deflection(b, y, p)
    energy: float = support.support_energy(form, k_x, k_y, x, z)
    energy -= 0.5 * (k_x * y[h] ** 2 + k_y * y[h + 1] ** 2)
    if OPTIONAL_PARTS and row[L.MOUNT] != 0.0:
        first, last = mount_states(b, p)
        energy += mount.mount_energy(row[L.MOUNT : L.MOUNT_END], x, z, y[first:last])
    if own >= 0 and form[support.FOUNDATION_SHARE] > 0.0:
        mass = row[L.SUPPORT_MASS_Y] / form[support.FOUNDATION_SHARE]
        for axis in range(2):
            u, v = y[own + axis], y[own + 2 + axis]
            energy += 0.5 * mass * (v * v + form[support.FOUNDATION_SPEED] ** 2 * u * u)
    return energy


@lean_kernel
def ball_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy [J] of the balls of one bearing and of the rings that springs press on."""
    row = p.bearing[b]
    balls, way = row[L.BALL_SET : L.BALL_SET_END], ring_travel(b, y, p)
    dx, dy = race_deflection(b, y, p)
    if OPTIONAL_PARTS and row[L.FAST_SPEED_STEP] > 0.0:
        grid, spin = row[L.FAST : L.FAST_END], y[p.bearing_at[b, L.RACE_SPIN]]
        return ball_table.fast_energy(grid, p.ball_table[b], p.balls[b], dx, dy, spin)
    axial = p.bearing_at[b, L.FACE_STATES]
    if OPTIONAL_PARTS and axial >= 0:
        loaded, relieved = rows_of(b, p)
        return ball_set_energy(balls, loaded, dx, dy, -y[axial]) + ball_set_energy(
            balls, relieved, dx, dy, y[axial]
        )
    energy: float = ball_set_energy(balls, p.balls[b], dx, dy, way)
    if OPTIONAL_PARTS and p.bearing_at[b, L.RING_STATES] >= 0:
        speed = y[p.bearing_at[b, L.RING_STATES] + 1]
        energy += ring.ring_energy(row[L.RING : L.RING_END], balls, way, speed)
    return energy


@lean_kernel
def touch_energy(b: int, delta: float, p: KernelParameters) -> float:
    """Energy [J] in a contact of one bearing at an indentation [m]."""
    return contact_energy(p.bearing[b, L.CONTACT : L.CONTACT_END], delta) if delta > 0.0 else 0.0


@lean_kernel
def spring_energy(b: int, y: Array, p: KernelParameters) -> float:
    """Energy [J] in the springs of one support."""
    h, row = p.bearing_at[b, L.SUPPORT], p.bearing[b]
    energy: float = (
        0.5 * row[L.SUPPORT_STIFFNESS_X] * y[h] ** 2 + 0.5 * row[L.SUPPORT_STIFFNESS_Y] * y[h + 1] ** 2
    )
    return energy


@lean_kernel
def rub_energy(y: Array, p: KernelParameters) -> float:
    """Energy [J] in the contacts of the rotor with its housing."""
    energy = 0.0
    for i in range(p.rub.shape[0]):
        delta = rub_values(i, y, p)[0]
        if delta > 0.0:
            energy += contact_energy(p.rub[i, touch.LAW : touch.N_ENTRIES], delta)
    return energy


@lean_kernel
def axial_energy(y: Array, p: KernelParameters) -> float:
    """Energy [J] of axial motion, of the rotor and of the races that it lands on, and in their faces."""
    at = p.rotor_at[L.AXIAL]
    if at < 0:
        return 0.0
    energy: float = 0.5 * p.spin[L.ROTOR_MASS] * y[at + 1] ** 2
    for b in p.faces:
        own = p.bearing_at[b, L.FACE_STATES]
        energy += 0.5 * p.bearing[b, L.RACE_MASS] * y[own + 1] ** 2
        energy += face.face_energy(p.bearing[b, L.FACE : L.FACE_END], y[at] - y[own])
    return energy


@lean_kernel
def coil_energy(y: Array, p: KernelParameters) -> float:
    """Energy [J] in the fields of magnets in the loop."""
    energy = 0.0
    if p.flags[L.LOOPS_ACT] == 0:
        return energy
    for a in range(p.magnet.shape[0]):
        for axis in range(2):
            own = p.magnet_at[a, L.MAGNET_OWN] + 2 * axis
            x, _v = plane_motion(p.magnet_shape[a], axis, y, p)
            energy += magnet.field_energy(p.magnet[a, L.LOOP : L.LOOP_END], x, y[own], y[own + 1])
    return energy


@kernel
def magnet_forces(states: Array, p: KernelParameters) -> Array:
    """Force of every magnet in the loop [N], shape (T, A, 2), from states (T, n)."""
    out = np.zeros((states.shape[0], p.magnet.shape[0], 2))
    for a in range(p.magnet.shape[0]):
        kappa, gap = p.magnet[a, L.LOOP + magnet.FORCE], p.magnet[a, L.LOOP + magnet.GAP]
        for axis in range(2):
            own = p.magnet_at[a, L.MAGNET_OWN] + 2 * axis
            for i in range(states.shape[0]):
                x, _v = plane_motion(p.magnet_shape[a], axis, states[i], p)
                out[i, a, axis] = magnet.magnet_force(kappa, gap, x, states[i, own], states[i, own + 1])[0]
    return out


@lean_kernel
def stored_energy(t: float, y: Array, p: KernelParameters, with_rotor_spin: bool) -> float:
    """Energy [J] of a state: motion, bending, contacts, balls, supports, gravity and spin."""
    n_q = p.rotor_at[L.N_COORDINATES]
    qx, qy, sx, sy = modal_parts(y, p)
    energy = 0.0
    for k in range(p.eigenvalue.shape[0]):
        energy += 0.5 * (sx[k] ** 2 + sy[k] ** 2)
        energy += 0.5 * p.eigenvalue[k] * (qx[k] ** 2 + qy[k] ** 2) - p.gravity[k] * qy[k]
    for b in range(p.bearing.shape[0]):
        row = p.bearing[b]
        r, h = p.bearing_at[b, L.RACE], p.bearing_at[b, L.SUPPORT]
        for c in range(p.bearing_at[b, L.CONTACTS], p.bearing_at[b, L.CONTACTS_END]):
            energy += touch_energy(b, depth_now(t, c, b, y, p), p)
        if r >= 0:
            energy += ball_energy(b, y, p)
            energy += row[L.RACE_WEIGHT] * y[r + 1]
            energy += 0.5 * row[L.RACE_MASS] * (y[n_q + r] ** 2 + y[n_q + r + 1] ** 2)
        energy += (
            0.5 * row[L.SUPPORT_MASS_X] * y[n_q + h] ** 2 + 0.5 * row[L.SUPPORT_MASS_Y] * y[n_q + h + 1] ** 2
        )
        energy += spring_energy(b, y, p)
        if row[L.SUPPORT_FORM + support.PRESENT] != 0.0:
            energy += support_form_energy(b, y, p)
        energy += 0.5 * row[L.RACE_INERTIA] * y[p.bearing_at[b, L.RACE_SPIN]] ** 2
    if OPTIONAL_PARTS:
        energy += rub_energy(y, p) + axial_energy(y, p) + coil_energy(y, p)
    if with_rotor_spin:
        energy += 0.5 * p.spin[L.POLAR_INERTIA] * y[p.rotor_at[L.ROTOR_SPEED]] ** 2
    return energy


@kernel
def stored_energies(
    times: Array, states: Array, p: KernelParameters, with_rotor_spin: bool, out: Array
) -> None:
    """Fill ``out`` (T,) with the energy [J] of each of the ``states`` (T, n) at ``times`` (T,) [s]."""
    for i in range(states.shape[0]):
        out[i] = stored_energy(times[i], states[i], p, with_rotor_spin)
