"""What clock and recorder do to good readings: lost blocks, filters, coupling, a dead speed.

None of it needs the machine; each shows by what it takes from the motion of a dropped rotor. That has
position and velocity from one sample to the next: where parabolas before and after a place describe the
motion, they meet there; where all channels jump by one time times their velocities, samples are missing.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RotordropError
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.evidence.quality.motion import first_motion
from rotordrop.record.axes import planar_of
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import DropModel
from rotordrop.series import MANY, median_of_five, noise_by_differences

if TYPE_CHECKING:
    from rotordrop.evidence.paths import Motion
    from rotordrop.record.record import Record

if TYPE_CHECKING:
    from rotordrop.record.record import Record

_FEWEST = 8
"""Fewest samples on either side of a place through which a parabola says how the rotor moves [1]: five remain
to tell whether it does. Twice as many, and so on, where noise hides what is missing."""

_AS_PARABOLA = 1.6e-3
"""Longest such side [s]: of an orbit of 100 Hz a parabola leaves 1 % over that time; whether one describes
the motion is asked of each by itself."""

_PART = 16384

_SMOOTH = 2.4
"""Standard deviations by which the mean square of the residual of those parabolas may lie above that of noise
where they describe the motion [1]: in a contact of less than a millisecond they do not, and nothing is said
of a jump there."""

_KINK = 0.6
"""Part of a sample by which the kink of a hard impact may lie aside of the middle of two samples [1]: a half,
and what the parabolas leave open."""

_LOST = 6.0
"""Standard deviations of a time that is missing in all channels, beyond what the parabolas may leave out,
from which it is named [1]: at 100,000 places looked at, five have one chance in 30; 4.5 at most in 57 clean
drops of all rotors."""

_LEFT_OUT = 7.0 / 18.0
"""Square of a jump, in its standard deviations, that a course in the third power of time makes which leaves
one noise variance to the parabolas on both sides together [1]: its value at their ends squared, 7 over the
samples, against twice the 9 over the samples of a parabola's."""

_SURELY = 2.0
"""Standard deviations of that noise by which it may hide what the parabolas leave out [1]."""

_SAME_WAY = 3.0
"""Standard deviations up to which channels agree on the missing time [1], and within which what is missing is
a whole number of samples."""


def check_continuity(record: Record) -> list[Finding]:
    """Find samples that are lost under a clock that runs on, by where the motion would go on."""
    signals, rate = record.signals, record.sampling_rate
    counts = [_FEWEST << k for k in range(12) if k == 0 or _FEWEST << k <= _AS_PARABOLA * rate]
    if len(signals) < 4 * counts[-1] or not np.isfinite(signals).all():
        return []
    steps = [np.median(np.diff(np.unique(c))) if np.ptp(c) > 0.0 else 0.0 for c in signals.T]
    own = np.array([noise_by_differences(column, 4) for column in signals.T])
    noise = np.maximum(np.hypot(own, np.array(steps) / np.sqrt(12.0)), 1e-12)
    worst: tuple[float, Finding | None] = (_LOST, None)
    for begin in range(0, len(signals), _PART):  # a coast-down of a minute must not be held many times
        part = signals[begin : begin + _PART + 2 * counts[-1]] / noise
        for count in (one for one in counts if 2 * one < len(part)):
            sizes, jump, velocity = _losses(part - np.median(part, axis=0), count)
            row = int(np.argmax(sizes))
            if sizes[row] > worst[0]:
                fast = int(np.argmax(np.abs(velocity[row])))
                missing = abs(jump[row, fast] / velocity[row, fast])
                size = 1e6 * float(np.max(np.abs(jump[row]) * noise))
                words = {"size": size, "missing": missing, "lasts": 1e3 * missing / rate, "sure": sizes[row]}
                worst = float(sizes[row]), found("lost", words, time=float(record.time[begin + count + row]))
    return [] if worst[1] is None else [worst[1]]


