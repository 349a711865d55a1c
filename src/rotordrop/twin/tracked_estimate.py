"""From a followed drop to its estimate: which numbers hold, which are replaced, and nothing of the filter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.touchdown_bearing import AIR_GAP
from rotordrop.errors import IdentificationError
from rotordrop.estimate.assumptions import left_to_assumption, twin_assumptions
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.estimate.bearing_values import bearing_values
from rotordrop.estimate.estimate import (
    CrossCheck,
    Estimate,
    FittedParameter,
    Innovations,
    PlaneUnbalance,
    SensorErrors,
    SensorMotion,
    Tracked,
    Verdict,
    unbalance_notes,
)
from rotordrop.estimate.published import Advice, LaterMotion, later_warning
from rotordrop.estimate.record_facts import RecordFacts
from rotordrop.evidence.quality.finding import WIRING
from rotordrop.evidence.synchronous import MarkAngle, angle_since_mark
from rotordrop.known import NINETY, Known
from rotordrop.severity.numbers import LOADS, NOT_DETERMINED
from rotordrop.track.consistency import NIS_RANGE, Check
from rotordrop.track.forces import predicted_readings
from rotordrop.track.input_state import InputEstimate, at_bearings
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Smoothed
from rotordrop.twin.tracked import TrackedDrop
from rotordrop.twin.tracked_loads import (
    INCONSISTENT,
    Loads,
    bearing_drop,
    check_with_noise,
    cross_checks,
    interval_from_zero,
    is_beyond_accuracy,
    is_beyond_factor,
    loads_of_cross_check,
    mixed_loads,
    twin_loads,
    widened_to_cross_check,
    widening_of,
)
from rotordrop.twin.tracked_parameters import (
    determination,
    gap_of_record,
    is_impossible_gap,
    joint_estimate,
    mixed_parameters,
    parameter_widening,
    parameters,
    sensor_errors,
)
from rotordrop.twin.value_of_information import value_of_information

NO_MARK = "not determined against a mark (the record carries no pulses of a tacho or keyphasor)"
NO_PASSAGE = "not determined against a mark (its pulses end before power-off, or are too few)"
NO_DIRECTION = "not determined (this drop does not tell a direction)"


def plane_unbalances(
    problem: DropProblem,
    smoothed: Smoothed,
    marks: Array | None,
    power_off: float,
    *,
    fits: bool,
    widening: float,
) -> tuple[PlaneUnbalance, ...]:
    """Unbalance of every plane of the machine, from its two components and their joint covariance.

    The filter counts the rotor angle from its first sample, so that instant is where the shaft stands
    against its mark, which passed at ``marks`` (M,) in record time [s], like power-off. Without agreement of
    model and record (``fits``) nothing is known but what was before; the widening is a factor on standard
    errors [1].
    """
    first = power_off + float(problem.time[0])
    turned = None if marks is None else angle_since_mark(marks, first)
    at = smoothed.filtered.parameter_sample
    mean, covariance = smoothed.means[at], smoothed.covariance(at)
    found = []
    for plane, unbalance in enumerate(problem.model.machine.unbalances):
        entries = np.array(problem.entries_that_set("unbalance", plane), dtype=np.intp)
        first = problem.unknowns[entries[0] - problem.n_dynamic]
        prior = first.sigma
        (a, b), (_, d) = covariance[np.ix_(entries, entries)]
        largest = math.sqrt(max(0.5 * (a + d) + math.hypot(0.5 * (a - d), b), 0.0))  # in any direction
        factor = parameter_widening(first, largest, widening)
        joint = factor**2 * covariance[np.ix_(entries, entries)]
        amount, phase = polar_of(complex(*mean[entries]), joint, prior, turned, fits)
        reason = NO_MARK if marks is None else NO_PASSAGE if turned is None else NO_DIRECTION
        found.append(
            PlaneUnbalance(
                node=unbalance.node, amount=amount, phase=phase, reason="" if phase is not None else reason
            )
        )
    return tuple(found)


def polar_of(
    vector: complex, covariance: Array, prior: float, turned: MarkAngle | None, fits: bool
) -> tuple[Known, Known | None]:
    """Amount and phase of a vector: its error along itself is that of the amount, the other of the phase."""
    size, direction = abs(vector), math.atan2(vector.imag, vector.real)
    along = np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    error = math.sqrt(max(float(along @ covariance @ along), 0.0))
    sideways = NINETY * math.sqrt(max(float(across @ covariance @ across), 0.0))
    highest = size + NINETY * error
    amount = Known(
        value=size,
        status=determination(error / prior) if fits else INCONSISTENT,
        standard_error=error,
        interval_90=(max(size - NINETY * error, 0.0), highest) if fits else (0.0, highest + NINETY * prior),
        unit="kg m",
    )
    if turned is None or not fits or max(NINETY * error, sideways) >= size:
        return amount, None
    half = min(math.hypot(math.asin(sideways / size), NINETY * turned.error), math.pi)
    phase = math.remainder(direction - turned.angle - 0.5 * math.pi, 2.0 * math.pi)
    return amount, Known(
        value=phase,
        status=determination(2.0 * half / math.pi),
        standard_error=half / NINETY,
        interval_90=(phase - half, phase + half),
        unit="rad",
    )


QUICK = (
    "Quick estimate: one pass over the record, {}without the search for the size of the process noise. "
    "A number that decides needs a whole estimate."
)
RESOLVED = 4.0
"""Difference of two largest distances that counts, in standard deviations of the noise [1]."""


@dataclass(frozen=True, kw_only=True)
class _Judgement:
    """How far the twin is believed.

    ``check`` is the estimate without contact law, if one was made; ``widening`` the factor on the twin's
    intervals [1]; ``parameters`` and ``sensors`` what it identified; ``replaced_at`` the bearings whose
    numbers are not the twin's.
    """

    verdict: Verdict
    check: InputEstimate | None
    widening: float
    parameters: tuple[FittedParameter, ...]
    sensors: tuple[SensorErrors, ...]
    replaced_at: tuple[bool, ...]

    @property
    def fits(self) -> bool:
        """Whether the twin's own numbers hold."""
        return self.verdict.holds


