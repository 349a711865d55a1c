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
from rotordrop.tracking.smoother import Smoothed

Array = NDArray[np.float64]

GATE_MARGIN = 10e-6
GATE_SIGMA = 3.0
BASE_RATE = 3e5
RATE_PER_FORCE = 3e3
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
    peak_stress : ndarray, shape (B,)
        Largest Hertz stress that this force gives in the bearing as the twin has it [Pa].
    mean_late : ndarray, shape (B,)
        Magnitude of the mean force vector between 0.15 and 0.2 s [N]; NaN when the record is shorter.
    mean_magnitude_late : ndarray, shape (B,)
        Mean magnitude of the force in the same time [N]; NaN when the record is shorter.
    """

    time: Array
    force: Array
    magnitude: Array
    peak: Array
    peak_stress: Array
    mean_late: Array
    mean_magnitude_late: Array


def input_state_estimate(problem: DropProblem, smoothed: Smoothed) -> InputEstimate:
    """Joint estimate of motion and bearing forces from the readings, by a linear filter and smoother.

    The tracked twin lends gains, offsets, air gaps and the radius that gates; no contact, friction or
    support enters. The stress takes the ball bearing, its preload included, from the twin. Both directions
    must be seen in two planes: with less, the rotor model alone does not bound the forces.
    """
    count = len(smoothed.means)
    radius, gaps = _radius_and_gap(problem, smoothed)
    gate = radius < gaps - GATE_MARGIN
    readings = _corrected(problem, smoothed)[:count]
    scale = np.full((count, gate.shape[1]), BASE_RATE)
    force = _smooth_forces(problem, readings, gate, scale)
    local = _running_maximum(np.hypot(force[..., 0], force[..., 1]), 10)
    force = _smooth_forces(problem, readings, gate, BASE_RATE * 0.1 + RATE_PER_FORCE * local)
    time = problem.time[:count]
    magnitude = np.hypot(force[..., 0], force[..., 1])
    late = time >= 0.15
    unknown = np.full(force.shape[1], np.nan)
    whole = time[-1] > 0.199
    at = magnitude.argmax(axis=0)
    stress = [stress_at_force(problem, smoothed, b, force[i, b]) for b, i in enumerate(at)]
    return InputEstimate(
        time=time,
        force=force,
        magnitude=magnitude,
        peak=magnitude.max(axis=0),
        peak_stress=np.array(stress),
        mean_late=np.hypot(*force[late].mean(axis=0).T) if whole else unknown,
        mean_magnitude_late=magnitude[late].mean(axis=0) if whole else unknown,
    )


def _radius_and_gap(problem: DropProblem, smoothed: Smoothed) -> tuple[Array, Array]:
    layout = problem.model.layout
    shapes = problem.model.parameters.bearing_shape
    x = smoothed.means[:, layout.modal_x] @ shapes.T
    y = smoothed.means[:, layout.modal_y] @ shapes.T
    race = smoothed.means[:, layout.race].reshape(len(x), -1, 2)
    gaps = np.array(
        [
            smoothed.means[0][problem.n_dynamic + k]
            for name in problem.model.bearing_names
            for k, unknown in enumerate(problem.unknowns)
            if unknown.path == f"{name}.air_gap"
        ]
    )
    return np.hypot(x - race[..., 0], y - race[..., 1]), gaps


def _corrected(problem: DropProblem, smoothed: Smoothed) -> Array:
    first, n_c = problem.n_dynamic + len(problem.unknowns), problem.n_channels
    gain = smoothed.means[-1][first : first + n_c]
    offset = smoothed.means[-1][first + n_c : first + 2 * n_c]
    return np.asarray((problem.readings - offset) / (1.0 + gain))


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
