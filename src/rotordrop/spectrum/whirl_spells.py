"""When a rotor whirls: stretches of an orbit that circle the bearing's centre, their sense and frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics.whirl import circling_spells

Array = NDArray[np.float64]

LEAST_TURNS = 2.0
"""Turns without turning back from which circling counts as whirl [1]."""
LEAST_RADIUS = 0.5
"""Share of the air gap outside of which a rotor may circle [1]; in flight through the middle it does not."""


@dataclass(frozen=True, kw_only=True)
class WhirlSpell:
    """One stretch of whirl.

    Attributes
    ----------
    start, end : float
        When it began and ended [s].
    frequency : float
        Mean whirl frequency [Hz]; positive with the spin (forward), negative against it (backward).
    """

    start: float
    end: float
    frequency: float

    @property
    def duration(self) -> float:
        """How long it lasted [s]."""
        return self.end - self.start


def whirl_spells(time: Array, orbit: Array, air_gap: float, *, spin: float = 1.0) -> tuple[WhirlSpell, ...]:
    """Find the stretches in which a rotor whirls round its touchdown bearing, in order.

    Parameters
    ----------
    time : ndarray, shape (T,)
        [s], rising.
    orbit : ndarray, shape (T, 2)
        Displacement (x, y) from the centre of the bearing [m].
    air_gap : float
        Air gap of the bearing [m].
    spin : float
        Rotor speed, of which the sign counts: positive from x to y.

    Notes
    -----
    Source: own definition, see `rotordrop.physics.whirl.circling_spells`: at least two turns in one sense
    outside of half the air gap. A pendulum motion at the bottom swings back and is none.
    """
    x, y = (np.ascontiguousarray(orbit[:, axis], dtype=np.float64) for axis in range(2))
    found = np.empty((0, 3))
    while (count := circling_spells(x, y, LEAST_RADIUS * air_gap, LEAST_TURNS, found)) > len(found):
        found = np.empty((count, 3))
    sense = math.copysign(1.0, spin)
    spells = []
    for first, last, _ in found:
        whole = slice(int(first), int(last) + 1)
        spells.append(_steady(time[whole], np.unwrap(np.arctan2(y[whole], x[whole])), sense))
    return tuple(spells)


def _steady(time: Array, angle: Array, sense: float) -> WhirlSpell:
    """Stretch without its run-in: half a turn at either end may be a slow swing, which would blur both
    frequency and limits; so the frequency is taken between, and the limits follow from it.
    """
    advance = np.abs(angle - angle[0])
    begin = int(np.argmax(advance >= math.pi))
    finish = len(advance) - 1 - int(np.argmax(advance[-1] - advance[::-1] >= math.pi))
    rate = (angle[finish] - angle[begin]) / (time[finish] - time[begin])
    half = math.pi / abs(rate)
    return WhirlSpell(
        start=max(float(time[0]), float(time[begin]) - half),
        end=min(float(time[-1]), float(time[finish]) + half),
        frequency=float(sense * rate / (2.0 * math.pi)),
    )
