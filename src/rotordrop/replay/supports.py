"""Support of each touchdown bearing from the first impacts, by least squares (Neisi 2020, section 3.2).

A drop is chaotic, so that a fit over a long window ends in a wrong minimum. The window therefore begins with
the first impacts and grows. Several starts go into the first windows, and the best minima go on.

With the supports, everything else that shapes the displacements is fitted under its prior: contact,
friction, race, and what the fall left open of initial state, gains and zeros. The errors of the supports hold
all of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import combinations
from os import cpu_count

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Role
from rotordrop.errors import IdentificationError
from rotordrop.known import NINETY, Correlation, Known, Status
from rotordrop.replay.problem import DIRECTIONS, Mask, ReplayProblem

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

WINDOWS = (1.75e-3, 3.25e-3, 5.25e-3, 7.25e-3, 11e-3, 16e-3)
"""Ends of the windows after the later of the first contacts [s]; each holds about one impact more."""

LONGEST_WINDOW = 25e-3
"""End of the last window, with the friction of the sweep, after the later first contact [s]."""

FIRST_DIRECTIONS = (8, 8, 16)
"""Directions of the fall that the first windows follow; they hold too few readings for more."""

MINIMA = (4, 4, 2)
"""How many minima go on after the first windows; then one does."""

ITERATIONS = (6, 12)
"""Largest number of iterations while several minima go on, and later."""

TOLERANCE = (2e-3, 3e-4)
"""Share of the cost below whose fall a fit ends, while several minima go on and later [1]."""

ANOTHER_MINIMUM = 0.25
"""Fits whose supports differ by less, in prior standard deviations, are one minimum [1]; chosen."""

BREAKING = 1.6
"""Rise of the misfit from one window to the next at which the model no longer follows the record [1]."""

SECOND_TRY = 200
"""Points drawn around a fit for another start where a longer window was not followed at first."""

WIDENING = 4.0
"""Factor on standard errors for what the linearised fit leaves out [1]: with 3.2, 81 % of the 90 % intervals
of stiffness, mass and damping held the truth on 8 machines (studies/replay, seeds 1120 to 1127)."""

SWEEP_WIDENING = 2.0
"""The same for the draws with which friction is swept: wider ones leave the neighbourhood of the fit [1]."""

UNDETERMINED = 0.7
"""Posterior over prior standard deviation above which the record does not determine a value [1]."""


@dataclass(frozen=True, kw_only=True)
class ImpactFit:
    """A minimum of the squared residual and priors over one window."""

    z: Array
    """Whitened unknowns, shape (P + u,)."""
    cost: float
    """Sum of squares of residual and priors [1]."""
    misfit: float
    """Mean square of the residual [1]; 1 is noise level."""
    window: float
    """End of the window [s from power-off]."""
    at_bound: Mask
    """Which unknowns lie at a bound, shape (P + u,)."""
    simulations: int
    """Simulations used."""


@dataclass(frozen=True, kw_only=True)
class SupportFit:
    """The fit over the longest window that the model follows, and how it was reached."""

    best: ImpactFit
    covariance: Array
    """Covariance of the whitened unknowns, shape (P + u, P + u), with the widening."""
    sweep_covariance: Array
    """The same for the draws with which friction is swept."""
    windows: tuple[float, ...]
    """Ends of the windows that were followed [s from power-off]."""
    starts: int
    agreeing: int
    """Minima within five percent of the best in the last window that several reached."""
    simulations: int
    ended_early: str
    """Why the window stopped growing; empty when it did not."""


def fit_supports(
    problem: ReplayProblem,
    later_contact: float,
    *,
    starts: int = 8,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SupportFit:
    """Find the supports by least squares on the first impacts.

    Parameters
    ----------
    problem : ReplayProblem
        The recorded drop.
    later_contact : float
        Time of the later of the first contacts [s from power-off]; the windows count from it.
    starts : int
        Quasi-random starts of stiffness, mass and damping; the first is the guess of the machine file.
    threads : int, optional
        Threads; all cores by default.
    progress : callable, optional
        Called with a text and the share done.

    Notes
    -----
    Source: Neisi 2020, section 3.2 (least squares up to 0.015 s). Differs from the paper: windows that grow,
    several starts, horizontal displacements too, and everything else that is uncertain is fitted as well.
    """
    windows = [later_contact + w for w in WINDOWS if later_contact + w <= problem.time[-1]]
    points = _starts(problem, starts)
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        return _grown(problem, points, windows, pool, progress or (lambda text, share: None))


def refit_with_friction(
    problem: ReplayProblem,
    fit: SupportFit,
    friction: Known,
    longest: float,
    *,
    threads: int | None = None,
) -> tuple[ReplayProblem, SupportFit]:
    """Fit once more with the friction of the sweep, over a window that may grow to ``longest`` [s].

    Returns the problem with that friction as prior, and its fit.
    """
    error = max((friction.standard_error or 0.0) / friction.value, 1e-4)
    known = problem.with_friction(math.log(friction.value), error)
    z = fit.best.z.copy()
    z[known.friction] = 0.0
    end = min(longest, float(problem.time[-1]))
    windows = [fit.best.window] + [end] * (end > fit.best.window)
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        return known, _grown(known, [z], windows, pool)


def _starts(problem: ReplayProblem, count: int) -> list[Array]:
    """The guess, then a scrambled Sobol sequence over the 90 % intervals of the sought parameters."""
    from scipy.stats import qmc

    sought = np.flatnonzero(problem.has_role(Role.SOUGHT))[:-1]  # the last is the friction, which is swept
    powers = max(count - 1, 1).bit_length()
    box = qmc.Sobol(d=len(sought), seed=1).random_base2(powers)
    points = [problem.guess()]
    for row in box[1:count]:
        z = np.zeros(problem.size)
        z[sought] = NINETY * (2.0 * row - 1.0)
        points.append(z)
    return points


def _grown(
    problem: ReplayProblem,
    points: Sequence[Array],
    windows: Sequence[float],
    pool: Executor,
    report: Progress = lambda text, share: None,
) -> SupportFit:
    """Fit from all points over growing windows, as far as the model follows the record."""
    starts, several = len(points), len(points) > 1
    best: list[ImpactFit] = []
    agreeing, simulations, ended_early = 1, 0, ""
    for stage, window in enumerate(windows):
        report(f"{len(points)} starts to {1e3 * window:.1f} ms", stage / len(windows))
        early = several and stage < len(MINIMA)
        directions = FIRST_DIRECTIONS[stage] if early else DIRECTIONS
        fits = [_fitted(problem, z, window, directions, early, pool) for z in points]
        if best and _breaks(best[-1], min(fits, key=_cost)):
            again = _drawn(problem, best[-1], window, directions, pool)
            fits += [_fitted(problem, z, window, directions, early, pool) for z in again]
            simulations += SECOND_TRY
        fits.sort(key=_cost)
        simulations += sum(fit.simulations for fit in fits)
        if best and _breaks(best[-1], fits[0]):
            ended_early = (
                f"the model no longer follows the record beyond {1e3 * best[-1].window:.1f} ms after "
                f"power-off (misfit {fits[0].misfit:.2g} times the noise variance, {best[-1].misfit:.2g} "
                "before)"
            )
            break
        if len(fits) > 1:
            agreeing = sum(fit.cost <= 1.05 * fits[0].cost for fit in fits)
        best.append(fits[0])
        points = _minima(problem, fits)[: MINIMA[stage] if early else 1]
    final = best[-1]
    if not math.isfinite(final.cost):
        raise IdentificationError(
            "no simulation from the guesses for supports and contact gets through the first impacts. Check "
            "the guesses of the machine file."
        )
    slopes = _slopes(problem, final, pool)
    return SupportFit(
        best=final,
        covariance=posterior_covariance(problem, final, slopes, WIDENING),
        sweep_covariance=posterior_covariance(problem, final, slopes, SWEEP_WIDENING),
        windows=tuple(fit.window for fit in best),
        starts=starts,
        agreeing=agreeing,
        simulations=simulations + problem.size,
        ended_early=ended_early,
    )


def _cost(fit: ImpactFit) -> float:
    return fit.cost


def _breaks(before: ImpactFit, fit: ImpactFit) -> bool:
    return fit.misfit > max(1.5, BREAKING * before.misfit)


def _fitted(
    problem: ReplayProblem, z: Array, window: float, directions: int, early: bool, pool: Executor
) -> ImpactFit:
    """The minimum nearest to a point, by the library's trust-region method within the bounds."""
    from scipy.optimize import least_squares

    free = problem.fitted(directions)
    whole = z.copy()

    def at(part: Array) -> Array:
        point = whole.copy()
        point[free] = part
        return point

    def residual(part: Array) -> Array:
        try:
            return np.concatenate([problem.residual(at(part), window), part])
        except IdentificationError:
            return np.full(size, np.inf)  # the method shortens its step

    def jacobian(part: Array) -> Array:
        return np.vstack([problem.jacobian(at(part), window, free, pool), np.eye(len(part))])

    low, high = (bound[free] for bound in problem.bounds)
    begin = np.clip(z[free], 0.999 * low, 0.999 * high)
    size = problem.samples_until(window) * len(problem.noise) + len(begin)
    nothing = np.zeros(problem.size, dtype=np.bool_)
    if not np.isfinite(residual(begin)).all():
        return ImpactFit(z=z, cost=math.inf, misfit=math.inf, window=window, at_bound=nothing, simulations=1)
    found = least_squares(
        residual,
        begin,
        jacobian,
        bounds=(low, high),
        ftol=TOLERANCE[0 if early else 1],
        xtol=1e-6,
        gtol=1e-8,
        max_nfev=ITERATIONS[0 if early else 1],
    )
    readings = found.fun[: len(found.fun) - len(begin)]
    at_bound = nothing.copy()
    at_bound[free] = found.active_mask != 0
    return ImpactFit(
        z=at(found.x),
        cost=2.0 * float(found.cost),
        misfit=float(np.mean(readings**2)),
        window=window,
        at_bound=at_bound,
        simulations=1 + found.nfev + found.njev * (len(begin) + 1),
    )


