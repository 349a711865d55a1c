"""Linear algebra for a few hundred unknowns, with the same bits on every processor.

BLAS and LAPACK choose their kernels by the processor: sums come in another order and with other
roundings, so the modes of one rotor differ in their last digits from machine to machine, and after some
impacts the drops do. What stands between a machine file and the time loop is small enough to be solved by
plain loops, whose order of operations is fixed. Everything else (fits, filters, spectra) keeps the
libraries. The loops run over single numbers, for expressions of whole arrays compile far slower.
"""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel, kernel, lean_kernel

_MOST_SWEEPS = 60
_EPSILON = 2.220446049250313e-16


def product(a: Array, b: Array) -> Array:
    """Matrix product [any unit], also with vectors, summed in the order of the inner index.

    Source: definition.
    """
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    left = a[None, :] if a.ndim == 1 else a
    right = b[:, None] if b.ndim == 1 else b
    whole = _product(np.ascontiguousarray(left), np.ascontiguousarray(right))
    return np.asarray(whole.reshape(a.shape[:-1] + b.shape[1:]))


def solve(a: Array, b: Array) -> Array:
    """Solution of ``a x = b`` for a square matrix (n, n) and right sides (n,) or (n, k) [any unit].

    Source: Gaussian elimination with row exchanges; Golub and Van Loan, Matrix Computations, section 3.4.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular.
    """
    b = np.asarray(b, dtype=np.float64)
    right = b[:, None] if b.ndim == 1 else b
    x, regular = _eliminated(np.array(a, dtype=np.float64), np.array(right, dtype=np.float64))
    if not regular:
        raise np.linalg.LinAlgError("the matrix is singular")
    return np.asarray(x.reshape(b.shape))


def least_squares(a: Array, b: Array) -> Array:
    """The shortest x (n, k) [any unit] of those nearest to ``a x = b``, for a matrix (m, n) of any rank.

    Source: complete orthogonal decomposition; Golub and Van Loan, section 5.5.
    """
    a = np.asarray(a, dtype=np.float64)
    columns = orthonormal(a)
    reduced = product(columns.T, a)
    rows = orthonormal(reduced.T)
    return product(rows, solve(product(reduced, rows), product(columns.T, b)))


def orthonormal(columns: Array, dependent: float = 1e-12) -> Array:
    """Orthonormal columns (n, r) that span the same space, in the given order [1].

    A column of which less than the share ``dependent`` is left by those before it is dropped.
    Source: Gram and Schmidt, twice; Golub and Van Loan, section 5.2.
    """
    kept, count = _orthonormal(np.array(columns.T, dtype=np.float64, order="C"), dependent)
    return np.asarray(kept[:count].T)


def symmetric_eigen(a: Array) -> tuple[Array, Array]:
    """Eigenvalues (n,), lowest first, and eigenvectors (n, n) in columns of a symmetric matrix [its unit, 1].

    Source: Householder's reduction to three diagonals and implicit QL; Bowdler, Martin, Reinsch and
    Wilkinson, Numer. Math. 11 (1968) 293.
    """
    values, rows = _ql(*_tridiagonal(np.array(a, dtype=np.float64)))
    order = np.argsort(values, kind="stable")
    return values[order], np.ascontiguousarray(rows[order].T)


def generalised_eigen(a: Array, b: Array) -> tuple[Array, Array]:
    """Eigenvalues and eigenvectors X of ``a x = λ b x``, b positive definite, ``Xᵀ b X = 1`` [any unit].

    Source: reduction by Cholesky's factor; Golub and Van Loan, section 8.7.

    Raises
    ------
    numpy.linalg.LinAlgError
        If b is not positive definite.
    """
    lower, definite = _cholesky(np.ascontiguousarray(b, dtype=np.float64))
    if not definite:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    half = _forward(lower, np.array(a, dtype=np.float64))
    reduced = _forward(lower, np.ascontiguousarray(half.T))
    values, vectors = symmetric_eigen(0.5 * (reduced + reduced.T))
    return values, _backward(lower, vectors)


@kernel
def _product(a: Array, b: Array) -> Array:
    out = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            factor = a[i, k]
            if factor != 0.0:
                for j in range(b.shape[1]):
                    out[i, j] += factor * b[k, j]
    return out


@kernel
def _eliminated(a: Array, b: Array) -> tuple[Array, bool]:
    n = a.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > 0.0:
            return b, False
        if best != k:
            _exchange(a[k], a[best])
            _exchange(b[k], b[best])
        for i in range(k + 1, n):
            if a[i, k] != 0.0:
                factor = a[i, k] / a[k, k]
                _subtract(a[i, k:], factor, a[k, k:])
                _subtract(b[i], factor, b[k])
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            _subtract(b[i], a[i, k], b[k])
        _divide(b[i], a[i, i])
    return b, True


@kernel
def _orthonormal(rows: Array, dependent: float) -> tuple[Array, int]:
    count = 0
    for i in range(rows.shape[0]):
        row = rows[i]
        before = math.sqrt(_dot(row, row))
        for _ in range(2):
            for j in range(count):
                _subtract(row, _dot(rows[j], row), rows[j])
        left = math.sqrt(_dot(row, row))
        if left > dependent * before:
            for j in range(rows.shape[1]):
                rows[count, j] = row[j] / left
            count += 1
    return rows, count


