"""The loop of a magnet near its operating point: controller in discrete time, margins, closed loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rotordrop.arrays import Array


class SampledController(NamedTuple):
    """A controller of one axis in discrete time: ``x ← A x + B e + G (u_limited − u)``, ``u = C x + D e``."""

    step: Array
    """A, shape (n, n)."""
    input: Array
    """B, shape (n,)."""
    output: Array
    """C, shape (n,)."""
    direct: float
    """D [A/m]."""
    unwind: Array
    """G, shape (n,)."""


def sampled_pid(
    gains: tuple[float, float, float], cutoff: float, sample_time: float, tracking: float
) -> SampledController:
    """A PID controller in discrete time, by the trapezoidal rule: ``P + I/s + D s / (1 + s/ω_f)``.

    Parameters
    ----------
    gains : tuple of float
        P [A/m], I [A/(m s)], D [A s/m].
    cutoff : float
        Cut-off of the derivative [rad/s].
    sample_time : float
        Time between two samples [s].
    tracking : float
        Time in which the integral follows an output at its limit [s]; zero: it does not.

    Notes
    -----
    Source: Åström and Hägglund 2006, chapter 13 (discretisation) and 3 (anti-windup by tracking).
    """
    proportional, integral, derivative = gains
    w = cutoff * sample_time
    pole, gain = (2.0 - w) / (2.0 + w), w / (2.0 + w)
    follows = sample_time / (tracking * integral) if tracking and integral else 0.0
    return SampledController(
        step=np.diag([1.0, pole]),
        input=np.array([sample_time, gain * (1.0 + pole)]),
        output=np.array([integral, -derivative * cutoff]),
        direct=proportional + 0.5 * integral * sample_time + derivative * cutoff * (1.0 - gain),
        unwind=np.array([follows, 0.0]),
    )


def sampled_response(
    omega: float, controller: SampledController, sample_time: float, delay: float
) -> complex:
    """Response [A/m] of a sampled controller with hold and delay [s] at a frequency [rad/s].

    Of outputs held for a sample time [s]; its images at higher frequencies are left out. Source: z-transform
    at ``e^{jωT}``, zero-order hold.
    """
    z = np.exp(1j * omega * sample_time)
    n = len(controller.step)
    states = np.linalg.solve(z * np.eye(n) - controller.step, controller.input) if n else np.zeros(0)
    inside = complex(controller.output @ states) + controller.direct
    held = (1.0 - 1.0 / z) / (1j * omega * sample_time)
    return complex(inside * held * np.exp(-1j * omega * delay))


class Margins(NamedTuple):
    """Where the gain of a loop falls through one, and what is left there."""

    crossover: float
    """Frequency [rad/s]."""
    phase: float
    """Phase margin [rad]; negative where the loop is unstable."""
    delay: float
    """Further delay up to the limit of stability [s]."""


def margins(loop: Callable[[float], complex], slowest: float, fastest: float) -> Margins | None:
    """Margins of a loop at the last frequency where its gain falls through one; None where it never does.

    ``loop`` gives the open loop [1] at a frequency, searched between two of them [rad/s]. Source: Nyquist
    criterion of a plant with one unstable pole, ``L(jω)`` with the sign of negative feedback.
    """
    grid = np.geomspace(slowest, fastest, 2000)
    above = np.array([abs(loop(float(w))) > 1.0 for w in grid])
    falls = np.flatnonzero(above[:-1] & ~above[1:])
    if not falls.size:
        return None
    low, high = float(grid[falls[-1]]), float(grid[falls[-1] + 1])
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if abs(loop(middle)) > 1.0 else (low, middle)
    crossover = 0.5 * (low + high)
    value = loop(crossover)
    phase = math.remainder(math.atan2(value.imag, value.real) + math.pi, 2.0 * math.pi)
    return Margins(crossover, phase, phase / crossover)


def closed_loop(
    plant: tuple[Array, Array, Array], controllers: list[SampledController], sample_time: float, delay: float
) -> Array:
    """Matrix [1] that moves a sampled loop on by one sample.

    Parameters
    ----------
    plant : tuple of ndarray
        ``ż = A z + B r`` and what the controllers see of it, ``C z``: shapes (n, n), (n, k), (k, n); SI
        units, rates [1/s].
    controllers : list of SampledController
        One for each of the k inputs.
    sample_time, delay : float
        Time between samples, and from a sample to its output [s].

    Notes
    -----
    Source: Franklin, Powell and Workman 1998, a plant with hold and a delay of any length.
    """
    rate, entry, seen = plant
    n, k = entry.shape
    whole = int(delay / sample_time + 1e-9)
    part = max(delay - whole * sample_time, 0.0)
    first, by_first = _held(rate, entry, part)
    second, by_second = _held(rate, entry, sample_time - part)
    orders = [len(one.step) for one in controllers]
    n_c, past = sum(orders), whole + 1
    # states: plant, controllers, outputs of the last samples, newest first
    put = np.zeros((k, n + n_c + past * k))
    matrix = np.zeros((put.shape[1], put.shape[1]))
    matrix[:n, :n] = second @ first
    at = n
    for i, (one, order) in enumerate(zip(controllers, orders, strict=True)):
        states = slice(at, at + order)
        put[i, :n] = -one.direct * seen[i]
        put[i, states] = one.output
        matrix[states, :n] = -np.outer(one.input, seen[i])
        matrix[states, states] = one.step
        at += order
    outputs = [put, *(np.eye(past * k, put.shape[1], n + n_c)[j * k : (j + 1) * k] for j in range(past))]
    matrix[:n] += by_second @ outputs[whole] + second @ by_first @ outputs[whole + 1]
    for j in range(past):
        matrix[n + n_c + j * k : n + n_c + (j + 1) * k] = outputs[j]
    return matrix


def _held(rate: Array, entry: Array, time: float) -> tuple[Array, Array]:
    """How a state moves on in a time [s], by itself and by a constant input."""
    from scipy.linalg import expm

    n, k = entry.shape
    both = np.zeros((n + k, n + k))
    both[:n, :n], both[:n, n:] = rate, entry
    moved = expm(both * time)
    return moved[:n, :n], moved[:n, n:]


def growth(matrix: Array, sample_time: float) -> tuple[float, float]:
    """Rate [1/s] at which a sampled loop grows fastest, negative where it is stable, and at what frequency
    [Hz].

    Of the matrix of `closed_loop` and its sample time [s]. Source: eigenvalue of largest magnitude.
    """
    values = np.linalg.eigvals(matrix)
    worst = values[int(np.argmax(np.abs(values)))]
    turn = abs(math.atan2(worst.imag, worst.real)) / (2.0 * math.pi * sample_time)
    return math.log(max(abs(worst), 1e-300)) / sample_time, turn


class Lift(NamedTuple):
    """How a magnet lifts what lies below its middle, as far as its slopes hold."""

    spare: float
    """Force at full current beyond weight and negative stiffness [N]; without any it does not lift."""
    deepest: float
    """Depth from which it lifts nothing any more [m]."""
    time: float
    """Time to the middle at full current from the first moment on [s]; infinite where it does not lift."""
    speed: float
    """Speed there [m/s]."""


def linear_lift(
    mass: float, slopes: tuple[float, float], current: float, weight: float, depth: float
) -> Lift:
    """Lift of a mass [kg] at rest at a depth [m], by full current.

    ``slopes`` k_i [N/A] and k_s [N/m], control current [A], weight [N]. Source: ``m ẍ = k_i i + k_s x − W``,
    whose solution is ``x = x_e + (x0 − x_e) cosh λt`` with ``λ² = k_s/m``; Schweitzer and Maslen 2009.
    """
    by_current, by_way = slopes
    deepest = (by_current * current - weight) / by_way
    spare = by_way * (deepest - depth)
    if spare <= 0.0:
        return Lift(spare, deepest, math.inf, 0.0)
    rate = math.sqrt(by_way / mass)
    time = math.acosh(deepest / (deepest - depth)) / rate
    return Lift(spare, deepest, time, rate * math.sqrt(deepest**2 - (deepest - depth) ** 2))
