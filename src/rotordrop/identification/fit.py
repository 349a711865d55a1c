"""Least squares with priors over growing windows, from many starts at once: the search behind a fit.

A drop is chaotic, so a plain fit over a long window lands in a wrong minimum. Here the window starts with the
first impacts and grows; several starts run side by side on threads; those that fall behind are given up on
the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import cpu_count
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

LARGEST_RISE = 8.0
"""Factor by which the damping of a step rises when the step fails [1]."""

SECOND_TRY = 10
"""Factor on the draws where a longer window was not followed at first [1]."""

EASING = 5.0
WORST = 1e30
TRIALS = 6


class Misfit(Protocol):
    """A problem to fit: weighted residual over a window, and what is believed beforehand."""

    @property
    def prior_mean(self) -> Array:
        """Prior mean of the unknowns, shape (n,)."""

    @property
    def prior_sigma(self) -> Array:
        """Prior standard deviation of the unknowns, shape (n,)."""

    @property
    def step(self) -> Array:
        """Step of the finite differences, shape (n,)."""

    @property
    def reach(self) -> Array:
        """Largest change of an unknown in one iteration, shape (n,)."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns, shape (n,) each."""

    @property
    def leading(self) -> NDArray[np.bool_]:
        """Unknowns that are fitted while many starts run; the others wait at their start, shape (n,)."""

    @property
    def considered(self) -> NDArray[np.bool_]:
        """Unknowns that keep their prior; their uncertainty reaches the others, shape (n,)."""

    def residual(self, x: Array, window: float) -> Array:
        """Residual over its standard deviation up to a time [s], shape (r,)."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A minimum of a misfit over one window; n unknowns.

    Attributes
    ----------
    x : ndarray, shape (n,)
        The unknowns.
    cost : float
        Sum of squares of weighted residuals and priors.
    misfit : float
        Mean square of the weighted residuals [1]; 1 is noise level.
    covariance : ndarray, shape (n, n)
        Covariance of the unknowns (Laplace), scaled up where the misfit exceeds the noise.
    window : float
        End of the window [s].
    evaluations : int
        Simulations used for it.
    active : tuple of bool
        Which unknowns lie at a bound.
    information : ndarray, shape (n, n)
        What the record alone says: the normal matrix without the priors.
    """

    x: Array
    cost: float
    misfit: float
    covariance: Array
    window: float
    evaluations: int
    active: tuple[bool, ...]
    information: Array


@dataclass(frozen=True, kw_only=True)
class _Point:
    x: Array
    residual: Array
    cost: float


def fit_window(
    problem: Misfit,
    start: Array,
    window: float,
    *,
    iterations: int = 12,
    tolerance: float = 1e-4,
    fitted: NDArray[np.bool_] | None = None,
    pool: Executor | None = None,
) -> Fit:
    """Levenberg–Marquardt over one window.

    Parameters
    ----------
    problem : Misfit
        What is fitted.
    start : ndarray, shape (n,)
        Start of the unknowns.
    window : float
        End of the window [s].
    iterations : int
        Bound of the number of Jacobians.
    tolerance : float
        Ends when the cost falls by less than this share.
    fitted : ndarray of bool, shape (n,), optional
        Unknowns that are fitted; all by default.
    pool : Executor, optional
        Threads for the columns of the Jacobian.
    """
    count = 1
    point = _evaluated(problem, np.clip(start, *problem.bounds), window)
    damping = 1e-3
    information = np.zeros((len(start),) * 2)
    chosen = np.ones(len(start), dtype=np.bool_) if fitted is None else fitted
    for _ in range(iterations):
        free = chosen & ~problem.considered
        jacobian = _jacobian(problem, point, window, free, pool)
        count += int(free.sum())
        information = jacobian.T @ jacobian
        gradient = jacobian.T @ point.residual
        better, damping, tried = _improved(problem, point, window, free, information, gradient, damping)
        count += tried
        if better is None:
            break
        fall = (point.cost - better.cost) / max(point.cost, 1e-300)
        point = better
        if fall < tolerance:
            break
    size = max(len(point.residual), 1)
    misfit = float(point.residual @ point.residual / size)
    lower, upper = problem.bounds
    return Fit(
        x=point.x,
        cost=point.cost,
        misfit=misfit,
        covariance=considered_covariance(problem, information, max(misfit, 1.0)),
        window=window,
        evaluations=count,
        active=tuple((point.x <= lower + 1e-9) | (point.x >= upper - 1e-9)),
        information=information,
    )


