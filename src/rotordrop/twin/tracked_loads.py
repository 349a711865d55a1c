"""Force and stress of a followed drop: histories with bands, peaks, means and impacts with intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.touchdown_bearing import AIR_GAP, MODEL_GAP_ERROR
from rotordrop.estimate.bearing_drop import (
    LATE,
    AirGap,
    Band,
    BearingDrop,
    History,
    Impact,
    Motion,
    Origin,
    Peak,
    deepest,
    mean_late,
    when_largest,
)
from rotordrop.estimate.estimate import CrossCheck
from rotordrop.evidence.impacts import after_flights, lasting_from
from rotordrop.known import NINETY, Known, Status
from rotordrop.one_thread import one_thread
from rotordrop.series import refined_peak, runs_of
from rotordrop.track.consistency import Check, direction_check
from rotordrop.track.forces import ForceHistory
from rotordrop.track.input_state import (
    MEAN_ERROR,
    STRESS_PER_PEAK,
    InputEstimate,
    corrections_by_record,
    input_state_estimate,
    peaks_shown,
)
from rotordrop.track.problem import DropProblem
from rotordrop.twin.allowances import (
    MODEL_FORCE_SIGMA,
    MODEL_MEAN_FORCE_SIGMA,
    MODEL_MEAN_STRESS_SIGMA,
    MODEL_STRESS_SIGMA,
)
from rotordrop.twin.mixture import mixed

INCONSISTENT_WIDENING = 2.0
"""Factor on intervals when the model is not consistent with the record [1]; those of force and stress grow
further until they hold the cross-check as well."""
FACTOR_APART = 2.0
"""Factor between twin and cross-check from which the twin cannot have followed the drop [1]."""
MEAN_STRESS_ERROR = 0.10
"""Relative error of a mean stress that rests on the preload of the machine file [1]: by its third root."""

INCONSISTENT: Status = "the model does not fit the record"
"""Status of a number of a model that is not believed; it holds the cross-check, where there is one."""
OF_CROSS_CHECK: Status = "of the cross-check: the model does not fit the record"
"""Status of a number that does not rest on the twin, because the twin lost the record."""
CUT: Status = "the estimated part ends during this contact"
"""Status of the numbers of an impact that goes on behind the end of the window."""
DIVERGED_WIDENING = 2.6
"""Half width of a number of the cross-check, where the twin lost the record, over the error that it makes on
drops that the model fits [1].

Source: of the peak forces of eight hidden machines told in twelve numbers it holds nine in ten, 13 of 14; of
seven others, too (study `twelve_numbers`).
"""
RIPPLE = 4e-3
"""Where model and record disagree, what a mean over this time takes off a force may be noise [s] (chosen)."""

NO_LATE_MEAN = f"estimate ends before {1e3 * LATE[1]:.0f} ms"


@dataclass(frozen=True)
class Load:
    """One load of a bearing: its history, the band of that, and its peak."""

    history: History
    band: Band
    peak: Peak

    def with_peak(self, known: Known) -> Load:
        """The load with another peak, and a band at least as wide everywhere, so that both say the same."""
        peak, band = replace(self.peak, known=known), self.band
        low, high = known.interval_90 or (known.value, known.value)
        scale = self.history.values / max(known.value, 1e-300)
        lower, upper = np.minimum(band.lower, low * scale), np.maximum(band.upper, high * scale)
        return Load(self.history, replace(band, lower=lower, upper=upper), peak)


@dataclass(frozen=True, kw_only=True)
class Loads:
    """Force and stress of one bearing, all from one origin."""

    force: Load
    stress: Load
    means: Mapping[str, Known]
    missing: Mapping[str, str] = field(default_factory=dict)


def widening_of(checks: Iterable[Check]) -> float:
    """Factor on all intervals by the checks of a drop [1]: what is noted widens, what fails doubles them."""
    return max(max(one.widening, 1.0 if one.passed else INCONSISTENT_WIDENING) for one in checks)


def with_form_error(forces: ForceHistory, sigma: float) -> ForceHistory:
    """Forces with the relative error of the rotor's form [1]; stress goes with the third root of force."""
    return replace(
        forces,
        magnitude_sigma=np.hypot(forces.magnitude_sigma, sigma * forces.magnitude),
        stress_sigma=np.hypot(forces.stress_sigma, sigma / 3.0 * forces.stress),
    )


