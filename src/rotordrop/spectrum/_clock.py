"""Time, speed and rotor angle of the signal that is searched for lines, and the ways to look at it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array, Mask
from rotordrop.spectrum.line_extraction import Envelope, Near, extract, near_path
from rotordrop.spectrum.line_settings import LineSettings
from rotordrop.spectrum.line_spectra import FramePower, frame_power, order_power
from rotordrop.spectrum.speed_profile import SpeedProfile

BESIDE = 25.0
"""Band [Hz] on either side of a moving path whose power is its floor."""


@dataclass(frozen=True, kw_only=True)
class View:
    """One way to look at a signal: over frequency, or over order."""

    frames: FramePower
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
        settings: LineSettings,
        highest_frequency: float,
    ) -> None:
        self.settings = settings
        self.highest_frequency = highest_frequency
        self.signal_rate = sampling_rate
        self.start = start_time
        self.signal_time: Array = start_time + np.arange(samples, dtype=np.float64) / sampling_rate
        self.signal_angle = None if profile is None else profile.angle_at(self.signal_time)
        self._signal_speed = np.zeros(samples) if profile is None else profile.speed_at(self.signal_time)
        self.factor = max(int(sampling_rate // max(5.2 * BESIDE, 50.0 * settings.bandwidth)), 1)
        self.rate = sampling_rate / self.factor
        self.time: Array = self.signal_time[:: self.factor].copy()
        self.angle = None if self.signal_angle is None else self.signal_angle[:: self.factor].copy()
        self.speed: Array = self._signal_speed[:: self.factor] / math.tau
        self.frame = min(settings.frame, samples / sampling_rate / 3.0)

    def at(self, time: Array, values: Array) -> Array:
        """Values [any] at the times of lines, at other times."""
        return np.interp(time, self.time, values)

    def rate_of(self, phase: Array) -> Array:
        """Frequency [Hz] of a phase [rad] at the times of lines."""
        return cast(Array, np.gradient(phase) * self.rate / math.tau)

    def reachable(self, phase: Array) -> Mask:
        """Where a phase [rad] runs at a frequency that is looked at."""
        frequency = np.abs(self.rate_of(phase))
        return (frequency >= self.settings.lowest_frequency) & (frequency <= self.highest_frequency)

    def near(self, signal: Array, path: Array) -> Near:
        """What a signal [m] holds near a path, whose phase [rad] is known at every sample of the signal."""
        return near_path(signal, path, self.factor)

    def extract(self, near: Near, turn: Array | float = 0.0) -> Envelope:
        """The part that follows a path and a further phase [rad]."""
        further = np.broadcast_to(turn, self.time.shape)
        return extract(near, self.rate, further, bandwidth=self.settings.bandwidth)

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
        return View(frames=frames, of_orders=False, length=np.full(len(frames.time), length), share=share)

    def order_view(self, signal: Array, share: float) -> View | None:
        """Power over order, in frames of equal rotor angle; None without speed or whole frame."""
        if self.signal_angle is None:
            return None
        turns = 2 * round(0.5 * self.settings.turns * (share if share == 1.0 else 2.0 * share))
        slowest = max(self.settings.lowest_frequency / self.settings.highest_order, 0.5)
        frames = order_power(
            signal,
            self.signal_time,
            self.signal_angle,
            self._signal_speed,
            turns=turns,
            highest_order=self.settings.highest_order,
            highest_frequency=self.highest_frequency,
            lowest_speed=math.tau * slowest,
        )
        if frames is None:
            return None
        lengths = turns / np.maximum(self.at(frames.time, self.speed), 0.1)
        return View(frames=frames, of_orders=True, length=lengths, share=share)
