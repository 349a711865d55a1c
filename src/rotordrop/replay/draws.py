"""The open-loop drop, and intervals of force and stress from draws over everything that is uncertain.

A least-squares covariance of the supports alone is no interval: with a wrong contact law the fit can reach
the noise and the force still be off by ten percent. So each draw takes initial state, supports, contact,
preload, race, friction and sensor errors from their joint covariance, keeps to what the record shows of the
fall and the first impacts, and simulates the whole drop.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError
from rotordrop.estimate.bearing_drop import LATE
from rotordrop.evidence.initial_state import covariance_root
from rotordrop.known import NINETY, Known
from rotordrop.progress import Progress
from rotordrop.replay.first_impacts import FirstImpacts, Trial, drop_parameters, start_state, with_bearing
from rotordrop.replay.support_and_friction import WIDENING
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.certificate import refined_peak
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult

FEWEST_DRAWS = 64
"""Draws an interval is made of at least: three lie beyond either end of 90 % (chosen)."""
CANDIDATES = 4
"""Candidates drawn for every draw at most (chosen)."""

SPREAD_STEP = 2.5e-4
"""Distance of the values [s] by which the spread of the draws is drawn (chosen)."""
QUANTILES = (0.05, 0.95)


@dataclass(frozen=True, kw_only=True)
class Draws:
    """Results of the draws; D draws, B bearings."""

    peak_force: Array
    mean_force: Array
    peak_stress: Array
    mean_stress: Array
    """Numbers of each draw [N], [Pa]; the mean force over 0.15–0.2 s, shape (D, B)."""
    spread_time: Array
    """Times [s], shape (T,)."""
    spread: Array
    """Root mean square distance of the draws' orbits from their mean [m], shape (T, B)."""
    rejected: int
    """Candidates that did not keep to the record."""

    def __len__(self) -> int:
        return len(self.peak_force)


def whole_drop(
    problem: FirstImpacts,
    trial: Trial,
    *,
    duration: float,
    gap_change: Array | None = None,
    tolerance: float = 1e-6,
) -> DropResult:
    """Simulate the whole drop from power-off [s], its air gaps (B,) changed by so much [m]."""
    initial = replace(problem.initial, mean=trial.fall)
    rows = problem.rows(trial)
    if gap_change is not None:
        rows[:, 0] += gap_change
    parameters = with_bearing(drop_parameters(problem.model, initial, 0.0), rows)
    case = DropCase(
        speed=initial.fall.speed,
        duration=duration,
        tolerance=tolerance,
        start=StateStart(state=start_state(initial, 0.0, trial.fall)[0]),
    )
    result = simulate_drop(replace(problem.model, parameters=parameters), case)
    if not result.finished:
        raise IdentificationError(f"a simulation with the identified values ended early. {result.outcome}")
    return result


def seen_at_bearings(problem: FirstImpacts, trial: Trial, result: DropResult) -> Array:
    """Displacement of a simulated drop as the sensors would show it at the bearings [m], shape (T, B, 2).

    With fitted gains, counted from the rest position, like the measured one.
    """
    initial = problem.initial
    return initial.sensing.at_bearings(problem.predicted(result.state, trial.fall) + initial.settled)


