"""Intervals of force and stress from draws over everything that is uncertain.

A least-squares covariance of the supports alone is no interval: with a wrong contact law the fit can reach
the noise and the force still be off by ten percent. So each draw takes initial state, supports, contact,
preload, race, friction and sensor errors from their joint covariance, keeps to what the record shows of the
fall and the first impacts, and simulates the whole drop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError
from rotordrop.evidence.initial_state import covariance_root, kernel_state
from rotordrop.identification.parameter_vector import with_bearing
from rotordrop.identification.replica import drop_parameters
from rotordrop.identification.support import WIDENING, ImpactFit
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.certificate import refined_peak
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

FEWEST_DRAWS = 64
CANDIDATES = 4
"""Candidates drawn for every draw at most."""

SPREAD_STEP = 2.5e-4
QUANTILES = (0.05, 0.95)
LATE = (0.15, 0.2)
"""Stretch of the mean force [s from power-off]."""


@dataclass(frozen=True, kw_only=True)
class Draws:
    """Results of the draws; D draws, B bearings."""

    peak_force: Array
    mean_force: Array
    peak_stress: Array
    mean_stress: Array
    """Numbers of each draw [N], [Pa]; the mean force over 0.15–0.2 s, shape (D, B)."""
    gaps: Array
    """Air gaps drawn [m], shape (D, B)."""
    spread_time: Array
    """Times [s], shape (T,)."""
    spread: Array
    """Root mean square distance of the draws' orbits from their mean [m], shape (T, B)."""
    rejected: int
    """Candidates that did not keep to the record."""

    def __len__(self) -> int:
        return len(self.peak_force)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Unknowns of one draw: parameters by the fit's vector, unknowns of the fall."""

    theta: Array
    fall: Array


def whole_drop(
    problem: ImpactFit,
    candidate: Candidate,
    *,
    duration: float,
    gap_change: Array | None = None,
    tolerance: float = 1e-6,
    output_step: float = 1e-5,
) -> DropResult:
    """Simulate the whole drop from power-off with given unknowns.

    Parameters
    ----------
    problem : ImpactFit
        The drop with its parameters.
    candidate : Candidate
        The unknowns.
    duration : float
        Length [s].
    gap_change : ndarray, shape (B,), optional
        Added to the air gaps [m], for the limits of the tail.
    tolerance, output_step : float
        Of the simulation.
    """
    replica = problem.replica
    initial = replace(replica.initial, mean=candidate.fall)
    rest = candidate.fall[initial.unknowns.rest].reshape(-1, 2)
    rows = replica.bearing_rows(problem.vector, candidate.theta, rest)
    if gap_change is not None:
        rows[:, 0] += gap_change
    state, remanent, unbalance = kernel_state(initial.fall, initial.state_at(0.0), 0.0)
    parameters = with_bearing(drop_parameters(replica.model, initial, remanent, unbalance), rows)
    model: DropModel = replace(replica.model, parameters=parameters)
    case = DropCase(
        speed=initial.fall.speed,
        duration=duration,
        output_step=output_step,
        tolerance=tolerance,
        start=StateStart(state=state),
    )
    result = simulate_drop(model, case)
    if not result.finished:
        raise IdentificationError(f"a simulation with the identified values ended early. {result.outcome}")
    return result


def seen_at_bearings(problem: ImpactFit, candidate: Candidate, result: DropResult) -> Array:
    """Displacement of a simulated drop as the sensors would show it at the bearings [m], shape (T, B, 2).

    With fitted gains, counted from the rest position, like the measured one.
    """
    replica = problem.replica
    along = replica.predicted(result.state, candidate.fall) + replica.initial.settled
    return replica.sensing.at_bearings(along)


def best_candidate(problem: ImpactFit, x: Array) -> Candidate:
    """The unknowns of a fit as a candidate."""
    theta, fall = problem.split(x)
    return Candidate(theta=theta, fall=fall)


