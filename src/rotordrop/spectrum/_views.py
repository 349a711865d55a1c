"""Taking one line out of a signal: its slowly changing amplitude, its frequency, the rest; lines found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from rotordrop.arrays import Array, ComplexArray, Mask
from rotordrop.spectrum.candidates import LineKind
from rotordrop.spectrum.speed import FrequencyPath, SpeedProfile
from rotordrop.spectrum.waterfall import FramePower, frame_power, order_power

LOWEST_FREQUENCY, HIGHEST_ORDER = 5.0, 20.0
"""Where lines are looked for [Hz], [1]."""
FRAME = 1.6384
"""Length of a frame for steady lines [s]: that of the paper."""
TURNS = 32
"""Turns of the rotor in a frame for orders [1]."""
BANDWIDTH = 1.0
"""Amplitude changes that are followed [Hz]."""

SHARPENING = 3
"""Passes over what the smoothing missed: each widens the band in which an amplitude is kept exactly."""


TAPS_PER_FACTOR = 10
STOP_BAND = 90.0
"""Length of the filter before thinning out, in factors [1], and what it leaves of all that would fold back
[dB]: it passes 0.2 of the rate that remains unchanged."""


@dataclass(frozen=True, kw_only=True)
class Near:
    """What a signal holds near a path: turned back by the phase of the path, and thinned out."""

    value: ComplexArray
    """Twice the signal, turned back [m], shape (M, C)."""
    path: Array
    """Phase of the path at every sample of the signal [rad], shape (N,)."""
    phase: Array
    """The same at the samples that are left [rad], shape (M,)."""


@dataclass(frozen=True, kw_only=True)
class Envelope:
    """Complex amplitude of a line over time, in every channel."""

    value: ComplexArray
    """The line is the real part of value times e^(j phase) [m], zero-to-peak, shape (M, C)."""
    phase: Array
    """Phase [rad] the line was assumed to follow, shape (M,)."""
    near: Near
    """What it was found in."""


def smooth(values: Array, samples: int) -> Array:
    """Smooth over so many samples on each side (three moving averages), fair to the ends, shape kept."""
    rows = np.array(values.T, dtype=np.float64, order="C", ndmin=2)
    _smooth_rows(rows, samples)
    return np.ascontiguousarray(rows.T).reshape(values.shape)


def _smooth_rows(rows: Array, samples: int) -> None:
    """Smooth every row in place."""
    size = max(samples, 1)
    for _ in range(3):
        uniform_filter1d(rows, size, axis=1, mode="constant", output=rows)
    rows /= _share_inside(rows.shape[1], size)


@lru_cache(maxsize=8)
def _share_inside(count: int, size: int) -> Array:
    """Share of the three moving averages that lies inside a series, sample by sample."""
    weight = np.ones(count)
    for _ in range(3):
        weight = uniform_filter1d(weight, size, mode="constant")
    weight.setflags(write=False)
    return weight


def _thinned(rows: Array, factor: int) -> Array:
    half = TAPS_PER_FACTOR // 2
    window = ("kaiser", 0.1102 * (STOP_BAND - 8.7))
    taps = scipy.signal.firwin(2 * half * factor + 1, 1.0 / factor, window=window)
    last = half - (-rows.shape[-1] // factor)
    return cast(Array, scipy.signal.upfirdn(taps, rows, 1, factor, axis=-1)[..., half:last])


@lru_cache(maxsize=8)
def _share_thinned(count: int, factor: int) -> Array:
    """Share of the filter that lies inside a series, at every sample that is left."""
    return _thinned(np.ones(count), factor)


def power_share(envelope: Envelope, present: NDArray[np.bool_]) -> Array:
    """Share of the line's power at each sample [1], where it is present."""
    power = np.where(present[:, None], np.abs(envelope.value) ** 2, 0.0).sum(axis=1)
    return cast(Array, power / power.sum())


@dataclass(frozen=True, kw_only=True)
class Offset:
    """How far a line's true frequency (or order) lies from the assumed one."""

    value: float
    error: float
    """Offset and its standard error [unit of advance per radian]."""


