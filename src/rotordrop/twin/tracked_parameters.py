"""Identified parameters and sensor errors of a followed drop: values with intervals, priors and verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Parameter
from rotordrop.elements.table import parameter
from rotordrop.elements.touchdown_bearing import AIR_GAP, MODEL_GAP_ERROR
from rotordrop.estimate.estimate import FittedParameter, SensorErrors
from rotordrop.estimate.published import Joint
from rotordrop.known import NINETY, Known, Status
from rotordrop.record.axes import sensor_polarity
from rotordrop.rotor.unknowns import Unknown, sensor_prior, smallest_gap
from rotordrop.track.consistency import DEPARTURE_LIMIT
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Smoothed, has_diverged
from rotordrop.twin.mixture import mixed
from rotordrop.twin.tracked_loads import INCONSISTENT, OF_CROSS_CHECK, symmetric, with_interval

LOOSE_SIGMA = 0.06
"""Standard deviation of the logarithm of friction and supports that a loose race adds, followed as a held one
[1]."""
STAND_FOR_PLAY = ("contact.", "race.", "damping_time")
"""What the parameters of a race that stand in for its play begin with."""
UNSURE_GAP = 0.05
"""Relative prior standard deviation from which an air gap counts as guessed [1]."""
UNDETERMINED: Status = "the record does not determine it"
KNOWN: Status = "known from the calibration"
AT_BOUND: Status = "at its bound"
NOT_DETERMINED: tuple[Status, ...] = (UNDETERMINED, KNOWN, AT_BOUND)
"""Verdicts on a parameter that the record says little about; the second where it was calibrated before, the
third where the fit went beyond what the model follows."""
DETERMINED_SHARE, WEAKLY_DETERMINED_SHARE = 0.3, 0.7
"""Standard error over that of the prior up to which a parameter is determined, and weakly determined [1]."""


def determination(share: float, *, calibrated: bool = False) -> Status:
    """Status on a parameter whose standard error is this share of its prior's [1]."""
    if share < DETERMINED_SHARE:
        return "determined"
    if share < WEAKLY_DETERMINED_SHARE:
        return "weakly determined"
    return KNOWN if calibrated else UNDETERMINED


def identified(unknown: Unknown, theta: float, sigma: float, widening: float = 1.0) -> Known:
    """An estimated parameter as a value with interval, start and verdict."""
    half = NINETY * sigma * widening
    interval = (unknown.value_of(theta - half), unknown.value_of(theta + half))
    status = determination(sigma / unknown.sigma, calibrated=unknown.calibrated)
    if status not in NOT_DETERMINED and not unknown.bounds[0] < theta < unknown.bounds[1]:
        # beyond its bound the model does not follow: what is known of it is what was known before
        status = AT_BOUND
        known = (unknown.value_of(unknown.mean + side * NINETY * unknown.sigma) for side in (-1, 1))
        ends = (*interval, *known)
        interval = (min(ends), max(ends))
    return Known(
        value=unknown.value_of(theta),
        status=status,
        standard_error=unknown.standard_error(theta, sigma * widening),
        interval_90=within_bounds(unknown.parameter, interval),
        start=unknown.value_of(unknown.begin),
        unit=unknown.unit,
    )


def within_bounds(row: Parameter, interval: tuple[float, float]) -> tuple[float, float]:
    """An interval that ends where the quantity does: no air gap is below zero."""
    low, high = interval
    return (max(low, 0.0), max(high, 0.0)) if row is AIR_GAP else interval


def parameter_widening(unknown: Unknown, sigma: float, widening: float) -> float:
    """Factor on a parameter's standard error [1] where all errors are wider; it stays within the prior's."""
    return max(1.0, min(widening, unknown.sigma / max(sigma, 1e-300)))


def parameters(
    problem: DropProblem, smoothed: Smoothed, *, fits: bool, widening: float
) -> tuple[FittedParameter, ...]:
    """Every unknown as it was shortly after the first contacts, beside what was known before.

    Where model and record disagree, a parameter may be anything between its prior and the fit.
    """
    at = smoothed.filtered.parameter_sample
    values = fitted_values(problem, smoothed.means[at], smoothed.covariance(at), widening)
    found = []
    for unknown, value in zip(problem.unknowns, values, strict=True):
        prior = identified(unknown, unknown.mean, unknown.sigma)
        value = never_used_up(problem, smoothed.means, unknown, value)
        if not fits:
            value = replace(value, status=INCONSISTENT, interval_90=_hull(value, prior), allowance_90=None)
        found.append(FittedParameter(row=unknown.parameter, owner=unknown.owner, prior=prior, estimate=value))
    return tuple(found)


