"""Cross-check without any contact law: forces at the bearing nodes from the rotor's own motion.

The rotor model alone (modes, gyroscopics, gravity) is driven by unknown forces at the touchdown-bearing
nodes; their rates are random walks whose size follows the local force and the duration of the contacts, which
the likelihood of the readings gives, and they are held at zero while the rotor is clearly inside the air gap.
Smoothing takes from the peaks; twicing puts most of it back. It gives no waveform.

Source: twicing, Tukey 1977, Exploratory Data Analysis, chapter 16.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.record.axes import end_columns
from rotordrop.rotor.parameters import DropModel
from rotordrop.track.forces import stress_at_force
from rotordrop.track.problem import DropProblem, RecordedDrop, build_problem

GATE_MARGIN = 0.12
"""Part of the air gap by which a rotor is clear of a race, at least, where its force is held at zero [1].

The straight line through the sensors does not know how far the rotor bends off it. A gate that closes
during a contact takes force away and leaves the likelihood no contact to judge: with 0.04 one of four drops
of a calibrated 60 kg machine read 6.5 in place of 2.7 kN; 0.08, 0.12 and 0.16 give peaks within 3 %."""
HELD = 0.01
"""Force that may be left while it is held at zero, as a part of the weight on a bearing [1]."""
TURNED = 2.0 / math.sqrt(math.pi)
"""Root of the density of the random walk of a rate, over ``F ω^1.5`` [1]: a half sine of amplitude F and
angular frequency ω turns its rate from ``F ω`` to ``-F ω`` within π/ω; the walk spreads by ``s √(π/ω)``."""
TYPICAL_PEAK = 10.0
"""Typical ratio of the largest force of a drop to the weight on a bearing [1], where nothing is known yet."""
LOCAL = 0.25
"""Part of the duration of a contact, π/ω, from which the local force is taken on either side [1]: on five
drops of 13 and 60 kg a quarter made the readings likelier than a half, and a half than the whole."""
LOOKS = 3
"""Passes, each with the local forces of the one before: with the third, peaks move by 1 % and less [1]."""
SEARCHED = 8.0
"""Part of a drop on which the duration of the contacts is judged, over the time of its fall [1]."""
FASTEST_TURN = 0.5
"""Largest turn of a contact between two samples [rad] that is tried."""
STRESS_POINTS = 41
"""Forces at which the stress of a bearing is computed; between them by straight lines."""
LEAST_PEAK_ERROR, REINSERTED_ERROR = 0.11, 3.8
"""Relative error of a largest peak [1], at least and over the part of it that twicing has put back, through
which sampling rate, noise, weight and contact time act: it held 11 of the 12 peaks that set it (13, 60 kg;
0.45, 2 µm noise) and 95 of 96 at 10 to 100 kHz (study cross_check).

