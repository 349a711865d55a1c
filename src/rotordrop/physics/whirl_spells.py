"""When a rotor whirls: stretches of an orbit that circle the bearing's centre, their sense and frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.series import runs_of

LEAST_TURNS = 2.0
"""Turns without turning back from which circling counts as whirl [1]."""
TURN_BACK = 0.5 * math.pi
"""Angle by which a whirl that has ended runs back [rad]."""
LEAST_RADIUS = 0.5
"""Share of the air gap outside of which a rotor may circle [1]; in flight through the middle it does not."""
FOLLOWED_TURNS = 4.0
"""Turns over which a frequency that changes is taken, or all of a shorter whirl [1] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class WhirlSpell:
    """One stretch of whirl."""

    start: float
    end: float
    """When it began and ended [s]."""
    frequency: float
    """Mean whirl frequency [Hz]; positive with the spin (forward), negative against it (backward)."""
    fastest: float
    last: float
    """Frequencies of the fastest and the last `FOLLOWED_TURNS`, with that sign [Hz]."""

    @property
    def turns(self) -> float:
        """Turns, with the sign of the frequency [1]."""
        return self.frequency * self.duration

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
        Rotor speed [rad/s], of which the sign counts: positive from x to y.

    Notes
    -----
    Source: own definition: at least two turns in one sense outside of half the air gap; going back by less
    than a quarter turn (a bounce) does not end a stretch, coming nearer to the centre does, because there the
    angle says nothing. A pendulum motion at the bottom swings back and is none. Told without compiled code,
    which a first look at a record must not wait for.
    """
    outside = np.hypot(orbit[:, 0], orbit[:, 1]) >= LEAST_RADIUS * air_gap
    sense = math.copysign(1.0, spin)
    spells = []
    for begin, length in zip(*runs_of(outside), strict=True):
        end = begin + length
        angle = np.unwrap(np.arctan2(orbit[begin:end, 1], orbit[begin:end, 0]))
        if np.ptp(angle) < 2.0 * math.pi * LEAST_TURNS:
            continue  # most drops swing at the bottom: they need no search for turning points
        for first, last in _one_way(angle):
            if abs(angle[last] - angle[first]) >= 2.0 * math.pi * LEAST_TURNS:
                part = slice(first, last + 1)
                spells.append(_steady(time[begin:end][part], angle[part], sense))
    return tuple(spells)


def _one_way(angle: Array) -> list[tuple[int, int]]:
    """Stretches between the turning points from which the angle runs back by a quarter turn."""
    values = angle.tolist()
    stretches: list[tuple[int, int]] = []
    start = high = low = 0
    sense = 0
    for i, value in enumerate(values):
        high = i if value > values[high] else high
        low = i if value < values[low] else low
        if sense >= 0 and values[high] - value > TURN_BACK:
            stretches.append((start, high))
            start, sense, low = high, -1, i
            high = i
        elif sense <= 0 and value - values[low] > TURN_BACK:
            stretches.append((start, low))
            start, sense, high = low, 1, i
            low = i
    stretches.append((start, high if sense > 0 else low if sense < 0 else len(values) - 1))
    return [(a, b) for a, b in stretches if b > a]


def _steady(time: Array, angle: Array, sense: float) -> WhirlSpell:
    """Stretch without its run-in: half a turn at either end may be a slow swing, which would blur both
    frequency and limits; so the frequency is taken between, and the limits follow from it.
    """
    advance = np.abs(angle - angle[0])
    begin = int(np.argmax(advance >= math.pi))
    finish = len(advance) - 1 - int(np.argmax(advance[-1] - advance[::-1] >= math.pi))
    rate = (angle[finish] - angle[begin]) / (time[finish] - time[begin])
    half = math.pi / abs(rate)
    angle, clock = angle[begin : finish + 1], time[begin : finish + 1]
    grown = np.maximum.accumulate(np.abs(angle - angle[0]))
    since = np.arange(max(int(np.searchsorted(grown, grown[-1] - 2.0 * math.pi * FOLLOWED_TURNS)), 1))
    until = np.minimum(np.searchsorted(grown, grown[since] + 2.0 * math.pi * FOLLOWED_TURNS), len(grown) - 1)
    rates = sense * (angle[until] - angle[since]) / (clock[until] - clock[since]) / (2.0 * math.pi)
    return WhirlSpell(
        start=max(float(time[0]), float(time[begin]) - half),
        end=min(float(time[-1]), float(time[finish]) + half),
        frequency=float(sense * rate / (2.0 * math.pi)),
        fastest=float(rates[np.argmax(np.abs(rates))]),
        last=float(rates[-1]),
    )
