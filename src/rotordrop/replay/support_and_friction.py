"""Supports and friction of the touchdown bearings from the first impacts (Neisi 2020, sections 3.2 and 5.2).

The sensors' displacements over the first impacts are fitted by the drop model. With the supports, everything
else that shapes these displacements is fitted under its prior: contact, friction, preload, race, and the
initial state with the sensors' gains and zeros as far as the fall left them open. So the supports carry the
uncertainty of all of it. The friction that the orbits fit best then follows from a sweep.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.estimate.agreement import TENFOLD, orbit_disagreement
from rotordrop.estimate.estimate import FrictionSweep
from rotordrop.known import NINETY, Correlation, Known, Status
from rotordrop.progress import Progress
from rotordrop.replay.first_impacts import FirstImpacts, influential_directions
from rotordrop.replay.least_squares import (
    Fit,
    Schedule,
    Search,
    considered_covariance,
    search,
    sobol_starts,
)

WINDOWS = (1.75e-3, 3.25e-3, 5.25e-3, 7.25e-3, 11e-3, 16e-3)
"""Ends of the windows after the later of the first contacts [s]; chosen, not measured."""

LONGEST_WINDOW = 25e-3
"""End of the window of the last fit, with the friction of the sweep, after the later first contact [s]."""

COARSE_WINDOWS = 3
"""How many of them are searched with a coarse basis; the last is fitted again with the fine one (chosen)."""

WIDENING = 3.2
"""Factor on standard errors for what the linearised fit leaves out [1]: with 2, 78 % of the 90 % intervals of
stiffness, mass and damping held the truth on 12 machines, with 3.2, 83 % on 12 others."""

SWEEP_WIDENING = 2.0
"""The same for the draws with which friction is swept: wider ones leave the neighbourhood of the fit [1]."""

ALL_DIRECTIONS = 40
"""How many directions of the initial state the last fit follows: with 16, what is left biases stiff supports
by two percent."""

UNDETERMINED = 0.7
"""Posterior over prior standard deviation above which the record does not determine a value [1]."""

SWEEP = np.round(np.arange(0.05, 0.2001, 0.01), 3)
"""Dynamic coefficients of the sweep [1]."""

SCATTER_WIDENING = 2.0
"""Factor on the scatter of the best coefficient between draws [1]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class SupportFit:
    """Supports found from the first impacts, with everything that was fitted beside them."""

    coarse: Search
    """Search from many starts over the first windows."""
    search: Search
    """Fits over the longer windows, with the fine basis."""
    covariance: Array
    """Covariance of all unknowns, widened for what the linearised fit leaves out, shape (n, n)."""
    correlations: tuple[Correlation, ...]
    """Correlation of pairs of support parameters of one bearing."""


