"""Severity: static safety by ISO 76, statistics of a stress history, and which drop was worst."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import trapezoid
from scipy.special import ndtr

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.catalog.inference import dynamic_rating
from rotordrop.errors import UsageError
from rotordrop.estimate.bearing_values import static_safety_of_stress
from rotordrop.machine import example_machine
from rotordrop.severity.fatigue import LIFE, ball_row, fatigue_share, share_by_16281
from rotordrop.severity.numbers import SEVERITY
from rotordrop.severity.ranking import DropSeverity, rank_drops, worst_probability
from rotordrop.severity.statistics import stress_statistics


@pytest.fixture(scope="module")
def numbers():
    return numbers_of(example_machine("paper").touchdown_bearings[0])


def test_ratings_follow_from_balls_and_stresses(numbers):
    assert static_safety_of_stress(4.2e9) == 1.0
    assert static_safety_of_stress(2.1e9) == pytest.approx(8.0)
    found = numbers.ratings()
    assert found.rows == 2 and found.balls == 23
    assert found.static / 2 == pytest.approx(30.9e3, rel=0.01)
    assert found.dynamic == pytest.approx(31.6e3, rel=0.01)
    given = {"NDE.bearing.static_load_rating": 32e3, "NDE.bearing.dynamic_load_rating": 33e3}
    bearing = example_machine("paper").with_values(given).touchdown_bearings[0]
    assert numbers_of(bearing).ratings().static == 64e3
    assert numbers_of(bearing).ratings().dynamic == 33e3


STANDARD = {
    **{f"{part}_youngs_modulus": 207e9 for part in ("ball", "ring")},
    **{f"{part}_poisson_ratio": 0.3 for part in ("ball", "ring")},
    **{f"conformity_{ring}": 0.52 for ring in ("inner", "outer")},
    "preload": 20.0,
}


def test_both_safeties_agree_for_steel_balls_in_the_grooves_of_the_standard():
    """At a radial load of C0 the most loaded ball of the standard has 4 200 MPa.

    The standard puts 5/Z of the load on it, a bearing without play 4.37/Z (Stribeck 1901), hence the ratio.
    Ceramic balls in wider grooves press harder.
    """
    found = []
    for values in (STANDARD, {}):
        machine = example_machine("paper").with_values({f"NDE.bearing.{k}": v for k, v in values.items()})
        numbers = numbers_of(machine.touchdown_bearings[0])
        loads = numbers.element_loads_under(np.array([[0.0, numbers.ratings().static]]))
        stress = numbers.constants.stress_coefficient_inner * loads.max() ** (1.0 / 3.0)
        found.append(static_safety_of_stress(float(stress)))
    assert found[0] == pytest.approx(5.0 / 4.37, abs=0.06)
    assert found[1] < 0.7


def test_a_life_is_hardly_used_and_every_number_has_its_field(numbers):
    time = np.linspace(0.0, 0.2, 2001)
    force = np.stack([np.zeros(2001), 4000.0 * np.abs(np.sin(60.0 * time))], axis=1)
    spin = np.where(time > 0.01, 2.0 * np.pi * 60.0, 0.0)
    loads = numbers.element_loads_under(force)
    assert 0.0 < fatigue_share(numbers.ratings(), time, loads, spin) < 1e-5
    assert len({one.field for one in SEVERITY}) == len(SEVERITY)
    less = [one.field for one in SEVERITY if not one.more_is_worse]
    assert less == ["severity.static_safety", "severity.static_safety_of_rating"]


BALLS, DIAMETER, PITCH = 16, 10e-3, 70e-3
C = dynamic_rating(BALLS, DIAMETER, PITCH, 0.0)
ROW = ball_row(C, BALLS, DIAMETER / PITCH, 1.0, 0.52, 0.52)
SPIN = 2.0 * np.pi * 50.0


def zone(radial, count=BALLS, balls=BALLS):
    """Ball loads of a radial load without clearance: Q cos^1.5, whose sum along the load is the load."""
    at = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    shape = np.maximum(np.cos(at), 0.0) ** 1.5
    return radial * (count / balls) / np.sum(shape * np.cos(at)) * shape


def steady(radial, turns, points=4000, **told):
    time = np.linspace(0.0, turns * 2.0 * np.pi / SPIN, points)
    return time, np.tile(zone(radial, **told), (points, 1)), np.full(points, SPIN)


def test_the_rating_load_lasts_a_million_turns():
    """C is by definition the radial load of that life (ISO 281); 0.407 and 0.389 come from its load zone."""
    share = share_by_16281(ROW, *steady(C, 20.0))
    assert share == pytest.approx(20.0 / LIFE, rel=5e-3)


@pytest.mark.parametrize(("balls", "ratio"), [(8, 0.24), (9, 0.2), (16, 0.12)])
def test_at_a_tenth_of_the_rating_life_is_a_thousand_times_longer(balls, ratio):
    """The load zone of a bearing without play, by ISO/TS 16281, against the rating life by ISO 281."""
    dynamic = dynamic_rating(balls, 10e-3, 10e-3 / ratio, 0.0)
    row = ball_row(dynamic, balls, ratio, 1.0, 0.52, 0.52)
    share = share_by_16281(row, *steady(0.1 * dynamic, 1.0, points=2, count=360, balls=balls))
    assert share == pytest.approx(1e-3 / LIFE, rel=5e-3)


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        ([5.0, 4.0], [0.6, 0.8], [ndtr(1.0), 1.0 - ndtr(1.0)]),  # the normal difference, with 1 as its error
        ([3.0] * 5, [0.2] * 5, [0.2] * 5),
        ([2.0, 1.0], [0.0, 0.0], [1.0, 0.0]),
    ],
)
def test_probabilities_that_are_known(value, error, expected):
    assert worst_probability(np.array(value), np.array(error)) == pytest.approx(expected, abs=1e-9)


def test_probabilities_match_random_draws():
    value, error = np.array([4.9, 4.6, 4.7, 3.0]), np.array([0.3, 0.5, 0.05, 0.4])
    draws = np.random.default_rng(3).normal(value, error, (400_000, 4)).argmax(axis=1)
    assert worst_probability(value, error) == pytest.approx(np.bincount(draws, minlength=4) / 4e5, abs=3e-3)


def test_doubt_of_scatter_or_of_the_condition_is_said():
    """The paper's peaks: 4889 N at 60 Hz; equal drops scatter by several hundred newtons."""
    drops = [
        DropSeverity(name="100 Hz", value=4300.0, standard_error=60.0),
        DropSeverity(name="60 Hz", value=4889.0, standard_error=60.0),
    ]
    found = rank_drops(drops, drop_scatter=600.0)
    assert found.names == ("60 Hz", "100 Hz")
    assert found.worst_drop[0] > 0.999
    assert 0.6 < found.worst_condition[0] < 0.85
    ends = (("a", 2.0, (1.9, 2.1)), ("b", 1.0, (0.9, 1.1)))
    found = rank_drops([DropSeverity.from_interval(*one) for one in ends])
    assert found.worst_condition is None


