"""Least squares with priors, from many starts at once over growing windows.

A drop is chaotic, so a plain fit over a long window lands in a wrong minimum. Here the window starts with the
first impacts and grows; several starts run side by side on threads; those that fall behind are given up on
the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import cpu_count
from typing import Protocol

import numpy as np

from rotordrop.arrays import Array, Mask
from rotordrop.errors import IdentificationError
from rotordrop.progress import Progress

# SciPy's least squares, with the priors as further residuals, was tried in place of `fit_window`: it has no
# largest step per unknown, and the errors of the peak force in the study of the replay rose from 0.27 to 0.75
# percent (median) and from 2.0 to 4.4 percent (worst).
LARGEST_RISE = 8.0
EASING = 5.0
"""Factors on the damping of a step when it fails, and under it when it succeeds [1]; chosen, not measured."""

TRIALS = 6
"""Steps that are tried from one point, each more damped than the one before (chosen)."""

WORST = 1e30
"""Cost of a point whose simulation does not get through."""

SECOND_TRY = 10
"""Factor on the draws where a longer window was not followed at first [1]; chosen, not measured."""

BREAKING = 1.6
"""A window whose misfit exceeds that of the window before by this factor (and 1.5) is given up, after a
second try from many more draws [1]; chosen, not measured."""

ANOTHER_MINIMUM = 0.25
"""Fits that differ by this share of the prior standard deviation are minima of their own [1]."""


@dataclass(frozen=True, kw_only=True)
class Unknowns:
    """What is known of the unknowns of a fit beforehand, and how a search treats them; shapes (n,)."""

    mean: Array
    sigma: Array
    """Mean and standard deviation of the prior."""
    begin: Array
    """Where a search begins."""
    step: Array
    """Step of the finite differences."""
    reach: Array
    """Largest change in one iteration."""
    lower: Array
    upper: Array
    """Bounds."""
    leading: Mask
    """Which are fitted while many starts run; the others wait at their start."""
    decisive: Mask
    """Which tell two minima apart: those that are sought."""
    considered: Mask
    """Which keep their prior though their uncertainty is carried. A fit would move what a record tells little
    of to hide what the model lacks, and the mean stress would follow."""


class Problem(Protocol):
    """A problem to fit; its residual is called from several threads."""

    @property
    def table(self) -> Unknowns:
        """The unknowns."""

    def residual(self, x: Array, window: float) -> Array:
        """Residual over its standard deviation up to a time [s], shape (r,)."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A minimum over one window; n unknowns."""

    x: Array
    """The unknowns, shape (n,)."""
    cost: float
    """Sum of squares of weighted residuals and priors."""
    misfit: float
    """Mean square of the weighted residuals [1]; 1 is noise level."""
    covariance: Array
    """Covariance of the unknowns (Laplace), scaled up where the misfit exceeds the noise, shape (n, n)."""
    window: float
    """End of the window [s]."""
    evaluations: int
    """Simulations used for it."""
    active: Mask
    """Which unknowns lie at a bound."""
    information: Array
    """What the record alone says: the normal matrix without the priors, shape (n, n)."""


@dataclass(frozen=True, kw_only=True)
class Point:
    """Unknowns with their weighted residual and the cost, priors included."""

    x: Array
    residual: Array
    cost: float


def evaluated(problem: Problem, x: Array, window: float) -> Point:
    """Residual and cost at a point; beyond all measure where the simulation does not get through."""
    try:
        residual = problem.residual(x, window)
    except IdentificationError:
        return Point(x=x, residual=np.full(1, np.sqrt(WORST)), cost=WORST)
    prior = (x - problem.table.mean) / problem.table.sigma
    return Point(x=x, residual=residual, cost=float(residual @ residual + prior @ prior))


