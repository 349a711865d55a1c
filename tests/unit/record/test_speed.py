"""Shaft speed: readings in a held signal, speed at the drop, smoothing."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.record.speed import readings_of_held_signal, speed_at_drop

HZ = 2 * np.pi


def held(readings, every=200, first=37):
    """Readings held for `every` samples, the first for `first` only."""
    return np.concatenate([np.repeat(value, first if i == 0 else every) for i, value in enumerate(readings)])


def test_readings_are_found_in_a_held_signal():
    values = held([60.0, 59.9, 60.1, 59.8, 59.7])
    time = np.arange(len(values)) * 5e-5
    when, what = readings_of_held_signal(time, values)
    np.testing.assert_array_equal(what, [60.0, 59.9, 60.1, 59.8, 59.7])
    np.testing.assert_allclose(when[1:], (37 + 200 * np.arange(4)) * 5e-5)


def test_equal_readings_in_a_row_are_both_found():
    values = held([60.0, 59.9, 60.1, 60.1, 59.7])
    when, what = readings_of_held_signal(np.arange(len(values)) * 5e-5, values)
    np.testing.assert_array_equal(what, [60.0, 59.9, 60.1, 60.1, 59.7])
    np.testing.assert_allclose(np.diff(when[1:]), 200 * 5e-5)


def test_a_continuous_signal_comes_back_as_it_is():
    time = np.arange(500) * 1e-3
    values = 60.0 * np.exp(-time / 6.0)
    when, what = readings_of_held_signal(time, values)
    np.testing.assert_array_equal(what, values)
    np.testing.assert_array_equal(when, time)


def slowing(drop, outliers=()):
    """Readings every 10 ms: 60 Hz before the drop, then exponential fall, with noise of 0.02 Hz."""
    time = np.arange(-0.25, 2.0, 0.01)
    hertz = 60.0 * np.exp(-np.maximum(time - 0.003, 0.0) / 9.0)
    hertz = hertz + 0.02 * np.random.default_rng(3).normal(size=len(time))
    hertz[list(outliers)] *= 2.0
    return replace(drop, speed_time=time, speed_readings=HZ * hertz)


@pytest.mark.parametrize("outliers", [(), (10, 30)])
def test_speed_at_the_drop(drop, outliers):
    found = speed_at_drop(slowing(drop, outliers), 0.003)
    assert found.value == pytest.approx(60.0 * HZ, abs=4 * found.standard_error)
    assert found.standard_error < 0.01 * HZ
    assert found.slope == pytest.approx(-60.0 * HZ / 9.0, rel=0.05)
    assert found.scatter == pytest.approx(0.02 * HZ, rel=0.35)


def test_speed_of_the_bundled_record(whole_drop):
    found = speed_at_drop(whole_drop, -0.00025)
    assert found.value == pytest.approx(60.0 * HZ, rel=3e-4)
    assert found.slope < 0


def test_missing_speed_says_what_to_do(drop):
    silent = replace(drop, speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(
        RecordError, match=r"drop_060 has no shaft speed beside S_NDE_A.*constant = \"60 Hz\""
    ):
        speed_at_drop(silent, 0.0)


def test_speed_far_from_the_drop_is_refused(drop):
    with pytest.raises(RecordError, match=r"0 speed readings within 0.5 s of the drop at 9 s"):
        speed_at_drop(drop, 9.0)
