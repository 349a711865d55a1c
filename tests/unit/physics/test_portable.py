"""Portable functions: elementary ones against 60 digits, linear algebra against LAPACK."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
import scipy.linalg
from scipy import special

from rotordrop.machine import example_machine
from rotordrop.physics import elementary, hertz
from rotordrop.physics import linear_algebra as own
from rotordrop.rotor.assembly import build_rotor_fe

DIGITS = 60
COUNT = 400


def circle(x):
    """Sine and cosine by their series, after the angle was brought near zero by multiples of π/2."""
    quarter = Decimal(2) * arctangent(Decimal(1))
    count = int((x / quarter).to_integral_value())
    r = x - count * quarter
    sine = cosine = Decimal(0)
    term, k = Decimal(1), 0
    while abs(term) > Decimal(10) ** -(DIGITS + 5) or k < 4:
        if k % 2:
            sine += term if k % 4 == 1 else -term
        else:
            cosine += term if k % 4 == 0 else -term
        k += 1
        term *= r / k
    for _ in range(count % 4):
        sine, cosine = cosine, -sine
    return sine, cosine


def arctangent(x):
    """Arc tangent by its series, after the angle was halved five times."""
    for _ in range(5):
        x = x / (1 + (1 + x * x).sqrt())
    total, power, k = Decimal(0), x, 1
    while abs(power) > Decimal(10) ** -(DIGITS + 10):
        total += power / k if k % 4 == 1 else -power / k
        power *= x * x
        k += 2
    return 32 * total


def hyperbolic_tangent(x):
    grown = (2 * x).exp()
    return (grown - 1) / (grown + 1)


def units_off(value, exact):
    """Error in units of the last place."""
    return float(abs(Decimal(value) - exact) / Decimal(math.ulp(float(exact))))


def drawn(low, high):
    return np.random.default_rng(3).uniform(low, high, COUNT).tolist()


def powers_of_ten(low, high):
    return (10.0 ** np.random.default_rng(4).uniform(low, high, COUNT)).tolist()


CASES = {
    "exp, whole range": (elementary.exp, Decimal.exp, drawn(-700.0, 700.0)),
    "exp, tiny": (elementary.exp, Decimal.exp, powers_of_ten(-12.0, 0.0)),
    "exp, near zero": (elementary.exp, Decimal.exp, drawn(-1.0, 1.0)),
    "ln, whole range": (elementary.ln, Decimal.ln, powers_of_ten(-300.0, 300.0)),
    "ln, near one": (elementary.ln, Decimal.ln, drawn(0.5, 2.0)),
    "tanh": (elementary.tanh, hyperbolic_tangent, drawn(-21.0, 21.0)),
    "tanh, small": (elementary.tanh, hyperbolic_tangent, powers_of_ten(-8.0, 0.0)),
    "sin": (elementary.sin_each, lambda x: circle(x)[0], drawn(-20.0, 20.0)),
    "cos": (elementary.cos_each, lambda x: circle(x)[1], drawn(-20.0, 20.0)),
    "sin, many turns": (elementary.sin_each, lambda x: circle(x)[0], drawn(-1e8, 1e8)),
    "cos, many turns": (elementary.cos_each, lambda x: circle(x)[1], drawn(-1e8, 1e8)),
    "sin, near its zeros": (
        elementary.sin_each,
        lambda x: circle(x)[0],
        [math.pi * k for k in range(1, COUNT)],
    ),
    "cos, near its zeros": (
        elementary.cos_each,
        lambda x: circle(x)[1],
        [math.pi * (k + 0.5) for k in range(COUNT)],
    ),
    "atan": (elementary.atan, arctangent, drawn(-5.0, 5.0)),
    "atan, small": (elementary.atan, arctangent, powers_of_ten(-10.0, 0.0)),
    "atan, large": (elementary.atan, arctangent, powers_of_ten(0.0, 10.0)),
    "cube root": (elementary.cube_root, lambda x: (x.ln() / 3).exp(), powers_of_ten(-200.0, 200.0)),
}


@pytest.mark.parametrize("name", CASES)
def test_error_is_below_one_unit_in_the_last_place(name):
    function, exact, arguments = CASES[name]
    with localcontext() as context:
        context.prec = DIGITS
        worst = max(units_off(function(x), exact(Decimal(x))) for x in arguments)
    assert worst < 0.9


@pytest.mark.parametrize("exponent", [10.0 / 9.0, 0.9, 1.4, -0.2, 2.5, 16.0, -16.0, 1.0 / 3.0])
def test_a_power_is_below_one_unit_in_the_last_place(exponent):
    with localcontext() as context:
        context.prec = DIGITS
        worst = max(
            units_off(elementary.power(x, exponent), (Decimal(exponent) * Decimal(x).ln()).exp())
            for x in powers_of_ten(-14.0, 4.0) + drawn(0.9, 1.1)
        )
    assert worst < 0.6


def test_powers_are_products_and_arrays_are_entry_by_entry():
    for x in powers_of_ten(-12.0, 0.0):
        assert elementary.power(x, 1.5) == x * math.sqrt(x)
        assert elementary.power(x, 1.0) == x
        assert elementary.power(x, 2.0) == x * x
    x = np.array([[0.1, 0.2], [0.3, 0.4]])
    circle_at = elementary.sine_cosine
    alone = {"sin": lambda x: circle_at(x)[0], "cos": lambda x: circle_at(x)[1]}
    for name in ("exp", "ln", "sin", "cos", "cube_root"):
        one = alone.get(name) or getattr(elementary, name)
        assert np.array_equal(
            getattr(elementary, f"{name}_each")(x), [[one(0.1), one(0.2)], [one(0.3), one(0.4)]]
        )
    assert np.array_equal(elementary.magnitude(np.array([3.0]), np.array([4.0])), [5.0])


def test_the_angle_of_a_point_knows_its_quadrant():
    for angle in drawn(-3.14, 3.14):
        x, y = math.cos(angle), math.sin(angle)
        assert elementary.atan2(y, x) == pytest.approx(math.atan2(y, x), rel=1e-15)
        assert elementary.atan2(1e-3 * y, 1e-3 * x) == pytest.approx(angle, rel=1e-14)
    for y, x in ((0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (0.0, 0.0)):
        assert elementary.atan2(y, x) == math.atan2(y, x)


@pytest.mark.parametrize(
    ("name", "x", "value", "rel"),
    [
        *(
            ("exp", x, y, 0.0)
            for x, y in ((0.0, 1.0), (710.0, math.inf), (-746.0, 0.0), (-745.0, math.exp(-745.0)))
        ),
        *(("ln", x, y, 0.0) for x, y in ((0.0, -math.inf), (1.0, 0.0), (5e-324, math.log(5e-324)))),
        *(("tanh", x, y, 0.0) for x, y in ((0.0, 0.0), (40.0, 1.0), (-40.0, -1.0))),
        *(("cube_root", x, y, 0.0) for x, y in ((-27.0, -3.0), (0.0, 0.0))),
        ("exp", 709.7, math.exp(709.7), 1e-15),
        ("cube_root", 1e-310, np.cbrt(1e-310), 1e-12),
    ],
)
def test_ends_of_the_ranges(name, x, value, rel):
    assert getattr(elementary, name)(x) == pytest.approx(value, rel=rel, abs=0.0)


def test_powers_at_the_ends_of_the_ranges():
    ends = {(0.0, 1.2): 0.0, (3.0, 0.0): 1.0, (1.0, 1.2): 1.0, (1e300, 1.2): math.inf, (1e-300, 1.2): 0.0}
    assert {given: elementary.power(*given) for given in ends} == ends
    assert elementary.power(1e-310, 0.5) == pytest.approx(1e-155, rel=1e-13)
    assert elementary.power(1e-160, 1.95) == pytest.approx(1e-312, rel=1e-10)


@pytest.mark.parametrize("name", ["exp", "ln", "tanh", "sin_each", "cos_each", "atan", "cube_root"])
def test_not_a_number_stays_so(name):
    assert math.isnan(getattr(elementary, name)(math.nan))
    assert math.isnan(elementary.power(math.nan, 1.2))
    assert math.isnan(elementary.power(-1.0, 1.2))


def test_elliptic_integrals_are_those_of_the_library():
    q = np.concatenate([10.0 ** np.linspace(-5.0, 0.0, 50), [1.0 - 1e-9]])
    assert hertz.complete_second(q) == pytest.approx(special.ellipe(1.0 - q), rel=3e-15)
    assert hertz.carlson_d(q, 1.0) == pytest.approx(special.elliprd(0.0, q, 1.0), rel=2e-15)
    assert hertz.carlson_d(1.0, q) == pytest.approx(special.elliprd(0.0, 1.0, q), rel=2e-15)


SIZES = (1, 2, 3, 12, 60)


def drawn_matrix(*shape):
    return np.random.default_rng(5).standard_normal(shape)


@pytest.mark.parametrize("n", SIZES)
def test_products_and_solutions(n):
    a, b = drawn_matrix(n, n), drawn_matrix(n, 3)
    assert own.product(a, b) == pytest.approx(a @ b, abs=1e-12)
    assert own.product(a, b[:, 0]) == pytest.approx(a @ b[:, 0], abs=1e-12)
    assert own.product(b[:, 0], a) == pytest.approx(b[:, 0] @ a, abs=1e-12)
    assert own.product(a.T, b) == pytest.approx(a.T @ b, abs=1e-12)
    assert own.solve(a, b) == pytest.approx(np.linalg.solve(a, b), rel=1e-10)
    assert own.solve(a, b[:, 0]) == pytest.approx(np.linalg.solve(a, b[:, 0]), rel=1e-10)


def test_a_zero_on_the_diagonal_equal_eigenvalues_and_singular_matrices():
    a = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert own.solve(a, np.array([2.0, 3.0])) == pytest.approx([3.0, 2.0])
    assert np.array_equal(a, [[0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        own.solve(np.array([[1.0, 2.0], [2.0, 4.0]]), np.ones(2))
    values, vectors = own.symmetric_eigen(np.eye(5))
    assert np.array_equal(values, np.ones(5))
    assert np.array_equal(np.abs(vectors), np.eye(5))
    assert np.array_equal(own.symmetric_eigen(np.zeros((4, 4)))[0], np.zeros(4))
    with pytest.raises(np.linalg.LinAlgError, match="positive definite"):
        own.generalised_eigen(np.eye(2), np.diag([1.0, 0.0]))


@pytest.mark.parametrize("n", SIZES)
def test_eigenvalues_and_vectors(n):
    a = drawn_matrix(n, n)
    a = a + a.T
    values, vectors = own.symmetric_eigen(a)
    scale = np.abs(values).max()
    assert values == pytest.approx(np.linalg.eigvalsh(a), abs=1e-13 * scale)
    assert a @ vectors == pytest.approx(vectors * values, abs=1e-13 * scale * n)
    assert vectors.T @ vectors == pytest.approx(np.eye(n), abs=1e-13)


def test_modes_of_a_rotor_are_those_of_lapack():
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


@pytest.mark.parametrize("n", SIZES)
def test_least_squares_of_any_rank(n):
    tall, wide = drawn_matrix(n + 3, n), drawn_matrix(n, n + 3)
    for a in (tall, wide, np.hstack([tall, tall])):
        b = drawn_matrix(len(a), 2)
        assert own.least_squares(a, b) == pytest.approx(np.linalg.lstsq(a, b, rcond=None)[0], abs=1e-9)


def test_dependent_columns_are_dropped_and_the_given_ones_kept():
    columns = drawn_matrix(6, 3)
    columns = np.column_stack([columns, columns[:, 0] + columns[:, 1]])
    before = columns.copy()
    found = own.orthonormal(columns)
    assert found.shape == (6, 3)
    assert found.T @ found == pytest.approx(np.eye(3), abs=1e-14)
    assert found @ (found.T @ columns) == pytest.approx(columns, abs=1e-13)
    assert np.array_equal(columns, before)
