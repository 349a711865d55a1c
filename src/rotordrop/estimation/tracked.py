"""The tracked twin: force and stress from a drop model that follows the record, with intervals that hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError, RecordError
from rotordrop.estimation.tracked_parameters import UNSURE_GAP
from rotordrop.identification.air_gap import STANDSTILL
from rotordrop.identification.evidence import Evidence, read_evidence
from rotordrop.identification.first_reach import reach_at_first_contact
from rotordrop.machine import Machine
from rotordrop.measurement.axes import sees_both_directions, sensor_polarity
from rotordrop.measurement.events import DropInstant
from rotordrop.measurement.power_off import PowerOff
from rotordrop.measurement.record import Record
from rotordrop.model.contact_band import reduction_for_contact
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
from rotordrop.tracking.problem import DropProblem, RecordedDrop, build_problem
from rotordrop.tracking.smoother import PassSettings, Smoothed, forward
from rotordrop.tracking.transfer import transferred

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

COARSE_BASIS = Reduction(modes=6, attachment=True)
FINE_BASIS = Reduction(modes=10, attachment=True)
"""Bases with the fewest modes; a rotor whose modes lie lower against its contact frequency gets more."""

COARSE_REACH, FINE_REACH = 2.25, 6.0
"""The highest mode over the contact frequency, at least [1]: a rotor of 1.8 m and 130 kg with a sensor plane
at mid-span was lost at 2.1 and followed from 3.2 on, one of 1.1 m and 60 kg is followed at 2.4."""

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


@dataclass(frozen=True, kw_only=True)
class TrackedDrop:
    """A drop that the twin has followed, with the arrays of its filter: the workshop, not the result.

    Attributes
    ----------
    prepared : Preparation
        The record made ready.
    problem, smoothed : DropProblem, Smoothed
        The estimation problem and its smoothed estimate; hundreds of megabytes.
    forces : ForceHistory
        Force and stress over time with standard deviations.
    checks : tuple of Check
        Consistency of model and record.
    noise_factor : float
        Size of the unknown impulses over the usual one [1].
    drops : int
        Number of drops that were fitted together.
    """

    prepared: Preparation
    problem: DropProblem
    smoothed: Smoothed
    forces: ForceHistory
    checks: tuple[Check, ...]
    noise_factor: float
    drops: int = 1

    @property
    def consistent(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    @property
    def sees_all_directions(self) -> bool:
        """Whether the sensors see enough for the estimate without contact law."""
        return all(check.passed for check in self.checks if check.name == DIRECTIONS)


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
    """Whether the supports of all bearings are estimates, not guesses."""
    return all(
        quantity.status == "estimated"
        for bearing in machine.touchdown_bearings
        for quantity in (bearing.support.stiffness, bearing.support.mass)
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
    fine_model = build_drop_model(machine, _basis(machine, FINE_BASIS, FINE_REACH))
    fine = [drop_problem(fine_model, item, until) for item in prepared]
    if is_calibrated(machine) and not calibrate_only:
        schedule = QUICK_SCHEDULE if quick else CALIBRATED_SCHEDULE
        return _not_lost(track(fine, schedule, progress=progress), prepared)
    coarse_model = build_drop_model(_seen_at_the_ends(machine), _basis(machine, COARSE_BASIS, COARSE_REACH))
    coarse = [drop_problem(coarse_model, _with_sensors_of(coarse_model, item), until) for item in prepared]
    contact = max(_first_contact(item) for item in prepared)
    first = _from_guesses(coarse, contact, progress)
    references = [
        transferred(one, two, drop.means) for one, two, drop in zip(coarse, fine, first.smoothed, strict=True)
    ]
    schedule = shifted(CALIBRATION_SCHEDULE if calibrate_only else FINE_SCHEDULE, contact)
    return _not_lost(track(fine, schedule, references=references, progress=progress), prepared)


def _basis(machine: Machine, least: Reduction, reach: float) -> Reduction:
    assert least.modes is not None
    return reduction_for_contact(machine, least=least.modes, reach=reach)


def _seen_at_the_ends(machine: Machine) -> Machine:
    """The machine with those two whole sensor planes only that lie farthest apart, where it has more.

    A search from guesses begins far from the record, and a plane between the bearings makes it stiff: what
    the first impacts get wrong has to bend the rotor then, and gains run away with it. Once the parameters
    are found, every plane takes part.
    """
    planes = {
        sensor.node: [s for s in machine.sensors if s.node == sensor.node] for sensor in machine.sensors
    }
    whole = [node for node, sensors in planes.items() if sees_both_directions(sensors)]
    if len(planes) <= 2 or len(whole) < 2:
        return machine
    z = machine.rotor.node_positions
    ends = {min(whole, key=lambda node: z[node - 1]), max(whole, key=lambda node: z[node - 1])}
    return machine.model_copy(update={"sensors": tuple(s for s in machine.sensors if s.node in ends)})


def _with_sensors_of(model: DropModel, prepared: Preparation) -> Preparation:
    """A prepared record with the channels of a model's sensors."""
    sensors, record = model.machine.sensors, prepared.record
    if len(sensors) == len(record.sensors):
        return prepared
    names = [sensor.name for sensor in sensors]
    columns = [c for c, sensor in enumerate(record.sensors) if sensor.name in names]
    tail = prepared.tail_level
    return replace(
        prepared,
        evidence=prepared.evidence.of_channels(columns),
        tail_level=None if tail is None else tail[columns],
    )


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
    prepared: Preparation, problem: DropProblem, smoothed: Smoothed, noise_factor: float, drops: int = 1
) -> TrackedDrop:
    """Forces and checks of one smoothed drop."""
    return TrackedDrop(
        prepared=prepared,
        problem=problem,
        smoothed=smoothed,
        forces=force_history(problem, smoothed),
        checks=consistency_checks(problem, smoothed, noise_factor),
        noise_factor=noise_factor,
        drops=drops,
    )


def followed_drops(
    machine: Machine,
    prepared: Sequence[Preparation],
    *,
    quick: bool = False,
    progress: Progress | None = None,
) -> Iterator[TrackedDrop]:
    """Follow recorded drops of one machine, and hand them out one by one.

    Each is given away with its arrays, so that no more than one is kept when its result has been made.
    """
    tracked = track_drops(machine, prepared, quick=quick, progress=progress)
    count = len(prepared)
    waiting = list(zip(prepared, tracked.problems, tracked.smoothed, tracked.noise_factors, strict=True))
    del tracked
    while waiting:
        item, problem, smoothed, needed = waiting.pop(0)
        factor = 1.0 if quick else best_noise_factor(problem, smoothed, FINE_SCHEDULE[-1])
        factor = max(factor, needed) if needed > 1.0 else factor
        yield tracked_drop(item, problem, smoothed, factor, count)
        del problem, smoothed
