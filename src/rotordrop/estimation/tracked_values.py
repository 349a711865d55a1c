"""Numbers of a tracked drop with their intervals: forces, stresses and identified parameters."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rotordrop.estimated import NINETY, IdentifiedValue, Verdict
from rotordrop.model.parameter_table import parameter
from rotordrop.model.unknowns import Unknown
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.simulation.certificate import refined_peak
from rotordrop.tracking.forces import ForceHistory
from rotordrop.tracking.input_state import (
    KNOWN_MEAN_ERROR,
    KNOWN_PEAK_ERROR,
    KNOWN_STRESS_ERROR,
    InputEstimate,
)
from rotordrop.tracking.problem import DropProblem
from rotordrop.tracking.smoother import Smoothed, parameter_sample

MODEL_FORCE_SIGMA = 0.01
"""Relative standard deviation of a force peak by what every model here leaves out (basis, sampling) [1]."""
MODEL_STRESS_SIGMA = 0.004
MODEL_MEAN_STRESS_SIGMA = 0.04
"""The same for the mean stress: preload sets it, known only through the ball stiffness [1]."""
MODEL_GAP_SIGMA = 2.5e-6
"""Standard deviation of an air gap by what confounds it with gains and offsets beyond the fit [m]."""
LONE_GAP_SIGMA = 4e-6
"""The same for a gap that was only guessed before a lone drop [m]: one drop seldom touches all round, and
near the bottom gap and sensor offset are hard to tell apart."""
UNSURE_GAP = 12e-6
"""Prior standard deviation from which an air gap counts as guessed [m]."""
PARAMETER_WIDENING = 1.5
"""Factor on standard errors of parameters for what the linearised fit leaves out [1]."""
MODEL_MEAN_FORCE_SIGMA = 0.01
"""Relative standard deviation of a mean force by what every model here leaves out [1]."""
INDEPENDENT_SPANS = 50.0
"""Independent stretches in the 50 ms of the mean force: its errors last about a millisecond [1]."""


def with_interval(value: float, sigma: float, widening: float = 1.0, unit: str = "") -> IdentifiedValue:
    """A magnitude with a symmetric 90 % interval, which does not go below zero."""
    half = NINETY * sigma * widening
    low = max(value - half, 0.0) if value >= 0.0 else value - half
    return IdentifiedValue(
        value=value, standard_error=sigma * widening, interval_90=(low, value + half), unit=unit
    )


def force_values(forces: ForceHistory, b: int, widening: float) -> tuple[dict[str, IdentifiedValue], float]:
    """Peak force, peak and mean stress and late mean force of one bearing, and when the peak was [s]."""
    peak, moment = refined_peak(forces.time, forces.magnitude[:, b])
    at = int(np.argmax(forces.magnitude[:, b]))
    sigma = math.hypot(float(forces.magnitude_sigma[at, b]), MODEL_FORCE_SIGMA * peak)
    highest, _ = refined_peak(forces.time, forces.stress[:, b])
    top = int(np.argmax(forces.stress[:, b]))
    stress_sigma = math.hypot(float(forces.stress_sigma[top, b]), MODEL_STRESS_SIGMA * highest)
    mean_stress = float(np.mean(forces.stress[:, b]))
    mean_sigma = math.hypot(float(np.mean(forces.stress_sigma[:, b])), MODEL_MEAN_STRESS_SIGMA * mean_stress)
    values = {
        "peak_force_N": with_interval(peak, sigma, widening, "N"),
        "peak_stress_Pa": with_interval(highest, stress_sigma, widening, "Pa"),
        "mean_stress_Pa": with_interval(mean_stress, mean_sigma, widening, "Pa"),
    }
    late = (forces.time >= 0.15) & (forces.time <= 0.2)
    if forces.time[-1] >= 0.199:
        mean = float(np.mean(forces.magnitude[late, b]))
        spread = float(np.mean(forces.magnitude_sigma[late, b])) / math.sqrt(INDEPENDENT_SPANS)
        sigma = math.hypot(spread, MODEL_MEAN_FORCE_SIGMA * mean)
        values["mean_force_0p15_0p2_N"] = with_interval(mean, sigma, widening, "N")
    return values, moment


INCONSISTENT: Verdict = "the model does not fit the record"
"""Status of a number whose interval had to be widened to hold the cross-check."""
OF_CROSS_CHECK: Verdict = "of the cross-check: the model does not fit the record"
"""Status of a number that the cross-check gave in place of the twin."""
FACTOR_APART = 2.0
"""Factor between twin and cross-check from which the twin cannot have followed the drop [1]."""


def holding(value: IdentifiedValue, ratio: float, accuracy: float) -> IdentifiedValue:
    """The value with an interval that also holds ``ratio`` times it, within a relative accuracy [1]."""
    low, high = value.interval_90 or (value.value, value.value)
    other = value.value * ratio if math.isfinite(ratio) else value.value
    low, high = min(low, other - accuracy * abs(other)), max(high, other + accuracy * abs(other))
    if value.value >= 0.0:
        low = max(low, 0.0)
    return replace(
        value,
        interval_90=(low, high),
        standard_error=(high - low) / (2.0 * NINETY),
        status=INCONSISTENT,
    )


def is_beside(peak: IdentifiedValue, check: InputEstimate, b: int) -> bool:
    """Whether a peak is so far from the cross-check that the twin cannot have followed the drop."""
    found = float(check.peak[b])
    if not (math.isfinite(found) and found > 0.0 and peak.value > 0.0):
        return False  # no impact, or no cross-check: nothing to give way to
    return not 1.0 / FACTOR_APART <= found / peak.value <= FACTOR_APART


def with_cross_check(
    values: dict[str, IdentifiedValue], moment: float, forces: ForceHistory, check: InputEstimate, b: int
) -> tuple[dict[str, IdentifiedValue], float]:
    """Force and stress of a bearing, and when its peak was [s], where model and record disagree.

    The error of the twin's own numbers is not known then: up to 340 % where a support is stiffer in one
    direction than the model allows, with innovations 14 % too large. Intervals are widened until they hold
    the cross-check; a twin further from it than a factor of two gives way to it.
    """
    if is_beside(values["peak_force_N"], check, b):
        return _of_cross_check(check, b), float(check.time[check.magnitude[:, b].argmax()])
    peak, stress = (max(values[field].value, 1e-9) for field in ("peak_force_N", "peak_stress_Pa"))
    ratios = {
        "peak_force_N": (float(check.peak[b]) / peak, KNOWN_PEAK_ERROR),
        "peak_stress_Pa": (float(check.peak_stress[b]) / stress, KNOWN_STRESS_ERROR),
    }
    ratios["mean_stress_Pa"] = ratios["peak_stress_Pa"]
    if "mean_force_0p15_0p2_N" in values and np.isfinite(check.mean_late[b]):
        vector = forces.force[forces.time >= 0.15, b].mean(axis=0)
        ratio = float(check.mean_late[b] / max(np.hypot(*vector), 1e-9))
        ratios["mean_force_0p15_0p2_N"] = (ratio, KNOWN_MEAN_ERROR)
    held = {
        name: holding(value, *ratios[name]) if name in ratios else value for name, value in values.items()
    }
    return held, moment


def _of_cross_check(check: InputEstimate, b: int) -> dict[str, IdentifiedValue]:
    """What the cross-check knows, with twice the error it is known to make on drops that the model fits."""
    found = {
        "peak_force_N": (float(check.peak[b]), KNOWN_PEAK_ERROR, "N"),
        "peak_stress_Pa": (float(check.peak_stress[b]), KNOWN_STRESS_ERROR, "Pa"),
        "mean_force_0p15_0p2_N": (float(check.mean_magnitude_late[b]), KNOWN_MEAN_ERROR, "N"),
    }
    return {
        name: IdentifiedValue(
            value=value,
            status=OF_CROSS_CHECK,
            interval_90=((1.0 - 2.0 * error) * value, (1.0 + 2.0 * error) * value),
            standard_error=2.0 * error * value / NINETY,
            unit=unit,
        )
        for name, (value, error, unit) in found.items()
        if math.isfinite(value)
    }


NOT_DETERMINED: dict[bool, Verdict] = {
    False: "the record does not determine it",
    True: "known from the calibration",
}
"""Verdict on a parameter that the record says little about, by whether it was calibrated before."""
DETERMINED_SHARE = 0.7
"""A parameter counts as determined when its error falls below this share of its prior's [1]."""


