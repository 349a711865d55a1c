"""The portable elementary functions against 60 digits, and what they must do at the ends of their ranges."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy import special

from rotordrop.physics import elementary, elliptic

DIGITS = 60
COUNT = 400


def circle(x: Decimal) -> tuple[Decimal, Decimal]:
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


def arctangent(x: Decimal) -> Decimal:
    """Arc tangent by its series, after the angle was halved five times."""
    for _ in range(5):
        x = x / (1 + (1 + x * x).sqrt())
    total, power, k = Decimal(0), x, 1
    while abs(power) > Decimal(10) ** -(DIGITS + 10):
        total += power / k if k % 4 == 1 else -power / k
        power *= x * x
        k += 2
    return 32 * total


def hyperbolic_tangent(x: Decimal) -> Decimal:
    grown = (2 * x).exp()
    return (grown - 1) / (grown + 1)


def units_off(value: float, exact: Decimal) -> float:
    """Error in units of the last place."""
    return float(abs(Decimal(value) - exact) / Decimal(math.ulp(float(exact))))


def drawn(low: float, high: float) -> list[float]:
    return np.random.default_rng(3).uniform(low, high, COUNT).tolist()


def powers_of_ten(low: float, high: float) -> list[float]:
    return (10.0 ** np.random.default_rng(4).uniform(low, high, COUNT)).tolist()


CASES: dict[str, tuple[Callable[[float], float], Callable[[Decimal], Decimal], list[float]]] = {
    "exp, whole range": (elementary.exp, Decimal.exp, drawn(-700.0, 700.0)),
    "exp, tiny": (elementary.exp, Decimal.exp, powers_of_ten(-12.0, 0.0)),
    "exp, near zero": (elementary.exp, Decimal.exp, drawn(-1.0, 1.0)),
    "ln, whole range": (elementary.ln, Decimal.ln, powers_of_ten(-300.0, 300.0)),
    "ln, near one": (elementary.ln, Decimal.ln, drawn(0.5, 2.0)),
    "tanh": (elementary.tanh, hyperbolic_tangent, drawn(-21.0, 21.0)),
    "tanh, small": (elementary.tanh, hyperbolic_tangent, powers_of_ten(-8.0, 0.0)),
    "sin": (elementary.sin, lambda x: circle(x)[0], drawn(-20.0, 20.0)),
    "cos": (elementary.cos, lambda x: circle(x)[1], drawn(-20.0, 20.0)),
    "sin, many turns": (elementary.sin, lambda x: circle(x)[0], drawn(-1e8, 1e8)),
    "cos, many turns": (elementary.cos, lambda x: circle(x)[1], drawn(-1e8, 1e8)),
    "sin, near its zeros": (elementary.sin, lambda x: circle(x)[0], [math.pi * k for k in range(1, COUNT)]),
    "cos, near its zeros": (
        elementary.cos,
        lambda x: circle(x)[1],
        [math.pi * (k + 0.5) for k in range(1, COUNT)],
    ),
    "atan": (elementary.atan, arctangent, drawn(-5.0, 5.0)),
    "atan, small": (elementary.atan, arctangent, powers_of_ten(-10.0, 0.0)),
    "atan, large": (elementary.atan, arctangent, powers_of_ten(0.0, 10.0)),
    "cube root": (
        elementary.cube_root,
        lambda x: (x.ln() / 3).exp(),
        powers_of_ten(-200.0, 200.0),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_error_is_below_one_unit_in_the_last_place(name: str) -> None:
    function, exact, arguments = CASES[name]
    with localcontext() as context:
        context.prec = DIGITS
        worst = max(units_off(function(x), exact(Decimal(x))) for x in arguments)
    assert worst < 0.9


@pytest.mark.parametrize("exponent", [10.0 / 9.0, 0.9, 1.4, -0.2, 2.5, 16.0, -16.0, 1.0 / 3.0])
def test_a_power_is_below_one_unit_in_the_last_place(exponent: float) -> None:
    with localcontext() as context:
        context.prec = DIGITS
        worst = max(
            units_off(elementary.power(x, exponent), (Decimal(exponent) * Decimal(x).ln()).exp())
            for x in powers_of_ten(-14.0, 4.0) + drawn(0.9, 1.1)
        )
    assert worst < 0.6


def test_three_halves_are_a_product_with_a_root() -> None:
    for x in powers_of_ten(-12.0, 0.0):
        assert elementary.power(x, 1.5) == x * math.sqrt(x)
        assert elementary.power(x, 1.0) == x
        assert elementary.power(x, 2.0) == x * x


def test_the_angle_of_a_point_knows_its_quadrant() -> None:
    for angle in drawn(-3.14, 3.14):
        x, y = math.cos(angle), math.sin(angle)
        assert elementary.atan2(y, x) == pytest.approx(math.atan2(y, x), rel=1e-15)
        assert elementary.atan2(1e-3 * y, 1e-3 * x) == pytest.approx(angle, rel=1e-14)
    for y, x in ((0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (0.0, 0.0)):
        assert elementary.atan2(y, x) == math.atan2(y, x)


def test_ends_of_the_ranges() -> None:
    assert elementary.exp(0.0) == 1.0
    assert elementary.exp(710.0) == math.inf
    assert elementary.exp(-746.0) == 0.0
    assert elementary.exp(-745.0) == math.exp(-745.0)
    assert elementary.exp(709.7) == pytest.approx(math.exp(709.7), rel=1e-15)
    assert elementary.ln(0.0) == -math.inf
    assert elementary.ln(1.0) == 0.0
    assert elementary.ln(5e-324) == math.log(5e-324)
    assert elementary.tanh(0.0) == 0.0
    assert elementary.tanh(40.0) == 1.0
    assert elementary.tanh(-40.0) == -1.0
    assert elementary.power(0.0, 1.2) == 0.0
    assert elementary.power(3.0, 0.0) == 1.0
    assert elementary.power(1.0, 1.2) == 1.0
    assert elementary.power(1e300, 1.2) == math.inf
    assert elementary.power(1e-300, 1.2) == 0.0
    assert elementary.power(1e-310, 0.5) == pytest.approx(1e-155, rel=1e-13)
    assert elementary.power(1e-160, 1.95) == pytest.approx(1e-312, rel=1e-10)
    assert elementary.cube_root(-27.0) == -3.0
    assert elementary.cube_root(0.0) == 0.0
    assert elementary.cube_root(1e-310) == pytest.approx(np.cbrt(1e-310), rel=1e-12)


@pytest.mark.parametrize("name", ["exp", "ln", "tanh", "sin", "cos", "atan", "cube_root"])
def test_not_a_number_stays_so(name: str) -> None:
    assert math.isnan(getattr(elementary, name)(math.nan))
    assert math.isnan(elementary.power(math.nan, 1.2))
    assert math.isnan(elementary.power(-1.0, 1.2))


def test_whole_arrays_are_entry_by_entry() -> None:
    x = np.array([[0.1, 0.2], [0.3, 0.4]])
    for name in ("exp", "ln", "sin", "cos", "cube_root"):
        one = getattr(elementary, name)
        assert np.array_equal(
            getattr(elementary, f"{name}_each")(x), [[one(0.1), one(0.2)], [one(0.3), one(0.4)]]
        )
    assert np.array_equal(elementary.magnitude(np.array([3.0]), np.array([4.0])), [5.0])


def test_elliptic_integrals_are_those_of_the_library() -> None:
    q = np.concatenate([10.0 ** np.linspace(-5.0, 0.0, 50), [1.0 - 1e-9]])
    assert elliptic.complete_second(q) == pytest.approx(special.ellipe(1.0 - q), rel=3e-15)
    assert elliptic.carlson_d(q, 1.0) == pytest.approx(special.elliprd(0.0, q, 1.0), rel=2e-15)
    assert elliptic.carlson_d(1.0, q) == pytest.approx(special.elliprd(0.0, 1.0, q), rel=2e-15)
