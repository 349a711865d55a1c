"""Faults of single channels that show without knowing the machine: missing, clipped, dead, stuck."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.evidence.quality.finding import Finding, Severity, found
from rotordrop.record.axes import sees_both_directions
from rotordrop.series import SIGMA_OF_MEDIAN, runs_of, stride_of

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

_PACE, _BESIDE = 1.5, 2
"""Steps of the converter from sample to sample up to which equal readings, with so many beside them at either
end, are those of a slow motion without noise: what was stuck catches up [1] (chosen)."""

_NEARBY = 400
"""Steps around a run that say how often neighbours read the same there."""

MOST_HELD = 5e-3
"""Longest time for which a channel may hold one reading and the estimate still goes on without it [s]: less
than a fall through a usual gap (chosen)."""

_SPIKE = 12.0
_SPIKE_LEAST = 5e-6
_SPIKE_STEPS = 2.5
"""A spike is higher than this many steps of the converter [1]."""

FEWEST_ZEROS = 3
"""Exact zeros in a row that make a block of them, among readings that are away from zero (chosen)."""

AWAY = 12.0
"""How far those readings are away from zero, in their own usual change from sample to sample [1]."""


def damaged_samples(signals: Array) -> NDArray[np.bool_]:
    """Samples (N, C) that are no readings of the motion: copies of the one before, or single ones far off."""
    bad = np.zeros(signals.shape, dtype=np.bool_)
    for c, values in enumerate(signals.T):
        if not np.isfinite(values).all() or len(values) < 3:
            continue  # such a channel is no candidate for single faults
        for start, count in zip(*_held(values), strict=True):
            bad[start + 1 : start + count, c] = True
        bad[_standing_out(values)[0] + 1, c] = True
        bad[np.isin(values, list(_limits(values))), c] = True
    return bad


def check_channels(record: Record) -> list[Finding]:
    """Look at every channel by itself and at how it compares with the others."""
    findings: list[Finding] = []
    columns = record.signals.T
    moves = np.array([float(np.ptp(v[np.isfinite(v)])) if np.isfinite(v).any() else 0.0 for v in columns])
    for index, name in enumerate(record.channel_names):
        values = np.ascontiguousarray(columns[index])
        others = np.delete(moves, index)
        typical = float(np.nanmedian(others)) if len(others) else float("nan")
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            at = float(record.time[bad[0]])
            findings.append(found("missing", channel=name, time=at, count=len(bad), of=len(values)))
        elif moves[index] == 0 or moves[index] < DEAD_SHARE * typical:
            moved = float(moves[index])
            findings.append(found("dead", channel=name, moves=moved, reads=values[0], typical=typical))
        else:
            stuck = _zeroed(record, name, values) or _stuck(record, name, values)
            single = _spikes(record, name, values) or _steps(record, name, values)
            findings += [*stuck, *_clipped(record, name, values), *single, *_coarse(name, values)]
    return findings


def _held(values: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths [samples] of the stretches that read the same without cause, the longest first."""
    step, changes = _step_of(values), np.abs(np.diff(values))
    same = changes == 0.0
    usual, (starts, lengths) = float(np.mean(same)), runs_of(same)

    def caused(start: int, length: int) -> bool:
        """Whether slow motion, or noise and converter by what they do beside it and at all, make this run."""
        end = start + length
        if np.max(changes[max(start - _BESIDE, 0) : end + _BESIDE]) <= _PACE * step:
            return True
        beside = np.append(same[max(start - _NEARBY, 0) : start], same[end : end + _NEARBY])
        share = max((float(np.sum(beside)) + 1.0) / (len(beside) + 1.0), usual)
        return len(same) * share**length >= _BY_CHANCE

    # flat at the extreme is clipping, which is looked for by itself; coarse steps make runs everywhere
    inside = (values[starts] != np.min(values)) & (values[starts] != np.max(values)) & (step <= COARSE_STEP)
    long = np.flatnonzero((lengths + 1 >= _STUCK_SAMPLES) & inside).tolist()
    chosen = [k for k in long if not caused(int(starts[k]), int(lengths[k]))]
    chosen.sort(key=lambda k: -lengths[k])
    return starts[chosen], lengths[chosen] + 1


def _stuck(record: Record, channel: str, values: Array) -> list[Finding]:
    starts, lengths = _held(values)
    if not len(lengths):
        return []
    first, count = int(starts[0]), int(lengths[0])
    rate, at = record.sampling_rate, float(record.time[first])
    said = {"count": count, "lasts": 1e3 * count / rate, "reads": values[first], "most": 1e3 * MOST_HELD}
    short = float(np.sum(lengths)) / rate <= MOST_HELD
    return [found("held", said, channel=channel, time=at, severity="warning" if short else None)]


