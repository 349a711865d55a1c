"""Clocks: stamps to seconds, the clocks of several channels to one, an even clock behind rounded stamps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.recording import MARKS, Channel, Recording
from rotordrop.units import format_quantity

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86_400.0}
"""Seconds in each unit of a time column."""

LONGEST_CLOCK = 86_400.0
"""Stamps beyond a day [s] are a date: times count from the first of them."""

_COUNTS = ((1e18, 1e-9), (1e17, 1e-7), (1e14, 1e-6), (1e11, 1e-3))
"""Size from which stamps without a unit count in a step [s]: since 1970 in ns, since 1601 in 100 ns, since
1970 in µs and in ms."""

_DAYS = (2e4, 1e-6)
"""Days since 1900 or the year 0 are more than this, and step by less than any sampling interval in s."""

LONG_PART = 20
"""Part of a record over which its usual step is taken [1]: a gap spoils few of such spans, and what one stamp
was rounded by is spread over many steps (chosen)."""

SAME_CLOCK, EVEN = 1e-3, 0.02
"""Share of a step by which two clocks may differ and be one, and rounded stamps from even ones [1]."""

ROUNDING_SLACK, DOUBT = 0.05, 3.0
"""How far a stamp may be off the even clock beyond half its resolution [1]; error of the slope of rounded
stamps over that of independent ones [1] (chosen)."""

MOST_DECIMALS, MOST_DIGITS, MOST_SIZES, FEWEST_STAMPS = 9, 5, 5, 10
"""Decimals, digits and different steps of stamps up to which a rounding is looked for, and different stamps
that show an even clock [1] (chosen)."""


def in_seconds(clocks: Sequence[Sequence[str] | NDArray[Any]], units: Sequence[str]) -> list[Array]:
    """Times of all clocks of a file [s], each of shape (N,), of stamps in one of `TIME_UNITS` each.

    Stamps are numbers, dates of numpy, or numbers as text with a decimal point; a unit that is empty follows
    from their size. Where they count from a date, times count from the first stamp of the first clock, and
    differences are taken before digits are lost; floating-point seconds have lost theirs, and stay.
    """
    times: list[Array] = []
    origin, per_count = None, 1.0
    for stamps, unit in zip(clocks, units, strict=True):
        exact: Any = stamps
        if not isinstance(stamps, np.ndarray):
            exact = np.array([Decimal(stamp or "NaN") for stamp in stamps])
        elif stamps.dtype.kind in "Mm":
            exact, unit = stamps.astype(f"{stamps.dtype.kind}8[ns]").astype(np.int64), "ns"
        elif stamps.dtype.kind == "u":
            exact = stamps.astype(np.int64)
        factor = TIME_UNITS[unit] if unit else _factor(exact)
        dated = len(exact) > 0 and abs(float(exact[0])) * factor > LONGEST_CLOCK
        if dated and (factor != 1.0 or exact.dtype.kind in "iO"):
            origin, per_count = (exact[0], factor) if origin is None else (origin, per_count)
            exact = exact - origin if factor == per_count else exact
        times.append(exact.astype(np.float64) * factor)
    return times


def _factor(stamps: NDArray[Any]) -> float:
    """Seconds per count of stamps without a unit."""
    first, last = (float(stamps[0]), float(stamps[-1])) if len(stamps) else (0.0, 0.0)
    if abs(first) > _DAYS[0] and 0.0 < abs(last - first) < _DAYS[1] * len(stamps):
        return TIME_UNITS["d"]
    return next((factor for least, factor in _COUNTS if abs(first) > least), 1.0)


def with_times(recording: Recording, place: str) -> Recording:
    """The recording without samples whose time is no number; RecordError where a channel has no others."""
    channels, untimed = [], 0
    for one in recording.channels:
        known = np.isfinite(one.time)
        if len(known) and not known.any():
            remedy = 'say the step in a profile, [time] step = "50 us"'
            raise RecordError(
                f"{place}: none of the {len(known)} times of {one.label!r} is a number; {remedy}"
            )
        untimed = max(untimed, int(np.sum(~known)))
        channels.append(one if known.all() else replace(one, time=one.time[known], values=one.values[known]))
    words = (f"left out, without a time: {untimed} of the samples",) if untimed else ()
    return replace(recording, channels=tuple(channels), warnings=(*recording.warnings, *words))


def from_first_stamp(recording: Recording) -> Recording:
    """The recording, its times from the first stamp where they count from a date."""
    origin = next((float(one.time[0]) for one in recording.channels if len(one.time)), 0.0)
    if not abs(origin) > LONGEST_CLOCK:
        return recording
    dated = 5e8 < origin < 5e9
    date = datetime.fromtimestamp(origin, UTC).isoformat(" ", "seconds") if dated else f"{origin:.9g} s"
    channels = tuple(
        replace(one, time=one.time - origin, values=one.values - (origin if one.name == MARKS else 0.0))
        for one in recording.channels
    )
    note = f"times count from the first stamp, {date}"
    return replace(recording, channels=channels, notes=(*recording.notes, note))


def on_one_clock(channels: Sequence[Channel], place: str) -> tuple[list[Channel], list[str]]:
    """Channels on the clock of the slowest, over the time that all of them cover, and notes.

    What meets that clock is kept as it was read; between samples a cubic through the four nearest is read
    off. Rates that are no multiples of each other are refused, and channels that begin together and do not
    end together.
    """
    steps = [_step(channel.time) for channel in channels]
    step = max(steps)
    slow = next(one for one, own in zip(channels, steps, strict=True) if own >= step - SAME_CLOCK * abs(step))
    if all(c.time.shape == slow.time.shape and _near(c.time, slow.time, step) for c in channels):
        return list(channels), []
    begin, end = max(c.time[0] for c in channels), min(c.time[-1] for c in channels)
    time = slow.time[(slow.time > begin - SAME_CLOCK * step) & (slow.time < end + SAME_CLOCK * step)]
    spread = begin - min(c.time[0] for c in channels)
    notes, kept = [], []
    for channel, own in zip(channels, steps, strict=True):
        times = step / own if own > 0.0 else 0.0
        together = abs(channel.time[0] - slow.time[0]) < 0.5 * step
        other = ""
        if abs(times - round(times)) > SAME_CLOCK * times or not own > 0.0:
            other = f"{_rate(step)} and {channel.label!r} {_rate(own)}"
        elif together and abs(channel.time[-1] - slow.time[-1]) > 1.5 * step:
            other = f"{len(slow.time)} samples and {channel.label!r} {len(channel.time)}"
        elif len(time) < 0.5 * len(slow.time):
            other = f"{len(time)} of {len(slow.time)} samples in the time of {channel.label!r}"
        if other:
            words = "the channels must be sampled together, export them at one rate and length"
            raise RecordError(f"{place}: {slow.label!r} has {other}; {words}")
        values, between = _read_off(channel, time)
        kept.append(replace(channel, time=time, values=values))
        if between:
            notes.append(f"{channel.label} was sampled between samples of {slow.label}: cubics through them")
        elif (fast := round(times)) > 1:
            words = f"is sampled {fast} times as fast as the slowest sensor; every {fast}th sample is used"
            notes.append(f"{channel.label} {words}")
    if spread > SAME_CLOCK * step:
        words = f"the clocks of the channels begin up to {format_quantity(spread, 'time')} apart"
        notes.append(f"{words}; each is read by its own, from {time[0]:.6g} s to {time[-1]:.6g} s")
    return kept, notes


def _near(one: Array, other: Array, step: float) -> bool:
    return not np.any(np.abs(one - other) > SAME_CLOCK * abs(step))


def _rate(step: float) -> str:
    return f"{1.0 / step:.6g} Hz" if step > 0.0 else "a clock that does not go on"


def _read_off(channel: Channel, time: Array) -> tuple[Array, bool]:
    """Readings at times between the first and last of a channel, and whether any lies between its samples."""
    at = np.interp(time, channel.time, np.arange(len(channel.time), dtype=np.float64))
    near = np.rint(at).astype(np.int64)
    if np.all(np.abs(at - near) <= 2.0 * SAME_CLOCK):
        return channel.values[near], False
    first = np.clip(np.floor(at).astype(np.int64) - 1, 0, max(len(channel.values) - 4, 0))
    u, values = at - first, channel.values
    parts = [
        np.prod([(u - m) / (k - m) for m in range(4) if m != k], axis=0) * values[first + k] for k in range(4)
    ]
    return np.asarray(np.sum(parts, axis=0)), True  # Lagrange's polynomial


def even_clock(channels: Sequence[Channel], place: str) -> tuple[Array, float, list[str]]:
    """The clock of channels that share one [s], shape (N,), its rate [Hz], a note on rounded stamps."""
    time = channels[0].time
    if len(time) < 2:
        raise RecordError(f"{place}: {len(time)} samples are no recording")
    if _step(time) < 0.0:
        words = f"the time runs backwards, from {time[0]:.6g} s to {time[-1]:.6g} s"
        raise RecordError(f"{place}: {words}; sort the samples by their time")
    stands = np.flatnonzero(np.diff(time) == 0.0)
    # rows that stand twice in a file have one stamp and the same readings; rounded stamps have others
    copied = any(all(one.values[k] == one.values[k + 1] for one in channels) for k in stands)
    found, rate = even(time, copied=copied)
    if np.isnan(rate):
        words = f"most of {len(time)} times stand twice, and tell no sampling rate"
        raise RecordError(f'{place}: {words}; say it in a profile, [time] step = "50 us"')
    rounded = len(stands) > 0 and bool(np.all(np.diff(found) > 0.0))
    return found, rate, ["time stamps are rounded; an even clock was put behind them"] if rounded else []


def _step(time: Array) -> float:
    """Usual step [s]: the slope of the times, which single roundings and gaps do not move."""
    if len(time) < 2:
        return 1.0
    span = max(1, len(time) // LONG_PART)
    return float(np.median(time[span:] - time[:-span])) / span


def even(time: Array, *, copied: bool = False) -> tuple[Array, float]:
    """Times that are even but for rounding in the file, exactly even; others as they are; the rate [Hz]."""
    count = len(time) - 1
    step = (time[-1] - time[0]) / count
    off = float(np.max(np.abs(time - time[0] - step * np.arange(count + 1))))
    if step > 0 and off <= EVEN * step:
        rate = _plainest(1.0 / step, 2.0 * off / (count * step))
        return time[0] + np.arange(count + 1) / rate, rate
    rounded = None if copied else _rounded_clock(time)
    if rounded is not None:
        return rounded
    usual = _step(time)
    return time.copy(), 1.0 / usual if usual > 0 else float("nan")


def _plainest(rate: float, doubt: float) -> float:
    """The rate of fewest digits within a relative doubt; nine digits are what a file can mean."""
    rounded = (float(f"{rate:.{digits}g}") for digits in range(1, 10))
    return next((one for one in rounded if abs(one / rate - 1.0) <= doubt), float(f"{rate:.9g}"))


def _rounded_clock(time: Array) -> tuple[Array, float] | None:
    """The even clock behind stamps that were rounded to decimals or to digits; None where there is none.

    No such stamp is further from the even clock than half its resolution. Rows that are there twice, or
    missing, drift away from it.
    """
    steps = np.diff(time)
    if np.any(steps < 0.0) or np.count_nonzero(steps) < FEWEST_STAMPS:
        return None
    repeated, since = bool(np.any(steps == 0.0)), time - time[0]
    index = np.arange(len(time), dtype=np.float64)
    for resolution in _resolutions(time, repeated=repeated):
        step, start = np.polyfit(index, since, 1, w=1.0 / resolution)
        if np.max(np.abs(since - start - step * index) / resolution) > 0.5 + ROUNDING_SLACK:
            continue
        if not repeated and step < 2.0 * resolution[0]:
            continue  # one row that is missing looks like the rounding of a clock that is a trifle slow
        # within one step over the whole record: the step is the resolution
        if np.ptp(resolution) == 0.0 and abs(step / resolution[0] - 1.0) * len(time) < 1.0:
            step, start = float(resolution[0]), float(np.mean(since - resolution[0] * index))
        spread = float(np.sqrt(np.sum(((index - index.mean()) / resolution) ** 2)))
        rate = _plainest(1.0 / step, DOUBT / (step * spread))
        return time[0] + start + index / rate, rate
    return None


def _resolutions(time: Array, *, repeated: bool) -> Iterator[Array]:
    """What each stamp may be a multiple of [s], shape (N,): one for all, or by a number of digits."""
    since = time - time[0]
    for decimals in range(MOST_DECIMALS + 1):
        counts = np.rint(since * 10.0**decimals)
        if np.max(np.abs(since - counts * 10.0**-decimals)) < 1e-3 * 10.0**-decimals:
            # the largest step of which all distances of the stamps are multiples
            yield np.full(len(time), float(np.gcd.reduce(counts.astype(np.int64))) * 10.0**-decimals)
            break
    size = np.floor(np.log10(np.maximum(np.abs(time), np.min(np.abs(time[time != 0.0])))))
    for digits in range(2, MOST_DIGITS + 1) if repeated else ():
        each = 10.0 ** (size + 1.0 - digits)
        if np.all(np.abs(time - np.rint(time / each) * each) < 1e-3 * each):
            yield each
            break
    # binary fractions of a day, or of an epoch in seconds: steps are multiples of one
    sizes = np.unique(np.round(np.diff(time) * 1e12)) * 1e-12
    if 1 < len(sizes) <= MOST_SIZES:
        yield np.full(len(time), float(np.max(np.diff(sizes))))
