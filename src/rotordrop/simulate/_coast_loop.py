"""What a coast-down carries over its windows: contacts still open, and how the rotor whirls."""

from __future__ import annotations

import math

from rotordrop.arrays import Array
from rotordrop.physics._compile import kernel
from rotordrop.physics.elementary import atan2
from rotordrop.simulate._loop import RUN_IN_CONTACT

# Columns of the whirl of each bearing: the present sweep of the azimuth, and the time spent in whole turns.
AZIMUTH, SWEEP_START, SWEEP_START_TIME, SWEEP_END, SWEEP_END_TIME, SWEEP_SENSE, FORWARD_TIME = range(7)
BACKWARD_TIME, N_WHIRL = range(7, 9)

TURNING_BACK = 0.5 * math.pi
"""An azimuth that falls back by more than this [rad] has turned round; less is the shiver of an impact."""


@kernel
def carry_open_contacts(log: Array, running: Array) -> int:
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
