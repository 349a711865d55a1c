"""A thinned history shows every peak; a thinned band contains the whole one."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rotordrop.report.style import block_envelope
from rotordrop.series import peak_indices


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 5000), blocks=st.integers(1, 60))
@settings(max_examples=60, deadline=None)
def test_every_block_keeps_its_extremes(seed, count, blocks):
    values = np.random.default_rng(seed).normal(size=count)
    chosen = peak_indices(values, blocks=blocks)
    assert chosen[0] == 0
    assert chosen[-1] == count - 1
    assert np.all(np.diff(chosen) > 0)
    assert len(chosen) <= 2 * blocks + 2
    for block in np.split(np.arange(count), np.linspace(0, count, blocks + 1).astype(int)[1:-1]):
        if len(block):
            kept = values[np.intersect1d(block, chosen)]
            assert kept.max() == values[block].max()
            assert kept.min() == values[block].min()


def test_peaks_of_all_signals_of_an_orbit_stay():
    rng = np.random.default_rng(2)
    x, y = rng.normal(size=(2, 10_000))
    chosen = peak_indices(x, y, np.hypot(x, y), blocks=50)
    for signal in (x, y, np.hypot(x, y)):
        assert signal[chosen].max() == signal.max()
        assert signal[chosen].min() == signal.min()


def test_short_histories_are_drawn_as_they_are():
    assert np.array_equal(peak_indices(np.arange(100.0), blocks=50), np.arange(100))


def test_a_gap_in_a_history_does_not_hide_the_peak_beside_it():
    values = np.ones(10_000)
    values[4000:4500] = np.nan
    values[4501] = 7.0
    chosen = peak_indices(values, blocks=40)
    assert np.nanmax(values[chosen]) == 7.0
    assert np.isnan(values[chosen]).any()


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_a_thinned_band_contains_the_whole_one(seed):
    rng = np.random.default_rng(seed)
    middle = rng.normal(size=3000).cumsum()
    lower, upper = middle - rng.random(3000), middle + rng.random(3000)
    index, lowest, highest = block_envelope(lower, upper, blocks=30)
    edges = np.linspace(0, 3000, 31).astype(int)
    for block, (start, end) in enumerate(pairwise(edges)):
        assert start <= index[block] < end
        assert lowest[block] <= lower[start:end].min()
        assert highest[block] >= upper[start:end].max()
