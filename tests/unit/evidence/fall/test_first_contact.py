"""First contact against a mass that falls on a spring, in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.evidence.contacts import (
    contact_intervals,
    corrected_stiffness,
    equivalent_stiffness,
    identify_first_contacts,
)

GAP, MASS, SPEED, GRAVITY = 250e-6, 40.0, 0.07, 9.81


def spring_contact(stiffness: float) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Time, radius, begin and end of the contact of a mass that hits a spring at the air gap."""
    omega = math.sqrt(stiffness / MASS)
    begin = 5e-3
    duration = (2.0 / omega) * (math.pi - math.atan(omega * SPEED / GRAVITY))
    time = np.arange(0.0, 0.02, 5e-5)
    t = time - begin
    inside = SPEED / omega * np.sin(omega * t) + GRAVITY / omega**2 * (1.0 - np.cos(omega * t))
    before = SPEED * t + 0.5 * GRAVITY * t**2
    after = -SPEED * (t - duration) + 0.5 * GRAVITY * (t - duration) ** 2
    beyond = np.where(t < 0.0, before, np.where(t < duration, inside, after))
    return time, GAP + beyond, begin, begin + duration


@pytest.mark.parametrize("stiffness", [5e6, 5e7, 4e8])
def test_contact_of_a_mass_on_a_spring_returns_its_stiffness(stiffness: float) -> None:
    time, radius, begin, end = spring_contact(stiffness)
    place = np.stack([np.zeros_like(radius), -radius], axis=-1)[:, None, :]
    (found,) = identify_first_contacts(
        time, place, np.array([GAP]), np.array([MASS * GRAVITY]), GRAVITY, 0.45e-6
    )
    assert found.start == pytest.approx(begin, abs=3e-6)
    assert found.end == pytest.approx(end, abs=3e-6)
    assert found.impact_speed == pytest.approx(SPEED, rel=1e-3)
    assert found.corrected_stiffness == pytest.approx(stiffness, rel=0.02)
    assert found.equivalent_stiffness < found.corrected_stiffness
    assert found.indentation == pytest.approx(radius.max() - GAP, abs=1e-12)


def test_equivalent_stiffness_is_eq_17() -> None:
    assert equivalent_stiffness(2e-3, 40.0) == pytest.approx(40.0 * (math.pi / 2e-3) ** 2, rel=1e-14)


def test_correction_vanishes_without_gravity() -> None:
    assert corrected_stiffness(2e-3, 40.0, 0.07, 1e-9) == pytest.approx(
        equivalent_stiffness(2e-3, 40.0), rel=1e-6
    )


@pytest.mark.parametrize("speed", [0.0, -2e-3])
def test_a_mass_laid_down_bounces_for_a_whole_period(speed: float) -> None:
    """A grazing contact, whose approach noise makes a departure, ended in a bare ValueError."""
    assert corrected_stiffness(2e-3, 40.0, speed, 9.81) == pytest.approx(40.0 * (2.0 * math.pi / 2e-3) ** 2)


def test_standard_error_follows_from_the_timing() -> None:
    time, radius, _, _ = spring_contact(5e7)
    place = np.stack([radius, np.zeros_like(radius)], axis=-1)[:, None, :]
    (found,) = identify_first_contacts(
        time, place, np.array([GAP]), np.array([MASS * GRAVITY]), GRAVITY, 1e-6
    )
    timing = math.hypot(5e-5 / math.sqrt(12.0), 1e-6 / found.impact_speed)
    assert found.timing_error == pytest.approx(timing, rel=1e-9)
    relative = 2.0 * math.sqrt(2.0) * timing / found.duration
    assert found.standard_error == pytest.approx(relative * found.equivalent_stiffness, rel=1e-9)


def test_intervals_list_every_contact_and_ignore_noise() -> None:
    time = np.arange(0.0, 0.04, 5e-5)
    radius = GAP - 20e-6 + 40e-6 * np.sin(2.0 * np.pi * 100.0 * time) ** 2
    radius += np.random.default_rng(0).normal(0.0, 0.2e-6, len(time))
    intervals = contact_intervals(time, radius, GAP)
    assert len(intervals) == 8
    assert intervals[:, 1] - intervals[:, 0] == pytest.approx(np.full(8, 2.5e-3), abs=1e-4)


def test_contact_that_lasts_to_the_end_is_listed_open() -> None:
    time = np.arange(0.0, 0.01, 5e-5)
    radius = GAP + np.where(time < 5e-3, -50e-6, 10e-6)
    intervals = contact_intervals(time, radius, GAP)
    assert intervals == pytest.approx(np.array([[5e-3, time[-1]]]), abs=6e-5)


def test_no_contact_is_refused_with_the_distance() -> None:
    time = np.arange(0.0, 0.01, 5e-5)
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = -100e-6
    with pytest.raises(IdentificationError, match=r"comes to 100 µm .* never reaches the air gap of 250 µm"):
        identify_first_contacts(time, place, np.array([GAP]), np.array([400.0]), GRAVITY, 1e-6)


def test_rotor_that_stays_outside_is_refused() -> None:
    time = np.arange(0.0, 0.01, 5e-5)
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = np.where(time < 5e-3, -200e-6, -300e-6)
    with pytest.raises(IdentificationError, match=r"stays beyond the air gap of 250 µm from 5.*ms"):
        identify_first_contacts(time, place, np.array([GAP]), np.array([400.0]), GRAVITY, 1e-6)
