"""A drop that the twin has followed: its problem, smoothed estimate, forces and checks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

from rotordrop.estimate.published import Structure
from rotordrop.evidence.evidence import Evidence
from rotordrop.machine import Machine
from rotordrop.progress import Progress
from rotordrop.track.consistency import DIRECTIONS, Check, consistency_checks
from rotordrop.track.forces import ForceHistory, force_history
from rotordrop.track.input_state import InputEstimate
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, Smoothed
from rotordrop.twin.mixture import Alternative, named, probabilities
from rotordrop.twin.problems import Drops, tail_first
from rotordrop.twin.search import Accepted, Search, track_drops
from rotordrop.twin.steps import Steps
from rotordrop.twin.tracked_loads import check_without_contact_law, checks_begun, with_form_error


@dataclass(frozen=True, kw_only=True)
class OtherModel:
    """A drop as another model has followed it, which the readings do not tell from the one that is stated."""

    name: str
    odds: float
    """Its probability over that of the model that is stated [1]."""
    probability: float
    """Its probability [1]."""
    problem: DropProblem
    smoothed: Smoothed
    forces: ForceHistory

    def structure(self) -> Structure:
        """The model in words."""
        return Structure(
            name=self.name,
            log_likelihood_rise=math.log(self.odds),
            probability=self.probability,
            sentence=(
                f"Not to be told from it: {self.name}, with a probability of "
                f"{100.0 * self.probability:.0f} %. The intervals hold both."
            ),
        )


@dataclass(frozen=True, kw_only=True)
class TrackedDrop:
    """A drop that the twin has followed, with the arrays of its filter: the workshop, not the result."""

    evidence: Evidence
    """What the record says without the contacts."""
    problem: DropProblem
    smoothed: Smoothed
    """The estimation problem and its smoothed estimate with the likeliest process noise."""
    judged: Forward
    """The pass by whose innovations the model is judged."""
    forces: ForceHistory
    """Force and stress over time with standard deviations."""
    checks: tuple[Check, ...]
    """Consistency of model and record."""
    noise_factor: float
    """Size of the process noise over that of the schedule [1]."""
    drops: int = 1
    """Number of drops that were fitted together."""
    accepted: tuple[Accepted, ...] = ()
    """Extensions of the base model that the readings paid for."""
    cross_check: Future[InputEstimate] | None = None
    """The estimate without contact law, where it was begun while the passes ran."""
    others: tuple[OtherModel, ...] = ()
    """What other models make of it that the readings do not tell from this one."""

    def without_contact_law(self) -> InputEstimate:
        """The estimate without contact law: as it was begun, or made now."""
        return (
            check_without_contact_law(self.problem) if self.cross_check is None else self.cross_check.result()
        )

    @property
    def consistent(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    @property
    def named(self) -> str:
        """The model by its extensions."""
        return named(one.extension for one in self.accepted)

    @property
    def sees_all_directions(self) -> bool:
        """Whether the sensors see enough for the estimate without contact law."""
        return all(check.passed for check in self.checks if check.name == DIRECTIONS)


def tracked_drop(
    evidence: Evidence,
    problem: DropProblem,
    smoothed: Smoothed,
    judged: Smoothed,
    noise_factor: float,
) -> TrackedDrop:
    """Forces and checks of one smoothed drop."""
    return TrackedDrop(
        evidence=evidence,
        problem=problem,
        smoothed=smoothed,
        judged=judged.filtered,
        forces=_forces(problem, smoothed),
        checks=consistency_checks(problem, judged, noise_factor),
        noise_factor=noise_factor,
    )


def _forces(problem: DropProblem, smoothed: Smoothed) -> ForceHistory:
    return with_form_error(force_history(problem, smoothed), problem.model.machine.rotor.force_sigma)


def _of_drop(alternatives: Sequence[Alternative], number: int) -> tuple[OtherModel, ...]:
    """What other models of a fit make of one of its drops."""
    found = []
    for one, probability in zip(alternatives, probabilities(alternatives), strict=True):
        problem, smoothed = one.fit.problems[number], one.fit.smoothed[number]
        found.append(
            OtherModel(
                name=one.name,
                odds=one.odds,
                probability=probability,
                problem=problem,
                smoothed=smoothed,
                forces=_forces(problem, smoothed),
            )
        )
    return tuple(found)


def followed_drops(
    machine: Machine,
    evidence: Sequence[Evidence],
    *,
    quick: bool = False,
    progress: Progress | None = None,
) -> Iterator[TrackedDrop]:
    """Follow recorded drops of one machine, and hand them out one by one.

    Each is handed out with its arrays, so that no more than one is held when its result has been made.
    """
    search = Search(
        drops=Drops(evidence=tuple(tail_first(evidence)), calibrate_only=False),
        progress=progress and Steps(progress),
    )
    machine = search.with_rotor(machine)
    # The estimate without contact law takes nothing from the passes, which leave a core to it.
    with ThreadPoolExecutor(max_workers=1) as pool:
        cross_check: list[Future[InputEstimate] | None] = [None] * len(evidence)
        if not quick:
            cross_check = checks_begun(pool, search.drops.fine(machine))
        found = track_drops(search, machine, quick=quick)
    factor, accepted, count = found.noise_factor, found.accepted, len(evidence)
    alternatives = found.alternatives
    waiting = list(
        zip(evidence, found.fit.problems, found.fit.smoothed, found.judged, cross_check, strict=True)
    )
    del search, found, cross_check
    for number in range(count):
        item, problem, smoothed, judged, check = waiting.pop(0)
        drop = tracked_drop(item, problem, smoothed, judged, factor)
        others = _of_drop(alternatives, number)
        yield replace(drop, drops=count, accepted=accepted, cross_check=check, others=others)