def fit_window(
    problem: Problem,
    start: Array,
    window: float,
    *,
    iterations: int = 12,
    tolerance: float = 1e-4,
    fitted: Mask | None = None,
    pool: Executor | None = None,
) -> Fit:
    """Levenberg–Marquardt over one window [s], with so many Jacobians at most.

    It ends when the cost falls by less than the tolerance [1]. Only the unknowns ``fitted`` move; all by
    default. The threads of a pool share the columns of the Jacobian.
    """
    table = problem.table
    free = ~table.considered if fitted is None else fitted & ~table.considered
    point, damping, count = evaluated(problem, np.clip(start, table.lower, table.upper), window), 1e-3, 1
    information = np.zeros((len(start),) * 2)
    for _ in range(iterations):
        jacobian = _jacobian(problem, point, window, free, pool)
        information = jacobian.T @ jacobian
        gradient = jacobian.T @ point.residual
        better, damping, tried = _improved(problem, point, window, free, information, gradient, damping)
        count += int(free.sum()) + tried
        if better is None:
            break
        fall = (point.cost - better.cost) / max(point.cost, 1e-300)
        point = better
        if fall < tolerance:
            break
    misfit = float(point.residual @ point.residual / max(len(point.residual), 1))
    return Fit(
        x=point.x,
        cost=point.cost,
        misfit=misfit,
        covariance=considered_covariance(table, information, max(misfit, 1.0)),
        window=window,
        evaluations=count,
        active=(point.x <= table.lower + 1e-9) | (point.x >= table.upper - 1e-9),
        information=information,
    )


def completed(problem: Problem, fit: Fit, *, pool: Executor | None = None) -> Fit:
    """The same fit with its covariance made anew at the minimum, considered unknowns included."""
    point = evaluated(problem, fit.x, fit.window)
    jacobian = _jacobian(problem, point, fit.window, np.ones(len(fit.x), dtype=np.bool_), pool)
    information = jacobian.T @ jacobian
    return replace(
        fit,
        information=information,
        covariance=considered_covariance(problem.table, information, max(fit.misfit, 1.0)),
        evaluations=fit.evaluations + len(fit.x) + 1,
    )


def considered_covariance(table: Unknowns, information: Array, scale: float) -> Array:
    """Covariance of the unknowns, with those that are only considered at their prior.

    ``information`` is the normal matrix of the record without the priors, ``scale`` [1] what it is divided
    by: misfit over noise, and widening.

    Notes
    -----
    Source: consider covariance of orbit determination (Tapley, Schutz and Born, Statistical Orbit
    Determination).
    """
    prior = table.sigma**2
    fitted, kept = np.flatnonzero(~table.considered), np.flatnonzero(table.considered)
    record = information / scale
    normal = record[np.ix_(fitted, fitted)] + np.diag(1.0 / prior[fitted])
    size = 1.0 / np.sqrt(np.diag(normal))
    inner = np.linalg.inv(normal * np.outer(size, size)) * np.outer(size, size)
    pull = inner @ record[np.ix_(fitted, kept)]
    covariance = np.zeros_like(information)
    covariance[np.ix_(fitted, fitted)] = inner + (pull * prior[kept]) @ pull.T
    covariance[np.ix_(fitted, kept)] = -pull * prior[kept]
    covariance[np.ix_(kept, fitted)] = (-pull * prior[kept]).T
    covariance[kept, kept] = prior[kept]
    return covariance


def _jacobian(problem: Problem, point: Point, window: float, chosen: Mask, pool: Executor | None) -> Array:
    """Slopes of the residual along the chosen unknowns, zero along the others, shape (r, n)."""

    def slope(k: int, step: float) -> Array:
        x = point.x.copy()
        x[k] += step
        return np.asarray((problem.residual(x, window) - point.residual) / step)

    def column(k: int) -> Array:
        step = problem.table.step[k]
        inward = -step if point.x[k] + step > problem.table.upper[k] else step
        try:
            return slope(k, inward)
        except IdentificationError:
            # A simulation that does not get through says nothing of this unknown; a zero column would say
            # that it has no effect, and leave it at its prior with the error of one that was fitted.
            return slope(k, -inward)

    jacobian = np.zeros((len(point.residual), len(point.x)))
    if point.cost < WORST:
        columns = [int(k) for k in np.flatnonzero(chosen)]
        moved = map(column, columns) if pool is None else pool.map(column, columns)
        for k, values in zip(columns, moved, strict=True):
            jacobian[:, k] = values
    return jacobian


