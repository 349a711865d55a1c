"""Fewer points for a figure without losing a peak."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array

DRAWN_BLOCKS = 900
"""Blocks a history is cut into; each keeps its extremes, so a figure 900 pixels wide loses nothing."""


def peak_indices(*signals: Array, blocks: int = DRAWN_BLOCKS) -> NDArray[np.int64]:
    """Choose samples to draw: the first, the last, and in every block the extremes of every signal.

    All of them where that would not save anything; the peaks of all signals stay.
    """
    count = len(signals[0])
    if count <= 2 * blocks * len(signals):
        return np.arange(count, dtype=np.int64)
    edges = np.linspace(0, count, blocks + 1).astype(np.int64)
    chosen: list[NDArray[np.int64]] = [np.array([0, count - 1], dtype=np.int64)]
    for signal in signals:
        chosen.append(block_extremes(np.where(np.isnan(signal), np.inf, signal), edges))
        chosen.append(block_extremes(np.where(np.isnan(signal), np.inf, -signal), edges))
    return np.unique(np.concatenate(chosen))


def block_extremes(values: Array, edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of the first smallest value of every block between two edges; no block is empty."""
    width = int(np.max(np.diff(edges)))
    index = edges[:-1, None] + np.arange(width)
    inside = index < edges[1:, None]
    block = np.where(inside, values[np.minimum(index, len(values) - 1)], np.inf)
    return np.asarray(edges[:-1] + np.argmin(block, axis=1), dtype=np.int64)


def block_envelope(
    lower: Array, upper: Array, blocks: int = DRAWN_BLOCKS
) -> tuple[NDArray[np.int64], Array, Array]:
    """Indices at which a thinned band is drawn, and its limits there, which contain the whole band."""
    count = len(lower)
    if count <= 2 * blocks:
        return np.arange(count, dtype=np.int64), lower, upper
    edges = np.linspace(0, count, blocks + 1).astype(np.int64)
    lowest = np.minimum.reduceat(lower, edges[:-1])
    highest = np.maximum.reduceat(upper, edges[:-1])
    return (edges[:-1] + edges[1:] - 1) // 2, np.asarray(lowest), np.asarray(highest)
