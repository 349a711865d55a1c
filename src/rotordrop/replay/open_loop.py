"""The whole drop simulated open loop with identified values, and with draws of everything uncertain.

A least-squares covariance of the supports alone is no interval: with a wrong contact law the fit can reach
the noise and the force still be off by ten percent. So each draw takes initial state, supports, contact,
preload, race, friction and sensor errors from their joint covariance, must follow the fall and the first
impacts of the record, and simulates the whole drop.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError
from rotordrop.estimate.bearing_drop import LATE
from rotordrop.evidence.free_fall import kernel_state
from rotordrop.evidence.initial_state import covariance_root
from rotordrop.physics import columns as L
from rotordrop.replay.problem import ReplayProblem, drop_parameters
from rotordrop.replay.supports import WIDENING
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.certificate import refined_peak
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

FEWEST_DRAWS = 64
"""Draws from which 5 % and 95 % quantiles are stated: about three lie beyond each of them."""

CANDIDATES = 4
"""Candidates drawn for every draw at most; chosen, not measured."""

SPREAD_STEP = 2.5e-4
QUANTILES = (0.05, 0.95)


@dataclass(frozen=True, kw_only=True)
class Draws:
    """Results of the draws; D draws, B bearings."""

    peak_force: Array
    """Shape (D, B) [N]."""
    mean_force: Array
    """Mean over 0.15–0.2 s, shape (D, B) [N]."""
    peak_stress: Array
    """Shape (D, B) [Pa]."""
    mean_stress: Array
    """Shape (D, B) [Pa]."""
    gaps: Array
    """Air gaps drawn, shape (D, B) [m]."""
    spread_time: Array
    """Times of the spread, shape (T,) [s]."""
    spread: Array
    """Root mean square distance of the draws' orbits from their mean, shape (T, B) [m]."""
    rejected: int
    """Candidates that did not follow the record."""

    def __len__(self) -> int:
        return len(self.peak_force)


def whole_drop(
    problem: ReplayProblem,
    z: Array,
    *,
    duration: float,
    gap_change: Array | float = 0.0,
    tolerance: float = 1e-6,
    output_step: float = 1e-5,
) -> DropResult:
    """Simulate the whole drop from power-off with given unknowns.

    Parameters
    ----------
    problem : ReplayProblem
        The drop.
    z : ndarray, shape (P + u,)
        Whitened unknowns.
    duration : float
        Length [s].
    gap_change : ndarray, shape (B,), optional
        Added to the air gaps [m], for the limits of the tail.
    tolerance, output_step : float
        Of the simulation.
    """
    initial = replace(problem.initial, mean=problem.fall(z))
    state, remanent, unbalance = kernel_state(initial.fall, initial.state_at(0.0), 0.0)
    parameters = drop_parameters(problem.model, initial, remanent, unbalance)
    rows = problem.bearing_rows(z)
    rows[:, L.AIR_GAP] += gap_change
    rows[:, L.ROTOR_RADIUS] -= gap_change
    case = DropCase(
        speed=initial.fall.speed,
        duration=duration,
        output_step=output_step,
        tolerance=tolerance,
        start=StateStart(state=state),
    )
    result = simulate_drop(replace(problem.model, parameters=parameters._replace(bearing=rows)), case)
    if not result.finished:
        raise IdentificationError(f"a simulation with the identified values ended early. {result.outcome}")
    return result


def seen_at_bearings(problem: ReplayProblem, z: Array, result: DropResult) -> Array:
    """Simulated displacement as the sensors would show it at the bearings [m], shape (T, B, 2).

    With fitted gains, counted from the rest position, like the measured one.
    """
    along = problem.predicted(result.state, z) + problem.initial.settled
    return problem.initial.sensing.at_bearings(along)