def _improved(
    problem: Problem,
    point: Point,
    window: float,
    free: Mask,
    information: Array,
    slope: Array,
    damping: float,
) -> tuple[Point | None, float, int]:
    """A point of lower cost, the damping for the next step, and the simulations it took."""
    table = problem.table
    weight = 1.0 / table.sigma**2
    normal = information + np.diag(weight)
    gradient = slope + weight * (point.x - table.mean)
    held = ((point.x <= table.lower) & (gradient > 0.0)) | ((point.x >= table.upper) & (gradient < 0.0))
    moved = free & ~held
    for trial in range(TRIALS):
        damped = normal + damping * np.diag(np.diag(normal))
        step = np.zeros(len(point.x))
        step[moved] = -np.linalg.solve(damped[np.ix_(moved, moved)], gradient[moved])
        step *= min(1.0, float(1.0 / np.max(np.abs(step) / table.reach, initial=1e-12)))
        candidate = evaluated(problem, np.clip(point.x + step, table.lower, table.upper), window)
        if candidate.cost < point.cost:
            return candidate, damping / EASING, trial + 1
        damping *= LARGEST_RISE
    return None, damping, TRIALS


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """How a search from many starts goes."""

    windows: tuple[float, ...]
    """Ends of the windows, growing [s]."""
    kept: tuple[int, ...] = (4, 4, 3, 2)
    """How many starts go on after each window; the last number holds for the rest."""
    draws: tuple[int, ...] = (200, 200, 100, 50)
    """Points drawn from the covariance of the fits before each window grows; the last number holds for the
    rest."""
    few: int = 2
    """Number of first windows in which only the leading unknowns are fitted."""
    iterations: tuple[int, int] = (4, 8)
    """Most Jacobians per window while several starts run, and of a start that runs alone."""
    tolerances: tuple[float, float] = (2e-3, 2e-3)
    """Share of the cost below which a fit ends, on the way and in the last window."""
    filled: bool = True
    """Whether the number kept is filled with draws where the fits are the same minimum."""
    complete: bool = False
    """Whether the covariance of the best fit is made anew at its minimum, considered unknowns included."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Result of a search from many starts."""

    best: Fit
    """The best fit over the longest window that the model explains."""
    windows: tuple[float, ...]
    """Ends of the windows that it explains [s]."""
    starts: int
    """From how many starts it began."""
    agreeing: int
    """Fits within five percent of the best cost in the last window that several reached."""
    evaluations: int
    """Simulations in all."""
    ended_early: str
    """Why the window stopped growing before the end of the schedule; empty when it did not."""
    finalists: tuple[Fit, ...]
    """All fits over the last window, best first."""


