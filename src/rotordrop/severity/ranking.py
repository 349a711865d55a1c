"""Which of several drops was worst, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.errors import UsageError
from rotordrop.known import NINETY
from rotordrop.require import each, require
from rotordrop.units import format_chance

CLEAR = 0.9
"""Probability from which one drop is called the worst [1]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class DropSeverity:
    """One number that stands for a drop, with what is known about its error."""

    name: str
    """Of the drop, e.g. "210 Hz"."""
    value: float
    """Peak force [N] or stress [Pa]."""
    standard_error: float
    """Of the estimate of this one drop [unit of value]."""

    def __post_init__(self) -> None:
        require(self.name, "name", str)
        require(self.value, "value", float)
        require(self.standard_error, "standard_error", float, least=0.0)

    @classmethod
    def from_interval(cls, name: str, value: float, interval_90: tuple[float, float]) -> DropSeverity:
        """Take the standard error from an interval that holds the true value with 90 % probability."""
        low, high = interval_90
        if not low <= high:
            raise UsageError(f"drop {name!r}: interval from {low:g} to {high:g} is upside down")
        return cls(name=name, value=value, standard_error=(high - low) / (2.0 * NINETY))


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Drops from worst to mildest, with the probability of each to be the worst."""

    names: tuple[str, ...]
    """Worst first, by value."""
    values: tuple[float, ...]
    """[unit of value]."""
    worst_drop: tuple[float, ...]
    """Probability that this recorded drop was the worst of them [1]."""
    worst_condition: tuple[float, ...] | None
    """Probability that drops like this one are the worst on average [1]; None when the scatter between equal
    drops is unknown."""
    drop_scatter: float | None
    """Standard deviation between equal drops [unit of value]."""
    worse_than_next: tuple[float, ...]
    """Probability that each drop but the last was worse than the one after it [1]."""
    statement: str
    """The order in words."""

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON."""
        return stated(
            self,
            "worst_first=names values probability_worst_drop=worst_drop statement "
            "probability_worse_than_next=worse_than_next probability_worst_condition=worst_condition",
        )


def rank_drops(
    drops: Sequence[DropSeverity], *, drop_scatter: float | None = None, more_is_worse: bool = True
) -> Ranking:
    """Order drops by severity and say how sure the order is.

    Two questions are kept apart. Which of the recorded drops was the worst? Only the errors of the estimates
    matter. Which speed is the worst? Then each drop is one sample, and the scatter between equal drops
    matters too: ``drop_scatter`` is the standard deviation between drops under equal conditions [unit of
    value], from repeated drops. The drops, at least two, are independent of each other; of a safety factor
    less is worse.

    Source: own method. Differs from the paper: section 5.3 ranks speeds by one drop each.
    """
    drops = each(drops, "drops", DropSeverity)
    require(drop_scatter, "drop_scatter", float, least=0.0, none=True)
    require(more_is_worse, "more_is_worse", bool)
    if len(drops) < 2:
        raise UsageError(f"ranking: {len(drops)} drop given, at least two are needed")
    sign = 1.0 if more_is_worse else -1.0
    ordered = sorted(drops, key=lambda drop: -sign * drop.value)
    value = sign * np.array([drop.value for drop in ordered])
    error = np.array([drop.standard_error for drop in ordered])
    worst_drop = worst_probability(value, error)
    condition = None if drop_scatter is None else worst_probability(value, np.hypot(error, drop_scatter))
    return Ranking(
        names=tuple(drop.name for drop in ordered),
        values=tuple((sign * value).tolist()),
        worst_drop=tuple(worst_drop.tolist()),
        worst_condition=None if condition is None else tuple(condition.tolist()),
        drop_scatter=drop_scatter,
        worse_than_next=tuple(worse_probability(value, error).tolist()),
        statement=_statement([drop.name for drop in ordered], worst_drop, condition, value, error),
    )


_quadrature = lru_cache(np.polynomial.legendre.leggauss)
"""Nodes and weights of Gauss and Legendre; finding them takes longer than all that they are used for."""


def _below(score: Array) -> Array:
    """Probability of a standard normal quantity to lie below a score [1]; scipy takes longer to load."""
    return np.array([0.5 * math.erfc(-x / math.sqrt(2.0)) for x in score.tolist()])


def worst_probability(value: Array, error: Array) -> Array:
    """Probability of each of several independent normal quantities to be the largest [1], shape as given."""
    sigma = np.maximum(error, 1e-9 * max(float(np.ptp(value)), float(np.abs(value).max()), 1e-300))
    # one drop at each of its values, all others below it: eight standard deviations leave out 1e-15
    nodes, weights = _quadrature(400)
    z, dz = 8.0 * nodes, 8.0 * weights
    result = np.empty(value.size)
    for k in range(value.size):
        x = value[k] + sigma[k] * z
        others = [_below((x - value[j]) / sigma[j]) for j in range(value.size) if j != k]
        density = np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
        result[k] = float(np.sum(dz * density * np.prod(others, axis=0)))
    return np.asarray(result / result.sum())


def worse_probability(value: Array, error: Array) -> Array:
    """Probability that each of several independent normal quantities exceeds the next one [1], (n − 1,)."""
    error = np.maximum(error, 1e-300)
    return np.asarray(_below((value[:-1] - value[1:]) / np.hypot(error[:-1], error[1:])))


def _statement(
    names: Sequence[str], worst: Array, condition: Array | None, value: Array, error: Array
) -> str:
    first, drop = names[0], float(worst[0])
    if drop >= CLEAR:
        text = f"{first} was the worst of those recorded ({format_chance(drop)})"
    else:
        text = f"{first} shows the worst value; that it was the worst drop has a probability of "
        text += format_chance(drop)
    if len(names) > 2:
        text += (
            f"; it was worse than {names[1]} with {format_chance(float(worse_probability(value, error)[0]))}"
        )
    if condition is None:
        return text
    sure = float(condition[0])
    verdict = "are the worst" if sure >= CLEAR else "cannot be called the worst"
    return f"{text}; with the scatter between equal drops its conditions {verdict} ({format_chance(sure)})"
