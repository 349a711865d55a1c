"""Deliberate mistakes in a recording, as they happen between sensor and file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import UsageError
from rotordrop.record.record import Record

Array = NDArray[np.float64]


def _inverted(record: Record) -> Array:
    signals = record.signals.copy()
    signals[:, 0] *= -1.0
    return signals


def _swapped_ends(record: Record) -> Array:
    nodes = [sensor.node for sensor in record.sensors]
    order = np.argsort([nodes[::-1].index(node) for node in nodes], kind="stable")
    return record.signals[:, order]


def _swapped_axes(record: Record) -> Array:
    columns = list(range(len(record.sensors)))
    first = [i for i in columns if record.sensors[i].node == record.sensors[0].node]
    for column, other in zip(first, first[::-1], strict=True):
        columns[column] = other
    return record.signals[:, columns]


def _wrong_unit(record: Record) -> Array:
    return record.signals * 25.4


def _clipped(record: Record) -> Array:
    limit = 0.6 * float(np.max(np.abs(record.signals)))
    return np.clip(record.signals, -limit, limit)


def _dead(record: Record) -> Array:
    signals = record.signals.copy()
    signals[:, -1] = signals[0, -1]
    return signals


def _missing(record: Record) -> Array:
    signals = record.signals.copy()
    signals[len(signals) // 2, 0] = np.nan
    return signals


FAULTS: dict[str, Callable[[Record], Array]] = {
    "inverted polarity": _inverted,
    "swapped ends": _swapped_ends,
    "swapped axes": _swapped_axes,
    "mil taken for micrometre": _wrong_unit,
    "clipping": _clipped,
    "dead channel": _dead,
    "missing sample": _missing,
}


def with_fault(record: Record, fault: str) -> Record:
    """The record with a deliberate mistake, by name from `FAULTS`; the first or last channel is hit."""
    if fault not in FAULTS:
        raise UsageError(f"unknown fault {fault!r}; choose one of {', '.join(map(repr, FAULTS))}")
    return replace(record, signals=np.ascontiguousarray(FAULTS[fault](record)))
