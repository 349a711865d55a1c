"""The drops of one machine posed as estimation problems, in a coarse basis for the search and a fine one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rotordrop.evidence.evidence import Evidence, Missing
from rotordrop.machine import Machine
from rotordrop.record.axes import end_columns
from rotordrop.rotor.parameters import DropModel, build_drop_model, held_lightly
from rotordrop.rotor.reduction import Reduction, reduction_for_contact
from rotordrop.track.calibration import BLIND_SCHEDULE, window_end
from rotordrop.track.prior import fall_time
from rotordrop.track.problem import DropProblem, RecordedDrop, build_problem
from rotordrop.twin.tracked_parameters import UNSURE_GAP

COARSE_BASIS = Reduction(modes=6, attachment=True)
"""The basis with the fewest modes; a rotor whose modes lie lower against its contact frequency gets more."""

COARSE_REACH, FINE_REACH = 2.25, 8.0
"""The highest mode over the contact frequency, at least [1]: a rotor of 1.8 m and 130 kg with a sensor plane
at mid-span was lost at 2.1 and followed from 3.2 on, one of 1.1 m and 60 kg is followed at 2.4.
Six peaks of three drops of DropBench moved by 0.25 % at most from a reach above 8.4 to one of 8, and by up to
0.6 % to one of 6."""

WINDOW = 0.2
"""Part of a drop that is estimated [s]."""


def drop_problem(model: DropModel, evidence: Evidence, until: float = WINDOW) -> DropProblem:
    """Estimation problem of a record up to a time [s].

    Without a tail the gaps, where they are unknown, start where the first forces act.
    """
    problem = build_problem(model, recorded_drop(evidence, until), until=until)
    if isinstance(evidence.settled_level, Missing):
        _start_gaps(problem, evidence)
    return problem


def recorded_drop(evidence: Evidence, until: float = WINDOW) -> RecordedDrop:
    """What the record says, as the filter takes it."""
    readings, level = evidence.readings(until), evidence.settled_level
    return RecordedDrop(
        time=evidence.time[: len(readings)],
        readings=readings,
        noise=evidence.noise(until),
        slow_noise=evidence.slow_noise,
        initial_speed=evidence.speed.value,
        initial_speed_error=evidence.speed.standard_error,
        speed=evidence.measured_speed(until),
        tail_level=None if isinstance(level, Missing) else level,
        first_contact=first_contact(evidence),
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


def _basis(machine: Machine, reach: float) -> Reduction:
    assert COARSE_BASIS.modes is not None
    return reduction_for_contact(machine, least=COARSE_BASIS.modes, reach=reach)


def with_end_planes(machine: Machine) -> Machine:
    """The machine with those two whole sensor planes only that lie farthest apart, where it has more.

    A search from guesses begins far from the record, and a plane between the bearings makes it stiff: what
    the first impacts get wrong has to bend the rotor then, and gains run away with it. Once the parameters
    are found, every plane takes part.
    """
    ends = end_columns(machine.sensors, machine.rotor.node_positions)
    if len(ends) == len(machine.sensors):
        return machine
    return machine.model_copy(update={"sensors": tuple(machine.sensors[i] for i in ends)})


def with_sensors_of(model: DropModel, evidence: Evidence) -> Evidence:
    """The evidence with the channels of a model's sensors."""
    names = [sensor.name for sensor in model.machine.sensors]
    columns = [c for c, sensor in enumerate(evidence.record.sensors) if sensor.name in names]
    return evidence if len(columns) == len(evidence.record.sensors) else evidence.of_channels(columns)


def first_contact(item: Evidence) -> float:
    """Time from power-off to the first contact [s]."""
    return max(item.power_off.contact - item.power_off.value, 0.002)


def tail_first(evidence: Sequence[Evidence]) -> list[Evidence]:
    """The drops with a known tail on the first of them, from which the machine is handed on to the others."""
    first, *others = evidence
    levels = [item.settled_level for item in evidence if not isinstance(item.settled_level, Missing)]
    if levels and isinstance(first.settled_level, Missing):
        first = first.with_facts(settled_level=levels[0])
    return [first, *others]


@dataclass(frozen=True, kw_only=True)
class Drops:
    """The drops that a search follows; what a machine makes of them is posed once in each basis."""

    evidence: tuple[Evidence, ...]
    calibrate_only: bool
    posed: dict[tuple[int, bool], tuple[Machine, tuple[DropProblem, ...]]] = field(default_factory=dict)

    def fine(self, machine: Machine) -> tuple[DropProblem, ...]:
        """The drops in the basis that force and stress are taken from."""
        return self._problems(machine, fine=True)

    def coarse(self, machine: Machine) -> tuple[DropProblem, ...]:
        """The drops in the basis of the search, seen by the outer sensor planes."""
        return self._problems(machine, fine=False)

    def _problems(self, machine: Machine, *, fine: bool) -> tuple[DropProblem, ...]:
        # The machine is held with its problems, so that its identity stays its own.
        known = self.posed.get((id(machine), fine))
        if known is not None:
            return known[1]
        until = WINDOW
        if self.calibrate_only:
            contact = max(first_contact(item) for item in self.evidence)
            until = window_end(BLIND_SCHEDULE[-1], contact, fall_time(machine)) + 0.01
        seen = machine if fine else with_end_planes(machine)
        basis = _basis(machine, FINE_REACH if fine else COARSE_REACH)
        model = held_lightly(build_drop_model(seen, basis))
        items = self.evidence if fine else [with_sensors_of(model, item) for item in self.evidence]
        problems = tuple(drop_problem(model, item, until) for item in items)
        self.posed[id(machine), fine] = machine, problems
        return problems
