"""The speed law: air apart from what friction takes once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.evidence.speed import identify_speed
from rotordrop.record.record import Record
from rotordrop_bench import SyntheticDrop

INITIAL = 2.0 * np.pi * 60.0


def with_speed(record: Record, end: float, loss: float = 3.0, constant: float = 9.0) -> Record:
    """A record whose speed falls by air and, within the first 0.3 s, by friction."""
    time = np.arange(-0.25, end, 0.01)
    after = np.maximum(time, 0.0)
    speed = INITIAL * np.exp(-after / constant) - loss * (1.0 - np.exp(-after / 0.08))
    speed += np.random.default_rng(2).normal(0.0, 0.1, len(time))
    return replace(record, speed_time=time, speed_readings=speed)


def test_aerodynamic_constant_does_not_count_friction(drop: SyntheticDrop) -> None:
    fit = identify_speed(with_speed(drop.record, 2.0), 0.0)
    assert fit.aero_time_constant.value == pytest.approx(9.0, rel=0.02)
    assert fit.friction_loss == pytest.approx(3.0, rel=0.1)
    assert fit.profile_time_constant < 8.8
    low, high = fit.aero_time_constant.interval_90 or (0.0, 0.0)
    assert low < 9.0 < high


def test_speed_before_the_drop_is_the_initial_speed(drop: SyntheticDrop) -> None:
    assert identify_speed(with_speed(drop.record, 2.0), 0.0).initial == pytest.approx(INITIAL, abs=0.3)


def test_orbit_gives_the_initial_speed_where_the_readings_agree(drop: SyntheticDrop) -> None:
    record = with_speed(drop.record, 2.0)
    assert identify_speed(record, 0.0, turning=INITIAL + 0.01).initial == INITIAL + 0.01
    assert identify_speed(record, 0.0, turning=2.0 * INITIAL).initial == pytest.approx(INITIAL, abs=0.3)


def test_short_record_says_that_it_cannot_separate(drop: SyntheticDrop) -> None:
    fit = identify_speed(with_speed(drop.record, 0.4), 0.0)
    assert "do not separate air from friction" in fit.note
    assert fit.aero_time_constant.status == "the record does not determine it"
    assert fit.aero_time_constant.value < 9.0


def test_record_that_ends_at_once_keeps_its_speed(drop: SyntheticDrop) -> None:
    fit = identify_speed(with_speed(drop.record, 0.05), 0.0)
    assert np.isinf(fit.aero_time_constant.value)
    assert "taken as constant" in fit.note
