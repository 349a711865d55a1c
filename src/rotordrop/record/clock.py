"""One clock for the channels of a record: thinned to the slowest, evenly spaced where the file means it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.recording import Channel
from rotordrop.units import format_quantity

MOST_DECIMALS = 9
"""Decimals of time stamps up to which a rounding is looked for [1]: of a nanosecond (chosen)."""

LONG_PART = 20
"""Part of a record over which its usual step is taken [1]: a gap spoils few of such spans, and what one stamp
was rounded by is spread over many steps (chosen)."""

ROUNDING_SLACK = 0.05
"""How far a stamp may be off beyond half its resolution, for the fit of the even clock [1] (chosen)."""

SAME_CLOCK = 1e-3
"""Share of a step by which two clocks may differ and be one [1] (chosen)."""

EVEN = 0.02
"""Share of a step by which written times may differ from even ones [1] (chosen): rounded stamps."""


def at_one_rate(channels: Sequence[Channel]) -> tuple[list[Channel], list[str]]:
    """Take every k-th sample of channels sampled k times as fast as the slowest, whose clock they share.

    Nothing is filtered or interpolated: what is kept was read. Channels whose clocks do not meet are left for
    `shared_clock` to refuse.
    """
    steps = [_step(channel.time) for channel in channels]
    slowest = max(steps)
    slow = channels[steps.index(slowest)].time
    kept, notes = [], []
    for channel, step in zip(channels, steps, strict=True):
        times = round(slowest / step) if step > 0.0 else 1
        thin = channel.time[::times][: len(slow)]
        off = float(np.max(np.abs(thin - slow), initial=0.0)) if len(thin) == len(slow) else np.inf
        if times < 2 or off > SAME_CLOCK * slowest:
            kept.append(channel)
            continue
        kept.append(replace(channel, time=thin, values=channel.values[::times][: len(slow)]))
        notes.append(
            f"{channel.label} is sampled {times} times as fast as the slowest sensor; every {times}th sample "
            "is used"
        )
    return kept, notes


def shared_clock(channels: Sequence[Channel], place: str) -> tuple[Array, float, list[str]]:
    """The clock of all channels [s], shape (N,), its rate [Hz], and a note where stamps were rounded.

    Raises
    ------
    RecordError
        When the channels were not sampled together.
    """
    first = channels[0]
    for other in channels[1:]:
        if len(other.time) != len(first.time):
            raise RecordError(
                f"{place}: {first.label!r} has {len(first.time)} samples and {other.label!r} "
                f"{len(other.time)}; the channels must be sampled together, export them at one rate and "
                "length"
            )
        shift = float(np.max(np.abs(other.time - first.time), initial=0.0))
        if shift > SAME_CLOCK * _step(first.time):
            raise RecordError(
                f"{place}: the clocks of {first.label!r} and {other.label!r} differ by "
                f"{format_quantity(shift, 'time')}; the channels must be sampled together"
            )
    if len(first.time) < 2:
        raise RecordError(f"{place}: {len(first.time)} samples are no recording")
    stands = np.flatnonzero(np.diff(first.time) == 0.0)
    # rows that stand twice in a file have one stamp and the same readings; rounded stamps have others
    copied = any(all(one.values[k] == one.values[k + 1] for one in channels) for k in stands)
    time, rate = _even(first.time, copied=copied)
    rounded = np.any(np.diff(first.time) == 0.0) and np.all(np.diff(time) > 0.0)
    return time, rate, ["time stamps are rounded; an even clock was put behind them"] if rounded else []


def _step(time: Array) -> float:
    """Usual step [s]: the slope of the times, which single roundings and gaps do not move."""
    if len(time) < 2:
        return 1.0
    span = max(1, len(time) // LONG_PART)
    return float(np.median(time[span:] - time[:-span])) / span


def _even(time: Array, *, copied: bool) -> tuple[Array, float]:
    """Replace times that are even but for rounding in the file by exactly even ones; the rate [Hz]."""
    count = len(time) - 1
    step = (time[-1] - time[0]) / count
    even = time[0] + step * np.arange(count + 1)
    if step > 0 and float(np.max(np.abs(time - even))) <= EVEN * step:
        # nine digits of a rate are what a file can mean; more would be the rounding of its stamps
        rate = float(f"{1.0 / step:.9g}")
        return time[0] + np.arange(count + 1) / rate, rate
    rounded = None if copied else _rounded_clock(time)
    if rounded is not None:
        return rounded
    usual = _step(time)
    return time.copy(), 1.0 / usual if usual > 0 else float("nan")


def _rounded_clock(time: Array) -> tuple[Array, float] | None:
    """The even clock behind stamps that were rounded to decimals; None where there is none.

    Such stamps are multiples of one resolution, and none is further from the even clock than half of it. Rows
    that are there twice, or missing, drift away from it.
    """
    steps = np.diff(time)
    if np.any(steps < 0.0) or not np.any(steps > 0.0):
        return None
    # the largest step of which all distances of the stamps are multiples
    for decimals in range(MOST_DECIMALS + 1):
        counts = np.rint((time - time[0]) * 10.0**decimals)
        if np.max(np.abs(time - time[0] - counts * 10.0**-decimals)) < 1e-3 * 10.0**-decimals:
            break
    else:
        return None
    resolution = float(np.gcd.reduce(counts.astype(np.int64))) * 10.0**-decimals
    if resolution == 0.0:
        return None
    count = np.rint((time - time[0]) / resolution)
    index = np.arange(len(time), dtype=np.float64)
    slope, start = np.polyfit(index, count, 1)
    if np.max(np.abs(count - start - slope * index)) > 0.5 + ROUNDING_SLACK:
        return None
    if not np.any(steps == 0.0) and slope < 2.0:
        return None  # one row that is missing looks like the rounding of a clock that is a trifle slow
    # within one step over the whole record: the step is the resolution
    if abs(slope - 1.0) * len(time) < 1.0:
        slope = 1.0
        start = float(np.mean(count - index))
    rate = float(f"{1.0 / (slope * resolution):.9g}")
    return time[0] + start * resolution + index / rate, rate
