"""Noise, priors and windows by weight, air gap and time: the same for 5 kg, 60 kg and 6 t, at any rate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine

from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track._filter import is_plausible
from rotordrop.track.calibration import BLIND_SCHEDULE, QUICK_SCHEDULE, stage_settings, window_end
from rotordrop.track.prior import fall_time
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import PassSettings
from rotordrop.twin.problems import COARSE_BASIS

LAST = QUICK_SCHEDULE[-1]


def of_mass(flight: DropProblem, mass: float) -> DropProblem:
    return replace(flight, model=build_drop_model(scaled_machine(mass), COARSE_BASIS))


def test_on_the_machine_of_the_record_the_unknown_impulses_are_as_they_were(flight):
    settings = stage_settings(flight, LAST)
    assert settings.impulse == pytest.approx(1e-3, rel=0.03)
    assert settings.share == pytest.approx(0.01, rel=0.01)
    assert settings.learning_end == pytest.approx(0.05, rel=0.01)


@pytest.mark.parametrize("mass", [5.0, 130.0, 6000.0])
def test_unknown_impulses_of_a_fall_are_the_same_part_of_its_momentum(flight, mass):
    """A random walk: over the time of the fall it spreads by 0.6 per cent of the momentum of the fall."""

    def part(problem: DropProblem) -> float:
        momentum = float(np.mean(problem.model.load_shares)) * problem.fall_time
        return stage_settings(problem, LAST).impulse * math.sqrt(problem.fall_time / 50e-6) / momentum

    assert part(of_mass(flight, mass)) == pytest.approx(part(flight), rel=1e-9)


@pytest.mark.parametrize("rate", [5e3, 20e3, 100e3])
def test_noise_gathers_with_time_and_not_with_samples(rate):
    """Over a contact of 1 ms under 1000 N, whatever the sampling rate."""
    usual, numbers = PassSettings().for_sampling(50e-6), PassSettings().for_sampling(1.0 / rate)

    def gathered(settings) -> list[float]:
        samples = 1e-3 / settings.dt
        share = settings.share * 1000.0 * settings.dt
        return [samples * x**2 for x in (settings.impulse, share, settings.spin_noise, settings.speed_noise)]

    assert gathered(numbers) == pytest.approx(gathered(usual), rel=1e-9)


def test_windows_follow_the_first_contact_and_last_as_long_as_the_rebounds():
    fall = math.sqrt(2.0 * 0.25e-3 / 9.81)
    usual = [stage.until for stage in BLIND_SCHEDULE]
    assert [window_end(stage, 0.0075, fall) for stage in BLIND_SCHEDULE] == pytest.approx(usual)
    slow = [window_end(stage, 0.015, 2.0 * fall) for stage in BLIND_SCHEDULE]
    assert slow == pytest.approx([2.0 * until for until in usual])
    assert window_end(LAST, 0.015, 2.0 * fall) == LAST.until


def test_a_fall_takes_the_time_of_its_gap(flight):
    assert fall_time(flight.model.machine) == pytest.approx(7.14e-3, rel=1e-3)
    assert of_mass(flight, 6000.0).fall_time > 1.4 * flight.fall_time


@pytest.mark.parametrize("mass", [5.0, 6000.0])
def test_a_filter_has_lost_a_drop_by_the_gap_of_its_machine(flight, mass):
    problem = of_mass(flight, mass)
    gap = float(problem.model.machine.touchdown_bearings[0].air_gap)
    p, mean = problem.model.parameters, np.zeros(problem.n_dynamic)
    race = problem.model.layout.race.start
    mean[race] = 3.9 * gap
    assert is_plausible(mean, p)
    mean[race] = 4.1 * gap
    assert not is_plausible(mean, p)
