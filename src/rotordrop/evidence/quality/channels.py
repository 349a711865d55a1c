"""Faults of single channels that show without knowing the machine: missing, clipped, dead, stuck."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.evidence.quality.rail import zeroed
from rotordrop.evidence.quality.recorder import bridged
from rotordrop.record.recording import Array
from rotordrop.series import runs_of
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.record.record import Record

DEAD_SHARE = 0.02
"""A channel that moves by less than this share of the median of the others is dead."""

CLIPPED_RUN = 5
"""Samples in a row at the very extreme of a channel that make clipping."""

COARSE_STEP = 1e-6
"""Quantisation coarser than this is worth a warning [m]."""

_STUCK_SAMPLES = 8
_SPIKE = 12.0
_SPIKE_LEAST = 5e-6
_SPIKE_STEPS = 2.5
"""A spike is higher than this many steps of the converter [1]."""


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
        findings += [found for check in checks if (found := check(record, sensor.name, values)) is not None]
    return findings


def _range(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _missing(record: Record, channel: str, values: Array) -> list[Finding]:
    bad = np.flatnonzero(~np.isfinite(values))
    if not len(bad):
        return []
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


def _stuck(record: Record, channel: str, values: Array) -> Finding | None:
    starts, lengths = runs_of(np.diff(values) == 0)
    if not len(lengths):
        return None
    longest = int(np.argmax(lengths))
    count = int(lengths[longest]) + 1
    others = np.append(np.delete(lengths, longest), 0)  # coarse steps make runs everywhere
    usual = int(np.percentile(others, 99.9, method="lower")) + 1
    if count < max(_STUCK_SAMPLES, 4 * usual):
        return None
    if values[starts[longest]] in (np.min(values), np.max(values)):
        return None  # flat at the extreme is clipping, which is looked for by itself
    at = float(record.time[starts[longest]])
    held = format_quantity(float(values[starts[longest]]), "length")
    return Finding(
        kind=Kind.STUCK_CHANNEL,
        message=f"{count} samples ({count / record.sampling_rate * 1e3:.3g} ms) read exactly {held} from "
        f"{at:.6g} s on",
        remedy="check the recorder's input, then record again",
        severity="stop",
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
    middle = values[1:-1] - 0.5 * (values[:-2] + values[2:])
    usual = 1.4826 * float(np.median(np.abs(middle)))
    limit = max(_SPIKE * usual, _SPIKE_LEAST)
    across = np.abs(values[2:] - values[:-2])
    spikes = np.flatnonzero((np.abs(middle) > limit) & (across < 0.5 * np.abs(middle)))
    if len(spikes):  # the steps of a coarse converter are none
        spikes = spikes[np.abs(middle[spikes]) > _SPIKE_STEPS * _step_of(values)]
    if not len(spikes):
        return _steps(record, channel, values)
    at = float(record.time[spikes[0] + 1])
    size = format_quantity(float(np.max(np.abs(middle[spikes]))), "length")
    return Finding(
        kind=Kind.SPIKES,
        message=f"{len(spikes)} single samples stand out by up to {size}, the first at {at:.6g} s",
        remedy="look for loose contacts or switching noise; single spikes pull every fit",
        severity="warning",
        channel=channel,
        time=at,
    )


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
