"""The portable linear algebra against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from rotordrop.machine import example_machine
from rotordrop.physics import linear_algebra as own
from rotordrop.rotor.assembly import build_rotor_fe

SIZES = (1, 2, 3, 12, 60)


def drawn(*shape: int) -> np.ndarray:
    return np.random.default_rng(5).standard_normal(shape)


@pytest.mark.parametrize("n", SIZES)
def test_products_and_solutions(n: int) -> None:
    a, b = drawn(n, n), drawn(n, 3)
    assert own.product(a, b) == pytest.approx(a @ b, abs=1e-12)
    assert own.product(a, b[:, 0]) == pytest.approx(a @ b[:, 0], abs=1e-12)
    assert own.product(b[:, 0], a) == pytest.approx(b[:, 0] @ a, abs=1e-12)
    assert own.product(a.T, b) == pytest.approx(a.T @ b, abs=1e-12)
    assert own.solve(a, b) == pytest.approx(np.linalg.solve(a, b), rel=1e-10)
    assert own.solve(a, b[:, 0]) == pytest.approx(np.linalg.solve(a, b[:, 0]), rel=1e-10)


def test_a_zero_on_the_diagonal_is_no_obstacle_and_a_singular_matrix_is_named() -> None:
    a = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert own.solve(a, np.array([2.0, 3.0])) == pytest.approx([3.0, 2.0])
    assert np.array_equal(a, [[0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        own.solve(np.array([[1.0, 2.0], [2.0, 4.0]]), np.ones(2))


@pytest.mark.parametrize("n", SIZES)
def test_eigenvalues_and_vectors(n: int) -> None:
    a = drawn(n, n)
    a = a + a.T
    values, vectors = own.symmetric_eigen(a)
    scale = np.abs(values).max()
    assert values == pytest.approx(np.linalg.eigvalsh(a), abs=1e-13 * scale)
    assert a @ vectors == pytest.approx(vectors * values, abs=1e-13 * scale * n)
    assert vectors.T @ vectors == pytest.approx(np.eye(n), abs=1e-13)


def test_equal_eigenvalues_and_a_matrix_of_zeros() -> None:
    values, vectors = own.symmetric_eigen(np.eye(5))
    assert np.array_equal(values, np.ones(5))
    assert np.array_equal(np.abs(vectors), np.eye(5))
    assert np.array_equal(own.symmetric_eigen(np.zeros((4, 4)))[0], np.zeros(4))


def test_modes_of_a_rotor_are_those_of_lapack() -> None:
    fe = build_rotor_fe(example_machine("lp400"))
    values, vectors = own.generalised_eigen(fe.stiffness, fe.mass)
    expected, shapes = scipy.linalg.eigh(fe.stiffness, fe.mass)
    assert values == pytest.approx(expected, abs=1e-12 * expected[-1])
    assert vectors.T @ fe.mass @ vectors == pytest.approx(np.eye(fe.size), abs=1e-12)
    residual = fe.stiffness @ vectors - fe.mass @ vectors * values
    largest = np.linalg.norm(fe.stiffness) * np.linalg.norm(vectors, axis=0)
    assert np.all(np.linalg.norm(residual, axis=0) < 1e-12 * largest)
    # the frequencies of bending share what rounding leaves of the highest eigenvalue
    assert np.sqrt(values[2:]) == pytest.approx(np.sqrt(expected[2:]), rel=1e-9)
    signs = np.sign(np.sum(vectors * (fe.mass @ shapes), axis=0))
    assert signs[2:] * vectors[:, 2:] == pytest.approx(shapes[:, 2:], abs=1e-9 * np.abs(shapes).max())


def test_a_matrix_without_inertia_is_not_definite() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="positive definite"):
        own.generalised_eigen(np.eye(2), np.diag([1.0, 0.0]))


@pytest.mark.parametrize("n", SIZES)
def test_least_squares_of_any_rank(n: int) -> None:
    tall, wide = drawn(n + 3, n), drawn(n, n + 3)
    for a in (tall, wide, np.hstack([tall, tall])):
        b = drawn(len(a), 2)
        assert own.least_squares(a, b) == pytest.approx(np.linalg.lstsq(a, b, rcond=None)[0], abs=1e-9)


def test_dependent_columns_are_dropped_and_the_given_ones_kept() -> None:
    columns = drawn(6, 3)
    columns = np.column_stack([columns, columns[:, 0] + columns[:, 1]])
    before = columns.copy()
    found = own.orthonormal(columns)
    assert found.shape == (6, 3)
    assert found.T @ found == pytest.approx(np.eye(3), abs=1e-14)
    assert found @ (found.T @ columns) == pytest.approx(columns, abs=1e-13)
    assert np.array_equal(columns, before)
