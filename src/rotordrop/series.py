"""Facts on evenly sampled series that several packages need: runs of a condition, noise beside the motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array

SIGMA_OF_MEDIAN = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution [1]."""
DRAWN_BLOCKS = 900
"""Blocks a history is cut into; each keeps its extremes, so a figure 900 pixels wide loses nothing."""

MANY = 1 << 18
"""Samples that show what many more show no better: noise, steps, how far a rotor strays (chosen)."""

PART = 1 << 16
"""Samples of a long record that are worked on at a time (chosen)."""


def stride_of(count: int) -> int:
    """Every how many-th of so many samples makes at most `MANY`."""
    return max(-(-count // MANY), 1)


def runs_of(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and lengths of the runs of true values, shape (R,) each, for a mask of shape (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2] - edges[::2]


def closed(mask: NDArray[np.bool_], gap: int) -> NDArray[np.bool_]:
    """A mask with its gaps shorter than so many samples filled: a morphological closing."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    filled = mask.copy()
    for end, begin in zip(edges[1:-1:2], edges[2::2], strict=True):
        if begin - end < gap:
            filled[end:begin] = True
    return filled


def in_parts(function: Callable[..., Array], values: Array, *arguments: Any, beside: int = 0) -> Array:
    """One number for each sample of a series (N, ...), shape (N,), in parts with so many neighbours."""
    found = np.empty(len(values))
    for first in range(0, len(values), PART):
        early = max(first - beside, 0)
        part = function(values[early : first + PART + beside], *arguments)
        found[first : first + PART] = part[first - early :][:PART]
    return found


def median_of_five(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median of each value and its two neighbours on either side, shape (N,); the ends count on beyond.

    A comparison network, in place of a library that takes half a second to load.
    """
    far, near, here, then, last = (np.pad(values, 2, mode="edge")[i : len(values) + i] for i in range(5))
    low = np.maximum(np.minimum(far, near), np.minimum(then, last))
    high = np.minimum(np.maximum(far, near), np.maximum(then, last))
    return np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), here))


def running_mean(values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Mean of every ``count`` neighbours along the first axis, shape (N − count + 1, ...)."""
    sums = np.zeros((len(values) + 1, *values.shape[1:]))
    np.cumsum(values, axis=0, out=sums[1:])
    mean: NDArray[np.float64] = sums[count:] - sums[:-count]
    mean /= count
    return mean


def curvature(values: NDArray[np.float64], rate: float, samples: int) -> NDArray[np.float64]:
    """Second derivative by a cubic through an odd number of samples around each, shape of the values.

    Along the first axis, at a rate [Hz]; 0 where the samples are not all there.
    """
    half = samples // 2
    weights = 2.0 * np.linalg.pinv(np.vander(np.arange(-half, half + 1) / rate, 4))[1]
    found = np.zeros(values.shape)
    flat, columns = found.reshape(len(values), -1), values.reshape(len(values), -1)
    for number, column in enumerate(columns.T if len(values) >= samples else ()):
        flat[half : len(values) - half, number] = np.convolve(column, weights, mode="valid")
    return found


def noise_by_differences(values: NDArray[np.float64], order: int) -> float:
    """Standard deviation of white noise on a smooth motion, in the unit of the values.

    Differences take the motion away; their median leaves the few large ones at contacts aside. The k-th
    difference of white noise has the variance ``C(2k, k) σ²``.

    Parameters
    ----------
    values : ndarray, shape (N, ...)
        Samples along the first axis; all columns have one noise. A difference over a missing one is left out.
    order : int
        How often differences are taken: a polynomial of a lower degree counts as motion.
    """
    difference = np.diff(values, order, axis=0)
    size = np.abs(difference, out=difference)
    return (
        SIGMA_OF_MEDIAN
        * float(np.nanmedian(size, overwrite_input=True))
        / math.sqrt(math.comb(2 * order, order))
    )


def peak_indices(*signals: NDArray[np.float64], blocks: int = DRAWN_BLOCKS) -> NDArray[np.int64]:
    """Choose samples to draw: the first, the last, and in every block the extremes of every signal.

    All of them where that would not save anything; the peaks of all signals stay.
    """
    count = len(signals[0])
    if count <= 2 * blocks * len(signals):
        return np.arange(count, dtype=np.int64)
    edges = np.linspace(0, count, blocks + 1).astype(np.int64)
    chosen = [0, count - 1]
    for signal in signals:
        for values in (signal, -signal):
            known = np.where(np.isnan(values), np.inf, values)
            chosen += [first + int(np.argmin(known[first:last])) for first, last in pairwise(edges.tolist())]
    return np.unique(np.array(chosen, dtype=np.int64))


def refined_peak(time: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, float]:
    """Peak of a sampled history and its time [s], by a parabola through the largest sample and its
    neighbours.

    Parameters
    ----------
    time : ndarray, shape (T,)
        Equidistant times [s].
    values : ndarray, shape (T,)
        History, for instance a force [N].
    """
    i = int(np.argmax(values))
    if i == 0 or i == len(values) - 1:
        return float(values[i]), float(time[i])
    left, middle, right = (float(values[j]) for j in (i - 1, i, i + 1))
    curvature = left - 2.0 * middle + right
    if curvature >= 0.0:
        return middle, float(time[i])
    shift = 0.5 * (left - right) / curvature
    return middle - 0.25 * (left - right) * shift, float(time[i] + shift * (time[i + 1] - time[i]))
