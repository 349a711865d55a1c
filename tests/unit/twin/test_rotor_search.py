"""The rotor of a machine of twelve numbers is found from a record; what else to measure is said."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import rotordrop
from rotordrop.elements.rotor import FORM
from rotordrop.estimate.advice import Advice
from rotordrop.evidence.evidence import read_evidence
from rotordrop.machine import example_machine
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.record.record import read_record
from rotordrop.rotor.assembly import free_free_modes, rotor_fe
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track.forces import ForceHistory
from rotordrop.track.input_state import InputEstimate
from rotordrop.twin.problems import recorded_drop
from rotordrop.twin.rotor_search import with_found_rotor
from rotordrop.twin.tracked_loads import (
    check_with_form_error,
    check_without_form_error,
    is_beyond_accuracy,
    with_form_error,
    without_form_error,
)
from rotordrop.twin.value_of_information import explained

RECORDS = Path(rotordrop.__file__).parent / "examples" / "lp400"


@pytest.fixture(scope="module")
def described():
    return example_machine("lp400")


@pytest.fixture(scope="module")
def twelve(described):
    """The machine of the bundled record as twelve numbers tell it."""
    rotor, bearings, sensors = described.rotor, described.touchdown_bearings, described.sensors
    at = rotor.node_positions
    machine = simple_machine(
        SimpleMachine(
            mass=rotor.mass,
            centre=rotor.centre_of_gravity,
            length=at[-1],
            bearings=(at[bearings[0].node - 1], at[bearings[1].node - 1]),
            sensors=(at[sensors[0].node - 1], at[sensors[-1].node - 1]),
            sensor_angle=float(sensors[0].angle),
            designation=str(bearings[0].bearing.designation),
            gap="0.27 mm",
            speed="550 Hz",
            grade="G 1",
            support="stiff",
        )
    )
    named = [one.changed(name=other.name) for one, other in zip(machine.sensors, sensors, strict=True)]
    return machine.changed(sensors=tuple(named))


@pytest.fixture(scope="module")
def seen(twelve):
    record = read_record(RECORDS / "drop_060.h5", twelve)
    tail = read_record(RECORDS / "drop_060_tail.csv", twelve)
    evidence = read_evidence(build_drop_model(twelve), record, tail)
    return [recorded_drop(evidence, 0.03)]


@pytest.mark.slow
def test_bending_and_inertia_are_found_from_the_record_without_a_contact_law(described, twelve, seen):
    """The cylinder of twelve numbers bends 80 % too fast; two numbers of the form bring it within a tenth."""
    held = {f"rotor.{row.path}": 0.0 for row in FORM[1:]}
    found = with_found_rotor(twelve.with_values(held), seen).rotor
    true = rotor_fe(described.rotor)
    frequencies = free_free_modes(true, 4).frequency[2:]
    cylinder = rotor_fe(twelve.with_values({"rotor.stiffness_factor": 1.0, "rotor.mass_to_ends": 0.0}).rotor)
    assert free_free_modes(cylinder, 3).frequency[2] > 1.7 * frequencies[0]
    np.testing.assert_allclose(free_free_modes(rotor_fe(found), 4).frequency[2:], frequencies, rtol=0.1)
    assert rotor_fe(found).diametral_inertia == pytest.approx(true.diametral_inertia, rel=0.12)
    assert found.stiffness_factor.status == "estimated"
    assert "without a contact law" in found.stiffness_factor.source


def test_a_rotor_that_is_described_stays_as_it_is(described):
    assert with_found_rotor(described, []) is described


def test_numbers_that_are_known_are_not_sought(twelve):
    known = twelve.with_values({f"rotor.{row.path}": 0.1 for row in FORM} | {"rotor.stiffness_factor": 0.3})
    assert with_found_rotor(known, []) is known


def test_what_numbers_explain_of_a_variance():
    """Two independent numbers explain the sum of their squares; one told twice explains no more than once."""
    apart = np.diag([4.0, 9.0])
    assert explained(apart, np.array([2.0, 3.0])) == pytest.approx(2.0)
    assert explained(np.array([[4.0, 4.0], [4.0, 4.0]]), np.array([2.0, 2.0])) == pytest.approx(1.0)


def test_advice_names_the_measurement_and_what_it_would_bring():
    one = Advice(
        measurement="a lift check at DE (rotordrop clearance)",
        paths=("DE.air_gap",),
        half_widths={"NDE": 200.0, "DE": 300.0},
        narrowed={"NDE": 199.0, "DE": 150.0},
    )
    assert one.left == pytest.approx(0.5)
    said = "a lift check at DE (rotordrop clearance) would narrow the peak force: DE from ± 300 N to ± 150 N"
    assert one.sentence() == said


def test_advice_where_the_twin_does_not_fit_is_a_bound_and_says_so():
    one = Advice(
        measurement="the rotor by its sections, from a drawing,",
        paths=("rotor",),
        half_widths={"NDE": 400.0},
        narrowed={"NDE": 300.0},
        at_most=True,
    )
    assert one.sentence().endswith("NDE from ± 400 N to ± 300 N or less; the model may well fit then")


def test_the_error_of_a_beam_is_taken_back_from_forces_and_cross_check():
    """What a drawing of the rotor brings at least, where the twin of a beam does not fit the record."""
    forces = SimpleNamespace(magnitude=1e3, magnitude_sigma=30.0, stress=1e9, stress_sigma=2e7)
    forces = ForceHistory(
        **{f.name: np.array([[getattr(forces, f.name, 0.0)]]) for f in fields(ForceHistory)}
    )
    beam = with_form_error(forces, 0.08)
    assert beam.magnitude_sigma[0, 0] == pytest.approx(math.hypot(30.0, 80.0))
    assert without_form_error(beam, 0.08).magnitude_sigma[0, 0] == pytest.approx(30.0)
    assert without_form_error(beam, 0.08).stress_sigma[0, 0] == pytest.approx(2e7)
    assert with_form_error(forces, 0.0).magnitude_sigma[0, 0] == 30.0  # a described rotor adds no bit
    check = InputEstimate(**{f.name: np.array([0.1]) for f in fields(InputEstimate)})
    wider = check_with_form_error(check, 0.08)
    assert wider.peak_error[0] == pytest.approx(math.hypot(0.1, 1.6449 * 0.08), rel=1e-4)
    assert check_without_form_error(wider, 0.08).peak_error == pytest.approx(check.peak_error)
    assert check_without_form_error(wider, 0.08).stress_error == pytest.approx(check.stress_error)


def test_a_peak_beyond_the_accuracy_of_the_cross_check_is_apart():
    """Where a beam stands for the rotor, the cross-check decides within its accuracy, not by a factor."""
    check = InputEstimate(**{f.name: np.array([0.2]) for f in fields(InputEstimate)})
    check = replace(check, peak=np.array([1000.0, 0.0]), peak_error=np.array([0.2, 0.2]))
    assert [is_beyond_accuracy(peak, check, 0) for peak in (790.0, 810.0, 1190.0, 1210.0)] == [
        True,
        False,
        False,
        True,
    ]
    assert not is_beyond_accuracy(1e6, check, 1)  # no impact there to be compared with