@one_thread()
def check_without_contact_law(problem: DropProblem) -> InputEstimate:
    """The cross-check, with the error of the rotor's form; it takes nothing from the twin."""
    check = input_state_estimate(problem, corrections_by_record(problem))
    return check_with_form_error(check, problem.model.machine.rotor.force_sigma)


def checks_begun(pool: Executor, problems: Sequence[DropProblem]) -> list[Future[InputEstimate] | None]:
    """The cross-check of every drop that is seen in all directions, begun in a pool."""
    return [
        pool.submit(check_without_contact_law, problem) if direction_check(problem).passed else None
        for problem in problems
    ]


def check_with_form_error(check: InputEstimate, sigma: float) -> InputEstimate:
    """The cross-check with the relative error of the rotor's form [1]."""
    form = NINETY * sigma
    return replace(
        check,
        peak_error=np.hypot(check.peak_error, form),
        stress_error=np.hypot(check.stress_error, form / 3.0),
    )


def symmetric(value: float, sigma: float, status: Status, unit: str, widening: float = 1.0) -> Known:
    """A value with a symmetric 90 % interval."""
    half = NINETY * sigma * widening
    return Known(
        value=value,
        status=status,
        standard_error=sigma * widening,
        interval_90=(value - half, value + half),
        unit=unit,
    )


def with_interval(
    value: float, sigma: float, widening: float = 1.0, unit: str = "", left_out: float = 0.0
) -> Known:
    """A magnitude with a symmetric 90 % interval, which does not go below zero.

    ``left_out`` is the standard deviation by what the model leaves out alone, independent of the rest.
    """
    known = symmetric(value, sigma, "determined", unit, widening)
    return replace(
        known,
        interval_90=(max(known.low, 0.0) if value >= 0.0 else known.low, known.high),
        allowance_90=NINETY * left_out * widening if left_out > 0.0 else None,
    )


def twin_loads(forces: ForceHistory, b: int, widening: float, ball_sigma: float = 0.0) -> Loads:
    """Force and stress of one bearing as the twin has them; bands are as wide as the stated intervals.

    ``ball_sigma`` is the relative standard deviation of the stress by balls inferred from a designation [1].
    """

    def load(values: Array, sigma: Array, unit: str, model_share: float) -> Load:
        history = History(label="estimated", time=forces.time, values=values[:, b], role="estimated")
        error = np.hypot(sigma[:, b], model_share * values[:, b])
        value, moment = refined_peak(history.time, history.values)
        at_peak = float(error[int(np.argmax(history.values))])
        known = with_interval(value, at_peak, widening, unit, model_share * value)
        peak = Peak(known=known, time=moment, origin=Origin.TWIN)
        return Load(history, _band(history, NINETY * widening * error, unit), peak)

    force = load(forces.magnitude, forces.magnitude_sigma, "N", MODEL_FORCE_SIGMA)
    stress = load(forces.stress, forces.stress_sigma, "Pa", math.hypot(MODEL_STRESS_SIGMA, ball_sigma))
    mean_stress = float(np.mean(stress.history.values))
    spread = float(np.mean(forces.stress_sigma[:, b]))
    left_out = math.hypot(MODEL_MEAN_STRESS_SIGMA, ball_sigma) * mean_stress
    sigma = math.hypot(spread, left_out)
    means = {"mean_stress_Pa": with_interval(mean_stress, sigma, widening, "Pa", left_out)}
    late_mean = mean_late(force.history)
    if late_mean is not None:
        # What the force of one sample gets wrong the next ones take back, or the readings would show it: the
        # errors of a mean are those of independent samples at most.
        late = (forces.time >= LATE[0]) & (forces.time <= LATE[1])
        independent, length = forces.magnitude_sigma[late, b], forces.magnitude[late, b]
        spread = float(np.linalg.norm(independent)) * math.sqrt(forces.substeps) / len(independent)
        # An error across a force lengthens it, whatever its sign: no number of samples averages that out.
        lengthened = float(np.mean(np.hypot(length, independent) - length))
        left_out = MODEL_MEAN_FORCE_SIGMA * late_mean
        sigma = math.hypot(spread, lengthened, left_out)
        means["mean_force_0p15_0p2_N"] = with_interval(late_mean, sigma, widening, "N", left_out)
    return Loads(
        force=force,
        stress=stress,
        means=means,
        missing={} if late_mean is not None else {"mean_force_0p15_0p2_N": NO_LATE_MEAN},
    )


