"""Which drop was worst: probabilities that are probabilities, and an answer that admits doubt."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr

from rotordrop.errors import UsageError
from rotordrop.severity.ranking import DropSeverity, rank_drops, worst_probability


def test_two_drops_follow_the_normal_difference():
    found = worst_probability(np.array([5.0, 4.0]), np.array([0.6, 0.8]))
    assert found[0] == pytest.approx(ndtr(1.0 / math.hypot(0.6, 0.8)), abs=1e-9)


def test_equal_drops_are_equally_likely():
    found = worst_probability(np.full(5, 3.0), np.full(5, 0.2))
    assert found == pytest.approx(np.full(5, 0.2), abs=1e-9)


def test_probabilities_match_random_draws():
    value, error = np.array([4.9, 4.6, 4.7, 3.0]), np.array([0.3, 0.5, 0.05, 0.4])
    draws = np.random.default_rng(3).normal(value, error, (400_000, 4)).argmax(axis=1)
    assert worst_probability(value, error) == pytest.approx(np.bincount(draws, minlength=4) / 4e5, abs=3e-3)


def test_a_drop_without_error_is_handled():
    assert worst_probability(np.array([2.0, 1.0]), np.zeros(2)) == pytest.approx([1.0, 0.0])


def test_sure_drop_but_unsure_condition():
    """The paper's peaks: 4889 N at 60 Hz; equal drops scatter by several hundred newtons."""
    drops = [
        DropSeverity(name="100 Hz", value=4300.0, standard_error=60.0),
        DropSeverity(name="60 Hz", value=4889.0, standard_error=60.0),
    ]
    found = rank_drops(drops, drop_scatter=600.0)
    assert found.names == ("60 Hz", "100 Hz")
    assert found.worst_drop[0] > 0.999
    assert 0.6 < found.worst_condition[0] < 0.85
    assert "cannot be called the worst" in found.statement


def test_unknown_scatter_says_nothing_about_conditions():
    drops = [
        DropSeverity.from_interval("a", 2.0, (1.9, 2.1)),
        DropSeverity.from_interval("b", 1.0, (0.9, 1.1)),
    ]
    found = rank_drops(drops)
    assert found.worst_condition is None
    assert "scatter between equal drops is unknown" in found.statement


def test_wrong_calls_are_refused():
    with pytest.raises(UsageError, match="1 drop given, at least two"):
        rank_drops([DropSeverity(name="a", value=1.0, standard_error=0.1)])
    with pytest.raises(UsageError, match="'a': interval from 3 to 2 is upside down"):
        DropSeverity.from_interval("a", 2.5, (3.0, 2.0))
