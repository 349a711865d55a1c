"""Friction coefficient: the paper's sweep, with a number in place of the eye (Neisi 2020, section 5.2).

A drop forgets its beginning: small differences grow tenfold in about 33 ms. So the orbits are compared over a
window of that length, and each moment counts by how well it can be known at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.identification.support import ImpactFit
from rotordrop.known import NINETY, Known

Array = NDArray[np.float64]

SWEEP = np.round(np.arange(0.05, 0.2001, 0.01), 3)
"""Dynamic coefficients of the sweep [1]."""

HORIZON = 33e-3
"""Length of the comparison after the first contact [s]: about one tenfold growth of differences."""

TENFOLD = 33e-3
"""Time in which small differences grow tenfold [s]."""

SCATTER_WIDENING = 2.0
"""Factor on the scatter of the best coefficient between draws [1]."""


@dataclass(frozen=True, kw_only=True)
class FrictionSweep:
    """Orbit agreement over friction coefficients; K coefficients, D draws."""

    coefficients: Array
    """Dynamic coefficients [1], shape (K,)."""
    disagreement: Array
    """Distance of simulated and measured orbit [m rms], each moment weighted by how well it can be known,
    shape (K,)."""
    best: Array
    """Best coefficient with the best parameters, then with each draw of them [1], shape (D + 1,)."""
    value: Known
    """The dynamic coefficient."""
    window: tuple[float, float]
    """Compared part of the drop [s from power-off]."""


def orbit_disagreement(time: Array, distance: Array, contact: float) -> float:
    """One number for how far two orbits lie apart [m rms], robust to chaos.

    Parameters
    ----------
    time : ndarray, shape (T,)
        Time from power-off [s].
    distance : ndarray, shape (T, B)
        Distance of the two orbits in each bearing [m].
    contact : float
        First contact [s]; from there on differences grow.

    Notes
    -----
    Source: own measure; root mean square with weights ``10^(−2 (t − t1) / 33 ms)``, the growth of small
    differences that the drop itself has.
    """
    weight = 10.0 ** (-2.0 * np.maximum(time - contact, 0.0) / TENFOLD)
    return float(np.sqrt(np.sum(weight[:, None] * distance**2) / (np.sum(weight) * distance.shape[1])))


def sweep_friction(
    problem: ImpactFit,
    x: Array,
    contact: float,
    *,
    draws: Sequence[Array] = (),
    coefficients: Array = SWEEP,
    threads: int | None = None,
) -> FrictionSweep:
    """Simulate the drop for a range of friction coefficients and compare the orbits.

    Parameters
    ----------
    problem : ImpactFit
        The drop; its record must reach beyond the window.
    x : ndarray
        Best unknowns of the problem.
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
    Source: Neisi 2020, section 5.2. Differs from the paper: a number in place of the eye, and the dynamic
    coefficient leads (sliding drops hardly see the static one).
    """
    place = problem.vector.friction
    end = contact + HORIZON
    count = problem.replica.until(end)
    time = problem.replica.time[:count]
    compared = time >= contact

    def disagreement(case: tuple[Array, float]) -> float:
        point, coefficient = case
        moved = point.copy()
        moved[place] = np.log(coefficient)
        distance = orbit_distance(problem, moved, count)
        return orbit_disagreement(time[compared], distance[compared], contact)

    cases = [(point, float(c)) for point in (x, *draws) for c in coefficients]
    with ThreadPoolExecutor(max_workers=threads) as pool:
        table = np.array(list(pool.map(disagreement, cases))).reshape(-1, len(coefficients))
    best = np.array([_lowest(coefficients, row) for row in table])
    return FrictionSweep(
        coefficients=coefficients,
        disagreement=table[0],
        best=best,
        value=_value(problem, best, coefficients),
        window=(contact, end),
    )


def orbit_distance(problem: ImpactFit, x: Array, count: int) -> Array:
    """Distance of simulated and measured orbit at the bearings [m], shape (count, B)."""
    replica = problem.replica
    theta, fall = problem.split(x)
    rows = replica.bearing_rows(problem.vector, theta, fall[replica.initial.unknowns.rest].reshape(-1, 2))
    states, _ = replica.states(rows, replica.time[:count], *problem.start(x))
    apart = replica.sensing.at_bearings(replica.predicted(states, fall) - replica.deviation[:count])
    return np.asarray(np.hypot(apart[..., 0], apart[..., 1]))


def _lowest(coefficients: Array, values: Array) -> float:
    """Minimum by a parabola through the lowest value and its neighbours."""
    k = int(np.argmin(values))
    if k in (0, len(values) - 1):
        return float(coefficients[k])
    left, middle, right = (float(values[j]) ** 2 for j in (k - 1, k, k + 1))
    step = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float(coefficients[k] + step * (coefficients[k + 1] - coefficients[k]))


def _value(problem: ImpactFit, best: Array, coefficients: Array) -> Known:
    value = float(best[0])
    grid = float(coefficients[1] - coefficients[0]) / np.sqrt(12.0)
    error = SCATTER_WIDENING * float(np.hypot(np.std(best, ddof=1), 0.1 * grid)) if len(best) > 2 else grid
    low, high = float(coefficients[0]), float(coefficients[-1])
    unknown = problem.vector.unknowns[problem.vector.friction]
    at_bound = value in (low, high)
    wide = error > 0.7 * (high - low) / np.sqrt(12.0)
    return Known(
        value=value,
        status="at its bound" if at_bound else "the record does not determine it" if wide else "determined",
        standard_error=error,
        interval_90=(max(value - NINETY * error, 0.0), value + NINETY * error),
        start=unknown.value_of(unknown.begin),
        bounds=(low, high),
        unit="1",
    )
