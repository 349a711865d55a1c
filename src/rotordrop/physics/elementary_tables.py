"""Polynomials and tables behind `rotordrop.physics.elementary`.

The polynomials have the least largest relative error on their interval; Remez gives them.
The tables, powers of two and logarithms in steps of a 128th, are computed from whole numbers in fixed point
when the module is loaded, so that they have the same bits everywhere; it takes a millisecond.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from rotordrop.arrays import Array

EXP = (0.4999999999999906, 0.16666666666667068, 0.04166667686917585, 0.008333333819167055)
LOG2 = (
    -0.34657359027997264,
    0.16015100463438645,
    -0.08325616299303285,
    0.046167649958911004,
    -0.026667534941894024,
)
ATANH = (
    0.3333333333333333,
    0.20000000000000442,
    0.14285714285399045,
    0.11111111196463369,
    0.09090897756980333,
    0.07693123204870787,
    0.06634298532292894,
    0.06544217817121768,
)
SIN = (
    -0.16666666666666666,
    0.008333333333333331,
    -0.00019841269841265003,
    2.7557319219294575e-06,
    -2.5052106217872983e-08,
    1.6058529427806369e-10,
    -7.5865738041884e-13,
)
COS = (
    0.041666666666666664,
    -0.001388888888888738,
    2.4801587298741908e-05,
    -2.755731726020999e-07,
    2.087614400047863e-09,
    -1.138247671587663e-11,
)
ATAN = (
    -0.3333333333333333,
    0.19999999999999982,
    -0.14285714285704634,
    0.11111111109128637,
    -0.09090908883819364,
    0.07692295241795181,
    -0.06666209496070775,
    0.058719046534877535,
    -0.05117227854764703,
    0.0360180182727522,
)

_PLACES = 120
"""Binary places of the fixed point."""

_ONE = 1 << _PLACES


def _powers_of_two() -> Array:
    step = 2 * _ONE
    for _ in range(7):
        step = math.isqrt(step << _PLACES)
    rows, power = [], _ONE
    for _ in range(128):
        high = power / _ONE
        rows.append((high, (power - int(math.ldexp(high, _PLACES))) / _ONE))
        power = (power * step) >> _PLACES
    return np.array(rows)


def _logarithms() -> Array:
    # ln a - ln b = 2 artanh((a - b)/(a + b)): from one number to the next the fraction is small, few terms do
    numbers, natural = [256, *range(257, 512, 2), 512], [0]
    for one, following in pairwise(numbers):
        apart, both = following - one, following + one
        terms = ((2 * apart**k << _PLACES) // (k * both**k) for k in range(1, 15, 2))
        natural.append(natural[-1] + sum(terms))
    rows = []
    for number, value in zip(numbers[1:-1], natural[1:-1], strict=True):
        binary = (value << _PLACES) // natural[-1]
        short = binary >> (_PLACES - 16)
        slope = (256 << 2 * _PLACES) // (natural[-1] * number)
        rows.append((number / 256, slope / _ONE, short / 65536, (binary - (short << (_PLACES - 16))) / _ONE))
    return np.array(rows)


POWERS = _powers_of_two()
"""2^(j/128) [1] as high + low, shape (128, 2)."""

LOGARITHMS = _logarithms()
"""Of the middle c of each 128th from 1 to 2: c, log₂e / c, log₂ c in 16 places, its rest; shape (128, 4)."""