def completed(problem: Misfit, fit: Fit, *, pool: Executor | None = None) -> Fit:
    """The same fit with its covariance made anew at the minimum, considered unknowns included."""
    point = _evaluated(problem, fit.x, fit.window)
    everything = np.ones(len(fit.x), dtype=np.bool_)
    jacobian = _jacobian(problem, point, fit.window, everything, pool)
    information = jacobian.T @ jacobian
    return replace(
        fit,
        information=information,
        covariance=considered_covariance(problem, information, max(fit.misfit, 1.0)),
        evaluations=fit.evaluations + len(fit.x) + 1,
    )


def _evaluated(problem: Misfit, x: Array, window: float) -> _Point:
    try:
        residual = problem.residual(x, window)
    except IdentificationError:
        return _Point(x=x, residual=np.full(1, np.sqrt(WORST)), cost=WORST)
    prior = (x - problem.prior_mean) / problem.prior_sigma
    return _Point(x=x, residual=residual, cost=float(residual @ residual + prior @ prior))


def _jacobian(
    problem: Misfit, point: _Point, window: float, chosen: NDArray[np.bool_], pool: Executor | None
) -> Array:
    def column(k: int) -> Array:
        x = point.x.copy()
        step = problem.step[k]
        if x[k] + step > problem.bounds[1][k]:
            step = -step
        x[k] += step
        try:
            moved = problem.residual(x, window)
        except IdentificationError:
            return np.zeros_like(point.residual)
        return np.asarray((moved - point.residual) / step)

    if point.cost >= WORST:
        return np.zeros((1, len(point.x)))
    columns = [int(k) for k in np.flatnonzero(chosen)]
    jacobian = np.zeros((len(point.residual), len(point.x)))
    moved = map(column, columns) if pool is None else pool.map(column, columns)
    for k, values in zip(columns, moved, strict=True):
        jacobian[:, k] = values
    return jacobian


def _improved(
    problem: Misfit,
    point: _Point,
    window: float,
    chosen: NDArray[np.bool_],
    information: Array,
    slope: Array,
    damping: float,
) -> tuple[_Point | None, float, int]:
    """A point of lower cost, the damping for the next step, and the simulations it took."""
    lower, upper = problem.bounds
    weight = 1.0 / problem.prior_sigma**2
    normal = information + np.diag(weight)
    gradient = slope + weight * (point.x - problem.prior_mean)
    held = ((point.x <= lower) & (gradient > 0.0)) | ((point.x >= upper) & (gradient < 0.0))
    free = chosen & ~held
    for trial in range(TRIALS):
        damped = normal + damping * np.diag(np.diag(normal))
        step = np.zeros(len(point.x))
        step[free] = -np.linalg.solve(damped[np.ix_(free, free)], gradient[free])
        step *= min(1.0, float(1.0 / np.max(np.abs(step) / problem.reach, initial=1e-12)))
        candidate = _evaluated(problem, np.clip(point.x + step, lower, upper), window)
        if candidate.cost < point.cost:
            return candidate, damping / EASING, trial + 1
        damping *= LARGEST_RISE
    return None, damping, TRIALS


