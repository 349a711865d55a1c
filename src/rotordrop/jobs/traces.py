"""Histories of any length on disk, of which a window is drawn from at most as many points as a figure shows.

A window is cut into as many stretches as the points allow, and of every stretch both extremes are sent, so
that a spike of one sample is seen at every zoom, and every point that is sent is a sample.
"""

from __future__ import annotations

import io
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.files import atomic_path

Indices = NDArray[np.int64]

MOST_POINTS = 4000
"""Samples of a window that are sent at once, at most; chosen, not measured."""

_ONE_HEAD = threading.Lock()
"""Numpy reads the head of an array file by ``ast.literal_eval``, which fails now and then in CPython 3.11
where two threads are in it at once (gh-106905)."""


@dataclass(frozen=True, kw_only=True)
class Traces:
    """Histories over one clock."""

    columns: tuple[str, ...]
    """Names."""
    time: Array
    """Time [s], rising, shape (N,)."""
    values: NDArray[np.float32]
    """Values in SI units, in single precision, shape (C, N)."""

    def chosen(self, names: tuple[str, ...]) -> list[int]:
        """Rows of the columns of these names."""
        missing = [name for name in names if name not in self.columns]
        if missing or not names:
            asked = repr(missing[0]) if missing else "without a name"
            raise UsageError(f"there is no column {asked}; there are {', '.join(self.columns)}")
        return [self.columns.index(name) for name in names]

    def window(self, rows: list[int], start: float, end: float, points: int = MOST_POINTS) -> Indices:
        """Samples that show a window [s]: all, or the extremes of as many stretches as there is room for.

        The extremes of the given columns count, up to ``points`` samples may be chosen. The sample before
        the window and the one after it belong to it, so that lines reach its edges.
        """
        first = max(int(np.searchsorted(self.time, start)) - 1, 0)
        last = min(int(np.searchsorted(self.time, end, side="right")) + 1, len(self.time))
        if last - first <= points:
            return np.arange(first, last, dtype=np.int64)
        stretches = max((points - 2) // (2 * len(rows)), 1)
        found = [first + extremes(self.values[row, first:last], stretches) for row in rows]
        return np.unique(np.concatenate([[first, last - 1], *found]))


def extremes(values: NDArray[np.float32], stretches: int) -> Indices:
    """Index of the smallest and of the largest value of every stretch; NaN is neither."""
    size = -(-len(values) // stretches)
    padded = np.full(size * stretches, np.nan, dtype=np.float32)
    padded[: len(values)] = values
    blocks = padded.reshape(stretches, size)
    missing = np.isnan(blocks)
    low = np.argmin(np.where(missing, np.inf, blocks), axis=1)
    high = np.argmax(np.where(missing, -np.inf, blocks), axis=1)
    found = (size * np.arange(stretches) + np.stack([low, high])).ravel()
    return np.asarray(found[found < len(values)], dtype=np.int64)


def write_traces(folder: Path, name: str, time: Array, columns: Mapping[str, Array]) -> None:
    """Write histories over one clock as plain array files."""
    values = np.stack([np.asarray(column, dtype=np.float32) for column in columns.values()])
    for part, array in (("time", np.asarray(time, dtype=np.float64)), ("values", values)):
        head = io.BytesIO()  # numpy's own way into a file drops the error of a full disk
        np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(array))
        with atomic_path(folder / f"{name}.{part}.npy") as place, place.open("wb") as stream:
            stream.write(head.getbuffer())
            stream.write(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)


def open_traces(folder: Path, name: str, columns: tuple[str, ...]) -> Traces:
    """Open histories that were written, without reading them: what a window needs comes from the disk."""
    with _ONE_HEAD:
        time, values = (
            np.load(folder / f"{name}.{part}.npy", mmap_mode="r", allow_pickle=False)
            for part in ("time", "values")
        )
    return Traces(columns=columns, time=time, values=values)


def sent(traces: Traces, rows: list[int], chosen: Indices) -> bytes:
    """Samples as they go to the page: start [s], their number, the number of columns, then single precision.

    Times count from the start of the window, so that single precision resolves every zoom.
    """
    start = float(traces.time[chosen[0]])
    head = (
        np.array([start], dtype="<f8").tobytes() + np.array([len(chosen), len(rows)], dtype="<u4").tobytes()
    )
    times = np.asarray(traces.time[chosen] - start, dtype="<f4")
    columns = [np.asarray(traces.values[row, chosen], dtype="<f4").tobytes() for row in rows]
    return b"".join((head, times.tobytes(), *columns))
