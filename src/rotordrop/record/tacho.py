"""Signals of a tacho: when a mark of the shaft passed and the speed between, or when a speed was read."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError

Edge: TypeAlias = Literal["rising", "falling"]

LOW, HIGH = 0.35, 0.65
"""Shares of the swing between which the signal must pass for one pulse [1]; ripple below a third is none."""

NEIGHBOURS, MISSED = 5, 1.5
"""Turns on either side that an interval is compared with, and how many times the usual one shows that a pulse
is missing [1]; its reciprocal shows one too many."""

MOST_FAULTY = 0.1
"""Share of faulty intervals above which the channel carries no pulses of this shaft [1] (chosen)."""

FINENESS, SEVERAL = 2e-3, 5
"""Share of a speed that the sampling of its passages may leave open; samples that a turn must have [1]."""


@dataclass(frozen=True, kw_only=True)
class Passages:
    """What a channel of pulses says."""

    marks: Array
    """When the mark passed [s]: the rotor angle there is a whole number of turns. Empty where a turn has
    several pulses, which are not told apart, shape (M,)."""
    time: Array
    speed: Array
    """Middle of as many turns as are looked at together [s], and mean speed over them [rad/s], shape (K,)."""
    warnings: tuple[str, ...]
    """Pulses that are missing or too many, with times."""


def passages(
    time: Array, values: Array, *, per_turn: int = 1, edge: Edge = "rising", place: str = "the tacho channel"
) -> Passages:
    """Read the passages of a mark and the speed from samples (N,) of a channel of pulses, called `place`.

    Speed is taken over whole turns, so that marks at uneven distances do not show, and over several where one
    is sampled too coarsely.
    """
    crossings = _crossings(time, values if edge == "rising" else -values)
    if len(crossings) < 2 * per_turn + 1:
        words = f"pulses; a speed needs those of two turns or more ({per_turn} per turn)"
        ask = "check the channel, and pulses_per_turn in the profile"
        raise RecordError(f"{place} has {len(crossings)} {words}: {ask}")
    step = float(np.median(np.diff(time)))
    turn = float(np.median(crossings[per_turn:] - crossings[:-per_turn]))
    if turn < SEVERAL * per_turn * step:
        words = f"a turn takes {turn / step:.1f} samples, too few for {per_turn} pulses"
        raise RecordError(f"{place}: {words}; sample faster or use a mark with fewer pulses")
    crossings, warnings = _sorted_out(crossings, per_turn, place)
    turns = crossings[::per_turn]
    together = min(max(1, math.ceil(step / (FINENESS * turn))), len(turns) - 1)
    bounds = turns[::together]
    whole = np.isfinite(bounds[1:]) & np.isfinite(bounds[:-1])
    begins, ends = bounds[:-1][whole], bounds[1:][whole]
    marks = turns[np.isfinite(turns)] if per_turn == 1 else np.empty(0)
    speed = 2.0 * np.pi * together / (ends - begins)
    return Passages(marks=marks, time=0.5 * (begins + ends), speed=speed, warnings=warnings)


def _crossings(time: Array, values: Array) -> Array:
    """When the signal rises through the middle, having been low before and high after."""
    low, high = float(np.min(values)), float(np.max(values))
    if not high > low:
        return np.empty(0)
    share = (values - low) / (high - low)
    state = np.where(share > HIGH, 1, np.where(share < LOW, -1, 0))
    known = np.flatnonzero(state)
    rises = np.flatnonzero((state[known][:-1] == -1) & (state[known][1:] == 1))
    found = []
    for first, last in zip(known[rises], known[rises + 1], strict=True):
        k = first + int(np.flatnonzero(share[first : last + 1] >= 0.5)[0])
        part = (0.5 - share[k - 1]) / (share[k] - share[k - 1])
        found.append(time[k - 1] + part * (time[k] - time[k - 1]))
    return np.array(found)


def _sorted_out(crossings: Array, per_turn: int, place: str) -> tuple[Array, tuple[str, ...]]:
    """Passages with a NaN for each missing pulse and none too many, and words on both."""
    from scipy.ndimage import median_filter

    intervals = np.diff(crossings)
    # median of the intervals around each; beyond the ends the first and the last count on
    usual = np.asarray(median_filter(intervals, size=2 * NEIGHBOURS * per_turn + 1, mode="nearest"))
    missing = np.flatnonzero(intervals > MISSED * usual)
    # one pulse too many splits an interval in two
    short = intervals < usual / MISSED
    spare = {k + 1 for k in range(len(intervals) - 1) if short[k] and short[k + 1]}
    faulty = len(missing) + len(spare)
    if faulty > MOST_FAULTY * len(intervals):
        first = f"first at {crossings[int(min([*missing, *spare]))]:.4g} s"
        words = f"{faulty} of {len(intervals)} intervals between pulses do not fit their neighbours ({first})"
        raise RecordError(f"{place}: {words}; check the trigger, and pulses_per_turn in the profile")
    rows: list[float] = []
    for k, when in enumerate(crossings.tolist()):
        if k in spare:
            continue
        rows.append(when)
        if k in missing:
            rows += [np.nan] * (round(float(intervals[k] / usual[k])) - 1)
    warnings = []
    for places, what in ((missing.tolist(), "missing after"), (sorted(spare), "too many at")):
        if places:
            told = ", ".join(f"{crossings[k]:.4g} s" for k in places[:5])
            warnings.append(f"{place}: {len(places)} pulses {what} {told}; their turns give no speed")
    return np.array(rows), tuple(warnings)


def readings_of_held_signal(time: Array, values: Array) -> tuple[Array, Array]:
    """When a signal that holds each reading took a new one [s] and which, (K,); others as they are."""
    changes = np.flatnonzero(np.diff(values)) + 1
    if len(changes) < 3 or len(changes) > 0.5 * len(values):
        return time, values
    # a reading equal to the one before leaves no step: longer intervals are missed steps
    interval = int(np.percentile(np.diff(changes), 25, method="lower"))
    first = changes[0] - interval * (1 + (changes[0] - 1) // interval)
    at = [max(int(first), 0)]
    for change in changes:
        missed = round((change - at[-1]) / interval) - 1
        at += [int(change) - interval * k for k in range(missed, 0, -1)] if len(at) > 1 else []
        at.append(int(change))
    at += list(range(at[-1] + interval, len(values), interval))
    index = np.array(sorted(set(at)))
    return time[index], values[index]