def fit_support(
    coarse: FirstImpacts,
    fine: FirstImpacts,
    later_contact: float,
    *,
    starts: int = 8,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SupportFit:
    """Find the supports by least squares on the first impacts.

    The coarse basis serves the search from many starts, the fine one the result. The windows count from the
    later of the first contacts [s from power-off].

    Notes
    -----
    Source: Neisi 2020, section 3.2 (least squares up to 0.015 s). Differs from the paper: windows that grow,
    many starts, horizontal displacements too, and everything else that is uncertain is marginalised.
    """
    report = progress or (lambda text, share: None)
    last = min(coarse.time[-1], fine.time[-1])
    windows = tuple(later_contact + w for w in WINDOWS if later_contact + w <= last)
    count = len(fine.unknowns)
    supports = fine.supports
    spread = np.zeros(len(coarse.table.mean))
    spread[supports] = NINETY * coarse.table.sigma[supports]
    first = search(
        coarse,
        [coarse.table.begin, *sobol_starts(coarse.table.mean, spread, starts)[1:]],
        Schedule(windows=windows[:COARSE_WINDOWS]),
        threads=threads,
        progress=lambda text, share: report(text, 0.5 * share),
    )
    # the same parameters for another basis; the directions of the initial state begin anew
    finalists = [np.zeros(len(fine.table.mean)) for _ in first.finalists[:2]]
    for x, fit in zip(finalists, first.finalists, strict=False):
        x[:count] = fit.x[:count]
    found = search(
        fine,
        finalists,
        Schedule(
            windows=windows[COARSE_WINDOWS - 1 :],
            kept=(2,),
            draws=(50,),
            filled=False,
            few=0,
            iterations=(10, 10),
            tolerances=(1e-3, 3e-4),
            complete=True,
        ),
        threads=threads,
        progress=lambda text, share: report(text, 0.5 + 0.5 * share),
    )
    covariance = found.best.covariance
    scale = np.sqrt(np.diag(covariance))
    return SupportFit(
        coarse=first,
        search=found,
        covariance=widened_covariance(fine, found.best, SWEEP_WIDENING),
        correlations=tuple(
            Correlation(
                first=fine.paths[k],
                second=fine.paths[i],
                value=float(covariance[i, k] / (scale[i] * scale[k])),
            )
            for i in supports
            for k in supports[: supports.index(i)]
            if fine.unknowns[i].owner == fine.unknowns[k].owner
        ),
    )


def widened_covariance(problem: FirstImpacts, fit: Fit, widening: float = WIDENING) -> Array:
    """Covariance with the information of the record reduced for what the linearised fit leaves out."""
    return considered_covariance(problem.table, fit.information, max(fit.misfit, 1.0) * widening**2)


def refit_with_friction(
    problem: FirstImpacts,
    fit: Fit,
    friction: Known,
    *,
    longest: float | None = None,
    threads: int | None = None,
) -> tuple[FirstImpacts, Array, Array]:
    """Fit once more with the friction that the sweep found, more of the fall, and over a longer window.

    The longer window [s from power-off] is left out where the model does not follow the record so far. Gives
    the problem with that friction as its prior, best unknowns (n,) and their widened covariance (n, n).
    """
    place, unknowns = problem.friction, list(problem.unknowns)
    error = (friction.standard_error or 0.0) / friction.value
    found = math.log(friction.value)
    unknowns[place] = replace(unknowns[place], mean=found, start=found, sigma=max(error, 1e-4))
    refined = replace(
        problem,
        unknowns=tuple(unknowns),
        directions=influential_directions(problem.initial, problem.start, ALL_DIRECTIONS),
    )
    start = refined.table.mean.copy()
    start[: len(fit.x)] = fit.x
    start[place] = found
    end = min(longest or fit.window, float(problem.time[-1]))
    schedule = Schedule(
        windows=(fit.window, end) if end > fit.window else (fit.window,),
        kept=(1,),
        draws=(50,),
        few=0,
        iterations=(6, 8),
        tolerances=(1e-3, 5e-4),
        complete=True,
    )
    again = search(refined, [start], schedule, threads=threads).best
    return refined, again.x, widened_covariance(refined, again)


def identified_values(
    problem: FirstImpacts,
    x: Array,
    covariance: Array,
    *,
    active: Sequence[bool] | NDArray[np.bool_] = (),
    given: bool = False,
) -> dict[str, Known]:
    """Values of the parameters by path, each with error, interval, start, bounds and verdict.

    ``active`` says which unknowns lie at a bound, ``given`` that they were taken over, not found.
    """
    values = {}
    for k, unknown in enumerate(problem.unknowns):
        mean, error = float(x[k]), float(np.sqrt(covariance[k, k]))
        status: Status = "determined"
        if given:
            status = "taken over"
        elif len(active) and active[k]:
            status = "at its bound"
        elif error > UNDETERMINED * unknown.sigma:
            status = "the record does not determine it"
        bounds = (float(problem.table.lower[k]), float(problem.table.upper[k]))
        values[unknown.path] = Known(
            value=unknown.value_of(mean),
            status=status,
            standard_error=unknown.standard_error(mean, error),
            interval_90=(unknown.value_of(mean - NINETY * error), unknown.value_of(mean + NINETY * error)),
            start=unknown.value_of(unknown.begin),
            bounds=(unknown.value_of(bounds[0]), unknown.value_of(bounds[1])),
            unit=unknown.unit,
        )
    return values


def sweep_friction(
    problem: FirstImpacts,
    x: Array,
    contact: float,
    *,
    draws: Sequence[Array] = (),
    coefficients: Array = SWEEP,
    threads: int | None = None,
) -> FrictionSweep:
    """Simulate the drop for a range of friction coefficients and compare the orbits.

    The comparison begins with the earlier first contact [s from power-off]; the static coefficient follows at
    the ratio of the machine file. The best coefficients of draws of the other unknowns give the interval.

    Notes
    -----
    Source: Neisi 2020, section 5.2. Differs from the paper: a number in place of the eye, and the dynamic
    coefficient leads (sliding drops hardly see the static one).
    """
    place, end = problem.friction, contact + TENFOLD
    count = problem.until(end)
    time = problem.time[:count]
    compared = time >= contact

    def disagreement(case: tuple[Array, float]) -> float:
        point, coefficient = case
        moved = point.copy()
        moved[place] = np.log(coefficient)
        apart = problem.initial.sensing.at_bearings(problem.difference(moved, count))
        return orbit_disagreement(time[compared], np.hypot(apart[..., 0], apart[..., 1])[compared], contact)

    cases = [(point, float(c)) for point in (x, *draws) for c in coefficients]
    with ThreadPoolExecutor(max_workers=threads) as pool:
        table = np.array(list(pool.map(disagreement, cases))).reshape(-1, len(coefficients))
    best = np.array([_lowest(coefficients, row) for row in table])
    value = float(best[0])
    grid = float(coefficients[1] - coefficients[0]) / np.sqrt(12.0)
    error = SCATTER_WIDENING * float(np.hypot(np.std(best, ddof=1), 0.1 * grid)) if len(best) > 2 else grid
    low, high = float(coefficients[0]), float(coefficients[-1])
    unknown = problem.unknowns[place]
    status: Status = "determined"
    if value in (low, high):
        status = "at its bound"
    elif error > UNDETERMINED * (high - low) / np.sqrt(12.0):
        status = "the record does not determine it"
    return FrictionSweep(
        coefficients=coefficients,
        disagreement=table[0],
        best=best,
        value=Known(
            value=value,
            status=status,
            standard_error=error,
            interval_90=(max(value - NINETY * error, 0.0), value + NINETY * error),
            start=unknown.value_of(unknown.begin),
            bounds=(low, high),
            unit="1",
        ),
        window=(contact, end),
    )


def _lowest(coefficients: Array, values: Array) -> float:
    """Minimum by a parabola through the lowest value and its neighbours."""
    k = int(np.argmin(values))
    if k in (0, len(values) - 1):
        return float(coefficients[k])
    left, middle, right = (float(values[j]) ** 2 for j in (k - 1, k, k + 1))
    step = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float(coefficients[k] + step * (coefficients[k + 1] - coefficients[k]))
