"""What clock and recorder do to good readings: lost blocks, bridged gaps, filters, coupling, a dead speed.

None of it needs the machine; each shows by what it takes from the motion of a dropped rotor.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.quality.continuity import check_continuity
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.series import SIGMA_OF_MEDIAN, runs_of
from rotordrop.units import format_quantity, percent

if TYPE_CHECKING:
    from rotordrop.evidence.levitated import LevitatedModel
    from rotordrop.evidence.paths import Motion
    from rotordrop.record.record import Record

SLOWEST = 2000.0
"""Sampling rate a drop should have at least [Hz] (chosen)."""

NO_FALL = 200.0
"""Sampling rate below which the whole fall of a rotor, some milliseconds, lies between two samples [Hz]."""

_GAP, _JITTERED_GAP = 1.5, 2.5
"""Interval over the usual one from which a sample is missing [1]; the second where all intervals scatter."""

_JITTER = 0.02
_SHORTEST_COPY = 24
_AROUND = 20
"""Samples on both sides of a jump that say what is usual there."""

_RATE_KEYS = re.compile(r"^(fs|sampl\w*[ _-]*(rate|frequency)|abtast(rate|frequenz))", re.IGNORECASE)


def check_clock(record: Record, *, drop: bool = True) -> list[Finding]:
    """Find backward, jittered or wrong clocks and gaps in them."""
    steps = np.diff(record.time)
    if not 0.0 < record.sampling_rate < np.inf:
        return [
            Finding(
                kind=Kind.WRONG_RATE,
                message=f"the sampling rate is {record.sampling_rate:g} Hz",
                remedy="give the true rate with the record",
                severity="stop",
            )
        ]
    usual = float(np.median(steps))
    if drop and record.sampling_rate < NO_FALL:
        return [
            Finding(
                kind=Kind.WRONG_RATE,
                message=f"the clock gives {record.sampling_rate:.6g} Hz over {record.duration:.6g} s: the "
                "fall of a rotor, some milliseconds, lies between two samples. Times in ms taken for s would "
                f"make it {1e3 * record.sampling_rate:.6g} Hz over {1e-3 * record.duration:.6g} s",
                remedy='give the unit of the time column in the profile ([time] unit = "ms"), or the true '
                "interval ([time] step)",
                severity="stop",
            )
        ]
    findings = _backward(record, steps)
    if findings:
        return findings
    even = steps[steps < _GAP * usual]
    jitter = float(np.std(even)) / usual
    findings += _gaps(record, steps, usual, _JITTERED_GAP if jitter > _JITTER else _GAP)
    if jitter > _JITTER:
        worst = int(np.argmax(np.abs(steps - usual)))
        findings.append(
            Finding(
                kind=Kind.JITTERED_CLOCK,
                message=f"the sampling interval of {usual * 1e6:.4g} µs scatters by {percent(jitter, 1)}",
                remedy="export the recording with the recorder's own sample clock",
                severity="warning",
                time=float(record.time[worst]),
            )
        )
    findings += _stated_rate(record)
    if drop and record.sampling_rate < SLOWEST:
        findings.append(
            Finding(
                kind=Kind.SLOW_SAMPLING,
                message=f"{record.sampling_rate:.6g} Hz has a sample every {1e3 / record.sampling_rate:.2g} "
                "ms; contacts last about a millisecond",
                remedy=f"record at {SLOWEST:.0f} Hz or faster, better 20000 Hz",
                severity="warning",
            )
        )
    return findings


def _backward(record: Record, steps: Array) -> list[Finding]:
    wrong = np.flatnonzero(~(steps > 0))
    if not len(wrong):
        return []
    at = int(wrong[0])
    return [
        Finding(
            kind=Kind.BACKWARD_TIME,
            message=f"sample {at + 2} is at {record.time[at + 1]:.7g} s after sample {at + 1} at "
            f"{record.time[at]:.7g} s "
            f"({len(wrong)} such steps)",
            remedy="export again, or delete the repeated rows",
            severity="stop",
            time=float(record.time[at + 1]),
        )
    ]


def _gaps(record: Record, steps: Array, usual: float, limit: float) -> list[Finding]:
    gaps = np.flatnonzero(steps > limit * usual)
    if not len(gaps):
        return []
    at = int(gaps[0])
    missing = round(steps[at] / usual) - 1
    return [
        Finding(
            kind=Kind.DROPPED_BLOCK,
            message=f"{missing} samples are missing after {record.time[at]:.6g} s ({len(gaps)} gaps in the "
            "clock)",
            remedy="export the recording without gaps; do not fill them",
            severity="stop",
            time=float(record.time[at]),
        )
    ]


def _stated_rate(record: Record) -> list[Finding]:
    for key, text in record.metadata.items():
        number = re.match(r"([\d.,]+)\s*(k?Hz)?", text) if _RATE_KEYS.match(key) else None
        if not number:
            continue
        stated = float(number.group(1).replace(",", ".")) * (1e3 if number.group(2) == "kHz" else 1.0)
        if stated > 0 and abs(record.sampling_rate / stated - 1.0) > 1e-3:
            return [
                Finding(
                    kind=Kind.WRONG_RATE,
                    message=f"the header says {stated:.6g} Hz, the time column {record.sampling_rate:.6g} Hz",
                    remedy="find out which is right; name the true interval in the profile (time.step)",
                    severity="stop",
                )
            ]
    return []


def check_blocks(record: Record) -> list[Finding]:
    """Find blocks of samples that are there twice, and jumps of the motion from one sample to the next."""
    return _copies(record) or _jumps(record) or check_continuity(record)


def _copies(record: Record) -> list[Finding]:
    """Rows that repeat earlier rows one after the other: noise never does that."""
    label = _row_hashes(record.signals)
    order = np.argsort(label, kind="stable")
    same = label[order][1:] == label[order][:-1]
    later, earlier = order[1:][same], order[:-1][same]
    lag = np.zeros(len(label), dtype=np.int64)
    lag[later] = later - earlier
    still = np.append(False, np.all(record.signals[1:] == record.signals[:-1], axis=1))
    lag[still] = 0
    start, length = _longest_run(lag)
    if length < _SHORTEST_COPY:
        return []
    return [
        Finding(
            kind=Kind.DUPLICATE_BLOCK,
            message=f"{length} samples from {record.time[start]:.6g} s on repeat those from "
            f"{record.time[start - lag[start]]:.6g} s exactly",
            remedy="export again; the times after the copy are wrong",
            severity="stop",
            time=float(record.time[start]),
        )
    ]


def _row_hashes(signals: Array) -> NDArray[np.uint64]:
    """One number per row, the same for the same readings; far faster to sort than the rows."""
    odd: Any = np.random.default_rng(0).integers(1, 2**62, signals.shape[1], dtype=np.uint64) * np.uint64(
        2
    ) + np.uint64(1)
    label = np.zeros(len(signals), dtype=np.uint64)
    for i, column in enumerate(signals.T):
        bits = (column + 0.0).view(np.uint64)
        mixed = (bits ^ (bits >> np.uint64(29))) * odd[i]
        label ^= mixed ^ (mixed >> np.uint64(32))
    return label


def _longest_run(lag: NDArray[np.int64]) -> tuple[int, int]:
    """Start and length of the longest run of one and the same lag above zero."""
    edges = np.flatnonzero(np.diff(lag)) + 1
    starts = np.concatenate([[0], edges])
    lengths = np.diff(np.concatenate([starts, [len(lag)]]))
    lengths = np.where(lag[starts] > 0, lengths, 0)
    best = int(np.argmax(lengths))
    return int(starts[best]), int(lengths[best])


def _jumps(record: Record) -> list[Finding]:
    """Steps of most channels between two samples that no rotor can make: samples are missing there."""
    signals = record.signals
    if len(signals) < 50:
        return []
    # channel by channel: a minute of all of them must not be held a dozen times
    count = signals.shape[1]
    kink = np.empty((count, len(signals) - 5))
    moved = np.empty(kink.shape, dtype=np.bool_)
    usual, limit, size = np.empty(count), np.empty(count), np.zeros(kink.shape[1])
    for i, column in enumerate(signals.T):
        step = np.diff(column)
        near = step[:-4], step[1:-3], step[3:-1], step[4:]
        # the median of four, several times faster than by sorting
        around = 0.5 * (sum(near) - np.maximum.reduce(near) - np.minimum.reduce(near))
        kink[i] = np.abs(step[2:-2] - around)
        # channels that stood still before catch up with the rotor: a hold has its own name
        moved[i] = step[1:-3] != 0.0
        usual[i] = max(SIGMA_OF_MEDIAN * float(np.median(kink[i])), 1e-12)
        finest = float(np.min(np.diff(np.unique(column)), initial=np.inf))
        limit[i] = max(12.0 * usual[i], 2e-6, 4.0 * finest if np.isfinite(finest) else 0.0)
        size = np.maximum(size, kink[i] / max(8.0 * float(np.percentile(kink[i], 99.9)), limit[i]))
    enough = max(2, count // 2 + 1)
    jumps = (kink > limit[:, None]) & moved
    many = np.sum(jumps, axis=0) >= enough
    # where the rotor moves along one sensor, one channel jumps far and the others less
    for jump in np.flatnonzero((size > 1.0) & ~many).tolist():
        nearby = np.median(kink[:, max(jump - _AROUND, 0) : jump + _AROUND], axis=1)
        jumped = (kink[:, jump] > 6.0 * np.maximum(nearby, usual)) & moved[:, jump]
        many[jump] = np.sum(jumped) >= enough
    beside = np.append(many[1:], False) | np.append(False, many[:-1])
    alone = np.flatnonzero(many & ~beside)  # a spike makes two such steps in a row
    if not len(alone):
        return []
    at = int(alone[0]) + 2
    jumped_by = float(np.max(np.abs(signals[at + 1] - signals[at])))
    return [
        Finding(
            kind=Kind.DROPPED_BLOCK,
            message=f"{len(alone)} jump(s) of most channels at once, the first by "
            f"{jumped_by * 1e6:.3g} µm from one "
            f"sample to the next at {record.time[at]:.6g} s",
            remedy="samples are missing though the clock runs on; export again",
            severity="stop",
            time=float(record.time[at]),
        )
    ]


_BRIDGE_S = 1e-3
"""A straight line this long between noisy readings was drawn by a program [s]."""

_FILTERED, _DOUBTFUL, _FAR_TOO_SMOOTH = 0.05, 0.3, 0.01
"""Acceleration from 500 Hz to 2 kHz over that from 30 to 150 Hz (medians of the power) after a drop, below
which a record is refused and doubted where its noise is coloured, and doubted whatever its noise [1].

