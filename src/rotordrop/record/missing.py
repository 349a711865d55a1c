"""Readings that are none: codes for no value, lost samples, a clock that was set. An even record is left.

A few that are missing lie on the straight line between their neighbours, for whoever looks at the motion; the
filter does without them. Where more is missing, the record is that part which holds the drop, if the rotor
moves in no other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.record.recording import Channel, listed
from rotordrop.series import runs_of
from rotordrop.units import format_quantity

FAR, NEVER = 1e6, 1e30
"""Readings beyond so many times what nine of ten stay below are none, and beyond so many in any unit [1]."""

CODES = {-9999.0, 9999.0, -999.0, 999.0, -99999.0, 99999.0, -32768.0, 32767.0, -(2.0**31), 2.0**31 - 1.0}
ASIDE = 3.0
"""Numbers that stand for no value where they lie so many ranges of the other readings beside these [1]."""

SHORT, FEW = 0.5e-3, 0.01
"""Longest gap [s], half of a contact, and largest share of the readings that are bridged [1] (chosen)."""

WHOLE, MOST_LOST = 0.2, 2**20
"""Share of a step by which an interval may differ from a multiple of it, and samples that are lost [1]
(chosen)."""

FEWEST_PAIRS, ZIGZAG = 20, 0.5
"""Pairs of readings, and share of them that must go back, by which peak detection shows [1] (chosen)."""

MOST_SET, QUIET, SLOWEST = 3, 0.5, 2000.0
"""Times that a clock is set back in a record, share of its range that a channel reaches in the part of the
drop only [1], and rate to which a record of two rates may be thinned [Hz] (chosen)."""


def no_values(values: Array) -> NDArray[np.bool_]:
    """Which readings (N,) are no values: not finite, or a code."""
    bad = ~np.isfinite(values)
    if bad.all():
        return bad
    size = np.abs(np.where(bad, 0.0, values))
    bad |= size > NEVER
    size[bad] = 0.0
    bad |= size > FAR * (float(np.quantile(size, 0.9)) or float(np.max(size)))
    for code in CODES.intersection((float(np.min(values[~bad])), float(np.max(values[~bad])))):
        rest = values[~bad & (values != code)]
        if len(rest) and np.min(np.abs(rest - code)) > ASIDE * max(float(np.ptp(rest)), 1e-3 * abs(code)):
            bad |= values == code
    return bad


def without_pairs(channels: Sequence[Channel]) -> tuple[list[Channel], list[str]]:
    """Middles where every interval has its least and its greatest reading, as peak detection writes them."""
    half = len(channels[0].values) // 2
    if half < FEWEST_PAIRS or any(len(one.values) != len(channels[0].values) for one in channels):
        return list(channels), []
    first, second = ([one.values[k : 2 * half : 2] for one in channels] for k in (0, 1))
    times = channels[0].time[: 2 * half].reshape(half, 2)
    for low, high in ((first, second), (second, first)):
        if any(np.any(a > b) for a, b in zip(low, high, strict=True)):
            continue
        back = [np.mean(b[:-1] > a[1:]) > ZIGZAG for a, b in zip(low, high, strict=True)]
        if np.all(back if times[0, 0] < times[0, 1] else times[:, 0] == times[:, 1]):
            middles = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
            pairs = zip(channels, middles, strict=True)
            words = "the readings are pairs, the least and the greatest of an interval (peak detection)"
            words += f": their middles are read, {half} samples; export plain samples"
            return [replace(one, values=v, time=times.mean(axis=1)) for one, v in pairs], [words]
    return list(channels), []


def mended(
    time: Array, signals: Array, names: Sequence[str]
) -> tuple[Array, Array, NDArray[np.bool_], list[str]]:
    """Bring times [s] (N,) and readings (N, S), NaN where there is none, to an even record.

    Gives both with the readings that nobody made, (N, S), which are bridged or NaN, and words on it.
    """
    words: list[str] = []
    usual, as_read = float(np.median(np.diff(time))), (time, signals)
    if len(time) > 2 and usual > 0.0 and np.any(np.abs(np.diff(time) - usual) > WHOLE * usual):
        time, signals, words = _at_one_rate(time, signals, np.diff(time), usual)
        as_read = time, signals
        time, signals = _with_lost(time, signals)
    missing = ~np.isfinite(signals)
    most = int(SHORT / usual + 1e-6) if usual > 0.0 else 0
    most = max(most, 1) if len(time) == len(as_read[0]) else most  # one lost row of a slow clock shows in it
    lacking = np.zeros(len(time), dtype=np.bool_)
    for start, length in (run for column in missing.T for run in zip(*runs_of(column), strict=True)):
        if length < len(time) and (length > most or start == 0 or start + length == len(time)):
            lacking[start : start + length] = True
    part, said = _part_of_drop(time, signals, lacking) if lacking.any() else (slice(None), [])
    many = len(time) > len(as_read[0]) and part == slice(None) and np.mean(missing.all(axis=1)) > FEW
    if part is None or many:  # the gate says what is missing where
        time, signals, part = *as_read, slice(None)
    time, signals, words = time[part], signals[part], words + said
    missing, told = ~np.isfinite(signals), []
    signals = signals.copy() if missing.any() else signals
    for c in np.flatnonzero(missing.any(axis=0)).tolist():
        known = ~missing[:, c]
        if float(np.mean(~known)) <= FEW and max(runs_of(~known)[1]) <= most:
            signals[~known, c] = np.interp(time[~known], time[known], signals[known, c])
            told.append(c)
    if told:
        rows = np.flatnonzero(missing[:, told].any(axis=1))
        what = f"{len(rows)} of {len(time)} samples of {listed(names[c] for c in told)} are missing"
        done = "bridged for whoever looks at the motion, left out by the filter"
        words.append(f"{what}, the first at {time[rows[0]]:.6g} s: {done}")
    return time, signals, missing, words


def gone_on(channels: Sequence[Channel]) -> tuple[tuple[Channel, ...], list[str]]:
    """Channels on clocks that go on where theirs were set back, the speed with the others; words on it."""
    clocks: dict[tuple[Any, ...], list[Channel]] = {}
    for channel in channels:
        steps = np.diff(channel.time)
        back = np.flatnonzero(steps < -0.5 * abs(float(np.median(steps)))) if len(steps) else steps
        if 0 < len(back) <= MOST_SET:
            clocks.setdefault((len(steps), float(channel.time[0]), *back.tolist()), []).append(channel)
    times, words = dict[int, Array](), list[str]()
    for together in clocks.values():
        signals = np.column_stack([channel.values for channel in together])
        time, said = _set_back(together[0].time, signals)
        times.update((id(channel), time) for channel in together)
        words += said
    return tuple(replace(one, time=times.get(id(one), one.time)) for one in channels), words


def _set_back(time: Array, signals: Array) -> tuple[Array, list[str]]:
    """Times of a clock that was set back while the samples went on; rows that were copied stay."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    back = np.flatnonzero(steps < -0.5 * usual)
    copied = any(np.any(np.all(signals[: k + 1] == signals[k + 1], axis=1)) for k in back)
    if not usual > 0.0 or copied:
        return time, []
    odd, jump = np.flatnonzero(np.abs(steps - usual) > WHOLE * usual), np.zeros(len(time))
    for k in back:  # a stamp that is wrong by itself goes back and forth
        beside = [
            j
            for j in (*odd[odd < k][-1:], *odd[odd > k][:1])
            if abs(steps[j] + steps[k] - 2 * usual) < WHOLE * usual
        ]
        jump[[k + 1, *(j + 1 for j in beside[:1])]] = usual - steps[[k, *beside[:1]]]
    return time + np.cumsum(jump), [
        f"the clock steps back by {format_quantity(-float(steps[k]), 'time')} after {time[k]:.6g} s; the "
        "samples are taken to go on evenly"
        for k in back
    ]


