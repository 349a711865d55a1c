"""What stands in for a missing fact, the unbalance against the mark, and the progress of an estimate."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from rotordrop import build_drop_model, load_machine
from rotordrop.estimate.assumptions import left_to_assumption, twin_assumptions
from rotordrop.estimate.document import estimate_document
from rotordrop.estimate.estimate import PlaneUnbalance, unbalance_notes
from rotordrop.evidence.evidence import Missing, read_evidence
from rotordrop.evidence.synchronous import MarkAngle
from rotordrop.known import NINETY
from rotordrop.rotor.parameters import held_lightly
from rotordrop.twin.problems import COARSE_BASIS, drop_problem, with_end_planes, with_sensors_of
from rotordrop.twin.steps import BEYOND, DESCRIBED, FORM, GUESSES, LASTS, WEIGHED, WHOLE, Steps
from rotordrop.twin.tracked_estimate import plane_unbalances, polar_of
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.event import drop_conditions

UNTIL = 3e-3


@pytest.fixture(scope="module")
def evidence(machine, whole_drop):
    return read_evidence(build_drop_model(machine), whole_drop.window(-0.25, 0.05))


def said(machine, evidence):
    problem = drop_problem(build_drop_model(machine, COARSE_BASIS), evidence, until=UNTIL)
    return "\n".join((*twin_assumptions(evidence, problem), *left_to_assumption(problem)))


def test_assumptions_are_said_with_their_numbers(machine, evidence):
    assert "drag of the air: it begins at 10 s (90 %: 3.2 to 32 s)" in said(machine, evidence)
    told = machine.with_values({"speed.aero_time_constant": 8.0})
    assert "drag of the air" not in said(told, evidence)
    reach = evidence.reach
    assert not isinstance(reach, Missing)
    for name, found in zip(("NDE", "DE"), reach, strict=True):
        begin = f"{name}: without a tail the air gap begins at {1e6 * found:.0f} µm ± "
        assert begin in said(machine, evidence)
    unseen = evidence.with_facts(reach=Missing(reason="the sensors see too little"))
    text = said(machine, unseen)
    assert "DE: without a tail the air gap begins at 250 µm ± " in text
    assert "by the machine file (the sensors see too little)" in text
    assert "no axial load given" in said(machine, evidence)
    moving = machine.changed(rotor=machine.rotor.changed(axial=True))
    assert "no axial load given" not in said(moving, evidence)
    text = said(machine, evidence.with_facts(levitated=None))
    for sensor in machine.sensors:
        assert f"{sensor.name}: no levitated readings tell its noise; 0." in text
    assert "no levitated readings" not in said(machine, evidence)


def test_the_play_of_a_loose_race_is_said(machine, evidence):
    assert "no drop tells the play" not in said(machine, evidence)
    bearing = {"designation": "6015", "clearance": "20 um"}
    ends = [one.changed(bearing=bearing) for one in machine.touchdown_bearings]
    loose = machine.changed(touchdown_bearings=ends)
    problem = drop_problem(held_lightly(build_drop_model(loose, COARSE_BASIS)), evidence, until=UNTIL)
    assert (
        f"NDE play under load {1e6 * problem.model.play[0, 0]:.1f} µm" in left_to_assumption(problem).values()
    )
    assert 10e-6 < problem.model.play[0, 0] < 12e-6


def test_gains_and_bandwidths_that_nobody_stated_are_said(machine, evidence):
    names = ", ".join(sensor.name for sensor in machine.sensors)
    assert f"no gain given of {names}: ±1.6 % assumed (90 %)" in said(machine, evidence)
    stated = machine.with_values({f"sensors.{sensor.name}.gain": 1.0 for sensor in machine.sensors})
    assert "no gain given" not in said(stated, evidence)
    # The bandwidth told lowers the amplitude at the frequency told by 1 %.
    text = said(machine, evidence)
    found = re.search(r"more than ([\d.]+) kHz assumed.* contacts of (\d+) Hz", text)
    assert found is not None
    cut_off, contact = 1e3 * float(found[1]), float(found[2])
    assert 1.0 - 1.0 / math.hypot(1.0, contact / cut_off) == pytest.approx(0.01, rel=0.1)
    stated = machine.with_values({f"sensors.{sensor.name}.time_constant": 5e-6 for sensor in machine.sensors})
    assert "no bandwidth of the sensors" not in said(stated, evidence)


def test_a_third_plane_does_not_hide_where_the_first_forces_act():
    machine = load_machine(Path(__file__).parents[2] / "machines" / "long_rotor.toml")
    made = synthesize_drop(hidden_machine(machine, 11), 2.0 * math.pi * 130.0, 110, duration=0.03)
    evidence = read_evidence(build_drop_model(machine), made.record)
    model = build_drop_model(with_end_planes(machine), COARSE_BASIS)
    problem = drop_problem(model, with_sensors_of(model, evidence), until=UNTIL)
    assert problem.n_channels == 4 < len(machine.sensors)
    for name, entry in zip(model.bearing_names, problem.gap_entries, strict=True):
        assert problem.start[entry] == pytest.approx(made.truth["air_gap_m"][name], abs=20e-6)
    assert np.isfinite(problem.start).all()


SPEED = 2.0 * math.pi * 60.0
TURN = 1.0 / 60.0


def marks_of(hidden, seed, later=0.0):
    """When the rotor angle was a whole number of turns before power-off, in record time [s]."""
    conditions = drop_conditions(hidden, SPEED, seed)
    first = conditions.jitter - conditions.start.rotor_angle / SPEED
    return first - TURN * np.arange(13, -1, -1) + later


def found(workshop, marks, *, fits=True):
    off = workshop.evidence.power_off.value
    return plane_unbalances(workshop.problem, workshop.smoothed, marks, off, fits=fits, widening=1.0)


def told(workshop, marks):
    return [complex(np.exp(1j * one.phase.value)) for one in found(workshop, marks) if one.phase is not None]


def test_the_true_unbalance_lies_within(workshop, hidden):
    planes = found(workshop, marks_of(hidden, 40))
    assert len(planes) == len(hidden.machine.unbalances)
    for one, true in zip(planes, hidden.machine.unbalances, strict=True):
        low, high = one.amount.interval_90 or (0.0, 0.0)
        assert low <= float(true.amount) <= high
        if one.phase is not None:
            assert one.phase.interval_90 is not None
            half = 0.5 * float(np.ptp(one.phase.interval_90))
            assert abs(math.remainder(one.phase.value - float(true.phase), 2.0 * math.pi)) <= half


def test_a_mark_turns_the_phase_with_its_error(workshop, hidden):
    early = told(workshop, marks_of(hidden, 40, later=-TURN / 4.0))
    late = told(workshop, marks_of(hidden, 40, later=-TURN / 8.0))
    for one, other in zip(early, late, strict=True):
        assert np.angle(other / one) == pytest.approx(math.pi / 4.0, abs=1e-9)
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


def test_no_phase_is_told_of_what_may_be_nothing_or_does_not_fit():
    turned = MarkAngle(angle=0.0, error=0.0)
    wide = np.diag([1.0, 1.0]) * 1e-11
    assert polar_of(3e-6 + 0.0j, wide, 1e-5, turned, True)[1] is None
    amount, phase = polar_of(3e-6 + 0.0j, 1e-3 * wide, 1e-5, turned, False)
    assert phase is None
    assert amount.interval_90 is not None
    assert amount.interval_90[0] == 0.0 and amount.interval_90[1] > 1e-5


def test_an_estimate_tells_node_and_amount_or_that_it_has_no_mark(tracked, workshop):
    said = "the phase of the unbalance is not determined against a mark (the record carries no pulses of a "
    assert sum(note.startswith(said) for note in tracked.notes) == 1
    assert [one["phase_rad"] for one in estimate_document(tracked)["unbalance"]] == [None] * len(
        tracked.unbalance
    )
    before = np.array([-2.0, -2.0 + TURN])
    assert "pulses end before power-off, or are too few" in unbalance_notes(found(workshop, before))[0]
    amount, phase = polar_of(
        3e-6 + 0.0j, np.diag([4.0, 1.0]) * 1e-14, 1e-5, MarkAngle(angle=math.pi, error=0.0), True
    )
    plane = PlaneUnbalance(node=5, amount=amount, phase=phase)
    assert unbalance_notes([plane]) == (
        "unbalance at node 5: 3 g mm (90 %: 2.67 to 3.33), its phase 90° (87 to 93°) from +y with the spin "
        "when the mark of the shaft passes",
    )


def test_steps_add_up_to_the_whole_and_a_fit_that_begins_again_does_not_fall_back():
    told: list[tuple[str, float]] = []
    steps = Steps(lambda words, share: told.append((words, share)))
    steps.begin(GUESSES)
    for share in (0.0, 0.5, 0.9):
        steps("fitting the first 59 ms", share)
    steps.begin(WHOLE)
    for share in (0.0, 0.5, 0.0, 0.3):  # in another minimum
        steps("fitting the first 200 ms", share)
    steps.begin(WEIGHED)
    steps.begin("trying extensions of the base model")
    steps("fitting the first 200 ms", 1.0)
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == pytest.approx(1.0)
    assert told[2] == ("step 1 of 3, fitting the first 59 ms", pytest.approx(0.5 * LASTS[GUESSES]))
    assert told[6][1] == told[7][1] == told[8][1] == pytest.approx(LASTS[GUESSES] + 0.5 * LASTS[WHOLE])
    assert told[-2][0] == "beyond the usual steps, trying extensions of the base model"


def test_a_calibrated_machine_has_fewer_steps_and_a_quick_one_is_not_counted():
    told: list[tuple[str, float]] = []
    steps = Steps(lambda words, share: told.append((words, share)))
    steps.begin(WHOLE, (WHOLE, WEIGHED))
    steps("a", 1.0)
    assert told[-1] == ("step 1 of 2, a", pytest.approx(LASTS[WHOLE] / (LASTS[WHOLE] + LASTS[WEIGHED])))
    steps.begin(WHOLE, (WHOLE,))
    steps("a", 1.0)
    assert told[-1] == ("a", 1.0)
    steps = Steps(lambda words, share: told.append((words, share)))  # a rotor that is sought: one more
    steps.begin(FORM, (FORM, *DESCRIBED))
    steps("a", 1.0)
    assert told[-1] == ("step 1 of 4, a", pytest.approx(LASTS[FORM] / sum(LASTS.values())))
    steps.begin("trying extensions of the base model")
    assert told[-1][1] == pytest.approx(1.0 - LASTS[BEYOND] / sum(LASTS.values()))
