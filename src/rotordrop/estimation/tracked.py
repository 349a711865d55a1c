"""The tracked twin: force and stress from a drop model that follows the record, with intervals that hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError, RecordError
from rotordrop.estimated import IdentifiedValue
from rotordrop.estimation.tracked_impacts import Impact as Impact
from rotordrop.estimation.tracked_impacts import tracked_impacts
from rotordrop.estimation.tracked_values import (
    INCONSISTENT,
    UNSURE_GAP,
    force_values,
    parameter_values,
    with_cross_check,
)
from rotordrop.identification.air_gap import STANDSTILL
from rotordrop.identification.evidence import Evidence, read_evidence
from rotordrop.identification.first_reach import reach_at_first_contact
from rotordrop.machine import Machine
from rotordrop.measurement.axes import sensor_polarity
from rotordrop.measurement.events import DropInstant
from rotordrop.measurement.power_off import PowerOff
from rotordrop.measurement.record import Record
from rotordrop.model.parameters import DropModel, build_drop_model
from rotordrop.model.reduction import Reduction
from rotordrop.tracking.calibration import (
    BLIND_SCHEDULE,
    CALIBRATED_SCHEDULE,
    LOOSER,
    PATIENT_SCHEDULE,
    QUICK_SCHEDULE,
    Stage,
    TrackedDrops,
    beside_the_record,
    shifted,
    track,
)
from rotordrop.tracking.consistency import DIRECTIONS, Check, consistency_checks
from rotordrop.tracking.forces import ForceHistory, force_history
from rotordrop.tracking.input_state import InputEstimate, input_state_estimate
from rotordrop.tracking.problem import DropProblem, RecordedDrop, build_problem
from rotordrop.tracking.smoother import PassSettings, Smoothed, forward
from rotordrop.tracking.transfer import transferred

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

COARSE_BASIS = Reduction(modes=6, attachment=True)
FINE_BASIS = Reduction(modes=10, attachment=True)
FINE_SCHEDULE: tuple[Stage, ...] = (
    Stage(until=0.06, impulse=1e-3, share=0.01, passes=2),
    Stage(until=0.1, impulse=1e-3, share=0.01, passes=1),
    Stage(until=0.15, impulse=1e-3, share=0.01, passes=1),
    Stage(until=0.2, impulse=1e-3, share=0.01, passes=2),
)
CALIBRATION_SCHEDULE = FINE_SCHEDULE[:1]
WINDOW = 0.2
NOISE_FACTORS = (0.5, 1.0, 2.0, 4.0, 8.0)
NOISE_WINDOW = 0.06
"""Part of the drop on which the size of the unknown impulses is judged [s]."""

LONG_RECORD, TAIL_SPAN = 20.0, 2.0
"""Length of a record that may hold its own settled tail, and of that tail [s]."""

INCONSISTENT_WIDENING = 2.0
"""Factor on intervals when the model is not consistent with the record [1]; those of force and stress grow
further until they hold the cross-check as well."""


@dataclass(frozen=True, kw_only=True)
class TrackedDrop:
    """What the tracked twin says about one drop.

    Attributes
    ----------
    record : Record
        The recording.
    drop_instant : DropInstant or PowerOff
        Power-off in record time.
    forces : ForceHistory
        Force and stress over time with standard deviations.
    values : dict of dict
        Per bearing, identified values by the field names of the estimate's JSON.
    impacts : tuple of Impact
        Every impact.
    checks : tuple of Check
        Consistency of model and record.
    consistent : bool
        Whether all checks passed.
    cross_check : InputEstimate or None
        The estimate without contact law, made here when the model is not consistent with the record.
    """

    name: str
    record: Record
    drop_instant: DropInstant | PowerOff
    speed: float
    problem: DropProblem
    smoothed: Smoothed
    forces: ForceHistory
    values: dict[str, dict[str, IdentifiedValue]]
    peak_times: dict[str, float]
    impacts: tuple[Impact, ...]
    checks: tuple[Check, ...]
    consistent: bool
    noise_factor: float
    nis: float
    cross_check: InputEstimate | None = None

    def sentence(self) -> str:
        """The verdict on model and record."""
        if self.consistent:
            return "The model is consistent with the record."
        failed = "; ".join(check.message for check in self.checks if not check.passed)
        return f"The model is not consistent with the record: {failed}. {self._consequence()}"

    def _consequence(self) -> str:
        if self.cross_check is not None:
            return (
                "Intervals are widened until they hold the independent cross-check too, and a peak force "
                "further from it than a factor of two gives way to it; the single numbers are not to be "
                "relied on."
            )
        return f"Intervals are {INCONSISTENT_WIDENING:g} × as wide; no independent cross-check is possible."

    @property
    def can_be_cross_checked(self) -> bool:
        """Whether the sensors see enough for the estimate without contact law."""
        return _sees_all_directions(self.checks)


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """A record made ready: power-off found, tail averaged."""

    name: str
    evidence: Evidence
    tail_level: Array | None

    @property
    def record(self) -> Record:
        """The recording."""
        return self.evidence.record

    @property
    def instant(self) -> DropInstant | PowerOff:
        """Power-off in record time."""
        return self.evidence.power_off


def prepare(
    machine: Machine,
    record: Record,
    tail: Record | None,
    name: str,
    instant: DropInstant | PowerOff | None = None,
) -> Preparation:
    """Find power-off and average the settled tail of a record."""
    tail = settled_tail(record, tail)
    if record.speed_readings is None:
        raise IdentificationError(
            f"the record {name} has no rotor speed; expected one. Map it with a profile."
        )
    model = build_drop_model(machine, COARSE_BASIS)
    polarity = sensor_polarity(record.sensors)
    return Preparation(
        name=name,
        evidence=read_evidence(model, record, power_off=instant),
        tail_level=None if tail is None else np.asarray(tail.signals).mean(axis=0) * polarity,
    )


def settled_tail(record: Record, tail: Record | None) -> Record | None:
    """The tail given, or the last seconds of a record until standstill; None where there is neither."""
    if tail is not None or record.duration < LONG_RECORD or record.measured_speed is None:
        return tail
    last = _last_seconds(record, TAIL_SPAN)
    assert last.speed is not None
    return last if np.nanmax(np.abs(last.speed)) < STANDSTILL else None


def _last_seconds(record: Record, span: float) -> Record:
    keep = record.time >= record.time[-1] - span
    return replace(
        record,
        time=record.time[keep],
        signals=record.signals[keep],
        speed=None if record.speed is None else record.speed[keep],
    )


def drop_problem(model: DropModel, prepared: Preparation, until: float = WINDOW) -> DropProblem:
    """Estimation problem of a prepared record; without a tail the gaps start where the first forces act."""
    problem = build_problem(model, recorded_drop(prepared, until), until=until)
    if prepared.tail_level is None:
        _start_gaps(problem, prepared)
    return problem


def recorded_drop(prepared: Preparation, until: float = WINDOW) -> RecordedDrop:
    """What the record says, as the filter takes it."""
    evidence = prepared.evidence
    readings = evidence.readings(until)
    return RecordedDrop(
        time=evidence.time[: len(readings)],
        readings=readings,
        noise=evidence.noise(until),
        initial_speed=evidence.speed.initial,
        initial_speed_error=evidence.speed.initial_error,
        speed=evidence.measured_speed(until),
        tail_level=prepared.tail_level,
    )


def _start_gaps(problem: DropProblem, prepared: Preparation) -> None:
    """Let unsure air gaps begin at the reach of the first contact; their prior uncertainty stays.

    From a gap that is tens of micrometres off, the first impacts come at the wrong time and the filter may
    settle at a wrong machine.
    """
    gaps = [
        problem.n_dynamic + [u.path for u in problem.unknowns].index(f"{name}.air_gap")
        for name in problem.model.bearing_names
    ]
    unsure = problem.covariance[gaps, gaps] > UNSURE_GAP**2
    if not unsure.any() or not isinstance(prepared.instant, DropInstant):
        return
    try:
        reached = reach_at_first_contact(prepared.record, problem.model, prepared.instant)
    except (IdentificationError, RecordError):  # too few sensors for it: the prior has to do
        return
    for entry, found, moved in zip(gaps, reached, unsure & np.isfinite(reached), strict=True):
        if moved:
            problem.mean[entry] = problem.start[entry] = found


def is_calibrated(machine: Machine) -> bool:
    """Whether support and contact of every bearing are estimates, not guesses."""
    return all(
        quantity.status == "estimated"
        for bearing in machine.touchdown_bearings
        for quantity in (bearing.support.stiffness, bearing.support.mass, bearing.contact.stiffness)
    )


def track_drops(
    machine: Machine,
    prepared: Sequence[Preparation],
    *,
    quick: bool = False,
    calibrate_only: bool = False,
    progress: Progress | None = None,
) -> TrackedDrops:
    """Follow recorded drops of one machine with the drop model.

    From guesses, a coarse basis finds the parameters in growing windows and a finer one refines them; a
    calibrated machine needs the finer one only (with ``quick``, a single pass of it).
    """
    until = BLIND_SCHEDULE[-1].until + 0.01 if calibrate_only else WINDOW
    prepared = _tail_first(prepared)
    fine_model = build_drop_model(machine, FINE_BASIS)
    fine = [drop_problem(fine_model, item, until) for item in prepared]
    if is_calibrated(machine) and not calibrate_only:
        schedule = QUICK_SCHEDULE if quick else CALIBRATED_SCHEDULE
        return _not_lost(track(fine, schedule, progress=progress), prepared)
    coarse_model = build_drop_model(machine, COARSE_BASIS)
    coarse = [drop_problem(coarse_model, item, until) for item in prepared]
    contact = max(_first_contact(item) for item in prepared)
    first = _from_guesses(coarse, contact, progress)
    references = [
        transferred(one, two, drop.means) for one, two, drop in zip(coarse, fine, first.smoothed, strict=True)
    ]
    schedule = shifted(CALIBRATION_SCHEDULE if calibrate_only else FINE_SCHEDULE, contact)
    return _not_lost(track(fine, schedule, references=references, progress=progress), prepared)


def _from_guesses(coarse: Sequence[DropProblem], contact: float, progress: Progress | None) -> TrackedDrops:
    """First fit of a machine of which only guesses are known; a failed one is repeated more patiently."""
    found = track(coarse, shifted(BLIND_SCHEDULE, contact), progress=progress)
    if not beside_the_record(found):
        return found
    again = track(coarse, shifted(PATIENT_SCHEDULE, contact), progress=progress)
    return min(found, again, key=lambda fit: (any(fit.diverged), max(fit.noise_factors), max(fit.nis)))


def _tail_first(prepared: Sequence[Preparation]) -> list[Preparation]:
    """The drops with a known tail on the first of them, from which the machine is handed on to the others."""
    known = next((item.tail_level for item in prepared if item.tail_level is not None), None)
    first = prepared[0] if prepared[0].tail_level is not None else replace(prepared[0], tail_level=known)
    return [first, *prepared[1:]]


def _not_lost(tracked: TrackedDrops, prepared: Sequence[Preparation]) -> TrackedDrops:
    """The drops, if the filter followed all of them to the end: a part of a drop says nothing of its peak."""
    for item, problem, smoothed in zip(prepared, tracked.problems, tracked.smoothed, strict=True):
        done, samples = smoothed.filtered.done, len(smoothed.filtered.means)
        if done < samples:
            raise IdentificationError(
                f"the filter lost the drop {item.name} at {1e3 * problem.time[done]:.1f} ms of "
                f"{1e3 * problem.time[samples - 1]:.0f} ms, even with {LOOSER[-1]:g} × the usual unknown "
                "impulses; the machine description is too far from the machine that was recorded. Check the "
                "sensors (planes, angles, signs), or calibrate anew with this drop."
            )
    return tracked


def _first_contact(item: Preparation) -> float:
    return max(item.instant.contact - item.instant.value, 0.002)


def best_noise_factor(problem: DropProblem, smoothed: Smoothed, stage: Stage) -> float:
    """Size of the unknown impulses, relative to the usual one, that makes the first impacts most likely [1].

    Searched upwards or downwards from the usual size; what later impacts miss shows in their innovations.
    """
    samples = min(int(np.searchsorted(problem.time, NOISE_WINDOW)), len(smoothed.means))

    def improbability(factor: float) -> float:
        settings = PassSettings(impulse=stage.impulse * factor, share=stage.share * factor)
        result = forward(problem, settings, reference=smoothed.means, samples=samples, smoothing=False)
        return result.negative_log_likelihood if result.done == samples else math.inf

    usual = NOISE_FACTORS.index(1.0)
    with ThreadPoolExecutor(max_workers=2) as pool:
        nearby = list(pool.map(improbability, NOISE_FACTORS[usual - 1 : usual + 2]))
    if nearby[0] < min(nearby[1:]):
        return NOISE_FACTORS[usual - 1]
    best, least = usual, nearby[1]
    following = nearby[2]
    while following < least:
        best, least = best + 1, following
        if best + 1 == len(NOISE_FACTORS):
            break
        following = improbability(NOISE_FACTORS[best + 1])
    return NOISE_FACTORS[best]


def tracked_drop(
    prepared: Preparation, problem: DropProblem, smoothed: Smoothed, noise_factor: float
) -> TrackedDrop:
    """Forces, values, impacts and checks of one smoothed drop."""
    checks = consistency_checks(problem, smoothed, noise_factor)
    consistent = all(check.passed for check in checks)
    widening = 1.0 if consistent else INCONSISTENT_WIDENING
    forces = force_history(problem, smoothed)
    cross_check = None
    if not consistent and _sees_all_directions(checks):
        cross_check = input_state_estimate(problem, smoothed)
    if cross_check is None:
        _refuse_unchecked(prepared.name, checks)
    values: dict[str, dict[str, IdentifiedValue]] = {}
    peak_times: dict[str, float] = {}
    for b, name in enumerate(problem.model.bearing_names):
        found = parameter_values(problem, smoothed, name, widening)
        loads, peak_times[name] = force_values(forces, b, widening)
        if cross_check is not None:
            found = {field: replace(value, status=INCONSISTENT) for field, value in found.items()}
            loads, peak_times[name] = with_cross_check(loads, peak_times[name], forces, cross_check, b)
        values[name] = found | loads
    return TrackedDrop(
        name=prepared.name,
        record=prepared.record,
        drop_instant=prepared.instant,
        speed=float(problem.mean[problem.model.layout.rotor_speed]),
        problem=problem,
        smoothed=smoothed,
        forces=forces,
        values=values,
        peak_times=peak_times,
        impacts=tracked_impacts(problem, forces, widening, cross_check),
        checks=checks,
        consistent=consistent,
        noise_factor=noise_factor,
        nis=smoothed.filtered.nis,
        cross_check=cross_check,
    )


def _sees_all_directions(checks: Sequence[Check]) -> bool:
    return all(check.passed for check in checks if check.name == DIRECTIONS)


def _refuse_unchecked(name: str, checks: Sequence[Check]) -> None:
    """Refuse a drop that the model does not fit and that nothing else can check: its errors have no limit."""
    failed = [check for check in checks if not check.passed]
    if {check.name for check in failed} <= {DIRECTIONS}:
        return
    raise IdentificationError(
        f"the model does not fit the record {name} ({'; '.join(check.message for check in failed)}), and "
        "nothing can check its force; expected a model that fits, or both directions in two planes. "
        "Calibrate on drops with all sensors, estimate without --quick, or leave this drop out."
    )


def estimate_tracked(
    machine: Machine,
    records: Sequence[Record],
    tails: Sequence[Record | None],
    *,
    names: Sequence[str] | None = None,
    quick: bool = False,
    progress: Progress | None = None,
) -> tuple[TrackedDrop, ...]:
    """Force and stress of recorded drops of one machine, each drop following its record.

    Parameters
    ----------
    machine : Machine
        The machine, calibrated or with guesses; several drops share its parameters in one fit.
    records, tails : sequence of Record
        The drops and their settled tails (None where there is none).
    names : sequence of str, optional
        Names of the drops; file stems by default.
    quick : bool
        One pass instead of three; only with a calibrated machine.
    progress : callable, optional
        Called with a sentence and the fraction done.
    """
    stems = names or [r.path.stem if r.path else f"drop_{i + 1}" for i, r in enumerate(records)]
    prepared = [prepare(machine, r, t, n) for r, t, n in zip(records, tails, stems, strict=True)]
    tracked = track_drops(machine, prepared, quick=quick, progress=progress)
    drops = []
    for item, problem, smoothed, needed in zip(
        prepared, tracked.problems, tracked.smoothed, tracked.noise_factors, strict=True
    ):
        factor = 1.0 if quick else best_noise_factor(problem, smoothed, FINE_SCHEDULE[-1])
        factor = max(factor, needed) if needed > 1.0 else factor
        drops.append(tracked_drop(item, problem, smoothed, factor))
    return tuple(drops)
