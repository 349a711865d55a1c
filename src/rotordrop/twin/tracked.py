"""The tracked twin: force and stress from a drop model that follows the record, with intervals that hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.beam import is_beam
from rotordrop.errors import IdentificationError
from rotordrop.evidence.evidence import Evidence, Missing
from rotordrop.machine import Machine
from rotordrop.record.axes import sees_both_directions
from rotordrop.rotor.contact_band import reduction_for_contact
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.track.calibration import (
    BLIND_SCHEDULE,
    CALIBRATED_SCHEDULE,
    DAMPED_SCHEDULE,
    LOOSER,
    QUICK_SCHEDULE,
    Stage,
    TrackedDrops,
    beside_the_record,
    converged,
    shifted,
    stage_settings,
    track,
)
from rotordrop.track.consistency import DIRECTIONS, Check, consistency_checks, judged_by
from rotordrop.track.forces import ForceHistory, force_history
from rotordrop.track.input_state import InputEstimate
from rotordrop.track.prior import fall_time
from rotordrop.track.problem import DropProblem, Fall, RecordedDrop, build_problem
from rotordrop.track.smoother import Forward, Smoothed, forward
from rotordrop.track.transfer import transferred
from rotordrop.track.unknown_impulses import likeliest_noise, with_noise
from rotordrop.twin.rotor_search import with_found_rotor
from rotordrop.twin.structure_search import (
    DAMPED,
    FIRST_OTHER_START,
    Candidate,
    Kept,
    Place,
    found_beside_the_usual,
    found_start,
    found_structure,
    rank_of,
)
from rotordrop.twin.tracked_loads import check_without_contact_law, checks_begun, of_a_beam
from rotordrop.twin.tracked_parameters import UNSURE_GAP

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

COARSE_BASIS = Reduction(modes=6, attachment=True)
FINE_BASIS = Reduction(modes=10, attachment=True)
"""Bases with the fewest modes; a rotor whose modes lie lower against its contact frequency gets more."""

COARSE_REACH, FINE_REACH = 2.25, 6.0
"""The highest mode over the contact frequency, at least [1]: a rotor of 1.8 m and 130 kg with a sensor plane
at mid-span was lost at 2.1 and followed from 3.2 on, one of 1.1 m and 60 kg is followed at 2.4."""

FINE_SCHEDULE: tuple[Stage, ...] = (
    Stage(until=0.06, force=0.07, share=0.01, passes=1),
    Stage(until=0.2, force=0.07, share=0.01, passes=1),
)
_WINDOWS = (slice(0, 2), *(slice(k, k + 1) for k in range(2, len(BLIND_SCHEDULE))))
"""Stages of each window from guesses; of the two of the first, one only finds a place to linearise at."""
CALIBRATION_SCHEDULE = (replace(FINE_SCHEDULE[0], passes=2),)
WINDOW = 0.2

START_SPREAD = 0.8
"""Spread of other starts, in standard deviations of the prior [1]."""

ROTOR_SEEN = 6.0
"""Part of the drop from which the form of a rotor is found, over the time of a free fall [1]."""

FALL_SHARE = 1.7e-7
"""Largest unknown impulse per 50 µs while the rotor falls, over its weight [s]."""


@dataclass(frozen=True, kw_only=True)
class TrackedDrop:
    """A drop that the twin has followed, with the arrays of its filter: the workshop, not the result.

    Attributes
    ----------
    evidence : Evidence
        What the record says beside the contacts.
    problem, smoothed : DropProblem, Smoothed
        The estimation problem and its smoothed estimate with the likeliest unknown impulses.
    judged : Forward
        The pass by whose innovations the model is judged.
    forces : ForceHistory
        Force and stress over time with standard deviations.
    checks : tuple of Check
        Consistency of model and record.
    noise_factor : float
        Size of the unknown impulses over the usual one [1].
    drops : int
        Number of drops that were fitted together.
    kept : tuple of Kept
        Extensions of the usual model that the readings paid for.
    unaided : Future of InputEstimate, optional
        The estimate without contact law, where it was begun beside the passes.
    """

    evidence: Evidence
    problem: DropProblem
    smoothed: Smoothed
    judged: Forward
    forces: ForceHistory
    checks: tuple[Check, ...]
    noise_factor: float
    drops: int = 1
    kept: tuple[Kept, ...] = ()
    unaided: Future[InputEstimate] | None = None

    def without_contact_law(self) -> InputEstimate:
        """The estimate without contact law: as it was begun, or made now."""
        return check_without_contact_law(self.problem) if self.unaided is None else self.unaided.result()

    @property
    def consistent(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    @property
    def sees_all_directions(self) -> bool:
        """Whether the sensors see enough for the estimate without contact law."""
        return all(check.passed for check in self.checks if check.name == DIRECTIONS)


def drop_problem(model: DropModel, evidence: Evidence, until: float = WINDOW) -> DropProblem:
    """Estimation problem of a record; without a tail the gaps start where the first forces act."""
    problem = build_problem(model, recorded_drop(evidence, until), until=until)
    if isinstance(evidence.settled_level, Missing):
        _start_gaps(problem, evidence)
    if model.machine.remanence_time_constant is None:
        return problem
    weight = model.machine.rotor.mass * float(model.machine.gravity)
    return replace(problem, fall=Fall(end=_first_contact(evidence), impulse=FALL_SHARE * weight))


def twin_problem(machine: Machine, evidence: Evidence, until: float = WINDOW) -> DropProblem:
    """Estimation problem of a recorded drop in the basis that force and stress are taken from."""
    return drop_problem(build_drop_model(machine, _basis(machine, FINE_BASIS, FINE_REACH)), evidence, until)


def recorded_drop(evidence: Evidence, until: float = WINDOW) -> RecordedDrop:
    """What the record says, as the filter takes it."""
    readings, level = evidence.readings(until), evidence.settled_level
    return RecordedDrop(
        time=evidence.time[: len(readings)],
        readings=readings,
        noise=evidence.noise(until),
        initial_speed=evidence.speed.initial,
        initial_speed_error=evidence.speed.initial_error,
        speed=evidence.measured_speed(until),
        tail_level=None if isinstance(level, Missing) else level,
    )


def _start_gaps(problem: DropProblem, evidence: Evidence) -> None:
    """Let unsure air gaps begin at the reach of the first contact; their prior uncertainty stays.

    From a gap that is tens of micrometres off, the first impacts come at the wrong time and the filter may
    settle at a wrong machine. Where no first force shows, the value of the machine file has to do.
    """
    if isinstance(evidence.reach, Missing):
        return
    gaps = problem.gap_entries
    unsure = problem.covariance[gaps, gaps] > (UNSURE_GAP * problem.mean[gaps]) ** 2
    for entry, found, moved in zip(gaps, evidence.reach, unsure & np.isfinite(evidence.reach), strict=True):
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
    evidence: Sequence[Evidence],
    *,
    quick: bool = False,
    calibrate_only: bool = False,
    progress: Progress | None = None,
) -> Candidate:
    """Follow recorded drops of one machine with the drop model.

    From guesses, a coarse basis finds the parameters in growing windows and a finer one refines them; a
    calibrated machine needs the finer one only (with ``quick``, a single pass of it). What ends beside the
    record is tried with extensions of the usual model; the machine that comes back has those that were kept.
    """
    search = _Search(evidence=tuple(_tail_first(evidence)), calibrate_only=calibrate_only, progress=progress)
    machine = search.with_rotor(machine)
    if is_calibrated(machine) and not calibrate_only:
        schedule = search.shifted(machine, QUICK_SCHEDULE if quick else CALIBRATED_SCHEDULE)
        calibrated = Candidate(
            machine=machine, fit=track(search.problems(machine), schedule, progress=progress)
        )
        if quick or not calibrated.beside:
            return search.not_lost(calibrated)
        found: Candidate | None = calibrated
        usual = Candidate(machine=machine, fit=search.first_fit(machine))
    else:
        usual = Candidate(machine=machine, fit=search.first_fit(machine))
        if not usual.beside:
            usual = found_beside_the_usual(usual, search)
        # First: the coarse basis alone may end beside a record that the finer one fits, or lose it there.
        found = search.refined_if_followed(usual)
    if found is None or not _fits(found):
        if progress is not None:
            progress("trying extensions of the usual model, and other starts", 0.0)
        # Where a beam stands for a rotor, its form is what does not fit: no extension stands for that.
        other = found_start(usual, search) if is_beam(machine.rotor) else found_structure(usual, search)
        again = None if other.fit is usual.fit else search.refined_if_followed(other)
        followed = [one for one in (found, again) if one is not None]
        if not followed:
            return search.not_lost(search.refined(other))  # says where it was lost
        found = min(followed, key=lambda one: one.rank)
    return search.not_lost(found)


@dataclass(frozen=True, kw_only=True)
class _Search:
    """Fits of machines to the same drops: a coarse basis finds the parameters, a finer one refines them."""

    evidence: tuple[Evidence, ...]
    calibrate_only: bool
    progress: Progress | None

    def until(self, machine: Machine) -> float:
        """End of the window [s]."""
        last = self.shifted(machine, BLIND_SCHEDULE[-1:])[0]
        return last.until + 0.01 if self.calibrate_only else WINDOW

    def shifted(self, machine: Machine, schedule: Sequence[Stage]) -> tuple[Stage, ...]:
        """A schedule with its windows where the first contacts of the drops are."""
        return shifted(schedule, self.contact, fall_time(machine))

    @property
    def contact(self) -> float:
        """Time of the latest first contact after power-off [s]."""
        return max(_first_contact(item) for item in self.evidence)

    def with_rotor(self, machine: Machine) -> Machine:
        """The machine with its rotor as the records show it, where a beam stands for it."""
        if not is_beam(machine.rotor):
            return machine
        until = ROTOR_SEEN * fall_time(machine)
        return with_found_rotor(machine, [(item, recorded_drop(item, until)) for item in self.evidence])

    def problems(self, machine: Machine) -> list[DropProblem]:
        """The drops with the finer basis."""
        model = build_drop_model(machine, _basis(machine, FINE_BASIS, FINE_REACH))
        return [drop_problem(model, item, self.until(machine)) for item in self.evidence]

    def coarse(self, machine: Machine) -> list[DropProblem]:
        """The drops with the coarse basis."""
        model = build_drop_model(_seen_at_the_ends(machine), _basis(machine, COARSE_BASIS, COARSE_REACH))
        items = [_with_sensors_of(model, item) for item in self.evidence]
        return [drop_problem(model, item, self.until(machine)) for item in items]

    def first_fit(self, machine: Machine) -> TrackedDrops:
        """Fit of a machine from its guesses by the coarse basis; beside the record, again in short steps."""
        problems, found = self.coarse(machine), None
        with suppress(IdentificationError):
            found = track(problems, self.shifted(machine, BLIND_SCHEDULE), progress=self.progress)
            if not beside_the_record(found):
                return found
        try:
            again = track(problems, self.shifted(machine, DAMPED_SCHEDULE), progress=self.progress)
            again = self.settled(_place_of(again))
        except IdentificationError:
            if found is None:
                raise
            return found
        return again if found is None else min(found, again, key=rank_of)

    @property
    def windows(self) -> int:
        """Number of windows from guesses."""
        return len(_WINDOWS)

    def window(self, machine: Machine, attempt: int, number: int, before: Place | None) -> Place:
        """A fit of a machine by the coarse basis over one window more, after what was found before."""
        stages = (DAMPED_SCHEDULE if attempt == DAMPED else BLIND_SCHEDULE)[_WINDOWS[number]]
        problems = self.coarse(machine) if before is None else before.problems
        if before is None and attempt >= FIRST_OTHER_START:
            problems = [_started_elsewhere(problem, attempt) for problem in problems]
        references = None if before is None else before.trajectories
        return _place_of(track(problems, self.shifted(machine, stages), references=references))

    def settled(self, place: Place) -> TrackedDrops:
        """The fit over the last window of the coarse basis, repeated while that pays."""
        last = self.shifted(place.problems[0].model.machine, BLIND_SCHEDULE[-1:])[0]
        return converged(place.problems, last, place.trajectories)

    def judge(self, known: TrackedDrops, machine: Machine) -> float:
        """Negative logarithm of the likelihood with another machine, drop by drop, linearised at a fit."""
        problems = self.coarse(machine)
        total, settings = 0.0, stage_settings(problems[0], BLIND_SCHEDULE[-1])
        for problem, reference in zip(problems, _carried(known, problems), strict=True):
            result = forward(problem, settings, reference=reference, samples=len(reference), smoothing=False)
            lost = result.done < len(reference)
            total += math.inf if lost else result.negative_log_likelihood
        return total

    def look(self, known: TrackedDrops, machine: Machine, passes: int) -> TrackedDrops:
        """Passes with another machine over the first window whole, linearised at a fit that is known."""
        problems = self.coarse(machine)
        last = self.shifted(machine, (replace(BLIND_SCHEDULE[-1], passes=passes),))
        return track(problems, last, references=_carried(known, problems))

    def refined(self, first: Candidate) -> Candidate:
        """The same machine with the finer basis, from what the coarse one found."""
        fine = self.problems(first.machine)
        schedule = self.shifted(first.machine, CALIBRATION_SCHEDULE if self.calibrate_only else FINE_SCHEDULE)
        references = _carried(first.fit, fine)
        if first.kept:
            # The finer basis may lie in the valley that the coarse one only came near: turned axes of a
            # support were found at one bearing by the coarse one and at both by the finer, some passes later.
            references = converged(fine, schedule[0], references).trajectories
        fit = track(fine, schedule, references=references, progress=self.progress)
        return replace(first, fit=fit)

    def refined_if_followed(self, first: Candidate) -> Candidate | None:
        """The same; None where the finer basis loses a record beside which the coarse one ended."""
        try:
            return self.refined(first)
        except IdentificationError:
            if not first.beside:
                raise
            return None

    def not_lost(self, found: Candidate) -> Candidate:
        """What was found, if the filter followed all drops to the end."""
        return replace(found, fit=_not_lost(found.fit, self.evidence))


def _place_of(fit: TrackedDrops) -> Place:
    return Place(problems=fit.problems, trajectories=tuple(fit.trajectories), rank=rank_of(fit))


def _fits(found: Candidate) -> bool:
    """Whether model and record agree, as far as another model could make them."""
    return all(
        check.passed or check.name == DIRECTIONS
        for problem, smoothed, factor in zip(
            found.fit.problems, found.fit.smoothed, found.fit.noise_factors, strict=True
        )
        for check in consistency_checks(problem, smoothed, factor)
    )


def _started_elsewhere(problem: DropProblem, attempt: int) -> DropProblem:
    """The problem with its unknowns starting at another place of their prior, one for each attempt."""
    start, chosen = problem.start.copy(), problem.parameter_slice
    sigma = np.array([unknown.sigma for unknown in problem.unknowns])
    start[chosen] += START_SPREAD * sigma * np.random.default_rng(attempt).standard_normal(len(sigma))
    bounds = np.array([unknown.bounds for unknown in problem.unknowns])
    start[chosen] = np.clip(start[chosen], bounds[:, 0], bounds[:, 1])
    start[problem.gap_entries] = problem.start[problem.gap_entries]
    return replace(problem, start=start)


def _carried(known: TrackedDrops, problems: Sequence[DropProblem]) -> list[Array]:
    """Trajectories of a fit in the coordinates of other problems of the same drops."""
    drops = zip(known.problems, problems, known.trajectories, strict=True)
    return [transferred(one, two, means) for one, two, means in drops]


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


def _with_sensors_of(model: DropModel, evidence: Evidence) -> Evidence:
    """The evidence with the channels of a model's sensors."""
    names = [sensor.name for sensor in model.machine.sensors]
    columns = [c for c, sensor in enumerate(evidence.record.sensors) if sensor.name in names]
    return evidence if len(columns) == len(evidence.record.sensors) else evidence.of_channels(columns)


