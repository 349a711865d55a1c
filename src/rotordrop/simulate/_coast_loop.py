"""The compiled loop of a coast-down: one window of time, landing on its end and on standstill.

Everything the loop carries from one window to the next stands in the arrays it is given (state, progress,
running contacts, open log entries), so a run that is stopped between two windows and taken up again takes
the very same steps.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.physics._compile import kernel
from rotordrop.physics.ball_set import ball_set_force, ball_set_load
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import atan2, power
from rotordrop.simulate._loop import (
    BETA,
    FINISHED,
    GROW,
    NOT_FINITE,
    RUN_DELTA,
    RUN_IN_CONTACT,
    SAFETY,
    SHRINK,
    STANDSTILL,
    STEP_TOO_SMALL,
    TOO_MANY_STEPS,
    dense_output,
    log_contacts,
    runge_kutta_stages,
    scaled_error,
    start_running,
)
from rotordrop.simulate._rhs import drop_derivative, race_deflection
from rotordrop.simulate._tableau import Tableau

Array = NDArray[np.float64]

# Entries of the progress array.
TIME = 0
STEP = 1
PREVIOUS_ERROR = 2
ACCEPTED = 3
REJECTED = 4
SAMPLES = 5
LOGGED = 6
N_PROGRESS = 7

# Columns of the peaks: value and time of each quantity, then the largest travel of the race [m²].
PEAK_INDENTATION = 0
PEAK_FORCE = 2
PEAK_STRESS = 4
PEAK_TRAVEL = 6
N_PEAKS = 7

# Columns of the whirl of each bearing: the present sweep of the azimuth, and the time spent in whole turns.
AZIMUTH = 0
SWEEP_START = 1
SWEEP_START_TIME = 2
SWEEP_END = 3
SWEEP_END_TIME = 4
SWEEP_SENSE = 5
FORWARD_TIME = 6
BACKWARD_TIME = 7
N_WHIRL = 8

TURNING_BACK = 0.5 * math.pi
"""An azimuth that falls back by more than this [rad] has turned round; less is the shiver of an impact."""


@kernel
def update_peaks(t: float, y: Array, p: KernelParameters, running: Array, peaks: Array) -> None:
    """Keep the largest indentation, ball force and stress of each bearing with an accepted state.

    Force and stress are computed only where the race has travelled nearly as far as ever, for they grow with
    its travel; directions differ by how the balls stand, which the margin of 10 % of the square covers.
    The peaks stand over the whole coast-down, so this is rare once the rotor has settled.
    """
    for b in range(p.bearing.shape[0]):
        if running[b, RUN_DELTA] > peaks[b, PEAK_INDENTATION]:
            peaks[b, PEAK_INDENTATION] = running[b, RUN_DELTA]
            peaks[b, PEAK_INDENTATION + 1] = t
        dx, dy = race_deflection(b, y, p)
        travel = dx * dx + dy * dy
        if travel < 0.9 * peaks[b, PEAK_TRAVEL]:
            continue
        peaks[b, PEAK_TRAVEL] = max(travel, peaks[b, PEAK_TRAVEL])
        force, stress = force_and_stress(b, dx, dy, p)
        if force > peaks[b, PEAK_FORCE]:
            peaks[b, PEAK_FORCE] = force
            peaks[b, PEAK_FORCE + 1] = t
        if stress > peaks[b, PEAK_STRESS]:
            peaks[b, PEAK_STRESS] = stress
            peaks[b, PEAK_STRESS + 1] = t


@kernel
def force_and_stress(b: int, dx: float, dy: float, p: KernelParameters) -> tuple[float, float]:
    """Magnitude of the ball force [N] and largest Hertz stress [Pa] for a race moved by (dx, dy) [m]."""
    entries, balls = p.bearing[b, L.BALL_SET : L.BALL_SET_END], p.balls[b]
    F_x, F_y = ball_set_force(entries, balls, dx, dy, np.empty((2, p.balls.shape[2])))
    _load, stress = ball_set_load(entries, balls, dx, dy)
    return math.sqrt(F_x * F_x + F_y * F_y), stress


@kernel
def carry_open_contacts(log: Array, n_log: int, running: Array) -> int:
    """Move the contacts that still last to the head of the log; returns how many they are."""
    kept = 0
    for b in range(running.shape[0]):
        row = int(running[b, RUN_IN_CONTACT]) - 1
        if row < 0:
            continue
        if row >= log.shape[0]:
            running[b, RUN_IN_CONTACT] = 0.0
            continue
        for other in range(b + 1, running.shape[0]):
            if int(running[other, RUN_IN_CONTACT]) - 1 == kept:
                running[other, RUN_IN_CONTACT] = row + 1.0
        for column in range(log.shape[1]):
            held = log[kept, column]
            log[kept, column] = log[row, column]
            log[row, column] = held
        running[b, RUN_IN_CONTACT] = kept + 1.0
        kept += 1
    return kept


@kernel
def start_window(y: Array, t: float, p: KernelParameters, running: Array, log: Array) -> int:
    """Prepare the running contacts of a coast-down from its first state; gives the number of entries."""
    log[:, :] = 0.0
    return start_running(y, t, p, running, log)


@kernel
def integrate_window(  # noqa: C901, PLR0915  one compiled loop
    y: Array,
    times: Array,
    p: KernelParameters,
    tab: Tableau,
    scale: Array,
    tolerance: float,
    largest_step: float,
    most_steps: int,
    stop_speed: float,
    states: Array,
    log: Array,
    running: Array,
    peaks: Array,
    progress: Array,
) -> int:
    """Integrate one window; the last of ``times`` is its end and is landed on exactly.

    Parameters
    ----------
    y : ndarray, shape (n,)
        State at ``progress[TIME]``; replaced by the state at the end.
    times : ndarray, shape (T,)
        Output grid after the present time [s].
    stop_speed : float
        The loop ends when the rotor turns no faster than this [rad/s]; negative: never.
    states : ndarray, shape (T, n)
        Filled with the states on the grid, as far as they were reached.
    log : ndarray, shape (R, 9)
        Contacts; the first entries are those still open.
    running : ndarray, shape (B, 5)
        The running contacts.
    peaks : ndarray, shape (B, 7)
        Peaks of the window.
    progress : ndarray, shape (7,)
        Time [s], next step [s], last error, steps accepted and rejected so far, samples filled, log entries.

    Returns
    -------
    int
        ``FINISHED``, ``STANDSTILL`` or why it ended early.
    """
    n = y.shape[0]
    i_w = p.rotor_at[L.ROTOR_SPEED]
    y_new = np.empty(n)
    k = np.empty((7, n))
    work = np.empty((2, p.balls.shape[2]))
    scratch = np.empty(n)
    t = progress[TIME]
    h = progress[STEP]
    previous = progress[PREVIOUS_ERROR]
    n_log = int(progress[LOGGED])
    t_end = times[-1]
    sense = 1.0 if y[i_w] >= 0.0 else -1.0
    landing = t_end - t
    tried = 0
    done = 0
    outcome = FINISHED
    drop_derivative(t, y, p, k[0], work)
    while t < t_end:
        if tried >= most_steps:
            outcome = TOO_MANY_STEPS
            break
        tried += 1
        step = min(h, t_end - t, landing)
        runge_kutta_stages(t, step, y, p, tab, k, y_new, work)
        error = scaled_error(step, y, y_new, k, tab.e, scale, tolerance, scratch)
        if not error <= 1.0:
            progress[REJECTED] += 1.0
            h = 0.1 * step if not math.isfinite(error) else step * max(SHRINK, SAFETY * power(error, -0.2))
            if h < 1e-14:
                outcome = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
                break
            continue
        if stop_speed >= 0.0 and sense * y_new[i_w] < 0.0:
            # The rotor would run backwards within this step: land between the stop speed and zero.
            landing = step * (sense * y[i_w] - 0.5 * stop_speed) / (sense * (y[i_w] - y_new[i_w]))
            continue
        landing = t_end - t + 1.0
        progress[ACCEPTED] += 1.0
        t_new = t + step
        if t_new > t_end - 1e-9 * step:
            t_new = t_end
        while done < times.shape[0] and times[done] <= t_new:
            dense_output((times[done] - t) / step, step, y, k, tab, states[done])
            done += 1
        n_log = log_contacts(t, step, y, y_new, k, tab, p, running, log, n_log, scratch)
        update_peaks(t_new, y_new, p, running, peaks)
        growth = GROW
        if error > 0.0:
            growth = min(
                GROW, max(SHRINK, SAFETY * power(error, -(0.2 - 0.75 * BETA)) * power(previous, BETA))
            )
        previous = max(error, 1e-4)
        h = min(step * growth, largest_step) if step >= h else h
        t = t_new
        for i in range(n):
            y[i] = y_new[i]
            k[0, i] = k[6, i]
        if stop_speed >= 0.0 and sense * y[i_w] <= stop_speed:
            outcome = STANDSTILL
            break
    progress[TIME] = t
    progress[STEP] = h
    progress[PREVIOUS_ERROR] = previous
    progress[SAMPLES] = done
    progress[LOGGED] = n_log
    return outcome


@kernel
def start_whirl(t: float, x: float, y: float, row: Array) -> None:
    """Begin the first sweep of the azimuth at a displacement (x, y) [m] relative to the race."""
    row[:] = 0.0
    row[AZIMUTH] = atan2(y, x)
    row[SWEEP_START] = row[AZIMUTH]
    row[SWEEP_END] = row[AZIMUTH]
    row[SWEEP_START_TIME] = t
    row[SWEEP_END_TIME] = t


@kernel
def follow_whirl(times: Array, relative: Array, whirl: Array) -> None:
    """Follow the azimuth of the rotor in each race, relative displacement (T, B, 2) [m], sweep by sweep.

    A sweep ends where the azimuth turns back; the time of sweeps of a whole turn or more counts as whirl,
    forward when they turn in the sense of positive spin.
    """
    for b in range(relative.shape[1]):
        row = whirl[b]
        for i in range(times.shape[0]):
            azimuth = atan2(relative[i, b, 1], relative[i, b, 0])
            change = azimuth - row[AZIMUTH]
            change -= 2.0 * math.pi * math.floor(change / (2.0 * math.pi) + 0.5)
            row[AZIMUTH] += change
            follow_sweep(times[i], row)


@kernel
def follow_sweep(t: float, row: Array) -> None:
    """Lengthen the present sweep to the azimuth reached, or end it and begin the one that goes back."""
    sense = row[SWEEP_SENSE]
    if sense == 0.0:
        if abs(row[AZIMUTH] - row[SWEEP_START]) > TURNING_BACK:
            row[SWEEP_SENSE] = math.copysign(1.0, row[AZIMUTH] - row[SWEEP_START])
            row[SWEEP_END] = row[AZIMUTH]
            row[SWEEP_END_TIME] = t
        return
    ahead = sense * (row[AZIMUTH] - row[SWEEP_END])
    if ahead >= 0.0:
        row[SWEEP_END] = row[AZIMUTH]
        row[SWEEP_END_TIME] = t
    elif ahead < -TURNING_BACK:
        close_sweep(row)
        row[SWEEP_START] = row[SWEEP_END]
        row[SWEEP_START_TIME] = row[SWEEP_END_TIME]
        row[SWEEP_SENSE] = -sense
        row[SWEEP_END] = row[AZIMUTH]
        row[SWEEP_END_TIME] = t


@kernel
def close_sweep(row: Array) -> None:
    """Add the time of a sweep of a whole turn or more to the whirl of its sense."""
    if abs(row[SWEEP_END] - row[SWEEP_START]) >= 2.0 * math.pi:
        lasted = row[SWEEP_END_TIME] - row[SWEEP_START_TIME]
        if row[SWEEP_SENSE] > 0.0:
            row[FORWARD_TIME] += lasted
        else:
            row[BACKWARD_TIME] += lasted