def mean_offset(envelope: ComplexArray, advance: Array, *, lag: int, present: NDArray[np.bool_]) -> Offset:
    """Mean offset of a line from the turning of its envelope, weighted by power.

    The envelope (N, C) is a complex amplitude [m]; the advance (N,) is what the offset is counted in: time
    times 2π [s rad] gives Hz, rotor angle [rad] gives orders; the lag is between compared samples;
    ``present`` (N,) is where the line is there.
    """
    pairs = present[:-lag] & present[lag:]
    product = np.where(pairs[:, None], envelope[lag:] * envelope[:-lag].conj(), 0.0).sum(axis=1)
    step = advance[lag:] - advance[:-lag]
    groups = np.arange(0, product.size, lag)
    turning = np.add.reduceat(product, groups)
    weight = np.abs(turning)
    # A bang is no line: no moment counts much more than the usual one.
    weight = np.minimum(weight, 4.0 * float(np.median(weight[weight > 0.0]))) if weight.any() else weight
    mean_step = np.add.reduceat(step, groups) / np.diff(np.append(groups, product.size))
    if weight.sum() == 0.0:
        return Offset(value=0.0, error=math.inf)
    power = float(np.sum(weight * mean_step**2))
    value = float(np.sum(weight * np.angle(turning) * mean_step)) / power
    left = np.angle(turning * np.exp(-1j * value * mean_step))
    effective = max(float(weight.sum() ** 2 / np.sum(weight**2)), 1.0)
    scatter = math.sqrt(float(np.sum(weight * left**2) / np.sum(weight * mean_step**2)) / effective)
    return Offset(value=value, error=scatter)