def estimate_of(drop: TrackedDrop, method: Tracked, facts: RecordFacts) -> Estimate:
    """The estimate of a followed drop; it keeps nothing of the filter.

    Raises
    ------
    IdentificationError
        If the model does not fit the record and the sensors see too little for a cross-check: the errors of
        its numbers have no limit then.
    """
    drop, check = cross_checked(drop, method)
    problem, evidence = drop.problem, drop.evidence
    judged = _judge(drop, check)
    until = float(problem.time[-1])
    later = motion_later(drop, believed=judged.fits)
    advice = _advice(drop, judged)
    unbalance = plane_unbalances(
        problem,
        drop.smoothed,
        evidence.record.marks,
        evidence.power_off.value,
        fits=judged.fits,
        widening=judged.widening,
    )
    values = {parameter.path: parameter.estimate for parameter in judged.parameters}
    assumed = left_to_assumption(problem)
    if all(one.phase is None for one in unbalance):
        assumed |= dict.fromkeys(unbalance_notes(unbalance), "no unbalance phase")
    quick = (QUICK.format("" if judged.check else "without the independent cross-check and "),)
    warned = {one.kind for one in facts.findings if one.severity == "warning"}
    if not judged.fits and not warned.isdisjoint(WIRING):  # the cross-check rests on the sensors too
        judged = replace(judged, verdict=Verdict.UNDETERMINED)
    return Estimate(
        name=evidence.name,
        method=method,
        machine=problem.model.machine,
        record=evidence.record,
        drop_instant=evidence.power_off,
        speed=float(problem.mean[problem.model.layout.rotor_speed]),
        until=until,
        verdict=judged.verdict,
        bearings=_bearings(drop, judged),
        parameters=judged.parameters,
        checks=drop.checks,
        sensors=judged.sensors,
        joint=joint_estimate(problem, drop.smoothed) if judged.fits else None,
        unbalance=unbalance,
        structure=(
            *(one.structure(problem.model.machine, values, believed=judged.fits) for one in drop.accepted),
            *(one.structure() for one in drop.others if judged.fits and one.name != drop.named),
        ),
        cross_check=_comparisons(drop, judged),
        innovations=_innovations(drop),
        at_sensors=_at_sensors(drop),
        nis=drop.judged.nis,
        noise_factor=drop.noise_factor,
        advice=advice,
        later=later,
        findings=facts.findings,
        warnings=facts.warnings_with(*evidence.power_off.notes, later_warning(later, until)),
        notes=(
            *twin_assumptions(evidence, problem),
            *assumed,
            *(check.noted() for check in drop.checks if check.note),
            *(f"a further number: {one.sentence}" for one in advice),
            *(note for note in unbalance_notes(unbalance) if note not in assumed),
            *(quick if method.quick else ()),
        ),
        assumed=assumed,
        simulated_record=facts.simulated,
    )


