"""Loops and products in place of expressions of whole arrays, which take ten times as long to compile.

Each product is compiled once for a kind of arrays; its bits are those of the expression. Covariance matrices
are symmetric, sound, stored by half.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.physics._compile import kernel, lean_kernel

Compact = NDArray[np.float32]
"""What is stored of covariances and transitions: seven digits of them are plenty."""

LARGEST_VARIANCE = 1e30
"""Beyond the square of every unknown in its SI unit: the cubic term of a stiff support is 1e11 1/m²."""
BLOCK = 16
"""Rows and columns taken together where a matrix meets its transpose, so that both stay in the cache."""


@lean_kernel
def fill(out: Any, value: float) -> None:
    """Set every entry of a vector."""
    for i in range(out.shape[0]):
        out[i] = value


@lean_kernel
def fill_rows(out: Any, value: float) -> None:
    """Set every entry of a matrix."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = value


@lean_kernel
def copy_into(source: Any, out: Any) -> None:
    """Copy a vector into the first entries of another, as many as the shorter one has."""
    for i in range(min(source.shape[0], out.shape[0])):
        out[i] = source[i]


@lean_kernel
def copy_rows(source: Any, out: Any) -> None:
    """Copy of a matrix what fits into another of as many rows."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = source[i, j]


@kernel
def multiply(a: Array, b: Array, out: Array) -> None:
    """Fill ``out`` with the product of two matrices; the second one may be transposed."""
    np.dot(a, b, out)


@kernel
def apply(a: Array, x: Array, out: Array) -> None:
    """Fill ``out`` with the product of a matrix and a vector."""
    np.dot(a, x, out)


@kernel
def inner(x: Array, y: Array) -> float:
    """Inner product of two vectors."""
    product: float = np.dot(x, y)
    return product


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
