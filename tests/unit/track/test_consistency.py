"""Checks that decide whether intervals hold: what they see, and that they do not see what is not there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track.consistency import (
    CORRELATION_LIMIT,
    DEPARTURE_LIMIT,
    LARGEST_LASTING_LIFT,
    NOISE_FACTOR_LIMIT,
    NOTED_DEPARTURE,
    consistency_checks,
    judged_by,
    normalised_innovations,
)
from rotordrop.track.smoother import PassSettings, forward, smooth
from rotordrop.twin.problems import COARSE_BASIS, drop_problem

SETTINGS = PassSettings(impulse=3e-3, share=0.03)


def checked(problem, noise_factor: float = 1.0):
    return {c.name: c for c in consistency_checks(problem, smooth(forward(problem, SETTINGS)), noise_factor)}


def test_a_right_model_passes_every_check(impacts, impacts_smoothed):
    checks = consistency_checks(impacts, impacts_smoothed, 1.0)
    assert [c.message for c in checks if not c.passed] == []
    assert {c.name for c in checks} == {
        "innovation size",
        "innovation whiteness",
        "sensor errors",
        "directions",
        "parameters",
        "unknowns of the drop",
        "remanent force",
        "process noise",
        "filter",
    }


def test_innovations_of_a_right_model_are_white_and_of_unit_size(impacts_smoothed):
    e = normalised_innovations(impacts_smoothed)
    assert e.shape == (500, 4)
    assert np.mean(e**2) == pytest.approx(1.0, abs=0.15)


def test_sensors_in_the_wrong_plane_are_seen(lp400, prepared):
    """Sensors said to sit in the bearing planes, 30 mm outboard of where they are."""
    moved = tuple(sensor.model_copy(update={"node": {5: 4, 25: 26}[sensor.node]}) for sensor in lp400.sensors)
    wrong = lp400.model_copy(update={"sensors": moved})
    further = wrong.model_copy(
        update={"sensors": tuple(s.model_copy(update={"node": {4: 2, 26: 28}[s.node]}) for s in moved)}
    )
    problem = drop_problem(build_drop_model(further, COARSE_BASIS), prepared, until=0.025)
    failed = {name for name, check in checked(problem).items() if not check.passed}
    assert failed & {"innovation size", "innovation whiteness", "sensor errors", "parameters"}


def test_red_noise_is_seen(impacts, random):
    """Noise of the same size whose neighbours are alike, as a low-pass before the sampling makes it."""
    white = random.standard_normal(impacts.readings.shape)
    red = np.zeros_like(white)
    for i in range(1, len(white)):
        red[i] = 0.8 * red[i - 1] + 0.6 * white[i]
    noisy = replace(
        impacts, readings=impacts.readings + 1.5e-6 * red, variances=impacts.variances + 1.5e-6**2
    )
    whiteness = checked(noisy)["innovation whiteness"]
    assert not whiteness.passed
    assert f"(limit {CORRELATION_LIMIT:g})" in whiteness.message
    usual = replace(
        impacts, readings=impacts.readings + 1.5e-6 * white, variances=impacts.variances + 1.5e-6**2
    )
    assert checked(usual)["innovation whiteness"].passed


def test_noise_of_another_size_than_stated_is_seen_and_named(impacts, random):
    louder = impacts.readings.copy()
    louder[:, 1] += 1.5e-6 * random.standard_normal(len(louder))
    check = checked(replace(impacts, readings=louder))["innovation size"]
    assert not check.passed
    assert "S_NDE_B" in check.message and "usual 0.6 to 1.25" in check.message
    quieter = replace(impacts, variances=4.0 * impacts.variances)
    assert not checked(quieter)["innovation size"].passed


def test_a_sensor_offset_beyond_its_prior_is_named(impacts):
    shifted = impacts.readings.copy()
    shifted[:, 3] += 120e-6
    check = checked(replace(impacts, readings=shifted))["sensor errors"]
    assert not check.passed
    assert f"(limit {DEPARTURE_LIMIT:g})" in check.message and "channel S_DE_" in check.message


def test_a_parameter_far_from_its_prior_is_named(impacts, impacts_smoothed):
    place = [u.path for u in impacts.unknowns].index("NDE.support.mass")
    means = impacts_smoothed.means.copy()
    means[:, impacts.n_dynamic + place] += 4.5 * impacts.unknowns[place].sigma
    checks = consistency_checks(impacts, replace(impacts_smoothed, means=means), 1.0)
    check = next(c for c in checks if c.name == "parameters")
    assert not check.passed
    assert check.said().startswith("NDE.support.mass departs by")


def departed(problem, smoothed, paths, by):
    """The smoothed drop with unknowns that stand so many standard deviations off their prior."""
    means = smoothed.means.copy()
    for path in paths:
        place = [u.path for u in problem.unknowns].index(path)
        means[:, problem.n_dynamic + place] = (
            problem.unknowns[place].mean + by * problem.unknowns[place].sigma
        )
    return replace(smoothed, means=means)


@pytest.mark.parametrize("by", [3.6, 3.9])
def test_one_departure_beside_white_innovations_is_a_note_that_widens(impacts, impacts_smoothed, by):
    """Contact stiffness at 3.6 and gains at 3.9 were no reason to drop an estimate whose peaks were right."""
    one = departed(impacts, impacts_smoothed, ["NDE.contact.stiffness"], by)
    checks = {c.name: c for c in consistency_checks(impacts, one, 1.0)}
    check = checks["parameters"]
    assert check.passed and f"departs by {by:.1f} prior standard deviations" in check.note
    assert check.widening == pytest.approx(1.0 + (by - DEPARTURE_LIMIT) / 0.5)
    assert all(other.widening == 1.0 for other in checks.values() if other is not check)


def test_two_departures_or_a_far_one_or_coloured_innovations_are_none(impacts, impacts_smoothed):
    for paths, by in (
        (["NDE.contact.stiffness"], NOTED_DEPARTURE),
        (["NDE.support.mass", "DE.support.mass"], 3.7),
    ):
        check = next(
            c
            for c in consistency_checks(impacts, departed(impacts, impacts_smoothed, paths, by), 1.0)
            if c.name == "parameters"
        )
        assert not check.passed and check.note == "" and check.widening == 1.0
    one = departed(impacts, impacts_smoothed, ["NDE.contact.stiffness"], 3.7)
    loud = replace(one.filtered, innovations=2.0 * one.filtered.innovations)
    checks = consistency_checks(impacts, replace(one, filtered=loud), 1.0)
    assert not next(c for c in checks if c.name == "parameters").passed


def test_a_side_force_that_stays_is_no_gain_error(impacts, impacts_smoothed):
    """A machine 3 degrees off level, and a rotor pulled aside, were flagged as sensors at fault."""
    weight = impacts.model.machine.rotor.mass * 9.81
    lasting = {"remanence.time_constant": math.log(0.46)}
    for up, passes in ((0.25 * LARGEST_LASTING_LIFT, True), (1.1 * LARGEST_LASTING_LIFT, False)):
        means = impacts_smoothed.means.copy()
        for place, unknown in enumerate(impacts.unknowns):
            if unknown.path in lasting:
                means[:, impacts.n_dynamic + place] = lasting[unknown.path]
            elif unknown.parameter.owner == "magnet":
                share = 0.05 if unknown.path.endswith(".x") else up
                means[:, impacts.n_dynamic + place] = share * weight / len(impacts.model.machine.ambs)
        smoothed = replace(impacts_smoothed, means=means)
        check = next(c for c in consistency_checks(impacts, smoothed, 1.0) if c.name == "remanent force")
        assert check.passed is passes
        assert ("the machine is not level" in check.note) is passes
        assert check.widening == pytest.approx(math.hypot(1.0, 0.25) if passes else 1.0)


def test_a_remanent_force_that_stays_is_a_gain_error_of_all_sensors(impacts, impacts_smoothed):
    """Readings times 1.2 were followed with a time constant of 1.3 s, and forces 20 % too high passed."""
    place = [u.path for u in impacts.unknowns].index("remanence.time_constant")
    means = impacts_smoothed.means.copy()
    means[:, impacts.n_dynamic + place] = math.log(1.28)
    checks = consistency_checks(impacts, replace(impacts_smoothed, means=means), 1.0)
    check = next(c for c in checks if c.name == "remanent force")
    assert not check.passed
    assert "fades in 1.28 s (limit 0.2 s)" in check.message


def test_unusual_process_noise_is_seen(impacts, impacts_smoothed):
    for factor, passes in ((0.5, True), (4.0, True), (NOISE_FACTOR_LIMIT, False)):
        checks = consistency_checks(impacts, impacts_smoothed, factor)
        assert next(c for c in checks if c.name == "process noise").passed is passes


def test_a_filter_that_gave_up_is_not_consistent(impacts, impacts_smoothed):
    lost = replace(impacts_smoothed, filtered=replace(impacts_smoothed.filtered, done=300))
    check, *others = consistency_checks(impacts, lost, 1.0)
    assert check.name == "filter" and check.failed and check.remedy
    assert check.message == "the filter followed 300 of 500 samples"
    for other in others:
        if other.name == "directions":
            assert other.passed
            continue
        assert not other.passed and not other.judged and not other.failed, other.name
        assert other.message.endswith(f"; not judged, {check.message}")


def test_departures_after_a_lost_filter_are_no_findings_but_earlier_innovations_are(
    impacts, impacts_smoothed
):
    """A mass, a gain and an unbalance far off; innovations of twice the size; noise beyond its limit."""
    means, filtered = impacts_smoothed.means.copy(), impacts_smoothed.filtered
    means[:, impacts.n_dynamic :] += 40.0 * np.sqrt(np.diag(impacts.covariance)[impacts.n_dynamic :])
    lost = replace(
        impacts_smoothed,
        means=means,
        filtered=replace(filtered, done=300, innovations=2.0 * filtered.innovations),
    )
    checks = consistency_checks(impacts, lost, NOISE_FACTOR_LIMIT)
    assert [check.name for check in checks if check.failed] == ["filter", "innovation size", "process noise"]
    assert not any(check.note for check in checks)


def test_a_remedy_names_the_sensor_and_the_value(impacts, impacts_smoothed):
    place = [u.path for u in impacts.unknowns].index("NDE.support.mass")
    for index, name, told in (
        (place, "parameters", "measure support mass of NDE,"),
        (
            len(impacts.unknowns) + 1,
            "sensor errors",
            "check sensor S_NDE_B against a known distance, or give",
        ),
        (len(impacts.unknowns) + impacts.n_channels, "sensor errors", "or give its offset a range"),
    ):
        means = impacts_smoothed.means.copy()
        means[:, impacts.n_dynamic + index] += 30.0 * math.sqrt(
            impacts.covariance[impacts.n_dynamic + index, impacts.n_dynamic + index]
        )
        checks = consistency_checks(impacts, replace(impacts_smoothed, means=means), 1.0)
        check = next(c for c in checks if c.name == name)
        assert check.failed
        assert told in check.advised({"NDE.support.mass": "support mass of NDE", "": ""}.__getitem__)


def test_a_lost_channel_is_not_judged(impacts):
    readings = impacts.readings.copy()
    readings[:, 1] = np.nan
    checks = checked(replace(impacts, readings=readings))
    for name in ("innovation size", "innovation whiteness"):
        assert "nan" not in checks[name].message
        assert "S_NDE_B" not in checks[name].message


def test_a_beam_is_judged_with_its_own_error(impacts, impacts_smoothed):
    """Innovations with the likeliest impulses, gains within what a beam bends otherwise; and it is said."""
    machine = impacts.model.machine
    beam = machine.changed(rotor=machine.rotor.changed(mass_to_ends=0.0))
    of_beam = replace(impacts, model=replace(impacts.model, machine=beam))
    usual, likeliest = impacts_smoothed.filtered, replace(impacts_smoothed.filtered, done=499)
    assert judged_by(impacts, likeliest, usual) is usual
    assert judged_by(of_beam, likeliest, usual) is likeliest
    means = impacts_smoothed.means.copy()
    means[:, impacts.n_dynamic + len(impacts.unknowns)] += 0.05  # the gain of the first channel
    passed = {}
    for problem in (impacts, of_beam):
        checks = {c.name: c for c in consistency_checks(problem, replace(impacts_smoothed, means=means), 4.1)}
        passed[problem is of_beam] = checks["sensor errors"].passed
        assert ("4.1 × its usual size" in checks["process noise"].note) is (problem is of_beam)
    assert passed == {False: False, True: True}
