"""One step of the drop model with its sensitivity to state and parameters, and the noise added to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array, Integers
from rotordrop.physics import columns as L
from rotordrop.physics._compile import by_reference, kernel, lean_kernel
from rotordrop.physics.aerodynamics import PRESCRIBED_SPEED
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import exp, power
from rotordrop.simulate._loop import contact_at
from rotordrop.simulate._rhs import (
    Scratch,
    add_rotor_rates,
    bearing_accelerations,
    drop_derivative,
    scratch_of,
)
from rotordrop.simulate._sensitivity import drop_jacobian_parts
from rotordrop.track._arrays import copy_into, copy_rows, fill, fill_rows

Flags = NDArray[np.bool_]

(
    ON_BEARING,
    ON_SPIN,
    ON_MAGNET,
    ON_UNBALANCE,
    SCALE_BEARING,
    AT_TYPICAL_DEPTH,
    SCALE_MODES,
    ON_LOAD,
) = range(8)
"""What a parameter acts on."""


@by_reference
class ParameterTargets(NamedTuple):
    """Which kernel entries the unknown parameters set; R targets, P parameters, U unbalance planes.

    ``target`` (R, 4): parameter, kind, row, column; ``factor`` (R,) [1] and ``shift`` (R,), what is added;
    ``logarithmic`` (P,) flags;
    ``step`` (P,) of the finite difference by which the right-hand side is differentiated; ``drift`` (P,)
    standard deviation of the random walk of each parameter per square root of a second, ``late_drift`` the
    same later in a drop; ``plane_shape`` (U, m) mode shapes of the planes. Beyond ``lower`` and ``upper``
    (P,) the model takes the bound: what drifts without being seen must not make it unstable. ``mean`` (P,)
    is the prior mean. ``eigenvalue`` and ``damping`` (m,) are those of the rotor as described. ``acts``
    (P, B + 1) flags the bearings on whose forces a parameter acts, and in the last column whether it acts on
    the rotor's own. ``together`` lists for each parameter, from ``starts`` (P + 1,) on, the targets that
    write where it writes, in their order: what has to be written again when it alone changes.
    """

    target: Integers
    acts: Flags
    together: Integers
    starts: Integers
    factor: Array
    shift: Array
    logarithmic: Integers
    step: Array
    drift: Array
    late_drift: Array
    plane_shape: Array
    lower: Array
    upper: Array
    mean: Array
    eigenvalue: Array
    damping: Array


@by_reference
class FilterSettings(NamedTuple):
    """Numbers of one pass: sample distance [s], steps per sample, impulse noise [N s] and its share.

    ``substeps`` is a multiple of ``frozen``, the number of steps over which the Jacobian is held; of its
    exponential 3 or 4 ``terms`` are taken then.
    ``impulse`` is the standard deviation of an unknown impulse per sample at each bearing and axis,
    ``share`` the same as a fraction of the contact impulse, ``spin_noise`` that of the race spins per
    sample [rad/s], ``speed_noise`` that of the rotor speed [rad/s]. After ``learning_end`` [s] the late
    drift of the parameters holds.
    """

    dt: float
    substeps: int
    frozen: int
    terms: int
    impulse: float
    share: float
    spin_noise: float
    speed_noise: float
    learning_end: float


@kernel
def apply_parameters(theta: Array, targets: ParameterTargets, p: KernelParameters) -> None:
    """Write parameter values into the kernel arrays (which must be private copies)."""
    values = target_values(theta, targets, 0.0)
    write_targets(np.arange(values.shape[0]), -1, values, values, targets, p)


@kernel
def target_values(theta: Array, targets: ParameterTargets, steps: float) -> Array:
    """What the targets are set to or multiplied by (R,), with every parameter some steps on."""
    values = np.empty(targets.target.shape[0])
    for i in range(values.shape[0]):
        k = targets.target[i, 0]
        value = bounded_value(k, theta[k], targets, steps * targets.step[k])
        if targets.target[i, 1] == AT_TYPICAL_DEPTH:
            values[i] = power(targets.factor[i], exp(targets.mean[k]) - value)
        else:
            values[i] = value * targets.factor[i] + targets.shift[i]
    return values


@lean_kernel
def bounded_value(k: int, theta: float, targets: ParameterTargets, step: float) -> float:
    """Parameter ``k`` as the model takes it: within its bounds, then a step on, and no longer a logarithm."""
    # The step comes after the bounds: at its bound a parameter keeps a slope and can be led back.
    within = min(max(theta, targets.lower[k]), targets.upper[k]) + step
    return exp(within) if targets.logarithmic[k] != 0 else within


@lean_kernel
def write_targets(
    which: Integers, k: int, moved: Array, values: Array, targets: ParameterTargets, p: KernelParameters
) -> None:
    """Write some of the targets into the kernel arrays: those of ``k`` as ``moved`` (R,), else ``values``."""
    cleared = False
    for i in which:
        kind, row, column = targets.target[i, 1], targets.target[i, 2], targets.target[i, 3]
        value = moved[i] if targets.target[i, 0] == k else values[i]
        if kind == ON_BEARING:
            p.bearing[row, column] = value
            if column == L.AIR_GAP:
                p.bearing[row, L.ROTOR_RADIUS] = p.bearing[row, L.BORE_RADIUS] - value
        elif kind in (SCALE_BEARING, AT_TYPICAL_DEPTH):
            p.bearing[row, column] *= value
        elif kind == ON_SPIN:
            p.spin[column] = value
        elif kind == ON_MAGNET:
            p.magnet[row, column] = value
        elif kind == ON_LOAD:
            p.load[row, column] = value
        elif kind == SCALE_MODES:
            for j in range(p.eigenvalue.shape[0]):
                if column == 0:
                    p.eigenvalue[j] = value * targets.eigenvalue[j]
                else:
                    p.damping[j] = value * targets.damping[j]
        else:
            if not cleared:
                fill(p.unbalance_cos, 0.0)
                fill(p.unbalance_sin, 0.0)
                cleared = True
            add_row(value, targets.plane_shape[row], p.unbalance_cos if column == 0 else p.unbalance_sin)


@lean_kernel
def rates_by_owner(
    t: float, owner: int, y: Array, p: KernelParameters, torque: float, out: Array, work: Scratch
) -> float:
    """The part of the right-hand side that one bearing gives, or the rotor's own behind the last, in ``out``.

    ``torque`` [N m] is what the bearings drive the rotor with. Returns the torque that this bearing gives.
    """
    fill(out, 0.0)
    if owner == p.bearing.shape[0]:
        add_rotor_rates(t, y, torque, 0.0, p, out)
        return 0.0
    driven, _losses = bearing_accelerations(t, owner, y, p, out, work)
    return driven


@kernel
def parameter_jacobian(
    t: float,
    y: Array,
    theta: Array,
    targets: ParameterTargets,
    p: KernelParameters,
    work: Scratch,
    B: Array,
) -> None:
    """Derivative of the right-hand side by the parameters, shape (s, P), by one-sided differences.

    A parameter of a bearing changes the forces at this bearing alone; the rest is not computed again. The
    effect of its torque on the ω̇ terms of eq. (1) is left out, as in the derivative by the state.
    """
    s, n_b, i_w = B.shape[0], p.bearing.shape[0], p.rotor_at[L.ROTOR_SPEED]
    free = p.flags[L.SPIN_MODE] != PRESCRIBED_SPEED
    base, other = np.empty((n_b + 1, y.shape[0])), np.empty(y.shape[0])
    torques, torque = np.empty(n_b), 0.0
    for b in range(n_b):
        torques[b] = rates_by_owner(t, b, y, p, 0.0, base[b], work)
        torque += torques[b]
    rates_by_owner(t, n_b, y, p, torque, base[n_b], work)
    values, moved = target_values(theta, targets, 0.0), target_values(theta, targets, 1.0)
    fill_rows(B, 0.0)
    for k in range(theta.shape[0]):
        step, which = targets.step[k], targets.together[targets.starts[k] : targets.starts[k + 1]]
        write_targets(which, k, moved, values, targets, p)
        for owner in range(n_b + 1):
            if not targets.acts[k, owner]:
                continue
            driven = rates_by_owner(t, owner, y, p, torque, other, work)
            for i in range(s):
                B[i, k] += (other[i] - base[owner, i]) / step
            if free and owner < n_b:
                B[i_w, k] += (driven - torques[owner]) / (step * p.spin[L.POLAR_INERTIA])
        write_targets(which, -1, moved, values, targets, p)
    for i in range(targets.target.shape[0]):
        if targets.target[i, 1] == ON_SPIN and targets.target[i, 3] == L.CLOCK_ERROR:
            # a slow clock stretches the step: every rate acts for longer
            for owner in range(n_b + 1):
                add_row(1.0 / (1.0 + p.spin[L.CLOCK_ERROR]), base[owner, :s], B[:, targets.target[i, 0]])


@lean_kernel
def gather_entries(J: Array, entries: Array, columns: Integers, starts: Integers) -> None:
    """List the entries of a mostly empty square matrix row by row, for fast products."""
    n = J.shape[0]
    count = 0
    for i in range(n):
        starts[i] = count
        for k in range(n):
            if J[i, k] != 0.0:
                entries[count] = J[i, k]
                columns[count] = k
                count += 1
    starts[n] = count


@lean_kernel
def sparse_product(entries: Array, columns: Integers, starts: Integers, V: Array, out: Array) -> None:
    """Product of a listed matrix (see `gather_entries`) with a full one; rows of ``V`` are contiguous."""
    c = V.shape[1]
    for i in range(starts.shape[0] - 1):
        for j in range(c):
            out[i, j] = 0.0
        e, end = starts[i], starts[i + 1]
        # Four entries in one go, summed in their order: ``out`` is fetched and stored a quarter as often.
        while e + 3 < end:
            a, b, g, h = entries[e], entries[e + 1], entries[e + 2], entries[e + 3]
            k, m, n, o = columns[e], columns[e + 1], columns[e + 2], columns[e + 3]
            for j in range(c):
                out[i, j] = (((out[i, j] + a * V[k, j]) + b * V[m, j]) + g * V[n, j]) + h * V[o, j]
            e += 4
        while e < end:
            add_row(entries[e], V[columns[e]], out[i])
            e += 1


@lean_kernel
def add_contact_product(c: int, g: Array, p: KernelParameters, V: Array, moved: Array, out: Array) -> None:
    """Add to ``out`` the product of one contact's part of the Jacobian with ``V``, both (s, columns).

    A contact couples all modes, but only through the six motions it sees and the three forces it gives:
    in two steps it takes a fraction of the operations of the full rows. ``moved`` (7, columns) is scratch.
    """
    n_q, i_w = p.rotor_at[L.N_COORDINATES], p.rotor_at[L.ROTOR_SPEED]
    b, r, spin = (
        p.contact_at[c, L.CONTACT_BEARING],
        p.contact_at[c, L.CONTACT_BODY],
        p.contact_at[c, L.CONTACT_SPIN],
    )
    shape = p.bearing_shape[b]
    row = p.bearing[b]
    columns = V.shape[1]
    for part in range(4):
        base = (part // 2) * n_q
        axis = part % 2
        modes = base + p.rotor_at[L.MODES_X + axis]
        for j in range(columns):
            moved[part, j] = -V[base + r + axis, j]
        for k in range(shape.shape[0]):
            weight = shape[k]
            source = modes + k
            for j in range(columns):
                moved[part, j] += weight * V[source, j]
    for force in range(3):
        for j in range(columns):
            moved[4 + force, j] = g[force, 4] * V[i_w, j] + g[force, 5] * V[spin, j]
        for part in range(4):
            weight = g[force, part]
            for j in range(columns):
                moved[4 + force, j] += weight * moved[part, j]
        if g[force, 6] != 0.0:
            add_row(g[force, 6], V[p.rotor_at[L.ROTOR_ANGLE]], moved[4 + force])
    for axis in range(2):
        add_row(1.0 / row[L.RACE_MASS], moved[4 + axis], out[n_q + r + axis])
        modes = n_q + p.rotor_at[L.MODES_X + axis]
        for k in range(shape.shape[0]):
            add_row(-shape[k], moved[4 + axis], out[modes + k])
    add_row(row[L.BORE_RADIUS] / row[L.RACE_INERTIA], moved[6], out[spin])
    if p.flags[L.SPIN_MODE] != PRESCRIBED_SPEED:
        add_row(-row[L.ROTOR_RADIUS] / p.spin[L.POLAR_INERTIA], moved[6], out[i_w])


@lean_kernel
def add_row(weight: float, source: Array, target: Array) -> None:
    """Add a weighted row to another."""
    for j in range(source.shape[0]):
        target[j] += weight * source[j]


@lean_kernel
def rk4_step(
    t: float, h: float, y: Array, p: KernelParameters, k: Array, trial: Array, work: Scratch
) -> None:
    """One classical Runge–Kutta step in place; ``k`` (5, n) and ``trial`` (n,) are scratch."""
    n = y.shape[0]
    drop_derivative(t, y, p, k[0], work)
    for i in range(n):
        trial[i] = y[i] + 0.5 * h * k[0, i]
    drop_derivative(t + 0.5 * h, trial, p, k[1], work)
    for i in range(n):
        k[4, i] = y[i] + 0.5 * h * k[1, i]
    drop_derivative(t + 0.5 * h, k[4], p, k[2], work)
    for i in range(n):
        trial[i] = y[i] + h * k[2, i]
    drop_derivative(t + h, trial, p, k[3], work)
    for i in range(n):
        y[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])


@kernel
def propagate(
    t: float,
    y: Array,
    theta: Array,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    F: Array,
    impulses: Array,
) -> None:
    """Advance a state by one sample in place and fill its sensitivity ``F`` (s, s + P).

    ``impulses`` (B,) receives the contact impulse of each bearing over the sample [N s].
    """
    n = y.shape[0]
    s, columns = F.shape
    J = np.empty((s, s))
    B = np.empty((s, columns - s))
    V = np.empty((settings.terms, s, columns))  # terms of the exponential, from the first on
    entries = np.empty(s * s)
    places = np.empty(s * s, dtype=np.int64)
    starts = np.empty(s + 1, dtype=np.int64)
    k = np.zeros((5, n))  # what a sensor has got to stays: `lag_step` moves it
    trial = np.empty(n)
    work = scratch_of(p)
    contact = np.empty(6)
    g = np.zeros((p.contact_at.shape[0], 3, 7))
    touching = np.zeros(p.contact_at.shape[0], dtype=np.int64)
    moved = np.empty((7, columns))
    middle = np.empty(n)
    copy_into(y, middle)
    # What acts on the rotor alone does so evenly; in a contact position and gap must see the same, or the gap
    # looks too well known.
    once = True
    for i in range(targets.acts.shape[0]):
        for b in range(targets.acts.shape[1] - 1):
            once = once and not targets.acts[i, b]
    step = (1.0 + p.spin[L.CLOCK_ERROR]) * settings.dt / settings.substeps
    h = step * settings.frozen
    fill_rows(F, 0.0)
    for i in range(s):
        F[i, i] = 1.0
    fill(impulses, 0.0)
    for block in range(settings.substeps // settings.frozen):
        now = t + block * h
        # The Jacobian of the middle serves the block of steps to second order, though it changes within it.
        for part in range(settings.frozen):
            rk4_step(now + part * step, step, y, p, k, trial, work)
            if 2 * part + 1 == settings.frozen:
                copy_into(k[4], middle)
            elif 2 * (part + 1) == settings.frozen:
                copy_into(y, middle)
        drop_jacobian_parts(now + 0.5 * h, middle, p, J, g, touching, k[:2], work)
        gather_entries(J, entries, places, starts)
        if columns > s and (block == 0 or not once):
            parameter_jacobian(now + 0.5 * h, middle, theta, targets, p, work, B)
        # What the contact law gets wrong is a share of what it gives; process noise is scaled by the impulse.
        for c in range(p.contact_at.shape[0]):
            contact_at(now + 0.5 * h, c, middle, p, contact)
            impulses[p.contact_at[c, L.CONTACT_BEARING]] += h * contact[1]
        # F <- exp(hJ) F + what the parameters add, to third order at least: at second light modes would grow
        for e in range(settings.terms):
            source = F if e == 0 else V[e - 1]
            if block + e > 0:
                sparse_product(entries, places, starts, source, V[e])
            else:  # F is the identity yet
                copy_rows(J, V[0, :, :s])
                fill_rows(V[0, :, s:], 0.0)
            for c in range(touching.shape[0]):
                if touching[c] != 0:
                    add_contact_product(c, g[c], p, source, moved, V[e])
            for i in range(s if e == 0 else 0):
                add_row(1.0, B[i], V[0, i, s:])
        for i in range(s):
            if settings.terms > 3:
                add_row(0.25 * h, V[3, i], V[2, i])
            for j in range(columns):
                F[i, j] += h * (V[0, i, j] + h * (0.5 * V[1, i, j] + h / 6.0 * V[2, i, j]))


@lean_kernel
def unknown_impulses(settings: FilterSettings, impulses: Array, sigmas: Array) -> None:
    """Fill ``sigmas`` (B,) with the standard deviation of the unknown impulse at each bearing [N s].

    ``impulses`` (B,) are those of the contacts.
    """
    for b in range(sigmas.shape[0]):
        sigmas[b] = settings.impulse + settings.share * impulses[b]


@kernel
def unit_impulses(p: KernelParameters, settings: FilterSettings, sigmas: Array) -> tuple[Array, Integers]:
    """Velocities that unit impulses between rotor and race give, and where they stand, shape (2 B, m + 1).

    They are equal and opposite, in x and y of each bearing; modes have unit mass. Where the rotor does not
    touch the race, so that ``sigmas`` (B,) [N s] has no share of an impulse, they act on the rotor alone: a
    light race would be made to ring.
    """
    m, n_q, n_b = p.eigenvalue.shape[0], p.rotor_at[L.N_COORDINATES], p.bearing.shape[0]
    g, place = np.empty((2 * n_b, m + 1)), np.empty((2 * n_b, m + 1), dtype=np.int64)
    for r in range(2 * n_b):
        b, axis = r // 2, r % 2
        for k in range(m):
            g[r, k] = -p.bearing_shape[b, k]
            place[r, k] = n_q + p.rotor_at[L.MODES_X + axis] + k
        g[r, m] = 1.0 / p.bearing[b, L.RACE_MASS] if sigmas[b] > settings.impulse else 0.0
        place[r, m] = n_q + p.bearing_at[b, L.RACE] + axis
    return g, place


@kernel
def own_noise(n: int, p: KernelParameters, settings: FilterSettings, sigmas: Array, drift: Array) -> Array:
    """Variances (n,) of what enters one entry of the estimate alone: spins, rotor speed, parameters."""
    s, i_w, q = p.rotor_at[L.N_DYNAMIC], p.rotor_at[L.ROTOR_SPEED], np.zeros(n)
    for b in range(p.bearing.shape[0]):
        row = p.bearing[b]
        # friction passes on a tenth of an unknown impulse
        spin = settings.spin_noise + sigmas[b] * row[L.BORE_RADIUS] / row[L.RACE_INERTIA] * 0.1
        q[p.bearing_at[b, L.RACE_SPIN]] += spin * spin
    q[i_w] = settings.speed_noise * settings.speed_noise
    for k in range(drift.shape[0]):  # a random walk: its variance grows with time
        q[s + k] = drift[k] * drift[k] * settings.dt
    return q


@kernel
def add_process_noise(
    P: Array, p: KernelParameters, settings: FilterSettings, sigmas: Array, drift: Array
) -> None:
    """Add unknown impulses at the bearings, noise of the spins and drift of the parameters to ``P`` (n, n).

    ``sigmas`` (B,) are the standard deviations of the unknown impulses [N s].
    """
    # Process noise enters where the model errs: as an impulse between rotor and race. White noise on every
    # state would let the filter explain a record by motions that nothing can cause.
    g, place = unit_impulses(p, settings, sigmas)
    for r in range(g.shape[0]):
        sigma = sigmas[r // 2]
        for i in range(g.shape[1]):
            for j in range(g.shape[1]):
                P[place[r, i], place[r, j]] += sigma * sigma * g[r, i] * g[r, j]
    q = own_noise(P.shape[0], p, settings, sigmas, drift)
    for i in range(q.shape[0]):
        P[i, i] += q[i]


@kernel
def subtract_process_noise(
    score: Array,
    p: KernelParameters,
    settings: FilterSettings,
    sigmas: Array,
    drift: Array,
    out: Array,
) -> None:
    """Take off ``out`` (n,) the product of what `add_process_noise` adds with ``score`` (n,)."""
    g, place = unit_impulses(p, settings, sigmas)
    for r in range(g.shape[0]):
        sigma, along = sigmas[r // 2], 0.0
        for i in range(g.shape[1]):
            along += g[r, i] * score[place[r, i]]
        for i in range(g.shape[1]):
            out[place[r, i]] -= sigma * sigma * g[r, i] * along
    q = own_noise(out.shape[0], p, settings, sigmas, drift)
    for i in range(q.shape[0]):
        out[i] -= q[i] * score[i]
