"""Support of each touchdown bearing from the first impacts (Neisi 2020, section 3.2).

The sensors' displacements over the first impacts are fitted by the drop model. With the supports, everything
else that shapes these displacements is fitted under its prior: contact, friction, preload, race, and the
initial state with the sensors' gains and zeros as far as the fall left them open. So the supports carry the
uncertainty of all of it.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from os import cpu_count

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Role
from rotordrop.identification.directions import DIRECTIONS, influential_directions
from rotordrop.identification.fit import Fit, completed, considered_covariance
from rotordrop.identification.parameter_vector import ParameterVector, joined, nuisance_vector, support_vector
from rotordrop.identification.replica import Replica
from rotordrop.identification.search import Progress, Schedule, Search, search, sobol_starts
from rotordrop.known import NINETY, Correlation, Known, Status

Array = NDArray[np.float64]

WINDOWS = (1.75e-3, 3.25e-3, 5.25e-3, 7.25e-3, 11e-3, 16e-3)
"""Ends of the windows after the later of the first contacts [s]."""

LONGEST_WINDOW = 25e-3
"""End of the window of the last fit, with the friction of the sweep, after the later first contact [s]."""

COARSE_WINDOWS = 3
"""How many of them are searched with a coarse basis; the last is fitted again with the fine one."""

WIDENING = 3.2
"""Factor on standard errors for what the linearised fit leaves out [1]: with 2, 78 % of the 90 % intervals of
stiffness, mass and damping held the truth on 12 machines, with 3.2, 83 % on 12 others."""

SWEEP_WIDENING = 2.0
"""The same for the draws with which friction is swept: wider ones leave the neighbourhood of the fit [1]."""

ALL_DIRECTIONS = 40
"""How many of them the last fit follows: with 16, what is left biases stiff supports by two percent."""

LEADING_DIRECTIONS = 8
"""How many of them while many starts run."""

MODEL_NOISE = 0.1e-6
"""What the reduced rotor leaves out, beside the sensor noise [m]."""

STEP = 1e-4
BOUND_FACTOR = np.log(6.0)
"""The search may leave the prior mean by this much, in logarithms, on both sides."""

UNDETERMINED = 0.7
"""Posterior over prior standard deviation above which the record does not determine a value [1]."""


@dataclass(frozen=True, kw_only=True)
class ImpactFit:
    """The problem of the first impacts: parameters by their logarithm, then directions of the
    initial state.
    """

    replica: Replica
    """The drop to be run again."""
    vector: ParameterVector
    """Supports first, then what is marginalised."""
    directions: Array
    """Directions of the unknowns of the fall, one standard deviation each, shape (u, K)."""
    states: Array
    """What these directions change in the state at the start of the simulation, shape (n, K)."""
    unbalances: Array
    """What they change in the modal unbalance, shape (2, m, K)."""
    remaining_directions: Array
    """Square root of what is left of the covariance: it matters too little to be fitted along, shape (u, u).
    """

    @cached_property
    def prior_mean(self) -> Array:
        """Prior mean of the unknowns, shape (n,)."""
        return np.concatenate([self.vector.mean, np.zeros(self.directions.shape[1])])

    @cached_property
    def guess(self) -> Array:
        """Where the search begins, shape (n,): what is sought at the guesses of the machine file."""
        begin = self.prior_mean.copy()
        for k, unknown in enumerate(self.vector.unknowns):
            if unknown.parameter.role is Role.SOUGHT:
                begin[k] = unknown.begin
        return begin

    @cached_property
    def prior_sigma(self) -> Array:
        """Prior standard deviation of the unknowns, shape (n,)."""
        return np.concatenate([self.vector.sigma, np.ones(self.directions.shape[1])])

    @cached_property
    def step(self) -> Array:
        """Step of the finite differences, shape (n,)."""
        own = [STEP if unknown.logarithmic else 1e-2 * unknown.sigma for unknown in self.vector.unknowns]
        return np.concatenate([own, np.full(self.directions.shape[1], 0.02)])

    @cached_property
    def reach(self) -> Array:
        """Largest change of an unknown in one iteration, shape (n,)."""
        own = [0.5 if unknown.logarithmic else 2.0 * unknown.sigma for unknown in self.vector.unknowns]
        return np.concatenate([own, np.full(self.directions.shape[1], 3.0)])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns, shape (n,) each."""
        own = [
            BOUND_FACTOR if unknown.logarithmic else 5.0 * unknown.sigma for unknown in self.vector.unknowns
        ]
        width = np.concatenate([own, np.full(self.directions.shape[1], 6.0)])
        return self.prior_mean - width, self.prior_mean + width

    @cached_property
    def noise(self) -> Array:
        """Standard deviation of the displacements along the sensors [m], shape (S,)."""
        return np.hypot(self.replica.noise, MODEL_NOISE)

    @cached_property
    def leading(self) -> NDArray[np.bool_]:
        """Unknowns that the first window tells apart: supports, contact stiffness, first directions."""
        own = [unknown.parameter.leading for unknown in self.vector.unknowns]
        return np.array(own + [k < LEADING_DIRECTIONS for k in range(self.directions.shape[1])])

    @cached_property
    def decisive(self) -> NDArray[np.bool_]:
        """Stiffness and mass of the supports, shape (n,)."""
        own = [unknown.parameter.decisive for unknown in self.vector.unknowns]
        return np.array(own + [False] * self.directions.shape[1])

    @cached_property
    def considered(self) -> NDArray[np.bool_]:
        """Unknowns that keep their prior though their uncertainty is carried.

        A fit would move what a record tells little of to hide what the model lacks, and the mean stress
        would follow.
        """
        own = [unknown.parameter.role is Role.CONSIDERED for unknown in self.vector.unknowns]
        return np.array(own + [False] * self.directions.shape[1])

    def split(self, x: Array) -> tuple[Array, Array]:
        """Parameters of the bearings, and unknowns of the fall."""
        count = len(self.vector)
        return x[:count], self.replica.initial.mean + self.directions @ x[count:]

    def start(self, x: Array) -> tuple[Array, Array]:
        """State at the start of the simulation, and modal unbalance (2, m)."""
        moved = x[len(self.vector) :]
        p = self.replica.model.parameters
        unbalance = np.stack([p.unbalance_cos, p.unbalance_sin]) + self.unbalances @ moved
        return self.replica.state + self.states @ moved, unbalance

    def residual(self, x: Array, window: float) -> Array:
        """Weighted residual up to a time from power-off [s], shape (r,)."""
        replica = self.replica
        theta, fall = self.split(x)
        count = replica.until(window)
        rest = fall[replica.initial.unknowns.rest].reshape(-1, 2)
        rows = replica.bearing_rows(self.vector, theta, rest)
        states, _ = replica.states(rows, replica.time[:count], *self.start(x))
        return np.asarray(
            ((replica.predicted(states, fall) - replica.deviation[:count]) / self.noise).ravel()
        )