def _advice(drop: TrackedDrop, judged: _Judgement) -> tuple[Advice, ...]:
    """What to measure of a machine whose rotor is not known by its drawing, or whose forces are wide."""
    unsure = any(unknown.path == "rotor.stiffness_factor" for unknown in drop.problem.unknowns)
    loads = (_loads(drop, judged, b).force.peak for b in range(len(drop.problem.model.bearing_names)))
    wide = any(one.is_wide for one in loads)
    # of a model that does not fit the covariances say nothing
    if not judged.fits or not (unsure or wide) or drop.drops != 1:
        return ()
    return value_of_information(drop.problem, drop.smoothed, drop.forces, judged.widening)


def cross_checked(drop: TrackedDrop, method: Tracked) -> tuple[TrackedDrop, InputEstimate | None]:
    """The drop with one check more, and the estimate without contact law, if one is made.

    A twin whose innovations are white may still be wrong where its contact law is, or an extension: a peak
    beyond the accuracy of the cross-check is not called consistent. That one takes nothing from the twin,
    since what it says of gaps and sensors may be as wrong as what it says of forces. Where noise would hide
    as much of the forces of the twin from it, it says nothing against them. A quick estimate does without it.
    """
    problem = drop.problem
    if not drop.sees_all_directions or (drop.consistent and method.quick):
        return drop, None
    if drop.consistent:
        check = drop.without_contact_law()
        peaks = drop.forces.magnitude.max(axis=0)
        apart = [
            b
            for b, peak in enumerate(peaks)
            if b not in problem.held and is_beyond_accuracy(float(peak), check, b)
        ]
        if not apart:
            return drop, check
        check, shown = check_with_noise(problem, drop.forces, check, apart)
        names = problem.model.bearing_names
        said = {
            b: f"the peak force at {names[b]} is {peaks[b]:.0f} N, "
            f"without a contact law {check.peak[b]:.0f} N"
            for b in apart
        }
        beyond = [b for b in apart if is_beyond_accuracy(float(shown[b]), check, b)]
        noted = [
            f"{said[b]}, where noise would leave {shown[b]:.0f} N to be seen of it"
            for b in apart
            if b not in beyond
        ]
        added = Check(
            name="cross-check",
            passed=not beyond,
            message="; ".join(said[b] for b in beyond or apart),
            note="; ".join(noted),
            remedy="plan with the upper end; calibrate on two drops with their tails",
        )
        return replace(drop, checks=(*drop.checks, added)), check
    return drop, drop.without_contact_law()


