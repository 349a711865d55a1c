"""The size of the process noise by the likelihood of the readings, and the estimate that it gives.

What the model leaves out differs from machine to machine. Impulses of a size set beforehand make the
intervals of a machine that the model fits too wide, and those of another too narrow; their likeliest size
lets each record say how wide its own are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from rotordrop.arrays import Array
from rotordrop.track.calibration import (
    THREADS,
    Stage,
    TrackedDrops,
    prior_of_next,
    stage_settings,
)
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, forward, has_diverged

SMALLEST, LARGEST = 0.125, 64.0
"""Limits of the size, over the baseline [1]. Below the smaller one the sensors' noise and the machine's
values decide: the interval of a peak shrank by less than 6 % from there to a quarter of it (two rotors)."""

STEP = 4.0
"""Factor between the sizes tried [1]; the likeliest lies on the parabola through the best three."""


def likeliest_noise(fit: TrackedDrops, stage: Stage) -> float:
    """Size of the process noise, over that of a stage, that makes the readings of all drops likeliest [1].

    The passes are linearised at a fit of the drops. It is no smaller than a size without which the filter
    diverged.
    """
    needed = max(1.0, *fit.noise_factors)

    def negative_log_likelihood(power: int) -> float:
        drops = forward_passes(fit.problems, fit.trajectories, stage, needed * STEP**power)
        return sum(likelihood_of(one) for one in drops)

    found: float = needed * STEP ** _lowest(negative_log_likelihood)
    return min(max(found, needed if needed > 1.0 else SMALLEST), LARGEST)


def likelihood_of(one: Forward) -> float:
    """Negative log likelihood of the readings of a pass [1]; infinite where the filter diverged."""
    return math.inf if has_diverged(one) else one.negative_log_likelihood


def forward_passes(
    problems: Sequence[DropProblem], references: Sequence[Array], stage: Stage, factor: float
) -> list[Forward]:
    """Drops of one machine filtered along references, each of shape (M, n), as far as these reach.

    Unknown impulses are larger than those of the stage by a factor [1]. Nothing is kept for a smoother.
    """
    settings = stage_settings(problems[0], stage, factor)
    passes: list[Forward] = []
    for problem, reference in zip(problems, references, strict=True):
        mean, covariance = prior_of_next(passes[-1] if passes else None, problem)
        count = len(reference)
        passes.append(
            forward(problem, settings, mean=mean, covariance=covariance, reference=reference, samples=count)
        )
    return passes


def _lowest(function: Callable[[int], float]) -> float:
    """Place of the minimum of a function of whole numbers, between them by a parabola, from the least up."""
    least = math.floor(math.log(SMALLEST, STEP))
    most = math.ceil(math.log(LARGEST, STEP))
    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        known = dict(zip((least, least + 1), pool.map(function, (least, least + 1)), strict=True))
    best = least
    while known[best + 1] < known[best] or (math.isinf(known[best]) and best < most):
        best += 1
        known[best + 1] = function(best + 1) if best < most else math.inf
    if math.isinf(known[best]):
        return 0.0  # every size loses the drops
    low, middle, high = (known.get(best + k, math.inf) for k in (-1, 0, 1))
    bend = low - 2.0 * middle + high
    return best + 0.5 * (low - high) / bend if math.isfinite(bend) and bend > 0.0 else float(best)
