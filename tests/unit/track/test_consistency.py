"""Checks that decide whether intervals hold: what they see, and that they do not see what is not there."""

import math
import re
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
    normalised_innovations,
    reference_pass,
)
from rotordrop.track.smoother import PassSettings, forward, smooth
from rotordrop.twin.problems import COARSE_BASIS, drop_problem

SETTINGS = PassSettings(impulse=3e-3, share=0.03)


def checks_of(problem, smoothed, noise_factor=1.0):
    return {c.name: c for c in consistency_checks(problem, smoothed, noise_factor)}


def checked(problem):
    return checks_of(problem, smooth(forward(problem, SETTINGS)))


def moved(problem, smoothed, values):
    """The smoothed drop with other means of unknowns, by their paths."""
    means = smoothed.means.copy()
    for k, unknown in enumerate(problem.unknowns):
        if unknown.path in values:
            means[:, problem.n_dynamic + k] = values[unknown.path]
    return replace(smoothed, means=means)


def departed(problem, smoothed, paths, by):
    """The smoothed drop with unknowns that stand so many standard deviations off their prior."""
    off = {u.path: u.mean + by * u.sigma for u in problem.unknowns if u.path in paths}
    return moved(problem, smoothed, off)


def test_a_right_model_passes_every_check(impacts, impacts_smoothed):
    checks = checks_of(impacts, impacts_smoothed)
    assert [c.message for c in checks.values() if not c.passed] == []
    assert set(checks) == {
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
    e = normalised_innovations(impacts_smoothed)
    assert e.shape == (500, 4)
    assert np.mean(e**2) == pytest.approx(1.0, abs=0.15)


def test_what_the_sensors_or_impulses_do_wrong_is_named(lp400, prepared, impacts, impacts_smoothed):
    moved = tuple(sensor.model_copy(update={"node": {5: 2, 25: 28}[sensor.node]}) for sensor in lp400.sensors)
    further = lp400.model_copy(update={"sensors": moved})
    problem = drop_problem(build_drop_model(further, COARSE_BASIS), prepared, until=0.025)
    failed = {name for name, check in checked(problem).items() if not check.passed}
    assert failed & {"innovation size", "innovation whiteness", "sensor errors", "parameters"}
    shifted = impacts.readings.copy()
    shifted[:, 3] += 120e-6
    check = checked(replace(impacts, readings=shifted))["sensor errors"]
    assert not check.passed
    assert f"(limit {DEPARTURE_LIMIT:g})" in check.message and "channel S_DE_" in check.message
    for factor, passes in ((0.5, True), (4.0, True), (NOISE_FACTOR_LIMIT, False)):
        assert checks_of(impacts, impacts_smoothed, factor)["process noise"].passed is passes


@pytest.mark.parametrize("channel", [0, 3])
def test_red_noise_is_seen_and_its_channel_named(impacts, random, channel):
    """Noise of the same size whose neighbours are alike, as a low-pass before the sampling makes it."""
    white = random.standard_normal(impacts.readings.shape)
    red = np.zeros_like(white)
    for i in range(1, len(white)):
        red[i] = 0.8 * red[i - 1] + 0.6 * white[i]
    red[:, np.arange(4) != channel] = white[:, np.arange(4) != channel]
    noisy, usual = (
        checked(
            replace(impacts, readings=impacts.readings + 1.5e-6 * e, variances=impacts.variances + 1.5e-6**2)
        )["innovation whiteness"]
        for e in (red, white)
    )
    assert usual.passed and not noisy.passed
    name = impacts.model.machine.sensors[channel].name
    assert re.search(rf"channel {name} correlate by .*limit {CORRELATION_LIMIT:g}", noisy.message)


def test_noise_of_another_size_than_stated_is_seen_and_named(impacts, random):
    louder = impacts.readings.copy()
    louder[:, 1] += 1.5e-6 * random.standard_normal(len(louder))
    check = checked(replace(impacts, readings=louder))["innovation size"]
    assert not check.passed
    assert "S_NDE_B" in check.message and "usual 0.6 to 1.25" in check.message
    quieter = replace(impacts, variances=4.0 * impacts.variances)
    assert not checked(quieter)["innovation size"].passed


@pytest.mark.parametrize("by", [3.6, 4.4])
def test_one_departure_beside_white_innovations_is_a_note_that_widens(impacts, impacts_smoothed, by):
    checks = checks_of(impacts, departed(impacts, impacts_smoothed, ["NDE.contact.stiffness"], by))
    check = checks["parameters"]
    assert check.passed and f"departs by {by:.1f} prior standard deviations" in check.note
    assert check.widening == pytest.approx(1.0 + 2.0 * (by - DEPARTURE_LIMIT))
    assert all(other.widening == 1.0 for other in checks.values() if other is not check)


@pytest.mark.parametrize(
    ("paths", "by", "louder"),
    [
        (["NDE.support.mass"], 5.5, 1.0),
        (["NDE.contact.stiffness"], NOTED_DEPARTURE + 1e-6, 1.0),
        (["NDE.support.mass", "DE.support.mass"], 3.7, 1.0),
        (["NDE.contact.stiffness"], 3.7, 2.0),
    ],
    ids=["far", "at the limit", "two", "beside coloured innovations"],
)
def test_departures_that_are_no_note_fail_and_are_named(impacts, impacts_smoothed, paths, by, louder):
    one = departed(impacts, impacts_smoothed, paths, by)
    loud = replace(one.filtered, innovations=louder * one.filtered.innovations)
    check = checks_of(impacts, replace(one, filtered=loud))["parameters"]
    assert not check.passed and check.note == ""
    assert check.widening == pytest.approx(1.0 + 2.0 * (min(by, NOTED_DEPARTURE) - DEPARTURE_LIMIT))
    assert check.said().startswith(f"{paths[0]} departs by")


@pytest.mark.parametrize(("louder", "passes"), [(1.0, True), (2.0, False)])
def test_what_is_unusual_in_one_drop_is_a_note_while_its_innovations_are_white(
    impacts, impacts_smoothed, louder, passes
):
    one = departed(impacts, impacts_smoothed, ["unbalance.1.sine"], 9.0)
    loud = replace(one.filtered, innovations=louder * one.filtered.innovations)
    check = checks_of(impacts, replace(one, filtered=loud))["unknowns of the drop"]
    assert (check.passed, bool(check.note), check.path) == (passes, passes, "unbalance.1.sine")
    assert check.message.startswith("departs by 9.0 prior standard deviations") and check.widening == 1.0


@pytest.mark.parametrize(("up", "passes"), [(0.25, True), (1.1, False)])
def test_a_side_force_that_stays_is_no_gain_error(impacts, impacts_smoothed, up, passes):
    """As of a machine 3 degrees off level, or of a rotor pulled aside."""
    share = impacts.model.machine.rotor.mass * 9.81 / len(impacts.model.machine.ambs)
    magnets = [one.path for one in impacts.unknowns if one.parameter.owner == "magnet"]
    lifts = {path: share * (0.05 if path.endswith(".x") else up * LARGEST_LASTING_LIFT) for path in magnets}
    smoothed = moved(impacts, impacts_smoothed, lifts | {"remanence.time_constant": math.log(0.46)})
    check = checks_of(impacts, smoothed)["remanent force"]
    assert check.passed is passes
    assert ("the machine is not level" in check.note) is passes
    assert check.widening == pytest.approx(math.hypot(1.0, 0.25) if passes else 1.0)


def test_a_remanent_force_that_stays_is_a_gain_error_of_all_sensors(impacts, impacts_smoothed):
    smoothed = moved(impacts, impacts_smoothed, {"remanence.time_constant": math.log(1.28)})
    check = checks_of(impacts, smoothed)["remanent force"]
    assert not check.passed
    assert "fades in 1.28 s (limit 0.2 s)" in check.message


def test_filters_that_gave_up_are_not_consistent(impacts, impacts_smoothed):
    lost = replace(impacts_smoothed, filtered=replace(impacts_smoothed.filtered, done=300))
    check, *others = checks_of(impacts, lost).values()
    assert check.name == "filter" and check.failed and check.remedy
    assert check.message == "the filter followed 300 of 500 samples"
    for other in others:
        if other.name == "directions":
            assert other.passed
            continue
        assert not other.passed and not other.judged and not other.failed, other.name
        assert other.message.endswith(f"; not judged, {check.message}")
    means, filtered = impacts_smoothed.means.copy(), impacts_smoothed.filtered
    means[:, impacts.n_dynamic :] += 40.0 * np.sqrt(np.diag(impacts.covariance)[impacts.n_dynamic :])
    filtered = replace(filtered, done=300, innovations=2.0 * filtered.innovations)
    checks = checks_of(
        impacts, replace(impacts_smoothed, means=means, filtered=filtered), NOISE_FACTOR_LIMIT
    ).values()
    assert [check.name for check in checks if check.failed] == ["filter", "innovation size", "process noise"]
    assert not any(check.note for check in checks)


@pytest.mark.parametrize(
    ("kind", "name", "told"),
    [
        ("mass", "parameters", "measure support mass of NDE,"),
        ("gain", "sensor errors", "check sensor S_NDE_B against a known distance, or give"),
        ("offset", "sensor errors", "or give its offset a range"),
    ],
)
def test_a_remedy_names_the_sensor_and_the_value(impacts, impacts_smoothed, kind, name, told):
    first = len(impacts.unknowns)
    mass = [u.path for u in impacts.unknowns].index("NDE.support.mass")
    index = {"mass": mass, "gain": first + 1, "offset": first + impacts.n_channels}[kind]
    place = impacts.n_dynamic + index
    means = impacts_smoothed.means.copy()
    means[:, place] += 30.0 * math.sqrt(impacts.covariance[place, place])
    check = checks_of(impacts, replace(impacts_smoothed, means=means))[name]
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
    machine = impacts.model.machine
    beam = machine.changed(rotor=machine.rotor.changed(mass_to_ends=0.0))
    of_beam = replace(impacts, model=replace(impacts.model, machine=beam))
    usual, likeliest = impacts_smoothed.filtered, replace(impacts_smoothed.filtered, done=499)
    assert reference_pass(impacts, likeliest, usual) is usual
    assert reference_pass(of_beam, likeliest, usual) is likeliest
    means = impacts_smoothed.means.copy()
    means[:, impacts.n_dynamic + len(impacts.unknowns)] += 0.06  # the gain of the first channel
    for problem, passes in ((impacts, False), (of_beam, True)):
        checks = checks_of(problem, replace(impacts_smoothed, means=means), 4.1)
        assert checks["sensor errors"].passed is passes
        assert ("4.1 × its usual size" in checks["process noise"].note) is passes
