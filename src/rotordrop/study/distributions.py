"""How a varied value is spread: from a uniform number between 0 and 1 to a value in SI units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from rotordrop.errors import UsageError

Array = NDArray[np.float64]
Number = Callable[[Any], float]
"""Reads what stands in a study file, such as ``"60 Hz"``, to SI."""

SHAPES = ("uniform", "log_uniform", "normal", "log_normal", "choices", "grid")
_MEANING = {
    "uniform": "[lowest, highest]",
    "log_uniform": "[lowest, highest], both above zero",
    "normal": "[mean, standard deviation]",
    "log_normal": "[median, standard deviation of the natural logarithm]",
    "choices": "a list of values, each as likely as the others",
    "grid": "a list of values, each of them visited",
}


@dataclass(frozen=True, kw_only=True)
class Distribution:
    """Spread of one varied value.

    Attributes
    ----------
    shape : str
        One of `SHAPES`.
    numbers : tuple of float
        Its numbers, as `SHAPES` explains them [SI unit of the value, the second of a log-normal 1].
    """

    shape: str
    numbers: tuple[float, ...]

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
            return np.asarray(np.exp(math.log(first) + math.log(second / first) * u))
        score = ndtri(np.clip(u, 1e-16, 1.0 - 1e-16))
        if self.shape == "normal":
            return np.asarray(first + second * score)
        return np.asarray(first * np.exp(second * score))


def read_distribution(name: str, table: Any, number: Number) -> Distribution:
    """Read a spread such as ``{uniform = ["60 Hz", "200 Hz"]}``.

    Parameters
    ----------
    name : str
        What is varied, for messages.
    table : mapping
        One key out of `SHAPES` with its numbers.
    number : callable
        Reads one value to SI.

    Raises
    ------
    UsageError
        If shape or numbers cannot be used.
    """
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
    if shape not in ("choices", "grid"):
        _check_pair(name, shape, numbers)
    return Distribution(shape=shape, numbers=numbers)


def _check_pair(name: str, shape: str, numbers: tuple[float, ...]) -> None:
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
