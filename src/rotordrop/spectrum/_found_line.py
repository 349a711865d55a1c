"""A line as the search finds it, before it has a name."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.spectrum.naming import LineKind
from rotordrop.spectrum.speed import FrequencyPath


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