def draw_drops(
    problem: ReplayProblem,
    z: Array,
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
    problem : ReplayProblem
        The drop.
    z, covariance : ndarray, shapes (P + u,), (P + u, P + u)
        Best unknowns and their covariance.
    window : float
        Draws must follow the record up to here [s from power-off].
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
    report("draws that follow the record", 0.0)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        points, rejected = following_draws(problem, z, covariance, window, count, pool)
        results = []
        for k, one in enumerate(pool.map(lambda point: _numbers(problem, point, duration), points)):
            results.append(one)
            report(f"draw {k + 1} of {len(points)}", (k + 1) / len(points))
    numbers = np.array([numbers for numbers, _ in results])
    orbits = np.array([orbit for _, orbit in results])
    return Draws(
        peak_force=numbers[:, 0],
        mean_force=numbers[:, 1],
        peak_stress=numbers[:, 2],
        mean_stress=numbers[:, 3],
        gaps=numbers[:, 4],
        spread_time=SPREAD_STEP * np.arange(orbits.shape[1], dtype=np.float64),
        spread=orbit_spread(orbits),
        rejected=rejected,
    )


def orbit_spread(orbits: Array) -> Array:
    """Root mean square distance of orbits (D, T, B, 2) from their mean, shape (T, B), in their unit."""
    return np.asarray(np.sqrt(np.mean(np.sum((orbits - orbits.mean(axis=0)) ** 2, axis=-1), axis=0)))


def following_draws(
    problem: ReplayProblem, z: Array, covariance: Array, window: float, count: int, pool: Executor
) -> tuple[list[Array], int]:
    """Draws whose first impacts stay near the record, and how many others were drawn.

    Raises
    ------
    IdentificationError
        If nearly none of the draws does.
    """
    random = np.random.Generator(np.random.Philox(7))
    root = covariance_root(covariance)
    points = [
        np.clip(z + root @ random.standard_normal(len(z)), *problem.bounds) for _ in range(CANDIDATES * count)
    ]
    # Draws of a linear model exceed the best cost by a chi-square with as many degrees of freedom as the
    # record determines: the unknowns less what their priors decide. Their covariance is widened, which its
    # square multiplies; four times that is room for a cost that bends with every impact, and 25 for five
    # standard deviations where hardly anything is determined.
    determined = len(z) - float(np.trace(covariance))
    allowed = problem.misfit(z, window) + 4.0 * WIDENING**2 * max(determined, 1.0) + 25.0
    chosen: list[Array] = []
    for first in range(0, len(points), count):
        batch = points[first : first + count]
        costs = pool.map(lambda point: problem.misfit(point, window), batch)
        for tried, (point, cost) in enumerate(zip(batch, costs, strict=True), start=first + 1):
            chosen += [point] * (cost <= allowed)
            if len(chosen) == count:
                return chosen, tried - count
    if len(chosen) < max(8, count // 4):
        raise IdentificationError(
            f"of {len(points)} draws of the uncertain values only {len(chosen)} follow the record up to "
            f"{1e3 * window:.3g} ms: the fit is no basis for an interval. Give better guesses for supports "
            "and contact."
        )
    return chosen, len(points) - len(chosen)


def _numbers(problem: ReplayProblem, z: Array, duration: float) -> tuple[Array, Array]:
    """Peak and mean force, peak and mean stress, air gap (5, B), and the orbit on a coarse grid."""
    result = whole_drop(problem, z, duration=duration)
    step = max(1, round(SPREAD_STEP / float(result.time[1] - result.time[0])))
    gaps = problem.bearing_rows(z)[:, L.AIR_GAP]
    # A draw's own vertical zero is no motion: orbits are compared from the rest position.
    return np.vstack([drop_numbers(result), gaps]), result.displacement[::step] - problem.rest_error(z)


def drop_numbers(result: DropResult) -> Array:
    """Peak and mean force [N], peak and mean stress [Pa] of a simulated drop, shape (4, B)."""
    force, stress = result.bearing_force_magnitude, result.max_stress
    late = (result.time >= LATE[0]) & (result.time <= LATE[1])
    mean = force[late].mean(axis=0) if late.any() else np.full(force.shape[1], np.nan)
    peaks = [[refined_peak(result.time, column)[0] for column in one.T] for one in (force, stress)]
    return np.array([peaks[0], mean, peaks[1], stress.mean(axis=0)])


def interval(values: Array) -> tuple[float, float]:
    """Interval that holds the value with 90 % probability: 5 % and 95 % quantiles of the draws."""
    low, high = np.quantile(values, QUANTILES)
    return float(low), float(high)