def mixed_loads(loads: Loads, others: Sequence[tuple[float, Loads]]) -> Loads:
    """Force and stress with the intervals of a mixture of models: their probabilities [1] and their loads."""
    if not others:
        return loads
    force = mixed(loads.force.peak.known, [(weight, one.force.peak.known) for weight, one in others])
    stress = mixed(loads.stress.peak.known, [(weight, one.stress.peak.known) for weight, one in others])
    means = {
        name: mixed(known, [(weight, one.means[name]) for weight, one in others])
        for name, known in loads.means.items()
    }
    return replace(
        loads, force=loads.force.with_peak(force), stress=loads.stress.with_peak(stress), means=means
    )


def interval_from_zero(loads: Loads) -> Loads:
    """Force of a bearing whose end was held: what the twin finds there is noise, its interval holds zero."""

    def held(known: Known) -> Known:
        return replace(known, interval_90=(0.0, known.high))

    return replace(
        loads,
        force=replace(loads.force, peak=replace(loads.force.peak, known=held(loads.force.peak.known))),
        means={name: held(known) if known.unit == "N" else known for name, known in loads.means.items()},
    )


def _band(history: History, half: Array, unit: str) -> Band:
    """Band of a force [N] or of a stress [Pa], which goes with its third root and near none has no slope."""
    root = {"N": 1, "Pa": 3}[unit]
    load, way = history.values**root, root * history.values ** (root - 1) * half
    lower, upper = (np.maximum(end, 0.0) ** (1.0 / root) for end in (load - way, load + way))
    return Band(time=history.time, lower=lower, upper=upper)


def widened_to(value: Known, ratio: float, accuracy: float) -> Known:
    """The value with an interval that also holds ``ratio`` times it, within a relative accuracy [1]."""
    other = value.value * ratio if math.isfinite(ratio) else value.value
    low, high = min(value.low, other - accuracy * abs(other)), max(value.high, other + accuracy * abs(other))
    if value.value >= 0.0:
        low = max(low, 0.0)
    return replace(
        value,
        interval_90=(low, high),
        standard_error=(high - low) / (2.0 * NINETY),
        allowance_90=None,
        status=INCONSISTENT,
    )


def is_beyond_factor(peak: float, check: InputEstimate, b: int) -> bool:
    """Whether a peak [N] is so far from the cross-check that the twin cannot have followed the drop."""
    return not 1.0 / FACTOR_APART <= _over_check(peak, check, b) <= FACTOR_APART


def check_with_noise(
    problem: DropProblem, forces: ForceHistory, check: InputEstimate, apart: Sequence[int]
) -> tuple[InputEstimate, Array]:
    """The cross-check with the error that noise leaves at bearings where it is far from the twin.

    Comes with what it would show of the peaks of the twin there, NaN elsewhere, shape (B,) [N].
    """
    shown, peaks = np.full(len(check.peak), np.nan), forces.magnitude.max(axis=0)
    samples = forces.force[:: forces.substeps]
    shown[list(apart)] = peaks_shown(problem, corrections_by_record(problem), samples)[list(apart)]
    hidden = np.nan_to_num(np.abs(peaks / shown - 1.0))
    wider = replace(
        check,
        peak_error=np.hypot(check.peak_error, hidden),
        stress_error=np.hypot(check.stress_error, STRESS_PER_PEAK * hidden),
    )
    return wider, shown


def is_beyond_accuracy(peak: float, check: InputEstimate, b: int) -> bool:
    """Whether a peak [N] lies outside the known accuracy of the cross-check."""
    return abs(_over_check(peak, check, b) - 1.0) > float(check.peak_error[b])


def _over_check(peak: float, check: InputEstimate, b: int) -> float:
    """A peak over that of the cross-check [1]; 1 where there is no impact or nothing to compare it with."""
    found = float(check.peak[b])
    return peak / found if math.isfinite(found) and found > 0.0 and peak > 0.0 else 1.0


