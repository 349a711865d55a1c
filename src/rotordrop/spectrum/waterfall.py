"""Overlapping frames of a displacement, their spectra, and the clearest line in them against the noise floor.

Fewer samples where low frequencies matter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, cast

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray
from scipy.fft import fft, next_fast_len, rfft
from scipy.ndimage import map_coordinates, spline_filter1d

from rotordrop.arrays import Array, Mask
from rotordrop.errors import RecordError

Component = Literal["x", "y", "full"]
AmplitudeKind = Literal["zero-to-peak", "peak-to-peak"]

AMPLITUDE_SCALE: dict[str, float] = {"zero-to-peak": 1.0, "peak-to-peak": 2.0}


class PlanarSignal(Protocol):
    """Displacement (x, y) over time, shape (N, 2): an array in memory or one that still lies in a file."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Samples and directions, (N, 2)."""

    def __getitem__(self, key: slice, /) -> ArrayLike: ...


FEWEST_POINTS = 16
"""Samples of the shortest frame [1], without which no line is looked for (chosen)."""


PAPER_POINTS, PAPER_OVERLAP = 32768, 0.5
"""Samples per frame [1], and share of a frame that the next one uses again [1], of the paper."""

_FEWEST_FRAMES, _SHORTEST_FRAME = 12, 1024
"""A map with fewer frames shows bars and no change, one of shorter frames no lines [1] (chosen)."""


def frame_starts(samples: int, points: int, overlap: float = PAPER_OVERLAP) -> range:
    """First samples of the whole frames that fit into so many samples; nothing is padded."""
    return range(0, samples - points + 1, max(1, round(points * (1.0 - overlap))))


def points_for(samples: int) -> int:
    """Samples per frame of the paper, halved until a short signal has a dozen frames."""
    points = PAPER_POINTS
    while points > _SHORTEST_FRAME and len(frame_starts(samples, points)) < _FEWEST_FRAMES:
        points //= 2
    return points


@dataclass(frozen=True, kw_only=True)
class Waterfall:
    """Amplitude of displacement over frequency, one row per frame."""

    time: Array
    """Middle of each frame [s], shape (F,)."""
    frequency: Array
    """Lines [Hz]; negative ones are backward (against the spin) in a full spectrum, shape (K,)."""
    amplitude: Array
    """Amplitude [m], zero-to-peak or peak-to-peak as ``amplitude_kind`` says, shape (F, K)."""
    speed: Array | None
    """Mean rotor speed of each frame [rad/s], shape (F,)."""
    speed_change: Array | None
    """Largest minus smallest rotor speed within each frame [rad/s]: what smears the orders, shape (F,)."""
    component: Component
    """"x", "y" or "full"."""
    amplitude_kind: AmplitudeKind
    """"zero-to-peak" or "peak-to-peak"."""
    sampling_rate: float
    """Of the signal [Hz]."""
    points: int
    overlap: float
    """Samples per frame, and share of a frame that the next one uses again [1]."""

    @property
    def resolution(self) -> float:
        """Distance between two lines [Hz]."""
        return self.sampling_rate / self.points

    def average(self) -> Array:
        """Root-mean-square over the frames of the amplitude of each line [m], shape (K,)."""
        return cast(Array, np.sqrt(np.mean(self.amplitude**2, axis=0)))


def hann_window(points: int) -> Array:
    """Periodic Hann window [1], shape (points,); its mean is exactly 1/2, hence the paper's factor 2."""
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(points) / points)


