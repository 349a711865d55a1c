"""Numbers that one part finds and another writes: none is lost, doubled or taken for another on the way."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop import Known, build_drop_model, example_machine
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.table import parameter
from rotordrop.estimate import coast_down
from rotordrop.estimate.bearing_drop import Motion, deepest
from rotordrop.estimate.bearing_values import equivalent_stiffness
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.twin.calibrated import CONFOUNDED, confounded_of, values_of
from rotordrop.twin.tracked_estimate import RESOLVED, later_motion
from rotordrop.twin.tracked_parameters import (
    determination,
    parameter_widening,
    prior_of,
    sensor_errors,
    within_bounds,
)

NINETY = 1.6448536269514722
SENSORS = 4
SIGNS = (1, -1, 1, 1)


@pytest.fixture(scope="module")
def problem():
    """The unknowns of a machine, behind five entries of the motion and before gains and offsets.

    Its second sensor is inverted, and every zero is stated.
    """
    machine = example_machine("lp400")
    one, inverted, *others = machine.sensors
    machine = machine.changed(sensors=(one, inverted.changed(polarity=-1), *others))
    zeros = {f"sensors.{sensor.name}.offset": 10e-6 for sensor in machine.sensors}
    model = build_drop_model(machine.with_values(zeros), "quick")
    unknowns = all_unknowns(model)
    first = 5 + len(unknowns)
    return SimpleNamespace(
        parameter_slice=slice(5, first),
        model=model,
        unknowns=unknowns,
        n_dynamic=5,
        n_channels=SENSORS,
        variances=np.array([1.0, 4.0, 9.0, 16.0]) * 1e-14,
        sensor_errors=lambda entries: (
            entries[first : first + SENSORS],
            entries[first + SENSORS : first + 2 * SENSORS],
        ),
    )


def test_the_first_contact_is_as_deep_as_the_motion_in_its_time():
    time = np.arange(0.0, 0.1, 1e-3)
    path = np.zeros((100, 2))
    path[:, 1] = -250e-6
    path[5], path[21], path[60] = (-400e-6, 0.0), (180e-6, -240e-6), (0.0, -500e-6)
    motion = Motion(label="estimated", time=time, displacement=path)
    found = deepest(motion, 0.02, 0.03, 280e-6)
    assert found.indentation == pytest.approx(20e-6)
    assert (found.start, found.end) == (0.02, 0.03)


def test_the_rest_of_a_record_is_compared_where_it_has_readings():
    time = np.arange(-0.01, 0.4, 1e-3)
    motion = np.zeros((len(time), 3, 2))
    motion[:, :, 1] = -100e-6
    early, late = np.searchsorted(time, 0.05), np.searchsorted(time, 0.30)
    motion[2, :, 1] = -900e-6  # levitated still: not in the drop
    motion[early, :, 0], motion[early, :, 1] = 240e-6, -180e-6
    motion[late, :, 1] = -330e-6
    motion[time > 0.2, 1] = np.nan  # its sensors fall silent
    motion[time <= 0.2, 2] = np.nan
    (found,) = later_motion(("NDE", "DE", "MID"), time, motion, 0.2, 1e-6)
    assert (found.bearing, found.resolved) == ("NDE", RESOLVED * 1e-6)
    assert (found.first, found.later) == pytest.approx((300e-6, 330e-6))
    assert (found.first_time, found.later_time) == pytest.approx((time[early], time[late]))
    assert found.larger
    assert not later_motion(("NDE", "DE", "MID"), time, motion, 0.2, 10e-6)[0].larger


def test_gaps_end_at_zero_and_widening_at_the_prior(problem):
    gap, mass = parameter("air_gap"), parameter("support.mass")
    for interval, inside in (((-3e-6, -1e-6), (0, 0)), ((-1e-6, 5e-6), (0, 5e-6)), ((2e-6, 5e-6),) * 2):
        assert within_bounds(gap, interval) == inside
        assert within_bounds(mass, interval) == interval
    for unknown in problem.unknowns:
        for share, factor in ((0.1, 2.0), (0.8, 1.25), (1.0, 1.0), (1.5, 1.0), (0.0, 2.0)):
            found = parameter_widening(unknown, share * unknown.sigma, 2.0)
            assert found == pytest.approx(factor), (unknown.path, share)
            assert parameter_widening(unknown, share * unknown.sigma, 1.0) == 1.0


def test_sensor_errors_are_those_at_the_end_of_the_drop(problem):
    size = problem.n_dynamic + len(problem.unknowns) + 2 * SENSORS
    first = size - 2 * SENSORS
    dice = np.random.default_rng(3)
    means, sigma = dice.normal(size=(3, size)), dice.uniform(0.01, 0.5, size)
    smoothed: Any = SimpleNamespace(means=means, covariance=lambda at: np.diag((1 + 2 - at) * sigma**2))
    for widening in (1.0, 2.0):
        found = sensor_errors(problem, smoothed, fits=True, widening=widening)
        assert [one.sensor for one in found] == [s.name for s in problem.model.machine.sensors]
        for c, one in enumerate(found):
            assert one.noise == pytest.approx((c + 1) * 1e-7)
            for at, value, sign in (
                (first + c, one.gain_error, 1),
                (first + SENSORS + c, one.offset, SIGNS[c]),
            ):
                middle, half = sign * means[2, at], NINETY * widening * sigma[at]
                assert value.value == middle
                assert value.standard_error == pytest.approx(widening * sigma[at])
                assert value.interval_90 == pytest.approx((middle - half, middle + half), rel=1e-12)


@pytest.mark.parametrize("done", [3, 2])
def test_a_sensor_that_the_model_does_not_fit_is_as_its_prior_allows(problem, done):
    size = problem.n_dynamic + len(problem.unknowns) + 2 * SENSORS
    dice = np.random.default_rng(5)
    prior, prior_sigma = dice.normal(size=size), dice.uniform(0.01, 0.5, size)
    means, sigma = prior + dice.normal(size=(done, size)), 0.1 * prior_sigma
    smoothed: Any = SimpleNamespace(
        means=means,
        covariance=lambda at: np.diag(sigma**2),
        filtered=SimpleNamespace(done=done, means=np.zeros((3, size))),
    )
    known = SimpleNamespace(**vars(problem), mean=prior, covariance=np.diag(prior_sigma**2))
    found = sensor_errors(known, smoothed, fits=False, widening=2.0)
    first = size - 2 * SENSORS
    for c, one in enumerate(found):
        for at, value, sign in ((first + c, one.gain_error, 1), (first + SENSORS + c, one.offset, SIGNS[c])):
            form = problem.model.machine.rotor.gain_sigma if value is one.gain_error else 0.0
            half = NINETY * math.hypot(prior_sigma[at], form)
            low, high = sign * prior[at] - half, sign * prior[at] + half
            if done == 3:
                assert value.status == "the model does not fit the record"
                assert value.value == sign * means[-1, at]
                low = min(low, sign * means[-1, at] - 2.0 * NINETY * sigma[at])
                high = max(high, sign * means[-1, at] + 2.0 * NINETY * sigma[at])
            else:
                assert value.status == "the record does not determine it"
                assert value.value == sign * prior[at]
            assert value.interval_90 == pytest.approx((low, high))


def test_a_stated_zero_of_an_inverted_sensor_counts_in_its_positive_direction(problem):
    size = problem.n_dynamic + len(problem.unknowns) + 2 * SENSORS
    before = prior_of(SimpleNamespace(**vars(problem), mean=np.zeros(size), covariance=np.eye(size)))
    assert before[0][-SENSORS:].tolist() == [10e-6 * sign for sign in SIGNS]


def test_a_calibrated_gain_undoes_the_error_of_the_sensor():
    """A sensor that reads (1 + g) times the motion needs the gain 1 / (1 + g); its error by differences."""
    names = ("A", "B")
    signs = {"A": 1, "B": -1}
    machine = SimpleNamespace(sensors=tuple(SimpleNamespace(name=n, polarity=signs[n]) for n in names))
    only: Any = SimpleNamespace(
        unknowns=(),
        n_dynamic=3,
        n_channels=2,
        model=SimpleNamespace(machine=machine),
        parameter_slice=slice(3, 3),
    )
    errors, offsets = np.array([0.1, -0.2]), np.array([3e-6, -4e-6])
    sigma = np.array([1.0, 1.0, 1.0, 0.02, 0.01, 1e-6, 2e-6])
    mean = np.concatenate([np.zeros(3), errors, offsets])
    found = values_of(only, mean, np.diag(sigma**2), 1.5)
    for c, name in enumerate(names):
        gain, offset = found[f"sensors.{name}.gain"], found[f"sensors.{name}.offset"]
        assert gain.value * (1.0 + errors[c]) == pytest.approx(1.0)
        step = 1e-4
        slope = (1.0 / (1.0 + errors[c] - step) - 1.0 / (1.0 + errors[c] + step)) / (2.0 * step)
        assert gain.standard_error == pytest.approx(1.5 * slope * sigma[3 + c], rel=1e-6)
        assert (offset.value, offset.standard_error) == (
            signs[name] * offsets[c],
            pytest.approx(1.5 * sigma[5 + c]),
        )
        for value in (gain, offset):
            low, high = value.interval_90 or (math.nan, math.nan)
            assert high - value.value == pytest.approx(value.value - low)
            assert high - low == pytest.approx(2.0 * NINETY * (value.standard_error or math.nan))


def test_what_is_called_confounded_is_what_correlates(problem):
    first, unknowns = problem.n_dynamic, problem.unknowns
    sensors = problem.model.machine.sensors
    offset = first + len(unknowns) + problem.n_channels
    sigma = np.geomspace(0.01, 3.0, offset + problem.n_channels)
    correlation = np.eye(len(sigma))
    pairs = {(first, first + 3): -0.95, (first + 1, offset): 0.92, (first + 2, first + 4): 0.6}
    for (i, j), value in pairs.items():
        correlation[i, j] = correlation[j, i] = value
    found = confounded_of(problem, correlation * np.outer(sigma, sigma))
    assert [(pair.first, pair.second) for pair in found] == [
        (unknowns[0].path, unknowns[3].path),
        (unknowns[1].path, f"sensors.{sensors[0].name}.offset"),
    ]
    assert [pair.correlation for pair in found] == pytest.approx([-0.95, 0.92])
    assert all(abs(pair.correlation) > CONFOUNDED and pair.separated_by for pair in found)


def test_a_simulated_coast_down_is_seen_where_the_sensors_are(monkeypatch):
    machine = example_machine("lp400")
    nodes = {sensor.bearing: f"node {sensor.node}" for sensor in machine.sensors}
    assert set(nodes) == {"NDE", "DE"}
    planes = {name: name for name in (*nodes, *nodes.values())}
    samples: Any = SimpleNamespace(
        planes=planes,
        air_gap={"NDE": 1e-4, "DE": 2e-4},
        speed=np.linspace(300.0, 200.0, 5000),
        sampling_rate=1e3,
    )
    result: Any = SimpleNamespace(standstill_time=None, maxima=tuple)
    monkeypatch.setattr(coast_down, "load_coast_down", lambda path: result)
    monkeypatch.setattr(coast_down, "open_samples", lambda path: samples)
    seen = coast_down.simulated_coast_down(Path("c.h5"), machine)
    assert dict(seen.planes) == nodes and seen.air_gap == samples.air_gap
    assert dict(coast_down.simulated_coast_down(Path("c.h5")).planes) == {n: n for n in nodes}
    del planes[nodes["DE"]]
    assert set(coast_down.simulated_coast_down(Path("c.h5"), machine).planes) == set(nodes)
    assert seen.profile.speed_at([0.0])[0] == pytest.approx(300.0) and not seen.recorded


def test_the_equivalent_stiffness_is_as_unsure_as_what_holds_the_balls():
    machine = example_machine("lp400")
    support = Known(value=80e6, status="determined", interval_90=(78e6, 82e6), unit="N/m")
    preload = Known(value=700.0, status="determined", interval_90=(500.0, 900.0), unit="N")
    found = equivalent_stiffness(machine, 0, 300.0, support, preload)

    def series(held, stiffness):
        name = machine.touchdown_bearings[0].name
        bearing = machine.with_values({f"{name}.preload": held}).touchdown_bearings[0]
        races = numbers_of(bearing).tangent_stiffness(300.0)
        return 1.0 / (1.0 / races + 1.0 / stiffness)

    value = series(700.0, 80e6)
    low = value - math.hypot(value - series(500.0, 80e6), value - series(700.0, 78e6))
    high = value + math.hypot(series(900.0, 80e6) - value, series(700.0, 82e6) - value)
    assert found.value == pytest.approx(value, rel=1e-12)
    assert found.interval_90 == pytest.approx((low, high), rel=1e-12)
    assert high - low > 1.1 * (series(700.0, 82e6) - series(700.0, 78e6))


def test_the_verdict_on_a_parameter_goes_by_how_much_of_its_prior_is_left():
    shares = (0.0, 0.29, 0.31, 0.69, 0.71, 1.0)
    said = [determination(share) for share in shares]
    assert said[:2] == ["determined"] * 2
    assert said[2:4] == ["weakly determined"] * 2
    assert said[4:] == ["the record does not determine it"] * 2
    assert determination(0.9, calibrated=True) == "known from the calibration"
    assert determination(0.5, calibrated=True) == "weakly determined"
