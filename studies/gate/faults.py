"""Thirty kinds of semantic fault of a record, each of a size drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt

from rotordrop.record.record import Record

Array = NDArray[np.float64]
Random = np.random.Generator
Made = tuple[Record, Record, str]


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A way to spoil record and tail, and the names under which it is found rightly."""

    make: Callable[[Record, Record, Random], Made]
    names: tuple[str, ...]


def _log(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _with(record: Record, change: Callable[[Array], Array | None]) -> Record:
    signals = record.signals.copy()
    changed = change(signals)
    return replace(record, signals=signals if changed is None else np.ascontiguousarray(changed))


def _channel(record: Record, random: Random) -> int:
    return int(random.integers(0, record.signals.shape[1]))


def _after(record: Record, random: Random, length: int) -> int:
    """A sample in the 0.2 s after the drop, from which `length` samples are there."""
    first = int(np.searchsorted(record.time, 0.0))
    last = min(first + int(0.2 * record.sampling_rate), len(record.time) - length - 1)
    return int(random.integers(first, last))


def missing_samples(record: Record, tail: Record, random: Random) -> Made:
    count, column = int(_log(random, 1, 300)), _channel(record, random)
    at = _after(record, random, count)

    def change(signals: Array) -> None:
        signals[at : at + count, column] = random.choice([np.nan, np.inf])

    return _with(record, change), tail, f"{count}"


def _rail(record: Record, random: Random) -> tuple[float, Array, Array]:
    level = np.mean(record.signals[record.time < -0.02], axis=0)
    reach = np.max(np.abs(record.signals - level), axis=0)
    share = float(random.uniform(0.5, 0.85))
    return share, level - share * reach, level + share * reach


def clipping(record: Record, tail: Record, random: Random) -> Made:
    share, low, high = _rail(record, random)
    return _with(record, lambda s: np.clip(s, low, high)), tail, f"{share:.2f}"


def noisy_clipping(record: Record, tail: Record, random: Random) -> Made:
    share, low, high = _rail(record, random)
    noise = float(random.uniform(0.05e-6, 0.5e-6))
    spoiled = _with(record, lambda s: np.clip(s, low, high) + random.normal(0.0, noise, s.shape))
    return spoiled, tail, f"{share:.2f}, {noise * 1e6:.2f} um"


def dead_channel(record: Record, tail: Record, random: Random) -> Made:
    column, noise = _channel(record, random), float(random.choice([0.0, 0.2e-6]))

    def change(signals: Array) -> None:
        signals[:, column] = signals[0, column] + random.normal(0.0, noise, len(signals))

    return _with(record, change), tail, f"{noise * 1e6:.1f} um"


def stuck_channel(record: Record, tail: Record, random: Random) -> Made:
    count, column = int(_log(random, 1e-3, 0.1) * record.sampling_rate), _channel(record, random)
    at = _after(record, random, count)

    def change(signals: Array) -> None:
        signals[at : at + count, column] = signals[at, column]

    return _with(record, change), tail, f"{count}"


def lost_samples(record: Record, tail: Record, random: Random) -> Made:
    """All channels lose a block; the clock runs on."""
    count = int(_log(random, 5e-4, 0.05) * record.sampling_rate)
    at = _after(record, random, count)
    keep = np.delete(np.arange(len(record.time)), np.arange(at, at + count))
    time = record.time[: len(keep)]
    moved = {"signals": record.signals[keep], "time": time}
    return replace(record, speed=np.asarray(record.speed)[: len(time)], **moved), tail, f"{count}"


def doubled_block(record: Record, tail: Record, random: Random) -> Made:
    count = int(_log(random, 2e-3, 0.05) * record.sampling_rate)
    at = _after(record, random, 2 * count)

    def change(signals: Array) -> Array:
        return np.vstack([signals[: at + count], signals[at:-count]])

    return _with(record, change), tail, f"{count}"


def bad_clock(record: Record, tail: Record, random: Random) -> Made:
    time = record.time.copy()
    step = 1.0 / record.sampling_rate
    if random.random() < 0.5:
        share = float(random.uniform(0.05, 0.25))
        time += share * step * random.uniform(-1.0, 1.0, len(time)) * 1.7
        return replace(record, time=time), tail, f"jitter {share:.2f}"
    at = _after(record, random, 10)
    back = float(random.uniform(2.0, 200.0)) * step
    time[at:] -= back
    return replace(record, time=time), tail, f"back {back:.2g} s"


def other_rate(record: Record, tail: Record, random: Random) -> Made:
    factor = float(random.choice([0.5, 2.0]))
    start = record.time[0]
    spoiled = replace(
        record,
        time=start + (record.time - start) / factor,
        sampling_rate=record.sampling_rate * factor,
        speed_time=start + (np.asarray(record.speed_time) - start) / factor,
    )
    return spoiled, tail, f"{factor:g}"


def late_channel(record: Record, tail: Record, random: Random) -> Made:
    late, column = _log(random, 2e-4, 2e-3), _channel(record, random)

    def change(signals: Array) -> None:
        moved = np.interp(record.time - late, record.time, signals[:, column])
        signals[:, column] = np.where(record.time - late < record.time[0], signals[:, column], moved)

    return _with(record, change), tail, f"{late * 1e3:.2f} ms"


def swapped_axes(record: Record, tail: Record, random: Random) -> Made:
    order = [1, 0, 3, 2] if random.random() < 0.5 else [1, 0, 2, 3]
    return _with(record, lambda s: s[:, order]), _with(tail, lambda s: s[:, order]), str(order)


def swapped_ends(record: Record, tail: Record, random: Random) -> Made:
    order = [[2, 3, 0, 1], [2, 1, 0, 3], [0, 3, 2, 1]][int(random.integers(0, 3))]
    return _with(record, lambda s: s[:, order]), _with(tail, lambda s: s[:, order]), str(order)


def inverted(record: Record, tail: Record, random: Random) -> Made:
    sign = np.ones(record.signals.shape[1])
    sign[_channel(record, random)] = -1.0
    return _with(record, lambda s: s * sign), _with(tail, lambda s: s * sign), ""


def wrong_unit(record: Record, tail: Record, random: Random) -> Made:
    factor = float(random.choice([25.4, 1 / 25.4, 1e3, 1e-3, 1e6, 1e-6]))
    return _with(record, lambda s: s * factor), _with(tail, lambda s: s * factor), f"{factor:.3g}"


def gain_of_one(record: Record, tail: Record, random: Random) -> Made:
    gain = np.ones(record.signals.shape[1])
    gain[_channel(record, random)] = _log(random, 1.15, 1.5) ** random.choice([-1.0, 1.0])
    return _with(record, lambda s: s * gain), _with(tail, lambda s: s * gain), f"{gain.min():.2f}"


def common_gain(record: Record, tail: Record, random: Random) -> Made:
    gain = _log(random, 1.15, 1.5) ** random.choice([-1.0, 1.0])
    return _with(record, lambda s: s * gain), _with(tail, lambda s: s * gain), f"{gain:.2f}"


def soft_saturation(record: Record, tail: Record, random: Random) -> Made:
    level = float(random.uniform(0.9, 1.6) * np.max(np.abs(record.signals)))

    def change(signals: Array) -> Array:
        return np.asarray(level * np.tanh(signals / level))

    return _with(record, change), _with(tail, change), f"{level * 1e6:.0f} um"


def low_pass(record: Record, tail: Record, random: Random) -> Made:
    corner = _log(random, 30.0, 200.0)
    sections = butter(2, corner, fs=record.sampling_rate, output="sos")
    level = np.mean(record.signals[:200], axis=0)
    return _with(record, lambda s: level + sosfilt(sections, s - level, axis=0)), tail, f"{corner:.0f} Hz"


def coupling(record: Record, tail: Record, random: Random) -> Made:
    corner = _log(random, 0.5, 3.0)

    def passed(one: Record) -> Record:
        upper, lower = butter(1, corner, btype="high", fs=one.sampling_rate)
        return _with(one, lambda s: lfilter(upper, lower, s - np.mean(s[:50], axis=0), axis=0))

    return passed(record), passed(tail), f"{corner:.2f} Hz"


def bridged_gap(record: Record, tail: Record, random: Random) -> Made:
    count, column = int(_log(random, 2e-3, 0.05) * record.sampling_rate), _channel(record, random)
    at = _after(record, random, count)

    def change(signals: Array) -> None:
        line = np.linspace(signals[at, column], signals[at + count, column], count + 1)
        signals[at : at + count + 1, column] = np.round(line, 10)

    return _with(record, change), tail, f"{count}"


def _with_speed(record: Record, factor: Array | float) -> Record:
    readings = np.asarray(record.speed_readings) * factor
    when = np.asarray(record.speed_time)
    return replace(record, speed_readings=readings, speed=np.interp(record.time, when, readings))


def dead_speed(record: Record, tail: Record, random: Random) -> Made:
    since = float(random.choice([-1.0, random.uniform(-0.1, 0.1)]))
    factor = np.where(np.asarray(record.speed_time) < since, 1.0, 0.0)
    return _with_speed(record, factor), tail, f"{since:.2f} s"


def scaled_speed(record: Record, tail: Record, random: Random) -> Made:
    factor = float(random.choice([60.0, 1 / 60.0, 2 * np.pi, 1 / (2 * np.pi), 2.0, 0.5]))
    return _with_speed(record, factor), tail, f"{factor:.3g}"


def negative_speed(record: Record, tail: Record, random: Random) -> Made:
    return _with_speed(record, -1.0), tail, ""


def second_drop(record: Record, tail: Record, random: Random) -> Made:
    keep = record.time < random.uniform(0.35, 0.6)
    once = record.signals[keep]
    count = int(random.uniform(0.02, 0.2) * record.sampling_rate)
    ramp = np.linspace(0.0, 1.0, count)[:, None]
    noise = random.normal(0.0, 0.4e-6, (count + len(record.signals), once.shape[1]))
    first = np.mean(record.signals[:100], axis=0)
    lift = once[-1] * (1.0 - ramp) + first * ramp
    signals = np.vstack([once, np.vstack([lift, record.signals]) + noise])
    time = record.time[0] + np.arange(len(signals)) / record.sampling_rate
    readings = np.full(len(time[::200]), np.asarray(record.speed_readings)[0])
    moved = {"signals": signals, "time": time, "speed": np.full(len(time), readings[0])}
    return replace(record, speed_time=time[::200], speed_readings=readings, **moved), tail, f"{count}"


def spikes(record: Record, tail: Record, random: Random) -> Made:
    count, column = int(_log(random, 1, 30)), _channel(record, random)
    at = random.choice(np.arange(10, len(record.time) - 10), count, replace=False)
    size = _log(random, 30e-6, 500e-6)

    def change(signals: Array) -> None:
        signals[at, column] += size * random.choice([-1.0, 1.0], count)

    return _with(record, change), tail, f"{count} of {size * 1e6:.0f} um"


def hum(record: Record, tail: Record, random: Random) -> Made:
    size, mains = _log(random, 5e-6, 30e-6), float(random.choice([50.0, 60.0]))
    if abs(mains * 2 * np.pi - float(np.asarray(record.speed_readings)[0])) < 2 * np.pi * 12.0:
        mains = 110.0 - mains

    def change(one: Record) -> Record:
        return _with(one, lambda s: s + size * np.sin(2 * np.pi * mains * one.time)[:, None])

    return change(record), change(tail), f"{mains:g} Hz, {size * 1e6:.0f} um"


def coarse_steps(record: Record, tail: Record, random: Random) -> Made:
    step = _log(random, 1.5e-6, 8e-6)
    return _with(record, lambda s: step * np.round(s / step)), tail, f"{step * 1e6:.1f} um"


def no_pretrigger(record: Record, tail: Record, random: Random) -> Made:
    since = float(random.uniform(0.012, 0.05))
    keep = record.time > since
    spoiled = replace(
        record, time=record.time[keep], signals=record.signals[keep], speed=np.asarray(record.speed)[keep]
    )
    return spoiled, tail, f"{since:.3f} s"


def turned_sensors(record: Record, tail: Record, random: Random) -> Made:
    turn = np.radians(random.uniform(15.0, 40.0) * random.choice([-1.0, 1.0]))
    first = [0, 1] if random.random() < 0.5 else [2, 3]
    c, s = np.cos(turn), np.sin(turn)

    def change(signals: Array) -> None:
        signals[:, first] = signals[:, first] @ np.array([[c, s], [-s, c]])

    return _with(record, change), _with(tail, change), f"{np.degrees(turn):.0f} deg"


def zeroed_block(record: Record, tail: Record, random: Random) -> Made:
    count, column = int(_log(random, 8, 4096)), _channel(record, random)
    at = _after(record, random, count)

    def change(signals: Array) -> None:
        signals[at : at + count, column] = 0.0

    return _with(record, change), tail, f"{count}"


_ENDS = ("swapped ends", "swapped channels")
_RATE = ("wrong speed", "wrong speed unit")

FAULTS: dict[str, Fault] = {
    "missing samples": Fault(make=missing_samples, names=("missing samples",)),
    "clipping": Fault(make=clipping, names=("clipping",)),
    "noisy clipping": Fault(make=noisy_clipping, names=("clipping",)),
    "dead channel": Fault(make=dead_channel, names=("dead channel",)),
    "stuck channel": Fault(make=stuck_channel, names=("stuck channel", "clipping")),
    "lost samples, running clock": Fault(make=lost_samples, names=("dropped block",)),
    "block there twice": Fault(make=doubled_block, names=("duplicate block",)),
    "jittered or backward clock": Fault(make=bad_clock, names=("jittered clock", "non-monotonic time")),
    "half or doubled sampling rate": Fault(make=other_rate, names=("wrong sampling rate",)),
    "late channel": Fault(make=late_channel, names=("late channel",)),
    "swapped axes": Fault(make=swapped_axes, names=("swapped axes", "inverted polarity")),
    "swapped ends or channels": Fault(make=swapped_ends, names=_ENDS),
    "inverted polarity": Fault(make=inverted, names=("inverted polarity", "swapped axes")),
    "wrong unit": Fault(make=wrong_unit, names=("wrong unit factor",)),
    "gain of one channel": Fault(make=gain_of_one, names=("wrong gain",)),
    "common gain": Fault(make=common_gain, names=("wrong gain",)),
    "soft saturation": Fault(make=soft_saturation, names=("soft saturation",)),
    "recorder low-pass": Fault(make=low_pass, names=("recorder low-pass",)),
    "AC coupling": Fault(make=coupling, names=("AC coupling",)),
    "bridged gap": Fault(make=bridged_gap, names=("bridged gap",)),
    "dead speed": Fault(make=dead_speed, names=("dead speed",)),
    "scaled speed": Fault(make=scaled_speed, names=_RATE),
    "negative speed": Fault(make=negative_speed, names=("negative speed",)),
    "second drop": Fault(make=second_drop, names=("second drop",)),
    "spikes": Fault(make=spikes, names=("spikes",)),
    "hum": Fault(make=hum, names=("hum",)),
    "coarse quantisation": Fault(make=coarse_steps, names=("coarse quantisation",)),
    "missing pre-trigger": Fault(make=no_pretrigger, names=("missing pre-trigger",)),
    "turned sensors": Fault(make=turned_sensors, names=("turned sensors", "leaning fall", "leaning rest")),
    "zeroed block": Fault(make=zeroed_block, names=("zeroed block",)),
}
