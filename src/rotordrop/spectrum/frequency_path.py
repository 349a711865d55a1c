"""The frequency of a line as it wanders over time, e.g. that of a pendulum whose swing dies down."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array


@dataclass(frozen=True, kw_only=True)
class FrequencyPath:
    """Frequency over time."""

    time: Array
    """[s], rising, shape (K,)."""
    frequency: Array
    """[Hz], shape (K,)."""

    def frequency_at(self, time: ArrayLike) -> Array:
        """Frequency [Hz] at times [s]; that of the nearest end beyond the path."""
        return np.interp(np.asarray(time, dtype=np.float64), self.time, self.frequency)

    def phase_over(self, time: Array) -> Array:
        """Phase [rad] over rising times [s], counted from the first of them."""
        frequency = self.frequency_at(time)
        steps = 0.5 * (frequency[1:] + frequency[:-1]) * np.diff(time)
        return 2.0 * math.pi * np.concatenate([[0.0], np.cumsum(steps)])


def steady_path(frequency: float) -> FrequencyPath:
    """Path of a line that does not wander, at a frequency [Hz]."""
    return FrequencyPath(time=np.array([0.0]), frequency=np.array([frequency]))
