"""Faults of single channels that show without knowing the machine: missing, clipped, dead, stuck."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.evidence.quality.motion import first_motion
from rotordrop.evidence.quality.recorder import bridged
from rotordrop.series import SIGMA_OF_MEDIAN, noise_by_differences, runs_of
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.record.record import Record

DEAD_SHARE = 0.02
"""A channel that moves by less than this share of the median of the others is dead (chosen)."""

CLIPPED_RUN = 5
"""Samples in a row at the very extreme of a channel that make clipping (chosen)."""

COARSE_STEP = 1e-6
"""Quantisation coarser than this is worth a warning [m] (chosen)."""

_STUCK_SAMPLES = 5
_BY_CHANCE = 1e-5
"""Runs as long as a stuck one that noise and converter make in a record, at most [1]; with 1e-3 one of 520
clean channels was named."""

_NEARBY = 400
"""Steps around a run that say how often neighbours read the same there."""

_SPIKE = 12.0
_SPIKE_LEAST = 5e-6
_SPIKE_STEPS = 2.5
"""A spike is higher than this many steps of the converter [1]."""


MOST_HELD = 5e-3
"""Longest time for which a channel may hold one reading and the estimate still goes on without it [s]: less
than a fall through a usual gap (chosen)."""


def damaged_samples(signals: Array) -> NDArray[np.bool_]:
    """Samples (N, C) that are no readings of the motion: copies of the one before, or single ones far off."""
    bad = np.zeros(signals.shape, dtype=np.bool_)
    for c in range(signals.shape[1]):
        values = signals[:, c]
        if not np.isfinite(values).all() or len(values) < 3:
            continue  # such a channel is no candidate for single faults
        for start, count in zip(*_held(values), strict=True):
            bad[start + 1 : start + count, c] = True
        bad[_standing_out(values)[0] + 1, c] = True
    return bad


def check_channels(record: Record) -> list[Finding]:
    """Look at every channel by itself and at how it compares with the others."""
    findings: list[Finding] = []
    moves = np.array([_range(record.signals[:, i]) for i in range(len(record.sensors))])
    for index, sensor in enumerate(record.sensors):
        values = record.signals[:, index]
        missing = _missing(record, sensor.name, values)
        if missing:
            findings += missing
            continue
        others = np.delete(moves, index)
        typical = float(np.nanmedian(others)) if len(others) else float("nan")
        if moves[index] == 0 or moves[index] < DEAD_SHARE * typical:
            findings.append(_dead(sensor.name, values, float(moves[index]), typical))
            continue
        checks = (zeroed, _stuck, _clipped, _spikes, _coarse, bridged)
        own = [found for check in checks if (found := check(record, sensor.name, values)) is not None]
        # zeros are held readings too: each name once
        findings += [found for k, found in enumerate(own) if all(found.kind != one.kind for one in own[:k])]
    return findings


def _range(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _missing(record: Record, channel: str, values: Array) -> list[Finding]:
    bad = np.flatnonzero(~np.isfinite(values))
    if not len(bad):
        return _no_readings(record, channel, values)
    at = float(record.time[bad[0]])
    return [
        Finding(
            kind=Kind.MISSING_SAMPLES,
            message=f"{len(bad)} of {len(values)} samples are NaN or infinite, the first at {at:.6g} s",
            remedy="export the recording without gaps, or cut it before them",
            severity="stop",
            channel=channel,
            time=at,
        )
    ]


_NO_LENGTH = (1e-30, 1e3)
"""Between these lies every reading that is not exactly zero [m]; beyond are bytes of a damaged file that
were taken for a number of double precision (chosen, far from any reading)."""


def _no_readings(record: Record, channel: str, values: Array) -> list[Finding]:
    size = np.abs(values)
    # a simulated motion may die away to nothing
    tiny = (size > 0.0) & (size < _NO_LENGTH[0]) & (np.median(size) > 1e-9)
    odd = np.flatnonzero(tiny | (size > _NO_LENGTH[1]))
    if not len(odd):
        return []
    at = float(record.time[odd[0]])
    return [
        Finding(
            kind=Kind.TORN,
            message=f"{len(odd)} of {len(values)} samples are no readings, the first, "
            f"{values[odd[0]]:.3g} m, at {at:.6g} s: bytes of the file have changed",
            remedy="copy or export the recording again",
            severity="stop",
            channel=channel,
            time=at,
        )
    ]


def _dead(channel: str, values: Array, moves: float, typical: float) -> Finding:
    reads = format_quantity(float(values[0]), "length")
    return Finding(
        kind=Kind.DEAD_CHANNEL,
        message=f"it moves by {format_quantity(moves, 'length')} around {reads} while the others move by "
        f"{format_quantity(typical, 'length')}",
        remedy="check cable and driver, then record again; this sensor cannot be replaced by the others",
        severity="stop",
        channel=channel,
    )


def _held(values: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths [samples] of the runs in which a channel holds one reading, the longest first."""
    starts, lengths = runs_of(np.diff(values) == 0)
    if not len(lengths):
        return starts, lengths
    # flat at the extreme is clipping, which is looked for by itself
    inside = (values[starts] != np.min(values)) & (values[starts] != np.max(values))
    # coarse steps make runs everywhere, and more of them where the rotor hardly moves
    same = np.diff(values) == 0
    share = max(float(np.mean(same)), 1.0 / len(same))
    rare = len(same) * share**lengths < _BY_CHANCE
    chosen = np.flatnonzero((lengths + 1 >= _STUCK_SAMPLES) & inside & rare)
    chosen = np.array(
        [
            k
            for k in chosen
            if _alone(same, int(starts[k]), int(lengths[k]))
            and not _of_steps(values, int(starts[k]), int(lengths[k]))
        ],
        dtype=np.intp,
    )
    chosen = chosen[np.argsort(-lengths[chosen], kind="stable")]
    return starts[chosen], lengths[chosen] + 1