def waterfalls(
    displacement: PlanarSignal,
    sampling_rate: float,
    *,
    components: Sequence[Component] = ("full",),
    speed: ArrayLike | None = None,
    points: int = PAPER_POINTS,
    overlap: float = PAPER_OVERLAP,
    amplitude_kind: AmplitudeKind = "zero-to-peak",
    start_time: float = 0.0,
    highest_frequency: float | None = None,
) -> tuple[Waterfall, ...]:
    """Cut a displacement into overlapping frames and give the amplitude of each frequency in each frame.

    A steady tone on a line reads its true amplitude; between two lines up to 15 % less (scalloping); a tone
    that moves within the frame less still. Frames are read one at a time, so that a
    file larger than memory can be passed.

    The displacement (N, 2) [m] is that of one plane, with the rotor speed (N,) [rad/s] where it is known;
    each component, one direction or forward and backward parts of x + jy, has a waterfall of its own; lines
    above the highest frequency [Hz] are left out. A frame has so many points, and shares the overlap [1] of
    them with the next one.

    Source: Neisi 2020, section 5.4 (Hann window, 32768 points, 50 % overlap, amplitude times 2).
    Differs from the paper: the full spectrum, and the choice of zero-to-peak or peak-to-peak.
    """
    samples = displacement.shape[0]
    starts = frame_starts(samples, points, overlap)
    if not starts:
        raise RecordError(
            f"waterfall: the signal has {samples} samples, one frame needs {points}; "
            f"choose shorter frames or a longer record"
        )
    lines = [_lines(points, sampling_rate, one, highest_frequency) for one in components]
    window = hann_window(points)
    amplitudes = [np.empty((len(starts), frequency.size)) for frequency, _ in lines]
    for row, start in enumerate(starts):
        frame = np.asarray(displacement[start : start + points], dtype=np.float64)
        frame = frame - frame.mean(axis=0)  # changes only the lines at 0 and ± one resolution
        for one, (_, keep), amplitude in zip(components, lines, amplitudes, strict=True):
            amplitude[row] = _amplitude(frame, window, one)[keep] * AMPLITUDE_SCALE[amplitude_kind]
    centre = (np.array(starts, dtype=np.float64) + points / 2) / sampling_rate
    mean_speed, change = _frame_speed(speed, samples, starts, points)
    return tuple(
        Waterfall(
            time=start_time + centre,
            frequency=frequency,
            amplitude=amplitude,
            speed=mean_speed,
            speed_change=change,
            component=component,
            amplitude_kind=amplitude_kind,
            sampling_rate=sampling_rate,
            points=points,
            overlap=overlap,
        )
        for component, (frequency, _), amplitude in zip(components, lines, amplitudes, strict=True)
    )


def _lines(
    points: int, sampling_rate: float, component: Component, highest: float | None
) -> tuple[Array, NDArray[np.intp]]:
    """Frequencies [Hz] in rising order, and where they stand in the transform."""
    if component == "full":
        frequency = np.fft.fftfreq(points, 1.0 / sampling_rate)
    else:
        frequency = np.fft.rfftfreq(points, 1.0 / sampling_rate)
    order = np.argsort(frequency)
    if highest is not None:
        order = order[np.abs(frequency[order]) <= highest]
    return cast(Array, frequency[order]), order


def _amplitude(frame: Array, window: Array, component: Component) -> Array:
    """Zero-to-peak amplitude [m] of each line of one frame, corrected for the window."""
    gain = window.sum()
    if component == "full":
        orbit = frame[:, 0] + 1j * frame[:, 1]
        return cast(Array, np.abs(np.fft.fft(orbit * window)) / gain)
    column = frame[:, 0 if component == "x" else 1]
    amplitude = 2.0 * np.abs(np.fft.rfft(column * window)) / gain
    amplitude[0] /= 2.0
    if window.size % 2 == 0:
        amplitude[-1] /= 2.0
    return cast(Array, amplitude)


def _frame_speed(
    speed: ArrayLike | None, samples: int, starts: range, points: int
) -> tuple[Array | None, Array | None]:
    if speed is None:
        return None, None
    values = np.asarray(speed, dtype=np.float64)
    if values.shape != (samples,):
        raise RecordError(
            f"waterfall: speed has shape {values.shape}, expected one value per sample, ({samples},)"
        )
    cuts = [values[start : start + points] for start in starts]
    mean = np.array([np.mean(cut) for cut in cuts])
    change = np.array([np.ptp(cut) for cut in cuts])
    return mean, change


