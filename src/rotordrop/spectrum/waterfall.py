"""Amplitude over frequency and time: the waterfall of a coast-down (Neisi 2020, section 5.4, Fig. 18)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotordrop.arrays import Array
from rotordrop.errors import RecordError, UsageError

Component = Literal["x", "y", "full"]
AmplitudeKind = Literal["zero-to-peak", "peak-to-peak"]

AMPLITUDE_SCALE: dict[str, float] = {"zero-to-peak": 1.0, "peak-to-peak": 2.0}


class PlanarSignal(Protocol):
    """Displacement (x, y) over time, shape (N, 2): an array in memory or one that still lies in a file."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Samples and directions, (N, 2)."""
        ...

    def __getitem__(self, key: slice, /) -> ArrayLike: ...


FEWEST_POINTS = 16
"""Samples of the shortest frame [1], without which no line is looked for (chosen)."""


@dataclass(frozen=True, kw_only=True)
class WaterfallSettings:
    """How the signal is cut into frames; the defaults are those of the paper."""

    points: int = 32768
    """Samples per frame [1]."""
    overlap: float = 0.5
    """Share of a frame that the next one uses again [1]."""
    remove_mean: bool = True
    """Subtract each frame's mean, which with a Hann window changes only the lines at 0 and ± one resolution.
    """

    def __post_init__(self) -> None:
        if self.points < FEWEST_POINTS:
            raise UsageError(
                f"waterfall: {self.points} points per frame given, at least {FEWEST_POINTS} are needed"
            )
        if not 0.0 <= self.overlap < 1.0:
            raise UsageError(f"waterfall: overlap {self.overlap} given, expected at least 0 and below 1")

    @property
    def hop(self) -> int:
        """Samples from the start of one frame to the start of the next [1]."""
        return max(1, round(self.points * (1.0 - self.overlap)))

    def resolution(self, sampling_rate: float) -> float:
        """Distance between two lines [Hz] at a sampling rate [Hz]."""
        return sampling_rate / self.points

    def frame_count(self, samples: int) -> int:
        """Whole frames [1] that fit into so many samples; nothing is padded."""
        return 0 if samples < self.points else (samples - self.points) // self.hop + 1


PAPER_SETTINGS = WaterfallSettings()

_FEWEST_FRAMES, _SHORTEST_FRAME = 12, 1024
"""A map with fewer frames shows bars and no change, one of shorter frames no lines [1] (chosen)."""


def settings_for(samples: int) -> WaterfallSettings:
    """Settings of the paper, with frames halved until a short signal has a dozen of them."""
    points = PAPER_SETTINGS.points
    while points > _SHORTEST_FRAME and WaterfallSettings(points=points).frame_count(samples) < _FEWEST_FRAMES:
        points //= 2
    return WaterfallSettings(points=points)


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
    settings: WaterfallSettings

    @property
    def resolution(self) -> float:
        """Distance between two lines [Hz]."""
        return self.settings.resolution(self.sampling_rate)

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
    settings: WaterfallSettings = PAPER_SETTINGS,
    amplitude_kind: AmplitudeKind = "zero-to-peak",
    start_time: float = 0.0,
    highest_frequency: float | None = None,
) -> tuple[Waterfall, ...]:
    """Cut a displacement into overlapping frames and give the amplitude of each frequency in each frame.

    A steady tone on a line reads its true amplitude; between two lines up to 15 % less (scalloping); a tone
    that moves within the frame less still (see `smear_factor`). Frames are read one at a time, so that a
    file larger than memory can be passed.

    The displacement (N, 2) [m] is that of one plane, with the rotor speed (N,) [rad/s] where it is known;
    each component, one direction or forward and backward parts of x + jy, has a waterfall of its own; lines
    above the highest frequency [Hz] are left out.

    Source: Neisi 2020, section 5.4 (Hann window, 32768 points, 50 % overlap, amplitude times 2).
    Differs from the paper: the full spectrum, and the choice of zero-to-peak or peak-to-peak.
    """
    samples = displacement.shape[0]
    frames = settings.frame_count(samples)
    if frames == 0:
        raise RecordError(
            f"waterfall: the signal has {samples} samples, one frame needs {settings.points}; "
            f"choose shorter frames or a longer record"
        )
    lines = [_lines(settings.points, sampling_rate, one, highest_frequency) for one in components]
    window = hann_window(settings.points)
    amplitudes = [np.empty((frames, frequency.size)) for frequency, _ in lines]
    for row in range(frames):
        start = row * settings.hop
        frame = np.asarray(displacement[start : start + settings.points], dtype=np.float64)
        if settings.remove_mean:
            frame = frame - frame.mean(axis=0)
        for one, (_, keep), amplitude in zip(components, lines, amplitudes, strict=True):
            amplitude[row] = _amplitude(frame, window, one)[keep] * AMPLITUDE_SCALE[amplitude_kind]
    centre = (np.arange(frames, dtype=np.float64) * settings.hop + settings.points / 2) / sampling_rate
    mean_speed, change = _frame_speed(speed, samples, frames, settings)
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
            settings=settings,
        )
        for component, (frequency, _), amplitude in zip(components, lines, amplitudes, strict=True)
    )


def smear_factor(rate: float, sampling_rate: float, settings: WaterfallSettings = PAPER_SETTINGS) -> float:
    """Share of its true amplitude that a sweeping tone shows in a frame, at its highest line [1].

    The rate is how fast the frequency of the tone changes [Hz/s], e.g. the order times the change of rotor
    speed per second.
    """
    points = 4096
    duration = settings.points / sampling_rate
    u = (np.arange(points) + 0.5) / points - 0.5
    weight = 1.0 + np.cos(2.0 * np.pi * u)
    span = abs(rate) * duration**2
    offsets = np.linspace(0.0, 0.5 * span, 201)
    phase = np.pi * span * u**2 - 2.0 * np.pi * offsets[:, None] * u
    return float(np.abs(np.mean(weight * np.exp(1j * phase), axis=1)).max())


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
    speed: ArrayLike | None, samples: int, frames: int, settings: WaterfallSettings
) -> tuple[Array | None, Array | None]:
    if speed is None:
        return None, None
    values = np.asarray(speed, dtype=np.float64)
    if values.shape != (samples,):
        raise RecordError(
            f"waterfall: speed has shape {values.shape}, expected one value per sample, ({samples},)"
        )
    cuts = [values[row * settings.hop :][: settings.points] for row in range(frames)]
    mean = np.array([np.mean(cut) for cut in cuts])
    change = np.array([np.ptp(cut) for cut in cuts])
    return mean, change