def draw_drops(
    problem: ImpactFit,
    x: Array,
    covariance: Array,
    *,
    window: float,
    duration: float,
    count: int = FEWEST_DRAWS,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Draws:
    """Simulate the drop for draws of everything uncertain.

    Parameters
    ----------
    problem : ImpactFit
        The drop with its parameters.
    x, covariance : ndarray, shapes (n,), (n, n)
        Best unknowns and their covariance.
    window : float
        Draws must keep to the record up to here [s from power-off].
    duration : float
        Length of the drop [s].
    count : int
        Number of draws.
    threads : int, optional
        Threads; all cores by default.
    progress : callable, optional
        Called with a text and the share done.
    """
    report = progress or (lambda text, share: None)
    report("draws that keep to the record", 0.0)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        kept, rejected = _keeping(problem, x, covariance, window, count, pool)
        results = []
        tasks = [pool.submit(_numbers, problem, candidate, duration) for candidate in kept]
        for k, task in enumerate(tasks):
            results.append(task.result())
            report(f"draw {k + 1} of {len(tasks)}", (k + 1) / len(tasks))
    numbers = np.array([numbers for numbers, _ in results])
    orbits = np.array([orbit for _, orbit in results])
    time = SPREAD_STEP * np.arange(orbits.shape[1], dtype=np.float64)
    spread = np.sqrt(np.mean(np.sum((orbits - orbits.mean(axis=0)) ** 2, axis=-1), axis=0))
    return Draws(
        peak_force=numbers[:, 0],
        mean_force=numbers[:, 1],
        peak_stress=numbers[:, 2],
        mean_stress=numbers[:, 3],
        gaps=numbers[:, 4],
        spread_time=time,
        spread=spread,
        rejected=rejected,
    )


def _keeping(
    problem: ImpactFit,
    x: Array,
    covariance: Array,
    window: float,
    count: int,
    pool: ThreadPoolExecutor,
) -> tuple[list[Candidate], int]:
    """Candidates whose first impacts stay near the record, and how many did not."""
    random = np.random.Generator(np.random.Philox(7))
    root = covariance_root(covariance)
    complement = problem.remaining_directions
    points, falls = [], []
    for _ in range(CANDIDATES * count):
        points.append(np.clip(x + root @ random.standard_normal(len(x)), *problem.bounds))
        falls.append(complement @ random.standard_normal(complement.shape[1]))
    allowed = _cost(problem, x, window) + _allowance(problem, covariance, len(x))
    kept: list[Candidate] = []
    tried = 0
    for first in range(0, len(points), count):
        batch = range(first, min(first + count, len(points)))
        costs = list(pool.map(lambda k: _cost(problem, points[k], window), batch))
        for k, cost in zip(batch, costs, strict=True):
            tried += 1
            if cost <= allowed:
                best = best_candidate(problem, points[k])
                kept.append(Candidate(theta=best.theta, fall=best.fall + falls[k]))
            if len(kept) == count:
                return kept, tried - count
    if len(kept) < max(8, count // 4):
        raise IdentificationError(
            f"of {tried} draws of the uncertain values only {len(kept)} keep to the record up to "
            f"{1e3 * window:.3g} ms: "
            "the fit is no basis for an interval. Give better guesses for supports and contact."
        )
    return kept, tried - len(kept)


def _allowance(problem: ImpactFit, covariance: Array, count: int) -> float:
    """By how much the cost of a draw may exceed the best: what a linear model would give, four times over."""
    # Draws of a linear model exceed the best cost by a chi-square with as many degrees of freedom as the
    # record determines: the unknowns, less what their priors decide. The covariance they are drawn from is
    # widened, which its square multiplies; the rest is room for a cost that bends with every impact, and for
    # five standard deviations where hardly anything is determined.
    by_prior = float(np.sum(np.diag(covariance) / problem.prior_sigma**2))
    return 4.0 * WIDENING**2 * max(count - by_prior, 1.0) + 25.0


def _cost(problem: ImpactFit, x: Array, window: float) -> float:
    try:
        residual = problem.residual(x, window)
    except IdentificationError:
        return float("inf")
    return float(residual @ residual)


def _numbers(problem: ImpactFit, candidate: Candidate, duration: float) -> tuple[Array, Array]:
    """Peak and mean force, peak and mean stress, air gap (5, B), and the orbit on a coarse grid."""
    result = whole_drop(problem, candidate, duration=duration)
    step = max(1, round(SPREAD_STEP / float(result.time[1] - result.time[0])))
    rest = candidate.fall[problem.replica.initial.unknowns.rest].reshape(-1, 2)
    gaps = problem.replica.bearing_rows(problem.vector, candidate.theta, rest)[:, 0]
    force, stress = drop_numbers(result)
    # a draw's own vertical zero is no motion: orbits are compared from the rest position
    orbit = result.displacement[::step] - rest
    return np.stack([force[0], force[1], stress[0], stress[1], gaps]), orbit


def drop_numbers(result: DropResult) -> tuple[Array, Array]:
    """Peak and mean force [N], then peak and mean stress [Pa], of a simulated drop, shape (2, B) each."""
    force = result.bearing_force_magnitude
    late = (result.time >= LATE[0]) & (result.time <= LATE[1])
    peaks = np.array([refined_peak(result.time, force[:, b])[0] for b in range(force.shape[1])])
    mean = force[late].mean(axis=0) if late.any() else np.full(force.shape[1], np.nan)
    stress = result.max_stress
    highest = np.array([refined_peak(result.time, stress[:, b])[0] for b in range(stress.shape[1])])
    return np.stack([peaks, mean]), np.stack([highest, stress.mean(axis=0)])


def interval(values: Sequence[float] | Array) -> tuple[float, float]:
    """Interval that holds the value with 90 % probability: 5 % and 95 % quantiles of the draws."""
    low, high = np.quantile(np.asarray(values), QUANTILES)
    return float(low), float(high)
