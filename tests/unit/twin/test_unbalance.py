"""The unbalance of a drop against the mark of the shaft: from two components and their covariance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.estimate.document import estimate_document
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.unbalance import PlaneUnbalance, unbalance_notes
from rotordrop.evidence.synchronous import MarkAngle
from rotordrop.known import NINETY
from rotordrop.twin.tracked import TrackedDrop
from rotordrop.twin.tracked_unbalance import plane_unbalances, polar_of
from rotordrop_bench import HiddenMachine
from rotordrop_bench.event import drop_conditions

SPEED = 2.0 * math.pi * 60.0
TURN = 1.0 / 60.0


def marks_of(hidden: HiddenMachine, seed: int, later: float = 0.0) -> np.ndarray:
    """When the rotor angle was a whole number of turns before power-off, in record time [s]."""
    conditions = drop_conditions(hidden, SPEED, seed)
    first = conditions.jitter - conditions.start.rotor_angle / SPEED
    return first - TURN * np.arange(13, -1, -1) + later


def found(
    workshop: TrackedDrop, marks: np.ndarray | None, *, fits: bool = True
) -> tuple[PlaneUnbalance, ...]:
    off = workshop.evidence.power_off.value
    return plane_unbalances(workshop.problem, workshop.smoothed, marks, off, fits=fits, widening=1.0)


def told(workshop: TrackedDrop, marks: np.ndarray) -> list[complex]:
    return [complex(np.exp(1j * one.phase.value)) for one in found(workshop, marks) if one.phase is not None]


def test_the_true_unbalance_lies_within(workshop: TrackedDrop, hidden: HiddenMachine) -> None:
    planes = found(workshop, marks_of(hidden, 40))
    assert len(planes) == len(hidden.machine.unbalances)
    for one, true in zip(planes, hidden.machine.unbalances, strict=True):
        low, high = one.amount.interval_90 or (0.0, 0.0)
        assert low <= float(true.amount) <= high
        if one.phase is not None:
            assert one.phase.interval_90 is not None
            half = 0.5 * float(np.ptp(one.phase.interval_90))
            assert abs(math.remainder(one.phase.value - float(true.phase), 2.0 * math.pi)) <= half


def test_a_mark_that_passes_later_sees_the_heavy_spot_further_on(
    workshop: TrackedDrop, hidden: HiddenMachine
) -> None:
    early = told(workshop, marks_of(hidden, 40, later=-TURN / 4.0))
    late = told(workshop, marks_of(hidden, 40, later=-TURN / 8.0))
    for one, other in zip(early, late, strict=True):
        assert np.angle(other / one) == pytest.approx(math.pi / 4.0, abs=1e-9)


def test_the_error_across_is_that_of_the_phase_and_the_one_along_that_of_the_amount() -> None:
    covariance = np.diag([4.0, 1.0]) * 1e-14
    amount, phase = polar_of(3e-6 + 0.0j, covariance, 1e-5, MarkAngle(angle=0.3, error=0.0), True)
    assert amount.interval_90 == pytest.approx((3e-6 - NINETY * 2e-7, 3e-6 + NINETY * 2e-7))
    assert phase is not None
    assert phase.value == pytest.approx(-0.3 - 0.5 * math.pi)
    half = math.asin(NINETY * 1e-7 / 3e-6)
    assert phase.interval_90 == pytest.approx((phase.value - half, phase.value + half))
    blurred = polar_of(3e-6 + 0.0j, covariance, 1e-5, MarkAngle(angle=0.3, error=0.1), True)[1]
    assert blurred is not None and blurred.interval_90 is not None
    assert 0.5 * np.ptp(blurred.interval_90) == pytest.approx(math.hypot(half, NINETY * 0.1))


def test_no_phase_is_told_of_what_may_be_nothing_or_does_not_fit() -> None:
    turned = MarkAngle(angle=0.0, error=0.0)
    wide = np.diag([1.0, 1.0]) * 1e-11
    assert polar_of(3e-6 + 0.0j, wide, 1e-5, turned, True)[1] is None
    amount, phase = polar_of(3e-6 + 0.0j, 1e-3 * wide, 1e-5, turned, False)
    assert phase is None
    assert amount.interval_90 is not None
    assert amount.interval_90[0] == 0.0 and amount.interval_90[1] > 1e-5


def test_without_a_mark_the_estimate_says_so(tracked: Estimate, workshop: TrackedDrop) -> None:
    said = "the phase of the unbalance is not determined against a mark (the record carries no pulses of a "
    assert sum(note.startswith(said) for note in tracked.notes) == 1
    assert [one["phase_rad"] for one in estimate_document(tracked)["unbalance"]] == [None] * len(
        tracked.unbalance
    )
    before = np.array([-2.0, -2.0 + TURN])
    assert "pulses end before power-off, or are too few" in unbalance_notes(found(workshop, before))[0]


def test_what_is_told_names_node_amount_and_direction() -> None:
    amount, phase = polar_of(
        3e-6 + 0.0j, np.diag([4.0, 1.0]) * 1e-14, 1e-5, MarkAngle(angle=math.pi, error=0.0), True
    )
    plane = PlaneUnbalance(node=5, amount=amount, phase=phase)
    assert unbalance_notes([plane]) == (
        "unbalance at node 5: 3 g mm (90 %: 2.67 to 3.33), its phase 90° (87 to 93°) from +y with the spin "
        "when the mark of the shaft passes",
    )