Not validated: other rotors."""
LEAST_STRESS_ERROR, STRESS_PER_PEAK = 0.015, 0.4
"""Relative error of a largest stress [1], at least (preload) and over that of the peak (third root of it)."""
MEAN_ERROR = 0.05
"""Relative error of the late mean force [1]."""


@dataclass(frozen=True, kw_only=True)
class InputEstimate:
    """Forces at the bearing nodes found without a contact law; N samples, B bearings."""

    time: Array
    """Time from power-off [s], shape (N,)."""
    turn: float
    """Angular frequency of the contacts that makes the readings likeliest [rad/s]."""
    force: Array
    sigma: Array
    """Force of the rotor on the race and its standard error by the noise of the readings alone [N], shape (N,
    B, 2)."""
    magnitude: Array
    """Its magnitude [N], shape (N, B)."""
    peak: Array
    reinserted: Array
    peak_error: Array
    """Largest magnitude [N], the part of it that twicing has put back [1], and the relative error that nine
    of ten such peaks stay within [1], shape (B,)."""
    stress: Array
    """Largest Hertz stress that this force gives in the bearing at rest [Pa], shape (N, B)."""
    peak_stress: Array
    stress_error: Array
    """Its largest value [Pa] and the relative error that nine of ten stay within [1], shape (B,)."""
    mean_late: Array
    """Magnitude of the mean force vector between 0.15 and 0.2 s [N]; NaN when the record is shorter, shape
    (B,)."""
    mean_magnitude_late: Array
    """Mean magnitude of the force in the same time [N]; NaN when the record is shorter, shape (B,)."""


@dataclass(frozen=True, kw_only=True)
class SensorCorrections:
    """What the cross-check has to be given; N samples, B bearings, C channels."""

    gain_errors: Array
    offsets: Array
    """Errors of the readings [1], [m], shape (C,)."""
    radius: Array
    """Distance of rotor and race [m]; NaN where it is not known, shape (N, B)."""
    reach: Array
    """Distance below which rotor and race cannot touch [m], shape (B,)."""
    theta: Array
    """Parameters of the drop model, of which the stress takes the preload, shape (P,)."""

    @property
    def closed(self) -> NDArray[np.bool_]:
        """Whether rotor and race cannot touch, for both axes, shape (N, 2 B)."""
        return np.repeat(self.radius < self.reach, 2, axis=1)

    def of(self, problem: DropProblem) -> Array:
        """Readings of a problem without the errors of the sensors [m], shape (N, C)."""
        readings = (problem.readings - self.offsets) / (1.0 + self.gain_errors)
        return np.asarray(readings[: len(self.radius)])


def corrections_by_record(problem: DropProblem) -> SensorCorrections:
    """What settled tail and machine file say alone: the cross-check takes nothing from the twin.

    The rotor counts as clear of a race only where it is so by twice the error of gap and sensors and by
    `GATE_MARGIN` of the gap, which it may bend off the line through its sensors: a gate that closes during
    a contact would take force away, one that opens too early only lets a little noise in.
    """
    gain_errors, offsets = problem.sensor_errors(problem.mean)
    entries = problem.gap_entries
    variance = np.diag(problem.covariance)
    first = problem.n_dynamic + len(problem.unknowns) + problem.n_channels
    zero = float(np.max(variance[first : first + problem.n_channels]))
    margin = GATE_MARGIN * problem.mean[entries] + 2.0 * np.sqrt(variance[entries] + zero)
    motion = at_bearings(problem, (problem.readings - offsets) / (1.0 + gain_errors))
    # so far may a loose race lie off its centre
    play = 0.0 if problem.model.play is None else problem.model.play[0]
    reach = problem.mean[entries] - margin - play
    # at an end that was held, what the description of its magnet gets wrong is found as a force
    reach[list(problem.held)] = 0.0
    return SensorCorrections(
        gain_errors=gain_errors,
        offsets=offsets,
        radius=np.hypot(motion[..., 0], motion[..., 1]),
        reach=reach,
        theta=problem.mean[problem.parameter_slice],
    )


def at_bearings(problem: DropProblem, along: Array) -> Array:
    """Rotor at the bearings [m], shape (N, B, 2), on the straight line through its outer sensor planes.

    ``along`` (N, C) is the displacement along every sensor [m], its gain and offset taken out. A sample that
    lacks a channel gives NaN; a channel that is never there is left out.
    """
    layout, rigid = problem.model.layout, slice(0, problem.model.basis.n_rigid)
    rows = problem.sensor_rows
    design = np.hstack([rows[:, layout.modal_x][:, rigid], rows[:, layout.modal_y][:, rigid]])
    machine, live = problem.model.machine, np.flatnonzero(np.isfinite(along).any(axis=0))
    live = live[end_columns([machine.sensors[i] for i in live], machine.rotor.node_positions)]
    amplitudes = along[:, live] @ np.linalg.pinv(design[live]).T
    shapes = problem.model.parameters.bearing_shape[:, rigid]
    half = shapes.shape[1]
    return np.stack([amplitudes[:, :half] @ shapes.T, amplitudes[:, half:] @ shapes.T], axis=-1)


def input_state_estimate(problem: DropProblem, corrections: SensorCorrections) -> InputEstimate:
    """Joint estimate of motion and bearing forces from the readings, by a linear filter and smoother.

    No contact, friction or support enters. Both directions must be seen in two planes: with less, the rotor
    model alone does not bound the forces. The corrections are those of the twin or of the record alone.
    """
    count = len(corrections.radius)
    rotor, passed, shown, variance, turn = _looked(problem, corrections)
    force, peak, smoothed_peak = _bias_corrected(rotor, passed, shown, corrections.of(problem))
    reinserted = np.minimum(np.abs(peak - smoothed_peak) / np.maximum(peak, 1e-300), 1.0)
    peak_error = np.hypot(LEAST_PEAK_ERROR, REINSERTED_ERROR * reinserted)
    force, variance = force.reshape(count, -1, 2), np.maximum(variance, 0.0).reshape(count, -1, 2)
    time = problem.time[:count]
    magnitude = np.hypot(force[..., 0], force[..., 1])
    level = np.sqrt(np.maximum(magnitude**2 - variance.sum(axis=2), 0.0))  # noise lengthens a vector
    late = time >= 0.15
    unknown = np.full(force.shape[1], np.nan)
    whole = time[-1] > 0.199
    stress = np.column_stack(
        [_stress(problem, corrections.theta, b, force[:, b]) for b in range(force.shape[1])]
    )
    return InputEstimate(
        time=time,
        turn=turn,
        force=force,
        sigma=np.sqrt(variance),
        magnitude=magnitude,
        peak=peak,
        reinserted=reinserted,
        peak_error=peak_error,
        stress=stress,
        peak_stress=stress.max(axis=0),
        stress_error=np.hypot(LEAST_STRESS_ERROR, STRESS_PER_PEAK * peak_error),
        mean_late=np.hypot(*force[late].mean(axis=0).T) if whole else unknown,
        mean_magnitude_late=level[late].mean(axis=0) if whole else unknown,
    )


def peaks_shown(problem: DropProblem, corrections: SensorCorrections, force: Array) -> Array:
    """Largest magnitude that this estimate would show of given forces (N, B, 2) [N], shape (B,) [N].

    Noise of the sensors hides what contacts faster than the readings resolve have above it: the rotor under
    these forces is read without noise, and estimated as the readings are.
    """
    rotor, passed, shown, _, _ = _looked(problem, corrections)
    force = force.reshape(len(force), -1)[: len(shown)]
    states = states_under(rotor.F, rotor.forces.start, force, rotor.dt)
    readings = np.array([rotor.H @ x for x in states])
    shown = pass_again(rotor, passed, readings)
    return _bias_corrected(rotor, passed, shown, readings)[1]


def _looked(
    problem: DropProblem, corrections: SensorCorrections
) -> tuple[ForcedRotor, Passed, Array, Array, float]:
    """The rotor, the last pass, what it shows, the variances of its forces, and how fast contacts turn."""
    closed, readings, rotor = corrections.closed, corrections.of(problem), rotor_of(problem)
    early = slice(0, int(np.searchsorted(problem.time[: len(readings)], SEARCHED * problem.fall_time)))
    local, turn = _typical(problem, rotor, closed)
    for look in range(LOOKS):
        if look == 1:
            turn = _likeliest_turn(rotor, readings[early], closed[early], local[early], turn)
        passed = forward_pass(rotor, readings, closed, local, turn)
        shown, variance, _ = backward_pass(rotor, passed, variances=look == LOOKS - 1)
        force = shown[:, : closed.shape[1]]
        local = _local_force(force, max(1, round(LOCAL * math.pi / (turn * rotor.dt))))
    return rotor, passed, shown, variance, turn


def _typical(problem: DropProblem, rotor: ForcedRotor, closed: NDArray[np.bool_]) -> tuple[Array, float]:
    """Forces (N, K) [N] and how fast contacts turn [rad/s], where nothing is known of them yet.

    Falling and rebounding as fast, a rotor has twice its momentum under a half sine.
    """
    return np.broadcast_to(TYPICAL_PEAK * rotor.weight, closed.shape), TYPICAL_PEAK / problem.fall_time


def rotor_likelihood_of(model: DropModel, drop: RecordedDrop, corrections: SensorCorrections) -> float:
    """Negative logarithm of the likelihood of readings with a rotor under any forces at its bearings [1].

    No contact law enters: the touchdown bearings of the model only say where forces act. A tail in what the
    record says costs time and changes nothing here; ``corrections`` are those of a like model.
    """
    problem = build_problem(model, replace(drop, tail_level=None), until=float(drop.time[-1]))
    rotor, closed = rotor_of(problem), corrections.closed
    local, turn = _typical(problem, rotor, closed)
    return forward_pass(rotor, corrections.of(problem), closed, local, turn).negative_log_likelihood


def _bias_corrected(
    rotor: ForcedRotor, passed: Passed, shown: Array, readings: Array
) -> tuple[Array, Array, Array]:
    """Forces (N, K) [N], their peaks (B,) [N], and the peaks before.

    What smoothing took from the peaks is in what is left of the readings: found there in the same way, it is
    put back: bias correction by twicing.
    """
    k = rotor.forces.stop - rotor.forces.start
    smoothed, fitted = shown[:, :k], shown[:, k:]
    force = smoothed + pass_again(rotor, passed, readings - fitted)[:, :k]
    return force, _size(force).max(axis=0), _size(smoothed).max(axis=0)


def _stress(problem: DropProblem, theta: Array, b: int, force: Array) -> Array:
    """Stress of a bearing [Pa], shape (N,), under forces (N, 2) [N], by their size, in the worst direction.

    The direction changes the stress by a few per mille only (one ball more or less below the force).
    """
    size = np.hypot(force[:, 0], force[:, 1])
    worst = int(np.argmax(size))
    sizes = size[worst] * np.linspace(0.0, 1.0, STRESS_POINTS) ** 2
    along = force[worst] / max(size[worst], 1e-300)
    return np.interp(size, sizes, [stress_at_force(problem, theta, b, one * along) for one in sizes])


def _size(force: Array) -> Array:
    """Magnitudes (N, B) of force components (N, K)."""
    return np.asarray(np.hypot(force[:, 0::2], force[:, 1::2]))


def _local_force(force: Array, half: int) -> Array:
    """Largest force of a bearing within some samples on either side, for both axes, shape (N, K)."""
    padded = np.pad(_size(force), ((half, half), (0, 0)), mode="edge")
    largest = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0).max(axis=-1)
    return np.repeat(largest, 2, axis=1)


def transition(
    stiffness: Array, damping: Array, push: Array, weight: Array, dt: float
) -> tuple[Array, Array, int]:
    """Transition of ``[motion, forces, rates]`` over ``dt`` [s], the step by the weight, size of the motion.

    The motion is that of ``q̈ + C q̇ + K q = push · forces + weight`` with unit masses; a force runs on along a
    straight line.
    """
    from scipy.linalg import expm

    m, k = push.shape
    n = 2 * m
    A = np.zeros((n + 2 * k + 1, n + 2 * k + 1))
    A[:m, m:n] = np.eye(m)
    A[m:n, :m] = -stiffness
    A[m:n, m:n] = -damping
    A[m:n, n : n + k] = push
    A[m:n, -1] = weight
    A[n : n + k, n + k : n + 2 * k] = np.eye(k)
    E = expm(A * dt)
    return E[:-1, :-1], E[:-1, -1], n


def states_under(F: Array, first: int, force: Array, dt: float) -> Array:
    """States (N, n) of a `transition` from rest, under forces (N, K) [N] that stand at ``first`` among them.

    Between samples ``dt`` [s] apart the forces run along a straight line.
    """
    states, of_force = np.zeros((len(force), len(F))), slice(first, first + 2 * force.shape[1])
    for i, rate in enumerate(np.diff(force, axis=0) / dt):
        states[i, of_force] = *force[i], *rate
        states[i + 1] = F @ states[i]
    return states


@dataclass(frozen=True, kw_only=True)
class ForcedRotor:
    """The rotor under unknown forces, in samples: N readings, C channels, K force components, n states.

    ``forces`` are the places of the force components among the states; their rates follow them. Slow noise of
    the sensors comes last.
    """

    dt: float
    F: Array
    gravity: Array
    forces: slice
    H: Array
    start: Array
    start_covariance: Array
    variances: Array
    weight: Array
    fresh: Array = field(default_factory=lambda: np.zeros(0))
    """Variance that a sample adds to each part of the slow noise [m²], shape (M,)."""
    places: Array | None = None
    """Rows of displacements that are wanted besides the readings, shape (D, n)."""

    @property
    def watched(self) -> Array:
        """Rows of forces, readings without slow noise and wanted displacements (K + C + D, n)."""
        wanted = [] if self.places is None else [self.places]
        moves = np.arange(len(self.F)) < len(self.F) - len(self.fresh)
        return np.concatenate([np.eye(len(self.F))[self.forces], self.H * moves, *wanted])


def rotor_of(problem: DropProblem) -> ForcedRotor:
    """The rotor of a problem under unknown forces at its bearings."""
    model = problem.model
    p = model.parameters
    dt = float(problem.time[1] - problem.time[0])
    m, k = model.layout.n_modes, 2 * len(p.bearing_shape)
    turned = float(problem.mean[model.layout.rotor_speed]) * p.polar
    push, weight = np.zeros((2 * m, k)), np.zeros(2 * m)
    push[:m, 0::2] = push[m:, 1::2] = -p.bearing_shape.T
    weight[m:] = p.gravity
    damping = np.block([[np.diag(p.damping), turned], [-turned, np.diag(p.damping)]])
    stiffness = np.diag(np.tile(p.eigenvalue, 2))
    for a in np.flatnonzero(p.magnet[:, L.AMB_STAYS]).tolist():
        shape, row = p.magnet_shape[a], p.magnet[a]
        spring = np.kron(np.eye(2), np.outer(shape, shape))
        stiffness = stiffness + row[L.AMB_STIFFNESS] * spring
        damping = damping + row[L.AMB_DAMPING] * spring
        for axis in range(2):
            entry = problem.entries_that_set("magnet", a, L.AMB_REFERENCE_X + axis)
            place = float(problem.mean[entry].sum())
            force = row[L.HOLDING_X + axis] + row[L.AMB_STIFFNESS] * place
            weight[axis * m : (axis + 1) * m] += force * shape
    F, gravity, n = transition(stiffness, damping, push, weight, dt)
    H = np.zeros((problem.n_channels, len(F)))
    H[:, : 2 * m] = problem.sensor_rows[:, : 2 * m]
    start, variance = np.zeros(len(F)), np.zeros(len(F))
    known = np.diag(problem.covariance)
    start[: 2 * m] = problem.mean[: 2 * m]
    variance[: 2 * m] = known[: 2 * m]
    variance[2 * m : n] = known[model.layout.velocity_of(slice(0, 2 * m))]
    form = problem.sensor_form
    none, last = np.zeros(len(form.noisy)), len(F) + np.arange(len(form.noisy))
    F = np.pad(F, (0, len(none)))
    F[last, last] = form.noise_decay
    H = np.pad(H, ((0, 0), (0, len(none))))
    H[form.noisy, last] = 1.0
    return ForcedRotor(
        dt=dt,
        F=F,
        gravity=np.append(gravity, none),
        forces=slice(n, n + k),
        H=H,
        start=np.append(start, none),
        start_covariance=np.diag(np.append(variance, form.noise_variance)),
        variances=problem.white_variances,
        weight=np.repeat(model.load_shares, 2),
        fresh=(1.0 - form.noise_decay**2) * form.noise_variance,
    )


def _likeliest_turn(
    rotor: ForcedRotor, readings: Array, closed: NDArray[np.bool_], local: Array, turn: float
) -> float:
    """Angular frequency of the contacts [rad/s] that makes the readings likeliest, by a parabola."""

    def cost(octave: int) -> float:
        if octave not in tried:
            tried[octave] = forward_pass(
                rotor, readings, closed, local, turn * 2.0**octave
            ).negative_log_likelihood
        return tried[octave]

    tried: dict[int, float] = {}
    best = 0
    while cost(best + 1) < cost(best) and turn * 2.0 ** (best + 1) * rotor.dt < FASTEST_TURN:
        best += 1
    while best <= 0 and cost(best - 1) < cost(best):
        best -= 1
    below, least, above = (cost(best + step) for step in (-1, 0, 1))
    curvature = below - 2.0 * least + above
    shift = 0.5 * (below - above) / curvature if curvature > 0.0 else 0.0
    return float(turn * 2.0 ** (best + min(max(shift, -0.5), 0.5)))


@dataclass(frozen=True, kw_only=True)
class _Update:
    """Gain, rows, whitened innovation, inverse of its covariance; ``channels`` is None for the gate."""

    K: Array
    H: Array
    whitened: Array
    inverse: Array
    channels: NDArray[np.int64] | None


@dataclass(frozen=True, kw_only=True)
class Passed:
    """A forward pass: what the smoother needs, and how improbable the readings are.

    One entry per sample: updates by gate and readings, what is watched, and its rows of the covariance.
    """

    updates: list[list[_Update]]
    shown: Array
    rows: Array
    negative_log_likelihood: float


def _walk(dt: float) -> tuple[float, float, float]:
    """Variance of the force, covariance with its rate and variance of the rate after a sample [s], where the
    rate is a random walk of density one.
    """
    return dt**3 / 3.0, dt**2 / 2.0, dt


def forward_pass(
    rotor: ForcedRotor, readings: Array, closed: NDArray[np.bool_], local: Array, turn: float
) -> Passed:
    """Kalman filter over the readings (N, C) with unknown forces of local size (N, K) [N]."""
    dt, f = rotor.dt, rotor.forces
    k = f.stop - f.start
    at, rate = np.arange(f.start, f.stop), np.arange(f.stop, f.stop + k)
    count, size = len(readings), len(rotor.F)
    noise = np.arange(size - len(rotor.fresh), size)
    strength = TURNED * turn**1.5 * np.maximum(local, rotor.weight)
    of_force, of_both, of_rate = (strength**2 * x for x in _walk(dt))
    held = (HELD * rotor.weight) ** 2 / (turn * dt)
    identity = np.eye(size)
    x, P = rotor.start, rotor.start_covariance
    watched = rotor.watched
    updates, negative_log_likelihood = [], 0.0
    shown, rows = np.empty((count, len(watched))), np.empty((count, len(watched), size))
    for i in range(count):
        if i > 0:
            x = rotor.F @ x + rotor.gravity
            P = rotor.F @ P @ rotor.F.T
            P[at, at] += of_force[i]
            P[at, rate] += of_both[i]
            P[rate, at] += of_both[i]
            P[rate, rate] += of_rate[i]
            if len(noise):
                P[noise, noise] += rotor.fresh
        live, shut = np.flatnonzero(np.isfinite(readings[i])), np.flatnonzero(closed[i])
        done = []
        for H, z, R, channels in (
            (identity[at[shut]], np.zeros(len(shut)), held[shut], None),
            (rotor.H[live], readings[i, live], rotor.variances[live], live),
        ):
            if len(z) == 0:
                continue
            PH = P @ H.T
            S = H @ PH
            S[np.diag_indices(len(z))] += R
            inverse: Array = np.asarray(np.linalg.inv(S), dtype=np.float64)
            K, e = PH @ inverse, z - H @ x
            x = x + K @ e
            P = P - K @ PH.T
            done.append(_Update(K=K, H=H, whitened=inverse @ e, inverse=inverse, channels=channels))
        if len(live):
            negative_log_likelihood += 0.5 * float(e @ done[-1].whitened - np.linalg.slogdet(inverse)[1])
        P = 0.5 * (P + P.T)  # else rounding would grow sample by sample
        updates.append(done)
        shown[i], rows[i] = watched @ x, watched @ P
    return Passed(updates=updates, shown=shown, rows=rows, negative_log_likelihood=negative_log_likelihood)


def backward_pass(
    rotor: ForcedRotor, passed: Passed, *, variances: bool = True
) -> tuple[Array, Array, Array]:
    """Smoothed forces and readings (N, K + C), variances of the forces (N, K): modified Bryson–Frazier.

    Last, what the readings say of the random walks of density s² at every sample, shape (2, N, K), with the
    variances only: ``s²`` times the first is the square of the smoothed step over its variance, ``s²`` times
    the second its expectation. Where the first is larger, s² is too small.

    Source: Koopman and Shephard 1992, exact score for time series models in state space form.
    """
    size, f = len(rotor.F), rotor.forces
    k = f.stop - f.start
    at, rate = np.arange(f.start, f.stop), np.arange(f.stop, f.stop + k)
    of_force, of_both, of_rate = _walk(rotor.dt)
    shown, variance = passed.shown.copy(), np.empty((len(passed.shown), k))
    evidence = np.zeros((2, *variance.shape))
    score, information = np.zeros(size), np.zeros((size, size))
    for i in range(len(shown) - 1, -1, -1):
        shown[i] -= passed.rows[i] @ score
        if variances:
            rows = passed.rows[i, :k]
            variance[i] = np.diag(rows[:, f]) - np.sum((rows @ information) * rows, axis=1)
        for update in reversed(passed.updates[i]):
            K, H = update.K, update.H
            score = score - H.T @ (K.T @ score + update.whitened)
            if variances:
                information = information - H.T @ (K.T @ information)
                information = information - (information @ K) @ H + H.T @ update.inverse @ H
        if variances and i > 0:
            for entry, square in zip(evidence, (np.outer(score, score), information), strict=True):
                both = 2.0 * of_both * square[at, rate]
                entry[i] = of_force * square[at, at] + both + of_rate * square[rate, rate]
        score = rotor.F.T @ score
        if variances:
            information = rotor.F.T @ information @ rotor.F
    return shown, variance, evidence


def pass_again(rotor: ForcedRotor, passed: Passed, left: Array) -> Array:
    """Forces (N, K) that the same filter and smoother find in other readings (N, C), from rest.

    Gains do not depend on readings, so that this is a fraction of the work of a pass.
    """
    x, shown, updates = np.zeros(len(rotor.F)), np.empty_like(passed.shown), []
    for i, before in enumerate(passed.updates):
        x = rotor.F @ x
        done = []
        for update in before:
            z = 0.0 if update.channels is None else left[i, update.channels]
            e = z - update.H @ x
            x = x + update.K @ e
            done.append(replace(update, whitened=update.inverse @ e))
        shown[i] = rotor.watched @ x
        updates.append(done)
    return backward_pass(rotor, replace(passed, updates=updates, shown=shown), variances=False)[0]
