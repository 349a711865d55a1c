"""Friction coefficient: the paper's sweep, with a number in place of the eye (Neisi 2020, section 3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimate.agreement import FrictionSweep
from rotordrop.known import NINETY, Known
from rotordrop.replay.agreement import TENFOLD, orbit_disagreement
from rotordrop.replay.problem import ReplayProblem
from rotordrop.replay.supports import UNDETERMINED

Array = NDArray[np.float64]

SWEEP = np.round(np.arange(0.05, 0.2001, 0.01), 3)
"""Dynamic coefficients of the sweep, the range of Neisi 2020, section 3.3 [1]."""

HORIZON = TENFOLD
"""Length of the comparison after the first contact [s]: a drop forgets its beginning, small differences grow
tenfold in it."""

SCATTER_WIDENING = 2.0
"""Factor on the scatter of the best coefficient between draws [1]; chosen, not measured."""


def sweep_friction(
    problem: ReplayProblem,
    z: Array,
    contact: float,
    *,
    draws: Sequence[Array] = (),
    coefficients: Array = SWEEP,
    threads: int | None = None,
) -> FrictionSweep:
    """Simulate the drop for a range of friction coefficients and compare the orbits.

    Parameters
    ----------
    problem : ReplayProblem
        The drop; its record must reach beyond the window.
    z : ndarray
        Best unknowns.
    contact : float
        Earlier first contact [s from power-off].
    draws : sequence of ndarray
        Other values of the unknowns, from their covariance: their best coefficients give the interval.
    coefficients : ndarray
        Dynamic coefficients of the sweep [1]; the static one follows at the ratio of the machine file.
    threads : int, optional
        Threads; all cores by default.

    Notes
    -----
    Source: Neisi 2020, sections 3.3 and 5.2. Differs from the paper: a number in place of the eye, and the
    dynamic coefficient leads (sliding drops hardly see the static one).
    """
    end = contact + HORIZON
    count = problem.samples_until(end)
    time = problem.time[:count]
    compared = time >= contact
    unknown = problem.unknowns[problem.friction]

    def disagreement(case: tuple[Array, float]) -> float:
        moved = case[0].copy()
        moved[problem.friction] = (np.log(case[1]) - unknown.mean) / unknown.sigma
        apart = problem.predicted(problem.simulated(moved, count), moved) - problem.deviation[:count]
        distance = np.hypot(*np.moveaxis(problem.initial.sensing.at_bearings(apart), -1, 0))
        return orbit_disagreement(time[compared], distance[compared], contact)

    cases = [(point, float(c)) for point in (z, *draws) for c in coefficients]
    with ThreadPoolExecutor(max_workers=threads) as pool:
        table = np.array(list(pool.map(disagreement, cases))).reshape(-1, len(coefficients))
    best = np.array([_lowest(coefficients, row) for row in table])
    value, low, high = float(best[0]), float(coefficients[0]), float(coefficients[-1])
    grid = float(coefficients[1] - coefficients[0]) / np.sqrt(12.0)
    error = SCATTER_WIDENING * float(np.hypot(np.std(best, ddof=1), 0.1 * grid)) if len(best) > 2 else grid
    wide = error > UNDETERMINED * (high - low) / np.sqrt(12.0)
    return FrictionSweep(
        coefficients=coefficients,
        disagreement=table[0],
        best=best,
        value=Known(
            value=value,
            status="at its bound"
            if value in (low, high)
            else "the record does not determine it"
            if wide
            else "determined",
            standard_error=error,
            interval_90=(max(value - NINETY * error, 0.0), value + NINETY * error),
            start=unknown.value_of(unknown.begin),
            bounds=(low, high),
            unit="1",
        ),
        window=(contact, end),
    )


def _lowest(coefficients: Array, values: Array) -> float:
    """Minimum by a parabola through the squares of the lowest value and its neighbours."""
    k = int(np.argmin(values))
    if k in (0, len(values) - 1):
        return float(coefficients[k])
    left, middle, right = (float(values[j]) ** 2 for j in (k - 1, k, k + 1))
    step = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float(coefficients[k] + step * (coefficients[k + 1] - coefficients[k]))
