"""Cross-check without any contact law: forces at the bearing nodes from the rotor's own motion.

The rotor model alone (modes, gyroscopics, gravity) is driven by unknown forces at the touchdown-bearing
nodes; their rates are random walks whose size follows the local force, and they are held at zero while the
rotor is clearly inside the air gap. Known accuracy on simulated records: main peaks 4–7 %, single impacts up
to 150 %; no waveform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.model.parameters import DropModel
from rotordrop.tracking.forces import stress_at_force
from rotordrop.tracking.problem import DropProblem
from rotordrop.tracking.smoother import Smoothed, parameter_sample

Array = NDArray[np.float64]

GATE_MARGIN = 10e-6
GATE_SIGMA = 3.0
BASE_RATE = 3e5
RATE_PER_FORCE = 3e3
STRESS_POINTS = 41
"""Forces at which the stress of a bearing is computed; between them by straight lines."""
KNOWN_PEAK_ERROR = 0.15
"""Relative error of the largest peak that this estimate is known to make at worst [1]."""
KNOWN_STRESS_ERROR = 0.05
"""The same for the largest stress, which goes with the third root of the load and sees the preload [1]."""
KNOWN_MEAN_ERROR = 0.10
"""The same for the late mean force vector [1]."""


@dataclass(frozen=True, kw_only=True)
class InputEstimate:
    """Forces at the bearing nodes found without a contact law; N samples, B bearings.

    Attributes
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    force : ndarray, shape (N, B, 2)
        Force of the rotor on the race [N].
    magnitude : ndarray, shape (N, B)
        Its magnitude [N].
    peak : ndarray, shape (B,)
        Largest magnitude [N].
    stress : ndarray, shape (N, B)
        Largest Hertz stress that this force gives in the bearing at rest [Pa].
    peak_stress : ndarray, shape (B,)
        Its largest value [Pa].
    mean_late : ndarray, shape (B,)
        Magnitude of the mean force vector between 0.15 and 0.2 s [N]; NaN when the record is shorter.
    mean_magnitude_late : ndarray, shape (B,)
        Mean magnitude of the force in the same time [N]; NaN when the record is shorter.
    """

    time: Array
    force: Array
    magnitude: Array
    peak: Array
    stress: Array
    peak_stress: Array
    mean_late: Array
    mean_magnitude_late: Array


@dataclass(frozen=True, kw_only=True)
class Lent:
    """What the cross-check has to be told; N samples, B bearings, C channels.

    Attributes
    ----------
    gain_errors, offsets : ndarray, shape (C,)
        Errors of the readings [1], [m].
    radius : ndarray, shape (N, B)
        Distance of rotor and race [m]; NaN where it is not known.
    reach : ndarray, shape (B,)
        Distance below which rotor and race cannot touch [m].
    theta : ndarray, shape (P,)
        Parameters of the drop model, of which the stress takes the preload.
    """

    gain_errors: Array
    offsets: Array
    radius: Array
    reach: Array
    theta: Array


def lent_by_twin(problem: DropProblem, smoothed: Smoothed) -> Lent:
    """What a twin that follows its record knows of sensors, gaps and preload, and where it saw the rotor."""
    radius, gaps = _radius_and_gap(problem, smoothed)
    gain_errors, offsets = problem.sensor_errors(smoothed.means[-1])
    return Lent(
        gain_errors=gain_errors,
        offsets=offsets,
        radius=radius,
        reach=gaps - GATE_MARGIN,
        theta=smoothed.means[parameter_sample(smoothed)][problem.parameter_slice],
    )


def lent_by_record(problem: DropProblem) -> Lent:
    """What settled tail and machine file say alone, for a twin that has lost its record.

    The rotor counts as clear of a race only where it is so by twice the error of gap and sensors: a gate that
    closes during a contact would take force away, one that opens too early only lets a little noise in.
    """
    gain_errors, offsets = problem.sensor_errors(problem.mean)
    entries = problem.gap_entries
    variance = np.diag(problem.covariance)
    first = problem.n_dynamic + len(problem.unknowns) + problem.n_channels
    zero = float(np.max(variance[first : first + problem.n_channels]))
    margin = GATE_MARGIN + 2.0 * np.sqrt(variance[entries] + zero)
    motion = at_bearings(problem, (problem.readings - offsets) / (1.0 + gain_errors))
    return Lent(
        gain_errors=gain_errors,
        offsets=offsets,
        radius=np.hypot(motion[..., 0], motion[..., 1]),
        reach=problem.mean[entries] - margin,
        theta=problem.mean[problem.parameter_slice],
    )


def at_bearings(problem: DropProblem, along: Array) -> Array:
    """Rotor at the bearings [m], shape (N, B, 2), on the straight line through its sensors.

    Parameters
    ----------
    problem : DropProblem
        Knows where sensors and bearings are.
    along : ndarray, shape (N, C)
        Displacement along every sensor [m], its gain and offset taken out; a sample that lacks a channel
        gives NaN, a channel that is never there is left out.
    """
    layout, rigid = problem.model.layout, slice(0, problem.model.basis.n_rigid)
    rows = problem.sensor_rows
    design = np.hstack([rows[:, layout.modal_x][:, rigid], rows[:, layout.modal_y][:, rigid]])
    heard = np.isfinite(along).any(axis=0)
    amplitudes = along[:, heard] @ np.linalg.pinv(design[heard]).T
    shapes = problem.model.parameters.bearing_shape[:, rigid]
    half = shapes.shape[1]
    return np.stack([amplitudes[:, :half] @ shapes.T, amplitudes[:, half:] @ shapes.T], axis=-1)


def input_state_estimate(problem: DropProblem, lent: Lent) -> InputEstimate:
    """Joint estimate of motion and bearing forces from the readings, by a linear filter and smoother.

    No contact, friction or support enters. Both directions must be seen in two planes: with less, the rotor
    model alone does not bound the forces.

    Parameters
    ----------
    problem : DropProblem
        Readings and rotor.
    lent : Lent
        Sensor errors, air gaps and preload, from the twin or from the record alone.
    """
    count = len(lent.radius)
    gate = lent.radius < lent.reach
    readings = ((problem.readings - lent.offsets) / (1.0 + lent.gain_errors))[:count]
    scale = np.full((count, gate.shape[1]), BASE_RATE)
    force = _smooth_forces(problem, readings, gate, scale)
    local = _running_maximum(np.hypot(force[..., 0], force[..., 1]), 10)
    force = _smooth_forces(problem, readings, gate, BASE_RATE * 0.1 + RATE_PER_FORCE * local)
    time = problem.time[:count]
    magnitude = np.hypot(force[..., 0], force[..., 1])
    late = time >= 0.15
    unknown = np.full(force.shape[1], np.nan)
    whole = time[-1] > 0.199
    stress = np.column_stack([_stress(problem, lent.theta, b, force[:, b]) for b in range(force.shape[1])])
    return InputEstimate(
        time=time,
        force=force,
        magnitude=magnitude,
        peak=magnitude.max(axis=0),
        stress=stress,
        peak_stress=stress.max(axis=0),
        mean_late=np.hypot(*force[late].mean(axis=0).T) if whole else unknown,
        mean_magnitude_late=magnitude[late].mean(axis=0) if whole else unknown,
    )


def _radius_and_gap(problem: DropProblem, smoothed: Smoothed) -> tuple[Array, Array]:
    layout = problem.model.layout
    shapes = problem.model.parameters.bearing_shape
    x = smoothed.means[:, layout.modal_x] @ shapes.T
    y = smoothed.means[:, layout.modal_y] @ shapes.T
    race = smoothed.means[:, layout.race].reshape(len(x), -1, 2)
    return np.hypot(x - race[..., 0], y - race[..., 1]), smoothed.means[0][problem.gap_entries]


def _stress(problem: DropProblem, theta: Array, b: int, force: Array) -> Array:
    """Stress of a bearing [Pa], shape (N,), under forces (N, 2) [N], by their size, in the worst direction.

    The direction changes the stress by a few per mille only (one ball more or less below the force).
    """
    size = np.hypot(force[:, 0], force[:, 1])
    worst = int(np.argmax(size))
    sizes = size[worst] * np.linspace(0.0, 1.0, STRESS_POINTS) ** 2
    along = force[worst] / max(size[worst], 1e-300)
    return np.interp(size, sizes, [stress_at_force(problem, theta, b, one * along) for one in sizes])


def _running_maximum(values: Array, half: int) -> Array:
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0).max(axis=-1))


def _transition(model: DropModel, speed: float, dt: float) -> tuple[Array, Array, int]:
    """Discrete transition of ``[motion, forces, rates]`` and the gravity step, by the matrix exponential."""
    from scipy.linalg import expm

    p = model.parameters
    m, n_b = len(p.eigenvalue), len(p.bearing_shape)
    n, k = 4 * m, 2 * n_b
    size = n + 2 * k + 1
    A = np.zeros((size, size))
    A[: 2 * m, 2 * m : n] = np.eye(2 * m)
    for axis, sign in ((0, -1.0), (1, 1.0)):
        rows = slice(2 * m + axis * m, 2 * m + (axis + 1) * m)
        A[rows, axis * m : (axis + 1) * m] = -np.diag(p.eigenvalue)
        A[rows, rows] = -np.diag(p.damping)
        other = slice(2 * m + (1 - axis) * m, 2 * m + (2 - axis) * m)
        A[rows, other] = sign * speed * p.polar
        for b in range(n_b):
            A[rows, n + 2 * b + axis] = -p.bearing_shape[b]
    A[3 * m : n, -1] = p.gravity
    A[n : n + k, n + k : n + 2 * k] = np.eye(k)
    E = expm(A * dt)
    return E[:-1, :-1], E[:-1, -1], n


def _smooth_forces(problem: DropProblem, readings: Array, gate: NDArray[np.bool_], rate: Array) -> Array:
    model = problem.model
    dt = float(problem.time[1] - problem.time[0])
    speed = float(problem.mean[model.layout.rotor_speed])
    A, gravity, n = _transition(model, speed, dt)
    m, n_b = model.layout.n_modes, len(model.parameters.bearing_shape)
    k = 2 * n_b
    count, size = len(readings), len(A)
    C = np.zeros((problem.n_channels, size))
    C[:, : 2 * m] = problem.sensor_rows[:, : 2 * m]
    x = np.zeros(size)
    x[: 2 * m] = problem.mean[: 2 * m]
    start = np.diag(problem.covariance)
    P = np.zeros((size, size))
    P[: 2 * m, : 2 * m] = np.diag(start[: 2 * m])
    velocity = model.layout.velocity_of(slice(0, 2 * m))
    P[2 * m : n, 2 * m : n] = np.diag(start[velocity])
    identity = np.eye(size)
    hold = np.zeros((k, size))
    hold[:, n : n + k] = np.eye(k)
    predicted, filtered = np.empty((count, size)), np.empty((count, size))
    P_predicted, P_filtered = np.empty((count, size, size)), np.empty((count, size, size))
    for i in range(count):
        if i > 0:
            x = A @ x + gravity
            P = A @ P @ A.T
            noise = np.repeat(rate[i], 2) ** 2
            P[range(n, n + k), range(n, n + k)] += noise * dt**2 * 0.25
            P[range(n + k, size), range(n + k, size)] += (noise / dt**2) * dt**2
        predicted[i], P_predicted[i] = x, P
        closed, heard = np.repeat(gate[i], 2), np.isfinite(readings[i])
        H = np.vstack([C[heard], hold[closed]])
        z = np.concatenate([readings[i, heard], np.zeros(int(closed.sum()))])
        R = np.diag(np.concatenate([problem.variances[heard], np.full(int(closed.sum()), GATE_SIGMA**2)]))
        S = H @ P @ H.T + R
        K = np.linalg.solve(S, H @ P).T
        x = x + K @ (z - H @ x)
        left = identity - K @ H
        P = left @ P @ left.T + (K * np.diag(R)) @ K.T  # Joseph form: stays positive with a channel missing
        P = 0.5 * (P + P.T)
        filtered[i], P_filtered[i] = x, P
    return _rauch(A, gravity, predicted, filtered, P_predicted, P_filtered)[:, n : n + k].reshape(
        count, n_b, 2
    )


def _rauch(
    A: Array, gravity: Array, predicted: Array, filtered: Array, P_predicted: Array, P_filtered: Array
) -> Array:
    smoothed = filtered.copy()
    jitter = 1e-12 * np.eye(A.shape[0])
    for i in range(len(filtered) - 2, -1, -1):
        scale = np.sqrt(np.maximum(np.diag(P_predicted[i + 1]), 1e-300))
        normal = P_predicted[i + 1] / np.outer(scale, scale) + jitter
        gain = np.linalg.solve(normal, (A @ P_filtered[i]) / scale[:, None]).T / scale
        smoothed[i] = filtered[i] + gain @ (smoothed[i + 1] - predicted[i + 1])
    return smoothed