def mixed_parameters(
    found: dict[str, FittedParameter], others: Sequence[tuple[float, tuple[FittedParameter, ...]]]
) -> dict[str, FittedParameter]:
    """Parameters by path with the intervals of a mixture of models: probabilities [1] and what they found.

    A model that does not have a parameter says nothing of it.
    """
    known = [(weight, {one.path: one.estimate for one in listed}) for weight, listed in others]
    return {
        path: replace(
            one,
            estimate=mixed(one.estimate, [(weight, there[path]) for weight, there in known if path in there]),
        )
        for path, one in found.items()
    }


def never_used_up(problem: DropProblem, means: Array, unknown: Unknown, value: Known) -> Known:
    """A way up to a stop that the motion of the drop (N, n) did not use up: larger than the largest travel.

    Any other value, and a way that was used up, as it is.
    """
    if unknown.parameter.way_of != "support":
        return value
    moved = problem.model.layout.support_deflection(means, unknown.targets[0].row)
    travel = float(np.max(np.hypot(moved[:, 0], moved[:, 1])))
    if travel >= value.value:
        return value
    ends = max(value.low, travel), max(value.high, travel)
    return replace(value, status=UNDETERMINED, lower=travel, interval_90=ends)


def fitted_values(problem: DropProblem, mean: Array, covariance: Array, widening: float) -> list[Known]:
    """Every unknown with its interval and verdict, from mean (n,) and covariance (n, n) of an estimate.

    Inertia and drag of a race show together, when it catches up with the rotor. Where one of them ended at
    its bound the other one stands in for it, and neither is a finding. Contact, race and balls of a loose
    race, which was followed as a held one, stand in for its play.
    """
    theta = mean[problem.parameter_slice]
    sigma = np.sqrt(np.maximum(np.diag(covariance)[problem.parameter_slice], 0.0))
    values = []
    for unknown, t, s in zip(problem.unknowns, theta.tolist(), sigma.tolist(), strict=True):
        left_out = _left_out(problem, unknown)
        error = math.hypot(s, left_out)
        wider = parameter_widening(unknown, error, widening)
        value, allowed = identified(unknown, t, error, wider), NINETY * wider * left_out
        values.append(replace(value, allowance_90=allowed) if unknown.parameter is AIR_GAP else value)
    races = list(zip(problem.unknowns, values, strict=True))
    astray = {u.owner for u, v in races if u.parameter.spin_up_only and v.status == AT_BOUND}

    def stands_in(unknown: Unknown) -> bool:
        if _play_sigma(problem, unknown) > 0.0 and unknown.parameter.path.startswith(STAND_FOR_PLAY):
            return True
        return unknown.parameter.spin_up_only and unknown.owner in astray

    return [
        replace(
            value,
            status=UNDETERMINED,
            standard_error=None,
            interval_90=_hull(value, identified(unknown, unknown.mean, unknown.sigma)),
        )
        if value.status != AT_BOUND and stands_in(unknown)
        else value
        for unknown, value in races
    ]


def joint_estimate(problem: DropProblem, smoothed: Smoothed) -> Joint:
    """What belongs to the machine as it was shortly after the first contacts, with all covariances."""
    at, places = smoothed.filtered.parameter_sample, problem.machine_indices
    sensors = problem.model.machine.sensors
    paths = [unknown.path for unknown in problem.unknowns if unknown.scope == "machine"]
    paths += [parameter(part, "sensor").path_of(s.name) for part in ("gain", "offset") for s in sensors]
    before = prior_of(problem)
    covariance = smoothed.covariance(at)[np.ix_(places, places)]
    return Joint(
        paths=paths,
        mean=smoothed.means[at][places].tolist(),
        covariance=[float(f"{c:.9g}") for c in covariance[np.tril_indices(len(paths))]],
        prior_mean=before[0][places].tolist(),
        prior_standard_deviation=before[1][places].tolist(),
    )