def identified(unknown: Unknown, theta: float, sigma: float, widening: float = 1.0) -> IdentifiedValue:
    """An estimated parameter as a value with interval, start and verdict."""
    half = NINETY * sigma * widening
    determined = sigma * widening < DETERMINED_SHARE * unknown.sigma
    return IdentifiedValue(
        value=unknown.value_of(theta),
        status="determined" if determined else NOT_DETERMINED[unknown.calibrated],
        standard_error=unknown.standard_error(theta, sigma * widening),
        interval_90=(unknown.value_of(theta - half), unknown.value_of(theta + half)),
        start=unknown.value_of(unknown.begin),
        unit=unknown.unit,
    )


def model_error(unknown: Unknown, sigma: float, drops: int = 1) -> float:
    """Standard error of a parameter with what the fit to a number of drops leaves out of it."""
    if unknown.parameter is not parameter("air_gap"):
        return sigma
    lone = drops == 1 and unknown.sigma > UNSURE_GAP
    return math.hypot(sigma, LONE_GAP_SIGMA if lone else MODEL_GAP_SIGMA)


def parameter_widening(unknown: Unknown, sigma: float, widening: float = 1.0) -> float:
    """Factor on a parameter's standard error [1]; the widened error stays within that of the prior."""
    return max(1.0, min(PARAMETER_WIDENING * widening, unknown.sigma / max(sigma, 1e-300)))


