"""Deliberate mistakes in a recording, as they happen between sensor and file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.record.record import Record


def _swapped_axes(signals: Array, nodes: list[int]) -> Array:
    columns = list(range(len(nodes)))
    first = [i for i in columns if nodes[i] == nodes[0]]
    for column, other in zip(first, first[::-1], strict=True):
        columns[column] = other
    return signals[:, columns]


def _changed(signals: Array, where: tuple[Any, Any], value: Any) -> Array:
    signals = signals.copy()
    signals[where] = value
    return signals


EVERY = slice(None)
FAULTS: dict[str, Callable[[Array, list[int]], Array]] = {
    "inverted polarity": lambda s, nodes: _changed(s, (EVERY, 0), -s[:, 0]),
    "swapped ends": lambda s, nodes: s[:, np.argsort([nodes[::-1].index(n) for n in nodes], kind="stable")],
    "swapped axes": _swapped_axes,
    "mil taken for micrometre": lambda s, nodes: s * 25.4,
    "clipping": lambda s, nodes: np.clip(s, -0.6 * np.max(np.abs(s)), 0.6 * np.max(np.abs(s))),
    "dead channel": lambda s, nodes: _changed(s, (EVERY, -1), s[0, -1]),
    "missing sample": lambda s, nodes: _changed(s, (len(s) // 2, 0), np.nan),
}
"""What a mistake makes of the readings (N, S) [m] of sensors at these nodes."""


def with_fault(record: Record, fault: str) -> Record:
    """The record with a deliberate mistake, by name from `FAULTS`; the first or last channel is hit."""
    if fault not in FAULTS:
        raise UsageError(f"unknown fault {fault!r}; choose one of {', '.join(map(repr, FAULTS))}")
    nodes = [sensor.node for sensor in record.sensors]
    return replace(record, signals=np.ascontiguousarray(FAULTS[fault](record.signals, nodes)))
