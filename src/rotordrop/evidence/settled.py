"""The rest at the end: a rotor at standstill on its touchdown bearings, swinging out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import UnsettledError
from rotordrop.record.recording import Array
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

STANDSTILL = 2 * np.pi * 0.5
"""Slower than this counts as standstill [rad/s]."""

MOST_SWING = 0.5
"""Peak-to-peak motion at rest, in nominal air gaps."""

_BLOCK = 0.1
_SHORTEST = 0.2


@dataclass(frozen=True, kw_only=True)
class SettledTail:
    """The part of a record in which the rotor rests on its touchdown bearings."""

    start: float
    end: float
    """Where it is, in record time [s]."""
    mean: Array
    """Mean readings [m]; a mean over a swing lies above the lowest point, take the arc into account, shape
    (S,)."""
    swing: Array
    """Peak-to-peak motion in x and y per sensor plane [m], shape (P, 2)."""


def settled_tail(record: Record, machine: Machine) -> SettledTail:
    """Find the last part of a record in which the shaft stands still and only swings.

    Parameters
    ----------
    record : Record
        A whole record, or one of the standstill alone, which needs no speed.
    machine : Machine
        The machine, for its nominal air gaps.

    Raises
    ------
    RecordError
        When the record does not reach standstill; says how fast or how far the shaft still moves.
    """
    start = _standstill_begins(record)
    gap = min(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    still = record.window(start, np.inf)
    path, time = still.whole.motion, still.time
    block = max(int(_BLOCK * record.sampling_rate), 4)
    count = len(time) // block
    quiet = 0
    while quiet < count and _swing(path[len(path) - (quiet + 1) * block :]).max() < MOST_SWING * gap:
        quiet += 1
    if quiet * block < _SHORTEST * record.sampling_rate:
        moves = format_quantity(float(_swing(path[-block:]).max()), "length")
        raise UnsettledError(
            record.name,
            f"does not reach standstill: the shaft still moves by {moves} peak to peak in the last "
            f"{_BLOCK:g} s, more than {MOST_SWING:.0%} of the nominal air gap of "
            f"{format_quantity(gap, 'length')}",
        )
    first = len(time) - quiet * block
    return SettledTail(
        start=float(time[first]),
        end=float(time[-1]),
        mean=np.mean(still.signals[first:], axis=0),
        swing=_swing(path[first:]),
    )


def resting_record(record: Record, tail: Record | None, machine: Machine) -> Record:
    """The settled part of a tail given, or of a record that reaches standstill.

    Raises
    ------
    RecordError
        When neither shows a rotor at rest.
    """
    if tail is None and record.measured_speed is None:
        raise UnsettledError(
            record.name,
            "has no measured shaft speed, so it cannot be seen where the rotor stands still",
        )
    source = record if tail is None else tail
    found = settled_tail(source, machine)
    return source.window(found.start, found.end)


def _standstill_begins(record: Record) -> float:
    """Time of the last speed reading above standstill [s]; the begin of a record without speed."""
    measured = record.measured_speed
    if measured is None:
        return float(record.time[0])
    speed_time, readings = measured
    turning = np.flatnonzero(np.abs(readings) > STANDSTILL)
    if not len(turning):
        return float(record.time[0])
    last = int(turning[-1])
    left = float(record.time[-1] - speed_time[last])
    if left < _SHORTEST:
        speed = format_quantity(float(abs(readings[last])), "speed")
        raise UnsettledError(
            record.name,
            f"does not reach standstill: the shaft still turns at {speed} at {speed_time[last]:.6g} s and "
            f"the record ends at {record.time[-1]:.6g} s",
        )
    return float(speed_time[last])


def _swing(path: Array) -> Array:
    return np.asarray(np.ptp(path, axis=0))