def widened_to_cross_check(loads: Loads, check: InputEstimate, b: int, preload: Known | None = None) -> Loads:
    """Force and stress where model and record disagree, with intervals that hold the cross-check.

    The error of the twin's own numbers is not known then: up to 340 % where a support is stiffer in one
    direction than the model allows, with innovations 14 % too large. The preload may be anything between its
    prior and the fit, and the mean stress goes with its third root.
    """
    force_ratio = float(check.peak[b]) / max(loads.force.peak.value, 1e-9)
    stress_ratio = float(check.peak_stress[b]) / max(loads.stress.peak.value, 1e-9)
    peak_error, stress_error = float(check.peak_error[b]), float(check.stress_error[b])
    held = {"mean_stress_Pa": [(stress_ratio, stress_error)]}
    if preload is not None and preload.interval_90 is not None and preload.interval_90[0] > 0.0:
        low, high = preload.interval_90
        held["mean_stress_Pa"] += [
            ((end / preload.value) ** (1.0 / 3.0), MEAN_STRESS_ERROR) for end in (low, high)
        ]
    late = loads.means.get("mean_force_0p15_0p2_N")
    if late is not None and np.isfinite(check.mean_magnitude_late[b]):
        # Mean magnitude with mean magnitude: where the force turns, the mean vector is a fraction of it, and
        # the ratio of two mean vectors says nothing of the stated number.
        late_means = (float(check.mean_magnitude_late[b]), _calm_mean(check, b))
        held["mean_force_0p15_0p2_N"] = [(one / max(late.value, 1e-9), MEAN_ERROR) for one in late_means]
    means = {
        name: reduce(lambda known, other: widened_to(known, *other), held.get(name, ()), value)
        for name, value in loads.means.items()
    }
    force = widened_to(loads.force.peak.known, force_ratio, peak_error)
    stress = widened_to(loads.stress.peak.known, stress_ratio, stress_error)
    return replace(
        loads, force=loads.force.with_peak(force), stress=loads.stress.with_peak(stress), means=means
    )


def _calm_mean(check: InputEstimate, b: int) -> float:
    """Mean magnitude of the late force without its ripple [N], at most what is sought.

    Noise that is taken for force only adds to a magnitude, for a 5 kg rotor half its weight.
    """
    vectors = check.force[(check.time >= LATE[0]) & (check.time <= LATE[1]), b]
    length = max(round(RIPPLE / float(check.time[1] - check.time[0])), 1)
    sums = np.cumsum(vectors, axis=0)
    return float(np.mean(np.hypot(*(sums[length:] - sums[:-length]).T))) / length


def loads_of_cross_check(check: InputEstimate, b: int) -> Loads:
    """What the cross-check knows, with errors larger than those it makes on drops that the model fits."""

    def load(values: Array, error: float, unit: str) -> Load:
        history = History(label="cross-check", time=check.time, values=values, role="cross-check")
        at = int(np.argmax(values))
        known = _where_diverged(float(values[at]), error, unit)
        peak = Peak(known=known, time=float(check.time[at]), origin=Origin.CROSS_CHECK)
        return Load(history, _band(history, DIVERGED_WIDENING * error * values, unit), peak)

    means = {"mean_stress_Pa": _where_diverged(float(np.mean(check.stress[:, b])), MEAN_STRESS_ERROR, "Pa")}
    late = float(check.mean_magnitude_late[b])
    if math.isfinite(late):
        # No mean magnitude is below that of the mean vector; how much of what is above is noise is not known.
        mean = _where_diverged(late, MEAN_ERROR, "N")
        held = widened_to(mean, float(check.mean_late[b]) / max(late, 1e-9), MEAN_ERROR)
        means["mean_force_0p15_0p2_N"] = replace(held, status=mean.status)
    return Loads(
        force=load(check.magnitude[:, b], float(check.peak_error[b]), "N"),
        stress=load(check.stress[:, b], float(check.stress_error[b]), "Pa"),
        means=means,
        missing={
            "impacts": "the model lost the record",
            **({} if math.isfinite(late) else {"mean_force_0p15_0p2_N": NO_LATE_MEAN}),
        },
    )


def _where_diverged(value: float, error: float, unit: str) -> Known:
    half = DIVERGED_WIDENING * error
    return Known(
        value=value,
        status=OF_CROSS_CHECK,
        interval_90=(max(1.0 - half, 0.0) * value, (1.0 + half) * value),
        standard_error=half * value / NINETY,
        unit=unit,
    )


