"""Least squares with priors over one window of a record."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError

Array = NDArray[np.float64]

LARGEST_RISE = 8.0
"""Factor by which the damping of a step rises when the step fails [1]."""

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
    def decisive(self) -> NDArray[np.bool_]:
        """Unknowns that tell two minima apart: those that are sought, shape (n,)."""

    @property
    def considered(self) -> NDArray[np.bool_]:
        """Unknowns that keep their prior; their uncertainty reaches the others, shape (n,)."""

    def residual(self, x: Array, window: float) -> Array:
        """Residual over its standard deviation up to a time [s], shape (r,)."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A minimum of a misfit over one window; n unknowns."""

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
    active: tuple[bool, ...]
    """Which unknowns lie at a bound."""
    information: Array
    """What the record alone says: the normal matrix without the priors, shape (n, n)."""


@dataclass(frozen=True, kw_only=True)
class Point:
    """Unknowns with their weighted residual and the cost, priors included."""

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
    point = evaluated(problem, np.clip(start, *problem.bounds), window)
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
    point = evaluated(problem, fit.x, fit.window)
    everything = np.ones(len(fit.x), dtype=np.bool_)
    jacobian = _jacobian(problem, point, fit.window, everything, pool)
    information = jacobian.T @ jacobian
    return replace(
        fit,
        information=information,
        covariance=considered_covariance(problem, information, max(fit.misfit, 1.0)),
        evaluations=fit.evaluations + len(fit.x) + 1,
    )


def evaluated(problem: Misfit, x: Array, window: float) -> Point:
    """Residual and cost at a point; beyond all measure where the simulation does not get through."""
    try:
        residual = problem.residual(x, window)
    except IdentificationError:
        return Point(x=x, residual=np.full(1, np.sqrt(WORST)), cost=WORST)
    prior = (x - problem.prior_mean) / problem.prior_sigma
    return Point(x=x, residual=residual, cost=float(residual @ residual + prior @ prior))


def _jacobian(
    problem: Misfit, point: Point, window: float, chosen: NDArray[np.bool_], pool: Executor | None
) -> Array:
    def column(k: int) -> Array:
        inward = -1.0 if point.x[k] + problem.step[k] > problem.bounds[1][k] else 1.0
        try:
            return slope(k, inward * problem.step[k])
        except IdentificationError:
            # A simulation that does not get through says nothing of this unknown; a zero column would say
            # that it has no effect, and leave it at its prior with the error of one that was fitted.
            return slope(k, -inward * problem.step[k])

    def slope(k: int, step: float) -> Array:
        x = point.x.copy()
        x[k] += step
        return np.asarray((problem.residual(x, window) - point.residual) / step)

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
    point: Point,
    window: float,
    chosen: NDArray[np.bool_],
    information: Array,
    slope: Array,
    damping: float,
) -> tuple[Point | None, float, int]:
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
        candidate = evaluated(problem, np.clip(point.x + step, lower, upper), window)
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
