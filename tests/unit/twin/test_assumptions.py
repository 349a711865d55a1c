"""What stands in for a missing fact is said, with the number that was taken and how well it is known."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from rotordrop.estimate.assumptions import left_to_assumption, twin_assumptions
from rotordrop.evidence.evidence import Evidence, Missing, read_evidence
from rotordrop.machine import Machine, example_machine, load_machine
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import read_record
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.twin.problems import COARSE_BASIS, drop_problem, with_end_planes, with_sensors_of
from rotordrop_bench import hidden_machine, synthesize_drop

UNTIL = 3e-3


@pytest.fixture(scope="module")
def machine() -> Machine:
    """The bundled machine, whose owner says nothing of the drag of the air."""
    return example_machine("lp400")


@pytest.fixture(scope="module")
def evidence(machine: Machine) -> Evidence:
    record = read_record(example_record_path("lp400_drop_060"), machine)
    early = record.window(-0.25, 0.05)
    return read_evidence(build_drop_model(machine), early)


def said(machine: Machine, evidence: Evidence) -> str:
    problem = drop_problem(build_drop_model(machine, COARSE_BASIS), evidence, until=UNTIL)
    return "\n".join((*twin_assumptions(evidence, problem), *left_to_assumption(problem)))


def test_drag_of_the_air_is_said_with_its_interval(machine: Machine, evidence: Evidence) -> None:
    assert "drag of the air: it begins at 10 s (90 %: 3.2 to 32 s)" in said(machine, evidence)
    told = machine.with_values({"speed.aero_time_constant": 8.0})
    assert "drag of the air" not in said(told, evidence)


def test_air_gaps_without_a_tail_say_where_they_begin(machine: Machine, evidence: Evidence) -> None:
    reach = evidence.reach
    assert not isinstance(reach, Missing)
    for name, found in zip(("NDE", "DE"), reach, strict=True):
        begin = f"{name}: without a tail the air gap begins at {1e6 * found:.0f} µm ± "
        assert begin in said(machine, evidence)
    unseen = evidence.with_facts(reach=Missing(reason="the sensors see too little"))
    text = said(machine, unseen)
    assert "DE: without a tail the air gap begins at 250 µm ± " in text
    assert "by the machine file (the sensors see too little)" in text


def test_gains_that_nobody_stated_are_said_with_what_is_taken(machine: Machine, evidence: Evidence) -> None:
    names = ", ".join(sensor.name for sensor in machine.sensors)
    assert f"states no gain of {names}: taken as calibrated, each within ±1.6 % (90 %)" in said(
        machine, evidence
    )
    stated = machine.with_values({f"sensors.{sensor.name}.gain": 1.0 for sensor in machine.sensors})
    assert "states no gain" not in said(stated, evidence)


def test_a_bandwidth_that_nobody_stated_is_said_with_what_it_could_hide(
    machine: Machine, evidence: Evidence
) -> None:
    """The lag told lowers the amplitude at the frequency told by 1 %."""
    text = said(machine, evidence)
    found = re.search(r"A lag of (\d+) µs \(a bandwidth of ([\d.]+) kHz\).* contacts of (\d+) Hz", text)
    assert found is not None
    lag, cut_off, contact = 1e-6 * float(found[1]), 1e3 * float(found[2]), float(found[3])
    assert cut_off == pytest.approx(1.0 / (2.0 * math.pi * lag), rel=0.05)
    assert 1.0 - 1.0 / math.hypot(1.0, contact / cut_off) == pytest.approx(0.01, rel=0.1)
    stated = machine.with_values({f"sensors.{sensor.name}.time_constant": 5e-6 for sensor in machine.sensors})
    assert "no time constant of the sensors" not in said(stated, evidence)


def test_a_load_along_the_axis_is_said_to_be_unseen_where_none_is_stated(
    machine: Machine, evidence: Evidence
) -> None:
    assert "states no load along the axis" in said(machine, evidence)
    moving = machine.changed(rotor=machine.rotor.changed(axial=True))
    assert "no load along the axis" not in said(moving, evidence)


def test_noise_that_nothing_tells_is_said(machine: Machine, evidence: Evidence) -> None:
    text = said(machine, evidence.with_facts(levitated=None))
    for sensor in machine.sensors:
        assert f"{sensor.name}: no levitated readings tell its noise; 0." in text
    assert "no levitated readings" not in said(machine, evidence)


def test_a_third_plane_does_not_hide_where_the_first_forces_act() -> None:
    """With a plane left out of the search, a fall seen by six sensors met the readings of four."""
    machine = load_machine(Path(__file__).parents[2] / "machines" / "long_rotor.toml")
    made = synthesize_drop(hidden_machine(machine, 11), 2.0 * math.pi * 130.0, 110, duration=0.03)
    evidence = read_evidence(build_drop_model(machine), made.record)
    model = build_drop_model(with_end_planes(machine), COARSE_BASIS)
    problem = drop_problem(model, with_sensors_of(model, evidence), until=UNTIL)
    assert problem.n_channels == 4 < len(machine.sensors)
    for name, entry in zip(model.bearing_names, problem.gap_entries, strict=True):
        assert problem.start[entry] == pytest.approx(made.truth["air_gap_m"][name], abs=20e-6)
    assert np.isfinite(problem.start).all()