def bearing_drop(
    problem: DropProblem,
    forces: ForceHistory,
    b: int,
    loads: Loads,
    measured: Array,
    values: Mapping[str, Known],
    widening: float,
    cross_check: InputEstimate | None,
    doubt: float,
) -> BearingDrop:
    """Everything about one bearing; ``measured`` (N, 2) is the motion that its sensors show [m].

    ``doubt`` is half the 90 % interval of power-off [s], from which times count.
    """
    name = problem.model.bearing_names[b]
    gap, loose = values[AIR_GAP.field], problem.model.play_sigma(b) > 0.0
    estimated = Motion(
        label="estimated", time=forces.time, displacement=forces.displacement[:, b], role="estimated"
    )
    samples = forces.time[:: forces.substeps]
    shown = Motion(label="measured", time=samples, displacement=measured[: len(samples)], role="measured")
    # the stress rises with the force; sizes of balls and preload are in all of its instants alike
    force, stress = loads.force, loads.stress
    begin, end = when_largest(force.history, force.band, doubt)
    at = stress.peak.time
    impacts: tuple[Impact, ...] = ()
    seen: dict[str, Any] = {}
    if force.peak.origin is Origin.TWIN:
        impacts = tuple(_as_unsure(one, force.peak) for one in twin_impacts(forces, b, widening, cross_check))
        seen = race_moved(forces, b, gap, widening, doubt)
        if cross_check is not None:  # as is handed over of a model that is not believed
            seen["largest"] = replace(seen["largest"], status=INCONSISTENT)
    first = impacts[0] if impacts else None
    ends = math.nan if first is None else float(np.nan_to_num(first.end, nan=forces.time[-1]))
    return BearingDrop(
        name=name,
        motions=(estimated if force.peak.origin is Origin.TWIN else shown,),
        air_gap=AirGap(lower=gap.low, upper=gap.high),
        force=force.history,
        force_band=force.band,
        force_vector=forces.force[:, b] if force.peak.origin is Origin.TWIN else None,
        stress=stress.history,
        stress_band=stress.band,
        preload_stress=None if loose else float(stress.history.values[0]),
        peak_force=replace(force.peak, time_interval_90=(begin, end)),
        peak_stress=replace(stress.peak, time_interval_90=(min(begin, at), max(end, at))),
        values={**values, **loads.means},
        missing=loads.missing,
        impacts=impacts,
        first_contact=None if first is None else deepest(estimated, first.start, ends, gap.value),
        **seen,
    )


def race_moved(forces: ForceHistory, b: int, gap: Known, widening: float, doubt: float) -> dict[str, Any]:
    """Intervals of the largest displacement, of how many impacts there are, and of when the last one began.

    Impacts are counted with the race as found, and nearer and farther by the 90 % error of the indentation;
    contacts of a nearer race may begin and end a sample outside those that the samples show.
    """
    place = forces.displacement[:, b]
    radius = np.hypot(*place.T)
    at = int(np.argmax(radius))
    sigma = math.hypot(*(place[at] / radius[at] * forces.displacement_sigma[at, b]))
    apart = MODEL_GAP_ERROR * float(radius[at])  # gains and offsets stretch it as they stretch the gap
    half = NINETY * widening * forces.indentation_sigma[:, b]
    step = forces.substeps * float(forces.time[1] - forces.time[0])
    begun = []
    for moved, outside in ((0.0, 0.0), (half, step), (-half, 0.0)):
        first, samples = runs_of(forces.indentation[:, b] + moved > 0.0)
        starts, ends = forces.time[first] - outside, forces.time[first + samples - 1] + outside
        begun.append(starts[after_flights(starts, ends, gap.value)])
    counts = [len(one) for one in begun]
    lasts = [one[-1] for one in begun if len(one)]
    seen = {
        "count_interval_90": (min(counts), max(counts)),
        "largest": with_interval(float(radius[at]), math.hypot(sigma, apart), widening, "m", apart),
    }
    if len(begun[0]) and lasting_from(begun[0], float(forces.time[-1])) is not None:
        early, late = (math.hypot(end - lasts[0], doubt, step) for end in (min(lasts), max(lasts)))
        seen["contact_from_interval_90"] = (lasts[0] - early, lasts[0] + late)
    return seen


def twin_impacts(
    forces: ForceHistory, b: int, widening: float, cross_check: InputEstimate | None
) -> tuple[Impact, ...]:
    """Every impact at a bearing in the order of their beginning; intervals hold a given cross-check."""
    found = []
    for first, samples in zip(*runs_of(forces.indentation[:, b] > 0.0), strict=True):
        impact = _impact(forces, b, int(first), int(first + samples), widening)
        found.append(impact if cross_check is None else _impact_holding(impact, cross_check, b))
    return tuple(found)


