"""Box-plot statistics of a stress history, with the rules in use named (Neisi 2020, Fig. 16 and Table 5)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.document import ABSENT, Document
from rotordrop.errors import UsageError

QuartileRule = Literal["hazen", "linear"]

QUARTILE_RULES: dict[str, str] = {
    "hazen": "Hazen, (k − 1/2)/n, as in MATLAB box plots",
    "linear": "linear, (k − 1)/(n − 1), the default of numpy",
}
WHISKER_REACH = 1.5
"""Interquartile ranges that a whisker reaches [1]; MATLAB's box plot, as in Neisi 2020, Fig. 16."""
SIGMA_REACH = 3.0
"""Standard deviations above the mean beyond which a value is an outlier [1]; Neisi 2020, Table 5."""


class Statistics(Document):
    """Distribution of the stress [Pa], as it is published."""

    rule: QuartileRule
    """Rule of the quartiles, "hazen" or "linear"."""
    weighted_by_time: bool
    """Whether each value counts by the time it lasted."""
    count: int
    """Values [1]."""
    mean: float
    median: float
    lower_quartile: float
    upper_quartile: float
    """[Pa]."""
    lower_whisker: float
    upper_whisker: float
    """Most extreme values within 1.5 interquartile ranges of the box [Pa]."""
    standard_deviation: float
    """With n − 1 [Pa]."""
    minimum: float
    maximum: float
    """[Pa]."""
    beyond_whiskers: int
    """Values outside the whiskers: the outliers of a MATLAB box plot [1]."""
    above_three_sigma: int
    """Values above mean + 3 standard deviations: the outliers of the paper's text [1]."""
    three_sigma_limit: float
    """mean + 3 standard deviations [Pa]."""
    preload_stress: float = ABSENT
    """Stress of the preload alone [Pa]."""
    preload_share: float = ABSENT
    """``preload_stress`` over ``mean`` [1]: near 1 the mean says little about the drop."""

    def rules(self) -> str:
        """Name the rules in use, for a table or a figure."""
        weight = "weighted by time" if self.weighted_by_time else "every sample counts alike"
        return (
            f"quartiles: {QUARTILE_RULES[self.rule]}; whiskers: {WHISKER_REACH:g} interquartile ranges; "
            f"outliers: above mean + {SIGMA_REACH:g} standard deviations (n − 1); {weight}"
        )


def stress_statistics(
    stress: ArrayLike,
    *,
    time: ArrayLike | None = None,
    rule: QuartileRule = "hazen",
    preload_stress: float | None = None,
) -> Statistics:
    """Summarise a stress history (T,) [Pa] as a box plot does, and say which rules were followed.

    With rising times (T,) [s] each value counts by the time around it, which matters where the steps differ;
    ``preload_stress`` is what the preload alone makes [Pa].

    Source: Neisi 2020, Table 5. Differs from the paper: the paper draws MATLAB boxes (Hazen, 1.5
    interquartile ranges) but writes "3 σ"; both outlier counts are given here.
    """
    values = np.asarray(stress, dtype=np.float64).ravel()
    if rule not in QUARTILE_RULES:
        raise UsageError(f"quartile rule {rule!r} is unknown; choose one of {', '.join(QUARTILE_RULES)}")
    if values.size < 2 or not np.isfinite(values).all():
        raise UsageError(
            f"stress statistics: {values.size} values, {np.sum(~np.isfinite(values))} of them not finite; "
            f"at least 2 and only finite ones are needed"
        )
    weight = np.full(values.size, 1.0 / values.size) if time is None else _durations(time, values.size)
    mean = float(weight @ values)
    deviation = float(np.sqrt(weight @ (values - mean) ** 2 * values.size / (values.size - 1)))
    lower, median, upper = weighted_quantiles(values, weight, (0.25, 0.5, 0.75), rule)
    reach = WHISKER_REACH * (upper - lower)
    inside = values[(values >= lower - reach) & (values <= upper + reach)]
    limit = mean + SIGMA_REACH * deviation
    preload = {} if preload_stress is None else {"preload_stress": preload_stress}
    if preload_stress is not None and mean != 0.0:
        preload["preload_share"] = preload_stress / mean
    return Statistics(
        rule=rule,
        weighted_by_time=time is not None,
        count=values.size,
        mean=mean,
        median=median,
        lower_quartile=lower,
        upper_quartile=upper,
        lower_whisker=float(inside.min()),
        upper_whisker=float(inside.max()),
        standard_deviation=deviation,
        minimum=float(values.min()),
        maximum=float(values.max()),
        beyond_whiskers=int(values.size - inside.size),
        above_three_sigma=int(np.sum(values > limit)),
        three_sigma_limit=limit,
        **preload,
    )


def weighted_quantiles(
    values: ArrayLike, weight: ArrayLike, shares: tuple[float, ...], rule: QuartileRule
) -> tuple[float, ...]:
    """Quantiles of weighted values [unit of the values]; with equal weights exactly those of the named
    rule.
    """
    x = np.asarray(values, dtype=np.float64)
    order = np.argsort(x, kind="stable")
    w = np.asarray(weight, dtype=np.float64)[order]
    middle = np.cumsum(w) - 0.5 * w
    if rule == "hazen":
        place = middle / w.sum()
    else:
        place = (middle - middle[0]) / (middle[-1] - middle[0])
    return tuple(float(q) for q in np.interp(shares, place, x[order]))


def _durations(time: ArrayLike, count: int) -> Array:
    """Share of the whole time around each value [1]: half of the steps beside it (trapezoidal rule)."""
    t = np.asarray(time, dtype=np.float64)
    if t.shape != (count,):
        raise UsageError(f"stress statistics: {count} stresses but time of shape {t.shape}")
    step = np.diff(t)
    if np.any(step <= 0.0):
        at = int(np.argmax(step <= 0.0))
        raise UsageError(f"stress statistics: time does not rise after {t[at]:.6g} s")
    around = 0.5 * (np.append(0.0, step) + np.append(step, 0.0))
    return np.asarray(around / around.sum())
