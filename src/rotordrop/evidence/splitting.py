"""A record with several drops, cut into one record for each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.look.events import Drop, drops_of
from rotordrop.evidence.look.motion import Motion, motion_of
from rotordrop.record.record import Record
from rotordrop.record.recording import Array

LYING = 0.7
"""Share of the air gap below which a rotor that lay on its bearings is being lifted [1]."""


def split_drops(record: Record) -> tuple[Record, ...]:
    """Cut a record into its drops, each with the levitated part before it.

    A drop ends where the rotor is lifted off its bearings again; while it is lifted, no sample belongs to any
    drop. No sample is changed.

    Parameters
    ----------
    record : Record
        The record.

    Returns
    -------
    tuple of Record
        One record per drop, named ``..._drop1`` and so on; the record itself where it holds one drop only.

    Raises
    ------
    RecordError
        When nothing falls in the record.
    """
    motion = motion_of(record, gaps=(None,) * len(record.planes), angles_known=True)
    drops = drops_of(motion)
    if not drops:
        raise RecordError(f"{record.name}: the rotor does not fall from where it floated; there is no drop")
    if len(drops) == 1:
        return (record,)
    starts = [float(record.time[0]), *(_floats_again(motion, drop) for drop in drops[:-1])]
    return tuple(
        _cut(record, number, start, _lifted(motion, drop), len(drops))
        for number, (start, drop) in enumerate(zip(starts, drops, strict=True), start=1)
    )


def _floats_again(motion: Motion, drop: Drop) -> float:
    """When the rotor is back where it floated, the controller calm: the first sample of the next drop."""
    return float(motion.time[np.searchsorted(motion.time, drop.end) + 1])


def _lifted(motion: Motion, drop: Drop) -> float:
    """The last time the rotor lay on its bearings in a drop [s]."""
    if not drop.lifted:
        return drop.end
    inside = (motion.time >= drop.release) & (motion.time <= drop.end)
    lies = np.all([path.radius[inside] > LYING * path.gap for path in motion.paths], axis=0)
    at = np.flatnonzero(lies)
    return float(motion.time[inside][at[-1]]) if len(at) else drop.end


def _cut(record: Record, number: int, start: float, end: float, count: int) -> Record:
    part = record.window(start, end)
    path = record.path
    return replace(
        part,
        speed_time=_inside(record.speed_time, record.speed_time, start, end),
        speed_readings=_inside(record.speed_readings, record.speed_time, start, end),
        marks=_inside(record.marks, record.marks, start, end),
        path=None if path is None else path.with_name(f"{path.stem}_drop{number}{path.suffix}"),
        metadata={**record.metadata, "split_from": f"{record.name}, drop {number} of {count}"},
        notes=(*record.notes, f"drop {number} of {count} in {record.name}, {start:.6g} to {end:.6g} s"),
    )


def _inside(values: Array | None, time: Array | None, start: float, end: float) -> Array | None:
    """What was read between two times; where nothing was, the reading before them."""
    if values is None or time is None:
        return None
    chosen = np.flatnonzero((time >= start) & (time <= end))
    if not len(chosen):
        chosen = np.array([max(int(np.searchsorted(time, start)) - 1, 0)])
    return values[chosen]
