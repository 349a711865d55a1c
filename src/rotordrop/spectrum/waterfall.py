"""Overlapping frames of a displacement, their spectra, and fewer samples where low frequencies matter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import firwin, upfirdn

from rotordrop.arrays import Array
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
    taps = firwin(2 * half * factor + 1, PASSED / factor, window=("kaiser", beta))
    samples = displacement.shape[0]
    thin = np.empty((-(-samples // factor), displacement.shape[1]))
    for first in range(0, len(thin), BLOCK):
        last = min(first + BLOCK, len(thin))
        read = _extended(displacement, (first - half) * factor, (last - 1 + half) * factor + 1)
        thin[first:last] = upfirdn(taps, read, 1, factor, axis=0)[2 * half : 2 * half + last - first]
    return thin, sampling_rate / factor


def _extended(displacement: PlanarSignal, first: int, last: int) -> Array:
    """Samples of a stretch; beyond the ends, the straight line through the first sample and the last one."""
    samples = displacement.shape[0]
    ends = [np.asarray(displacement[k : k + 1], dtype=np.float64) for k in (0, samples - 1)]
    slope = (ends[1] - ends[0]) / max(samples - 1, 1)
    before, after = np.arange(first, 0)[:, None], np.arange(1, last - samples + 1)[:, None]
    inside = np.asarray(displacement[max(first, 0) : min(last, samples)], dtype=np.float64)
    return np.concatenate([ends[0] + slope * before, inside, ends[1] + slope * after])
