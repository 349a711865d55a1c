"""The first touch of a race: where the motion leaves the free fall, no machine known.

With a machine file, `rotordrop.evidence.contacts` has the forces behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.impacts import slope
from rotordrop.units import GRAVITY, fall_time

_NEAREST, _FARTHEST = 0.75, 1.08
"""The race is touched between these shares of the way from floating to rest [1] (chosen)."""

_SURELY, _FIRST_SOFT = (0.86, 1.12), 0.6
"""Shares of that way at which the kink of a hard contact is taken for a touch, and the least of a soft one
[1] (chosen): it rests deep in its race."""

_SOFT = 1.2e-3
"""A contact whose deceleration grows for longer than this is soft [s] (set with DropBench in view)."""

_FLANK, _DELAY = (0.2, 0.6), 0.26e-3
"""Shares of the largest deceleration between which its growth is taken as straight [1], and how much earlier
than the touch that line leaves the fall, by the windows of the velocities [s] (set with DropBench in
view)."""

_SUDDEN, _SUDDEN_WITHIN = 0.9, 1e-3
"""What a deceleration that sets in at once leaves over of the motion up to so long after the touch [s], over
what one that grows leaves, below which a contact is hard however long its deceleration seems to grow [1]: a
light rotor rings on its race (soft contacts of 500 kg and 1.6 t leave 0.94 and more, those of 5 kg that ring
0.74 and less)."""

_RELEASE = 1e-3
"""Time after the release from which the deceleration counts as that of the fall [s] (chosen)."""

_FLANK_ERROR = 0.1
"""Standard error of a soft touch over the time in which its deceleration grows [1] (the same)."""

_LATEST = 8e-3
"""How long after `_NEAREST` a touch is looked for [s]."""

_BEFORE, _AFTER = 2e-3, 0.35e-3
"""Lengths of the free fall before the kink of a hard contact and of the contact after it that are fitted
[s]."""

_SEARCHED = (-0.7e-3, 0.2e-3)
"""How far from the sample that stands out the kink is searched [s]."""

_RINGING, _LEAST = 2.5, 0.8
"""How much a kink stands above the ringing of the falling rotor [1], and its least acceleration over gravity
[1]."""

_SOFT_RINGING, _SOFT_LEAST = 4.0, 1.5
"""The same of the deceleration of a soft contact, over the root mean square of the ringing."""

_KINK_ERROR = 0.15e-3
"""Standard error of the kink of a hard contact [s] (set with all of DropBench in view)."""


@dataclass(frozen=True, kw_only=True)
class Touch:
    """When the shaft first touches its race in one plane."""

    sample: float
    """When, in samples of the record."""
    error: float
    """Standard error [s]."""
    by_kink: bool
    """Whether the motion shows it, by a kink or by where its deceleration begins; else it is where the path
    crosses the air gap."""

    def at(self, values: Array) -> Array:
        """Values (N, K) at the touch."""
        return np.array([self.when(column) for column in values.T])

    def when(self, values: Array) -> float:
        """One value of a series (N,) at the touch, such as the time."""
        first = min(int(self.sample), len(values) - 2)
        return float(np.interp(self.sample, (first, first + 1), values[first : first + 2]))


def first_touch(
    place: Array, floated: Array, rate: float, begin: int, size: float, noise: float
) -> Touch | None:
    """Find where the fall ends; None where ringing hides it.

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
    A free fall is a cubic in time over some milliseconds. A hard contact adds to it a part that begins at the
    kink and points inwards; the first one that stands above noise and ringing is the touch, and the best fit
    of both parts dates it. A soft contact has no kink: its deceleration grows along a line, which is followed
    back to the fall.
    """
    way = np.hypot(*(place - floated).T)
    near = _first_beyond(way, begin, _NEAREST * size)
    if near is None:
        return None
    released = max(near - int(fall_time(_NEAREST * size) * rate), 0)
    soft, flank = None, _flank(way, rate, (released, near))
    if flank is not None and flank[1] > _SOFT * rate:
        begins, lasts = flank
        share = float(np.interp(begins, np.arange(len(way)), way)) / size
        if _FIRST_SOFT < share < _SURELY[1]:
            soft = Touch(sample=begins, error=_FLANK_ERROR * lasts / rate, by_kink=True)
            # whether a jump of the deceleration explains the motion better than its growth from a touch on
            jump, growth = (
                _dated(place, round(begins), rate, after=_SUDDEN_WITHIN, searched=(-0.8e-3, 0.6e-3), power=k)
                for k in (2, 3)
            )
            if not jump[1] < _SUDDEN * growth[1]:
                return soft
    far = _first_beyond(way, begin, _FARTHEST * size) or len(way) - 1
    last = min(far, near + int(_LATEST * rate))
    last = near + int(np.argmax(way[near : last + 1]))
    samples, inward, unit = _departures(place, floated, rate, (released, max(last, near + 2)))
    after = max(round(_AFTER * rate), 3)
    falling = (samples + after < near) & (samples - _BEFORE * rate > released - 0.5e-3 * rate)
    ringing = float(np.percentile(inward[falling], 95)) if np.count_nonzero(falling) > 10 else 0.0
    limit = max(5.0 * noise, _RINGING * ringing, _LEAST * GRAVITY * unit)
    strong = np.flatnonzero((samples >= near) & (inward > limit))
    if not len(strong):
        return soft
    best = strong[0] + int(np.argmax(inward[strong[0] : strong[0] + int(_AFTER * rate) + 1]))
    kink = _dated(place, int(samples[best]), rate)[0]
    share = float(np.interp(kink, np.arange(len(way)), way)) / size
    if not _SURELY[0] < share < _SURELY[1]:
        return soft
    return Touch(sample=kink, error=math.hypot(_KINK_ERROR, 0.3 / rate), by_kink=True)


def _flank(way: Array, rate: float, fall: tuple[int, int]) -> tuple[float, float] | None:
    """When the deceleration of the first contact begins to grow, and for how long it does [samples].

    ``fall`` are the samples of the release and of the way from which a contact is looked for.
    """
    first = max(fall[0] - int(_BEFORE * rate), 0)
    outward = slope(slope(way[first : fall[1] + int(2.0 * _LATEST * rate)], rate), rate)
    released, near = fall[0] - first + int(_RELEASE * rate), fall[1] - first
    if near - released < 4:
        return None
    usual, ringing = float(np.median(outward[released:near])), float(np.std(outward[released:near]))
    deep = outward[near : near + int(_LATEST * rate)] < usual - max(
        _SOFT_LEAST * GRAVITY, _SOFT_RINGING * ringing
    )
    if not deep.any():
        return None
    most = near + int(np.argmax(deep))
    while most + 1 < len(outward) and outward[most + 1] <= outward[most]:
        most += 1
    early, late = (
        most - int(np.argmax(outward[most::-1] >= usual - share * (usual - outward[most])))
        for share in _FLANK
    )
    low, high = _FLANK
    begins = early - (late - early) * low / (high - low)
    return first + begins + _DELAY * rate, most - begins


def crossing(radius: Array, begin: int, rate: float, gap: float, error: float) -> Touch | None:
    """First touch where a path crosses the air gap, whose standard error is given [m]."""
    at = _first_beyond(radius, begin, gap)
    if at is None or at < 2:
        return None
    back = max(at - max(int(1e-3 * rate), 1), 0)
    speed = max(float(radius[at] - radius[back]) * rate / (at - back), 1e-3)
    below, above = float(radius[at - 1]), float(radius[at])
    sample = at - (above - gap) / max(above - below, 1e-12) if above > below else float(at)
    return Touch(sample=sample, error=math.hypot(_KINK_ERROR, error / speed), by_kink=False)


def _first_beyond(values: Array, begin: int, limit: float) -> int | None:
    beyond = np.flatnonzero(values[begin:] > limit)
    return begin + int(beyond[0]) if len(beyond) else None


def _departures(
    place: Array, floated: Array, rate: float, span: tuple[int, int]
) -> tuple[NDArray[np.int64], Array, float]:
    """How far each sample's contact would move the rotor inwards, and what 1 m/s² would.

    Samples (K,), amplitudes along a unit vector [m], shape (K,), and that of an acceleration of 1 m/s² [m].
    """
    before, after = round(_BEFORE * rate), max(round(_AFTER * rate), 3)
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


def _dated(
    place: Array,
    near: int,
    rate: float,
    *,
    after: float = _AFTER,
    searched: tuple[float, float] = _SEARCHED,
    power: int = 2,
) -> tuple[float, float]:
    """The kink [samples] that fits best, a cubic before and a power of the time more after it; what is left.

    A parabola is a deceleration that jumps, a cubic one that grows; what is left is a sum of squares [m²].
    """
    index = np.arange(
        max(near - round(_BEFORE * rate), 0),
        min(near + max(round(after * rate), 4), len(place) - 1) + 1,
    )
    time = (index - near) / rate * 1e3
    cubic = np.linalg.qr(np.vander(time, 4))[0]
    readings = place[index] - place[near]
    rest = readings - cubic @ (cubic.T @ readings)
    tried = np.arange(searched[0] * 1e3, searched[1] * 1e3, 0.02)
    pushed = np.maximum(time - tried[:, None], 0.0) ** power
    pushed -= (pushed @ cubic) @ cubic.T
    size = np.sum(pushed**2, axis=1)
    explained = np.sum((pushed @ rest) ** 2, axis=1) / np.maximum(size, 1e-12)
    best = int(np.argmax(explained))
    return near + float(tried[best]) * 1e-3 * rate, float(np.sum(rest**2) - explained[best])
