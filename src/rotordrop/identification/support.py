"""Support of each touchdown bearing from the first impacts (Neisi 2020, section 3.2).

The sensors' displacements over the first impacts are fitted by the drop model. With the supports, everything
else that shapes these displacements is fitted under its prior: contact, friction, preload, race, and the
initial state with the sensors' gains and zeros as far as the fall left them open. So the supports carry the
uncertainty of all of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import IdentifiedValue, Verdict
from rotordrop.identification.fit import (
    Progress,
    Schedule,
    Search,
    search,
    sobol_starts,
    widened_covariance,
)
from rotordrop.identification.parameter_vector import (
    ParameterVector,
    joined,
    nuisance_vector,
    support_vector,
)
from rotordrop.identification.replica import Replica

Array = NDArray[np.float64]

WINDOWS = (1.75e-3, 3.25e-3, 5.25e-3, 7.25e-3, 11e-3, 16e-3)
"""Ends of the windows after the later of the first contacts [s]."""

COARSE_WINDOWS = 3
"""How many of them are searched with a coarse basis; the last of these is the first of the fine basis."""

WIDENING = 1.5
"""Factor on standard errors for what the linearised fit leaves out [1]."""

DIRECTIONS = 16
"""Directions of the initial state's uncertainty that are fitted along."""

LEADING_DIRECTIONS = 8
"""How many of them while many starts run."""

MODEL_NOISE = 0.1e-6
"""What the reduced rotor leaves out, beside the sensor noise [m]."""

STEP = 1e-4
BOUND_FACTOR = np.log(6.0)
"""The search may leave the prior mean by this much, in logarithms, on both sides."""

UNDETERMINED = 0.7
"""Posterior over prior standard deviation above which the record does not determine a value [1]."""

NINETY = 1.6448536269514722


@dataclass(frozen=True, kw_only=True)
class ImpactFit:
    """The problem of the first impacts: parameters by their logarithm, then directions of the initial state.

    Attributes
    ----------
    replica : Replica
        The drop to be run again.
    vector : ParameterVector
        Supports first, then what is marginalised.
    directions : ndarray, shape (u, K)
        Directions of the unknowns of the fall, one standard deviation each.
    states : ndarray, shape (n, K)
        What these directions change in the state at the start of the simulation.
    remaining_directions : ndarray, shape (u, u - K)
        Directions of the fall's unknowns that matter too little to be fitted along.
    """

    replica: Replica
    vector: ParameterVector
    directions: Array
    states: Array
    remaining_directions: Array

    @cached_property
    def prior_mean(self) -> Array:
        """Prior mean of the unknowns, shape (n,)."""
        return np.concatenate([self.vector.mean, np.zeros(self.directions.shape[1])])

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
        ends = ("support.stiffness", "support.mass", "support.damping", "contact.stiffness")
        own = [unknown.path.endswith(ends) for unknown in self.vector.unknowns]
        return np.array(own + [k < LEADING_DIRECTIONS for k in range(self.directions.shape[1])])

    def split(self, x: Array) -> tuple[Array, Array]:
        """Parameters of the bearings, and unknowns of the fall."""
        count = len(self.vector)
        return x[:count], self.replica.initial.mean + self.directions @ x[count:]

    def residual(self, x: Array, window: float) -> Array:
        """Weighted residual up to a time from power-off [s], shape (r,)."""
        replica = self.replica
        theta, fall = self.split(x)
        count = replica.until(window)
        rest = fall[replica.initial.unknowns.rest].reshape(-1, 2)
        rows = replica.bearing_rows(self.vector, theta, rest)
        state = replica.state + self.states @ x[len(self.vector) :]
        states, _ = replica.states(rows, replica.time[:count], state)
        return np.asarray(
            ((replica.predicted(states, fall) - replica.deviation[:count]) / self.noise).ravel()
        )


@dataclass(frozen=True, kw_only=True)
class SupportFit:
    """Supports found from the first impacts, with everything that was fitted beside them.

    Attributes
    ----------
    problem : ImpactFit
        The problem that was solved, with the fine basis.
    coarse : Search
        Search from many starts over the first windows.
    search : Search
        Fits over the longer windows.
    covariance : ndarray, shape (n, n)
        Covariance of all unknowns, widened for what the linearised fit leaves out.
    values : dict
        Identified value by path, such as ``"NDE.support.stiffness"``.
    correlations : dict
        Correlation of pairs of support parameters of one bearing by ``"path ~ path"`` [1].
    """

    problem: ImpactFit
    coarse: Search
    search: Search
    covariance: Array
    values: dict[str, IdentifiedValue]
    correlations: dict[str, float]