def drift_phase(
    envelope: ComplexArray, sampling_rate: float, present: NDArray[np.bool_], *, span: float
) -> Array:
    """Slow phase [rad], shape (N,), by which a line wanders from its assumed frequency, smoothed over a span
    [s].

    Where the line is absent its frequency is taken as that of the nearest moments where it is there.
    """
    lag = max(round(0.05 * sampling_rate), 1)
    product = (envelope[lag:] * envelope[:-lag].conj()).sum(axis=1)
    product = np.where(present[:-lag] & present[lag:], product, 0.0)
    rows = np.stack([product.real, product.imag])
    for _ in range(2):
        _smooth_rows(rows, round(0.5 * span * sampling_rate))
    product = rows[0] + 1j * rows[1]
    size = np.abs(product)
    if not size.any():
        return np.zeros(len(envelope))
    known = size > 1e-6 * float(np.median(size[present[:-lag]])) if present[:-lag].any() else size > 0.0
    index = np.arange(product.size)
    rate = np.interp(index, index[known], np.angle(product[known])) / lag
    rate = np.concatenate([rate[:1].repeat(lag // 2), rate, rate[-1:].repeat(lag - lag // 2)])
    return cast(Array, np.cumsum(rate))


BESIDE = 25.0
"""Band [Hz] on either side of a moving path whose power is its floor."""


@dataclass(frozen=True, kw_only=True)
class View(FramePower):
    """One way to look at a signal: over frequency, or over order."""

    of_orders: bool
    length: Array
    """Length of the frames [s], shape (F,)."""
    share: float
    """Of the usual length [1]."""

    @property
    def resolution(self) -> float:
        """Of a usual frame [Hz]."""
        return 1.0 / float(np.median(self.length))


class Clock:
    """Times of the samples, with rotor speed and angle if they are known.

    Lines are described at fewer samples than the signal has, as their amplitudes change slowly.
    """

    def __init__(
        self,
        samples: int,
        sampling_rate: float,
        profile: SpeedProfile | None,
        *,
        start_time: float,
        highest_frequency: float,
    ) -> None:
        self.highest_frequency = highest_frequency
        self.signal_rate = sampling_rate
        self.start = start_time
        self.signal_time: Array = start_time + np.arange(samples, dtype=np.float64) / sampling_rate
        self.signal_angle = None if profile is None else profile.angle_at(self.signal_time)
        self._signal_speed = np.zeros(samples) if profile is None else profile.speed_at(self.signal_time)
        self.factor = max(int(sampling_rate // max(5.2 * BESIDE, 50.0 * BANDWIDTH)), 1)
        self.rate = sampling_rate / self.factor
        self.time: Array = self.signal_time[:: self.factor].copy()
        self.angle = None if self.signal_angle is None else self.signal_angle[:: self.factor].copy()
        self.speed: Array = self._signal_speed[:: self.factor] / math.tau
        self.frame = min(FRAME, samples / sampling_rate / 3.0)

    def at(self, time: Array, values: Array) -> Array:
        """Values [any] at the times of lines, at other times."""
        return np.interp(time, self.time, values)

    def rate_of(self, phase: Array) -> Array:
        """Frequency [Hz] of a phase [rad] at the times of lines."""
        return cast(Array, np.gradient(phase) * self.rate / math.tau)

    def reachable(self, phase: Array) -> Mask:
        """Where a phase [rad] runs at a frequency that is looked at."""
        frequency = np.abs(self.rate_of(phase))
        return (frequency >= LOWEST_FREQUENCY) & (frequency <= self.highest_frequency)

    def near(self, signal: Array, path: Array) -> Near:
        """Turn a signal back by the phase of a path and thin out what lies near it.

        The signal (N, C) [m] is without its mean, the path (N,) is a phase [rad].
        """
        channels, factor = signal.shape[1], self.factor
        turned = np.empty((2 * channels, len(signal)))  # a row per channel: real parts, then imaginary parts
        np.multiply(2.0 * signal.T, np.cos(path), out=turned[:channels])
        np.multiply(-2.0 * signal.T, np.sin(path), out=turned[channels:])
        if factor > 1:
            turned = _thinned(turned, factor) / _share_thinned(len(path), factor)
        value = (turned[:channels] + 1j * turned[channels:]).T
        return Near(value=value, path=path, phase=path[::factor].copy())

    def extract(self, near: Near, turn: Array | float = 0.0) -> Envelope:
        """Take the part out that follows a path and a further phase, with an amplitude that changes slowly.

        ``turn`` (M,) is what the phase of the line has more than that of the path [rad].
        """
        samples = round(0.5 * self.rate / BANDWIDTH)
        back = (near.value * np.exp(-1j * np.broadcast_to(turn, near.phase.shape))[:, None]).T
        turned = np.concatenate([back.real, back.imag])
        value = np.zeros_like(turned)
        for _ in range(SHARPENING):
            missed = turned - value
            _smooth_rows(missed, samples)
            value += missed
        channels = len(back)
        found = (value[:channels] + 1j * value[channels:]).T
        return Envelope(value=found, phase=near.phase + turn, near=near)

    def line(self, envelope: Envelope, size: NDArray[np.complex128]) -> Array:
        """A line with a complex amplitude [m] at every sample of the signal, shape (N, C)."""
        then, now = self.time, self.signal_time
        phase = envelope.near.path + np.interp(now, then, envelope.phase - envelope.near.phase)
        cosine, sine = np.cos(phase), np.sin(phase)
        return np.column_stack(
            [np.interp(now, then, of.real) * cosine - np.interp(now, then, of.imag) * sine for of in size.T]
        )

    def same_view(self, view: View, signal: Array) -> View:
        """The same look at another signal [m]."""
        again = (self.order_view if view.of_orders else self.frequency_view)(signal, view.share)
        assert again is not None
        return again

    def frequency_view(self, signal: Array, share: float) -> View:
        """Power over frequency, in frames of equal time."""
        length = share * self.frame
        frames = frame_power(
            signal, self.signal_rate, start_time=self.start, frame=length, highest=self.highest_frequency
        )
        lengths = np.full(len(frames.time), length)
        return View(**vars(frames), of_orders=False, length=lengths, share=share)

    def order_view(self, signal: Array, share: float) -> View | None:
        """Power over order, in frames of equal rotor angle; None without speed or whole frame."""
        if self.signal_angle is None:
            return None
        turns = 2 * round(0.5 * TURNS * (share if share == 1.0 else 2.0 * share))
        slowest = max(LOWEST_FREQUENCY / HIGHEST_ORDER, 0.5)
        frames = order_power(
            signal,
            self.signal_time,
            self.signal_angle,
            self._signal_speed,
            turns=turns,
            highest_order=HIGHEST_ORDER,
            highest_frequency=self.highest_frequency,
            lowest_speed=math.tau * slowest,
        )
        if frames is None:
            return None
        lengths = turns / np.maximum(self.at(frames.time, self.speed), 0.1)
        return View(**vars(frames), of_orders=True, length=lengths, share=share)


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenLine:
    """Where and when a line of a coast-down is seen."""

    kind: LineKind
    """Follows the speed, stands still, both (sum or difference of an order and a steady line), or the speed
    changes too little to say."""
    frequency: float
    frequency_error: float
    """Mean frequency over the time it was seen [Hz], weighted by power, and its standard error, never less
    than one over the time that holds its power, divided by √12, for an order by two."""
    order: float | None
    order_error: float | None
    """Multiple of the rotor speed [1], and its standard error, with the turns in place of the time; None for
    a steady line."""
    drift: tuple[float, float]
    """Lowest and highest frequency of a steady line over its time [Hz]."""
    width: float
    """Full width at half power [Hz], without that of the frame; 0 when it is below the resolution."""
    floor: float
    """Local noise floor [m] where it was found."""
    ratio: float
    """Amplitude over the local floor where it was found [1]."""
    first_seen: float
    last_seen: float
    """[s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundLine(SeenLine):
    """A line that was found, with what the search goes on with."""

    amplitude: Array
    forward: Array
    backward: Array
    """Amplitudes along x and y, and radii of the parts that turn with the spin and against it [m]."""
    existence: float
    """Probability that it is one [1]."""
    time: Array
    path: Array
    """The frequency that it follows [Hz], shape (N,)."""
    power: Array
    """Mean square of what was taken out of the signal [m²], over all channels, shape (N,)."""
    brief: bool
    """Seen only for a short part of the signal."""
    parent: FoundLine | None = None
    multiple: float = 0.0
    """For a sum or difference: the steady line, and the order that is added to it [1]."""

    @property
    def strength(self) -> float:
        """Sum of squares of what was taken out [m²]."""
        return float(np.sum(self.power))

    @property
    def skirt(self) -> float:
        """Distance to keep from the line, by how much of it is left when it is taken out [1]: 1 at 30
        floors.
        """
        return max(math.log10(max(self.ratio, 1.0)) - 0.5, 0.5)

    def path_of_frequency(self) -> FrequencyPath:
        """Frequency over time, about twenty values per second."""
        step = max(round(0.05 / (self.time[1] - self.time[0])), 1)
        return FrequencyPath(time=self.time[::step], frequency=self.path[::step].copy())

    def frequency_at(self, time: Array) -> Array:
        """Frequency [Hz] at times [s]; infinite where a brief line is not there."""
        frequency = np.interp(time, self.time, self.path)
        if self.brief:
            frequency[(time < self.first_seen - 1.0) | (time > self.last_seen + 1.0)] = np.inf
        return frequency


def path_range(line: FoundLine, time: Array, length: Array, unit: Array) -> tuple[Array, Array]:
    """Lowest and highest frequency of a line within frames, in units [Hz] that change with time.

    Time and length of the frames have shape (F,) [s]; the unit (F, 5) is what one step of the view is worth
    at five moments of each frame [Hz]: 1, or the rotor speed for orders. The result is infinite where the
    line is not there.
    """
    places = np.array(
        [line.frequency_at(time + share * length) / unit[:, k] for k, share in enumerate(FIVE_MOMENTS)]
    )
    there = np.isfinite(places)
    low = np.where(there, places, np.inf).min(axis=0)
    high = np.where(there, places, -np.inf).max(axis=0)
    return low, np.where(there.any(axis=0), high, np.inf)


FIVE_MOMENTS = (-0.4, -0.2, 0.0, 0.2, 0.4)
"""Moments within a Hann frame [share of its length] between which it looks."""


def radius(value: NDArray[np.complex128], direction: float) -> Array:
    """Root-mean-square radius [m] of the forward (+1) or backward (−1) turning part in each plane, shape
    (P,).
    """
    turning = np.abs(value[:, 0::2] + direction * 1j * value[:, 1::2]) / 2.0
    return np.asarray(np.sqrt(np.mean(turning**2, axis=0)))