@inner_kernel
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@inner_kernel
def _subtract(row: Array, factor: float, other: Array) -> None:
    for j in range(row.shape[0]):
        row[j] -= factor * other[j]


@inner_kernel
def _exchange(row: Array, other: Array) -> None:
    for j in range(row.shape[0]):
        row[j], other[j] = other[j], row[j]


@inner_kernel
def _divide(row: Array, by: float) -> None:
    for j in range(row.shape[0]):
        row[j] /= by


@kernel
def _cholesky(a: Array) -> tuple[Array, bool]:
    n = a.shape[0]
    lower = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            left = a[i, j] - _dot(lower[i, :j], lower[j, :j])
            if j < i:
                lower[i, j] = left / lower[j, j]
            elif left > 0.0:
                lower[i, i] = math.sqrt(left)
            else:
                return lower, False
    return lower, True


@kernel
def _forward(lower: Array, b: Array) -> Array:
    for i in range(lower.shape[0]):
        for k in range(i):
            if lower[i, k] != 0.0:
                _subtract(b[i], lower[i, k], b[k])
        _divide(b[i], lower[i, i])
    return b


@kernel
def _backward(lower: Array, b: Array) -> Array:
    for i in range(lower.shape[0] - 1, -1, -1):
        _divide(b[i], lower[i, i])
        for k in range(i):
            if lower[i, k] != 0.0:
                _subtract(b[k], lower[i, k], b[i])
    return b


@kernel
def _tridiagonal(a: Array) -> tuple[Array, Array, Array]:
    """Diagonal (n,), the diagonal beside it (n,) and the rows of the transformation (n, n)."""
    n = a.shape[0]
    beside = np.zeros(n)
    mirrors = np.zeros((n, n))
    weights = np.zeros(n)
    for k in range(n - 1):
        mirror = np.empty(n - k - 1)
        for i in range(n - k - 1):
            mirror[i] = a[k + 1 + i, k]
        size = math.sqrt(_dot(mirror, mirror))
        if k == n - 2 or size == abs(mirror[0]):
            beside[k] = mirror[0]
            continue
        beside[k] = -math.copysign(size, mirror[0])
        mirror[0] -= beside[k]
        weight = 2.0 / _dot(mirror, mirror)
        push = np.zeros(n - k - 1)
        for i in range(n - k - 1):
            _subtract(push, -mirror[i], a[k + 1 + i, k + 1 :])
        for j in range(n - k - 1):
            push[j] *= weight
        _subtract(push, 0.5 * weight * _dot(mirror, push), mirror)
        for i in range(n - k - 1):
            for j in range(n - k - 1):
                a[k + 1 + i, k + 1 + j] -= mirror[i] * push[j] + push[i] * mirror[j]
            mirrors[k, k + 1 + i] = mirror[i]
        weights[k] = weight
    diagonal = np.empty(n)
    for i in range(n):
        diagonal[i] = a[i, i]
    return diagonal, beside, _mirrored(mirrors, weights)


@kernel
def _mirrored(mirrors: Array, weights: Array) -> Array:
    n = weights.shape[0]
    rows = np.zeros((n, n))
    for i in range(n):
        rows[i, i] = 1.0
    for k in range(n - 3, -1, -1):
        if weights[k] > 0.0:
            mirror = mirrors[k, k + 1 :]
            for i in range(k + 1, n):
                _subtract(rows[i, k + 1 :], weights[k] * _dot(mirror, rows[i, k + 1 :]), mirror)
    return rows


@kernel
def _ql(diagonal: Array, beside: Array, rows: Array) -> tuple[Array, Array]:
    n = diagonal.shape[0]
    for low in range(n):
        for _ in range(_MOST_SWEEPS):
            high = low
            while high < n - 1 and abs(beside[high]) > _EPSILON * (
                abs(diagonal[high]) + abs(diagonal[high + 1])
            ):
                high += 1
            if high == low:
                break
            _sweep(low, high, diagonal, beside, rows)
    return diagonal, rows


@lean_kernel
def _sweep(low: int, high: int, diagonal: Array, beside: Array, rows: Array) -> None:
    """One implicit QL sweep of the block from ``low`` to ``high``."""
    g = (diagonal[low + 1] - diagonal[low]) / (2.0 * beside[low])
    r = math.sqrt(g * g + 1.0)
    g = diagonal[high] - diagonal[low] + beside[low] / (g + math.copysign(r, g))
    sine = cosine = 1.0
    shift = 0.0
    for i in range(high - 1, low - 1, -1):
        f = sine * beside[i]
        b = cosine * beside[i]
        r = math.sqrt(f * f + g * g)
        beside[i + 1] = r
        if r == 0.0:
            diagonal[i + 1] -= shift
            beside[high] = 0.0
            return
        sine = f / r
        cosine = g / r
        g = diagonal[i + 1] - shift
        r = (diagonal[i] - g) * sine + 2.0 * cosine * b
        shift = sine * r
        diagonal[i + 1] = g + shift
        g = cosine * r - b
        for j in range(rows.shape[1]):
            lower, upper = rows[i, j], rows[i + 1, j]
            rows[i + 1, j] = sine * lower + cosine * upper
            rows[i, j] = cosine * lower - sine * upper
    diagonal[low] -= shift
    beside[low] = g
    beside[high] = 0.0
