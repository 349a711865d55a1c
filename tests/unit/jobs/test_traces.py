"""Histories of any length: a spike is seen at every zoom, few points are sent, and soon."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotordrop.errors import UsageError
from rotordrop.jobs.traces import MOST_POINTS, Traces, open_traces, sent, write_traces

RATE = 20_000.0


def traces(folder, *columns, start=0.0):
    names = tuple(f"c{number}" for number in range(len(columns)))
    clock = start + np.arange(len(columns[0])) / RATE
    write_traces(folder, "some", clock, dict(zip(names, columns, strict=True)))
    return open_traces(folder, "some", names)


@pytest.fixture(scope="module")
def long_record(tmp_path_factory):
    """75 s at 20 kHz, four channels and two radii."""
    generator = np.random.default_rng(1)
    count = int(75 * RATE)
    return traces(tmp_path_factory.mktemp("long"), *(generator.normal(0, 1e-6, count) for _ in range(6)))


@settings(max_examples=120, deadline=None)
@given(
    spike=st.integers(0, 199_999),
    first=st.integers(0, 199_998),
    width=st.integers(1, 200_000),
    sign=st.sampled_from([-1.0, 1.0]),
    points=st.sampled_from([100, 700, 4000]),
)
def test_a_spike_of_one_sample_is_seen_in_every_window_that_holds_it(spike, first, width, sign, points):
    noise = np.random.default_rng(3).normal(0, 1.0, 200_000)
    noise[spike] = sign * 40.0
    clock = np.arange(len(noise)) / RATE
    values = np.stack([noise, np.zeros_like(noise)]).astype(np.float32)
    shown = Traces(columns=("a", "b"), time=clock, values=values)
    last = min(first + width, len(noise) - 1)
    chosen = shown.window([0, 1], clock[first], clock[last], points)
    assert len(chosen) <= points
    assert np.all(np.diff(chosen) > 0)
    assert (spike in chosen) or not first <= spike <= last


def test_a_larger_value_just_outside_the_window_hides_nothing(tmp_path):
    values = np.zeros(100_000)
    values[50_000], values[50_003] = 5.0, 3.0
    shown = traces(tmp_path, values)
    chosen = shown.window([0], 50_001.5 / RATE, 90_000 / RATE, 200)
    assert 50_003 in chosen


def test_every_zoom_of_a_long_record_is_short_and_small(long_record):
    generator, slowest = np.random.default_rng(7), 0.0
    for _ in range(60):
        width = 10.0 ** generator.uniform(-2.5, np.log10(75))
        start = generator.uniform(0, 75 - width)
        begun = time.thread_time()  # a busy computer does not count
        chosen = long_record.window([0, 1, 2, 3], start, start + width)
        body = sent(long_record, [0, 1, 2, 3], chosen)
        slowest = max(slowest, time.thread_time() - begun)
        assert len(chosen) <= MOST_POINTS
        assert len(body) == 16 + 5 * 4 * len(chosen)
    assert slowest < 0.05


def test_what_is_sent_are_samples_with_their_times(tmp_path):
    shown = traces(tmp_path, np.sin(np.arange(50_000) / 90), start=-0.25)
    chosen = shown.window([0], 0.1, 0.9, 500)
    body = sent(shown, [0], chosen)
    start = np.frombuffer(body, "<f8", 1)[0]
    count, columns = np.frombuffer(body, "<u4", 2, 8)
    times = start + np.frombuffer(body, "<f4", count, 16)
    values = np.frombuffer(body, "<f4", count, 16 + 4 * count)
    assert columns == 1
    np.testing.assert_allclose(times, shown.time[chosen], atol=1e-7)
    np.testing.assert_array_equal(values, shown.values[0, chosen])


def test_gaps_stay_gaps_and_missing_columns_are_named(tmp_path):
    values = np.ones(60_000)
    values[:30_000] = np.nan
    values[40_000] = 9.0
    shown = traces(tmp_path, values)
    assert 40_000 in shown.window([0], 0.0, 3.0, 300)
    assert np.isnan(shown.values[0, shown.window([0], 0.0, 1.0, 300)]).all()
    shown = traces(tmp_path, np.zeros(10))
    with pytest.raises(UsageError, match=r"no column 'c7'; there are c0"):
        shown.chosen(("c7",))
    with pytest.raises(UsageError, match=r"no column without a name"):
        shown.chosen(())
