"""Two views of a coast-down: power over frequency, where steady lines stand still, and power over order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.fft import fft, rfft
from scipy.ndimage import map_coordinates, spline_filter1d
from scipy.signal import resample_poly

from rotordrop.spectrum.speed_profile import SpeedProfile
from rotordrop.spectrum.waterfall import hann_window

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
UPSAMPLING = 3
SPLINE_DEGREE = 5


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


def frequency_power(
    signal: Array, sampling_rate: float, *, start_time: float, frame: float, highest: float
) -> FramePower:
    """Power over frequency in half-overlapping Hann frames.

    Parameters
    ----------
    signal : shape (N, C)
        Displacement of every channel [m].
    sampling_rate : float
        [Hz].
    start_time : float
        Time of the first sample [s].
    frame : float
        Length of a frame [s].
    highest : float
        Highest frequency kept [Hz].
    """
    points = min(2 * max(round(frame * sampling_rate / 2), 8), len(signal) // 2 * 2)
    window = hann_window(points)
    starts = np.arange(0, len(signal) - points + 1, points // 2)
    frequency = np.fft.rfftfreq(points, 1.0 / sampling_rate)
    kept = frequency <= highest
    power = np.empty((starts.size, int(kept.sum()), signal.shape[1]))
    for channel in range(signal.shape[1]):
        frames = _frames(signal[:, channel], points)
        spectrum = rfft((frames - frames.mean(axis=1, keepdims=True)) * window, overwrite_x=True)[:, kept]
        power[:, :, channel] = np.abs(spectrum) ** 2 * (4.0 / points) ** 2
    middle = start_time + (starts.astype(np.float64) + points / 2) / sampling_rate
    return FramePower(
        time=middle,
        coordinate=cast(Array, frequency[kept]),
        power=power,
    )


def offset_power(
    turned: NDArray[np.complex128], sampling_rate: float, *, start_time: float, frame: float, reach: float
) -> FramePower:
    """Power over the distance from a moving path, in half-overlapping Hann frames.

    Parameters
    ----------
    turned : shape (N, C)
        Twice the displacement [m], turned back by the phase of the path.
    sampling_rate : float
        [Hz].
    start_time : float
        Time of the first sample [s].
    frame : float
        Length of a frame [s].
    reach : float
        Largest distance kept [Hz].
    """
    points = min(2 * max(round(frame * sampling_rate / 2), 8), len(turned) // 2 * 2)
    window = hann_window(points)
    starts = np.arange(0, len(turned) - points + 1, points // 2)
    offset = np.fft.fftfreq(points, 1.0 / sampling_rate)
    kept = np.flatnonzero(np.abs(offset) <= reach)
    kept = kept[np.argsort(offset[kept])]
    power = np.empty((starts.size, kept.size, turned.shape[1]))
    for channel in range(turned.shape[1]):
        spectrum = fft(_frames(turned[:, channel], points) * window, overwrite_x=True)[:, kept]
        power[:, :, channel] = np.abs(spectrum) ** 2
    middle = start_time + (starts.astype(np.float64) + points / 2) / sampling_rate
    return FramePower(
        time=middle,
        coordinate=cast(Array, offset[kept]),
        power=power * (2.0 / points) ** 2,
    )


def _frames(series: NDArray[Any], points: int) -> NDArray[Any]:
    """Half-overlapping frames of a series, shape (F, points), without a copy."""
    return sliding_window_view(series, points)[:: points // 2]


def order_power(
    signal: Array,
    sampling_rate: float,
    profile: SpeedProfile,
    *,
    start_time: float,
    turns: int,
    highest_order: float,
    highest_frequency: float,
    lowest_speed: float,
) -> FramePower | None:
    """Power over order in half-overlapping Hann frames of equal rotor angle; None if not one frame fits.

    Parameters
    ----------
    signal : shape (N, C)
        Displacement of every channel [m].
    sampling_rate : float
        [Hz].
    profile : SpeedProfile
        Rotor speed.
    start_time : float
        Time of the first sample [s].
    turns : int
        Turns of the rotor in a frame [1].
    highest_order : float
        [1].
    highest_frequency : float
        Frequencies above it are not in the signal any more [Hz].
    lowest_speed : float
        Frames that reach below it [rad/s] are left out.
    """
    time = start_time + np.arange(len(signal)) / sampling_rate
    angle = profile.angle_at(time) / TURN
    slow = np.flatnonzero(profile.speed_at(time) < lowest_speed)
    end = float(angle[slow[0]] if slow.size else angle[-1])
    starts = np.arange(float(angle[0]), end - turns, turns / 2)
    if starts.size == 0:
        return None
    fine = spline_filter1d(resample_poly(signal, UPSAMPLING, 1, padtype="line"), SPLINE_DEGREE, axis=0)
    coordinate = np.arange(int(highest_order * turns) + 1) / turns
    power = np.full((starts.size, coordinate.size, signal.shape[1]), np.nan)
    middle = np.empty(starts.size)
    for row, start in enumerate(starts):
        first, last = np.searchsorted(angle, [start, start + turns])
        points = int(turns * max(math.ceil((last - first) / turns * 1.5), 4))
        place = np.interp(start + np.arange(points) * turns / points, angle, np.arange(len(angle)))
        middle[row] = np.interp(start + turns / 2, angle, time)
        cut = np.column_stack(
            [
                map_coordinates(fine[:, c], [place * UPSAMPLING], order=SPLINE_DEGREE, prefilter=False)
                for c in range(signal.shape[1])
            ]
        )
        spectrum = np.fft.rfft((cut - cut.mean(axis=0)) * hann_window(points)[:, None], axis=0)
        fastest = profile.speed_at(time[min(first, len(time) - 1)]) / TURN
        reach = min(coordinate.size, len(spectrum), int(highest_frequency / fastest * turns) + 1)
        power[row, :reach] = np.abs(spectrum[:reach]) ** 2 * (4.0 / points) ** 2
    return FramePower(time=middle, coordinate=coordinate, power=power)
