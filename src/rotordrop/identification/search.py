"""Fits from many starts at once over growing windows: the search behind a fit.

A drop is chaotic, so a plain fit over a long window lands in a wrong minimum. Here the window starts with the
first impacts and grows; several starts run side by side on threads; those that fall behind are given up on
the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np
from numpy.typing import NDArray

from rotordrop.identification.fit import Fit, Misfit, evaluated, fit_window

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

SECOND_TRY = 10
"""Factor on the draws where a longer window was not followed at first [1]."""

ANOTHER_MINIMUM = 0.25
"""Fits that differ by this share of the prior standard deviation are minima of their own [1]."""


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
    """Jacobians per window while several starts run, and for the last one."""
    tolerances: tuple[float, float] = (2e-3, 2e-3)
    """Share of the cost below which a fit ends, on the way and in the last window."""
    breaking: float = 1.6
    """A window whose misfit exceeds that of the window before by this factor (and 1.5) is given up, after a
    second try from many more draws."""
    filled: bool = True
    """Whether the number kept is filled with draws where the fits are the same minimum."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Result of a search from many starts."""

    best: Fit
    """The best fit over the longest window that the model explains."""
    by_window: tuple[Fit, ...]
    """The best fit of every window."""
    starts: Array
    """Where the search began, shape (k, n)."""
    costs: tuple[tuple[float, ...], ...]
    """Costs of the fits that ran in each window, best first."""
    agreeing: int
    """Fits within five percent of the best cost in the last window that several reached."""
    evaluations: int
    """Simulations in all."""
    ended_early: str
    """Why the window stopped growing before the end of the schedule; empty when it did not."""
    finalists: tuple[Fit, ...]
    """All fits over the last window, best first."""


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
        """Points for the next window: the best around every minimum, then the best of all others."""
        schedule = self.schedule
        kept = max(schedule.kept[min(stage, len(schedule.kept) - 1)], 2 if more > 1 else 1)
        fits = self._minima(found)[:kept]
        each = max(1, more * schedule.draws[min(stage, len(schedule.draws) - 1)] // len(fits))
        free = ~self.problem.considered
        moved = (free if stage >= schedule.few else free & self.problem.leading).astype(np.float64)
        groups = []
        for fit in fits:
            root = np.linalg.cholesky(fit.covariance + 1e-12 * np.diag(np.diag(fit.covariance)))
            noise = self.random.standard_normal((each, len(fit.x)))
            own = [np.clip(fit.x + moved * (root @ z), *self.problem.bounds) for z in noise]
            groups.append(self._sorted([fit.x, *own], window))
        best = [group[0][1] for group in groups]
        if schedule.filled or more > 1:
            others = sorted((pair for group in groups for pair in group[1:]), key=lambda pair: pair[0])
            best += [point for _, point in others[: kept - len(best)]]
        return best

    def _sorted(self, points: list[Array], window: float) -> list[tuple[float, Array]]:
        """Points with their cost, the best first."""
        costs = list(self.pool.map(lambda x: evaluated(self.problem, x, window).cost, points))
        self.evaluations += len(points)
        return sorted(zip(costs, points, strict=True), key=lambda pair: pair[0])

    def _minima(self, fits: list[Fit]) -> list[Fit]:
        """Fits that are minima of their own, best first."""
        own: list[Fit] = []
        for fit in fits:
            apart = [np.abs(fit.x - other.x) / self.problem.prior_sigma for other in own]
            if all(np.max(distance[self.problem.decisive]) > ANOTHER_MINIMUM for distance in apart):
                own.append(fit)
        return own


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