def _minima(problem: ReplayProblem, fits: Sequence[ImpactFit]) -> list[Array]:
    """Unknowns of the fits that are different minima, the best first."""
    sought, minima = problem.has_role(Role.SOUGHT), list[Array]()
    for fit in fits:
        if all(np.max(np.abs(fit.z - other)[sought]) > ANOTHER_MINIMUM for other in minima):
            minima.append(fit.z)
    return minima


def _drawn(
    problem: ReplayProblem, fit: ImpactFit, window: float, directions: int, pool: Executor
) -> list[Array]:
    """The two best in a longer window of points drawn around a fit: what the shorter one left open."""
    random = np.random.Generator(np.random.Philox(20))
    root = np.linalg.cholesky(posterior_covariance(problem, fit, _slopes(problem, fit, pool), 1.0))
    moved = problem.fitted(directions)
    points = [
        np.clip(fit.z + moved * (root @ random.standard_normal(problem.size)), *problem.bounds)
        for _ in range(SECOND_TRY)
    ]
    costs = list(pool.map(lambda z: problem.misfit(z, window) + float(z @ z), points))
    return [points[k] for k in np.argsort(costs)[:2]]


def _slopes(problem: ReplayProblem, fit: ImpactFit, pool: Executor) -> Array:
    """Change of the residual per unknown at a fit, shape (r, P + u), zero for directions left out."""
    chosen = problem.fitted(DIRECTIONS) | problem.has_role(Role.CONSIDERED)
    columns = problem.jacobian(fit.z, fit.window, chosen, pool)
    slopes = np.zeros((len(columns), problem.size))
    slopes[:, chosen] = columns
    return slopes


