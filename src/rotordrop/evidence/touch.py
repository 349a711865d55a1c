"""The first touch of a race: the kink with which the motion leaves the free fall, no machine known.

With a machine file, `rotordrop.evidence.contacts` has the forces behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.units import GRAVITY

_NEAREST, _FARTHEST = 0.75, 1.08
"""The race is touched between these shares of the way from floating to rest [1] (chosen)."""

_SURELY = (0.86, 1.12)
"""Shares of that way at which the kink of a hard contact is taken for a touch [1] (chosen)."""

_SOFT = 3e-3
"""A rotor that goes deeper for longer than this has a soft contact [s] (chosen)."""

_LATEST = 8e-3
"""How long after `_NEAREST` a touch is looked for [s]."""


@dataclass(frozen=True, kw_only=True)
class _Windows:
    """Lengths [s] of the free fall before a kink and of the contact after it that are fitted."""

    before: float
    after: float
    power: int
    """Power of time with which the contact moves the rotor away from its fall."""
    earliest: float
    latest: float
    """How far from the sample that stands out the kink is searched [s]."""
    ringing: float
    """A kink stands this much above the ringing of the falling rotor [1]."""
    least: float
    """Least acceleration at a kink over gravity [1]."""
    error: float
    """Standard error of the kink [s] (set with all of DropBench in view)."""


_HARD_KINK = _Windows(
    before=2e-3,
    after=0.35e-3,
    power=2,
    earliest=-0.7e-3,
    latest=0.2e-3,
    ringing=2.5,
    least=0.8,
    error=0.15e-3,
)
_SOFT_KINK = _Windows(
    before=2e-3, after=1.2e-3, power=3, earliest=-1.5e-3, latest=0.8e-3, ringing=1.5, least=0.4, error=0.35e-3
)


@dataclass(frozen=True, kw_only=True)
class Touch:
    """When the shaft first touches its race in one plane."""

    sample: float
    """When, in samples of the record."""
    error: float
    """Standard error [s]."""
    by_kink: bool
    """Whether a kink of the velocity shows it; else it is where the path crosses the air gap."""
    soft: bool
    """Whether the rotor goes on for longer than 3 ms."""

    def at(self, values: Array) -> Array:
        """Values (N, K) at the touch."""
        return np.array([self.when(column) for column in values.T])

    def when(self, values: Array) -> float:
        """One value of a series (N,) at the touch, such as the time."""
        return float(np.interp(self.sample, np.arange(len(values)), values))


def first_touch(
    place: Array, floated: Array, rate: float, begin: int, size: float, noise: float
) -> Touch | None:
    """Find the kink with which the fall ends; None where ringing hides it.

    Parameters
    ----------
    place : array, shape (N, 2)
        Readings of a plane [m].
    floated : array, shape (2,)
        Where the rotor floated [m].
    rate : float
        Samples per second [Hz].
    begin : int
        Last sample that surely floats.
    size : float
        Way from floating to rest [m].
    noise : float
        Noise of the readings [m].

    Notes
    -----
    A free fall is a cubic in time over some milliseconds. A contact adds to it a part that begins at the kink
    and points inwards; the first one that stands above noise and ringing is the touch, and the best fit of
    both parts dates it.
    """
    way = np.hypot(*(place - floated).T)
    near = _first_beyond(way, begin, _NEAREST * size)
    closest = _first_beyond(way, begin, 0.9 * size)
    if near is None or closest is None:
        return None
    soft = _turns(way, closest, rate) - closest > _SOFT * rate
    windows = _SOFT_KINK if soft else _HARD_KINK
    far = _first_beyond(way, begin, _FARTHEST * size) or len(way) - 1
    last = min(far, near + int(_LATEST * rate))
    last = near + int(np.argmax(way[near : last + 1]))
    released = near - int(math.sqrt(2.0 * _NEAREST * size / GRAVITY) * rate)
    samples, inward, unit = _departures(
        place, floated, rate, windows, (max(released, 0), max(last, near + 2))
    )
    after = max(round(windows.after * rate), 3)
    falling = (samples + after < near) & (samples - windows.before * rate > released - 0.5e-3 * rate)
    ringing = float(np.percentile(inward[falling], 95)) if np.count_nonzero(falling) > 10 else 0.0
    limit = max(5.0 * noise, windows.ringing * ringing, windows.least * GRAVITY * unit)
    strong = np.flatnonzero((samples >= near) & (inward > limit))
    if not len(strong):
        return None
    best = strong[0] + int(np.argmax(inward[strong[0] : strong[0] + int(windows.after * rate) + 1]))
    kink = _dated(place, int(samples[best]), rate, windows)
    share = float(np.interp(kink, np.arange(len(way)), way)) / size
    if not (_NEAREST if soft else _SURELY[0]) < share < _SURELY[1]:
        return None
    return Touch(sample=kink, error=math.hypot(windows.error, 0.3 / rate), by_kink=True, soft=soft)


def crossing(radius: Array, begin: int, rate: float, gap: float, error: float) -> Touch | None:
    """First touch where a path crosses the air gap, whose standard error is given [m]."""
    at = _first_beyond(radius, begin, gap)
    if at is None or at < 2:
        return None
    back = max(at - max(int(1e-3 * rate), 1), 0)
    speed = max(float(radius[at] - radius[back]) * rate / (at - back), 1e-3)
    below, above = float(radius[at - 1]), float(radius[at])
    sample = at - (above - gap) / max(above - below, 1e-12) if above > below else float(at)
    return Touch(sample=sample, error=math.hypot(_HARD_KINK.error, error / speed), by_kink=False, soft=False)


def _first_beyond(values: Array, begin: int, limit: float) -> int | None:
    beyond = np.flatnonzero(values[begin:] > limit)
    return begin + int(beyond[0]) if len(beyond) else None


def _turns(way: Array, since: int, rate: float) -> int:
    """Sample at which the rotor stops going deeper, ringing smoothed away."""
    width = max(int(0.5e-3 * rate), 1)
    ahead = way[since : since + int(30e-3 * rate)]
    if len(ahead) <= width + 1:
        return since
    smooth = np.convolve(ahead, np.ones(width) / width, mode="valid")
    back = np.flatnonzero(np.diff(smooth) < 0.0)
    return since + (int(back[0]) if len(back) else 0) + width // 2


def _departures(
    place: Array, floated: Array, rate: float, windows: _Windows, span: tuple[int, int]
) -> tuple[NDArray[np.int64], Array, float]:
    """How far each sample's contact would move the rotor inwards, and what 1 m/s² would.

    Samples (K,), amplitudes along a unit vector [m], shape (K,), and that of an acceleration of 1 m/s² [m].
    """
    before, after = round(windows.before * rate), max(round(windows.after * rate), 3)
    index = np.arange(-before, after + 1)
    time = index / (after * 1.0)
    cubic = np.linalg.qr(np.vander(time, 4, increasing=True))[0]
    pushed = np.maximum(index / rate, 0.0) ** 2 / 2.0
    pushed = pushed - cubic @ (cubic.T @ pushed)
    unit = float(np.linalg.norm(pushed))
    samples = np.arange(max(span[0], before), min(span[1], len(place) - after - 1) + 1)
    moved = np.array([np.correlate(column, pushed / unit, mode="valid") for column in place.T]).T[
        samples - before
    ]
    out = place[samples] - floated
    return samples, -np.sum(moved * out, axis=1) / np.maximum(np.hypot(*out.T), 1e-12), unit


def _dated(place: Array, near: int, rate: float, windows: _Windows) -> float:
    """The kink [samples] that fits best: cubic before, and a power of time more after it."""
    index = np.arange(
        max(near - round(windows.before * rate), 0),
        min(near + max(round(windows.after * rate), 4), len(place) - 1) + 1,
    )
    time = (index - near) / rate * 1e3
    cubic = np.linalg.qr(np.vander(time, 4))[0]
    readings = place[index] - place[near]
    rest = readings - cubic @ (cubic.T @ readings)
    tried = np.arange(windows.earliest * 1e3, windows.latest * 1e3, 0.02)
    pushed = np.maximum(time - tried[:, None], 0.0) ** windows.power
    pushed -= (pushed @ cubic) @ cubic.T
    size = np.sum(pushed**2, axis=1)
    explained = np.sum((pushed @ rest) ** 2, axis=1) / np.maximum(size, 1e-12)
    return near + float(tried[int(np.argmax(explained))]) * 1e-3 * rate
