"""Forward filter and backward smoother of a drop: states, unknown parameters and sensor errors in one estimate.

The vector estimated is ``[dynamic state (s), parameters (P), sensor gains (C), offsets (C), 1X runout cosine and
sine (C, C)]``. The forward pass
is an extended Kalman filter with analytic sensitivities of the drop model; given a reference trajectory (the smoothed
one of an earlier pass) it linearises there, so that repeated passes are a Gauss–Newton solution of the whole problem.
The backward pass is the modified Bryson–Frazier smoother: it needs no inverse of a covariance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotordrop.model import layout as L
from rotordrop.model.layout import KernelParameters
from rotordrop.physics._compile import kernel
from rotordrop.simulation._loop import contact_at
from rotordrop.simulation._rhs import drop_derivative
from rotordrop.simulation._sensitivity import drop_jacobian

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

# What a parameter acts on.
ON_BEARING = 0
ON_SPIN = 1
ON_MAGNET = 2
ON_UNBALANCE = 3
SCALE_BEARING = 4


class ParameterTargets(NamedTuple):
    """Which kernel entries the unknown parameters set; R targets, P parameters, U unbalance planes.

    ``target`` (R, 4): parameter, kind, row, column; ``factor`` (R,) [1]; ``logarithmic`` (P,) flags; ``step`` (P,) of the
    finite difference by which the right-hand side is differentiated; ``drift`` (P,) standard deviation of the random walk
    of each parameter per square root of a second, ``late_drift`` the same later in a drop; ``plane_shape`` (U, m) mode shapes of the planes.
    """

    target: IntArray
    factor: Array
    logarithmic: IntArray
    step: Array
    drift: Array
    late_drift: Array
    plane_shape: Array


class FilterSettings(NamedTuple):
    """Numbers of one pass: sample distance [s], integration steps per sample, impulse noise [N s] and its share.

    ``impulse`` is the standard deviation of an unknown impulse per sample at each bearing and axis, ``share`` the same
    as a fraction of the contact impulse, ``spin_noise`` that of the race spins per sample [rad/s], ``speed_noise`` that
    of the rotor speed [rad/s]. After ``learning_end`` [s] the late drift of the parameters holds.
    """

    dt: float
    substeps: int
    impulse: float
    share: float
    spin_noise: float
    speed_noise: float
    learning_end: float


@kernel
def apply_parameters(theta: Array, targets: ParameterTargets, p: KernelParameters) -> None:
    """Write parameter values into the kernel arrays (which must be private copies)."""
    cleared = False
    for i in range(targets.target.shape[0]):
        k = targets.target[i, 0]
        kind = targets.target[i, 1]
        row = targets.target[i, 2]
        column = targets.target[i, 3]
        value = theta[k]
        if targets.logarithmic[k] != 0:
            value = math.exp(value)
        value *= targets.factor[i]
        if kind == ON_BEARING:
            p.bearing[row, column] = value
            if column == L.AIR_GAP:
                p.bearing[row, L.ROTOR_RADIUS] = p.bearing[row, L.BORE_RADIUS] - value
        elif kind == SCALE_BEARING:
            p.bearing[row, column] *= value
        elif kind == ON_SPIN:
            p.spin[column] = value
        elif kind == ON_MAGNET:
            p.magnet[row, column] = value
        else:
            if not cleared:
                p.unbalance_cos[:] = 0.0
                p.unbalance_sin[:] = 0.0
                cleared = True
            for j in range(p.unbalance_cos.shape[0]):
                if column == 0:
                    p.unbalance_cos[j] += value * targets.plane_shape[row, j]
                else:
                    p.unbalance_sin[j] += value * targets.plane_shape[row, j]


@kernel
def parameter_jacobian(
    t: float,
    y: Array,
    theta: Array,
    targets: ParameterTargets,
    p: KernelParameters,
    base: Array,
    other: Array,
    work: Array,
    B: Array,
) -> None:
    """Derivative of the right-hand side by the parameters, shape (s, P), by one-sided differences."""
    drop_derivative(t, y, p, base, work)
    s = B.shape[0]
    for k in range(theta.shape[0]):
        value = theta[k]
        theta[k] = value + targets.step[k]
        apply_parameters(theta, targets, p)
        drop_derivative(t, y, p, other, work)
        theta[k] = value
        for i in range(s):
            B[i, k] = (other[i] - base[i]) / targets.step[k]
    apply_parameters(theta, targets, p)


@kernel
def sparse_product(J: Array, V: Array, out: Array) -> None:
    """Product of a mostly empty square matrix with a full one; rows of ``V`` are contiguous."""
    n = J.shape[0]
    c = V.shape[1]
    for i in range(n):
        for j in range(c):
            out[i, j] = 0.0
        for k in range(n):
            value = J[i, k]
            if value != 0.0:
                for j in range(c):
                    out[i, j] += value * V[k, j]


@kernel
def rk4_step(t: float, h: float, y: Array, p: KernelParameters, k: Array, trial: Array, work: Array) -> None:
    """One classical Runge–Kutta step in place; ``k`` (5, n) and ``trial`` (n,) are scratch, ``k[4]`` the midpoint state."""
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
    """Advance a state by one sample in place and fill its sensitivity ``F`` (s, s + P) to state and parameters.

    ``impulses`` (B,) receives the contact impulse of each bearing over the sample [N s].
    """
    n = y.shape[0]
    s, columns = F.shape
    J = np.empty((s, s))
    B = np.empty((s, columns - s))
    first = np.empty((s, columns))
    second = np.empty((s, columns))
    third = np.empty((s, columns))
    k = np.empty((5, n))
    trial = np.empty(n)
    work = np.empty((2, p.ball_cos.shape[1]))
    contact = np.empty(6)
    h = settings.dt / settings.substeps
    F[:, :] = 0.0
    for i in range(s):
        F[i, i] = 1.0
    impulses[:] = 0.0
    for step in range(settings.substeps):
        now = t + step * h
        rk4_step(now, h, y, p, k, trial, work)
        middle = k[4].copy()
        drop_jacobian(now + 0.5 * h, middle, p, J)
        if columns > s:
            parameter_jacobian(now + 0.5 * h, middle, theta, targets, p, k[0], k[1], work, B)
        for b in range(p.bearing.shape[0]):
            contact_at(b, middle, p, contact)
            impulses[b] += h * contact[1]
        # F <- exp(hJ) F + what the parameters add, to third order: the second order would let light modes grow
        sparse_product(J, F, first)
        for i in range(s):
            for j in range(columns - s):
                first[i, s + j] += B[i, j]
        sparse_product(J, first, second)
        sparse_product(J, second, third)
        for i in range(s):
            for j in range(columns):
                F[i, j] += h * (first[i, j] + h * (0.5 * second[i, j] + h / 6.0 * third[i, j]))


@kernel
def add_process_noise(
    P: Array, p: KernelParameters, settings: FilterSettings, impulses: Array, drift: Array
) -> None:
    """Add unknown impulses between rotor and race, noise of the spins and drift of the parameters to a covariance."""
    m = p.eigenvalue.shape[0]
    n_b = p.bearing.shape[0]
    n_q = 2 * m + 4 * n_b
    g = np.empty(m + 1)
    place = np.empty(m + 1, dtype=np.int64)
    for b in range(n_b):
        sigma = settings.impulse + settings.share * impulses[b]
        for axis in range(2):
            for k in range(m):
                g[k] = -p.bearing_shape[b, k]
                place[k] = n_q + axis * m + k
            g[m] = 1.0 / p.bearing[b, L.RACE_MASS]
            place[m] = n_q + 2 * m + 2 * b + axis
            for i in range(m + 1):
                for j in range(m + 1):
                    P[place[i], place[j]] += sigma * sigma * g[i] * g[j]
        spin = settings.spin_noise + sigma * p.bearing[b, L.BORE_RADIUS] / p.bearing[b, L.RACE_INERTIA] * 0.1
        P[2 * n_q + b, 2 * n_q + b] += spin * spin
    P[2 * n_q + n_b, 2 * n_q + n_b] += settings.speed_noise * settings.speed_noise
    s = 2 * n_q + n_b + 2
    for k in range(drift.shape[0]):
        P[s + k, s + k] += drift[k] * drift[k] * settings.dt


@kernel
def scalar_update(mean: Array, P: Array, row: Array, innovation: float, variance: float, gain: Array) -> float:
    """Update mean and covariance in place with one scalar measurement; returns the innovation's variance.

    ``row`` (n,) is the measurement's derivative by the estimate, ``gain`` (n,) receives the Kalman gain.
    """
    n = mean.shape[0]
    for i in range(n):
        gain[i] = 0.0
    for j in range(n):
        value = row[j]
        if value != 0.0:
            for i in range(n):
                gain[i] += P[j, i] * value
    S = variance
    for j in range(n):
        S += row[j] * gain[j]
    for i in range(n):
        scaled = gain[i] / S
        for j in range(n):
            P[i, j] -= scaled * gain[j]
    for i in range(n):
        gain[i] /= S
        mean[i] += gain[i] * innovation
    return S


@kernel
def measurement_row(
    c: int, at: Array, sensor_row: Array, s: int, n_p: int, n_c: int, row: Array
) -> float:
    """Reading of sensor ``c`` predicted at an estimate [m] and its derivative ``row`` (n,).

    The reading is ``(1 + gain error) · (sensor row · state) + offset + runout at the rotor angle``.
    """
    row[:] = 0.0
    k = s + n_p + c
    cosine = math.cos(at[s - 1])
    sine = math.sin(at[s - 1])
    seen = 0.0
    for j in range(sensor_row.shape[0]):
        seen += sensor_row[j] * at[j]
    growth = 1.0 + at[k]
    for j in range(sensor_row.shape[0]):
        row[j] = growth * sensor_row[j]
    row[k] = seen
    row[k + n_c] = 1.0
    row[k + 2 * n_c] = cosine
    row[k + 3 * n_c] = sine
    return growth * seen + at[k + n_c] + at[k + 2 * n_c] * cosine + at[k + 3 * n_c] * sine


@kernel
def symmetrise(P: Array) -> None:
    """Replace a matrix by its symmetric part in place."""
    for i in range(P.shape[0]):
        for j in range(i):
            value = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = value
            P[j, i] = value


@kernel
def forward_pass(
    mean_0: Array,
    P_0: Array,
    times: Array,
    readings: Array,
    speed: Array,
    sensor_rows: Array,
    variances: Array,
    speed_variance: float,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    reference: Array,
    means: Array,
    covariances: Array,
    transitions: Array,
    rows: Array,
    gains: Array,
    innovations: Array,
    innovation_variances: Array,
) -> int:
    """Extended Kalman filter over the samples of one drop; N samples, n estimated, s dynamic, C channels.

    Parameters
    ----------
    mean_0, P_0 : ndarray, shapes (n,), (n, n)
        Estimate before the first sample.
    times, readings, speed : ndarray, shapes (N,), (N, C), (N,)
        Time from power-off [s], readings with polarity removed [m] (NaN is left out), rotor speed [rad/s] (NaN too).
    sensor_rows : ndarray, shape (C, s)
        Displacement along each sensor's direction from the dynamic state.
    variances, speed_variance : ndarray (C,), float
        Noise variance of the readings [m²] and of the speed [rad²/s²].
    reference : ndarray, shape (M, n)
        Trajectory to linearise at for the first M samples; the filter's own mean afterwards.
    means, covariances : ndarray, shapes (N, n), (N, n, n) or (N, 0, 0)
        Filled with the filtered estimate; covariances only when there is room.
    transitions : ndarray, shape (N, s, s + P) or (0, ...)
        Filled with the sensitivity from the sample before.
    rows, gains : ndarray, shape (N, C + 1, n) or (0, ...)
        Filled with measurement rows and gains, in the order used.
    innovations, innovation_variances : ndarray, shape (N, C + 1)
        Filled; NaN where a reading was left out.

    Returns
    -------
    int
        Number of samples done; fewer than N when a value became infinite.
    """
    n = mean_0.shape[0]
    n_c, s = sensor_rows.shape
    n_p = n - s - 4 * n_c
    full = s + 4 - 2
    i_w = s - 2
    mean = mean_0.copy()
    P = P_0.copy()
    y = np.zeros(full)
    F = np.zeros((s, s + n_p))
    impulses = np.zeros(p.bearing.shape[0])
    row = np.empty(n)
    gain = np.empty(n)
    theta = mean[s : s + n_p].copy()
    keep = transitions.shape[0] > 0
    for i in range(times.shape[0]):
        if i > 0:
            at = mean
            with_reference = i - 1 < reference.shape[0]
            if with_reference:
                at = reference[i - 1]
            theta[:] = at[s : s + n_p]
            apply_parameters(theta, targets, p)
            y[:] = 0.0
            y[:s] = at[:s]
            propagate(times[i - 1], y, theta, targets, p, settings, F, impulses)
            if with_reference:
                deviation = mean[: s + n_p] - at[: s + n_p]
                mean[:s] = y[:s] + np.dot(F, deviation)
            else:
                mean[:s] = y[:s]
            head = np.dot(F, np.ascontiguousarray(P[: s + n_p]))
            P[:s] = head
            P[:s, :s] = np.dot(np.ascontiguousarray(head[:, : s + n_p]), F.T)
            P[s:, :s] = head[:, s:].T
            drift = targets.late_drift if times[i] > settings.learning_end else targets.drift
            add_process_noise(P, p, settings, impulses, drift)
            if keep:
                transitions[i] = F
        for c in range(n_c + 1):
            value = speed[i] if c == n_c else readings[i, c]
            innovations[i, c] = np.nan
            innovation_variances[i, c] = np.nan
            if not math.isfinite(value):
                if keep:
                    rows[i, c] = 0.0
                    gains[i, c] = 0.0
                continue
            if c < n_c:
                variance = variances[c]
                if i < reference.shape[0]:
                    predicted = measurement_row(c, reference[i], sensor_rows[c], s, n_p, n_c, row)
                    for j in range(n):
                        predicted += row[j] * (mean[j] - reference[i, j])
                else:
                    predicted = measurement_row(c, mean, sensor_rows[c], s, n_p, n_c, row)
            else:
                variance = speed_variance
                row[:] = 0.0
                row[i_w] = 1.0
                predicted = mean[i_w]
            innovations[i, c] = value - predicted
            innovation_variances[i, c] = scalar_update(mean, P, row, value - predicted, variance, gain)
            if keep:
                rows[i, c] = row
                gains[i, c] = gain
        symmetrise(P)
        means[i] = mean
        if covariances.shape[1] > 0:
            covariances[i] = P
        if not math.isfinite(mean[0]) or not math.isfinite(P[0, 0]):
            return i
    return times.shape[0]


@kernel
def backward_pass(
    means: Array,
    covariances: Array,
    transitions: Array,
    rows: Array,
    gains: Array,
    innovations: Array,
    innovation_variances: Array,
    smoothed: Array,
    information: Array,
    final_score: Array,
    final_information: Array,
) -> None:
    """Modified Bryson–Frazier smoother; arrays as filled by `forward_pass`.

    Parameters
    ----------
    smoothed : ndarray, shape (N, n)
        Filled with the smoothed estimate.
    information : ndarray, shape (N, n, n)
        Filled with Λ of each sample: the smoothed covariance is ``P − P Λ P`` with the filtered ``P``.
    final_score, final_information : ndarray, shapes (n,), (n, n)
        λ and Λ that later records put on the last sample (zero for a single record); overwritten by their values
        *before* the first measurement, to be handed to an earlier record.
    """
    n_t, n = means.shape
    s = transitions.shape[1]
    columns = transitions.shape[2]
    lam = final_score
    Lam = final_information
    for i in range(n_t - 1, -1, -1):
        information[i] = Lam
        smoothed[i] = means[i] - np.dot(covariances[i], lam)
        for c in range(rows.shape[1] - 1, -1, -1):
            S = innovation_variances[i, c]
            if not math.isfinite(S):
                continue
            row = rows[i, c]
            gain = gains[i, c]
            # (I - K h)ᵀ Λ (I - K h) + hᵀ h / S
            lk = np.dot(Lam, gain)
            klk = np.dot(gain, lk)
            score = np.dot(gain, lam)
            weight = klk + 1.0 / S
            for a in range(n):
                if row[a] != 0.0:
                    for b in range(n):
                        Lam[a, b] += row[a] * (weight * row[b] - lk[b])
            for b in range(n):
                if row[b] != 0.0:
                    for a in range(n):
                        Lam[a, b] -= lk[a] * row[b]
            for a in range(n):
                lam[a] -= row[a] * (score + innovations[i, c] / S)
        if i > 0:
            F = transitions[i]
            top = np.ascontiguousarray(Lam[:s])
            tail = np.dot(F.T, top)
            body = np.dot(np.ascontiguousarray(tail[:, :s]), F)
            old = lam.copy()
            lam[:columns] = np.dot(F.T, old[:s])
            lam[s:columns] += old[s:columns]
            lower = Lam[s:, s:].copy()
            cross = tail[:, s:].copy()
            Lam[:, :] = 0.0
            Lam[s:, s:] = lower
            Lam[:columns, :columns] += body
            Lam[:columns, s:] += cross
            Lam[s:, :columns] += cross.T
        symmetrise(Lam)
