"""How a varied value is spread: from a uniform number between 0 and 1 to a value in SI units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.physics.elementary import exp_each, ln, ln_each

Number = Callable[[Any], float]
"""Reads what stands in a study file, such as ``"60 Hz"``, to SI."""

_MEANING = {
    "uniform": "[lowest, highest]",
    "log_uniform": "[lowest, highest], both above zero",
    "normal": "[mean, standard deviation]",
    "log_normal": "[median, standard deviation of the natural logarithm]",
    "choices": "a list of values, each as likely as the others",
    "grid": "a list of values, each of them visited",
}
SHAPES = tuple(_MEANING)


@dataclass(frozen=True, kw_only=True)
class Distribution:
    """Spread of one varied value."""

    shape: str
    """One of `SHAPES`."""
    numbers: tuple[float, ...]
    """Its numbers, as `SHAPES` explains them [SI unit of the value, the second of a log-normal 1]."""

    def __call__(self, share: Array) -> Array:
        """Values [SI] at the given shares of the probability, shape as given; shares lie between 0 and 1."""
        u = np.asarray(share, dtype=np.float64)
        if self.shape in ("choices", "grid"):
            place = np.minimum((u * len(self.numbers)).astype(np.int64), len(self.numbers) - 1)
            return np.asarray(self.numbers, dtype=np.float64)[place]
        first, second = self.numbers
        if self.shape == "uniform":
            return np.asarray(first + (second - first) * u)
        if self.shape == "log_uniform":
            return np.asarray(exp_each(ln(first) + ln(second / first) * u))
        score = normal_score(u)
        if self.shape == "normal":
            return np.asarray(first + second * score)
        return np.asarray(first * exp_each(second * score))


_MIDDLE = (
    (2509.0809287301226727, 33430.575583588128105, 67265.770927008700853, 45921.953931549871457,
     13731.693765509461125, 1971.5909503065514427, 133.14166789178437745, 3.387132872796366608),
    (5226.495278852854561, 28729.085735721942674, 39307.89580009271061, 21213.794301586595867,
     5394.1960214247511077, 687.1870074920579083, 42.313330701600911252, 1.0),
)  # fmt: skip
_SIDE = (
    (7.7454501427834140764e-4, 0.0227238449892691845833, 0.24178072517745061177, 1.27045825245236838258,
     3.64784832476320460504, 5.7694972214606914055, 4.6303378461565452959, 1.42343711074968357734),
    (1.05075007164441684324e-9, 5.475938084995344946e-4, 0.0151986665636164571966, 0.14810397642748007459,
     0.68976733498510000455, 1.6763848301838038494, 2.05319162663775882187, 1.0),
)  # fmt: skip
_END = (
    (2.01033439929228813265e-7, 2.71155556874348757815e-5, 0.0012426609473880784386, 0.026532189526576123093,
     0.29656057182850489123, 1.7848265399172913358, 5.4637849111641143699, 6.6579046435011037772),
    (2.04426310338993978564e-15, 1.4215117583164458887e-7, 1.8463183175100546818e-5, 7.868691311456132591e-4,
     0.0148753612908506148525, 0.13692988092273580531, 0.59983220655588793769, 1.0),
)  # fmt: skip


def normal_score(share: Array) -> Array:
    """Standard normal variable [1] at a share of its probability, with the same bits on every processor.

    Source: Wichura, Applied Statistics 37, 1988, algorithm AS 241 (relative error 1e-16).
    """
    u = np.clip(np.asarray(share, dtype=np.float64), 1e-16, 1.0 - 1e-16)
    from_middle = u - 0.5
    tail = np.sqrt(-ln_each(np.minimum(u, 1.0 - u)))
    outer = np.where(tail <= 5.0, _ratio(_SIDE, tail - 1.6), _ratio(_END, tail - 5.0))
    inner = from_middle * _ratio(_MIDDLE, 0.180625 - from_middle * from_middle)
    return np.where(np.abs(from_middle) <= 0.425, inner, np.copysign(outer, from_middle))


def _ratio(coefficients: tuple[tuple[float, ...], tuple[float, ...]], x: Array) -> Array:
    above, below = np.zeros_like(x), np.zeros_like(x)
    for a, b in zip(*coefficients, strict=True):
        above, below = above * x + a, below * x + b
    return above / below


def read_distribution(name: str, table: Any, number: Number) -> Distribution:
    """Read a spread such as ``{uniform = ["60 Hz", "200 Hz"]}``; ``number`` reads one value to SI."""
    if not isinstance(table, Mapping) or len(table) != 1 or next(iter(table)) not in SHAPES:
        raise UsageError(
            f"{name} is varied by {table!r}; expected one of {', '.join(SHAPES)}, "
            'as in {uniform = ["60 Hz", "200 Hz"]}'
        )
    shape, written = next(iter(table.items()))
    if not isinstance(written, list | tuple) or not written:
        raise UsageError(f"{name}: {shape} = {written!r}; expected {_MEANING[shape]}")
    plain = shape == "log_normal"
    numbers = tuple(
        float(item) if plain and i == 1 and isinstance(item, int | float) else number(item)
        for i, item in enumerate(written)
    )
    if shape in ("choices", "grid"):
        return Distribution(shape=shape, numbers=numbers)
    expected = f"expected {_MEANING[shape]}"
    if len(numbers) != 2:
        raise UsageError(f"{name}: {shape} has {len(numbers)} numbers; {expected}")
    first, second = numbers
    if shape in ("uniform", "log_uniform") and not first < second:
        raise UsageError(f"{name}: {shape} runs from {first:g} to {second:g} (SI); {expected}")
    if shape in ("normal", "log_normal") and not second > 0.0:
        raise UsageError(f"{name}: {shape} has a standard deviation of {second:g}; {expected}")
    if shape in ("log_uniform", "log_normal") and not first > 0.0:
        raise UsageError(f"{name}: {shape} begins at {first:g} (SI); {expected}")
    return Distribution(shape=shape, numbers=numbers)
