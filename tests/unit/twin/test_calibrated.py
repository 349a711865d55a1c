"""A calibration from guesses: parameters near the truth, what is determined, what is confounded."""

import math

import pytest
from tests.bank import handed_out

from rotordrop import load_machine, save_machine
from rotordrop.elements.table import parameter, row_of
from rotordrop.rotor.unknowns import prior
from rotordrop.twin.calibrated import calibration_json
from rotordrop.twin.search import is_calibrated
from rotordrop.twin.tracked_parameters import NOT_DETERMINED

BEARINGS = ("NDE", "DE")

pytestmark = pytest.mark.slow


calibration = handed_out("calibration")


def test_supports_and_gaps_come_near_the_truth_from_guesses(calibration, hidden, lp400):
    assert calibration.consistent, calibration.sentence()
    for bearing in hidden.machine.touchdown_bearings:
        for path, limit in (("stiffness", 0.03), ("mass", 0.03), ("damping", 0.15)):
            found = calibration.values[f"{bearing.name}.support.{path}"]
            true = float(getattr(bearing.support, path))
            assert found.value == pytest.approx(true, rel=limit), (bearing.name, path)
            low, high = found.interval_90 or (math.nan, math.nan)
            assert low < true < high, (bearing.name, path)
        gap = calibration.values[f"{bearing.name}.air_gap"].value
        assert gap == pytest.approx(float(bearing.air_gap), abs=3e-6)
    apart = [
        abs(float(guess.support.stiffness) / float(true.support.stiffness) - 1.0)
        for guess, true in zip(lp400.touchdown_bearings, hidden.machine.touchdown_bearings, strict=True)
    ]
    assert max(apart) > 0.1


def test_the_calibrated_machine_loads_and_says_what_was_determined(calibration, lp400, tmp_path):
    save_machine(calibration.machine, tmp_path / "calibrated.toml")
    again = load_machine(tmp_path / "calibrated.toml")
    assert is_calibrated(again) and not is_calibrated(lp400)
    for bearing in again.touchdown_bearings:
        for quantity in (bearing.support.stiffness, bearing.contact.stiffness, bearing.air_gap):
            assert quantity.source == "calibrated on hidden_060, hidden_150"
            assert quantity.interval_90 is not None
            assert quantity.interval_90[0] < float(quantity) < quantity.interval_90[1]
    verdicts = {entry.path: entry.verdict for entry in calibration.identifiability}
    for name in BEARINGS:
        for path in ("support.stiffness", "support.mass", "support.damping", "friction.dynamic"):
            assert verdicts[f"{name}.{path}"] == "determined"
        for path in ("race.inertia", "race.drag_coefficient", "contact.damping"):
            assert verdicts[f"{name}.{path}"] == "the record does not determine it"
    for entry in calibration.identifiability:  # what drifts may end less certain than it began
        if row_of(entry.path).drift == 0.0:
            assert entry.posterior_standard_deviation <= 1.0001 * entry.prior_standard_deviation


def test_drops_keep_their_lift_and_sensors_their_gain(calibration, synthetic, hidden):
    origin = calibration.machine.calibration
    assert origin is not None
    assert [len(drop.lift) for drop in origin.drops] == [2, 2]
    carried = calibration.machine.rotor.mass * float(calibration.machine.gravity) / 2.0
    for lift, true in zip(origin.drops[0].lift, synthetic.truth["remanent_force"], strict=True):
        assert abs(lift.up - true["vertical_N"] / carried) < 4.0 * lift.up_error < 0.4
        assert abs(lift.sideways - true["x_N"] / carried) < 4.0 * lift.sideways_error
    for sensor in calibration.machine.sensors:
        found = calibration.values[f"sensors.{sensor.name}.gain"]
        assert float(sensor.gain) == found.value == pytest.approx(1.0, abs=0.05)
        assert found.standard_error is not None and found.standard_error < 0.02
        assert float(sensor.offset) == calibration.values[f"sensors.{sensor.name}.offset"].value


def test_confounded_values_are_said_in_the_document_too(calibration):
    pairs = {frozenset((pair.first, pair.second)): pair for pair in calibration.confounded}
    pair = pairs[frozenset(("NDE.support.stiffness", "NDE.support.mass"))]
    assert pair.correlation > 0.9
    assert "hammer test" in pair.separated_by
    written = calibration_json(calibration)
    assert set(written["values"]) == set(calibration.values)
    assert written["sentence"] == calibration.sentence()
    found = [entry.verdict for entry in calibration.identifiability].count("determined")
    assert calibration.sentence().startswith(f"{found} of {len(calibration.identifiability)} parameters are")
    assert "determined by 2 drop(s)" in calibration.sentence()
    for entry in calibration.identifiability:  # one word for one thing, in values, table and sentence
        assert calibration.values[entry.path].status == entry.verdict


def test_what_the_records_do_not_determine_stays_a_guess(calibration, lp400):
    undetermined = {e.path for e in calibration.identifiability if e.verdict in NOT_DETERMINED}
    assert {"NDE.race.inertia", "DE.race.inertia"} <= undetermined
    for b, bearing in enumerate(calibration.machine.touchdown_bearings):
        inertia, before = bearing.race.inertia, lp400.touchdown_bearings[b].race.inertia
        assert inertia.status == "guess" and inertia.range is not None
        sigma = prior(parameter("race.inertia"), inertia).sigma
        assert sigma == pytest.approx(prior(parameter("race.inertia"), before).sigma, rel=1e-6)