def considered_covariance(problem: Misfit, information: Array, scale: float) -> Array:
    """Covariance of the unknowns, with those that are only considered at their prior.

    Parameters
    ----------
    problem : Misfit
        Gives priors, and which unknowns are considered.
    information : ndarray, shape (n, n)
        Normal matrix of the record without the priors.
    scale : float
        What the information is divided by [1]: misfit over noise, and widening.

    Notes
    -----
    Source: consider covariance of orbit determination (Tapley, Schutz and Born, Statistical Orbit
    Determination).
    """
    prior = problem.prior_sigma**2
    fitted, kept = np.flatnonzero(~problem.considered), np.flatnonzero(problem.considered)
    record = information / scale
    inner = _inverse(record[np.ix_(fitted, fitted)] + np.diag(1.0 / prior[fitted]))
    pull = inner @ record[np.ix_(fitted, kept)]
    covariance = np.zeros_like(information)
    covariance[np.ix_(fitted, fitted)] = inner + (pull * prior[kept]) @ pull.T
    covariance[np.ix_(fitted, kept)] = -pull * prior[kept]
    covariance[np.ix_(kept, fitted)] = (-pull * prior[kept]).T
    covariance[kept, kept] = prior[kept]
    return covariance


def _inverse(normal: Array) -> Array:
    scale = 1.0 / np.sqrt(np.diag(normal))
    return np.asarray(np.linalg.inv(normal * np.outer(scale, scale)) * np.outer(scale, scale))


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """How a search from many starts goes.

    Attributes
    ----------
    windows : tuple of float
        Ends of the windows, growing [s].
    kept : tuple of int
        How many starts go on after each window; the last number holds for the rest.
    draws : tuple of int
        Points drawn from the covariance of the fits before each window grows; the last number holds for the
        rest.
    few : int
        Number of first windows in which only the leading unknowns are fitted.
    iterations : tuple of int
        Jacobians per window while several starts run, and for the last one.
    tolerances : tuple of float
        Share of the cost below which a fit ends, on the way and in the last window.
    breaking : float
        A window whose misfit exceeds that of the window before by this factor (and 1.5) is given up, after a
        second try from many more draws.
    """

    windows: tuple[float, ...]
    kept: tuple[int, ...] = (4, 4, 3, 2)
    draws: tuple[int, ...] = (200, 200, 100, 50)
    few: int = 2
    iterations: tuple[int, int] = (4, 8)
    tolerances: tuple[float, float] = (2e-3, 2e-3)
    breaking: float = 1.6


@dataclass(frozen=True, kw_only=True)
class Search:
    """Result of a search from many starts.

    Attributes
    ----------
    best : Fit
        The best fit over the longest window that the model explains.
    by_window : tuple of Fit
        The best fit of every window.
    starts : ndarray, shape (k, n)
        Where the search began.
    costs : tuple of tuple of float
        Costs of the fits that ran in each window, best first.
    agreeing : int
        Fits within five percent of the best cost in the last window that several reached.
    evaluations : int
        Simulations in all.
    ended_early : str
        Why the window stopped growing before the end of the schedule; empty when it did not.
    finalists : tuple of Fit
        All fits over the last window, best first.
    """

    best: Fit
    by_window: tuple[Fit, ...]
    starts: Array
    costs: tuple[tuple[float, ...], ...]
    agreeing: int
    evaluations: int
    ended_early: str
    finalists: tuple[Fit, ...]


