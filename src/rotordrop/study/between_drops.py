"""What differs from drop to drop of one machine, as its recorded drops show it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rotordrop.study.distributions import Distribution

Estimate = tuple[float, float]
"""A value and its standard error, what was known before the record included."""

SHARES = 64
"""Points over the share that all drops have in common."""


def next_draw(recorded: Sequence[Estimate], spread: float) -> Distribution:
    """Distribution of a value in the next drop, from what recorded drops show of it.

    Before any record each value is normal about zero; which part of that variance all drops share is not
    known. Values that agree speak for a large common part: the next one will then lie near them, and no
    nearer than they lie to one another.

    Parameters
    ----------
    recorded : sequence of (float, float)
        Value and standard error of each recorded drop, and of each magnet in it [any unit].
    spread : float
        Standard deviation of a value before any record, which stands in the errors too [same unit].

    Returns
    -------
    Distribution
        Normal, with mean and standard deviation of the mixture over the unknown common part.

    Notes
    -----
    Source: the normal model of values that may be exchanged, Gelman and others, Bayesian Data Analysis, 2013,
    chapter 5, with the total variance given and the common share uniform between 0 and 1.
    """
    own = [_without_prior(value, error, spread) for value, error in recorded if error < spread]
    if not own:
        return Distribution(shape="normal", numbers=(0.0, spread))
    parts = [_given_share((k + 0.5) / SHARES, own, spread) for k in range(SHARES)]
    best = max(weight for weight, _, _ in parts)
    weights = [math.exp(weight - best) for weight, _, _ in parts]
    whole = math.fsum(weights)
    mean = math.fsum(w * m for w, (_, m, _) in zip(weights, parts, strict=True)) / whole
    square = math.fsum(w * (v + m * m) for w, (_, m, v) in zip(weights, parts, strict=True)) / whole
    return Distribution(shape="normal", numbers=(mean, math.sqrt(square - mean * mean)))


def _without_prior(value: float, error: float, spread: float) -> Estimate:
    """What the record alone says: the quotient of estimate and prior about zero; value and variance."""
    variance = 1.0 / (error**-2 - spread**-2)
    return value * variance / error**2, variance


def _given_share(share: float, own: Sequence[Estimate], spread: float) -> tuple[float, float, float]:
    """Logarithm of the likelihood of a common share, and mean and variance of the next value with it.

    The covariance of the recorded values is diagonal but for the common part c in every entry, so that its
    inverse and determinant are sums.
    """
    common = share * spread**2
    alone = [(1.0 - share) * spread**2 + variance for _, variance in own]
    ones = math.fsum(1.0 / d for d in alone)
    sums = math.fsum(value / d for (value, _), d in zip(own, alone, strict=True))
    squares = math.fsum(value**2 / d for (value, _), d in zip(own, alone, strict=True))
    seen = 1.0 + common * ones
    misfit = squares - common * sums**2 / seen
    size = math.fsum(math.log(d) for d in alone) + math.log(seen)
    return -0.5 * (misfit + size), common * sums / seen, (1.0 - share) * spread**2 + common / seen
