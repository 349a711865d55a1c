"""Forward filter and backward smoother of a drop: state, parameters and sensor errors in one.

The vector estimated is ``[dynamic state (s), parameters (P), sensor gains (C), offsets (C), 1X runout
cosine and sine (C, C), slow noise (M)]``. The forward pass is an extended Kalman filter with analytic
sensitivities of the drop model; given a reference trajectory (the smoothed one of an earlier pass) it
linearises there, so that repeated passes are a Gauss–Newton solution of the whole problem. The backward pass
is the modified Bryson–Frazier smoother: it needs no inverse of a covariance.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array, Integers
from rotordrop.physics import columns as L
from rotordrop.physics._compile import kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.track._covariance import is_covariance, pack, symmetrise, unpack
from rotordrop.track._propagation import (
    FilterSettings,
    ParameterTargets,
    add_process_noise,
    apply_parameters,
    propagate,
    subtract_process_noise,
    unknown_impulses,
)
from rotordrop.track.sensor_form import SensorForm, lag_step, measurement_row, noise_step

Compact = NDArray[np.float32]


LARGEST_DEFLECTION = 4.0
"""Way of a race or a support from its place, over the air gap, from which a filter has diverged [1]."""
SIGN_WIDTH = math.sqrt(0.5 * math.pi)


@lean_kernel
def gain_beside(P: Array, row: Array, before: Array, count: int, gain: Array) -> None:
    """Fill ``gain`` (n,) with the covariance of the estimate and a reading of a row (n,).

    ``before`` (C, n) are what the ``count`` readings taken before will take off ``P`` (n, n), see `take_off`.
    """
    n = P.shape[0]
    gain[:] = 0.0
    for j in range(n):
        if row[j] != 0.0:
            for i in range(n):
                gain[i] += P[j, i] * row[j]
    for c in range(count):
        seen = 0.0
        for i in range(n):
            seen += before[c, i] * row[i]
        for i in range(n):
            gain[i] -= before[c, i] * seen


@lean_kernel
def take_off(P: Array, before: Array, count: int) -> None:
    """Take what readings tell off a covariance: ``a aᵀ`` of each, a row of ``before`` (C, n).

    All at once, for the matrix is fetched once then; a symmetric one stays so to the last bit.
    """
    n = P.shape[0]
    for i in range(n):
        for c in range(0, count - 1, 2):
            one, two = before[c, i], before[c + 1, i]
            for j in range(n):
                P[i, j] = (P[i, j] - one * before[c, j]) - two * before[c + 1, j]
        if count % 2 == 1:
            weight = before[count - 1, i]
            for j in range(n):
                P[i, j] -= weight * before[count - 1, j]


@lean_kernel
def soften_friction(P: Array, least: Array, p: KernelParameters) -> None:
    """Smooth the sign of friction by how well each race spin is known, never less than ``least`` (B,) [m/s].

    The spin of a race is not seen before it catches up with the rotor. A sign taken at the estimate has
    no slope there, and the filter cannot learn when that happens; the mean of the sign over a normal
    distribution of the slip is, to a few per cent, tanh(v / (1.25 σ)).
    """
    for b in range(least.shape[0]):
        spin = p.bearing_at[b, L.RACE_SPIN]
        spread = SIGN_WIDTH * p.bearing[b, L.BORE_RADIUS] * math.sqrt(max(P[spin, spin], 0.0))
        p.bearing[b, L.SMOOTHING_SPEED] = math.sqrt(least[b] * least[b] + spread * spread)


@kernel
def forward_pass(
    first: int,
    mean_0: Array,
    P: Array,
    times: Array,
    readings: Array,
    speed: Array,
    sensor_rows: Array,
    variances: Array,
    speed_variance: float,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    form: SensorForm,
    reference: Array,
    means: Array,
    covariances: Compact,
    transitions: Compact,
    rows: Array,
    gains: Array,
    impulse_sigmas: Array,
    innovations: Array,
    innovation_variances: Array,
) -> int:
    """Extended Kalman filter over the samples of one drop; N samples, n estimated, s dynamic, C channels.

    Parameters
    ----------
    first : int
        First sample to be done: 0, or 1 to go on from the filtered estimate of sample 0.
    mean_0, P : ndarray, shapes (n,), (n, n)
        Estimate to begin with; ``P`` is overwritten by that of the last sample.
    times, readings, speed : ndarray, shapes (N,), (N, C), (N,)
        Time from power-off [s], readings with polarity removed [m] (NaN is left out), rotor speed [rad/s]
        (NaN too).
    sensor_rows : ndarray, shape (C, s)
        Displacement along each sensor's direction from the dynamic state.
    variances, speed_variance : ndarray (C,), float
        Variance of the white noise of the readings [m²] and of the speed [rad²/s²].
    form : SensorForm
        What the sensors do beyond gain, offset and runout.
    reference : ndarray, shape (M, n)
        Trajectory to linearise at for the first M samples; the filter's own mean afterwards.
    means, covariances : ndarray, shapes (N, n), (N, n (n + 1) / 2) or (N, 0)
        Filled with the filtered estimate; covariances, as `pack` stores them, only when there is room.
    transitions : ndarray, shape (N, s, s + P) or (0, ...)
        Filled with the sensitivity from the sample before.
    rows, gains : ndarray, shape (N, C + 1, n) or (0, ...)
        Filled with measurement rows and gains, in the order used.
    impulse_sigmas : ndarray, shape (N, B) or (0, ...)
        Filled with the standard deviations of the unknown impulses from the sample before [N s].
    innovations, innovation_variances : ndarray, shape (N, C + 1)
        Filled; NaN where a reading was left out.

    Returns
    -------
    int
        Number of samples done; fewer than N when a value became infinite.
    """
    n = mean_0.shape[0]
    n_c, s = sensor_rows.shape
    n_p = n - s - 4 * n_c - form.noisy.shape[0]
    i_w, i_a = p.rotor_at[L.ROTOR_SPEED], p.rotor_at[L.ROTOR_ANGLE]
    mean = mean_0.copy()
    y = np.zeros(p.rotor_at[L.N_STATES])
    F = np.zeros((s, s + n_p))
    impulses = np.zeros(p.bearing.shape[0])
    sigmas = np.zeros(p.bearing.shape[0])
    row = np.empty(n)
    gain = np.empty(n)
    told = np.empty((n_c + 1, n))
    theta = mean[s : s + n_p].copy()
    moved = np.empty(s + n_p)
    keep = transitions.shape[0] > 0
    smoothing = p.bearing[:, L.SMOOTHING_SPEED].copy()
    if first > 0 and covariances.shape[1] > 0:
        pack(P, covariances[0])
    for i in range(first, times.shape[0]):
        if i > 0:
            at = mean
            with_reference = i - 1 < reference.shape[0]
            if with_reference:
                at = reference[i - 1]
            theta[:] = at[s : s + n_p]
            apply_parameters(theta, targets, p)
            soften_friction(P, smoothing, p)
            y[:] = 0.0
            y[:s] = at[:s]
            propagate(times[i - 1], y, theta, targets, p, settings, F, impulses)
            if form.lag.shape[0] > 0:
                moved[:s] = y[:s]
                moved[s:] = theta
                lag_step(at[: s + n_p], moved, form, settings.dt, F)
                y[:s] = moved[:s]
            # Around a reference the model is an affine map, the same for prediction and for smoothing, so the
            # passes are Gauss-Newton steps of one least-squares problem. The mean itself, propagated, would
            # be linearised elsewhere than the smoother's, and each pass would solve another problem.
            if with_reference:
                deviation = mean[: s + n_p] - at[: s + n_p]
                mean[:s] = y[:s] + np.dot(F, deviation)
            else:
                mean[:s] = y[:s]
            # Only the dynamic states move; parameters and sensor errors are constants (but for their drift
            # and for slow noise), so of the whole covariance s rows and columns change.
            head = np.dot(F, np.ascontiguousarray(P[: s + n_p]))
            P[:s] = head
            P[:s, :s] = np.dot(np.ascontiguousarray(head[:, : s + n_p]), F.T)
            P[s:, :s] = head[:, s:].T
            noise_step(mean, P, form)
            largest = settings.fall_impulse if times[i] < settings.fall_end else np.inf
            unknown_impulses(settings, impulses, largest, sigmas)
            add_process_noise(P, p, settings, sigmas, drift_at(times[i], targets, settings))
            # Rounding leaves what has moved lopsided by a little, and sample by sample the error would grow.
            symmetrise(P, s)
            if keep:
                transitions[i] = F
                impulse_sigmas[i] = sigmas
        elif keep:
            transitions[i] = 0.0
        count = 0
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
                    at = reference[i]
                    predicted = measurement_row(c, at, at[i_a], sensor_rows[c], s + n_p, n_c, form, row)
                    for j in range(n):
                        predicted += row[j] * (mean[j] - at[j])
                else:
                    predicted = measurement_row(c, mean, mean[i_a], sensor_rows[c], s + n_p, n_c, form, row)
            else:
                variance = speed_variance
                row[:] = 0.0
                row[i_w] = 1.0
                predicted = mean[i_w]
            # Readings have independent noise, so they are taken one at a time and no matrix is inverted.
            gain_beside(P, row, told, count, gain)
            S = variance + np.dot(row, gain)
            root = math.sqrt(S)
            for j in range(n):
                told[count, j] = gain[j] / root
                gain[j] /= S
                mean[j] += gain[j] * (value - predicted)
            count += 1
            innovations[i, c] = value - predicted
            innovation_variances[i, c] = S
            if keep:
                rows[i, c] = row
                gains[i, c] = gain
        take_off(P, told, count)
        means[i] = mean
        if covariances.shape[1] > 0:
            pack(P, covariances[i])
        if not is_covariance(P) or not is_plausible(mean, p):
            return i
    return len(times)


@kernel
def drift_at(t: float, targets: ParameterTargets, settings: FilterSettings) -> Array:
    """Drift of the parameters at a time [s], shape (P,)."""
    return targets.late_drift if t > settings.learning_end else targets.drift


@kernel
def is_plausible(mean: Array, p: KernelParameters) -> bool:
    """Whether the estimate is finite and no race or support has left its place."""
    good = math.isfinite(np.sum(mean))
    for b in range(p.bearing.shape[0]):
        limit = LARGEST_DEFLECTION * p.bearing[b, L.AIR_GAP]
        for body in (L.RACE, L.SUPPORT):
            i = p.bearing_at[b, body]
            good = good and abs(mean[i]) < limit and abs(mean[i + 1]) < limit
    return good


@kernel
def score_before_reading(score: Array, row: Array, gain: Array, innovation: float, variance: float) -> None:
    """λ (n,) after a reading, of a row (n,) and a gain (n,), becomes that before it."""
    told = np.dot(gain, score) + innovation / variance
    for a in range(score.shape[0]):
        score[a] -= row[a] * told


@kernel
def score_before_step(score: Array, F: Array | Compact, noise_decay: Array) -> None:
    """λ (n,) after a step with the transition ``F`` (s, s + P) becomes that before it."""
    s, columns = F.shape
    old = score[:s].copy()
    score[:s] = 0.0
    for a in range(s):
        for j in range(columns):
            score[j] += F[a, j] * old[a]
    for m in range(noise_decay.shape[0]):
        score[score.shape[0] - noise_decay.shape[0] + m] *= noise_decay[m]


@kernel
def backward_pass(
    first: int,
    means: Array,
    covariances: Compact,
    transitions: Compact,
    rows: Array,
    gains: Array,
    innovations: Array,
    innovation_variances: Array,
    noise_decay: Array,
    watched: Array,
    kept: Integers,
    smoothed: Array,
    blocks: Array,
    filtered: Array,
    information: Array,
    final_score: Array,
    final_information: Array,
) -> None:
    """Modified Bryson–Frazier smoother; arrays as filled by `forward_pass`.

    Parameters
    ----------
    first : int
        Where to stop: 0, or 1 where `forward_pass` went on from sample 0.
    noise_decay : ndarray, shape (M,)
        What a sample leaves of the slow noise, the last of the estimate.
    watched : ndarray, shape (G, n)
        Linear functions of the estimate whose smoothed covariance is wanted at every sample.
    kept : ndarray, shape (K,)
        Samples, rising, whose Λ is wanted.
    smoothed : ndarray, shape (N, n) or (0, n)
        Filled with the smoothed estimate.
    blocks : ndarray, shape (N, G, G) or (0, ...)
        Filled with the smoothed covariance of the watched functions.
    filtered, information : ndarray, shape (K, n, n)
        Filled with P and Λ of the kept samples: the smoothed covariance is ``P − P Λ P``.
    final_score, final_information : ndarray, shapes (n,), (n, n)
        λ and Λ that later samples or records put on the last one (zero behind the end); overwritten by their
        values *before* the first measurement done, to be handed to an earlier one.
    """
    n_t, n = means.shape
    s = transitions.shape[1]
    columns = transitions.shape[2]
    # λ and Λ gather what all later innovations say of the present estimate, in the manner of a gradient and
    # its curvature. That way no covariance is inverted, and a parameter known exactly does no harm.
    lam = final_score
    Lam = final_information
    P = np.empty((n, n))
    seen = np.empty(n, dtype=np.int64)
    left = kept.shape[0] - 1
    for i in range(n_t - 1, first - 1, -1):
        if smoothed.shape[0] > 0:
            unpack(covariances[i], P)
            smoothed[i] = means[i] - np.dot(P, lam)
            spread = np.dot(watched, P)
            blocks[i] = np.dot(spread, watched.T) - np.dot(np.dot(spread, Lam), spread.T)
        if left >= 0 and kept[left] == i:
            filtered[left] = P
            information[left] = Lam
            left -= 1
        for c in range(rows.shape[1] - 1, -1, -1):
            S = innovation_variances[i, c]
            if not math.isfinite(S):
                continue
            row = rows[i, c]
            gain = gains[i, c]
            # (I - K h)ᵀ Λ (I - K h) + hᵀ h / S
            lk = np.dot(Lam, gain)
            klk = np.dot(gain, lk)
            weight = klk + 1.0 / S
            count = 0
            # A reading sees one plane and its own sensor errors: most of its row is zero.
            for a in range(n):
                if row[a] != 0.0:
                    seen[count] = a
                    count += 1
            for a in range(n):
                for b in range(n):  # every entry: faster than those alone that are not zero
                    Lam[a, b] -= lk[a] * row[b]
            for e in range(count):
                a = seen[e]
                for b in range(n):
                    Lam[a, b] += row[a] * (weight * row[b] - lk[b])
            score_before_reading(lam, row, gain, innovations[i, c], S)
        if i > 0:
            F = transitions[i].astype(np.float64)
            top = np.ascontiguousarray(Lam[:s])
            tail = np.dot(F.T, top)
            body = np.dot(np.ascontiguousarray(tail[:, :s]), F)
            score_before_step(lam, F, noise_decay)
            lower = Lam[s:, s:].copy()
            cross = tail[:, s:].copy()
            Lam[:, :] = 0.0
            Lam[s:, s:] = lower
            Lam[:columns, :columns] += body
            Lam[:columns, s:] += cross
            Lam[s:, :columns] += cross.T
            for m in range(noise_decay.shape[0]):
                j = n - noise_decay.shape[0] + m
                Lam[j, :] *= noise_decay[m]
                Lam[:, j] *= noise_decay[m]
        symmetrise(Lam, n)


@kernel
def smooth_means(
    first: int,
    mean_0: Array,
    P: Array,
    times: Array,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    form: SensorForm,
    reference: Array,
    means: Array,
    transitions: Compact,
    rows: Array,
    gains: Array,
    impulse_sigmas: Array,
    innovations: Array,
    innovation_variances: Array,
    smoothed: Array,
    score: Array,
) -> None:
    """Smoothed estimate alone; arrays as filled by `forward_pass` and, as `reference`, handed to it.

    λ is carried back as by `backward_pass`; from the first sample, whose covariance is known, the estimate
    goes forward again, with the unknown impulses and drifts that λ says: no covariance of a later sample is
    asked for, nor Λ.

    Parameters
    ----------
    first : int
        First sample done: 0, or 1 where sample 0 is the last one of what was filtered before.
    mean_0, P : ndarray, shapes (n,), (n, n)
        Estimate before the first reading, or the filtered one of sample 0.
    smoothed : ndarray, shape (N, n)
        Filled from the first sample done on.
    score : ndarray, shape (n,)
        λ that later samples put on the last one; overwritten as by `backward_pass`.
    """
    n_t, n = means.shape
    s, columns = transitions.shape[1], transitions.shape[2]
    noisy = form.noise_decay.shape[0]
    scores = np.empty((n_t, n))
    for i in range(n_t - 1, first - 1, -1):
        for c in range(rows.shape[1] - 1, -1, -1):
            if math.isfinite(innovation_variances[i, c]):
                S = innovation_variances[i, c]
                score_before_reading(score, rows[i, c], gains[i, c], innovations[i, c], S)
        scores[i] = score
        if i > 0:
            score_before_step(score, transitions[i], form.noise_decay)
    away = -np.dot(P, score)  # of the smoothed estimate from the filtered one
    moved = np.empty(n)
    for i in range(first, n_t):
        if i == 0:
            smoothed[0] = mean_0 + away
        else:
            at = reference[i - 1] if i - 1 < reference.shape[0] else means[i - 1]
            apply_parameters(at[s:columns].copy(), targets, p)
            moved[:] = away
            for a in range(s):
                moved[a] = 0.0
                for j in range(columns):
                    moved[a] += transitions[i, a, j] * away[j]
            for m in range(noisy):
                e, decay = n - noisy + m, form.noise_decay[m]
                kept = decay * away[e]
                moved[e] = kept - (1.0 - decay * decay) * form.noise_variance[m] * scores[i, e]
            subtract_process_noise(
                scores[i], p, settings, impulse_sigmas[i], drift_at(times[i], targets, settings), moved
            )
            smoothed[i] = means[i] + moved
            for c in range(rows.shape[1]):
                if math.isfinite(innovation_variances[i, c]):
                    for a in range(n):
                        smoothed[i, a] -= gains[i, c, a] * innovations[i, c]
        for a in range(n):
            away[a] = smoothed[i, a] - means[i, a]
