"""The compiled time loop of a hidden machine: the pair of the simulated drop, its own right-hand side."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.physics._compile import kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import exp, ln, power
from rotordrop.simulate._loop import (
    ALPHA,
    BETA,
    FINISHED,
    GROW,
    LOG_SMALLEST_ERROR,
    NOT_FINITE,
    SAFETY,
    SHRINK,
    STEP_TOO_SMALL,
    TOO_MANY_STEPS,
    combine,
    dense_output,
    scaled_error,
)
from rotordrop.simulate._tableau import Tableau
from rotordrop_bench._hidden_rhs import hidden_derivative

Array = NDArray[np.float64]


@kernel
def integrate_hidden(  # noqa: C901, PLR0915  one compiled loop
    y0: Array,
    times: Array,
    before: KernelParameters,
    after: KernelParameters,
    change: float,
    s: Array,
    tab: Tableau,
    scale: Array,
    tolerance: float,
    first_step: float,
    largest_step: float,
    most_steps: int,
    states: Array,
    counters: Array,
) -> int:
    """Integrate the drop of a hidden machine over an ascending output grid.

    Parameters
    ----------
    y0 : ndarray, shape (n,)
        Start state at ``times[0]``; behind the states of the drop those of the structures.
    times : ndarray, shape (T,)
        Output grid [s].
    before, after : KernelParameters
        The machine until the change and from then on.
    change : float
        When it changes [s].
    s : ndarray, shape (B, C)
        Structures of the bearings.
    scale : ndarray, shape (n,)
        Size of each state for the control of the step; infinite where nothing looks.
    states : ndarray, shape (T, n)
        Filled with the states on the grid.
    counters : ndarray, shape (3,)
        Filled with accepted steps, rejected steps, time reached [s].

    Returns
    -------
    int
        ``FINISHED`` or why it ended early.
    """
    n = y0.shape[0]
    base, controlled = before.rotor_at[L.N_STATES], before.rotor_at[L.N_CONTROLLED]
    y = y0.copy()
    y_new = np.empty(n)
    k = np.zeros((7, n))
    work = np.empty((2, before.balls.shape[2]))
    scratch = np.empty(n)
    t = times[0]
    t_end = times[-1]
    states[0] = y
    done = 1
    h = min(first_step, largest_step)
    log_previous = 0.0
    outcome = FINISHED
    accepted = 0
    rejected = 0
    hidden_derivative(t, y, before if t < change else after, s, k[0], work)
    while t < t_end:
        if accepted + rejected >= most_steps:
            outcome = TOO_MANY_STEPS
            break
        step = min(h, t_end - t)
        # no step reaches across the change: its error estimate would not see a jump behind its last stage
        cut = t < change < t + step
        if cut:
            step = change - t
        p = before if t < change else after
        for stage in range(1, 7):
            combine(y, step, tab.a[stage], k, stage, y_new)
            hidden_derivative(t + tab.c[stage] * step, y_new, p, s, k[stage], work)
        # the structures have their own norm, so that states at rest do not loosen the control of the others
        error = max(
            scaled_error(step, y, y_new, k, tab.e, scale[:controlled], tolerance, scratch),
            scaled_error(step, y[base:], y_new[base:], k[:, base:], tab.e, scale[base:], tolerance, scratch),
        )
        if not error <= 1.0:
            rejected += 1
            h = 0.1 * step
            if math.isfinite(error):
                h = step * max(SHRINK, SAFETY * power(error, -0.2))
            if h < 1e-14:
                outcome = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
                break
            continue
        accepted += 1
        t_new = t + step
        if cut:
            t_new = change
        elif step < h:
            t_new = t_end
        while done < times.shape[0] and times[done] <= t_new:
            dense_output((times[done] - t) / step, step, y, k, tab, states[done])
            done += 1
        growth = GROW
        log_error = LOG_SMALLEST_ERROR
        if error > 0.0:
            log_error = ln(error)
            growth = min(GROW, max(SHRINK, SAFETY * exp(BETA * log_previous - ALPHA * log_error)))
        log_previous = max(log_error, LOG_SMALLEST_ERROR)
        h = min(step * growth, largest_step) if step >= h else h
        t = t_new
        for i in range(n):
            y[i] = y_new[i]
            k[0, i] = k[6, i]
        if cut:
            hidden_derivative(t, y, after, s, k[0], work)
    counters[0] = accepted
    counters[1] = rejected
    counters[2] = t
    while done < times.shape[0]:
        states[done] = np.nan
        done += 1
    return outcome