def draw_drops(
    problem: FirstImpacts,
    x: Array,
    covariance: Array,
    *,
    window: float,
    duration: float,
    count: int = FEWEST_DRAWS,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Draws:
    """Simulate the drop for draws from the covariance (n, n) of the unknowns around the best of them (n,).

    Draws must keep to the record up to the end of the window [s from power-off].
    """
    report = progress or (lambda text, share: None)
    report("draws that keep to the record", 0.0)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        kept, rejected = _keeping(problem, x, covariance, window, count, pool)
        results = []
        for k, one in enumerate(pool.map(lambda trial: _numbers(problem, trial, duration), kept)):
            results.append(one)
            report(f"draw {k + 1} of {len(kept)}", (k + 1) / len(kept))
    numbers = np.array([numbers for numbers, _ in results])
    orbits = np.array([orbit for _, orbit in results])
    return Draws(
        peak_force=numbers[:, 0],
        mean_force=numbers[:, 1],
        peak_stress=numbers[:, 2],
        mean_stress=numbers[:, 3],
        spread_time=SPREAD_STEP * np.arange(orbits.shape[1], dtype=np.float64),
        spread=np.sqrt(np.mean(np.sum((orbits - orbits.mean(axis=0)) ** 2, axis=-1), axis=0)),
        rejected=rejected,
    )


def _keeping(
    problem: FirstImpacts,
    x: Array,
    covariance: Array,
    window: float,
    count: int,
    pool: ThreadPoolExecutor,
) -> tuple[list[Trial], int]:
    """Trials whose first impacts stay near the record, and how many did not."""
    random = np.random.Generator(np.random.Philox(7))
    root, table = covariance_root(covariance), problem.table
    complement = problem.directions.remaining
    points, falls = [], []
    for _ in range(CANDIDATES * count):
        points.append(np.clip(x + root @ random.standard_normal(len(x)), table.lower, table.upper))
        falls.append(complement @ random.standard_normal(complement.shape[1]))

    def cost(point: Array) -> float:
        try:
            residual = problem.residual(point, window)
        except IdentificationError:
            return float("inf")
        return float(residual @ residual)

    # Draws of a linear model exceed the best cost by a chi-square with as many degrees of freedom as the
    # record determines: the unknowns, less what their priors decide. The covariance they are drawn from is
    # widened, which its square multiplies; the rest is room for a cost that bends with every impact, and for
    # five standard deviations where hardly anything is determined.
    by_prior = float(np.sum(np.diag(covariance) / table.sigma**2))
    allowed = cost(x) + 4.0 * WIDENING**2 * max(len(x) - by_prior, 1.0) + 25.0
    kept: list[Trial] = []
    for first in range(0, len(points), count):
        for k, found in enumerate(pool.map(cost, points[first : first + count]), start=first):
            if found <= allowed:
                theta, fall = problem.trial(points[k])
                kept.append(Trial(theta, fall + falls[k]))
            if len(kept) == count:
                return kept, k + 1 - count
    if len(kept) < max(8, count // 4):
        raise IdentificationError(
            f"of {len(points)} draws of the uncertain values only {len(kept)} keep to the record up to "
            f"{1e3 * window:.3g} ms: "
            "the fit is no basis for an interval. Give better guesses for supports and contact."
        )
    return kept, len(points) - len(kept)


def _numbers(problem: FirstImpacts, trial: Trial, duration: float) -> tuple[Array, Array]:
    """Peak and mean force [N], peak and mean stress [Pa] (4, B), and the orbit [m] on a coarse grid."""
    result = whole_drop(problem, trial, duration=duration)
    force, stress = result.bearing_force_magnitude, result.max_stress
    late = (result.time >= LATE[0]) & (result.time <= LATE[1])
    mean = force[late].mean(axis=0) if late.any() else np.full(force.shape[1], np.nan)
    peaks = [
        np.array([refined_peak(result.time, one[:, b])[0] for b in range(one.shape[1])])
        for one in (force, stress)
    ]
    step = max(1, round(SPREAD_STEP / float(result.time[1] - result.time[0])))
    # a draw's own vertical zero is no motion: orbits are compared from the rest position
    orbit = result.displacement[::step] - problem.rest_error(trial)
    return np.stack([peaks[0], mean, peaks[1], stress.mean(axis=0)]), orbit


def with_draws(value: Known, sample: Array | None, model: float) -> Known:
    """A number with the 5 % and 95 % quantiles of its draws, widened by what every model leaves out.

    The interval holds the number itself. Without draws there is none.
    """
    if sample is None:
        return replace(value, status="the record does not determine it")
    low, high = (float(limit) for limit in np.quantile(sample, QUANTILES))
    middle = float(np.median(sample))
    allowance = NINETY * model * value.value
    low, high = middle - math.hypot(middle - low, allowance), middle + math.hypot(high - middle, allowance)
    return replace(
        value,
        standard_error=math.hypot(float(np.std(sample, ddof=1)), model * value.value),
        interval_90=(max(min(low, value.value - allowance), 0.0), max(high, value.value + allowance)),
    )


def mean_with_draws(value: Known, sample: Array | None, model: float) -> Known:
    """A mean over chaotic motion: the middle of the draws, of which the replay is only one."""
    middle = value if sample is None else replace(value, value=float(np.median(sample)))
    return with_draws(middle, sample, model)