def influential_directions(replica: Replica, count: int = DIRECTIONS) -> tuple[Array, Array, Array]:
    """Directions of the fall's unknowns that move the drop most, one standard deviation each.

    Returns
    -------
    directions : ndarray, shape (u, count)
        Change of the unknowns of the fall.
    states : ndarray, shape (n, count)
        Change of the state at the start of the simulation.
    remaining : ndarray, shape (u, u - count)
        The other directions.
    """
    initial, layout = replica.initial, replica.model.layout
    root = initial.square_root()
    changes = np.column_stack([replica.start_state(initial.mean + column) for column in root.T])
    changes -= replica.state[:, None]
    shapes = replica.model.parameters.bearing_shape
    reach = np.max(np.abs(shapes), axis=0)[:, None]
    effects = []
    for place in (layout.modal_x, layout.modal_y):
        rate = layout.velocity_of(place)
        effects += [shapes @ changes[place] / 1e-6, shapes @ changes[rate] / 3e-4]
        effects += [(reach * changes[place])[2:5] / 1e-6, (reach * changes[rate])[2:5] / 1e-3]
    effects += [root[initial.unknowns.gain] / 5e-3, root[initial.unknowns.rest] / 5e-6]
    _, _, turned = np.linalg.svd(np.vstack(effects), full_matrices=True)
    leading, others = turned[:count].T, turned[count:].T
    return np.asarray(root @ leading), np.asarray(changes @ leading), np.asarray(root @ others)


def impact_problem(replica: Replica, *, nuisance: ParameterVector | None = None) -> ImpactFit:
    """The problem of the first impacts for a drop that can be run again."""
    beside = nuisance_vector(replica.model) if nuisance is None else nuisance
    vector = joined(support_vector(replica.model), beside) if len(beside) else support_vector(replica.model)
    directions, states, remaining = influential_directions(replica)
    return ImpactFit(
        replica=replica,
        vector=vector,
        directions=directions,
        states=states,
        remaining_directions=remaining,
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
        sobol_starts(coarse.prior_mean, spread, starts),
        Schedule(windows=windows[:COARSE_WINDOWS]),
        threads=threads,
        progress=lambda text, share: report(text, 0.5 * share),
    )
    found = search(
        fine,
        [_handed_over(fit.x, coarse, fine) for fit in first.finalists[:2]],
        Schedule(windows=windows[COARSE_WINDOWS - 1 :], kept=(2,), draws=(60,), few=0, iterations=(10, 10)),
        threads=threads,
        progress=lambda text, share: report(text, 0.5 + 0.5 * share),
    )
    covariance = widened_covariance(found.best, fine.prior_sigma, WIDENING)
    return SupportFit(
        problem=fine,
        coarse=first,
        search=found,
        covariance=covariance,
        values={path: _identified(fine, found, covariance, k) for k, path in enumerate(fine.vector.paths)},
        correlations=_correlations(fine, found, supports),
    )


def _handed_over(x: Array, coarse: ImpactFit, fine: ImpactFit) -> Array:
    """The same parameters for another basis; the directions of the initial state begin anew."""
    count = len(coarse.vector)
    return np.concatenate([x[:count], np.zeros(fine.directions.shape[1])])


def _identified(problem: ImpactFit, found: Search, covariance: Array, place: int) -> IdentifiedValue:
    unknown = problem.vector.unknowns[place]
    x = float(found.best.x[place])
    error = float(np.sqrt(covariance[place, place]))
    low, high = (float(b[place]) for b in problem.bounds)
    value = unknown.value_of(x)
    return IdentifiedValue(
        value=value,
        status=_verdict(bool(found.best.active[place]), error, unknown.sigma),
        standard_error=value * error if unknown.logarithmic else error,
        interval_90=(unknown.value_of(x - NINETY * error), unknown.value_of(x + NINETY * error)),
        start=unknown.value_of(unknown.mean),
        bounds=(unknown.value_of(low), unknown.value_of(high)),
        unit=unknown.unit,
    )


def _verdict(at_bound: bool, error: float, prior: float) -> Verdict:
    if at_bound:
        return "at its bound"
    return "the record does not determine it" if error > UNDETERMINED * prior else "determined"


def _correlations(problem: ImpactFit, found: Search, supports: int) -> dict[str, float]:
    covariance = found.best.covariance[:supports, :supports]
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    paths = problem.vector.paths
    pairs = {}
    for i in range(supports):
        for k in range(i):
            if paths[i].split(".")[0] == paths[k].split(".")[0]:
                pairs[f"{paths[k]} ~ {paths[i]}"] = float(correlation[i, k])
    return pairs
