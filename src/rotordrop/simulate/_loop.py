"""The compiled time loop: one explicit adaptive Runge–Kutta integration of a window of time.

Everything the loop carries from one window to the next stands in the arrays it is given: state, progress,
running contacts, open log entries.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.physics import ball_set, ball_table, mount
from rotordrop.physics import columns as L
from rotordrop.physics._compile import OPTIONAL_PARTS, by_reference, inner_kernel, kernel, lean_kernel
from rotordrop.physics.ball_set import ball_set_load
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import atan2, cube_root, exp, ln, power
from rotordrop.simulate._rhs import (
    N_PLACES,
    Scratch,
    ball_force,
    contact_values,
    depth_now,
    drop_derivative,
    face_values,
    race_deflection,
    race_travel,
    ring_travel,
    rises_with_travel,
    rows_of,
    rub_values,
    scratch_of,
    support_deflection,
)
from rotordrop.simulate._tableau import Tableau

# Outcome of the loop.
FINISHED, STEP_TOO_SMALL, TOO_MANY_STEPS, NOT_FINITE, STANDSTILL = range(5)

# Columns of the contact log.
LOG_CONTACT, LOG_START, LOG_END, LOG_PEAK_FORCE, LOG_PEAK_TIME, LOG_AZIMUTH, LOG_IMPULSE = range(7)
LOG_DISSIPATED, LOG_SLIDING, N_LOG_COLUMNS = range(7, 10)

# Columns of the running state of each contact.
RUN_IN_CONTACT, RUN_FORCE, RUN_POWER, RUN_DELTA, RUN_SLIDING, N_RUN_COLUMNS = range(6)

# Entries of the progress array.
TIME, STEP, PREVIOUS_ERROR, ACCEPTED, REJECTED, SAMPLES, LOGGED, N_PROGRESS = range(8)

# Columns of the peaks of each bearing: value and time of each quantity, then the largest travel of the race
# [m²].
PEAK_INDENTATION = 0
PEAK_FORCE = 2
PEAK_STRESS = 4
PEAK_TRAVEL = 6
N_PEAKS = 7

SAFETY = 0.9
SHRINK = 0.2
GROW = 5.0
BETA = 0.04
ALPHA = 0.2 - 0.75 * BETA
LOG_SMALLEST_ERROR = -9.210340371976182  # ln 1e-4, written out: a library may round it otherwise


@by_reference
class Control(NamedTuple):
    """How a window is stepped through; ``scale`` (s,) is the size of each state that error control looks at.

    ``largest_step`` and ``end`` [s]. The loop ends when the rotor turns no faster than ``stop_speed``
    [rad/s]; negative: never. A step that ends within ``snap`` of itself before the end lands on the end.
    ``logarithmic`` carries the error of the step before as a logarithm; the same control, rounded otherwise.
    """

    scale: Array
    tolerance: float
    largest_step: float
    most_steps: int
    stop_speed: float
    end: float
    snap: float
    logarithmic: bool


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
    t: float,
    h: float,
    y: Array,
    p: KernelParameters,
    tab: Tableau,
    k: Array,
    y_new: Array,
    work: Scratch,
    powers: Array,
) -> None:
    """Fill stages 2 to 7 (stage 1 is ``k[0]``), their ``powers`` (7, B + 1, 5) by place and the new state."""
    for stage in range(1, 7):
        combine(y, h, tab.a[stage], k, stage, y_new)
        drop_derivative(
            t + tab.c[stage] * h, y_new, p, k[stage], Scratch(work.balls, powers[stage], work.blend)
        )


@inner_kernel
def book_losses(h: float, powers: Array, tab: Tableau, books: Array) -> None:
    """Add to ``books`` (B + 1, 5) what an accepted step lost by place [J]; its last stage stays."""
    w = tab.a[6]
    w0, w1, w2, w3, w4, w5 = h * w[0], h * w[1], h * w[2], h * w[3], h * w[4], h * w[5]
    for b in range(books.shape[0]):
        # written out: this runs in every step, and a loop over the stages would take as long as a contact
        k0, k1, k2, k3 = powers[0, b], powers[1, b], powers[2, b], powers[3, b]
        k4, k5, last, book = powers[4, b], powers[5, b], powers[6, b], books[b]
        for i in range(N_PLACES):
            book[i] += w0 * k0[i] + w1 * k1[i] + w2 * k2[i] + w3 * k3[i] + w4 * k4[i] + w5 * k5[i]
            k0[i] = last[i]


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


@inner_kernel
def step_error(
    h: float, y: Array, y_new: Array, k: Array, e: Array, rule: Control, p: KernelParameters, scratch: Array
) -> float:
    """`scaled_error` of a step over the states that the control looks at; up to 1 it is accepted."""
    scale = rule.scale[: p.rotor_at[L.N_CONTROLLED]]
    return scaled_error(h, y, y_new, k, e, scale, rule.tolerance, scratch)


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
def contact_at(t: float, c: int, y: Array, p: KernelParameters, out: Array) -> None:
    """Fill ``out`` (6,) with one contact in a state: as `contact_values`, the powers as one."""
    out[0], out[1], out[2], out[3], out[4], sliding, lost = contact_values(
        t, c, p.contact_at[c, L.CONTACT_BEARING], y, p
    )
    out[5] = sliding + lost


@lean_kernel
def further_values(
    c: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """A contact other than of rotor and race: of a support with its stop, of rotor and housing, of a face.

    The normal of a face is (1, 0) towards +z and (-1, 0) towards -z.
    """
    beyond = c - p.stops.shape[0] - p.rub.shape[0]
    if beyond >= 0:
        depth, push, _x, _y, _torque, sliding, lost = face_values(p.faces[beyond], y, p)
        return depth, abs(push), 0.0, math.copysign(1.0, push), 0.0, sliding, lost
    if c >= p.stops.shape[0]:
        return rub_values(c - p.stops.shape[0], y, p)
    b = p.stops[c]
    x, z, vx, vz = support_deflection(b, y, p)
    numbers = p.bearing[b, L.MOUNT : L.MOUNT_END]
    radius = math.sqrt(x * x + z * z)
    depth = radius - numbers[mount.GAP]
    if depth <= 0.0:
        return depth, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    F_x, F_y, lost = mount.stop_force(numbers, x, z, vx, vz)
    return depth, math.sqrt(F_x * F_x + F_y * F_y), 0.0, x / radius, z / radius, 0.0, lost


@inner_kernel
def watched(
    t: float, c: int, y: Array, p: KernelParameters
) -> tuple[float, float, float, float, float, float, float]:
    """One of all contacts that are logged, in the order of `rotordrop.physics.touch.touch`.

    Those of rotor and races come first.
    """
    if not OPTIONAL_PARTS or c < p.contact_at.shape[0]:
        return contact_values(t, c, p.contact_at[c, L.CONTACT_BEARING], y, p)
    return further_values(c - p.contact_at.shape[0], y, p)


def bearings_logged(log: Array, p: KernelParameters) -> NDArray[np.int64]:
    """Bearing of every entry of the contact log; -1 of a stop or the housing."""
    of_contacts = np.append(p.contact_at[:, L.CONTACT_BEARING], -1)
    return of_contacts[np.minimum(log[:, LOG_CONTACT].astype(np.int64), len(p.contact_at))]


def number_watched(p: KernelParameters) -> int:
    """Number of contacts that are logged."""
    return len(p.contact_at) + len(p.stops) + len(p.rub) + len(p.faces)


@lean_kernel
def crossing_fraction(
    t: float,
    c: int,
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
    b = p.contact_at[c, L.CONTACT_BEARING] if c < p.contact_at.shape[0] else 0
    low = 0.0
    high = 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        dense_output(middle, h, y, k, tab, scratch)
        if (
            not OPTIONAL_PARTS or c < p.contact_at.shape[0]
        ):  # its motion alone: the forces of thirty halvings cost a step
            inside = depth_now(t + middle * h, c, b, scratch, p) > 0.0
        else:
            inside = further_values(c - p.contact_at.shape[0], scratch, p)[0] > 0.0
        if inside == (delta_0 > 0.0):
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
    for c in range(running.shape[0]):
        delta, force, _friction, nx, ny, sliding, lost = watched(t + h, c, y_new, p)
        power = sliding + lost
        was = running[c, RUN_IN_CONTACT] > 0.0
        touches = delta > 0.0
        begin = t
        end = t + h
        if was != touches:
            moment = t + h * crossing_fraction(t, c, h, y, k, tab, p, running[c, RUN_DELTA], scratch)
            scratch_time = -math.inf
            if touches:
                begin = moment
            else:
                end = moment
        if touches and not was:
            if n_log < log.shape[0]:
                log[n_log, LOG_CONTACT] = c
                log[n_log, LOG_START] = begin
                log[n_log, LOG_END] = np.nan
            n_log += 1
            running[c, RUN_IN_CONTACT] = n_log
        row = int(running[c, RUN_IN_CONTACT]) - 1
        if 0 <= row < log.shape[0]:
            # Impulse and loss by Simpson's rule within the step: the output grid is coarser than an impact.
            middle = 0.5 * (begin + end)
            if middle != scratch_time:
                dense_output((middle - t) / h, h, y, k, tab, scratch)
                scratch_time = middle
            _delta, between, _friction, mid_x, mid_y, mid_sliding, mid_lost = watched(middle, c, scratch, p)
            mid_power = mid_sliding + mid_lost
            sixth = (end - begin) / 6.0
            log[row, LOG_IMPULSE] += sixth * (running[c, RUN_FORCE] + 4.0 * between + force)
            log[row, LOG_DISSIPATED] += sixth * (running[c, RUN_POWER] + 4.0 * mid_power + power)
            log[row, LOG_SLIDING] += sixth * (running[c, RUN_SLIDING] + 4.0 * mid_sliding + sliding)
            note_peak(middle, between, mid_x, mid_y, log[row])
            note_peak(t + h, force, nx, ny, log[row])
            if not touches:
                log[row, LOG_END] = end
        if not touches:
            running[c, RUN_IN_CONTACT] = 0.0
        running[c, RUN_FORCE] = force
        running[c, RUN_POWER] = power
        running[c, RUN_DELTA] = delta
        running[c, RUN_SLIDING] = sliding
    return n_log


@kernel
def start_running(y: Array, t: float, p: KernelParameters, running: Array, log: Array) -> int:
    """Fill the running contacts from a state that may already touch; returns the number of entries opened."""
    n_log = 0
    for c in range(running.shape[0]):
        delta, force, _friction, nx, ny, sliding, lost = watched(t, c, y, p)
        power = sliding + lost
        running[c, RUN_IN_CONTACT] = 0.0
        running[c, RUN_FORCE] = force
        running[c, RUN_POWER] = power
        running[c, RUN_DELTA] = delta
        running[c, RUN_SLIDING] = sliding
        if delta > 0.0:
            if n_log < log.shape[0]:
                log[n_log, LOG_CONTACT] = c
                log[n_log, LOG_START] = t
                log[n_log, LOG_END] = np.nan
                log[n_log, LOG_PEAK_FORCE] = force
                log[n_log, LOG_PEAK_TIME] = t
                log[n_log, LOG_AZIMUTH] = atan2(ny, nx)
            n_log += 1
            running[c, RUN_IN_CONTACT] = n_log
    return n_log


@inner_kernel
def race_loads(b: int, y: Array, p: KernelParameters) -> tuple[float, float, float]:
    """Largest load of a ball of one bearing [N], and its Hertz stress on inner and outer race [Pa].

    The stress on the outer race is zero where it carries the same loads as the inner one, which governs.
    """
    dx, dy = race_deflection(b, y, p)
    spin, along = y[p.bearing_at[b, L.RACE_SPIN]], race_travel(b, y, p)
    return deflected_loads(b, dx, dy, ring_travel(b, y, p), along, spin, p)


@inner_kernel
def deflected_loads(
    b: int, dx: float, dy: float, way: float, along: float, spin: float, p: KernelParameters
) -> tuple[float, float, float]:
    """`race_loads` of a deflected race; arguments as of `deflected_force`."""
    numbers, grid = p.bearing[b][L.ROLLING : L.ROLLING_END], p.bearing[b, L.FAST : L.FAST_END]
    if OPTIONAL_PARTS and p.bearing[b, L.FAST_SPEED_STEP] > 0.0:
        inner, outer = ball_table.fast_loads(grid, p.ball_table[b], p.balls[b], dx, dy, spin)
        stress = numbers[ball_set.STRESS_COEFFICIENT] * cube_root(inner)
        return max(inner, outer), stress, grid[ball_table.OUTER_STRESS] * cube_root(outer)
    if OPTIONAL_PARTS and p.bearing_at[b, L.FACE_STATES] >= 0:
        loaded, relieved = rows_of(b, p)
        load, stress = ball_set_load(numbers, loaded, dx, dy, -along)
        other, beside = ball_set_load(numbers, relieved, dx, dy, along)
        return max(load, other), max(stress, beside), 0.0
    load, stress = ball_set_load(numbers, p.balls[b], dx, dy, way)
    return load, stress, 0.0


@lean_kernel
def borne_by_contacts(t: float, b: int, y: Array, p: KernelParameters) -> tuple[float, float, float]:
    """Force on a sleeve or the like, x and y [N], and its stress [Pa]: the contacts are all it bears."""
    x = z = hardest = 0.0
    for c in range(p.bearing_at[b, L.CONTACTS], p.bearing_at[b, L.CONTACTS_END]):
        _delta, F_r, F_mu, nx, ny, _sliding, _lost = contact_values(t, c, b, y, p)
        x += F_mu * ny - F_r * nx
        z += -F_mu * nx - F_r * ny
        hardest = max(hardest, F_r)
    return x, z, p.bearing[b, L.STRESS_COEFFICIENT] * math.sqrt(hardest)


@inner_kernel
def borne(
    t: float, b: int, y: Array, p: KernelParameters, work: Scratch
) -> tuple[float, float, float, float, float]:
    """What one bearing bears: force on its race, x and y, and largest load of a ball [N], stress on inner and
    outer race [Pa] as of `race_loads`.
    """
    if OPTIONAL_PARTS and p.bearing_at[b, L.RACE] < 0:
        x, z, stress = borne_by_contacts(t, b, y, p)
        return x, z, 0.0, stress, 0.0
    F_x, F_y, _exchanged = ball_force(b, y, p, work)
    load, inner, outer = race_loads(b, y, p)
    return -F_x, -F_y, load, inner, outer


@inner_kernel
def note_largest(t: float, force: float, stress: float, entry: Array) -> None:
    """Keep the largest force [N] and stress [Pa] of a bearing with their times."""
    if force > entry[PEAK_FORCE]:
        entry[PEAK_FORCE] = force
        entry[PEAK_FORCE + 1] = t
    if stress > entry[PEAK_STRESS]:
        entry[PEAK_STRESS] = stress
        entry[PEAK_STRESS + 1] = t


@lean_kernel
def update_peaks(
    t: float, y: Array, p: KernelParameters, running: Array, peaks: Array, work: Scratch
) -> None:
    """Keep the largest indentation, ball force and stress of each bearing with an accepted state.

    Force and stress are computed only where the race has travelled nearly as far as ever, for they grow with
    its travel; directions differ by how the balls stand, which the margin of 10 % of the square covers.
    The peaks stand over the whole coast-down, so this is rare once the rotor has settled.
    """
    for b in range(p.bearing.shape[0]):
        for c in range(p.bearing_at[b, L.CONTACTS], p.bearing_at[b, L.CONTACTS_END]):
            if running[c, RUN_DELTA] > peaks[b, PEAK_INDENTATION]:
                peaks[b, PEAK_INDENTATION] = running[c, RUN_DELTA]
                peaks[b, PEAK_INDENTATION + 1] = t
        if rises_with_travel(b, p):
            dx, dy = race_deflection(b, y, p)
            travel = dx * dx + dy * dy
            if travel < 0.9 * peaks[b, PEAK_TRAVEL]:
                continue
            peaks[b, PEAK_TRAVEL] = max(travel, peaks[b, PEAK_TRAVEL])
        F_x, F_y, _load, inner, outer = borne(t, b, y, p, work)
        note_largest(t, math.sqrt(F_x * F_x + F_y * F_y), max(inner, outer), peaks[b])


@kernel
def integrate(  # noqa: C901, PLR0915  one compiled loop
    y: Array,
    times: Array,
    p: KernelParameters,
    tab: Tableau,
    control: Control,
    states: Array,
    log: Array,
    running: Array,
    books: Array,
    peaks: Array,
    progress: Array,
) -> int:
    """Integrate one window of time; its end is landed on exactly.

    Parameters
    ----------
    y : ndarray, shape (n,)
        State at ``progress[TIME]``; replaced by the state at the end.
    times : ndarray, shape (T,)
        Output grid after the present time [s], ascending.
    states : ndarray, shape (T, n)
        Filled with the states on the grid, as far as they were reached.
    log : ndarray, shape (R, 9)
        Contacts, columns ``LOG_*``; the first entries are those still open.
    running : ndarray, shape (W, 5)
        The running contacts of all that are `watched`; a run that begins fills them with `start_running`.
    books : ndarray, shape (B + 1, 5)
        Energy lost so far by place [J].
    peaks : ndarray, shape (B, 7) or (0, 7)
        Peaks so far; none are kept without rows.
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
    work = scratch_of(p)
    powers = np.zeros((7, books.shape[0], books.shape[1]))
    scratch = np.empty(n)
    t, t_end = progress[TIME], control.end
    h = progress[STEP]
    previous = progress[PREVIOUS_ERROR]
    begins = progress[ACCEPTED] + progress[REJECTED] == 0.0
    n_log = start_running(y, t, p, running, log) if begins else int(progress[LOGGED])
    stop_speed = control.stop_speed
    sense = 1.0 if y[i_w] >= 0.0 else -1.0
    landing = t_end - t
    tried = 0
    done = 0
    outcome = FINISHED
    drop_derivative(t, y, p, k[0], Scratch(work.balls, powers[0], work.blend))
    while t < t_end:
        if tried >= control.most_steps:
            outcome = TOO_MANY_STEPS
            break
        tried += 1
        step = min(h, t_end - t, landing)
        runge_kutta_stages(t, step, y, p, tab, k, y_new, work, powers)
        error = step_error(step, y, y_new, k, tab.e, control, p, scratch)
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
        if step == t_end - t or t_new > t_end - control.snap * step:
            t_new = t_end
        while done < times.shape[0] and times[done] <= t_new:
            dense_output((times[done] - t) / step, step, y, k, tab, states[done])
            done += 1
        n_log = log_contacts(t, step, y, y_new, k, tab, p, running, log, n_log, scratch)
        book_losses(step, powers, tab, books)
        if peaks.shape[0] > 0:
            update_peaks(t_new, y_new, p, running, peaks, work)
        # PI control (Gustafsson): the error of the step before damps the swing between steps too long and too
        # short that every opening of a contact starts.
        growth = GROW
        if control.logarithmic:
            log_error = LOG_SMALLEST_ERROR
            if error > 0.0:
                log_error = ln(error)
                growth = min(GROW, max(SHRINK, SAFETY * exp(BETA * previous - ALPHA * log_error)))
            previous = max(log_error, LOG_SMALLEST_ERROR)
        else:
            if error > 0.0:
                by_error = power(error, -(0.2 - 0.75 * BETA))
                growth = min(GROW, max(SHRINK, SAFETY * by_error * power(previous, BETA)))
            previous = max(error, 1e-4)
        h = min(step * growth, control.largest_step) if step >= h else h
        t = t_new
        # The last stage is the first of the next step, also where a contact opens: forces are continuous.
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
