"""Whether readings follow each other as those of a moving rotor do: jumps, lost samples, an uneven clock.

A rotor has position and velocity from one sample to the next, whatever machine it belongs to. Where parabolas
before and after a place describe the motion, they meet there; where all channels jump by one time times their
velocities, samples are missing. While it levitates, its orbit turns with the shaft: lost samples turn it on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.series import SIGMA_OF_MEDIAN, noise_by_differences
from rotordrop.units import percent

if TYPE_CHECKING:
    from rotordrop.record.record import Record

_FEWEST = 8
"""Fewest samples on either side of a place through which a parabola says how the rotor moves [1]: five remain
to tell whether it does. Twice as many, and so on, where noise hides what is missing."""

_AS_PARABOLA = 1.6e-3
"""Longest such side [s]: of an orbit of 100 Hz a parabola leaves 1 % over that time; whether one describes
the motion is asked of each by itself."""

_PART = 65536

_SMOOTH = 2.4
"""Standard deviations by which the mean square of the residual of those parabolas may lie above that of noise
where they describe the motion [1]: in a contact of less than a millisecond they do not, and nothing is said
of a jump there."""

_LONGEST = 0.5e-3
"""Longest side of a jump of a single channel beyond the shortest one [s]: of 57 clean drops of all rotors
none had more than 5.4 standard deviations, with 0.65 ms 7.1; channels that jump together agree on a time and
may be longer."""

_KINK = 0.6
"""Part of a sample by which the kink of a hard impact may lie aside of the middle of two samples [1]: a half,
and what the parabolas leave open."""

_TORN = 8.0
"""Jump of a channel in standard deviations, beyond what the parabolas may leave out, from which it is none of
noise [1]: of 577 clean drops of all rotors one had more than 7, of 5 kg at 20 kHz."""

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

_BLOCK = 256
"""Longest block looked for where two neighbouring ones may be exchanged [samples]: 512 bytes, the smallest
unit of a disk, in readings of 16 bits."""

_MIDDLE = 4.0
"""Jump in the middle of two exchanged blocks, in standard deviations, from which they are looked for [1]: a
steady motion jumps there by twice what it does at both ends."""

_BESIDE = 64
"""Places on either side that say how large jumps are there [1] (chosen)."""

_EXCHANGED = 50.0
"""By how much the squares of three jumps, in their variances, fall with two blocks exchanged back from where
they are named [1]: 37 at most in 500 clean drops of all rotors; 56 where 8 samples are 0.8 ms long."""

_BACK = 5.0
"""Standard deviations by which the squares that are left then may lie above those of chance [1]."""

_SAME_WAY = 3.0
"""Standard deviations up to which channels agree on the missing time [1]."""

_WHOLE = 3.0
"""Standard deviations within which what is missing is a whole number of samples [1]."""

_ORDER = 6
"""Differences that leave no motion of a rotor: at 1 kHz of bending and 20 kHz of sampling 1e-3 of it [1]."""

_UNEVEN = 1.3
"""Scatter of readings along the motion over that across it from which the clock is uneven [1]: 0.94 to 1.1 in
80 clean drops."""

_UNEVEN_SHARE = 0.02
"""Scatter of the sampling interval that is worth a word [1], that of a clock that is written down."""

_MOVES = 1000
"""Samples in motion that tell the two apart [1]: their medians then differ by 5 % by chance."""

_TURNED = 6.0
"""Standard deviations by which the orbit jumps in angle where samples are missing [1]: at a hundred places
looked at, five have one chance in 10,000."""

_LEAST_TURN = 0.5
"""Least such jump over what the shaft turns in a sample [1]: what is lost is a whole number of them."""

_PARTS = (8, 48)
"""Parts of the levitated motion, half turns or more, in which the angle of its orbit is looked at: at least
and at most [1]."""


@dataclass(frozen=True, kw_only=True)
class _Windows:
    """Sums over all stretches of so many samples, by which parabolas read the motion at their ends."""

    count: int
    """Samples of a stretch, a power of two."""
    sums: tuple[Array, Array, Array]
    """Sums of readings times the zeroth to second power of the sample, counted from the middle, (N, S)."""
    squares: Array
    """Sum of their squares [m²], shape (N, S)."""

    @classmethod
    def of(cls, readings: Array) -> _Windows:
        """Stretches of one sample."""
        nothing = np.zeros_like(readings)
        return cls(count=1, sums=(readings, nothing, nothing), squares=readings**2)

    def doubled(self) -> _Windows:
        """Stretches twice as long, from the sums of their halves: no sample is added up again."""
        half = self.count
        (early, early_1, early_2), (late, late_1, late_2) = (
            [part[own] for part in self.sums] for own in (slice(-half), slice(half, None))
        )
        first = early_1 + late_1 + 0.5 * half * (late - early)
        second = early_2 + late_2 + half * (late_1 - early_1) + 0.25 * half**2 * (early + late)
        squares = self.squares[:-half] + self.squares[half:]
        return _Windows(count=2 * half, sums=(early + late, first, second), squares=squares)

    @property
    def bend(self) -> Array:
        """Second power beside its mean, times the readings, summed."""
        return np.asarray(self.sums[2] - (self.count**2 - 1) / 12.0 * self.sums[0])

    @property
    def norms(self) -> tuple[float, float, float]:
        """Sums of the squares of the first three Legendre polynomials over the samples."""
        squared = self.count**2
        line = self.count * (squared - 1) / 12.0
        return float(self.count), line, line * (squared - 4) / 15.0

    @property
    def left(self) -> Array:
        """Sum of the squares that parabolas leave [m²]."""
        pairs = zip((self.sums[0], self.sums[1], self.bend), self.norms, strict=True)
        return np.asarray(self.squares - sum(part**2 / norm for part, norm in pairs))

    def at_ends(self) -> tuple[Array, Array, Array, Array]:
        """Parabolas half a sample before the first and beyond the last one, and their slopes per sample."""
        ahead, (flat, line, bow) = 0.5 * self.count, self.norms
        high = (ahead**2 - (self.count**2 - 1) / 12.0) / bow
        even, odd = self.sums[0] / flat + high * self.bend, ahead / line * self.sums[1]
        slope, turn = self.sums[1] / line, 2.0 * ahead / bow * self.bend
        return even - odd, even + odd, slope - turn, slope + turn

    @property
    def error_at_end(self) -> float:
        """Standard error of what they read there, over that of a sample [1]."""
        ahead, (flat, line, bow) = 0.5 * self.count, self.norms
        high = ahead**2 - (self.count**2 - 1) / 12.0
        return math.sqrt(1.0 / flat + ahead**2 / line + high**2 / bow)


@dataclass(frozen=True, kw_only=True)
class _Jumps:
    """Jumps of the motion between the parabolas before and after every place; shape (N, S)."""

    end: Array
    begin: Array
    """Where the parabolas before and after the place meet it [m]."""
    jump: Array
    """How far these are apart [m]."""
    before: Array
    after: Array
    """Velocity on both sides [m per sample]."""
    smooth: NDArray[np.bool_]
    """Whether both parabolas describe the motion."""
    excess: Array
    """What both leave of the readings beyond noise, in its variances [1]."""
    free: int
    """Samples of one side that remain to tell so [1]."""
    error: Array
    """Standard deviation of a jump by noise [m], shape (S,)."""


def check_continuity(record: Record) -> list[Finding]:
    """Find places where no rotor moves from one sample to the next, or samples that were not taken evenly."""
    signals = record.signals
    longest = _AS_PARABOLA * record.sampling_rate
    doubled = range(max(math.floor(math.log2(longest / _FEWEST)), 0) + 1)
    counts = [_FEWEST << double for double in doubled]
    if len(signals) < 4 * counts[-1] or not np.isfinite(signals).all():
        return []
    steps = [np.median(np.diff(np.unique(c))) if np.ptp(c) > 0.0 else 0.0 for c in signals.T]
    own = np.array([noise_by_differences(column, 4) for column in signals.T])
    noise = np.maximum(np.hypot(own, np.array(steps) / np.sqrt(12.0)), 1e-12)
    uneven = _uneven(record, noise)
    if uneven:
        return uneven  # readings that are early or late jump by themselves
    torn, lost, exchanged = _Worst(), _Worst(), _Exchanged()
    reach = 2 * (counts[-1] + _BLOCK + _BESIDE)
    for begin in range(0, len(signals), _PART):  # a coast-down of a minute must not be held eight times
        part = signals[begin : begin + _PART + reach]
        # about their middle: the difference of two sums of squares loses what an offset takes up of them
        windows = _Windows.of(part - np.median(part, axis=0))
        # where a channel holds one reading it is stuck, which has its own name
        same = np.cumsum(np.vstack([np.zeros(part.shape[1]), part[1:] == part[:-1]]), axis=0)
        while windows.count < counts[-1] and len(part) > 4 * windows.count:
            windows = windows.doubled()
            if windows.count < _FEWEST:
                continue
            seen = _jumps_of(windows, same, noise)
            short = windows.count <= _LONGEST * record.sampling_rate
            if windows.count == _FEWEST or short:
                torn.keep(_size_of_jump(seen), seen, begin + windows.count)
            if short:
                exchanged.keep(seen, begin, windows.count)
            lost.keep(_size_of_loss(seen), seen, begin + windows.count)
    if lost.size >= _LOST:
        return [_lost(lost, record)]
    if torn.size >= _TORN:
        return [_torn(torn, record)]
    return [exchanged.finding(record)] if exchanged.size >= _EXCHANGED else []


def _jumps_of(windows: _Windows, same: Array, noise: Array) -> _Jumps:
    """Jumps between stretches; `same` counts from the first sample on how often a channel reads as before."""
    count, free, left = windows.count, windows.count - 3, windows.left
    smooth = left < (free + _SMOOTH * math.sqrt(2.0 * free)) * noise**2
    smooth &= same[count - 1 :] - same[: len(smooth)] < count // 2
    begins, ends, into, out = windows.at_ends()
    excess = left / noise**2 - free
    return _Jumps(
        end=ends[:-count],
        begin=begins[count:],
        jump=begins[count:] - ends[:-count],
        before=out[:-count],
        after=into[count:],
        smooth=smooth[count:] & smooth[:-count],
        excess=excess[count:] + excess[:-count],
        free=free,
        error=np.sqrt(2.0) * windows.error_at_end * noise,
    )


def _size_of_jump(seen: _Jumps) -> Array:
    """Jump of every channel beyond what a kink explains, in standard deviations, shape (N, S)."""
    # a hard impact turns the velocity between two samples: that kink may lie half a sample aside
    turned = np.abs(seen.after - seen.before)
    # noise that happens to be small hides no less
    excess = np.maximum(seen.excess, 0.0) + _SURELY * math.sqrt(4.0 * seen.free)
    beyond = np.abs(seen.jump) - _KINK * turned - np.sqrt(_LEFT_OUT * excess) * seen.error
    return np.asarray(np.maximum(beyond, 0.0) * seen.smooth / seen.error)


def _size_of_loss(seen: _Jumps) -> Array:
    """Missing time over its standard deviation, where channels jump by it times their velocity, shape (N, 1).

    Channels that parabolas do not describe on both sides have no voice; more than half must have one.
    Over a gap the motion goes on with one acceleration: it has the mean velocity of both sides. What is no
    parabola within the noise jumps too, by as much as the readings on both sides leave room for.
    """
    jump, mean, turned = (
        part * seen.smooth / seen.error
        for part in (seen.jump, 0.5 * (seen.before + seen.after), seen.after - seen.before)
    )
    weight = np.sum(mean**2, axis=1)
    missing = np.sum(jump * mean, axis=1) / np.maximum(weight, 1e-300)
    aside = np.sum((jump - missing[:, None] * mean) ** 2, axis=1)
    seeing = np.sum(seen.smooth, axis=1)
    whole = np.abs(missing - np.round(missing)) * np.sqrt(weight) < _WHOLE
    fits = (seeing > max(jump.shape[1] // 2, 1)) & whole & (missing > 0.5)
    fits &= aside < _SAME_WAY**2 * seeing
    kink = _KINK * np.linalg.norm(turned, axis=1)
    excess = np.maximum(np.sum(seen.excess * seen.smooth, axis=1), 0.0)
    bent = np.sqrt(_LEFT_OUT * (excess + _SURELY * np.sqrt(4.0 * seen.free * seeing)))
    return np.asarray((np.maximum(missing * np.sqrt(weight) - kink - bent, 0.0) * fits)[:, None])


class _Worst:
    """The largest of the jumps looked at."""

    def __init__(self) -> None:
        self.size, self.at = 0.0, 0
        self.sizes = self.jump = self.velocity = np.zeros(0)

    def keep(self, sizes: Array, seen: _Jumps, begin: int) -> None:
        """Keep the largest of more jumps, the first of which is at a sample."""
        if not sizes.size or float(np.max(sizes)) <= self.size:
            return
        row = int(np.argmax(np.max(sizes, axis=1)))
        self.size, self.at, self.sizes = float(np.max(sizes)), begin + row, sizes[row]
        self.jump = np.abs(seen.jump[row])
        self.velocity = 0.5 * (seen.before[row] + seen.after[row])


class _Exchanged:
    """Two neighbouring blocks that the motion says were exchanged: three jumps that vanish with them back."""

    def __init__(self) -> None:
        self.size, self.at, self.length = 0.0, 0, 0
        self.channel: int | None = None

    def keep(self, seen: _Jumps, begin: int, count: int) -> None:
        """Keep the surest of more places, between parabolas of `count` samples, the first at a sample."""
        jump, channels = seen.jump / seen.error, seen.jump.shape[1]
        reach, lengths = _BLOCK + _BESIDE, np.arange(count, _BLOCK + 1)
        beside = np.arange(_FEWEST + 1, _FEWEST + 1 + _BESIDE)
        beside = np.concatenate([-beside, beside])
        places = reach + np.flatnonzero(np.max(np.abs(jump[reach:-reach]), axis=1, initial=0.0) > _MIDDLE)
        for place in places.tolist():
            first, last = place - lengths, place + lengths
            # where the motion is rougher than noise, by how rough it is there
            usual = np.maximum(SIGMA_OF_MEDIAN * np.median(np.abs(jump[place + beside]), axis=0), 1.0)
            now = jump[first] ** 2 + jump[place] ** 2 + jump[last] ** 2
            back = [
                seen.begin[place] - seen.end[first],
                seen.begin[first] - seen.end[last],
                seen.begin[last] - seen.end[place],
            ]
            left = np.sum((np.array(back) / seen.error) ** 2, axis=0) / usual**2
            gain = now / usual**2 - left
            for channel in (*range(channels), None):
                own = slice(None) if channel is None else [channel]
                free = 3.0 * (channels if channel is None else 1)
                fits = np.sum(left[:, own], axis=1) < free + _BACK * math.sqrt(2.0 * free)
                sizes = np.sum(gain[:, own], axis=1) * fits
                best = int(np.argmax(sizes))
                if sizes[best] > self.size:
                    self.size, self.channel = float(sizes[best]), channel
                    self.at, self.length = begin + count + int(first[best]), int(lengths[best])

    def finding(self, record: Record) -> Finding:
        """What is said of them."""
        return Finding(
            kind=Kind.TORN,
            message=f"the motion goes on smoothly only where the {self.length} samples from here on change "
            f"places with the {self.length} after them, {math.sqrt(self.size):.0f} standard deviations: two "
            "blocks were exchanged",
            remedy="copy or export the recording again",
            severity="warning",
            channel=None if self.channel is None else record.channel_names[self.channel],
            time=float(record.time[self.at]),
        )


def _lost(worst: _Worst, record: Record) -> Finding:
    fast = int(np.argmax(np.abs(worst.velocity)))
    missing = worst.jump[fast] / abs(worst.velocity[fast])
    return Finding(
        kind=Kind.DROPPED_BLOCK,
        message=f"between two samples all channels go on by {float(np.max(worst.jump)) * 1e6:.3g} µm at "
        f"most, what they do in {missing:.2g} samples ({missing / record.sampling_rate * 1e3:.2g} ms) with "
        f"the velocity before and after, {worst.size:.0f} standard deviations: samples are missing there",
        remedy="copy or export the recording again; the times after lost samples are wrong",
        severity="stop",
        time=float(record.time[worst.at]),
    )


def _torn(worst: _Worst, record: Record) -> Finding:
    torn = np.flatnonzero(worst.sizes > 0.5 * _TORN)
    alike = len(torn) > record.signals.shape[1] // 2
    return Finding(
        kind=Kind.DROPPED_BLOCK if alike else Kind.TORN,
        message=f"the motion jumps by {float(np.max(worst.jump[torn])) * 1e6:.3g} µm between two samples, "
        f"{worst.size:.0f} standard deviations off the parabolas before and after it: "
        + ("samples are missing or exchanged there" if alike else "a block was overwritten or exchanged"),
        remedy="copy or export the recording again; the times after lost samples are wrong",
        # a drop cannot be recorded again: one torn channel leaves the others to tell of it
        severity="stop" if alike else "warning",
        channel=None if alike else ", ".join(record.channel_names[i] for i in torn),
        time=float(record.time[worst.at]),
    )


def _uneven(record: Record, noise: Array) -> list[Finding]:
    """Readings taken early or late: they scatter along the motion of all channels, not across it.

    What a channel reads at a wrong time is off by its velocity times one error of time, the same in all.
    Noise, and what the rotor does within a few samples, have no reason to point along the velocity.
    """
    signals, count = record.signals, len(record.signals) - _ORDER
    speed = np.empty(count)
    for begin in range(0, count, _PART):
        part = signals[begin : begin + _PART + _ORDER] / noise
        velocity = (part[_ORDER - 1 : -1] - part[1 : 1 - _ORDER]) / (_ORDER - 2)
        speed[begin : begin + _PART] = np.linalg.norm(velocity, axis=1)
    fast = speed > np.median(speed[speed > 0.0]) if np.any(speed > 0.0) else speed > 0.0
    freedom = signals.shape[1] - 1
    if int(np.sum(fast)) < _MOVES or freedom == 0:  # a single channel has nothing across its motion
        return []
    # of the faster half the fastest, where a wrong time shows most
    fast &= speed >= np.sort(speed[fast])[-max(_MOVES, int(np.sum(fast)) // 4)]
    # samples from the first of a difference to its last: shape (difference, sample, channel)
    near = signals[np.flatnonzero(fast)[:, None] + np.arange(_ORDER + 1)]
    near /= noise
    unit = (near[:, -2] - near[:, 1]) / (_ORDER - 2) / speed[fast, None]
    scatter = np.diff(near, _ORDER, axis=1)[:, 0]
    along = np.sum(scatter * unit, axis=1)
    across = scatter - along[:, None] * unit
    with_motion = SIGMA_OF_MEDIAN * float(np.median(np.abs(along)))
    middle = freedom * (1.0 - 2.0 / (9.0 * freedom)) ** 3  # median of the chi square
    aside = float(np.sqrt(np.median(np.sum(across**2, axis=1)) / middle))
    if with_motion < _UNEVEN * aside:
        return []
    late = math.sqrt((with_motion**2 - aside**2) / math.comb(2 * _ORDER, _ORDER))
    share = late / float(np.median(speed[fast]))
    if share < _UNEVEN_SHARE:
        return []
    return [
        Finding(
            kind=Kind.JITTERED_CLOCK,
            message=f"the readings scatter {with_motion / aside:.2g} times as much along the motion of all "
            f"channels as across it: they were taken about {share / record.sampling_rate * 1e6:.2g} µs "
            f"({percent(share)} of an interval, rms) early or late, though the clock runs evenly",
            remedy="export the recording with the recorder's own sample clock",
            severity="warning",
        )
    ]


def check_orbit(levitated: LevitatedModel, record: Record) -> list[Finding]:
    """Find samples lost before the drop: the orbit of the levitated rotor is then ahead by an angle.

    A whole number of turns that is lost shows nowhere, and changes nothing that follows from the record.
    """
    inside = (record.time >= levitated.start) & (record.time <= levitated.end)
    time, signals = record.time[inside], record.signals[inside]
    half_turns = max(round(2.0 * (levitated.end - levitated.start) * levitated.frequency / _PARTS[1]), 1)
    turns = 0.5 * half_turns
    if not np.isfinite(signals).all():
        return []
    noise = np.maximum(levitated.noise, 1e-12)
    weight = levitated.amplitudes[0].conj() / noise**2
    number = ((time - levitated.start) * levitated.frequency / turns).astype(int)
    # what is left beside 1X, so that 2X and hum leave nothing in parts that hold no whole number of them
    waves = np.exp(2j * np.pi * levitated.frequency * time)
    left = signals - levitated.readings(time)
    power = max(float(np.sum(np.abs(levitated.amplitudes[0]) ** 2 / noise**2)), 1e-300)
    angle, error = [], []
    for part in range(int(number[-1])):
        own = number == part
        seen = 2.0 * np.mean(left[own] * waves[own].conj()[:, None], axis=0)
        angle.append(float(np.angle(power + np.sum(weight * seen))))
        error.append(float(np.sqrt(2.0 / (power * np.sum(own)))))
    least = _LEAST_TURN * 2.0 * np.pi * levitated.frequency / record.sampling_rate
    return _orbit_steps(np.unwrap(angle), np.array(error), levitated, turns, least)


def _orbit_steps(
    angle: Array, error: Array, levitated: LevitatedModel, turns: float, least: float
) -> list[Finding]:
    if len(angle) < _PARTS[0]:
        return []
    places = np.arange(len(angle))
    course = np.vander(places / len(places), 3) / error[:, None]
    best, at, size = 0.0, 0, 0.0
    for place in range(2, len(angle) - 1):
        design = np.column_stack([course, (places >= place) / error])
        inverse = np.linalg.pinv(design)
        found = inverse @ (angle / error)
        left = angle / error - design @ found
        scatter = max(float(np.sqrt(left @ left / max(len(angle) - 4, 1))), 1.0)
        sure = abs(float(found[3])) / (float(np.linalg.norm(inverse[3])) * scatter)
        if sure > best:
            best, at, size = sure, place, float(found[3])
    if best < _TURNED or abs(size) < least:
        return []
    when = levitated.start + at * turns / levitated.frequency
    return [
        Finding(
            kind=Kind.DROPPED_BLOCK,
            message=f"near {when:.4g} s, before the drop, the orbit jumps by about {np.degrees(size):+.3g}° "
            f"against the shaft that turns at {levitated.frequency:.4g} Hz, {best:.0f} standard deviations: "
            f"{abs(size) / (2 * np.pi * levitated.frequency) * 1e3:.2g} ms are missing, whole turns aside, "
            "or what holds the rotor changed",
            remedy="export the recording without gaps; make sure that nothing was switched before the drop",
            severity="warning",
            time=when,
        )
    ]
