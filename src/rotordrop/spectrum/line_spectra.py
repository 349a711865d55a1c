"""Two views of a coast-down: power over frequency, where steady lines stand still, and power over order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.fft import fft, next_fast_len, rfft
from scipy.ndimage import map_coordinates, spline_filter1d
from scipy.signal import resample_poly

from rotordrop.arrays import Array
from rotordrop.spectrum.waterfall import hann_window

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
    fine = spline_filter1d(resample_poly(signal.T, UPSAMPLING, 1, axis=1, padtype="line"), SPLINE_DEGREE)
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