def posterior_covariance(problem: ReplayProblem, fit: ImpactFit, slopes: Array, widening: float) -> Array:
    """Covariance of the whitened unknowns at a fit, shape (P + u, P + u).

    Considered parameters keep their prior; their uncertainty enters the covariance of the others.

    Notes
    -----
    Source: consider covariance of orbit determination (Tapley, Schutz and Born, Statistical Orbit
    Determination).
    """
    fitted, considered = problem.fitted(DIRECTIONS), problem.has_role(Role.CONSIDERED)
    scaled = slopes / (widening * math.sqrt(max(fit.misfit, 1.0)))
    inner = np.linalg.inv(scaled[:, fitted].T @ scaled[:, fitted] + np.eye(int(fitted.sum())))
    pull = inner @ scaled[:, fitted].T @ scaled[:, considered]
    covariance = np.eye(problem.size)
    covariance[np.ix_(fitted, fitted)] = inner + pull @ pull.T
    covariance[np.ix_(fitted, considered)] = -pull
    covariance[np.ix_(considered, fitted)] = -pull.T
    return covariance


def identified_values(
    problem: ReplayProblem, z: Array, covariance: Array, at_bound: Mask | None = None
) -> dict[str, Known]:
    """Parameters by path with error, interval, start, bounds and verdict.

    Without ``at_bound`` the values were taken over from an earlier estimate and not identified here.
    """
    low, high = (problem.theta(bound) for bound in problem.bounds)
    errors = problem.sigma * np.sqrt(np.diag(covariance))[: len(problem.unknowns)]
    values = {}
    for k, (unknown, theta) in enumerate(zip(problem.unknowns, problem.theta(z), strict=True)):
        mean, error = float(theta), float(errors[k])
        status: Status = "determined"
        if at_bound is None:
            status = "taken over"
        elif at_bound[k]:
            status = "at its bound"
        elif error > UNDETERMINED * unknown.sigma:
            status = "the record does not determine it"
        values[unknown.path] = Known(
            value=unknown.value_of(mean),
            status=status,
            standard_error=unknown.standard_error(mean, error),
            interval_90=(unknown.value_of(mean - NINETY * error), unknown.value_of(mean + NINETY * error)),
            start=unknown.value_of(unknown.begin),
            bounds=(unknown.value_of(float(low[k])), unknown.value_of(float(high[k]))),
            unit=unknown.unit,
        )
    return values


def support_correlations(problem: ReplayProblem, covariance: Array) -> tuple[Correlation, ...]:
    """Correlations of the support parameters of each bearing."""
    error = np.sqrt(np.diag(covariance))
    sought = [k for k, u in enumerate(problem.unknowns) if u.parameter.role is Role.SOUGHT and u.owner]
    return tuple(
        Correlation(
            first=problem.paths[i],
            second=problem.paths[k],
            value=float(covariance[i, k] / (error[i] * error[k])),
        )
        for i, k in combinations(sought, 2)
        if problem.unknowns[i].owner == problem.unknowns[k].owner
    )