@dataclass(frozen=True, kw_only=True)
class SupportFit:
    """Supports found from the first impacts, with everything that was fitted beside them."""

    problem: ImpactFit
    """The problem that was solved, with the fine basis."""
    coarse: Search
    """Search from many starts over the first windows."""
    search: Search
    """Fits over the longer windows."""
    covariance: Array
    """Covariance of all unknowns, widened for what the linearised fit leaves out, shape (n, n)."""
    values: dict[str, Known]
    """Identified value by path, such as ``"NDE.support.stiffness"``."""
    correlations: tuple[Correlation, ...]
    """Correlation of pairs of support parameters of one bearing."""


def impact_problem(replica: Replica, *, directions: int = DIRECTIONS) -> ImpactFit:
    """The problem of the first impacts for a drop that can be run again."""
    found = influential_directions(replica, directions)
    return ImpactFit(
        replica=replica,
        vector=joined(support_vector(replica.model), nuisance_vector(replica.model)),
        directions=found.unknowns,
        states=found.states,
        unbalances=found.unbalances,
        remaining_directions=found.remaining,
    )


def fit_support(
    coarse: ImpactFit,
    fine: ImpactFit,
    later_contact: float,
    *,
    starts: int = 8,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SupportFit:
    """Find the supports by least squares on the first impacts.

    Parameters
    ----------
    coarse, fine : ImpactFit
        The problem with a basis for the search from many starts, and with one for the result.
    later_contact : float
        Time of the later of the first contacts, from power-off [s]; the windows count from it.
    starts : int
        Quasi-random starts.
    threads : int, optional
        Threads; all cores by default.
    progress : callable, optional
        Called with a text and the share done.

    Notes
    -----
    Source: Neisi 2020, section 3.2 (least squares up to 0.015 s). Differs from the paper: windows that grow,
    many starts, horizontal displacements too, and everything else that is uncertain is marginalised.
    """
    report = progress or (lambda text, share: None)
    last = min(coarse.replica.time[-1], fine.replica.time[-1])
    windows = tuple(later_contact + w for w in WINDOWS if later_contact + w <= last)
    spread = np.zeros(len(coarse.prior_mean))
    supports = len(support_vector(coarse.replica.model))
    spread[:supports] = NINETY * coarse.prior_sigma[:supports]
    first = search(
        coarse,
        [coarse.guess, *sobol_starts(coarse.prior_mean, spread, starts)[1:]],
        Schedule(windows=windows[:COARSE_WINDOWS]),
        threads=threads,
        progress=lambda text, share: report(text, 0.5 * share),
    )
    found = search(
        fine,
        [_handed_over(fit.x, coarse, fine) for fit in first.finalists[:2]],
        Schedule(
            windows=windows[COARSE_WINDOWS - 1 :],
            kept=(2,),
            draws=(50,),
            filled=False,
            few=0,
            iterations=(10, 10),
            tolerances=(1e-3, 3e-4),
        ),
        threads=threads,
        progress=lambda text, share: report(text, 0.5 + 0.5 * share),
    )
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        best = completed(fine, found.best, pool=pool)
    found = replace(found, best=best, evaluations=found.evaluations + len(best.x) + 1)
    covariance = widened_covariance(fine, best, SWEEP_WIDENING)
    return SupportFit(
        problem=fine,
        coarse=first,
        search=found,
        covariance=covariance,
        values=identified_values(fine, found.best.x, covariance, active=found.best.active),
        correlations=_correlations(fine, found, supports),
    )


def widened_covariance(problem: ImpactFit, fit: Fit, widening: float = WIDENING) -> Array:
    """Covariance with the information of the record reduced for what the linearised fit leaves out."""
    return considered_covariance(problem, fit.information, max(fit.misfit, 1.0) * widening**2)


def refit_with_friction(
    problem: ImpactFit,
    fit: Fit,
    friction: Known,
    *,
    longest: float | None = None,
    threads: int | None = None,
) -> tuple[ImpactFit, Array, Array]:
    """Fit once more with the friction that the sweep found, more of the fall, and over a longer window.

    Parameters
    ----------
    problem, fit
        The problem and its best fit.
    friction : Known
        Friction coefficient of the sweep.
    longest : float, optional
        End of a longer window [s from power-off]; left out where the model does not follow the record so far.
    threads : int, optional
        Threads; all cores by default.

    Returns
    -------
    problem : ImpactFit
        The problem with that friction as its prior.
    x, covariance : ndarray, shapes (n,), (n, n)
        Best unknowns and their widened covariance.
    """
    place = problem.vector.friction
    unknowns = list(problem.vector.unknowns)
    error = (friction.standard_error or 0.0) / friction.value
    found = math.log(friction.value)
    unknowns[place] = replace(unknowns[place], mean=found, start=found, sigma=max(error, 1e-4))
    known = replace(
        impact_problem(problem.replica, directions=ALL_DIRECTIONS),
        vector=ParameterVector(unknowns=tuple(unknowns)),
    )
    start = known.prior_mean.copy()
    start[: len(fit.x)] = fit.x
    start[place] = known.prior_mean[place]
    end = min(longest or fit.window, float(problem.replica.time[-1]))
    windows = (fit.window, end) if end > fit.window else (fit.window,)
    again = search(
        known,
        [start],
        Schedule(windows=windows, kept=(1,), draws=(50,), few=0, iterations=(6, 8), tolerances=(1e-3, 5e-4)),
        threads=threads,
    ).best
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        again = completed(known, again, pool=pool)
    return known, again.x, widened_covariance(known, again)


def _handed_over(x: Array, coarse: ImpactFit, fine: ImpactFit) -> Array:
    """The same parameters for another basis; the directions of the initial state begin anew."""
    count = len(coarse.vector)
    return np.concatenate([x[:count], np.zeros(fine.directions.shape[1])])


def identified_values(
    problem: ImpactFit,
    x: Array,
    covariance: Array,
    *,
    active: tuple[bool, ...] = (),
    given: bool = False,
) -> dict[str, Known]:
    """Values of the parameters by path, each with error, interval, start, bounds and verdict.

    Parameters
    ----------
    problem : ImpactFit
        The problem they belong to.
    x, covariance : ndarray, shapes (n,), (n, n)
        The unknowns and their covariance.
    active : tuple of bool
        Which unknowns lie at a bound.
    given : bool
        Whether the values were taken over and not found from this record.
    """
    values = {}
    low, high = problem.bounds
    for k, unknown in enumerate(problem.vector.unknowns):
        mean, error = float(x[k]), float(np.sqrt(covariance[k, k]))
        at_bound = bool(active[k]) if active else False
        value = unknown.value_of(mean)
        values[unknown.path] = Known(
            value=value,
            status="taken over" if given else _verdict(at_bound, error, unknown.sigma),
            standard_error=unknown.standard_error(mean, error),
            interval_90=(unknown.value_of(mean - NINETY * error), unknown.value_of(mean + NINETY * error)),
            start=unknown.value_of(unknown.begin),
            bounds=(unknown.value_of(float(low[k])), unknown.value_of(float(high[k]))),
            unit=unknown.unit,
        )
    return values


def _verdict(at_bound: bool, error: float, prior: float) -> Status:
    if at_bound:
        return "at its bound"
    return "the record does not determine it" if error > UNDETERMINED * prior else "determined"


def _correlations(problem: ImpactFit, found: Search, supports: int) -> tuple[Correlation, ...]:
    covariance = found.best.covariance[:supports, :supports]
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    unknowns = problem.vector.unknowns
    return tuple(
        Correlation(first=unknowns[k].path, second=unknowns[i].path, value=float(correlation[i, k]))
        for i in range(supports)
        for k in range(i)
        if unknowns[i].owner == unknowns[k].owner
    )