def _tail_first(evidence: Sequence[Evidence]) -> list[Evidence]:
    """The drops with a known tail on the first of them, from which the machine is handed on to the others."""
    first, *others = evidence
    levels = [item.settled_level for item in evidence if not isinstance(item.settled_level, Missing)]
    if levels and isinstance(first.settled_level, Missing):
        first = first.with_facts(settled_level=levels[0])
    return [first, *others]


def _not_lost(tracked: TrackedDrops, evidence: Sequence[Evidence]) -> TrackedDrops:
    """The drops, if the filter followed all of them to the end: a part of a drop says nothing of its peak."""
    for item, problem, smoothed in zip(evidence, tracked.problems, tracked.smoothed, strict=True):
        done, samples = smoothed.filtered.done, len(smoothed.filtered.means)
        if done < samples:
            raise IdentificationError(
                f"the filter lost the drop {item.name} at {1e3 * problem.time[done]:.1f} ms of "
                f"{1e3 * problem.time[samples - 1]:.0f} ms, even with {LOOSER[-1]:g} × the usual unknown "
                "impulses; the machine description is too far from the machine that was recorded. Check the "
                "sensors (planes, angles, signs), or calibrate anew with this drop."
            )
    return tracked


def _first_contact(item: Evidence) -> float:
    return max(item.power_off.contact - item.power_off.value, 0.002)


