"""Coefficients of the polynomials in `rotordrop.physics.elementary_tables`, computed to 60 digits.

Each is the polynomial of least largest relative error of one function on one interval, found by Remez'
exchange algorithm; the coefficients are then rounded to doubles. ``python tools/minimax.py`` prints what
stands in the module, with the error that the rounded coefficients leave. It needs mpmath.
"""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp

mp.mp.dps = 60

Function = Callable[[mp.mpf], mp.mpf]


def series(terms: Callable[[int], mp.mpf], count: int = 40) -> Function:
    """Power series with the given terms, for where a closed form would cancel."""
    return lambda z: mp.fsum(terms(k) * z**k for k in range(count))


WANTED: dict[str, tuple[Function, mp.mpf, mp.mpf, int]] = {
    "EXP": (series(lambda k: 1 / mp.factorial(k + 2)), -mp.log(2) / 256, mp.log(2) / 256, 3),
    "LOG2": (
        series(lambda k: (-1) ** (k + 1) * mp.log(2) ** (k + 1) / (k + 2)),
        -1 / (256 * mp.log(2)),
        1 / (256 * mp.log(2)),
        4,
    ),
    "ATANH": (series(lambda k: mp.mpf(1) / (2 * k + 3)), mp.mpf(0), (3 - 2 * mp.sqrt(2)) ** 2, 7),
    "SIN": (series(lambda k: (-1) ** (k + 1) / mp.factorial(2 * k + 3)), mp.mpf(0), (mp.pi / 4) ** 2, 6),
    "COS": (series(lambda k: (-1) ** k / mp.factorial(2 * k + 4)), mp.mpf(0), (mp.pi / 4) ** 2, 5),
    "ATAN": (series(lambda k: (-1) ** (k + 1) / mp.mpf(2 * k + 3)), mp.mpf(0), mp.mpf(1) / 16, 9),
}
"""Function of the polynomial's argument, interval, degree. EXP is (eˣ − 1 − x)/x² of x, LOG2 is
(log₂(1 + x ln 2) − x)/x² of x; the others are, of z = x², (atanh x − x)/x³, (sin x − x)/x³,
(cos x − 1 + z/2)/z² and (atan x − x)/x³."""


def remez(f: Function, low: mp.mpf, high: mp.mpf, degree: int) -> list[mp.mpf]:
    """Coefficients, lowest first, of the polynomial with the least largest relative error."""
    low, high = low * mp.mpf("1.001") - mp.mpf("1e-9"), high * mp.mpf("1.001") + mp.mpf("1e-9")
    points = degree + 2
    nodes = [(low + high) / 2 - (high - low) / 2 * mp.cos(mp.pi * k / (points - 1)) for k in range(points)]
    for _ in range(8):
        rows = [[x**j for j in range(degree + 1)] + [(-1) ** i * f(x)] for i, x in enumerate(nodes)]
        found = list(mp.lu_solve(mp.matrix(rows), mp.matrix([f(x) for x in nodes])))
        coefficients = found[: degree + 1]
        nodes = _extrema(coefficients, f, low, high, points)
    return coefficients


def relative_error(coefficients: list[mp.mpf], f: Function, x: mp.mpf) -> mp.mpf:
    """Error of the polynomial over the function."""
    return mp.polyval(coefficients[::-1], x) / f(x) - 1


def _extrema(coefficients: list[mp.mpf], f: Function, low: mp.mpf, high: mp.mpf, count: int) -> list[mp.mpf]:
    """Places of the alternating largest errors."""
    grid = [(low + high) / 2 - (high - low) / 2 * mp.cos(mp.pi * k / 400) for k in range(401)]
    errors = [relative_error(coefficients, f, x) for x in grid]
    best: list[tuple[mp.mpf, mp.mpf]] = []
    for x, e in zip(grid, errors, strict=True):
        if best and mp.sign(e) == mp.sign(best[-1][1]):
            if abs(e) > abs(best[-1][1]):
                best[-1] = (x, e)
        else:
            best.append((x, e))
    while len(best) > count:
        best.pop(0 if abs(best[0][1]) < abs(best[-1][1]) else -1)
    return [x for x, _ in best]


def main() -> None:
    """Print every polynomial."""
    for name, (f, low, high, degree) in WANTED.items():
        rounded = [mp.mpf(float(c)) for c in remez(f, low, high, degree)]
        grid = [low + (high - low) * k / 1000 for k in range(1001)]
        worst = max(abs(relative_error(rounded, f, x)) for x in grid)
        print(f"# {name}: relative error {mp.nstr(worst, 2)}")
        print(f"{name} = (" + ", ".join(repr(float(c)) for c in rounded) + ")")


if __name__ == "__main__":
    main()
