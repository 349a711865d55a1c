"""Statistics of a stress history: named rules, time weights, outliers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from rotordrop.errors import UsageError
from rotordrop.severity.statistics import stress_statistics

NUMBERS = st.lists(st.floats(-1e9, 1e9), min_size=2, max_size=60)


@given(NUMBERS)
def test_linear_quartiles_are_those_of_numpy(values):
    found = stress_statistics(values, rule="linear")
    expected = np.quantile(values, [0.25, 0.5, 0.75])
    assert [found.lower_quartile, found.median, found.upper_quartile] == pytest.approx(expected, abs=1e-3)


@given(NUMBERS)
def test_hazen_quartiles_are_those_of_numpys_hazen(values):
    found = stress_statistics(values, rule="hazen")
    expected = np.quantile(values, [0.25, 0.5, 0.75], method="hazen")
    assert [found.lower_quartile, found.median, found.upper_quartile] == pytest.approx(expected, abs=1e-3)


@given(st.lists(st.floats(-1e9, 1e9), min_size=3, max_size=60))
def test_mean_over_time_is_that_of_the_trapezoidal_rule(values):
    time = np.cumsum(np.linspace(1.0, 2.0, len(values)))
    expected = trapezoid(values, time) / (time[-1] - time[0])
    assert stress_statistics(values, time=time).mean == pytest.approx(expected, abs=1e-3)


def test_time_weights_undo_uneven_sampling():
    """A ramp sampled densely in its upper half has its mean in the middle only when weighted by time."""
    time = np.concatenate([np.linspace(0.0, 0.5, 51)[:-1], np.linspace(0.5, 1.0, 5001)])
    assert stress_statistics(time).mean > 0.74
    weighted = stress_statistics(time, time=time)
    assert weighted.mean == pytest.approx(0.5, abs=1e-4)
    assert weighted.median == pytest.approx(0.5, abs=5e-3)
    assert weighted.standard_deviation == pytest.approx(1.0 / np.sqrt(12.0), rel=1e-3)


def test_whiskers_reach_the_last_value_within_the_fence():
    values = [*range(1, 11), 100.0]
    found = stress_statistics(values)
    assert (found.lower_whisker, found.upper_whisker, found.beyond_whiskers) == (1.0, 10.0, 1)
    assert found.above_three_sigma == 0
    assert found.three_sigma_limit == pytest.approx(100.002597, abs=1e-6)


def test_rules_are_named():
    text = stress_statistics([1.0, 2.0, 3.0]).rules()
    assert "Hazen" in text and "3 standard deviations" in text and "1.5 interquartile" in text


def test_preload_share():
    assert stress_statistics([1.0e9, 1.2e9], preload_stress=0.99e9).preload_share == pytest.approx(0.9)


def test_unknown_rule_and_bad_values_are_refused():
    with pytest.raises(UsageError, match="'tukey' is unknown; choose one of hazen, linear"):
        stress_statistics([1.0, 2.0], rule="tukey")
    with pytest.raises(UsageError, match="3 values, 1 of them not finite"):
        stress_statistics([1.0, np.nan, 2.0])
    with pytest.raises(UsageError, match=r"time does not rise after 0\.1 s"):
        stress_statistics([1.0, 2.0, 3.0], time=[0.0, 0.1, 0.1])
