"""Covariance matrices of a pass: symmetric, sound, stored by half."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.physics._compile import lean_kernel

Compact = NDArray[np.float32]

LARGEST_VARIANCE = 1e30
"""Beyond the square of every unknown in its SI unit: the cubic term of a stiff support is 1e11 1/m²."""


BLOCK = 16
"""Rows and columns taken together where a matrix meets its transpose, so that both stay in the cache."""


@lean_kernel
def symmetrise(P: Array, n: int) -> None:
    """Replace the first ``n`` rows and columns of a matrix by their symmetric part in place."""
    for top in range(0, n, BLOCK):
        for left in range(0, top + 1, BLOCK):
            for i in range(top, min(top + BLOCK, n)):
                for j in range(left, min(left + BLOCK, i)):
                    value = 0.5 * (P[i, j] + P[j, i])
                    P[i, j] = value
                    P[j, i] = value


@lean_kernel
def pack(P: Array, out: Compact) -> None:
    """Store the lower half of a symmetric matrix (n, n) row by row in ``out`` (n (n + 1) / 2,)."""
    e = 0
    for i in range(P.shape[0]):
        for j in range(i + 1):
            out[e] = P[i, j]
            e += 1


@lean_kernel
def unpack(packed: Compact, P: Array) -> None:
    """Fill a symmetric matrix (n, n) from what `pack` stored."""
    e = 0
    for i in range(P.shape[0]):
        for j in range(i + 1):
            P[i, j] = packed[e]
            P[j, i] = packed[e]
            e += 1


@lean_kernel
def is_covariance(P: Array) -> bool:
    """Whether all variances are finite and none is negative; what fails was a filter that diverged."""
    good = True
    for i in range(P.shape[0]):
        good = good and P[i, i] >= 0.0 and P[i, i] < LARGEST_VARIANCE
    return good