def _zeroed(record: Record, channel: str, values: Array) -> list[Finding]:
    """A block of exact zeros among readings that are far from zero."""
    starts, lengths = runs_of(values == 0.0)
    inner = (lengths >= FEWEST_ZEROS) & (starts > 0) & (starts + lengths < len(values))
    starts, lengths = starts[inner], lengths[inner]
    if not len(starts):
        return []
    changes = np.abs(np.diff(values))
    usual = max(float(np.median(changes)), float(np.min(changes[changes > 0.0], initial=np.inf)))
    away = np.minimum(np.abs(values[starts - 1]), np.abs(values[starts + lengths])) > AWAY * usual
    if not away.any():
        return []
    at = float(record.time[starts[away][0]])
    return [
        found("zeroed", channel=channel, time=at, count=int(np.sum(lengths[away])), blocks=int(np.sum(away)))
    ]


def _limits(values: Array) -> dict[float, int]:
    """The ends of its range at which a channel is clipped [m], with its longest run there [samples]."""
    low, high = float(np.min(values)), float(np.max(values))
    inside = (values > low) & (values < high)
    # coarse steps make runs everywhere
    usual = int(np.max(runs_of((np.diff(values) == 0) & inside[1:])[1], initial=0)) + 1
    runs = {end: int(np.max(runs_of(values == end)[1], initial=0)) for end in (high, low)}
    return {end: longest for end, longest in runs.items() if longest >= max(CLIPPED_RUN, 3 * usual)}


def _clipped(record: Record, channel: str, values: Array) -> list[Finding]:
    """Clipping; a warning where two planes of the record are whole without the channel."""
    pairs = zip(record.sensors, record.signals.T, strict=True)
    sound = [one for one, read in pairs if one.name != channel and not _limits(read)]
    nodes = {one.node for one in sound}
    whole = [n for n in nodes if sees_both_directions([one for one in sound if one.node == n])]
    for extreme, longest in list(_limits(values).items())[:1]:
        side, at = "lower" if extreme < np.median(values) else "upper", values == extreme
        said = {"side": side, "extreme": extreme, "longest": longest, "count": np.sum(at)}
        severe: Severity | None = "warning" if len(whole) > 1 else None
        return [found("clipped", said, channel=channel, time=record.time[np.argmax(at)], severity=severe)]
    return []


def _spikes(record: Record, channel: str, values: Array) -> list[Finding]:
    spikes, heights = _standing_out(values)
    if not len(spikes):
        return []
    at = float(record.time[spikes[0] + 1])
    return [found("spikes", channel=channel, time=at, count=len(spikes), size=np.max(heights))]


def _standing_out(values: Array) -> tuple[NDArray[np.intp], Array]:
    """Single samples off the line through their neighbours, which agree: places less one, and size [m]."""
    middle = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    limit = max(_SPIKE * SIGMA_OF_MEDIAN * float(np.median(middle)), _SPIKE_LEAST)
    spikes = np.flatnonzero((middle > limit) & (np.abs(values[2:] - values[:-2]) < 0.5 * middle))
    if len(spikes):  # the steps of a coarse converter are none
        spikes = spikes[middle[spikes] > _SPIKE_STEPS * _step_of(values)]
    return spikes, middle[spikes]


def _steps(record: Record, channel: str, values: Array) -> list[Finding]:
    """Steps from one sample to the next far beyond those of the motion."""
    step = np.abs(np.diff(values))
    limit = max(8.0 * float(np.percentile(step, 99.9)), _SPIKE_LEAST)
    steps = np.flatnonzero(step > limit)
    if len(steps):
        steps = steps[step[steps] > _SPIKE_STEPS * _step_of(values)]
    if not len(steps):
        return []
    at = float(record.time[steps[0] + 1])
    return [found("steps", channel=channel, time=at, count=len(steps), size=np.max(step))]


def _step_of(values: Array) -> float:
    """Usual distance between readings that differ [m]."""
    levels = np.unique(values[:: stride_of(len(values))])
    return float(np.median(np.diff(levels))) if len(levels) > 1 else 0.0


def _coarse(channel: str, values: Array) -> list[Finding]:
    step = _step_of(values)
    return (
        [found("coarse", channel=channel, step=step, count=len(np.unique(values)))]
        if step >= COARSE_STEP
        else []
    )
