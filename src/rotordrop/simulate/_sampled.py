"""The time loop of magnets whose controllers sample: windows from instant to instant, steps end on each.

Between two instants the right-hand side reads a memory that stands still; only here it is written, when a
step has ended on a sample, an output or an event. A step that is rejected never gets here.
"""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.physics import magnet
from rotordrop.physics._compile import kernel
from rotordrop.physics.columns import KernelParameters
from rotordrop.simulate import _loop
from rotordrop.simulate._loop import Control, integrate
from rotordrop.simulate._rhs import plane_motion
from rotordrop.simulate._tableau import Tableau

# Columns of the table of events, in order: what lets one happen and its value (time [s], speed [rad/s],
# velocity [m/s]); what the axes do from then on; magnet and axis, -1 for all; when it happened [s].
EVENT_KIND, EVENT_VALUE, EVENT_MODE, EVENT_MAGNET, EVENT_AXIS, EVENT_TIME, N_EVENT_COLUMNS = range(7)
AT_TIME, BELOW_SPEED, AT_REST = range(3)

REST_TIME = 0.02
"""Time [s] for which a rotor at rest has been quiet; chosen, longer than a bounce of the last micrometres."""
NEAR = 1e-6
"""Instants closer than this, in sample times, are one [1]: sums of times are rounded."""


@kernel
def clock_of(p: KernelParameters) -> Array:
    """The clock of all magnets in the memory."""
    first = p.magnet_at[0, L.MAGNET_MEMORY]
    return p.memory[first - magnet.N_CLOCK : first]


@kernel
def next_instant(p: KernelParameters, events: Array) -> float:
    """Time [s] of the next sample, output or event at a time."""
    clock = clock_of(p)
    period, delay = p.magnet[0, L.LOOP + magnet.SAMPLE_TIME], p.magnet[0, L.LOOP + magnet.DELAY]
    due = min(clock[magnet.SAMPLES] * period, clock[magnet.OUTPUTS] * period + delay)
    past = int(clock[magnet.EVENTS])
    if past < events.shape[0] and events[past, EVENT_KIND] == AT_TIME:
        due = min(due, events[past, EVENT_VALUE])
    return float(due)


@kernel
def fastest_at_bearings(y: Array, p: KernelParameters) -> float:
    """Largest velocity of the rotor at a touchdown bearing [m/s]."""
    most = 0.0
    for b in range(p.bearing.shape[0]):
        _x, vx = plane_motion(p.bearing_shape[b], 0, y, p)
        _y, vy = plane_motion(p.bearing_shape[b], 1, y, p)
        most = max(most, math.sqrt(vx * vx + vy * vy))
    return most


@kernel
def happens(t: float, y: Array, p: KernelParameters, event: Array) -> bool:
    """Whether an event is due."""
    value = event[EVENT_VALUE]
    if event[EVENT_KIND] == AT_TIME:
        return bool(t >= value)
    if event[EVENT_KIND] == BELOW_SPEED:
        return bool(abs(y[p.rotor_at[L.ROTOR_SPEED]]) <= value)
    clock = clock_of(p)
    if fastest_at_bearings(y, p) > value:
        clock[magnet.QUIET] = t
    return bool(t - clock[magnet.QUIET] >= REST_TIME)


@kernel
def let_happen(t: float, p: KernelParameters, event: Array) -> None:
    """Let the axes that an event names do what it says from now on."""
    for a in range(p.magnet.shape[0]):
        for axis in range(2):
            chosen = event[EVENT_MAGNET] == a or event[EVENT_MAGNET] < 0.0
            if chosen and (event[EVENT_AXIS] == axis or event[EVENT_AXIS] < 0.0):
                first = p.magnet_at[a, L.MAGNET_MEMORY] + axis * magnet.N_AXIS
                magnet.begin(p.memory[first : first + magnet.N_AXIS], int(event[EVENT_MODE]))
    clock = clock_of(p)
    event[EVENT_TIME], clock[magnet.QUIET] = t, t
    clock[magnet.EVENTS] += 1.0


@kernel
def remember(t: float, y: Array, p: KernelParameters, events: Array) -> None:
    """Write the memory at an instant: events first, then samples, then outputs whose delay is over."""
    clock = clock_of(p)
    while clock[magnet.EVENTS] < events.shape[0]:
        event = events[int(clock[magnet.EVENTS])]
        if not happens(t, y, p, event):
            break
        let_happen(t, p, event)
    period, delay = p.magnet[0, L.LOOP + magnet.SAMPLE_TIME], p.magnet[0, L.LOOP + magnet.DELAY]
    count, made = int(clock[magnet.SAMPLES]), int(clock[magnet.OUTPUTS])
    sampled = t + NEAR * period >= count * period
    put_out = made < count + sampled and t + NEAR * period >= made * period + delay
    for a in range(p.magnet.shape[0]):
        numbers, seen = p.magnet[a, L.LOOP : L.LOOP_END], p.magnet[a, L.LOOP_END :]
        for axis in range(2):
            first = p.magnet_at[a, L.MAGNET_MEMORY] + axis * magnet.N_AXIS
            kept = p.memory[first : first + magnet.N_AXIS]
            if sampled:
                moved, _v = plane_motion(seen, axis, y, p)
                error = p.magnet[a, L.AMB_REFERENCE_X + axis] - moved
                magnet.take_sample(numbers, kept, numbers[magnet.FEED + axis], error, count)
            if put_out and magnet.LEVITATES <= kept[magnet.MODE] <= magnet.HOLDS:
                kept[magnet.REFERENCE] = kept[magnet.PENDING + made % magnet.MOST_PENDING]
    clock[magnet.SAMPLES] += sampled
    clock[magnet.OUTPUTS] += put_out


@kernel
def integrate_sampled(
    events: Array,
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
    """Integrate one window of time as `_loop.integrate` does, with the ``events`` (E, 6) of its magnets."""
    done, outcome = 0, _loop.FINISHED
    while outcome == _loop.FINISHED:
        end = min(next_instant(p, events), control.end)
        if end > progress[_loop.TIME]:
            count = np.searchsorted(times[done:], end, side="right")
            window = Control(
                control.scale,
                control.tolerance,
                control.largest_step,
                control.most_steps,
                control.stop_speed,
                end,
                control.snap,
                control.logarithmic,
            )
            outcome = integrate(
                y,
                times[done : done + count],
                p,
                tab,
                window,
                states[done:],
                log,
                running,
                books,
                peaks,
                progress,
            )
            done += int(progress[_loop.SAMPLES])
        if end >= control.end:
            break
        remember(end, y, p, events)
    progress[_loop.SAMPLES] = done
    return outcome
