"""Displacement over a coast-down: envelope, largest and when, settling."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.record.impacts import shortest_flight
from rotordrop.spectrum.indentation import (
    BLOCK,
    displacement_history,
    find_settling,
    held_maximum,
    settling_words,
)
from rotordrop.units import GRAVITY

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
    found = displacement_history(xy, FS, air_gap=GAP, start_time=0.01, error=4e-6)
    assert found.largest_time == pytest.approx(6.01)
    assert "328 ± 7 µm (+48 ± 9 µm beyond the air gap) at 6.0100 s; later" in found.statement
    assert "at most 328 ± 7 µm (at 6.0100 s)" in found.statement
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


def bouncing(restitution: float, duration: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
    """A mass that falls on a damped spring of 300 Hz: its path, and the times at which it lands [s]."""
    stiffness = (2.0 * np.pi * 300.0) ** 2
    share = -np.log(restitution) / np.hypot(np.pi, np.log(restitution))
    damping, steps = 2.0 * share * np.sqrt(stiffness), 10
    heights, landings = np.empty(int(duration * FS)), []
    height, velocity, touching = 0.0, 0.0, False
    for sample in range(len(heights)):
        heights[sample] = height
        for _ in range(steps):
            depth = -GAP - height
            push = max(stiffness * depth - damping * velocity, 0.0) if depth > 0.0 else 0.0
            if depth > 0.0 and not touching:
                landings.append(sample / FS)
            touching = depth > 0.0
            velocity += (push - GRAVITY) / (FS * steps)
            height += velocity / (FS * steps)
    return np.column_stack([np.full(len(heights), 1e-6), heights]), np.array(landings)


def after_flights(landings: np.ndarray) -> np.ndarray:
    """The landings that end a flight of a twentieth of the gap or more."""
    flown = np.diff(landings, prepend=-np.inf)
    return landings[flown > shortest_flight(GAP) + 2e-3]


def test_impacts_are_flights_that_end_and_contact_lasts_from_the_last():
    xy, landings = bouncing(0.6)
    xy += 0.2e-6 * np.random.default_rng(0).standard_normal(xy.shape)
    found = find_settling(xy, FS, air_gap=GAP, start_time=-0.1)
    assert len(landings) > len(after_flights(landings)) > 2
    assert found.touched == pytest.approx(after_flights(landings) - 0.1, abs=0.7e-3)
    assert found.contact_from == found.touched[-1]
    low, high = found.count_interval_90
    assert low <= len(after_flights(landings)) <= high
    told = settling_words(found, xy, FS)
    assert f"{len(found.touched)} impacts (90 %: {low} to {high}) by the displacement alone, the last" in told
    assert found.contact_from_interval_90 is not None
    early, late = found.contact_from_interval_90
    assert early < after_flights(landings)[-1] - 0.1 < late
    assert f"({early:.4f} s to {late:.4f} s), mostly in contact from then on" in told


def test_an_impact_late_in_a_long_signal_counts():
    """Read in blocks: a hop in the third of them is an impact, and lying on the race in between is none."""
    one, landings = bouncing(0.6, 1.0)
    once = after_flights(landings)
    late = int((once[0] + 2e-3) * FS)
    xy = np.tile(one[-1], (35 * int(FS), 1))
    xy[: len(one)] = one
    xy[2 * BLOCK + 1000 :][: len(one) - late] = one[late:]
    found = find_settling(xy, FS, air_gap=GAP)
    again = (2 * BLOCK + 1000 - late) / FS + once[1:]
    assert found.touched == pytest.approx(np.concatenate([once, again]), abs=0.7e-3)


def test_a_rotor_that_still_hops_did_not_settle():
    xy, _ = bouncing(0.95, duration=0.25)
    found = find_settling(xy, FS, air_gap=GAP)
    assert len(found.touched) > 5
    assert found.contact_from is None
    assert found.contact_from_interval_90 is None
    assert "did not settle" in settling_words(found, xy, FS)


def test_a_swing_along_the_race_makes_no_impacts():
    assert len(find_settling(swing(noise=0.4e-6), FS, air_gap=GAP).touched) <= 1


def test_an_empty_signal_is_refused():
    with pytest.raises(RecordError, match="1 samples, at least 2"):
        displacement_history(np.zeros((1, 2)), FS, air_gap=GAP)