def search(
    problem: Misfit,
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

    Parameters
    ----------
    problem : Misfit
        What is fitted; its residual must be safe to call from several threads.
    starts : sequence of ndarray
        Starts of the unknowns.
    schedule : Schedule
        Windows, and how many starts go on.
    threads : int, optional
        Threads; all cores by default.
    progress : callable, optional
        Called with a text and the share done.
    """
    report = progress or (lambda text, share: None)
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        return _Searching(problem, schedule, pool, report).run(list(starts))


class _Searching:
    """One search under way."""

    def __init__(self, problem: Misfit, schedule: Schedule, pool: Executor, report: Progress) -> None:
        self.problem, self.schedule, self.pool, self.report = problem, schedule, pool, report
        self.evaluations = 0
        self.random = np.random.Generator(np.random.Philox(20))

    def run(self, starts: list[Array]) -> Search:
        schedule = self.schedule
        points, best, costs, agreeing, ended = starts, list[Fit](), list[tuple[float, ...]](), 0, ""
        finalists: list[Fit] = []
        for stage, window in enumerate(schedule.windows):
            self.report(f"{len(points)} starts to {1e3 * window:.1f} ms", stage / len(schedule.windows))
            fits = self._fitted(points, window, stage)
            if best and self._broken(best[-1], fits[0]):
                again = self._drawn(finalists, window, stage - 1, more=SECOND_TRY)
                fits = sorted([*fits, *self._fitted(again, window, stage)], key=lambda fit: fit.cost)
            if best and self._broken(best[-1], fits[0]):
                ended = (
                    f"from {1e3 * best[-1].window:.1f} to {1e3 * window:.1f} ms the misfit rises from "
                    f"{best[-1].misfit:.2g} to {fits[0].misfit:.2g}: the model no longer follows the record"
                )
                break
            best.append(fits[0])
            finalists = fits
            costs.append(tuple(fit.cost for fit in fits))
            if len(fits) > 1:
                agreeing = sum(fit.cost < 1.05 * fits[0].cost for fit in fits)
            if stage + 1 < len(schedule.windows):
                points = self._drawn(fits, schedule.windows[stage + 1], stage)
        return Search(
            best=best[-1],
            by_window=tuple(best),
            starts=np.array(starts),
            costs=tuple(costs),
            agreeing=agreeing,
            evaluations=self.evaluations,
            ended_early=ended,
            finalists=tuple(finalists),
        )

    def _broken(self, before: Fit, fit: Fit) -> bool:
        """Whether a longer window is not followed."""
        return fit.misfit > max(1.5, self.schedule.breaking * before.misfit)

    def _fitted(self, points: list[Array], window: float, stage: int) -> list[Fit]:
        """Fits from several points side by side, or from one with its Jacobian side by side; best first."""
        schedule = self.schedule
        chosen = self.problem.leading if stage < schedule.few else None
        last = stage + 1 == len(schedule.windows)
        alone = len(points) == 1

        def fit(start: Array) -> Fit:
            return fit_window(
                self.problem,
                start,
                window,
                iterations=schedule.iterations[alone],
                tolerance=schedule.tolerances[last],
                fitted=chosen,
                pool=self.pool if alone else None,
            )

        fits = [fit(points[0])] if alone else list(self.pool.map(fit, points))
        self.evaluations += sum(fit.evaluations for fit in fits)
        return sorted(fits, key=lambda fit: fit.cost)

    def _drawn(self, found: list[Fit], window: float, stage: int, more: int = 1) -> list[Array]:
        """Points for the next window: those of the fits and of draws around them that begin it best."""
        schedule = self.schedule
        kept = max(schedule.kept[min(stage, len(schedule.kept) - 1)], 2 if more > 1 else 1)
        fits = found[:kept]
        each = max(1, more * schedule.draws[min(stage, len(schedule.draws) - 1)] // len(fits))
        free = ~self.problem.considered
        moved = (free if stage >= schedule.few else free & self.problem.leading).astype(np.float64)
        points = [fit.x for fit in fits]
        for fit in fits:
            root = np.linalg.cholesky(fit.covariance + 1e-12 * np.diag(np.diag(fit.covariance)))
            noise = self.random.standard_normal((each, len(fit.x)))
            points += [np.clip(fit.x + moved * (root @ z), *self.problem.bounds) for z in noise]
        costs = np.array(list(self.pool.map(lambda x: _evaluated(self.problem, x, window).cost, points)))
        self.evaluations += len(points)
        return [points[k] for k in np.argsort(costs, kind="stable")[:kept]]


def sobol_starts(centre: Array, spread: Array, count: int, seed: int = 1) -> list[Array]:
    """Quasi-random starts, the first at the centre; ``spread`` (n,) is half the box (0 keeps a value).

    Source: Sobol sequence with a fixed scramble.
    """
    from scipy.stats import qmc

    moved = np.flatnonzero(spread)
    powers = max(count - 1, 1).bit_length()
    points = qmc.Sobol(d=max(len(moved), 1), seed=seed).random_base2(powers)
    starts = []
    for k in range(count):
        x = centre.copy()
        if k > 0:
            x[moved] += spread[moved] * (2.0 * points[k] - 1.0)
        starts.append(x)
    return starts
