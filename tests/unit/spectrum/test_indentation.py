"""Displacement over a coast-down: envelope, largest and when, settling."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.spectrum.indentation import displacement_history, find_settling, held_maximum

FS = 5000.0
GAP = 280e-6


def swing(duration: float = 10.0, noise: float = 0.0) -> np.ndarray:
    """A rotor lying in the race and swinging; it never leaves the circle of the gap."""
    time = np.arange(int(duration * FS)) / FS
    angle = 0.3 * np.exp(-time / 5.0) * np.cos(2.0 * np.pi * 29.0 * time)
    xy = GAP * np.column_stack([np.sin(angle), -np.cos(angle)])
    return xy + noise * np.random.default_rng(0).standard_normal(xy.shape)


def test_early_maximum_is_found_and_told():
    xy = swing(noise=0.4e-6)
    xy[150] = [0.0, -GAP - 35e-6]
    found = displacement_history(xy, FS, air_gap=GAP)
    assert found.largest_time == pytest.approx(0.03)
    assert found.largest_indentation == pytest.approx(35e-6)
    assert held_maximum(found)
    assert "the first 0.2 s held the maximum" in found.statement
    assert found.noise == pytest.approx(0.4e-6, rel=0.1)


def test_late_maximum_is_found_and_told():
    xy = swing()
    xy[30000] = [200e-6, -260e-6]
    found = displacement_history(xy, FS, air_gap=GAP, start_time=0.01)
    assert found.largest_time == pytest.approx(6.01)
    assert not held_maximum(found)
    assert "did not hold the maximum" in found.statement


def test_a_difference_within_the_noise_is_left_open():
    xy = swing(noise=0.5e-6)
    found = displacement_history(xy, FS, air_gap=GAP)
    text = found.statement
    assert "leaves open" in text if found.largest_time <= 0.2 else "did not hold" in text


def test_envelope_holds_every_sample_once():
    xy = swing(noise=2e-6)
    radius = np.hypot(*xy.T)
    found = displacement_history(xy, FS, air_gap=GAP, intervals=300)
    assert 250 <= len(found.time) <= 300
    assert found.highest.max() == radius.max()
    assert found.lowest.min() == radius.min()
    assert found.lowest_xy.min(axis=0) == pytest.approx(xy.min(axis=0))
    per = -(-len(xy) // 300)
    assert found.highest[7] == radius[7 * per : 8 * per].max()


def test_a_short_record_says_that_it_ends_within_the_window():
    found = displacement_history(swing(0.1), FS, air_gap=GAP)
    assert "ends within 0.2 s" in found.statement
    assert np.isnan(found.largest_later)


def test_bouncing_ends_where_the_last_hop_ends():
    xy = swing(noise=0.4e-6)
    for start in (500, 900, 2600):
        xy[start : start + 100] *= 0.9
    found = find_settling(xy, FS, start_time=-0.1)
    assert found.settled
    assert found.last_lift_off == pytest.approx(2699 / FS - 0.1)
    assert found.contact_radius == pytest.approx(GAP, abs=0.5e-6)


def test_a_rotor_that_still_hops_did_not_settle():
    xy = swing()
    xy[-500:-400] *= 0.8
    found = find_settling(xy, FS)
    assert not found.settled
    assert "did not settle" in found.statement


def test_an_empty_signal_is_refused():
    with pytest.raises(RecordError, match="1 samples, at least 2"):
        displacement_history(np.zeros((1, 2)), FS, air_gap=GAP)
