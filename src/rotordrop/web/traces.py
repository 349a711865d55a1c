"""Histories of any length on disk, of which a window is drawn from at most as many points as a figure shows.

Beside the samples lie levels of indices: for every block of 8, 64, 512, ... samples the place of its
smallest and of its largest value. A window is cut into as many stretches as the points allow, and of every
stretch both extremes are sent, so that a spike of one sample is seen at every zoom, and every point that is
sent is a sample.
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
from rotordrop.report.decimation import block_extremes

Indices = NDArray[np.int64]

FACTOR = 8
"""Blocks of a level that make one of the next; chosen, not measured."""

MOST_POINTS = 4000
FEWEST_POINTS = 100
"""Samples of a window that are sent at once, at most and at least; chosen, not measured."""
MOST_COLUMNS = 12
"""Columns that are sent at once, more than a figure shows; chosen, not measured."""

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
    levels: NDArray[np.int32]
    """Index of the smallest and of the largest sample of every block, level after level, shape (C, B, 2)."""

    def chosen(self, names: tuple[str, ...]) -> list[int]:
        """Rows of the columns of these names."""
        if not 1 <= len(names) <= MOST_COLUMNS:
            raise UsageError(f"{len(names)} columns asked for; 1 to {MOST_COLUMNS} are sent at once")
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise UsageError(f"there is no column {missing[0]!r}; there are {', '.join(self.columns)}")
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
        stretches = max((points - 2 - 4 * len(rows)) // (2 * len(rows)), 1)
        size, offset = 1, 0
        for level_size, level_offset, _ in levels_of(len(self.time)):
            if level_size <= (last - first) / stretches:  # the coarsest level no wider than a stretch
                size, offset = level_size, level_offset
        if size == 1:
            edges = np.linspace(first, last, stretches + 1).astype(np.int64)
            found = [first + extremes(self._read(row, slice(first, last)), edges - first) for row in rows]
        else:
            found = [self._from_level(row, first, last, size, offset, stretches) for row in rows]
        return np.unique(np.concatenate([[first, last - 1], *(places.ravel() for places in found)]))

    def between(self, rows: list[int], start: float, end: float) -> dict[str, float | None]:
        """Mean over time, smallest and largest of every sample between two instants [s].

        One row is a history, two are the x and y of a radius.
        """
        first = int(np.searchsorted(self.time, start))
        last = int(np.searchsorted(self.time, end, side="right"))
        read = [self._read(row, slice(first, last)) for row in rows]
        values = np.hypot(*read) if len(read) > 1 else read[0]
        time = np.asarray(self.time[first:last])
        known = np.isfinite(values)
        time, values = time[known], values[known]
        if not len(values):
            return {"mean": None, "least": None, "largest": None}
        lasted = float(time[-1] - time[0])
        area = np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(time))
        mean = area / lasted if lasted > 0.0 else values[0]
        return {"mean": float(mean), "least": float(values.min()), "largest": float(values.max())}

    def _from_level(self, row: int, first: int, last: int, size: int, offset: int, stretches: int) -> Indices:
        """Extremes of the stretches by the blocks inside the window; its ragged ends sample by sample.

        A block that reaches beyond the window must not be used: its extreme may lie outside and hide a
        smaller spike inside.
        """
        begin, stop = -(-first // size), last // size
        ends = [
            (a + extremes(self._read(row, slice(a, b)), np.array([0, b - a]))).ravel()
            for a, b in ((first, begin * size), (stop * size, last))
            if b > a
        ]
        places = self.levels[row, offset + begin : offset + stop].astype(np.int64)
        edges = np.unique(np.linspace(0, len(places), stretches + 1).astype(np.int64))
        low, high = self._read(row, places[:, 0]), self._read(row, places[:, 1])
        inside = [
            places[block_extremes(np.nan_to_num(low, nan=np.inf), edges), 0],
            places[block_extremes(np.nan_to_num(-high, nan=np.inf), edges), 1],
        ]
        return np.concatenate([*ends, *inside])

    def _read(self, row: int, where: slice | Indices) -> Array:
        return np.asarray(self.values[row, where], dtype=np.float64)


def extremes(values: Array, edges: Indices) -> Indices:
    """Index of the smallest and the largest value of every block, shape (blocks, 2); NaN is neither."""
    low = block_extremes(np.where(np.isnan(values), np.inf, values), edges)
    high = block_extremes(np.where(np.isnan(values), np.inf, -values), edges)
    return np.stack([low, high], axis=1)


def levels_of(count: int) -> list[tuple[int, int, int]]:
    """Whole blocks of all levels over a number of samples: samples in a block, first place, number."""
    levels, offset, size = [], 0, FACTOR
    while count // size > 1:
        levels.append((size, offset, count // size))
        offset, size = offset + count // size, size * FACTOR
    return levels


def write_traces(folder: Path, name: str, time: Array, columns: Mapping[str, Array]) -> None:
    """Write histories over one clock with their levels, as plain array files."""
    values = np.stack([np.asarray(column, dtype=np.float32) for column in columns.values()])
    levels = np.stack([extremes_of_blocks(row) for row in values])
    for part, array in (("time", np.asarray(time, dtype=np.float64)), ("values", values), ("levels", levels)):
        head = io.BytesIO()  # numpy's own way into a file drops the error of a full disk
        np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(array))
        with atomic_path(folder / f"{name}.{part}.npy") as place, place.open("wb") as stream:
            stream.write(head.getbuffer())
            stream.write(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)


def extremes_of_blocks(values: NDArray[np.float32]) -> NDArray[np.int32]:
    """Index of the smallest and the largest value of every block of all levels (N,), shape (B, 2)."""
    low = np.where(np.isnan(values), np.inf, values)
    high = np.where(np.isnan(values), -np.inf, values)
    place_low = place_high = np.arange(len(values), dtype=np.int32)
    levels = [np.empty((0, 2), dtype=np.int32)]
    for _, _, count in levels_of(len(values)):
        rows = np.arange(count)
        low, high = (one[: count * FACTOR].reshape(count, FACTOR) for one in (low, high))
        at_low, at_high = np.argmin(low, axis=1), np.argmax(high, axis=1)
        place_low = place_low[: count * FACTOR].reshape(count, FACTOR)[rows, at_low]
        place_high = place_high[: count * FACTOR].reshape(count, FACTOR)[rows, at_high]
        low, high = low[rows, at_low], high[rows, at_high]
        levels.append(np.stack([place_low, place_high], axis=1))
    return np.concatenate(levels)


def open_traces(folder: Path, name: str, columns: tuple[str, ...]) -> Traces:
    """Open histories that were written, without reading them: what a window needs comes from the disk."""
    with _ONE_HEAD:
        parts = [
            np.load(folder / f"{name}.{part}.npy", mmap_mode="r", allow_pickle=False)
            for part in ("time", "values", "levels")
        ]
    return Traces(columns=columns, time=parts[0], values=parts[1], levels=parts[2])


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
