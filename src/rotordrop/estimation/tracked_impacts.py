"""The impacts of a tracked drop, each number with its interval."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.estimated import IdentifiedValue
from rotordrop.estimation.tracked_values import MODEL_FORCE_SIGMA, holding, with_interval
from rotordrop.simulation.certificate import refined_peak
from rotordrop.tracking.forces import ForceHistory
from rotordrop.tracking.input_state import KNOWN_PEAK_ERROR, InputEstimate
from rotordrop.tracking.problem import DropProblem


@dataclass(frozen=True, kw_only=True)
class Impact:
    """One impact at one bearing, each number with its 90 % interval.

    Times [s] from power-off, azimuth [rad ccw from +x] of the contact normal at the peak, peak ball force
    [N], normal impulse [N s], energy dissipated in the contact [J].
    """

    bearing: str
    start: float
    end: float
    azimuth: float
    peak_time: float
    peak_force: IdentifiedValue
    impulse: IdentifiedValue
    dissipated_energy: IdentifiedValue


def tracked_impacts(
    problem: DropProblem,
    forces: ForceHistory,
    widening: float,
    cross_check: InputEstimate | None,
) -> tuple[Impact, ...]:
    """Every impact at every bearing, in the order of their beginning.

    With a cross-check their intervals are widened until they hold it.
    """
    found: list[Impact] = []
    for b, name in enumerate(problem.model.bearing_names):
        touching = forces.indentation[:, b] > 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
        for first, last in zip(edges[0::2], edges[1::2], strict=True):
            impact = _impact(forces, b, name, int(first), int(last), widening)
            if cross_check is not None:
                impact = _impact_holding(impact, cross_check, b)
            found.append(impact)
    return tuple(sorted(found, key=lambda impact: impact.start))


def _impact(forces: ForceHistory, b: int, name: str, first: int, last: int, widening: float) -> Impact:
    window = slice(max(first - 1, 0), min(last + 2, len(forces.time)))
    peak, moment = refined_peak(forces.time[window], forces.magnitude[window, b])
    at = window.start + int(np.argmax(forces.magnitude[window, b]))
    relative = math.hypot(float(forces.magnitude_sigma[at, b]) / max(peak, 1e-9), MODEL_FORCE_SIGMA)
    dt = float(forces.time[1] - forces.time[0])
    impulse = dt * float(np.sum(forces.contact_force[first:last, b]))
    lost = dt * float(np.sum(forces.contact_power[first:last, b]))
    middle = first + int(np.argmax(forces.contact_force[first:last, b]))
    return Impact(
        bearing=name,
        start=float(forces.time[first]),
        end=float(forces.time[last - 1]),
        azimuth=float(forces.azimuth[middle, b]),
        peak_time=moment,
        peak_force=with_interval(peak, relative * peak, widening, "N"),
        impulse=with_interval(impulse, relative * impulse, widening, "N s"),
        dissipated_energy=with_interval(lost, 2.0 * relative * abs(lost), widening, "J"),
    )


def _impact_holding(impact: Impact, cross_check: InputEstimate, b: int) -> Impact:
    """An impact whose intervals hold what the cross-check finds in its time."""
    during = (cross_check.time >= impact.start) & (cross_check.time <= impact.end)
    if not during.any() or impact.peak_force.value <= 0.0:
        return impact
    ratio = float(cross_check.magnitude[during, b].max()) / impact.peak_force.value
    return replace(
        impact,
        peak_force=holding(impact.peak_force, ratio, KNOWN_PEAK_ERROR),
        impulse=holding(impact.impulse, ratio, KNOWN_PEAK_ERROR),
        dissipated_energy=holding(impact.dissipated_energy, ratio, 2.0 * KNOWN_PEAK_ERROR),
    )
