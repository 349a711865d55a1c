"""Intervals of quantiles and probabilities hold what they promise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from rotordrop.errors import UsageError
from rotordrop.study.summary import exceedance, quantile


@pytest.mark.parametrize(("share", "drops"), [(0.5, 21), (0.9, 100), (0.99, 1000), (0.05, 200)])
def test_the_interval_of_a_quantile_holds_nine_times_of_ten(share, drops):
    random = np.random.default_rng(5)
    true = norm.ppf(share)
    held = 0
    for _ in range(2000):
        known = quantile(random.standard_normal(drops), share)
        held += known.low <= true <= known.high
    assert 0.89 <= held / 2000 <= 0.97  # order statistics are discrete: at least 90 %, a little more


def test_an_end_that_the_drops_cannot_give_is_open():
    known = quantile(np.arange(10.0), 0.99)
    assert known.high == np.inf
    assert np.isfinite(known.low)
    assert quantile([np.nan], 0.5).drops == 0


def test_median_of_five_by_hand():
    known = quantile([5.0, 1.0, 3.0, 2.0, 4.0], 0.5)
    assert (known.value, known.low, known.high) == (3.0, 1.0, 5.0)  # P(1 to 5 holds it) = 1 - 2/32


@pytest.mark.parametrize("probability", [0.01, 0.3, 0.97])
def test_the_interval_of_a_probability_holds_nine_times_of_ten(probability):
    random = np.random.default_rng(6)
    held = 0
    for _ in range(2000):
        known = exceedance(random.random(100) < probability, 0.5)
        held += known.low <= probability <= known.high
    assert held / 2000 >= 0.89


def test_nothing_in_ten_is_no_proof_of_never():
    known = exceedance(np.zeros(10), 1.0)
    assert (known.value, known.low) == (0.0, 0.0)
    assert known.high == pytest.approx(1.0 - 0.05**0.1)


def test_a_share_that_is_none_is_refused():
    with pytest.raises(UsageError, match=r"quantile 99; expected a number between 0 and 1"):
        quantile([1.0, 2.0], 99)
