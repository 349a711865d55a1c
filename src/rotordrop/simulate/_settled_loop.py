"""The compiled loop for the settled part of a coast-down: one right-hand side per step.

Once the rotor lies in its races for good, nothing but stability bounds the step of a Runge–Kutta pair: the
races swing on contact and balls at 8 kHz although nothing excites them there. Per evaluation the velocity
Verlet scheme stays stable over a five times longer time, and with 20 to 40 steps per millisecond its second
order shifts a line at 250 Hz by less than 0.01 %.
"""

from __future__ import annotations

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.physics._compile import kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.simulate._rhs import Scratch, drop_derivative, scratch_of


@kernel
def race_damping_rates(p: KernelParameters, n: int) -> Array:
    """Damping over mass [1/s] of the race velocities, shape (n,); zero for every other state."""
    rates = np.zeros(n)
    for b in range(p.bearing.shape[0]):
        if p.bearing_at[b, L.RACE] < 0:
            continue
        rate = p.bearing[b, L.BEARING_DAMPING] / p.bearing[b, L.RACE_MASS]
        race = p.rotor_at[L.N_COORDINATES] + p.bearing_at[b, L.RACE]
        rates[race] = rate
        rates[race + 1] = rate
    return rates


@kernel
def settled_step(
    t: float, h: float, y: Array, d: Array, y_new: Array, d_new: Array, p: KernelParameters, work: Scratch
) -> None:
    """One step of velocity Verlet from (y, d) to (y_new, d_new), d being the derivative of the state.

    Forces that depend on velocity are taken at the velocity extrapolated to the end of the step.
    """
    n = y.shape[0]
    n_q = p.rotor_at[L.N_COORDINATES]
    half = 0.5 * h
    for i in range(n_q):
        y_new[i] = y[i] + h * (y[n_q + i] + half * d[n_q + i])
    for i in range(n_q, n):
        y_new[i] = y[i] + h * d[i]
    drop_derivative(t + h, y_new, p, d_new, work)
    for i in range(n_q, n):
        y_new[i] = y[i] + half * (d[i] + d_new[i])


@kernel
def damp_races(
    h: float, y: Array, d: Array, y_new: Array, d_new: Array, p: KernelParameters, rates: Array
) -> None:
    """Take the ball-set damping of the races implicitly: explicitly it would bound the step."""
    half = 0.5 * h
    for b in range(p.bearing.shape[0]):
        if p.bearing_at[b, L.RACE] < 0:
            continue
        race = p.rotor_at[L.N_COORDINATES] + p.bearing_at[b, L.RACE]
        for i in range(race, race + 2):
            # The right-hand side has taken the damping at the velocity assumed; found is the velocity at
            # which it would have been right.
            assumed = y[i] + h * d[i]
            found = (y[i] + half * (d[i] + d_new[i] + rates[i] * assumed)) / (1.0 + half * rates[i])
            d_new[i] -= rates[i] * (found - assumed)
            y_new[i] = found


@kernel
def integrate_settled(
    y: Array,
    t: float,
    output_step: float,
    parts: int,
    p: KernelParameters,
    stop_speed: float,
    states: Array,
    books: Array,
) -> int:
    """Integrate a settled rotor over ``len(states)`` samples, ``parts`` equal steps to a sample.

    Parameters
    ----------
    y : ndarray, shape (n,)
        State at time ``t`` [s]; replaced by the state at the last sample reached.
    output_step : float
        Distance of the samples [s].
    stop_speed : float
        The loop ends at the last sample before the rotor turns no faster than this [rad/s]; negative: never.
    states : ndarray, shape (T, n)
        Filled with the states one, two, … output steps after ``t``.
    books : ndarray, shape (B + 1, 5)
        Energy lost so far by place [J], by the powers at the samples.

    Returns
    -------
    int
        Number of samples filled; fewer than T only when the rotor is about to stand still.
    """
    n = y.shape[0]
    i_w = p.rotor_at[L.ROTOR_SPEED]
    rates = race_damping_rates(p, n)
    work = scratch_of(p)
    state = y.copy()
    y_new = np.empty(n)
    d = np.empty(n)
    d_new = np.empty(n)
    h = output_step / parts
    sense = 1.0 if y[i_w] >= 0.0 else -1.0
    drop_derivative(t, state, p, d, work)
    for sample in range(states.shape[0]):
        for part in range(parts):
            now = t + sample * output_step + part * h
            settled_step(now, h, state, d, y_new, d_new, p, work)
            damp_races(h, state, d, y_new, d_new, p, rates)
            state, y_new = y_new, state
            d, d_new = d_new, d
        if stop_speed >= 0.0 and sense * state[i_w] <= stop_speed:
            return sample
        for i in range(n):
            y[i] = state[i]
            states[sample, i] = state[i]
        for b in range(books.shape[0]):
            for i in range(books.shape[1]):
                books[b, i] += output_step * work.power[b, i]
    return int(states.shape[0])