TAPS_PER_FACTOR = 40
BLOCK = 1024
"""Samples that remain of what is read at a time [1]: the signal may lie in a file, or be made while read."""
PASSED = 0.75
"""Share of the band up to half the new rate that is left [1]: white noise is white below it only."""
STOP_BAND = 100.0
"""Attenuation of what would fold back [dB]."""


def reduce_rate(
    displacement: PlanarSignal,
    sampling_rate: float,
    highest_frequency: float,
    *,
    samples_per_turn: float = 3.6,
) -> tuple[Array, float]:
    """Thin out a displacement to what its highest frequency of interest needs.

    Frequencies up to the highest keep their amplitude within 2e-5; what lies beyond half the new rate is gone
    (100 dB). The first sample keeps its time. A signal that cannot be thinned out is returned as it is.

    The displacement has shape (N, 2) [m], the thinned one (M, 2); the new rate comes with it. So many samples
    per period of the highest frequency remain [1].
    """
    factor = int(sampling_rate // (samples_per_turn * highest_frequency))
    if factor < 2:
        return np.asarray(displacement[0 : displacement.shape[0]], dtype=np.float64), sampling_rate
    beta = 0.1102 * (STOP_BAND - 8.7)
    half = TAPS_PER_FACTOR // 2
    taps = scipy.signal.firwin(2 * half * factor + 1, PASSED / factor, window=("kaiser", beta))
    samples = displacement.shape[0]
    thin = np.empty((-(-samples // factor), displacement.shape[1]))
    for first in range(0, len(thin), BLOCK):
        last = min(first + BLOCK, len(thin))
        read = _extended(displacement, (first - half) * factor, (last - 1 + half) * factor + 1)
        inside = slice(2 * half, 2 * half + last - first)
        thin[first:last] = scipy.signal.upfirdn(taps, read, 1, factor, axis=0)[inside]
    return thin, sampling_rate / factor


def _extended(displacement: PlanarSignal, first: int, last: int) -> Array:
    """Samples of a stretch; beyond the ends, the straight line through the first sample and the last one."""
    samples = displacement.shape[0]
    ends = [np.asarray(displacement[k : k + 1], dtype=np.float64) for k in (0, samples - 1)]
    slope = (ends[1] - ends[0]) / max(samples - 1, 1)
    before, after = np.arange(first, 0)[:, None], np.arange(1, last - samples + 1)[:, None]
    inside = np.asarray(displacement[max(first, 0) : min(last, samples)], dtype=np.float64)
    return np.concatenate([ends[0] + slope * before, inside, ends[1] + slope * after])


UPSAMPLING = 3
SPLINE_DEGREE = 5
"""Finer sampling, and degree of the spline through it, before the signal is read at equal angles (chosen)."""


@dataclass(frozen=True, kw_only=True)
class FramePower:
    """Power of each channel over a coordinate (frequency or order), frame by frame."""

    time: Array
    """Middle of each frame [s], shape (F,)."""
    coordinate: Array
    """Frequency [Hz] or order [1], shape (K,)."""
    power: Array
    """Square of the zero-to-peak amplitude [m²]; nan where a frame does not reach, shape (F, K, C)."""

    @property
    def spacing(self) -> float:
        """Distance of neighbouring coordinates."""
        return float(self.coordinate[1] - self.coordinate[0])


def frame_power(
    signal: NDArray[Any], sampling_rate: float, *, start_time: float, frame: float, highest: float
) -> FramePower:
    """Power over frequency in half-overlapping Hann frames.

    The signal (N, C) is the displacement of every channel [m]; or, complex, twice the displacement turned
    back by the phase of a path, whose power is found on both sides of the path. A frame [s] is drawn out to a
    number of samples that transforms fast; kept is what lies below the highest frequency, or nearer to the
    path [Hz].
    """
    turned = np.iscomplexobj(signal)
    half = next_fast_len(max(round(frame * sampling_rate / 2), 8), real=not turned)
    points = min(2 * half, len(signal) // 2 * 2)
    window = hann_window(points)
    starts = np.arange(0, len(signal) - points + 1, points // 2)
    frequency = (np.fft.fftfreq if turned else np.fft.rfftfreq)(points, 1.0 / sampling_rate)
    kept = np.flatnonzero(np.abs(frequency) <= highest)
    kept = kept[np.argsort(frequency[kept])]
    power = np.empty((starts.size, kept.size, signal.shape[1]))
    for channel in range(signal.shape[1]):
        frames = sliding_window_view(signal[:, channel], points)[:: points // 2]
        if turned:
            spectrum = fft(frames * window, overwrite_x=True)[:, kept]
        else:
            spectrum = rfft((frames - frames.mean(axis=1, keepdims=True)) * window, overwrite_x=True)[:, kept]
        power[:, :, channel] = np.abs(spectrum) ** 2
    power *= ((2.0 if turned else 4.0) / points) ** 2
    middle = start_time + (starts.astype(np.float64) + points / 2) / sampling_rate
    return FramePower(time=middle, coordinate=cast(Array, frequency[kept]), power=power)


def order_power(
    signal: Array,
    time: Array,
    angle: Array,
    speed: Array,
    *,
    turns: int,
    highest_order: float,
    highest_frequency: float,
    lowest_speed: float,
) -> FramePower | None:
    """Power over order in half-overlapping Hann frames of equal rotor angle; None if not one frame fits.

    The signal (N, C) is the displacement of every channel [m], with time [s], rotor angle [rad] and speed
    [rad/s] (N,) at every sample. Frequencies above the highest [Hz] are not in the signal any more; frames
    that reach below the lowest speed [rad/s] are left out.
    """
    angle = angle / math.tau
    slow = np.flatnonzero(speed < lowest_speed)
    end = float(angle[slow[0]] if slow.size else angle[-1])
    starts = np.arange(float(angle[0]), end - turns, turns / 2)
    if starts.size == 0:
        return None
    finer = scipy.signal.resample_poly(signal.T, UPSAMPLING, 1, axis=1, padtype="line")
    fine = spline_filter1d(finer, SPLINE_DEGREE)
    coordinate = np.arange(int(highest_order * turns) + 1) / turns
    power = np.full((starts.size, coordinate.size, signal.shape[1]), np.nan)
    middle, steps = np.empty(starts.size), np.arange(float(len(angle)))
    for row, start in enumerate(starts):
        first, last = np.searchsorted(angle, [start, start + turns])
        points = int(turns * max(math.ceil((last - first) / turns * 1.5), 4))
        turned = start + np.arange(points) * turns / points
        near = slice(max(first - 1, 0), last + 1)
        place = (near.start + np.interp(turned, angle[near], steps[: len(angle[near])])) * UPSAMPLING
        middle[row] = np.interp(start + turns / 2, angle[near], time[near])
        cut = np.stack([map_coordinates(one, [place], order=SPLINE_DEGREE, prefilter=False) for one in fine])
        spectrum = rfft((cut - cut.mean(axis=1, keepdims=True)) * hann_window(points)).T
        fastest = speed[min(first, len(time) - 1)] / math.tau
        reach = min(coordinate.size, len(spectrum), int(highest_frequency / fastest * turns) + 1)
        power[row, :reach] = np.abs(spectrum[:reach]) ** 2 * (4.0 / points) ** 2
    return FramePower(time=middle, coordinate=coordinate, power=power)


MEDIAN_OF_NOISE = math.log(2.0)
"""Median over mean of the power of noise in one frame [1]."""

HANN_OVERLAP_SHARE = 1.0 / 18.0
"""How much half-overlapping Hann frames repeat each other: averages counted as n / (1 + share)."""


LEAST_RATIO = 2.0
"""Amplitude over the local floor from which a peak counts as a line [1]."""
FALSE_ALARM = 1e-3
"""Accepted probability that noise alone shows any line in the whole search [1]."""
FLOOR_LINES = 81
"""Neighbouring lines whose median is the local floor [1]."""


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The clearest peak of a view."""

    coordinate: float
    """Frequency [Hz] or order [1], interpolated between lines."""
    channel: int
    """Channel in which it is clearest."""
    first: int
    last: int
    """Frames it was found in, last one excluded."""
    amplitude: float
    floor: float
    """Zero-to-peak amplitude and local floor [m]."""
    score: float
    """Minus the logarithm of the probability that noise alone shows it [1]."""
    width: float
    """Full width at half power of the peak [unit of the coordinate]."""

    @property
    def ratio(self) -> float:
        """Amplitude over the local floor [1]."""
        return self.amplitude / self.floor


def clearest_peak(
    frames: FramePower,
    allowed: Mask,
    stretches: Sequence[tuple[int, int]],
    usual: Array | None = None,
) -> Peak | None:
    """Find the peak that noise explains worst, over all channels and all given stretches of frames.

    ``allowed`` (F, K) says where a line may be looked for; a line must be seen in half the frames of a
    stretch, given by its first frame and the one after its last; ``usual`` (K, C) is power [m²] that is not
    to count as a line: the floor is nowhere lower. None where noise explains everything.
    """
    trials = max(int(np.sum(allowed.any(axis=0))), 1) * frames.power.shape[2] * max(len(stretches), 1)
    threshold = math.log(trials / FALSE_ALARM)
    floor = _floor(frames.power)
    if usual is not None:
        floor = np.maximum(floor, usual)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(allowed[:, :, None] & (floor > 0.0), frames.power / floor, np.nan)
    # Counts over the frames say at once which lines a stretch can hold: sorting all of them takes long.
    nearly = (1.0 - 1e-9) * LEAST_RATIO**2 / MEDIAN_OF_NOISE
    seen, above = (
        np.concatenate([np.zeros((1, *part.shape[1:]), dtype=np.intp), np.cumsum(part, axis=0)])
        for part in (np.isfinite(ratio), ratio >= nearly)
    )
    best: tuple[float, int, int, int, int] = (threshold, -1, -1, -1, -1)
    for first, last in stretches:
        known = seen[last] - seen[first]
        enough = known >= max(1, (last - first + 1) // 2)
        possible = enough & (2 * (above[last] - above[first]) >= known)
        if possible.any():
            around = possible.copy()
            around[1:] |= possible[:-1]
            around[:-1] |= possible[1:]
            looked = around & enough
            best = max(best, _best_in(ratio[first:last], looked, known, first, last))
    if best[1] < 0:
        return None
    return _peak(frames, ratio, *best)


def stretches_of(count: int, shortest: int) -> Iterator[tuple[int, int]]:
    """All frames, then half of them in overlapping steps, and so on down to the shortest stretch."""
    length = count
    while length >= max(shortest, 1):
        for first in range(0, count - length + 1, max(length // 2, 1)):
            yield first, first + length
        length = length // 2


def _best_in(
    ratio: Array, looked: Mask, known: NDArray[np.intp], first: int, last: int
) -> tuple[float, int, int, int, int]:
    """Score, line, channel and stretch of the clearest peak in one stretch, of the lines looked at.

    A line is as clear as half of its frames show it: what only passes through, or a bang, leaves that alone.
    """
    typical = np.full(ratio.shape[1:], np.nan)
    typical[looked] = median_of_known(ratio[:, looked])
    independent = np.maximum(known / (1.0 + HANN_OVERLAP_SHARE), 1.0)
    clear = (typical * MEDIAN_OF_NOISE >= LEAST_RATIO**2) & _local_maximum(typical)
    score = np.where(clear, _improbability(np.nan_to_num(typical), independent), 0.0)
    line, channel = np.unravel_index(int(np.argmax(score)), score.shape)
    return float(score[line, channel]), int(line), int(channel), first, last


def _peak(
    frames: FramePower,
    ratio: Array,
    score: float,
    line: int,
    channel: int,
    first: int,
    last: int,
) -> Peak:
    used = np.isfinite(ratio[first:last, line, channel])
    # the typical form of the peak: the median over the frames, zero where no frame reaches
    power = frames.power[first:last, :, channel][used]
    reached = np.isfinite(power).any(axis=0)
    shape = np.zeros(power.shape[1])
    shape[reached] = median_of_known(power[:, reached])
    shift, height = _between_lines(shape, line)
    # by the ratio that it was found with: power and floor are not at their medians in the same frames
    around = shape[line] / float(np.median(ratio[first:last, line, channel][used])) / MEDIAN_OF_NOISE
    return Peak(
        coordinate=float(frames.coordinate[line]) + shift * frames.spacing,
        channel=channel,
        first=first,
        last=last,
        amplitude=math.sqrt(height),
        floor=math.sqrt(around),
        score=score,
        width=half_power_width(shape, line) * frames.spacing,
    )


def _floor(power: Array) -> Array:
    """Median power of the lines around each line, frame by frame: half-overlapping blocks, joined by
    straight lines.
    """
    count = power.shape[1]
    half = max(min(FLOOR_LINES, count) // 2, 1)
    centres = np.arange(half, max(count - half, half + 1), half)
    blocks = np.empty((power.shape[0], centres.size, power.shape[2]))
    for k, centre in enumerate(centres):
        block = power[:, centre - half : centre + half + 1]
        reached = np.isfinite(block).sum(axis=1) > half
        blocks[:, k] = np.where(reached, median_of_known(np.moveaxis(block, 1, 0)), np.nan)
    place = np.clip((np.arange(count) - centres[0]) / half, 0.0, centres.size - 1.0)
    low = np.minimum(place.astype(int), max(centres.size - 2, 0))
    share = (place - low)[:, None]
    high = np.minimum(low + 1, centres.size - 1)
    left, right = blocks[:, low], blocks[:, high]
    joined = np.where(np.isnan(right), left, np.where(np.isnan(left), right, left + share * (right - left)))
    return cast(Array, np.where(np.isfinite(power), joined, np.nan))


def median_of_known(values: Array) -> Array:
    """Median along the first axis of what is not nan; nan where nothing is known."""
    ordered = np.sort(values, axis=0)
    known = np.isfinite(ordered).sum(axis=0, keepdims=True)
    low = np.take_along_axis(ordered, np.maximum(known - 1, 0) // 2, axis=0)
    high = np.take_along_axis(ordered, np.minimum(known // 2, len(values) - 1), axis=0)
    return cast(Array, 0.5 * (low + high)[0])


def _improbability(ratio: Array, frames: Array) -> Array:
    """Minus the logarithm of (Chernoff's bound of) the chance that noise exceeds its median so far in half
    the frames.

    Power of noise in one frame is exponentially distributed: it exceeds ``ratio`` medians with probability
    2^(−ratio), independently in each frame.
    """
    above = np.clip(ratio, 1.0, None)
    share = np.exp2(-np.minimum(above, 60.0))
    return 0.5 * frames * ((above - 2.0) * math.log(2.0) - np.log1p(-share))


def _local_maximum(values: Array) -> Mask:
    """Higher than both neighbours, which must be looked at too: the edge of what is left out is no line."""
    result = np.zeros(values.shape, dtype=np.bool_)
    with np.errstate(invalid="ignore"):
        result[1:-1] = (values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:])
    return result


def _between_lines(power: Array, line: int) -> tuple[float, float]:
    """Place of a peak between lines and its power there, by a parabola through the logarithms."""
    if not 0 < line < len(power) - 1:
        return 0.0, float(power[line])
    left, here, right = np.log(np.maximum(power[line - 1 : line + 2], 1e-300))
    if not np.isfinite(left + right):
        return 0.0, float(power[line])
    bend = left - 2.0 * here + right
    shift = 0.0 if bend >= 0.0 else float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5))
    return shift, float(np.exp(here - 0.25 * (left - right) * shift))


def half_power_width(power: Array, line: int) -> float:
    """Width of a peak at half its power, in lines."""
    half = 0.5 * power[line]
    left, right = line, line
    while left > 0 and power[left - 1] > half:
        left -= 1
    while right < len(power) - 1 and power[right + 1] > half:
        right += 1
    below = 0.0 if left == 0 else float((power[left] - half) / (power[left] - power[left - 1]))
    above = (
        0.0 if right == len(power) - 1 else float((power[right] - half) / (power[right] - power[right + 1]))
    )
    return right - left + below + above