def parameter_values(
    problem: DropProblem, smoothed: Smoothed, name: str, widening: float
) -> dict[str, IdentifiedValue]:
    """Identified parameters of one bearing, as they were shortly after the first contacts."""
    at = parameter_sample(smoothed)
    theta = smoothed.means[at][problem.parameter_slice]
    sigma = np.sqrt(np.maximum(np.diag(smoothed.covariance(at))[problem.parameter_slice], 0.0))
    values = {}
    for unknown, t, s in zip(problem.unknowns, theta, sigma, strict=True):
        if unknown.scope != "machine" or unknown.owner != name:
            continue
        error = model_error(unknown, float(s))
        wide = parameter_widening(unknown, error, widening)
        values[unknown.parameter.field] = identified(unknown, float(t), error, wide)
    if "friction.dynamic" in values:  # a bearing described without friction has none to find
        values["friction.static"] = _static_friction(problem, name, values["friction.dynamic"])
    values["equivalent_stiffness_N_per_m"] = _equivalent_stiffness(problem, name, values)
    return values


def _static_friction(problem: DropProblem, name: str, dynamic: IdentifiedValue) -> IdentifiedValue:
    """Static coefficient at its prior ratio to the dynamic one: sliding drops say little about it."""
    friction = problem.model.machine.bearing(name).friction
    ratio = float(friction.static) / float(friction.dynamic)
    low, high = dynamic.interval_90 or (dynamic.value, dynamic.value)
    return IdentifiedValue(
        value=ratio * dynamic.value,
        status="prior",
        standard_error=None if dynamic.standard_error is None else ratio * dynamic.standard_error,
        interval_90=(0.85 * ratio * low, 1.15 * ratio * high),
        unit="1",
    )


def _equivalent_stiffness(
    problem: DropProblem, name: str, values: dict[str, IdentifiedValue]
) -> IdentifiedValue:
    """Support and bearing in series [N/m], the bearing by its tangent at the static load."""
    from rotordrop.physics.ball_set import static_bearing_stiffness

    index = problem.model.bearing_names.index(name)
    constants = bearing_constants(problem.model.machine.bearing(name).bearing)
    bearing = static_bearing_stiffness(constants, float(problem.model.load_shares[index]))
    support = values["support.stiffness_N_per_m"]
    low, high = support.interval_90 or (support.value, support.value)

    def series(stiffness: float) -> float:
        return stiffness * bearing / (stiffness + bearing)

    return replace(
        support,
        value=series(support.value),
        interval_90=(series(low), series(high)),
        standard_error=(series(high) - series(low)) / (2.0 * NINETY),
        start=None,
    )