def _at_one_rate(time: Array, signals: Array, steps: Array, usual: float) -> tuple[Array, Array, list[str]]:
    """Samples of the slower of two rates, where a recorder went from one to the other."""
    slow = float(np.quantile(steps, 1.0 - FEW))
    other = np.abs(steps / slow - 1.0) < WHOLE
    if (
        slow < 1.5 * usual
        or slow * SLOWEST > 1.0
        or np.mean(other | (np.abs(steps / usual - 1.0) < WHOLE)) < 0.99
    ):
        return time, signals, []
    first = int(np.argmax(other))
    place = (time - time[first]) / slow
    on = np.abs(place - np.rint(place)) < 0.1 * usual / slow
    words = f"sampled at {1.0 / usual:.6g} Hz and, from {time[first]:.6g} s on, at {1.0 / slow:.6g} Hz"
    return time[on], signals[on], [f"{words}; all is read at {1.0 / slow:.6g} Hz"]


def _with_lost(time: Array, signals: Array) -> tuple[Array, Array]:
    """Rows of NaN where samples are lost under a clock that goes on."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not step > 0.0 or not np.any(np.diff(time) > 1.5 * step):
        return time, signals
    place = (time - time[0]) / step
    rows = np.rint(place).astype(np.int64)
    drift = np.abs(np.diff(place) - np.diff(rows))
    if np.any(np.diff(rows) < 1) or np.any(drift > WHOLE) or rows[-1] > len(time) + MOST_LOST:
        return time, signals
    whole = np.full((int(rows[-1]) + 1, signals.shape[1]), np.nan)
    whole[rows] = signals
    return np.interp(np.arange(len(whole)), rows, time), whole


def _part_of_drop(time: Array, signals: Array, lacking: NDArray[np.bool_]) -> tuple[slice | None, list[str]]:
    """The part without a longer gap in which the rotor drops; None where it moves in others too."""
    parts = [slice(a, a + n) for a, n in zip(*runs_of(~lacking), strict=True) if n > 2]
    live = signals[:, np.isfinite(signals).any(axis=0)]
    whole = np.maximum(np.nanmax(live, axis=0) - np.nanmin(live, axis=0), 1e-300)

    def moved(part: slice) -> float:
        """Largest share of its range that a channel reaches in a part."""
        known = [(one[np.isfinite(one)], most) for one, most in zip(live[part].T, whole, strict=True)]
        return max((float(np.ptp(one)) / most for one, most in known if len(one)), default=0.0)

    gaps = [(time[a], n) for a, n in zip(*runs_of(lacking), strict=True) if 0 < a < len(time) - n]
    words = ", ".join(f"{n} samples are missing from {at:.6g} s on" for at, n in gaps[:5])
    best = max(parts, key=moved)
    beside = slice(0, best.start), slice(best.stop, None)
    if moved(best) < QUIET or any(moved(part) >= QUIET for part in beside):
        return None, []
    kept = f"read from {time[best.start]:.6g} s to {time[best.stop - 1]:.6g} s"
    return best, [f"{words + '; ' if words else ''}{kept}: the rotor hardly moves in the rest"]