def _alone(same: NDArray[np.bool_], start: int, length: int) -> bool:
    """Whether noise and converter hardly make a run as long as this, by what they do on both sides of it."""
    beside = np.append(same[max(start - _NEARBY, 0) : start], same[start + length :][:_NEARBY])
    share = (float(np.sum(beside)) + 1.0) / (len(beside) + 1.0)
    return len(same) * share**length < _BY_CHANCE


def _of_steps(values: Array, start: int, length: int) -> bool:
    """Whether a coarse converter makes a run where the rotor turns back: it goes on by a single step."""
    step = _step_of(values)
    beside = (max(start - 1, 0), min(start + length + 1, len(values) - 1))
    gone = max(abs(float(values[place] - values[start])) for place in beside)
    return step > COARSE_STEP and gone < 1.5 * step


def _stuck(record: Record, channel: str, values: Array) -> Finding | None:
    starts, lengths = _held(values)
    if not len(lengths):
        return None
    count, first = int(lengths[0]), int(starts[0])
    held, at = format_quantity(float(values[first]), "length"), float(record.time[first])
    lasts = count / record.sampling_rate
    short = float(np.sum(lengths)) / record.sampling_rate <= MOST_HELD
    return Finding(
        kind=Kind.STUCK_CHANNEL if values[first] != 0.0 else Kind.ZEROED,
        message=f"{count} samples ({lasts * 1e3:.3g} ms) read exactly {held} from {at:.6g} s on",
        remedy="check the recorder's input; the tracked twin goes on without these samples, for at most "
        f"{MOST_HELD * 1e3:g} ms"
        if short
        else "check the recorder's input, then record again",
        severity="warning" if short else "stop",
        channel=channel,
        time=at,
    )


def _clipped(record: Record, channel: str, values: Array) -> Finding | None:
    low, high = float(np.min(values)), float(np.max(values))
    inside = (values > low) & (values < high)
    _, elsewhere = runs_of((np.diff(values) == 0) & inside[1:])
    usual = int(np.max(elsewhere, initial=0)) + 1  # coarse steps make runs everywhere
    for extreme, side in ((high, "upper"), (low, "lower")):
        starts, lengths = runs_of(values == extreme)
        if len(lengths) and int(np.max(lengths)) >= max(CLIPPED_RUN, 3 * usual):
            first = int(starts[np.argmax(lengths >= CLIPPED_RUN)])
            return Finding(
                kind=Kind.CLIPPING,
                message=f"it stays at its {side} limit {format_quantity(extreme, 'length')} for up to "
                f"{int(np.max(lengths))} samples, {int(np.sum(lengths))} in all",
                remedy="widen the input range of the recorder or the range of the sensor, then record again",
                severity="stop",
                channel=channel,
                time=float(record.time[first]),
            )
    return None


