"""Intervals where a record leaves several models."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.elements.table import EXTENSIONS
from rotordrop.known import NINETY, Known
from rotordrop.twin.mixture import Alternative, mixed, probabilities, worth_keeping
from rotordrop.twin.tracked import OtherModel


def normal(value: float, sigma: float) -> Known:
    half = NINETY * sigma
    return Known(value=value, standard_error=sigma, interval_90=(value - half, value + half), unit="N")


def alternative(odds: float, *extensions: Any) -> Alternative:
    return Alternative(extensions, odds, SimpleNamespace())  # type: ignore[arg-type]


def test_one_model_alone_keeps_its_interval():
    assert mixed(normal(100.0, 2.0), []) == normal(100.0, 2.0)


def test_models_that_agree_leave_the_interval_as_it_is():
    found = mixed(normal(100.0, 2.0), [(0.4, normal(100.0, 2.0))])
    assert found.interval_90 == pytest.approx(normal(100.0, 2.0).interval_90)


def test_the_interval_holds_ninety_per_cent_of_a_mixture():
    """Against draws; the value stays that of the stated model."""
    rng = np.random.default_rng(5)
    parts = [(0.6, 100.0, 2.0), (0.3, 110.0, 1.0), (0.1, 95.0, 5.0)]
    draws = np.concatenate([rng.normal(mean, sigma, int(2e5 * share)) for share, mean, sigma in parts])
    found = mixed(normal(100.0, 2.0), [(0.3, normal(110.0, 1.0)), (0.1, normal(95.0, 5.0))])
    assert found.value == 100.0
    assert found.interval_90 == pytest.approx(np.quantile(draws, [0.05, 0.95]), abs=0.1)
    assert found.standard_error == pytest.approx(math.sqrt(np.mean((draws - 100.0) ** 2)), rel=0.01)


def test_the_interval_holds_the_value_that_is_stated_and_ends_at_zero():
    low, high = mixed(normal(1.0, 0.1), [(0.97, normal(0.01, 0.1))]).interval_90 or (0.0, 0.0)
    assert low == 0.0 and high >= 1.0


def test_odds_become_probabilities_of_what_the_record_does_not_tell_apart():
    lag = next(one for one in EXTENSIONS if one.name == "sensor lag")
    open_ones = worth_keeping([alternative(1.0), alternative(0.5, lag), alternative(0.05, lag, lag)])
    assert [one.name for one in open_ones] == ["the base model", "sensor lag"]
    assert probabilities(open_ones) == pytest.approx([0.4, 0.2])


def test_a_model_that_is_left_open_is_named_with_its_probability():
    nothing: Any = SimpleNamespace()
    other = OtherModel(
        name="sensor lag", odds=0.25, probability=0.2, problem=nothing, smoothed=nothing, forces=nothing
    )
    said = other.structure()
    assert (said.name, said.probability, said.gain) == ("sensor lag", 0.2, math.log(0.25))
    assert "sensor lag, with a probability of 20 %" in said.sentence
