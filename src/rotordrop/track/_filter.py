"""Extended Kalman filter of a drop, and the smoother behind it: state, parameters and sensor errors in one.

The vector x estimated is ``[dynamic state (s), parameters (P), sensor gains (C), offsets (C), 1X runout
cosine and sine (C, C), slow noise (M)]``, n in all. Given a reference trajectory (the smoothed one of an
earlier pass) the filter linearises there, so that repeated passes are a Gauss–Newton solution of the whole
problem. The smoother is that of Bryson and Frazier, modified: it inverts no covariance.

A filter step is `predict` and `update`; x, P, F, Q, H, R, S and K are those of the textbooks, e the
innovations, and λ and Λ what later innovations say of an estimate, in the manner of a gradient and its
curvature.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.physics import columns as L
from rotordrop.physics._compile import by_reference, kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.track._arrays import (
    Compact,
    apply,
    copy_into,
    copy_rows,
    fill,
    inner,
    is_covariance,
    multiply,
    pack,
    symmetrise,
    unpack,
)
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

LARGEST_DEFLECTION = 4.0
"""Way of a race or a support from its place, over the air gap, from which a filter has diverged [1]."""
SIGN_WIDTH = math.sqrt(0.5 * math.pi)


@by_reference
class Measurements(NamedTuple):
    """What was measured in N samples, with C channels.

    ``time`` (N,) from power-off [s]; ``readings`` (N, C) with polarity removed [m] and ``speed`` (N,) of the
    rotor [rad/s], NaN where missing; ``H`` (C, s), displacement along each sensor's direction by the dynamic
    state; ``R`` (C,) and ``speed_R``, the variances of their white noise [m²], [rad²/s²].
    """

    time: Array
    readings: Array
    speed: Array
    H: Array
    R: Array
    speed_R: float


@by_reference
class Segment(NamedTuple):
    """What a pass finds in N samples that follow one another; U = C + 1 measurements a sample, B bearings.

    It begins with sample ``first``: 0, or 1 where sample 0 is the last one of the segment before.
    ``reference`` (M, n) is the trajectory to linearise at for the first M samples; behind it the posterior
    serves. ``x`` (N, n) is the posterior mean, ``e`` and ``S`` (N, U) are the innovations and their
    variances, channel by channel, then the speed, NaN where missing.

    The rest is for the smoother and has no samples where nothing is kept: ``P`` (N, n (n + 1) / 2), the
    posterior covariance as `pack` stores it, or (N, 0); ``F`` (N, s, s + P), the transition from the sample
    before; ``H`` and ``K`` (N, U, n), rows and gains in the order used; ``sigma`` (N, B), the standard
    deviation of the unknown impulse since the sample before [N s].
    """

    first: int
    reference: Array
    x: Array
    e: Array
    S: Array
    P: Compact
    F: Compact
    H: Array
    K: Array
    sigma: Array

    def cut(self, count: int) -> Segment:
        """Its first samples."""
        return Segment(self.first, *(array[:count] for array in self[1:]))  # type: ignore[arg-type]


@lean_kernel
def cross_gain(P: Array, h: Array, scaled: Array, count: int, out: Array) -> None:
    """Fill ``out`` (n,) with the covariance of the estimate and a reading of a row ``h`` (n,).

    The first ``count`` rows of ``scaled`` (U, n) are not yet subtracted from ``P`` (n, n), see `subtract`.
    """
    n = P.shape[0]
    fill(out, 0.0)
    for j in range(n):
        if h[j] != 0.0:
            for i in range(n):
                out[i] += P[j, i] * h[j]
    for c in range(count):
        seen = 0.0
        for i in range(n):
            seen += scaled[c, i] * h[i]
        for i in range(n):
            out[i] -= scaled[c, i] * seen


@lean_kernel
def subtract(P: Array, scaled: Array, count: int) -> None:
    """Subtract ``K S Kᵀ`` of ``count`` readings from a covariance; ``scaled`` (U, n) holds ``K √S`` of each.

    All at once, for the matrix is fetched once then; a symmetric one stays so to the last bit.
    """
    n = P.shape[0]
    for i in range(n):
        for c in range(0, count - 1, 2):
            one, two = scaled[c, i], scaled[c + 1, i]
            for j in range(n):
                P[i, j] = (P[i, j] - one * scaled[c, j]) - two * scaled[c + 1, j]
        if count % 2 == 1:
            weight = scaled[count - 1, i]
            for j in range(n):
                P[i, j] -= weight * scaled[count - 1, j]


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
    x_0: Array,
    P: Array,
    measured: Measurements,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    form: SensorForm,
    segment: Segment,
) -> int:
    """Extended Kalman filter over the samples of a segment, which it fills.

    ``x_0`` (n,) and ``P`` (n, n) are the prior of sample 0, or its posterior where the segment begins with
    sample 1; ``P`` becomes that of the last sample. ``p`` is written to: a private copy. Returns the number
    of samples done: fewer than N when the filter has diverged.
    """
    x, smoothing = np.empty(x_0.shape[0]), np.empty(p.bearing.shape[0])
    copy_into(x_0, x)
    for b in range(smoothing.shape[0]):
        smoothing[b] = p.bearing[b, L.SMOOTHING_SPEED]
    if segment.first > 0 and segment.P.size > 0:
        pack(P, segment.P[0])
    for i in range(segment.first, segment.x.shape[0]):
        if i > 0:
            predict(i, x, P, measured.time, smoothing, targets, p, settings, form, segment)
        update(i, x, P, measured, p, form, segment)
        copy_into(x, segment.x[i])
        if segment.P.size > 0:
            pack(P, segment.P[i])
        if not is_covariance(P) or not is_plausible(x, p):
            return i
    return len(segment.x)


@kernel
def predict(
    i: int,
    x: Array,
    P: Array,
    time: Array,
    smoothing: Array,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    form: SensorForm,
    segment: Segment,
) -> None:
    """Turn the posterior x (n,), P (n, n) of the sample before into the prior of sample ``i``.

    ``smoothing`` (B,) is the least sliding speed below which friction is smoothed [m/s].
    """
    n, s, n_p = x.shape[0], p.rotor_at[L.N_DYNAMIC], targets.step.shape[0]
    y, theta = np.zeros(p.rotor_at[L.N_STATES]), np.empty(n_p)
    F, impulses, sigma = np.zeros((s, s + n_p)), np.zeros(smoothing.shape[0]), np.zeros(smoothing.shape[0])
    at = segment.reference[i - 1] if i - 1 < segment.reference.shape[0] else x
    copy_into(at[s : s + n_p], theta)
    apply_parameters(theta, targets, p)
    soften_friction(P, smoothing, p)
    copy_into(at[:s], y)
    propagate(time[i - 1], y, theta, targets, p, settings, F, impulses)
    if form.lag.shape[0] > 0:
        moved = np.empty(s + n_p)
        copy_into(y, moved[:s])
        copy_into(theta, moved[s:])
        lag_step(at[: s + n_p], moved, form, settings.dt, F)
        copy_into(moved[:s], y)
    # Around a reference the model is an affine map, the same for prediction and for smoothing, so the passes
    # are Gauss-Newton steps of one least-squares problem. The mean itself, propagated, would be linearised
    # elsewhere than the smoother's, and each pass would solve another problem.
    deviation, by_deviation = np.empty(s + n_p), np.empty(s)
    for j in range(s + n_p):
        deviation[j] = x[j] - at[j]
    apply(F, deviation, by_deviation)
    for j in range(s):
        x[j] = y[j] + by_deviation[j]
    # Only the dynamic states move; parameters and sensor errors are constants (but for their drift and for
    # slow noise), so of the whole covariance s rows and columns change.
    head, left, block = np.empty((s, n)), np.empty((s, s + n_p)), np.empty((s, s))
    multiply(F, P[: s + n_p], head)
    copy_rows(head, left)
    multiply(left, F.T, block)
    for j in range(s):
        copy_into(head[j], P[j])
        copy_into(block[j], P[j])
        for k in range(s, n):
            P[k, j] = head[j, k]
    noise_step(x, P, form)
    unknown_impulses(settings, impulses, sigma)
    add_process_noise(P, p, settings, sigma, drift_at(time[i], targets, settings))
    # Rounding leaves what has moved lopsided by a little, and sample by sample the error would grow.
    symmetrise(P, s)
    if segment.F.shape[0] > 0:
        copy_rows(F, segment.F[i])
        copy_into(sigma, segment.sigma[i])


@kernel
def update(
    i: int,
    x: Array,
    P: Array,
    measured: Measurements,
    p: KernelParameters,
    form: SensorForm,
    segment: Segment,
) -> None:
    """Turn the prior x (n,), P (n, n) of sample ``i`` into its posterior.

    Readings have independent noise, so they are taken one at a time and no matrix is inverted.
    """
    n, n_c = x.shape[0], measured.H.shape[0]
    first = n - 4 * n_c - form.noisy.shape[0]
    h, K, scaled, count = np.empty(n), np.empty(n), np.empty((n_c + 1, n)), 0
    for c in range(n_c + 1):
        value = measured.speed[i] if c == n_c else measured.readings[i, c]
        if not math.isfinite(value):
            segment.e[i, c], segment.S[i, c] = np.nan, np.nan
            continue
        if c < n_c:
            R, at = measured.R[c], segment.reference[i] if i < segment.reference.shape[0] else x
            angle = at[p.rotor_at[L.ROTOR_ANGLE]]
            predicted = measurement_row(c, at, angle, measured.H[c], first, n_c, form, h)
            for j in range(n):
                predicted += h[j] * (x[j] - at[j])
        else:
            R = measured.speed_R
            fill(h, 0.0)
            h[p.rotor_at[L.ROTOR_SPEED]] = 1.0
            predicted = x[p.rotor_at[L.ROTOR_SPEED]]
        cross_gain(P, h, scaled, count, K)
        S, e = R + inner(h, K), value - predicted
        root = math.sqrt(S)
        for j in range(n):
            scaled[count, j] = K[j] / root
            K[j] /= S
            x[j] += K[j] * e
        count += 1
        segment.e[i, c], segment.S[i, c] = e, S
        if segment.K.shape[0] > 0:
            copy_into(h, segment.H[i, c])
            copy_into(K, segment.K[i, c])
    subtract(P, scaled, count)


@kernel
def drift_at(t: float, targets: ParameterTargets, settings: FilterSettings) -> Array:
    """Drift of the parameters at a time [s], shape (P,)."""
    return targets.late_drift if t > settings.learning_end else targets.drift


@kernel
def is_plausible(x: Array, p: KernelParameters) -> bool:
    """Whether the estimate is finite and no race or support has left its place."""
    good = True
    for i in range(x.shape[0]):
        good = good and math.isfinite(x[i])
    for b in range(p.bearing.shape[0]):
        limit = LARGEST_DEFLECTION * p.bearing[b, L.AIR_GAP]
        for body in (L.RACE, L.SUPPORT):
            i = p.bearing_at[b, body]
            good = good and abs(x[i]) < limit and abs(x[i + 1]) < limit
    return good


@kernel
def score_before_readings(i: int, segment: Segment, lam: Array) -> None:
    """λ (n,) after the readings of sample ``i`` becomes that before them."""
    for c in range(segment.S.shape[1] - 1, -1, -1):
        S = segment.S[i, c]
        if math.isfinite(S):
            reported = inner(segment.K[i, c], lam) + segment.e[i, c] / S
            for a in range(lam.shape[0]):
                lam[a] -= segment.H[i, c, a] * reported


@kernel
def score_before_step(lam: Array, F: Array | Compact, noise_decay: Array) -> None:
    """λ (n,) after a step with the transition ``F`` (s, s + P) becomes that before it."""
    s, columns = F.shape
    old = np.empty(s)
    copy_into(lam, old)
    fill(lam[:s], 0.0)
    for a in range(s):
        for j in range(columns):
            lam[j] += F[a, j] * old[a]
    for m in range(noise_decay.shape[0]):
        lam[lam.shape[0] - noise_decay.shape[0] + m] *= noise_decay[m]


@kernel
def information_before_readings(i: int, segment: Segment, Lam: Array) -> None:
    """Λ (n, n) after the readings of sample ``i`` becomes ``(I - K h)ᵀ Λ (I - K h) + hᵀ h / S`` of each."""
    n = Lam.shape[0]
    by_gain, seen = np.empty(n), np.empty(n, dtype=np.int64)
    for c in range(segment.S.shape[1] - 1, -1, -1):
        S, h, K = segment.S[i, c], segment.H[i, c], segment.K[i, c]
        if not math.isfinite(S):
            continue
        apply(Lam, K, by_gain)
        weight = inner(K, by_gain) + 1.0 / S
        count = 0
        # A reading sees one plane and its own sensor errors: most of its row is zero.
        for a in range(n):
            if h[a] != 0.0:
                seen[count] = a
                count += 1
        for a in range(n):
            for b in range(n):  # every entry: faster than those alone that are not zero
                Lam[a, b] -= by_gain[a] * h[b]
        for e in range(count):
            a = seen[e]
            for b in range(n):
                Lam[a, b] += h[a] * (weight * h[b] - by_gain[b])


@kernel
def information_before_step(Lam: Array, F: Array, noise_decay: Array) -> None:
    """Λ (n, n) after a step with the transition ``F`` (s, s + P) becomes that before it."""
    n = Lam.shape[0]
    s, columns = F.shape
    tail, left, body = np.empty((columns, n)), np.empty((columns, s)), np.empty((columns, columns))
    multiply(F.T, Lam[:s], tail)
    copy_rows(tail, left)
    multiply(left, F, body)
    # of Λ itself only what does not move, behind the dynamic states, stays
    for a in range(n):
        for b in range(n):
            if a < s or b < s:
                Lam[a, b] = 0.0
    for a in range(columns):
        for b in range(columns):
            Lam[a, b] += body[a, b]
        for b in range(s, n):
            Lam[a, b] += tail[a, b]
    for a in range(columns):
        for b in range(s, n):
            Lam[b, a] += tail[a, b]
    for m in range(noise_decay.shape[0]):
        j = n - noise_decay.shape[0] + m
        for a in range(n):
            Lam[j, a] *= noise_decay[m]
            Lam[a, j] *= noise_decay[m]


@kernel
def backward_pass(
    segment: Segment,
    noise_decay: Array,
    watched: Array,
    kept: Integers,
    smoothed: Array,
    blocks: Array,
    posterior: Array,
    information: Array,
    lam: Array,
    Lam: Array,
) -> None:
    """Smoothed estimates and covariances of a segment that was filled with covariances.

    ``smoothed`` (N, n) receives the estimates, ``blocks`` (N, G, G) the covariances of the linear functions
    ``watched`` (G, n), ``posterior`` and ``information`` (E, n, n) P and Λ of the rising samples ``kept``
    (E,): their smoothed covariance is ``P - P Λ P``. ``noise_decay`` (M,) is what a sample leaves of the slow
    noise. ``lam`` (n,) and ``Lam`` (n, n) are λ and Λ behind the last sample, zero where nothing follows;
    they become those before the first measurement done.
    """
    n, n_w = segment.x.shape[1], watched.shape[0]
    P, by_lam, F = np.empty((n, n)), np.empty(n), np.empty((segment.F.shape[1], segment.F.shape[2]))
    spread, across = np.empty((n_w, n)), np.empty((n_w, n))
    block, taken = np.empty((n_w, n_w)), np.empty((n_w, n_w))
    last = kept.shape[0] - 1
    for i in range(segment.x.shape[0] - 1, segment.first - 1, -1):
        unpack(segment.P[i], P)
        apply(P, lam, by_lam)
        for a in range(n):
            smoothed[i, a] = segment.x[i, a] - by_lam[a]
        multiply(watched, P, spread)
        multiply(spread, watched.T, block)
        multiply(spread, Lam, across)
        multiply(across, spread.T, taken)
        for a in range(n_w):
            for b in range(n_w):
                blocks[i, a, b] = block[a, b] - taken[a, b]
        if last >= 0 and kept[last] == i:
            copy_rows(P, posterior[last])
            copy_rows(Lam, information[last])
            last -= 1
        information_before_readings(i, segment, Lam)
        score_before_readings(i, segment, lam)
        if i > 0:
            copy_rows(segment.F[i], F)
            score_before_step(lam, F, noise_decay)
            information_before_step(Lam, F, noise_decay)
        symmetrise(Lam, n)


@kernel
def smooth_means(
    x_0: Array,
    P: Array,
    time: Array,
    targets: ParameterTargets,
    p: KernelParameters,
    settings: FilterSettings,
    form: SensorForm,
    segment: Segment,
    smoothed: Array,
    lam: Array,
) -> None:
    """Smoothed estimates alone of a filled segment; arguments as handed to `forward_pass`.

    λ is carried back as by `backward_pass`; from the first sample, whose covariance ``P`` (n, n) is known,
    the estimate goes forward again, with the unknown impulses and drifts that λ says: no covariance of a
    later sample is asked for, nor Λ. ``smoothed`` (N, n) is filled from the first sample done on.
    """
    n_t, n = segment.x.shape
    s, columns = segment.F.shape[1], segment.F.shape[2]
    noisy = form.noise_decay.shape[0]
    scores = np.empty((n_t, n))
    for i in range(n_t - 1, segment.first - 1, -1):
        score_before_readings(i, segment, lam)
        copy_into(lam, scores[i])
        if i > 0:
            score_before_step(lam, segment.F[i], form.noise_decay)
    away, moved, theta = np.empty(n), np.empty(n), np.empty(columns - s)
    apply(P, lam, away)
    for a in range(n):
        away[a] = -away[a]  # of the smoothed estimate from the posterior
    if segment.first == 0:
        for a in range(n):
            smoothed[0, a] = x_0[a] + away[a]
            away[a] = smoothed[0, a] - segment.x[0, a]
    for i in range(1, n_t):
        at = segment.reference[i - 1] if i - 1 < segment.reference.shape[0] else segment.x[i - 1]
        copy_into(at[s:columns], theta)
        apply_parameters(theta, targets, p)
        copy_into(away, moved)
        for a in range(s):
            moved[a] = 0.0
            for j in range(columns):
                moved[a] += segment.F[i, a, j] * away[j]
        for m in range(noisy):
            a, decay = n - noisy + m, form.noise_decay[m]
            fresh = (1.0 - decay * decay) * form.noise_variance[m]
            moved[a] = decay * away[a] - fresh * scores[i, a]
        drift = drift_at(time[i], targets, settings)
        subtract_process_noise(scores[i], p, settings, segment.sigma[i], drift, moved)
        for a in range(n):
            smoothed[i, a] = segment.x[i, a] + moved[a]
        for c in range(segment.S.shape[1]):
            if math.isfinite(segment.S[i, c]):
                for a in range(n):
                    smoothed[i, a] -= segment.K[i, c, a] * segment.e[i, c]
        for a in range(n):
            away[a] = smoothed[i, a] - segment.x[i, a]