def _judge(drop: TrackedDrop, check: InputEstimate | None) -> _Judgement:
    """Weigh the twin's own checks and the estimate without contact law."""
    problem, smoothed = drop.problem, drop.smoothed
    if not drop.consistent and check is None:
        _refuse_unchecked(drop)
    fits = drop.consistent or check is None
    widening = widening_of(drop.checks)
    found = {one.path: one for one in parameters(problem, smoothed, fits=fits, widening=widening)}
    if fits:
        found = mixed_parameters(
            found,
            [
                (one.probability, parameters(one.problem, one.smoothed, fits=fits, widening=widening))
                for one in drop.others
            ],
        )
    replaced_at = [False] * len(problem.model.bearing_names)
    if not fits and check is not None:
        for b, name in enumerate(problem.model.bearing_names):
            if b in problem.held:
                continue
            # the twin has lost the drop there: by its peak force, or by an air gap that cannot be
            gap, peak = found[AIR_GAP.path_of(name)], float(drop.forces.magnitude[:, b].max())
            replaced_at[b] = is_beyond_factor(peak, check, b) or is_impossible_gap(problem, gap.estimate, b)
            if replaced_at[b]:
                found[gap.path] = replace(gap, estimate=gap_of_record(problem, b))
    verdict = Verdict.CONSISTENT if drop.consistent else Verdict.ONE_DIRECTION
    if drop.consistent and drop.accepted:
        verdict = Verdict.EXTENDED
    if not fits:
        verdict = Verdict.REPLACED if any(replaced_at) else Verdict.WIDENED
    return _Judgement(
        verdict=verdict,
        check=check,
        widening=widening,
        parameters=tuple(found.values()),
        sensors=sensor_errors(problem, smoothed, fits=fits, widening=widening),
        replaced_at=tuple(replaced_at),
    )


def _refuse_unchecked(drop: TrackedDrop) -> None:
    failed = [check for check in drop.checks if check.failed]
    if len(failed) == 1:  # the directions themselves: the model fits what is seen
        return
    raise IdentificationError(
        f"the model does not fit the record {drop.evidence.name} "
        f"({'; '.join(check.said() for check in failed)}), and "
        "nothing can check its force; expected a model that fits, or both directions in two planes. "
        "Calibrate on drops with all sensors, make a whole estimate, or leave this drop out."
    )


def _bearings(drop: TrackedDrop, judged: _Judgement) -> tuple[BearingDrop, ...]:
    measured = measured_motion(drop, drop.problem.readings, believed=judged.fits)
    low, high = drop.evidence.power_off.interval_90
    found = []
    for b in range(len(drop.problem.model.bearing_names)):
        values: dict[str, Known] = bearing_values(
            drop.problem.model.machine, b, float(drop.problem.model.load_shares[b]), judged.parameters
        )
        held = None if judged.fits else judged.check
        found.append(
            bearing_drop(
                drop.problem,
                drop.forces,
                b,
                _loads(drop, judged, b, values.get("preload_N")),
                measured[:, b],
                values,
                judged.widening,
                held,
                0.5 * (high - low),
            )
        )
    if judged.verdict is Verdict.UNDETERMINED:
        lost = {one.field: NOT_DETERMINED for one in LOADS}
        found = [replace(one, missing={**one.missing, **lost}) for one in found]
    return tuple(found)


def _loads(drop: TrackedDrop, judged: _Judgement, b: int, preload: Known | None = None) -> Loads:
    twin = _twin(drop, judged, b)
    if b in drop.problem.held:
        return interval_from_zero(twin)
    if judged.fits or judged.check is None:
        return twin
    if judged.replaced_at[b]:
        return loads_of_cross_check(judged.check, b)
    return widened_to_cross_check(twin, judged.check, b, preload)


def _twin(drop: TrackedDrop, judged: _Judgement, b: int) -> Loads:
    """Loads of the twin, replaced or not."""
    sigma = numbers_of(drop.problem.model.machine.touchdown_bearings[b]).stress_sigma
    loads = twin_loads(drop.forces, b, judged.widening, sigma)
    if not judged.fits:
        return loads
    others = [(one.probability, twin_loads(one.forces, b, judged.widening, sigma)) for one in drop.others]
    return mixed_loads(loads, others)