def _losses(part: Array, count: int) -> tuple[Array, Array, Array]:
    """Missing time over its standard deviation, where channels jump by it times their velocity, shape (N,).

    Beside it the jump of the motion between the parabolas through so many samples before and after every
    place, and the velocity over it per sample, shape (N, S), all in the noise of the readings. Channels that
    parabolas do not describe on both sides have no voice; more than half must have one. Over a gap the motion
    goes on with one acceleration: it has the mean velocity of both sides. What is no parabola within the
    noise jumps too, by as much as the readings on both sides leave room for.
    """
    free, powers = count - 3, np.vander(np.arange(count) - 0.5 * (count - 1), 3, increasing=True)
    basis, upper = np.linalg.qr(powers)
    # the parabola half a sample before and beyond its samples, and its slope there
    places = np.array([[1, -0.5 * count, 0.25 * count**2], [1, 0.5 * count, 0.25 * count**2]])
    weights = np.vstack([places, [[0, 1, -count], [0, 1, count]]]) @ np.linalg.inv(upper)
    fitted = np.array([[np.correlate(c, one, "valid") for one in basis.T] for c in part.T])
    squares = np.array([np.convolve(c**2, np.ones(count), "valid") for c in part.T])
    begins, ends, into, out = (np.tensordot(row, fitted, (0, 1)).T for row in weights)
    excess = (squares - np.sum(fitted**2, axis=1)).T - free
    # where a channel holds one reading it is stuck, which has its own name
    held = np.cumsum(np.vstack([np.zeros(part.shape[1]), part[1:] == part[:-1]]), axis=0)
    smooth = excess < _SMOOTH * np.sqrt(2.0 * free)
    smooth &= held[count - 1 :] - held[: len(smooth)] < count // 2
    smooth = smooth[count:] & smooth[:-count]
    error = float(np.sqrt(2.0) * np.linalg.norm(weights[1]))
    jump, velocity = begins[count:] - ends[:-count], 0.5 * (into[count:] + out[:-count])
    gone, mean, turned = (one * smooth / error for one in (jump, velocity, into[count:] - out[:-count]))
    weight, seeing = np.sum(mean**2, axis=1), np.sum(smooth, axis=1)
    missing = np.sum(gone * mean, axis=1) / np.maximum(weight, 1e-300)
    aside = np.sum((gone - missing[:, None] * mean) ** 2, axis=1)
    whole = np.abs(missing - np.round(missing)) * np.sqrt(weight) < _SAME_WAY
    fits = (seeing > max(part.shape[1] // 2, 1)) & whole & (missing > 0.5) & (aside < _SAME_WAY**2 * seeing)
    # noise that happens to be small hides no less
    beyond = np.maximum(np.sum((excess[count:] + excess[:-count]) * smooth, axis=1), 0.0)
    hidden = np.sqrt(_LEFT_OUT * (beyond + _SURELY * np.sqrt(4.0 * free * seeing)))
    sure = missing * np.sqrt(weight) - _KINK * np.linalg.norm(turned, axis=1) - hidden
    return np.maximum(sure, 0.0) * fits, jump, velocity


SLOWEST = 2000.0
"""Sampling rate a drop should have at least [Hz] (chosen)."""

NO_FALL = 200.0
"""Sampling rate below which the whole fall of a rotor, some milliseconds, lies between two samples [Hz]."""

NO_RECORDER, FASTEST = 1e6, 0.03
"""Sampling rate that no recorder of displacements has [Hz], and mean speed over a record from which on its
clock is then too fast [m/s] (chosen): a rotor falls 0.25 mm within 7 ms."""

_GAP, _JITTERED_GAP = 1.5, 2.5
"""Interval over the usual one from which a sample is missing [1]; the second where all intervals scatter."""

_JITTER = 0.02
"""Scatter of the sampling interval that is worth a word [1] (chosen)."""

_SHORTEST_COPY = 24
_FAR, _LESS, _LEAST_STEP = 8.0, 2.0, 5e-6
"""How much a step of one channel, and of most, differs from those beside it where samples are missing, over
what one of a thousand exceeds [1]; least such step [m] (chosen)."""

_RATE_KEYS = re.compile(r"^(fs|sampl\w*[ _-]*(rate|frequency)|abtast(rate|frequenz))", re.IGNORECASE)


def check_clock(record: Record, *, drop: bool = True) -> list[Finding]:
    """Find backward, jittered or wrong clocks and gaps in them."""
    rate, time, steps = record.sampling_rate, record.time, np.diff(record.time)
    if drop and rate < NO_FALL:
        lasts = record.duration
        return [found("no-fall-between", rate=rate, lasts=lasts, in_ms=1e3 * rate, lasts_ms=1e-3 * lasts)]
    spans = np.fmax.reduce(record.signals, axis=0) - np.fmin.reduce(record.signals, axis=0)
    span = float(np.fmax.reduce(spans, initial=0.0))
    if drop and rate > NO_RECORDER and span > FASTEST * record.duration:
        slow = {"slower": 1e-3 * rate, "longer": 1e3 * record.duration}
        return [found("fall-too-fast", slow, rate=rate, lasts=record.duration, span=span)]
    wrong = np.flatnonzero(~(steps > 0))
    if len(wrong):
        at = int(wrong[0])
        samples = {"first": at + 1, "second": at + 2, "before": time[at], "count": len(wrong)}
        return [found("backward", samples, time=float(time[at + 1]))]
    usual = float(np.median(steps))
    jitter = float(np.std(steps[steps < _GAP * usual])) / usual
    findings = []
    gaps = np.flatnonzero(steps > (_JITTERED_GAP if jitter > _JITTER else _GAP) * usual)
    if len(gaps):
        missing = round(steps[gaps[0]] / usual) - 1
        findings.append(found("gap", time=float(time[gaps[0]]), missing=missing, count=len(gaps)))
    if jitter > _JITTER:
        worst = int(np.argmax(np.abs(steps - usual)))
        findings.append(found("jitter", time=float(time[worst]), step=1e6 * usual, share=jitter))
    for key, text in record.metadata.items():
        number = re.match(r"([\d.,]+(?:[eE]\+?\d+)?)\s*(k?Hz)?", text) if _RATE_KEYS.match(key) else None
        stated = float(number[1].replace(",", ".")) * (1e3 if number[2] == "kHz" else 1.0) if number else 0.0
        if stated > 0 and abs(rate / stated - 1.0) > 1e-3:
            findings.append(found("other-rate", stated=stated, rate=rate))
            break
    if drop and rate < SLOWEST:
        findings.append(found("slow", rate=rate, step=1e3 / rate, least=SLOWEST))
    return findings


def check_blocks(record: Record) -> list[Finding]:
    """Find blocks that are there twice and jumps of the motion, in a long record about its fall."""
    first = max(min(first_motion(record)[0] - MANY // 4, len(record.time) - MANY), 0)
    record = record.samples(slice(first, first + MANY))
    return _copies(record) or _jumps(record) or check_continuity(record)


def _copies(record: Record) -> list[Finding]:
    """Rows that repeat earlier rows one after the other, and do not follow what those followed."""
    signals = np.ascontiguousarray(record.signals) + 0.0
    odd: Any = 2 * np.random.default_rng(0).integers(2**61, size=signals.shape[1], dtype=np.uint64) + 1
    bits = signals.view(np.uint64)
    label = np.sum((bits ^ (bits >> np.uint64(29))) * odd, axis=1)  # one number per row, fast to sort
    order = np.argsort(label, kind="stable")
    same = label[order][1:] == label[order][:-1]
    later = order[1:][same]
    lag = np.zeros(len(label), dtype=np.int64)
    lag[later] = later - order[:-1][same]
    lag[1:][np.all(signals[1:] == signals[:-1], axis=1)] = 0  # held, which has its own name
    edges = np.append(0, np.flatnonzero(np.diff(lag)) + 1)
    lengths = np.diff(np.append(edges, len(lag))) * (lag[edges] > 0)
    start, length = int(edges[np.argmax(lengths)]), int(np.max(lengths))
    earlier = start - int(lag[start])
    # what repeats because nothing disturbs it goes on into the repetition as it did before
    usual = np.median(np.abs(np.diff(signals, axis=0)), axis=0)
    before = np.abs(signals[start - 1] - signals[earlier - 1])
    if length < _SHORTEST_COPY or earlier == 0 or np.all(before <= 0.5 * usual):
        return []
    at, copied = float(record.time[start]), record.time[earlier]
    return [found("copy", time=at, count=length, earlier=copied)]


def _jumps(record: Record) -> list[Finding]:
    """Steps of most channels between two samples that no rotor can make: samples are missing there."""
    if len(record.signals) < 50:
        return []
    steps = np.diff(record.signals, axis=0)
    turns = np.abs(np.diff(steps, axis=0))
    # channels that stood still before catch up with the rotor: a hold has its own name
    size = np.minimum(turns[:-1], turns[1:]) * (steps[:-2] != 0.0)
    usual = np.percentile(size, 99.9, axis=0)
    # where the rotor moves along one sensor, one channel jumps far and the others less
    far = np.any(size > np.maximum(_FAR * usual, _LEAST_STEP), axis=1)
    enough = max(2, size.shape[1] // 2 + 1)
    many = far & (np.sum(size > np.maximum(_LESS * usual, 0.5 * _LEAST_STEP), axis=1) >= enough)
    beside = np.append(many[1:], False) | np.append(False, many[:-1])
    alone = np.flatnonzero(many & ~beside)  # a spike makes two such steps in a row
    if not len(alone):
        return []
    at = int(alone[0]) + 1
    by = 1e6 * float(np.max(np.abs(steps[at])))
    return [found("jump", time=float(record.time[at]), count=len(alone), size=by)]


_LANDED, _LATER, _SPAN = 0.05, 0.3, 0.25
"""Times after the drop from which a rotor bounces, and lies; how long it is looked at [s] (chosen)."""

_FLOATS, _CENTRED = 0.95, 0.6
"""A rotor that was let go reaches more than the first share of its gap at first, and on average lies farther
off than the second of its reach, or it whirls [1]: in 48 drops of 4 machines 1.07 and 0.69 at least."""

_RISEN, _LIFTED = (0.8, 0.75), 0.1
"""Later it reaches the first share of its gap, or the second of its reach at first; less than the third where
it was lifted again [1] (chosen)."""

_THROUGH = 0.5
"""For a tenth of the time a reading behind a high-pass is nearer to its middle than this share of its reach,
on average too [1] (chosen): in 50 simulated drops a rotor on its bearings stays at 0.74 at least, in both."""


def check_coupling(record: Record, gaps: Array | None, drop: float) -> list[Finding]:
    """A rotor at rest stays at rest; behind a high-pass its reading creeps back to zero.

    Where no air gap [m] is known, only a reading that swings about where the rotor levitated shows it.
    """
    since = record.time - drop
    if since[-1] < _LANDED + 0.5 * _SPAN or since[0] >= -5e-3:
        return []
    level = np.mean(record.signals[since < -5e-3], axis=0)

    def seen(begin: float) -> tuple[Array, Array, Array]:
        part = record.signals[(since > begin) & (since < begin + _SPAN)] - level
        path = planar_of(part * record.gains, record.planes)
        near, reach = np.percentile(np.hypot(path[..., 0], path[..., 1]), (10, 95), axis=0)
        return reach, np.hypot(*np.mean(path, axis=0).T) / reach, near / reach

    reach, about, _ = seen(_LANDED)
    if gaps is not None and np.all(reach < _FLOATS * gaps) and np.all(about < _CENTRED):
        return [found("coupling", share=np.max(reach / gaps))]
    for begin in (_LANDED, *((_LATER, since[-1] - _SPAN) if since[-1] > _LATER + _SPAN else ())):
        late, about, near = seen(begin)
        if np.all(np.maximum(about, near) < _THROUGH) and np.all(near > _LIFTED):
            return [found("coupling-about", reach=np.max(late))]
        if gaps is None or begin == _LANDED:
            continue
        if np.all(late < np.minimum(_RISEN[0] * gaps, _RISEN[1] * reach)) and np.all(late > _LIFTED * gaps):
            return [found("coupling", share=np.max(late / gaps))]
    return []


def check_again(motion: Motion) -> list[Finding]:
    """Find further drops in the record, without knowing the machine."""
    from rotordrop.evidence.paths import drops_of

    drops = drops_of(motion)
    if len(drops) < 2:
        return []
    return [found("again", time=drops[1].release, lifted=drops[0].end, count=len(drops))]


def check_speed(record: Record) -> list[Finding]:
    """Find a speed that is missing, dead, jumping or of a sign of its own."""
    readings, time = record.speed_readings, record.speed_time
    if readings is None or time is None:
        return [found("no-speed", names=", ".join(record.channel_names))]
    bad = np.flatnonzero(~np.isfinite(readings))
    if len(bad):
        return [found("speed-nan", channel="speed", time=float(time[bad[0]]), count=len(bad))]
    if len(readings) < 2:
        return []
    size = np.abs(readings)
    turning = float(np.median(size[: max(len(size) // 20, 3)]))
    if turning < np.pi and not record.speed_by_hand:
        return [found("no-turning", channel="speed", time=float(time[0]), size=turning)]
    dead = np.flatnonzero((size[1:] < 0.02 * turning) & (size[:-1] > 0.5 * turning))
    if len(dead):
        at = int(dead[0]) + 1
        return [found("dead-speed", channel="speed", time=float(time[at]), size=size[at - 1])]
    if float(np.median(readings)) < 0.0:
        return [found("negative-speed", channel="speed", time=float(time[0]))]
    if len(readings) < 5:
        return []
    middle = median_of_five(readings)
    usual = np.maximum(np.abs(middle), 0.1 * float(np.max(np.abs(middle))))
    off = np.flatnonzero(np.abs(readings - middle) > 0.2 * usual)
    if not len(off):
        return []
    at, seen = int(off[0]), {"seen": readings[off[0]], "near": middle[off[0]]}
    return [found("speed-jumps", seen, channel="speed", time=float(time[at]), count=len(off))]


_WINDOW = 0.2
"""Time after the drop that is compared [s]."""

_LOWEST, _BANDS = 50.0, 3
"""Lower end of the lowest band [Hz], and bands an octave."""

_SEEN = 10.0
"""Power of the simulated drop over that of the levitated readings from which a band tells [1]."""

_LACKS = 8.0
"""What the highest two bands that tell must lack [dB]. In 212 drops of the corpus, some of machines other
than described, they lack 6 at most; behind one of 300 Hz of second order those of a 60 kg rotor lack 11."""

_IMPACTS = 0.95
"""Part of the power of the velocity, which impacts change, up to which a band tells of them [1]."""

_CORNER = 6.0
"""What all bands above the corner of a filter lack [dB]."""


def check_low_pass(record: Record, model: DropModel, speed: float, drop: float) -> list[Finding]:
    """Find a low-pass by the drop of the described machine from a speed [rad/s]; ``drop`` is its time [s]."""
    after = (record.time >= drop) & (record.time < drop + _WINDOW)
    before = record.time < drop - 5e-3
    count = 1 << int(np.log2(min(0.05 * record.sampling_rate, 0.5 * after.sum(), before.sum()) + 1.0))
    edges = _LOWEST * 2.0 ** np.arange(
        0.0, np.log2(max(0.4 * record.sampling_rate / _LOWEST, 1.0)), 1.0 / _BANDS
    )
    live = np.isfinite(record.along).all(axis=0)  # a channel that lacks readings tells nothing here
    described = _described(record, model, speed, int(after.sum())) if count > 1 and live.any() else None
    if described is None:
        return []
    shown, floor, expected = (
        _powers(along[:, live], record.sampling_rate, count, edges)
        for along in (record.along[after], record.along[before], described)
    )
    velocity = np.nan_to_num(np.median(expected, axis=1)) * np.diff(edges**3)
    below = np.cumsum(velocity) - velocity < _IMPACTS * velocity.sum()
    tells = (expected > _SEEN * floor) & below[:, None]
    bands = np.flatnonzero(tells.sum(axis=1) > 0.5 * tells.shape[1])
    if len(bands) < 3:
        return []
    lack = 10.0 * np.log10(expected / np.maximum(shown - floor, 1e-3 * shown))
    lack = np.nanmedian(np.where(tells, lack, np.nan)[bands], axis=1)
    if lack[-2:].mean() < _LACKS:
        return []
    first = max(np.flatnonzero(lack[:-2] < _CORNER), default=-1) + 1
    corner = edges[bands[first]]
    return [found("low-pass", corner=corner, lacks=lack[-2:].mean(), above=2.0 * edges[bands[-1] + 1])]


def _described(record: Record, model: DropModel, speed: float, count: int) -> Array | None:
    """The described machine along the sensors after a drop [m], shape (count, S); None if it cannot drop."""
    from rotordrop.simulate.case import DropCase
    from rotordrop.simulate.drop import simulate_drop

    step = 1.0 / record.sampling_rate
    try:
        case = DropCase(speed=speed, duration=count * step, output_step=step, most_steps=1_000_000)
        moved = simulate_drop(model, case).at_nodes([sensor.node for sensor in record.sensors])
    except RotordropError:
        return None
    along: Array = np.sum(moved[:count] * record.directions, axis=-1)
    return along if len(along) == count else None


def _powers(along: Array, rate: float, count: int, edges: Array) -> Array:
    """Mean power of segments of ``count`` samples in bands [m²], shape (bands, S)."""
    whole = along[: len(along) // count * count].reshape(-1, count, along.shape[1])
    segments = (whole - whole.mean(axis=1, keepdims=True)) * np.hanning(count)[:, None]
    power = np.mean(np.abs(np.fft.rfft(segments, axis=1)) ** 2, axis=0)
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    inside = [(frequency >= low) & (frequency < high) for low, high in pairwise(edges)]
    return np.array(
        [power[one].mean(axis=0) if one.any() else np.full(power.shape[1], np.nan) for one in inside]
    )