def prior_of(problem: DropProblem) -> tuple[Array, Array]:
    """Mean and standard deviation of every entry of an estimate before anything of its record was read.

    The prior of the problem itself knows the settled tail already.
    """
    mean, sigma = problem.mean.copy(), np.sqrt(np.diag(problem.covariance))
    gap = smallest_gap(problem.model.machine)
    for place, unknown in enumerate(problem.unknowns, start=problem.n_dynamic):
        mean[place], sigma[place] = unknown.mean, unknown.sigma
    first = problem.parameter_slice.stop
    for c, sensor in enumerate(problem.model.machine.sensors):
        known = sensor_prior(parameter("offset", "sensor"), sensor.offset, gap)
        offset = first + problem.n_channels + c
        mean[offset], sigma[offset] = sensor.polarity * known.mean, known.sigma
    return mean, sigma


def _hull(one: Known, other: Known) -> tuple[float, float]:
    return min(one.low, other.low), max(one.high, other.high)


def _left_out(problem: DropProblem, unknown: Unknown) -> float:
    """Standard deviation of an unknown beyond its fit, in the measure it is estimated in."""
    play = _play_sigma(problem, unknown)
    if unknown.parameter is AIR_GAP:
        return math.hypot(MODEL_GAP_ERROR * unknown.begin, play)
    return LOOSE_SIGMA if play > 0.0 else 0.0


def _play_sigma(problem: DropProblem, unknown: Unknown) -> float:
    """Standard deviation of the play of the race that an unknown belongs to [m]; zero of all others."""
    of_bearing = unknown.parameter.owner == "bearing"
    return problem.model.play_sigma(unknown.targets[0].row) if of_bearing else 0.0


def gap_of_record(problem: DropProblem, b: int) -> Known:
    """Air gap [m] by settled tail and machine file alone, for a twin that lost the record."""
    entry = problem.gap_entries[b]
    value = float(problem.mean[entry])
    return replace(
        with_interval(
            value, math.hypot(math.sqrt(problem.covariance[entry, entry]), MODEL_GAP_ERROR * value)
        ),
        status=OF_CROSS_CHECK,
        unit="m",
    )


def is_impossible_gap(problem: DropProblem, gap: Known, b: int) -> bool:
    """Whether an estimated air gap is none that the machine can have, by settled tail and machine file."""
    entry = problem.gap_entries[b]
    sigma = math.sqrt(problem.covariance[entry, entry])
    return gap.value <= 0.0 or abs(gap.value - float(problem.mean[entry])) > DEPARTURE_LIMIT * sigma


def sensor_errors(
    problem: DropProblem, smoothed: Smoothed, *, fits: bool, widening: float
) -> tuple[SensorErrors, ...]:
    """Gain and offset of every sensor at the end of the drop, and its noise.

    Where model and record disagree, each may be anything between its prior, by machine file and settled tail,
    and the fit. Where the filter lost the record the prior alone stands.
    """
    last = len(smoothed.means) - 1
    sigma = np.sqrt(np.maximum(np.diag(smoothed.covariance(last)), 0.0))
    status: Status = "determined" if fits else INCONSISTENT
    found = _sensor_values(problem, smoothed.means[last], widening * sigma, status)
    if not fits:
        # an error of the rotor's form looks like one of the gains, as in the check of both
        form = problem.model.machine.rotor.gain_sigma
        before = _sensor_values(
            problem, problem.mean, np.sqrt(np.diag(problem.covariance)), UNDETERMINED, form
        )
        if has_diverged(smoothed.filtered):
            found = before
        found = [
            [replace(value, interval_90=_hull(value, prior)) for value, prior in zip(*both, strict=True)]
            for both in zip(found, before, strict=True)
        ]
    return tuple(
        SensorErrors(
            sensor=sensor.name,
            gain_error=gain_error,
            offset=offset,
            noise=float(np.sqrt(problem.variances[c])),
        )
        for c, (sensor, gain_error, offset) in enumerate(
            zip(problem.model.machine.sensors, *found, strict=True)
        )
    )


def _sensor_values(
    problem: DropProblem, mean: Array, sigma: Array, status: Status, form: float = 0.0
) -> list[list[Known]]:
    """Gain errors [1] and offsets [m] of all sensors by mean and standard deviations of an estimate (n,).

    The gains have a further standard deviation by the form of the rotor [1].
    """
    gains, offsets = problem.sensor_errors(mean)
    found = gains, offsets * sensor_polarity(problem.model.machine.sensors)
    return [
        [
            symmetric(float(value), math.hypot(error, more), status, unit)
            for value, error in zip(values, errors, strict=True)
        ]
        for values, errors, unit, more in zip(
            found, problem.sensor_errors(sigma), ("1", "m"), (form, 0.0), strict=True
        )
    ]