def _comparisons(drop: TrackedDrop, judged: _Judgement) -> tuple[CrossCheck, ...]:
    if judged.check is None:
        return ()
    found: list[CrossCheck] = []
    for b, name in enumerate(drop.problem.model.bearing_names):
        if b in drop.problem.held:
            continue  # the cross-check sees what its magnets do there
        twin = _twin(drop, judged, b)
        found += cross_checks(name, twin, drop.forces, judged.check, b, replaced=judged.replaced_at[b])
    return tuple(found)


def measured_motion(drop: TrackedDrop, readings: Array, *, believed: bool) -> Array:
    """Motion at the bearings [m], shape (N, B, 2), of readings (N, C) [m].

    ``believed``: sensor errors as the twin found them, else by the record alone.
    """
    estimate = drop.smoothed.means[-1] if believed else drop.problem.mean
    gain_errors, offsets = drop.problem.sensor_errors(estimate)
    return at_bearings(drop.problem, (readings - offsets) / (1.0 + gain_errors))


def motion_later(drop: TrackedDrop, *, believed: bool) -> tuple[LaterMotion, ...]:
    """What the rest of the record says after the estimated part; ``believed`` as for `measured_motion`."""
    evidence = drop.evidence
    return later_motion(
        drop.problem.model.bearing_names,
        evidence.time,
        measured_motion(drop, evidence.readings(np.inf), believed=believed),
        until=float(drop.problem.time[-1]),
        noise=float(np.sqrt(np.mean(drop.problem.variances))),
    )


def later_motion(
    names: Sequence[str], time: Array, motion: Array, until: float, noise: float
) -> tuple[LaterMotion, ...]:
    """Compare the rest of a record with its estimated part, bearing by bearing; empty where nothing follows.

    The motion (N, B, 2) is the measured displacement from the centres of the bearings [m], the noise its
    standard deviation [m]; times (N,) and the end of the estimated part count from power-off [s].
    """
    radius = np.hypot(motion[..., 0], motion[..., 1])
    parts = ((time >= 0.0) & (time <= until), time > until)
    found = []
    for b, name in enumerate(names):
        inside = [np.flatnonzero(part & np.isfinite(radius[:, b])) for part in parts]
        if not all(len(samples) for samples in inside):
            continue
        first, later = (samples[np.argmax(radius[samples, b])] for samples in inside)
        before, after, resolved = float(radius[first, b]), float(radius[later, b]), RESOLVED * noise
        found.append(
            LaterMotion(
                bearing=name,
                first=before,
                first_time=float(time[first]),
                later=after,
                later_time=float(time[later]),
                resolved=resolved,
                larger=after > before + resolved,
            )
        )
    return tuple(found)


def _at_sensors(drop: TrackedDrop) -> SensorMotion:
    estimated = predicted_readings(drop.problem, drop.smoothed)
    measured = drop.problem.readings[: len(estimated)]
    live = np.isfinite(measured).any(axis=0)
    names = np.array([sensor.name for sensor in drop.problem.model.machine.sensors])
    return SensorMotion(
        channels=tuple(names[live].tolist()),
        time=drop.problem.time[: len(estimated)].copy(),
        measured=measured[:, live],
        estimated=estimated[:, live],
    )


def _innovations(drop: TrackedDrop) -> Innovations:
    filtered = drop.judged
    done = filtered.done
    return Innovations(
        channels=tuple(sensor.name for sensor in drop.problem.model.machine.sensors),
        time=drop.problem.time[:done].copy(),
        values=filtered.innovations[:done, :-1].copy(),
        deviation=np.sqrt(filtered.innovation_variances[:done, :-1]),
        limits=NIS_RANGE,
    )