def _spikes(record: Record, channel: str, values: Array) -> Finding | None:
    """Single samples off the line through their neighbours, with the neighbours agreeing."""
    spikes, heights = _standing_out(values)
    if not len(spikes):
        return _steps(record, channel, values)
    at = float(record.time[spikes[0] + 1])
    size = format_quantity(float(np.max(heights)), "length")
    return Finding(
        kind=Kind.SPIKES,
        message=f"{len(spikes)} single samples stand out by up to {size}, the first at {at:.6g} s",
        remedy="look for loose contacts or switching noise; the tracked twin goes on without these samples",
        severity="warning",
        channel=channel,
        time=at,
    )


def _standing_out(values: Array) -> tuple[NDArray[np.intp], Array]:
    """Single samples off the line through their neighbours: their places less one, and by how much [m]."""
    middle = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    limit = max(_SPIKE * SIGMA_OF_MEDIAN * float(np.median(middle)), _SPIKE_LEAST)
    spikes = np.flatnonzero((middle > limit) & (np.abs(values[2:] - values[:-2]) < 0.5 * middle))
    if len(spikes):  # the steps of a coarse converter are none
        spikes = spikes[middle[spikes] > _SPIKE_STEPS * _step_of(values)]
    return spikes, middle[spikes]


def _steps(record: Record, channel: str, values: Array) -> Finding | None:
    """Steps from one sample to the next far beyond those of the motion."""
    step = np.abs(np.diff(values))
    limit = max(8.0 * float(np.percentile(step, 99.9)), _SPIKE_LEAST)
    steps = np.flatnonzero(step > limit)
    if len(steps):
        steps = steps[step[steps] > _SPIKE_STEPS * _step_of(values)]
    if not len(steps):
        return None
    at = float(record.time[steps[0] + 1])
    return Finding(
        kind=Kind.SPIKES,
        message=f"{len(steps)} steps of up to {format_quantity(float(np.max(step)), 'length')} from one "
        f"sample to the next, the first at {at:.6g} s",
        remedy="look for loose contacts or damaged blocks of the file",
        severity="warning",
        channel=channel,
        time=at,
    )


def _step_of(values: Array) -> float:
    """Usual distance between readings that differ [m]."""
    levels = np.unique(values)
    return float(np.median(np.diff(levels))) if len(levels) > 1 else 0.0


def _coarse(record: Record, channel: str, values: Array) -> Finding | None:
    step = _step_of(values)
    if step < COARSE_STEP:
        return None
    count = len(np.unique(values))
    return Finding(
        kind=Kind.COARSE,
        message=f"readings come in steps of {format_quantity(step, 'length')} ({count} different values)",
        remedy="use more bits or a smaller input range of the recorder",
        severity="warning",
        channel=channel,
    )


FEWEST_ZEROS = 3
"""Exact zeros in a row that make a block of them, among readings that are away from zero (chosen)."""

AWAY = 12.0
"""How far those readings are away from zero, in their own usual change from sample to sample [1]."""

ON_THE_RAIL = 4.0
"""Half width of the band at the rail in standard deviations of the noise [1]."""

FEWEST_SPELLS = 4
"""Spells at one and the same level that make a rail; an impact ends at a level of its own."""

FLAT_S = 0.6e-3
"""A spell at the rail lasts at least so long [s]."""

MOST_SCATTER = 3.0
"""Mean square of the spells' levels about their mean over that of noise, up to which they are one [1]."""

FURTHEST = 4.8
"""Distance of the extreme reading from the level of a rail in standard deviations of the noise [1]: of 1000
readings one lies 3.2 off, of a million one 4.9."""

FEWEST_SAMPLES = 10
"""Samples by which noise about a level and an arc are told apart [1]."""

FAR = 0.08
"""Share of a channel's range by which the readings leave the rail between two spells [1]."""

COMES_FROM = 8.0
"""Least lengths of a spell within which the readings come from afar and go there again [1]."""