def _as_unsure(impact: Impact, peak: Peak) -> Impact:
    """An impact as unsure, over its force, as the stated peak, whose interval holds other models too.

    That of the peak has its interval.
    """
    force, stated = impact.peak_force, peak.known
    if force.interval_90 is None or stated.interval_90 is None or min(force.value, stated.value) <= 0.0:
        return impact
    low, high = (force.value * end / stated.value for end in stated.interval_90)
    if impact.start <= peak.time <= impact.end:
        return replace(impact, peak_force=replace(force, interval_90=(low, high)))
    return replace(
        impact, peak_force=replace(force, interval_90=(min(low, force.low), max(high, force.high)))
    )


def _impact(forces: ForceHistory, b: int, first: int, last: int, widening: float) -> Impact:
    window = slice(max(first - 1, 0), min(last + 2, len(forces.time)))
    cut = last == len(forces.time)
    peak, moment = refined_peak(forces.time[window], forces.magnitude[window, b])
    at = window.start + int(np.argmax(forces.magnitude[window, b]))
    relative = math.hypot(float(forces.magnitude_sigma[at, b]) / max(peak, 1e-9), MODEL_FORCE_SIGMA)
    dt = float(forces.time[1] - forces.time[0])
    impulse = dt * float(np.sum(forces.contact_force[first:last, b]))
    lost = dt * float(np.sum(forces.contact_power[first:last, b]))
    middle = first + int(np.argmax(forces.contact_force[first:last, b]))

    force = with_interval(peak, relative * peak, widening, "N")
    passed = with_interval(impulse, relative * impulse, widening, "N s")
    # nearly all of it is sliding: friction coefficient times impulse times sliding speed
    energy = with_interval(lost, math.hypot(relative, forces.friction_sigma[b]) * abs(lost), widening, "J")
    if cut:
        # Impulse and energy are of the part that was estimated, and add up to that of the window. The peak of
        # a contact that goes on may be still to come: the whole impact has at least this.
        force = Known(value=peak, status=CUT, lower=force.low, unit="N")
        passed, energy = replace(passed, status=CUT), replace(energy, status=CUT)
    return Impact(
        start=float(forces.time[first]),
        end=math.nan if cut else float(forces.time[last - 1]),
        azimuth=float(forces.azimuth[middle, b]),
        peak_time=moment,
        peak_force=force,
        impulse=passed,
        dissipated_energy=energy,
    )


def _impact_holding(impact: Impact, cross_check: InputEstimate, b: int) -> Impact:
    """An impact whose intervals hold what the cross-check finds in its time."""
    step = cross_check.time[1] - cross_check.time[0]  # a contact may lie between two samples
    during = (cross_check.time >= impact.start - step) & (cross_check.time <= impact.end + step)
    if not during.any() or impact.peak_force.value <= 0.0:
        return impact
    ratio = float(cross_check.magnitude[during, b].max()) / impact.peak_force.value
    error = float(cross_check.peak_error[b])
    return replace(
        impact,
        peak_force=widened_to(impact.peak_force, ratio, error),
        impulse=widened_to(impact.impulse, ratio, error),
        dissipated_energy=widened_to(impact.dissipated_energy, ratio, 2.0 * error),
    )


def cross_checks(
    name: str, twin: Loads, forces: ForceHistory, check: InputEstimate, b: int, *, replaced: bool
) -> tuple[CrossCheck, ...]:
    """Peak force, peak stress and late mean force vector of one bearing, found in both ways."""
    pairs = [
        ("peak force", twin.force.peak.known, check.peak[b], float(check.peak_error[b])),
        ("peak stress", twin.stress.peak.known, check.peak_stress[b], float(check.stress_error[b])),
    ]
    if np.isfinite(check.mean_late[b]):
        late = (forces.time >= LATE[0]) & (forces.time <= LATE[1])
        mean = float(np.hypot(*forces.force[late, b].mean(axis=0)))
        vector = Known(value=mean, status="determined", unit="N")
        pairs.append(("force of the mean, 150 to 200 ms", vector, check.mean_late[b], MEAN_ERROR))
    return tuple(
        CrossCheck(
            name=f"{name} {what}",
            estimate=estimate,
            check=float(other),
            accuracy=accuracy,
            replaced=replaced,
        )
        for what, estimate, other, accuracy in pairs
    )
