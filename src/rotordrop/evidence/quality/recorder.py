"""What a recorder does to good readings: bridged gaps, filters, coupling; a dead speed, a second drop.

None of it needs the machine; each shows by what it takes from the motion of a dropped rotor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.record.recording import Array
from rotordrop.series import runs_of
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.record.record import Record

_BRIDGE_S = 1e-3
"""A straight line this long between noisy readings was drawn by a program [s]."""

_FILTERED, _DOUBTFUL, _FAR_TOO_SMOOTH = 0.05, 0.3, 0.01
"""Acceleration from 500 Hz to 2 kHz over that from 30 to 150 Hz (medians of the power) after a drop, below
which a record is refused and doubted where its noise is coloured, and doubted whatever its noise [1].

572 simulated records of rotors of 5, 60 and 140 kg have 0.022 to 130, behind a low-pass of 200 Hz to 0.037:
heavy rotors on soft supports are as smooth as filtered ones, and only the noise tells."""

_COLOURED = 0.05
"""Power of the levitated readings from 500 Hz to 2 kHz over that from 100 to 250 Hz, lines left out, below
which a filter has taken their noise too [1]; 0.25 to 1.5 in 235 simulated records, at most 0.005 behind a
low-pass of up to 300 Hz."""

_BEFORE = (100.0, 250.0)
_HIGH, _LOW = (500.0, 2000.0), (30.0, 150.0)
_RISEN = 0.75
"""A rest that comes back to this share of its depth within the record leaks away."""

_ALIKE = 0.15
"""Channels that leak away do so alike, within this share of their depth; swings come on top [1]."""

_SUNK, _DEEP = 0.03, 0.5
"""A rotor at rest reads more than the first share of its whole motion in some channel, and the channels that
show it read more than the second share of the deepest [1]."""


def bridged(record: Record, channel: str, values: Array) -> Finding | None:
    """Find a stretch that is straighter than the noise of the channel allows."""
    bend = np.abs(np.diff(values, 2))
    usual = float(np.median(bend))
    noisy = usual < 0.8 * float(np.median(np.abs(np.diff(values, 3))))  # a smooth channel is no noise
    known = 0.0 < record.sampling_rate < np.inf
    if not known or usual <= 0.0 or not noisy or float(np.mean(bend == 0.0)) > 0.1:
        return None
    moving = np.diff(values)[:-1] != 0.0  # a channel that stands still is stuck, which has its own name
    straight = (bend < 0.1 * usual) & moving
    starts, lengths = runs_of(straight)
    if not len(starts):
        return None
    longest = int(np.argmax(lengths))
    if lengths[longest] < max(_BRIDGE_S * record.sampling_rate, 12):
        return None
    at, count = float(record.time[starts[longest]]), int(lengths[longest]) + 2
    return Finding(
        kind=Kind.BRIDGED,
        message=f"{count} samples ({(count - 1) / record.sampling_rate * 1e3:.3g} ms) lie on a straight line "
        f"without noise from {at:.6g} s on",
        remedy="export the recording without filling its gaps, or cut it before them",
        severity="stop",
        channel=channel,
        time=at,
    )


def check_filters(record: Record, drop: float) -> list[Finding]:
    """See whether impacts and rest of a dropped rotor are as sharp and as lasting as they must be."""
    return [*_low_pass(record, drop), *_coupling(record, drop)]


def _low_pass(record: Record, drop: float) -> list[Finding]:
    inside = (record.time > drop) & (record.time < drop + 0.2)
    if record.sampling_rate < 2.2 * _HIGH[1] or int(inside.sum()) < 0.1 * record.sampling_rate:
        return []
    ratio = _bands(np.diff(record.signals[inside], 2, axis=0), record.sampling_rate, _LOW)
    noise = _bands(record.signals[record.time < drop - 8e-3], record.sampling_rate, _BEFORE)
    if ratio >= (_DOUBTFUL if noise < _COLOURED else _FAR_TOO_SMOOTH):
        return []
    return [
        Finding(
            kind=Kind.LOW_PASS,
            message=f"after the drop the acceleration above {_HIGH[0]:.0f} Hz is {ratio:.2g} of that below "
            f"{_LOW[1]:.0f} Hz, and the noise before it above {_HIGH[0]:.0f} Hz {noise:.2g} of that below "
            f"{_BEFORE[1]:.0f} Hz: a filter has smoothed both",
            remedy="record without the low-pass, or with one far above 1 kHz",
            severity="stop" if ratio < _FILTERED and noise < _COLOURED else "warning",
        )
    ]


def _bands(signals: Array, rate: float, low: tuple[float, float]) -> float:
    """Median power from 500 Hz to 2 kHz over that of a lower band, median of the channels; 1 if too short."""
    count = len(signals)
    if count < 8 * rate / (low[1] - low[0]):
        return 1.0
    window = np.hanning(count)[:, None]
    power = np.abs(np.fft.rfft((signals - np.mean(signals, axis=0)) * window, axis=0)) ** 2
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    high, below = (np.median(power[(frequency >= a) & (frequency < b)], axis=0) for a, b in (_HIGH, low))
    return float(np.median(high / np.maximum(below, 1e-300)))


def _coupling(record: Record, drop: float) -> list[Finding]:
    """A rotor at rest stays at rest; behind a high-pass its reading creeps back to zero."""
    block = 0.1
    if record.time[-1] < drop + 0.2 + 4 * block:
        return []
    level = np.mean(record.signals[record.time < drop - 5e-3], axis=0)
    starts = np.linspace(drop + 0.2, float(record.time[-1]) - block, 4)
    means = np.array(
        [
            np.mean(record.signals[(record.time >= a) & (record.time < a + block)], axis=0) - level
            for a in starts
        ]
    )
    depth = np.abs(means[0])
    if float(np.max(depth)) < _SUNK * float(np.max(np.ptp(record.signals, axis=0))):
        return []
    deep = depth > _DEEP * np.max(depth)
    share = means[:, deep] / means[0, deep]
    falling = np.all(np.diff(share, axis=0) < _ALIKE) and float(np.ptp(share[-1])) < _ALIKE
    if not falling or float(np.max(share[-1])) > _RISEN:
        return []
    return [
        Finding(
            kind=Kind.AC_COUPLING,
            message=f"the readings at rest creep back towards zero, to {float(np.mean(share[-1])):.0%} of "
            "their depth by the end, all alike: a rotor on its bearings cannot rise",
            remedy="record with DC coupling; a high-pass takes away where the rotor lies",
            severity="stop",
        )
    ]


def check_again(record: Record) -> list[Finding]:
    """Find further drops in the record, without knowing the machine."""
    from rotordrop.errors import RecordError
    from rotordrop.evidence.look.events import drops_of
    from rotordrop.evidence.look.motion import motion_of

    try:
        gaps = (None,) * len(record.planes)
        drops = drops_of(motion_of(record, gaps=gaps, angles_known=True))
    except RecordError:
        return []  # who looks for the drop says why there is none
    if len(drops) < 2:
        return []
    return [
        Finding(
            kind=Kind.SECOND_DROP,
            message=f"the rotor was lifted at {drops[0].end:.6g} s and dropped again at "
            f"{drops[1].release:.6g} s ({len(drops)} drops)",
            remedy="cut it into a record for each drop: rotordrop look RECORD MACHINE --split FOLDER",
            severity="stop",
            time=drops[1].release,
        )
    ]


def check_speed_signal(record: Record) -> list[Finding]:
    """Find a speed that is dead before the drop or goes dead in it, or has a sign of its own."""
    readings, time = record.speed_readings, record.speed_time
    if readings is None or time is None or len(readings) < 2 or not np.isfinite(readings).all():
        return []
    size = np.abs(readings)
    turning = float(np.median(size[: max(len(size) // 20, 3)]))
    if turning < np.pi:
        return [
            _of_speed(
                Kind.DEAD_SPEED, f"it reads {format_quantity(turning, 'speed')} from the beginning", 0, record
            )
        ]
    dead = np.flatnonzero((size[1:] < 0.02 * turning) & (size[:-1] > 0.5 * turning))
    if len(dead):
        at = int(dead[0]) + 1
        words = (
            f"it falls from {format_quantity(float(size[at - 1]), 'speed')} to nothing between two readings"
        )
        return [_of_speed(Kind.DEAD_SPEED, words, at, record)]
    if float(np.median(readings)) < 0.0:
        words = "it is negative; the spin is counter-clockwise seen from the DE, the sign is left out"
        return [_of_speed(Kind.NEGATIVE_SPEED, words, 0, record, "warning")]
    return []


def _of_speed(kind: Kind, words: str, at: int, record: Record, severity: str = "stop") -> Finding:
    assert record.speed_time is not None
    return Finding(
        kind=kind,
        message=words,
        remedy="check the tacho and the direction of rotation; or give the speed by hand ([speed] constant)",
        severity="stop" if severity == "stop" else "warning",
        channel="speed",
        time=float(record.speed_time[at]),
    )
