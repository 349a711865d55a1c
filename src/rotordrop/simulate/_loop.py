"""The compiled time loop: one explicit adaptive Runge–Kutta integration of a drop, crossed once per drop."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.physics._compile import inner_kernel, kernel, lean_kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import atan2, exp, ln, power
from rotordrop.simulate._rhs import contact_state, drop_derivative, relative_motion
from rotordrop.simulate._tableau import Tableau

Array = NDArray[np.float64]

# Outcome of the loop.
FINISHED = 0
STEP_TOO_SMALL = 1
TOO_MANY_STEPS = 2
NOT_FINITE = 3
STANDSTILL = 4

# Columns of the contact log.
LOG_BEARING = 0
LOG_START = 1
LOG_END = 2
LOG_PEAK_FORCE = 3
LOG_PEAK_TIME = 4
LOG_AZIMUTH = 5
LOG_IMPULSE = 6
LOG_DISSIPATED = 7
LOG_SLIDING = 8
N_LOG_COLUMNS = 9

# Columns of the running contact of each bearing.
RUN_IN_CONTACT = 0
RUN_FORCE = 1
RUN_POWER = 2
RUN_DELTA = 3
RUN_SLIDING = 4
N_RUN_COLUMNS = 5

SAFETY = 0.9
SHRINK = 0.2
GROW = 5.0
BETA = 0.04
ALPHA = 0.2 - 0.75 * BETA
LOG_SMALLEST_ERROR = -9.210340371976182  # ln 1e-4, written out: a library may round it otherwise


@inner_kernel
def combine(y: Array, h: float, weights: Array, k: Array, count: int, out: Array) -> None:
    """Fill ``out`` with ``y + h Σ_j weights_j k_j`` over the first ``count`` stages, summed in order."""
    n = y.shape[0]
    first, w = k[0], weights[0]
    for i in range(n):
        out[i] = w * first[i]
    for j in range(1, count):
        stage, w = k[j], weights[j]
        for i in range(n):
            out[i] += w * stage[i]
    for i in range(n):
        out[i] = y[i] + h * out[i]


@lean_kernel
def runge_kutta_stages(
    t: float, h: float, y: Array, p: KernelParameters, tab: Tableau, k: Array, y_new: Array, work: Array
) -> None:
    """Fill stages 2 to 7 (stage 1 is ``k[0]``) and the new state."""
    for stage in range(1, 7):
        combine(y, h, tab.a[stage], k, stage, y_new)
        drop_derivative(t + tab.c[stage] * h, y_new, p, k[stage], work)


@inner_kernel
def scaled_error(
    h: float, y: Array, y_new: Array, k: Array, e: Array, scale: Array, tolerance: float, scratch: Array
) -> float:
    """Root mean square over the states of the embedded error over ``tolerance · (scale + |y|)``."""
    n = scale.shape[0]
    first, w = k[0], e[0]
    for i in range(n):
        scratch[i] = w * first[i]
    for j in range(1, 7):
        stage, w = k[j], e[j]
        for i in range(n):
            scratch[i] += w * stage[i]
    for i in range(n):
        ratio = h * scratch[i] / (scale[i] + max(abs(y[i]), abs(y_new[i])))
        scratch[i] = ratio * ratio
    total = 0.0
    for i in range(n):
        total += scratch[i]
    return math.sqrt(total / n) / tolerance


@lean_kernel
def dense_output(theta: float, h: float, y: Array, k: Array, tab: Tableau, out: Array) -> None:
    """State within a step at fraction ``theta``, fourth order."""
    t2 = theta * theta
    n = y.shape[0]
    for i in range(n):
        out[i] = 0.0
    for j in range(7):
        p = tab.p[j]
        w = p[0] * theta + t2 * (p[1] + theta * (p[2] + theta * p[3]))
        stage = k[j]
        for i in range(n):
            out[i] += w * stage[i]
    for i in range(n):
        out[i] = y[i] + h * out[i]


@inner_kernel
def contact_values(
    b: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """Contact of one bearing in a state: indentation [m], normal force [N], friction force [N], normal
    x and y [1], power dissipated in the contact [W] and the part of it that sliding takes [W].
    """
    ux, uy, vx, vy = relative_motion(b, y, p)
    omega, omega_i = y[p.rotor_at[L.ROTOR_SPEED]], y[p.bearing_at[b, L.RACE_SPIN]]
    delta, F_r, mu, nx, ny, v_t, elastic = contact_state(ux, uy, vx, vy, omega, omega_i, p.bearing[b])
    sliding = mu * F_r * v_t
    power = sliding + (F_r - elastic) * (vx * nx + vy * ny)
    return delta, F_r, mu * F_r, nx, ny, power, sliding


@inner_kernel
def contact_at(b: int, y: Array, p: KernelParameters, out: Array) -> None:
    """Fill ``out`` (6,) with the contact of one bearing in a state, in the order of `contact_values`."""
    out[0], out[1], out[2], out[3], out[4], out[5], _sliding = contact_values(b, y, p)


@lean_kernel
def crossing_fraction(
    b: int,
    h: float,
    y: Array,
    k: Array,
    tab: Tableau,
    p: KernelParameters,
    delta_0: float,
    scratch: Array,
) -> float:
    """Fraction of a step at which the indentation changes sign, by bisection on the dense output."""
    # Bisection, not Newton: the normal speed may pass zero within the step, and thirty halvings are few
    # against the right-hand sides of a step.
    low = 0.0
    high = 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        dense_output(middle, h, y, k, tab, scratch)
        ux, uy, _vx, _vy = relative_motion(b, scratch, p)
        if (math.sqrt(ux * ux + uy * uy) > p.bearing[b, L.AIR_GAP]) == (delta_0 > 0.0):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inner_kernel
def note_peak(time: float, force: float, nx: float, ny: float, entry: Array) -> None:
    """Keep the largest force of a contact with its time and azimuth."""
    if force > entry[LOG_PEAK_FORCE]:
        entry[LOG_PEAK_FORCE] = force
        entry[LOG_PEAK_TIME] = time
        entry[LOG_AZIMUTH] = atan2(ny, nx)


@lean_kernel
def log_contacts(
    t: float,
    h: float,
    y: Array,
    y_new: Array,
    k: Array,
    tab: Tableau,
    p: KernelParameters,
    running: Array,
    log: Array,
    n_log: int,
    scratch: Array,
) -> int:
    """Update the contact log with an accepted step; returns the number of entries opened so far."""
    scratch_time = -math.inf
    for b in range(p.bearing.shape[0]):
        delta, force, _friction, nx, ny, power, sliding = contact_values(b, y_new, p)
        was = running[b, RUN_IN_CONTACT] > 0.0
        touches = delta > 0.0
        begin = t
        end = t + h
        if was != touches:
            moment = t + h * crossing_fraction(b, h, y, k, tab, p, running[b, RUN_DELTA], scratch)
            scratch_time = -math.inf
            if touches:
                begin = moment
            else:
                end = moment
        if touches and not was:
            if n_log < log.shape[0]:
                log[n_log, LOG_BEARING] = b
                log[n_log, LOG_START] = begin
                log[n_log, LOG_END] = np.nan
            n_log += 1
            running[b, RUN_IN_CONTACT] = n_log
        row = int(running[b, RUN_IN_CONTACT]) - 1
        if 0 <= row < log.shape[0]:
            # Impulse and loss by Simpson's rule within the step: the output grid is coarser than an impact.
            middle = 0.5 * (begin + end)
            if middle != scratch_time:
                dense_output((middle - t) / h, h, y, k, tab, scratch)
                scratch_time = middle
            _delta, between, _friction, mid_x, mid_y, mid_power, mid_sliding = contact_values(b, scratch, p)
            sixth = (end - begin) / 6.0
            log[row, LOG_IMPULSE] += sixth * (running[b, RUN_FORCE] + 4.0 * between + force)
            log[row, LOG_DISSIPATED] += sixth * (running[b, RUN_POWER] + 4.0 * mid_power + power)
            log[row, LOG_SLIDING] += sixth * (running[b, RUN_SLIDING] + 4.0 * mid_sliding + sliding)
            note_peak(middle, between, mid_x, mid_y, log[row])
            note_peak(t + h, force, nx, ny, log[row])
            if not touches:
                log[row, LOG_END] = end
        if not touches:
            running[b, RUN_IN_CONTACT] = 0.0
        running[b, RUN_FORCE] = force
        running[b, RUN_POWER] = power
        running[b, RUN_DELTA] = delta
        running[b, RUN_SLIDING] = sliding
    return n_log


@kernel
def start_running(y: Array, t: float, p: KernelParameters, running: Array, log: Array) -> int:
    """Fill the running contacts from a state that may already touch; returns the number of entries opened."""
    n_log = 0
    for b in range(p.bearing.shape[0]):
        delta, force, _friction, nx, ny, power, sliding = contact_values(b, y, p)
        running[b, RUN_IN_CONTACT] = 0.0
        running[b, RUN_FORCE] = force
        running[b, RUN_POWER] = power
        running[b, RUN_DELTA] = delta
        running[b, RUN_SLIDING] = sliding
        if delta > 0.0:
            if n_log < log.shape[0]:
                log[n_log, LOG_BEARING] = b
                log[n_log, LOG_START] = t
                log[n_log, LOG_END] = np.nan
                log[n_log, LOG_PEAK_FORCE] = force
                log[n_log, LOG_PEAK_TIME] = t
                log[n_log, LOG_AZIMUTH] = atan2(ny, nx)
            n_log += 1
            running[b, RUN_IN_CONTACT] = n_log
    return n_log


@kernel
def integrate_drop(  # noqa: C901, PLR0915  one compiled loop
    y0: Array,
    times: Array,
    p: KernelParameters,
    tab: Tableau,
    scale: Array,
    tolerance: float,
    first_step: float,
    largest_step: float,
    most_steps: int,
    states: Array,
    log: Array,
    counters: Array,
) -> int:
    """Integrate a drop over an ascending output grid.

    Parameters
    ----------
    y0 : ndarray, shape (n,)
        Start state at ``times[0]``.
    times : ndarray, shape (T,)
        Output grid [s].
    scale : ndarray, shape (s,)
        Size of each state that error control looks at; the states behind (angle, energies) follow.
    states : ndarray, shape (T, n)
        Filled with the states on the grid.
    log : ndarray, shape (R, 9)
        Filled with the contacts, columns ``LOG_*``.
    counters : ndarray, shape (5,)
        Filled with accepted steps, rejected steps, last step [s], contacts, time reached [s].

    Returns
    -------
    int
        ``FINISHED`` or why it ended early.
    """
    n = y0.shape[0]
    y = y0.copy()
    y_new = np.empty(n)
    k = np.empty((7, n))
    work = np.empty((2, p.balls.shape[2]))
    scratch = np.empty(n)
    running = np.zeros((p.bearing.shape[0], N_RUN_COLUMNS))
    log[:, :] = 0.0
    n_log = start_running(y, times[0], p, running, log)
    t = times[0]
    t_end = times[-1]
    states[0] = y
    done = 1
    h = min(first_step, largest_step)
    log_previous = 0.0
    accepted = 0
    rejected = 0
    outcome = FINISHED
    drop_derivative(t, y, p, k[0], work)
    while t < t_end:
        if accepted + rejected >= most_steps:
            outcome = TOO_MANY_STEPS
            break
        step = min(h, t_end - t)
        runge_kutta_stages(t, step, y, p, tab, k, y_new, work)
        error = scaled_error(step, y, y_new, k, tab.e, scale, tolerance, scratch)
        if not error <= 1.0:
            rejected += 1
            if not math.isfinite(error):
                h = 0.1 * step
            else:
                h = step * max(SHRINK, SAFETY * power(error, -0.2))
            if h < 1e-14:
                outcome = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
                break
            continue
        accepted += 1
        t_new = t + step
        if step < h:
            t_new = t_end
        while done < times.shape[0] and times[done] <= t_new:
            dense_output((times[done] - t) / step, step, y, k, tab, states[done])
            done += 1
        n_log = log_contacts(t, step, y, y_new, k, tab, p, running, log, n_log, scratch)
        # PI control (Gustafsson): the error of the step before damps the swing between steps too long and too
        # short that every opening of a contact starts.
        growth = GROW
        log_error = LOG_SMALLEST_ERROR
        if error > 0.0:
            log_error = ln(error)
            growth = min(GROW, max(SHRINK, SAFETY * exp(BETA * log_previous - ALPHA * log_error)))
        log_previous = max(log_error, LOG_SMALLEST_ERROR)
        h = min(step * growth, largest_step) if step >= h else h
        t = t_new
        # The last stage is the first of the next step, also where a contact opens: forces are continuous.
        for i in range(n):
            y[i] = y_new[i]
            k[0, i] = k[6, i]
    counters[0] = accepted
    counters[1] = rejected
    counters[2] = h
    counters[3] = n_log
    counters[4] = t
    while done < times.shape[0]:
        states[done] = np.nan
        done += 1
    return outcome