def zeroed(record: Record, channel: str, values: Array) -> Finding | None:
    """Find a block of exact zeros among readings that are far from zero."""
    starts, lengths = runs_of(values == 0.0)
    if not len(lengths) or int(np.max(lengths)) < FEWEST_ZEROS:
        return None
    changes = np.abs(np.diff(values))
    usual = max(float(np.median(changes)), float(np.min(changes[changes > 0.0], initial=np.inf)))
    found = [
        (int(start), int(length))
        for start, length in zip(starts, lengths, strict=True)
        if length >= FEWEST_ZEROS and start > 0 and start + length < len(values)
        if min(abs(values[start - 1]), abs(values[start + length])) > AWAY * usual
    ]
    if not found:
        return None
    at = float(record.time[found[0][0]])
    count = sum(length for _, length in found)
    return Finding(
        kind=Kind.ZEROED,
        message=f"{count} samples in {len(found)} block(s) read exactly zero among readings far from it, the "
        f"first at {at:.6g} s",
        remedy="the file is damaged; copy or export it again",
        severity="stop",
        channel=channel,
        time=at,
    )


def check_rail(record: Record, fallen: int | None = None) -> list[Finding]:
    """Find channels whose readings run into one and the same level again and again, with noise on them.

    A rotor that bounces turns back at a depth of its own each time, in an arc; one that rests does not run
    into its rest again and again. An orbit before the drop does turn back at one level and is left out. Of 96
    clean channels at 60 to 500 Hz none was found, of 72 cut at half to 85 % of their depth 67.
    """
    rate = record.sampling_rate
    if not 0.0 < rate < np.inf or round(FLAT_S * rate) < FEWEST_SAMPLES:
        return []
    fallen = first_motion(record)[0] if fallen is None else fallen
    found = (
        _railed(name, record.time[fallen:], record.signals[fallen:, column], round(FLAT_S * rate))
        for column, name in enumerate(record.channel_names)
    )
    return [finding for finding in found if finding is not None]


def _railed(channel: str, time: Array, values: Array, least: int) -> Finding | None:
    if len(values) < 100:
        return None
    noise = noise_by_differences(values, 2)
    for extreme, side in ((float(np.max(values)), "upper"), (float(np.min(values)), "lower")):
        spells = _spells(np.abs(values - extreme), noise, least)
        if len(spells) < FEWEST_SPELLS or not _of_one_level(values, spells, noise):
            continue
        flat = np.concatenate([values[start : start + length] for start, length in spells])
        if abs(float(np.mean(flat)) - extreme) > FURTHEST * noise:
            continue  # the readings go on beyond that level: the rotor does, no rail lets them
        at, total = float(time[spells[0][0]]), sum(length for _, length in spells)
        return Finding(
            kind=Kind.CLIPPING,
            message=f"it runs into its {side} limit near {format_quantity(extreme, 'length')} {len(spells)} "
            f"times and stays there, {total} samples in all, with noise on them",
            remedy="widen the input range of the recorder or the range of the sensor, then record again",
            severity="stop",
            channel=channel,
            time=at,
        )
    return None


def _spells(below: Array, noise: float, least: int) -> list[tuple[int, int]]:
    """Starts and lengths of flat spells at the extreme, between which the readings go far from it."""
    band = 2.0 * ON_THE_RAIL * noise
    far = max(3.0 * band, FAR * float(np.max(below)))
    reach = round(COMES_FROM * least)
    starts, lengths = runs_of(below <= band)
    found = []
    for start, length in zip(starts.tolist(), lengths.tolist(), strict=True):
        before, after = below[max(start - reach, 0) : start], below[start + length : start + length + reach]
        if length < least or not len(before) or not len(after):
            continue
        comes, goes = float(np.max(before)), float(np.max(after))
        if min(comes, goes) > far and _is_flat(below[start : start + length], noise):
            found.append((start, length))
    return found


def _of_one_level(values: Array, spells: list[tuple[int, int]], noise: float) -> bool:
    """Whether the means of all spells differ by no more than noise allows: a rail does not move."""
    means = np.array([np.mean(values[start : start + length]) for start, length in spells])
    errors = noise / np.sqrt([length for _, length in spells])
    spread = float(np.sum(((means - np.average(means, weights=errors**-2)) / errors) ** 2))
    return spread < (len(spells) - 1) * MOST_SCATTER


def _is_flat(spell: Array, noise: float) -> bool:
    """Whether a spell is noise about a level, not an arc: its thirds have one mean."""
    thirds = [float(np.mean(part)) for part in np.array_split(spell, 3)]
    return max(thirds) - min(thirds) < 3.0 * noise * float(np.sqrt(3.0 / len(spell)) * np.sqrt(2.0))
