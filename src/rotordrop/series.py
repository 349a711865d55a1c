"""Facts on evenly sampled series that several packages need: runs of a condition, noise beside the motion."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

SIGMA_OF_MEDIAN = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution [1]."""


def runs_of(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and lengths of the runs of true values, shape (R,) each, for a mask of shape (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2] - edges[::2]


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
    return SIGMA_OF_MEDIAN * float(np.nanmedian(np.abs(difference))) / math.sqrt(math.comb(2 * order, order))


def local_polynomials(
    values: NDArray[np.float64], samples: int, order: int, *, derivative: int = 0, spacing: float = 1.0
) -> NDArray[np.float64]:
    """Value or derivative of the polynomial through the samples around each one, shape of ``values``.

    Source: Savitzky & Golay, Anal. Chem. 36 (1964). That of ``scipy.signal`` is the same; with that package
    come the distributions of ``scipy.stats``, and half of a second and 25 MB with them.

    Parameters
    ----------
    values : ndarray, shape (N, ...)
        Samples along the first axis, at least ``samples``.
    samples : int
        Samples of a polynomial, an odd number; the first and the last one serve all samples at the ends.
    order, derivative : int
        Degree of the polynomial; which derivative, 0 for the value.
    spacing : float
        Distance between samples.
    """
    from scipy.linalg import lstsq
    from scipy.ndimage import convolve1d

    half = samples // 2
    powers = np.arange(half, -half - 1, -1.0) ** np.arange(order + 1)[:, None]
    wanted = np.zeros(order + 1)
    wanted[derivative] = math.factorial(derivative) / spacing**derivative
    found = np.asarray(convolve1d(values, lstsq(powers, wanted)[0], axis=0, mode="constant"))
    at = np.arange(float(samples))
    for inside, shown in ((slice(0, samples), slice(0, half)), (slice(-samples, None), slice(-half, None))):
        edge = np.polyfit(at, values[inside].reshape(samples, -1), order)
        for _ in range(derivative):
            edge = edge[:-1] * np.arange(len(edge) - 1, 0, -1)[:, None]
        ends = np.polyval(edge, at[shown][:, None]) / spacing**derivative
        found[shown] = ends.reshape(half, *values.shape[1:])
    return found