NUMBERS = st.lists(st.floats(-1e9, 1e9), min_size=2, max_size=60)


@pytest.mark.parametrize("rule", ["linear", "hazen"])
@given(NUMBERS)
def test_quartiles_are_those_of_numpy(rule, values):
    found = stress_statistics(values, rule=rule)
    expected = np.quantile(values, [0.25, 0.5, 0.75], method=rule)
    assert [found.lower_quartile, found.median, found.upper_quartile] == pytest.approx(expected, abs=1e-3)


@given(st.lists(st.floats(-1e9, 1e9), min_size=3, max_size=60))
def test_mean_over_time_is_that_of_the_trapezoidal_rule(values):
    time = np.cumsum(np.linspace(1.0, 2.0, len(values)))
    expected = trapezoid(values, time) / (time[-1] - time[0])
    assert stress_statistics(values, time=time).mean == pytest.approx(expected, abs=1e-3)


def test_time_weights_undo_uneven_sampling_and_whiskers_stay_within():
    """A ramp sampled densely in its upper half has its mean in the middle only when weighted by time."""
    time = np.concatenate([np.linspace(0.0, 0.5, 51)[:-1], np.linspace(0.5, 1.0, 5001)])
    assert stress_statistics(time).mean > 0.74
    weighted = stress_statistics(time, time=time)
    assert weighted.mean == pytest.approx(0.5, abs=1e-4)
    assert weighted.median == pytest.approx(0.5, abs=5e-3)
    assert weighted.standard_deviation == pytest.approx(1.0 / np.sqrt(12.0), rel=1e-3)
    found = stress_statistics([*range(1, 11), 100.0], preload_stress=11.0)
    assert (found.lower_whisker, found.upper_whisker, found.beyond_whiskers) == (1.0, 10.0, 1)
    assert found.above_three_sigma == 0
    assert found.three_sigma_limit == pytest.approx(100.002597, abs=1e-6)
    assert found.preload_share == pytest.approx(11.0 / np.mean([*range(1, 11), 100.0]))


@pytest.mark.parametrize(
    ("values", "told", "message"),
    [
        ([1.0, 2.0], {"rule": "tukey"}, "'tukey' is unknown; choose one of hazen, linear"),
        ([1.0, np.nan, 2.0], {}, "3 values, 1 of them not finite"),
        ([1.0, 2.0, 3.0], {"time": [0.0, 0.1, 0.1]}, r"time does not rise after 0\.1 s"),
    ],
)
def test_unknown_rule_and_bad_values_are_refused(values, told, message):
    with pytest.raises(UsageError, match=message):
        stress_statistics(values, **told)