def tracked_drop(
    evidence: Evidence,
    problem: DropProblem,
    smoothed: Smoothed,
    usual: Forward,
    noise_factor: float,
    drops: int = 1,
    kept: tuple[Kept, ...] = (),
    unaided: Future[InputEstimate] | None = None,
) -> TrackedDrop:
    """Forces and checks of one smoothed drop."""
    forces = force_history(problem, smoothed)
    seen = judged_by(problem, smoothed.filtered, usual)
    return TrackedDrop(
        evidence=evidence,
        problem=problem,
        smoothed=smoothed,
        judged=seen,
        forces=of_a_beam(forces) if is_beam(problem.model.machine.rotor) else forces,
        checks=consistency_checks(problem, replace(smoothed, filtered=seen), noise_factor),
        noise_factor=noise_factor,
        drops=drops,
        kept=kept,
        unaided=unaided,
    )


def followed_drops(
    machine: Machine,
    evidence: Sequence[Evidence],
    *,
    quick: bool = False,
    progress: Progress | None = None,
) -> Iterator[TrackedDrop]:
    """Follow recorded drops of one machine, and hand them out one by one.

    Each is given away with its arrays, so that no more than one is kept when its result has been made.
    """
    found = track_drops(machine, evidence, quick=quick, progress=progress)
    fit, factor, count, kept = found.fit, max(found.fit.noise_factors), len(evidence), found.kept
    usual = [drop.filtered for drop in fit.smoothed]
    unaided: list[Future[InputEstimate] | None] = [None] * count
    if not quick:
        # The estimate without contact law takes nothing from these passes, which leave a core to it.
        with ThreadPoolExecutor(max_workers=1) as beside:
            unaided = checks_begun(beside, fit)
            factor = likeliest_noise(fit, FINE_SCHEDULE[-1])
            fit = with_noise(fit, FINE_SCHEDULE[-1], factor)
    waiting = list(zip(evidence, fit.problems, fit.smoothed, usual, unaided, strict=True))
    del fit, found, usual, unaided
    while waiting:
        item, problem, smoothed, judged, check = waiting.pop(0)
        yield tracked_drop(item, problem, smoothed, judged, factor, count, kept, check)
