"""Where the readings leave several models, the answer is their mixture, weighted by posterior probability."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

from scipy.optimize import brentq

from rotordrop.elements.parameter import Extension
from rotordrop.known import Known
from rotordrop.track.calibration import TrackedDrops

LEAST_PROBABILITY = 0.05
"""Probability below which a model is left out [1]: a 90 % interval leaves as much outside at either end."""


@dataclass(frozen=True)
class Alternative:
    """Another model of the same drops, with its fit."""

    extensions: tuple[Extension, ...]
    """What it has beyond the base model."""
    odds: float
    """Its probability over that of the model that is stated [1]."""
    fit: TrackedDrops

    @property
    def name(self) -> str:
        """What it is called."""
        return named(self.extensions)


def named(extensions: Iterable[Extension]) -> str:
    """What a model with some extensions is called."""
    return " and ".join(one.name for one in extensions) or "the base model"


def worth_keeping(alternatives: Sequence[Alternative]) -> tuple[Alternative, ...]:
    """Those that are probable enough beside the model that is stated."""
    return tuple(one for one in alternatives if one.odds >= LEAST_PROBABILITY / (1.0 - LEAST_PROBABILITY))


def probabilities(alternatives: Sequence[Alternative]) -> list[float]:
    """Posterior probability of each alternative [1]; the stated model has the rest."""
    total = 1.0 + math.fsum(one.odds for one in alternatives)
    return [one.odds / total for one in alternatives]


def mixed(known: Known, others: Sequence[tuple[float, Known]]) -> Known:
    """A number of the stated model with the 90 % interval of the mixture, each model with a normal error.

    ``others`` are the probability [1] and the number of each other model; the stated one has the rest.
    """
    if not others or known.standard_error is None:
        return known
    parts = [(1.0 - math.fsum(weight for weight, _ in others), known), *others]
    normal = [
        (weight, NormalDist(one.value, max(one.standard_error or 0.0, 1e-9 * abs(one.value), 1e-300)))
        for weight, one in parts
    ]
    spread = math.sqrt(
        math.fsum(weight * (one.stdev**2 + (one.mean - known.value) ** 2) for weight, one in normal)
    )

    def quantile(share: float) -> float:
        ends = [one.inv_cdf(share) for _, one in normal]
        if min(ends) == max(ends):
            return ends[0]
        found: float = brentq(
            lambda x: math.fsum(weight * one.cdf(x) for weight, one in normal) - share, min(ends), max(ends)
        )
        return found

    low, high = quantile(0.05), quantile(0.95)
    if known.interval_90 is not None and known.interval_90[0] >= 0.0:
        low = max(low, 0.0)
    return replace(
        known,
        standard_error=spread,
        interval_90=(min(low, known.value), max(high, known.value)),
        allowance_90=None,
    )