572 simulated records of rotors of 5, 60 and 140 kg have 0.022 to 130, behind a low-pass of 200 Hz to 0.037:
heavy rotors on soft supports are as smooth as filtered ones, and only the noise tells."""

_BOUNCES = 200.0
"""Frequency at which a rotor bounces on its supports below which it is smoother than those [Hz]: force pulses
have a power that falls with the fourth power of the frequency over that of the bounce. Of 50 records rotors
of 1.6 and 6 t, of 127 and 82 Hz, have 0.022 and 0.0067 at least, behind a low-pass of 100 Hz 2e-5."""

_COLOURED = 0.05
"""Power of the levitated readings, without orbit and hum, from 500 Hz to 2 kHz over that from 100 to 250 Hz,
below which a filter has taken their noise too [1]; 0.25 to 1.5 in 235 simulated records, at most 0.005 behind
a low-pass of up to 300 Hz."""

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


def check_filters(record: Record, levitated: LevitatedModel, drop: float, bounces: float) -> list[Finding]:
    """See whether impacts and rest of a dropped rotor are as sharp and as lasting as they must be.

    `bounces` is the frequency of the rigid rotor on its supports [Hz].
    """
    return [*_low_pass(record, levitated, drop, bounces), *_coupling(record, drop)]


def _low_pass(record: Record, levitated: LevitatedModel, drop: float, bounces: float) -> list[Finding]:
    inside = (record.time > drop) & (record.time < drop + 0.2)
    if record.sampling_rate < 2.2 * _HIGH[1] or int(inside.sum()) < 0.1 * record.sampling_rate:
        return []
    ratio = _bands(np.diff(record.signals[inside], 2, axis=0), record.sampling_rate, _LOW)
    # in a short window the orbit is no line among others: what is left beside it is noise
    floating = (record.time >= levitated.start) & (record.time <= levitated.end)
    left = record.signals[floating] - levitated.readings(record.time[floating])
    noise = _bands(left, record.sampling_rate, _BEFORE)
    smoothest = _FAR_TOO_SMOOTH * min(bounces / _BOUNCES, 1.0) ** 4
    if ratio >= (_DOUBTFUL if noise < _COLOURED else smoothest):
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
            message=f"the readings at rest creep back towards zero, to {percent(float(np.mean(share[-1])))} "
            "of their depth by the end, all alike: a rotor on its bearings cannot rise",
            remedy="record with DC coupling; a high-pass takes away where the rotor lies",
            severity="stop",
        )
    ]


def check_again(motion: Motion) -> list[Finding]:
    """Find further drops in the record, without knowing the machine."""
    from rotordrop.evidence.paths import drops_of

    drops = drops_of(motion)
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