def search(
    problem: Problem,
    starts: Sequence[Array],
    schedule: Schedule,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Search:
    """Fit from many starts over growing windows; those that fall behind are given up on the way.

    Before a window grows, points are drawn from the covariance of the fits so far, and the best of them in
    the longer window start there: what the short window leaves open is searched before the next impact
    decides it.

    With many starts every thread fits one; a single one shares its Jacobian among all threads.
    """
    report = progress or (lambda text, share: None)
    points, finalists, windows, agreeing, ended = list(starts), list[Fit](), list[float](), 0, ""
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        run = _Searching(problem, schedule, pool)
        for stage, window in enumerate(schedule.windows):
            report(f"{len(points)} starts to {1e3 * window:.1f} ms", stage / len(schedule.windows))
            followed = max(1.5, BREAKING * finalists[0].misfit) if finalists else np.inf
            fits = run.fitted(points, window, stage)
            if fits[0].misfit > followed:
                again = run.drawn(finalists, window, stage - 1, more=SECOND_TRY)
                fits = sorted([*fits, *run.fitted(again, window, stage)], key=lambda fit: fit.cost)
            if fits[0].misfit > followed:
                ended = (
                    f"from {1e3 * windows[-1]:.1f} to {1e3 * window:.1f} ms the misfit rises from "
                    f"{finalists[0].misfit:.2g} to {fits[0].misfit:.2g}: the model no longer follows the "
                    "record"
                )
                break
            windows.append(window)
            finalists = fits
            if len(fits) > 1:
                agreeing = sum(fit.cost < 1.05 * fits[0].cost for fit in fits)
            if stage + 1 < len(schedule.windows):
                points = run.drawn(fits, schedule.windows[stage + 1], stage)
        best = finalists[0]
        if schedule.complete:
            best = completed(problem, best, pool=pool)
            run.evaluations += best.evaluations - finalists[0].evaluations
    return Search(
        best=best,
        windows=tuple(windows),
        starts=len(starts),
        agreeing=agreeing,
        evaluations=run.evaluations,
        ended_early=ended,
        finalists=tuple(finalists),
    )


class _Searching:
    """One search under way."""

    def __init__(self, problem: Problem, schedule: Schedule, pool: Executor) -> None:
        self.problem, self.schedule, self.pool = problem, schedule, pool
        self.evaluations = 0
        self.random = np.random.Generator(np.random.Philox(20))

    def fitted(self, points: list[Array], window: float, stage: int) -> list[Fit]:
        """Fits from several points side by side, or from one with its Jacobian side by side; best first."""
        schedule = self.schedule
        alone = len(points) == 1

        def fit(start: Array) -> Fit:
            return fit_window(
                self.problem,
                start,
                window,
                iterations=schedule.iterations[alone],
                tolerance=schedule.tolerances[stage + 1 == len(schedule.windows)],
                fitted=self.problem.table.leading if stage < schedule.few else None,
                pool=self.pool if alone else None,
            )

        fits = [fit(points[0])] if alone else list(self.pool.map(fit, points))
        self.evaluations += sum(fit.evaluations for fit in fits)
        return sorted(fits, key=lambda fit: fit.cost)

    def drawn(self, found: list[Fit], window: float, stage: int, more: int = 1) -> list[Array]:
        """Points for the next window: the best around every minimum, then the best of all others."""
        schedule, table = self.schedule, self.problem.table
        kept = max(schedule.kept[min(stage, len(schedule.kept) - 1)], 2 if more > 1 else 1)
        minima: list[Fit] = []
        for fit in found:
            apart = [np.abs(fit.x - other.x) / table.sigma for other in minima]
            if all(np.max(distance[table.decisive]) > ANOTHER_MINIMUM for distance in apart):
                minima.append(fit)
        fits = minima[:kept]
        each = max(1, more * schedule.draws[min(stage, len(schedule.draws) - 1)] // len(fits))
        free = ~table.considered
        moved = (free if stage >= schedule.few else free & table.leading).astype(np.float64)
        best, others = list[Array](), list[tuple[float, Array]]()
        for fit in fits:
            root = np.linalg.cholesky(fit.covariance + 1e-12 * np.diag(np.diag(fit.covariance)))
            noise = self.random.standard_normal((each, len(fit.x)))
            tried = [fit.x, *(np.clip(fit.x + moved * (root @ z), table.lower, table.upper) for z in noise)]
            costs = self.pool.map(lambda x: evaluated(self.problem, x, window).cost, tried)
            first, *rest = sorted(zip(costs, tried, strict=True), key=lambda pair: pair[0])
            self.evaluations += len(tried)
            best.append(first[1])
            others += rest
        if schedule.filled or more > 1:
            others.sort(key=lambda pair: pair[0])
            best += [point for _, point in others[: kept - len(best)]]
        return best


def sobol_starts(centre: Array, spread: Array, count: int, seed: int = 1) -> list[Array]:
    """Quasi-random starts, the first at the centre; ``spread`` (n,) is half the box (0 keeps a value).

    Source: Sobol sequence with a fixed scramble.
    """
    from scipy.stats import qmc

    moved = np.flatnonzero(spread)
    powers = max(count - 1, 1).bit_length()
    points = qmc.Sobol(d=max(len(moved), 1), seed=seed).random_base2(powers)
    starts = [centre.copy() for _ in range(count)]
    for x, point in zip(starts[1:], points[1:], strict=False):
        x[moved] += spread[moved] * (2.0 * point - 1.0)
    return starts
