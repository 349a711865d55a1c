"""The compiled time loop: one explicit adaptive Runge–Kutta integration of a drop, crossed once per drop."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.model import layout as L
from rotordrop.model.layout import KernelParameters
from rotordrop.physics._compile import kernel
from rotordrop.simulation._rhs import contact_state, drop_derivative, project
from rotordrop.simulation._tableau import Tableau

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
N_LOG_COLUMNS = 8

# Columns of the running contact of each bearing.
RUN_IN_CONTACT = 0
RUN_FORCE = 1
RUN_POWER = 2
RUN_DELTA = 3

SAFETY = 0.9
SHRINK = 0.2
GROW = 5.0
BETA = 0.04


@kernel
def runge_kutta_stages(
    t: float, h: float, y: Array, p: KernelParameters, tab: Tableau, k: Array, y_new: Array, work: Array
) -> None:
    """Fill stages 2 to 7 (stage 1 is ``k[0]``) and the new state."""
    n = y.shape[0]
    a = tab.a
    for i in range(n):
        y_new[i] = y[i] + h * a[1, 0] * k[0, i]
    drop_derivative(t + tab.c[1] * h, y_new, p, k[1], work)
    for i in range(n):
        y_new[i] = y[i] + h * (a[2, 0] * k[0, i] + a[2, 1] * k[1, i])
    drop_derivative(t + tab.c[2] * h, y_new, p, k[2], work)
    for i in range(n):
        y_new[i] = y[i] + h * (a[3, 0] * k[0, i] + a[3, 1] * k[1, i] + a[3, 2] * k[2, i])
    drop_derivative(t + tab.c[3] * h, y_new, p, k[3], work)
    for i in range(n):
        y_new[i] = y[i] + h * (a[4, 0] * k[0, i] + a[4, 1] * k[1, i] + a[4, 2] * k[2, i] + a[4, 3] * k[3, i])
    drop_derivative(t + tab.c[4] * h, y_new, p, k[4], work)
    for i in range(n):
        y_new[i] = y[i] + h * (
            a[5, 0] * k[0, i] + a[5, 1] * k[1, i] + a[5, 2] * k[2, i] + a[5, 3] * k[3, i] + a[5, 4] * k[4, i]
        )
    drop_derivative(t + h, y_new, p, k[5], work)
    for i in range(n):
        y_new[i] = y[i] + h * (
            a[6, 0] * k[0, i]
            + a[6, 1] * k[1, i]
            + a[6, 2] * k[2, i]
            + a[6, 3] * k[3, i]
            + a[6, 4] * k[4, i]
            + a[6, 5] * k[5, i]
        )
    drop_derivative(t + h, y_new, p, k[6], work)


@kernel
def scaled_error(
    h: float, y: Array, y_new: Array, k: Array, e: Array, scale: Array, tolerance: float
) -> float:
    """Root mean square over the states of the embedded error over ``tolerance · (scale + |y|)``."""
    total = 0.0
    n = scale.shape[0]
    for i in range(n):
        error = h * (
            e[0] * k[0, i]
            + e[1] * k[1, i]
            + e[2] * k[2, i]
            + e[3] * k[3, i]
            + e[4] * k[4, i]
            + e[5] * k[5, i]
            + e[6] * k[6, i]
        )
        ratio = error / (scale[i] + max(abs(y[i]), abs(y_new[i])))
        total += ratio * ratio
    return math.sqrt(total / n) / tolerance


@kernel
def dense_output(theta: float, h: float, y: Array, k: Array, tab: Tableau, out: Array) -> None:
    """State within a step at fraction ``theta``, fourth order."""
    t2 = theta * theta
    w = np.empty(7)
    for j in range(7):
        w[j] = h * (tab.p[j, 0] * theta + t2 * (tab.p[j, 1] + theta * (tab.p[j, 2] + theta * tab.p[j, 3])))
    for i in range(y.shape[0]):
        out[i] = y[i] + (
            w[0] * k[0, i]
            + w[1] * k[1, i]
            + w[2] * k[2, i]
            + w[3] * k[3, i]
            + w[4] * k[4, i]
            + w[5] * k[5, i]
            + w[6] * k[6, i]
        )


@kernel
def contact_at(b: int, y: Array, p: KernelParameters, out: Array) -> None:
    """Contact of one bearing in a state: indentation [m], normal force [N], friction force [N], normal, power
    [W].

    Filled as ``delta, F_r, F_mu, n_x, n_y, power dissipated in the contact``.
    """
    m = p.eigenvalue.shape[0]
    n_b = p.bearing.shape[0]
    n_q = 2 * m + 4 * n_b
    r = 2 * m + 2 * b
    shape = p.bearing_shape[b]
    ux = project(shape, y[:m]) - y[r]
    uy = project(shape, y[m : 2 * m]) - y[r + 1]
    vx = project(shape, y[n_q : n_q + m]) - y[n_q + r]
    vy = project(shape, y[n_q + m : n_q + 2 * m]) - y[n_q + r + 1]
    row = p.bearing[b]
    delta, F_r, mu, nx, ny, v_t = contact_state(ux, uy, vx, vy, y[2 * n_q + n_b], y[2 * n_q + b], row)
    elastic = 0.0
    if delta > 0.0:
        elastic = row[L.CONTACT_STIFFNESS] * delta ** row[L.CONTACT_EXPONENT]
    out[0] = delta
    out[1] = F_r
    out[2] = mu * F_r
    out[3] = nx
    out[4] = ny
    out[5] = mu * F_r * v_t + (F_r - elastic) * (vx * nx + vy * ny)


@kernel
def crossing_fraction(
    b: int,
    h: float,
    y: Array,
    k: Array,
    tab: Tableau,
    p: KernelParameters,
    delta_0: float,
    scratch: Array,
    out: Array,
) -> float:
    """Fraction of a step at which the indentation changes sign, by bisection on the dense output."""
    low = 0.0
    high = 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        dense_output(middle, h, y, k, tab, scratch)
        contact_at(b, scratch, p, out)
        if (out[0] > 0.0) == (delta_0 > 0.0):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel
def note_peak(time: float, contact: Array, entry: Array) -> None:
    """Keep the largest force of a contact with its time and azimuth."""
    if contact[1] > entry[LOG_PEAK_FORCE]:
        entry[LOG_PEAK_FORCE] = contact[1]
        entry[LOG_PEAK_TIME] = time
        entry[LOG_AZIMUTH] = math.atan2(contact[4], contact[3])


@kernel
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
    now = np.empty(6)
    between = np.empty(6)
    for b in range(p.bearing.shape[0]):
        contact_at(b, y_new, p, now)
        was = running[b, RUN_IN_CONTACT] > 0.0
        touches = now[0] > 0.0
        begin = t
        end = t + h
        if was != touches:
            moment = t + h * crossing_fraction(b, h, y, k, tab, p, running[b, RUN_DELTA], scratch, between)
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
            middle = 0.5 * (begin + end)
            dense_output((middle - t) / h, h, y, k, tab, scratch)
            contact_at(b, scratch, p, between)
            sixth = (end - begin) / 6.0
            log[row, LOG_IMPULSE] += sixth * (running[b, RUN_FORCE] + 4.0 * between[1] + now[1])
            log[row, LOG_DISSIPATED] += sixth * (running[b, RUN_POWER] + 4.0 * between[5] + now[5])
            note_peak(middle, between, log[row])
            note_peak(t + h, now, log[row])
            if not touches:
                log[row, LOG_END] = end
        if not touches:
            running[b, RUN_IN_CONTACT] = 0.0
        running[b, RUN_FORCE] = now[1]
        running[b, RUN_POWER] = now[5]
        running[b, RUN_DELTA] = now[0]
    return n_log


@kernel
def start_running(y: Array, t: float, p: KernelParameters, running: Array, log: Array) -> int:
    """Fill the running contacts from a state that may already touch; returns the number of entries opened."""
    now = np.empty(6)
    n_log = 0
    for b in range(p.bearing.shape[0]):
        contact_at(b, y, p, now)
        running[b, RUN_IN_CONTACT] = 0.0
        running[b, RUN_FORCE] = now[1]
        running[b, RUN_POWER] = now[5]
        running[b, RUN_DELTA] = now[0]
        if now[0] > 0.0:
            if n_log < log.shape[0]:
                log[n_log, LOG_BEARING] = b
                log[n_log, LOG_START] = t
                log[n_log, LOG_END] = np.nan
                log[n_log, LOG_PEAK_FORCE] = now[1]
                log[n_log, LOG_PEAK_TIME] = t
                log[n_log, LOG_AZIMUTH] = math.atan2(now[4], now[3])
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
    log : ndarray, shape (R, 8)
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
    work = np.empty((2, p.ball_cos.shape[1]))
    scratch = np.empty(n)
    running = np.zeros((p.bearing.shape[0], 4))
    log[:, :] = 0.0
    n_log = start_running(y, times[0], p, running, log)
    t = times[0]
    t_end = times[-1]
    states[0] = y
    done = 1
    h = min(first_step, largest_step)
    previous = 1.0
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
        error = scaled_error(step, y, y_new, k, tab.e, scale, tolerance)
        if not error <= 1.0:
            rejected += 1
            if not math.isfinite(error):
                h = 0.1 * step
            else:
                h = step * max(SHRINK, SAFETY * error**-0.2)
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
        growth = GROW
        if error > 0.0:
            growth = min(GROW, max(SHRINK, SAFETY * error ** -(0.2 - 0.75 * BETA) * previous**BETA))
        previous = max(error, 1e-4)
        h = min(step * growth, largest_step) if step >= h else h
        t = t_new
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
