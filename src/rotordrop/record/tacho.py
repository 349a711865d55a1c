"""Pulses of a tacho or keyphasor: when a mark of the shaft passed, and the speed between the passages."""

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

NEIGHBOURS = 5
"""Turns on either side that an interval is compared with [1]; no rotor changes its speed much in them."""

MISSED = 1.5
"""Interval over the usual one from which a pulse is missing between [1]; its reciprocal for one too many."""

MOST_FAULTY = 0.1
"""Share of faulty intervals above which the channel carries no pulses of this shaft [1] (chosen)."""

FINENESS = 2e-3
"""Share of a speed that the sampling of its two passages may leave open [1]; turns are joined for it."""

SEVERAL = 5
"""Samples a turn must have, for its pulses to be told apart [1] (chosen)."""


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
        raise RecordError(
            f"{place} has {len(crossings)} pulses; a speed needs those of two turns or more ({per_turn} per "
            "turn): check the channel, and pulses_per_turn in the profile"
        )
    step = float(np.median(np.diff(time)))
    turn = float(np.median(crossings[per_turn:] - crossings[:-per_turn]))
    if turn < SEVERAL * per_turn * step:
        raise RecordError(
            f"{place}: a turn takes {turn / step:.1f} samples, too few for {per_turn} pulses; sample faster "
            "or use a mark with fewer pulses"
        )
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
        raise RecordError(
            f"{place}: {faulty} of {len(intervals)} intervals between pulses do not fit their neighbours "
            f"(first at {crossings[int(min([*missing, *spare]))]:.4g} s); check the trigger of the tacho, "
            "and pulses_per_turn in the profile"
        )
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
