"""The next draw, from those that were recorded."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from scipy.stats import kstest

from rotordrop import example_machine
from rotordrop.machine import loads_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin, RecordedLift
from rotordrop.machine.saving import machine_text
from rotordrop.study.distributions import normal_score
from rotordrop.study.repeat import next_draw, repeat_study

SPREAD = 0.2
MACHINE = example_machine("lp400")


def posterior(value: float, error: float) -> tuple[float, float]:
    """Estimate and error that a record with a given error leaves of a value with the prior about zero."""
    sure = 1.0 / (error**-2 + SPREAD**-2)
    return value * sure / error**2, math.sqrt(sure)


def test_without_records_the_prior_stays():
    assert next_draw([], SPREAD).numbers == (0.0, SPREAD)
    assert next_draw([(0.0, SPREAD)], SPREAD).numbers == (0.0, SPREAD)


def test_one_exact_record_takes_half_of_it_over():
    """The mean common share of a uniform one is a half, and one value alone says nothing of it."""
    mean, sigma = next_draw([(0.2, 1e-9)], SPREAD).numbers
    assert mean == pytest.approx(0.5 * 0.2, rel=1e-3)
    shares = (np.arange(64) + 0.5) / 64
    expected = np.mean(SPREAD**2 * (1.0 - shares**2) + (0.2 * shares) ** 2) - mean**2
    assert sigma == pytest.approx(math.sqrt(expected), rel=1e-6)


def test_many_equal_records_are_repeated_and_many_scattered_ones_scatter():
    equal = next_draw([posterior(0.15, 0.005)] * 12, SPREAD).numbers
    assert equal[0] == pytest.approx(0.15, abs=0.01)
    assert equal[1] < 0.04
    random = np.random.default_rng(1).normal(0.0, SPREAD, 200)
    mean, sigma = next_draw([posterior(x, 0.01) for x in random], SPREAD).numbers
    assert mean == pytest.approx(random.mean(), abs=0.01)
    assert sigma == pytest.approx(SPREAD, rel=0.08)


@pytest.mark.parametrize("error", [0.01, 0.1])
def test_the_next_value_lies_anywhere_in_its_distribution(error):
    """Common share, common part and scatter drawn as the model has them: places of the next are uniform."""
    random, places = np.random.default_rng(3), []
    for _ in range(2000):
        share = random.uniform()
        common = SPREAD * math.sqrt(share) * random.standard_normal()
        values = common + SPREAD * math.sqrt(1.0 - share) * random.standard_normal(5)
        told = [posterior(x + error * random.standard_normal(), error) for x in values[:4]]
        mean, sigma = next_draw(told, SPREAD).numbers
        places.append(float(ndtr((values[4] - mean) / sigma)))
    inside = np.mean(np.abs(np.array(places) - 0.5) < 0.45)
    assert inside == pytest.approx(0.9, abs=0.02)
    assert kstest(places, "uniform").statistic < 0.035


def test_a_virtual_repeat_lifts_as_the_recorded_drops_did():
    lifts = [
        tuple(
            RecordedLift(magnet=amb.name, sideways=0.0, sideways_error=0.05, up=0.17, up_error=0.05)
            for amb in MACHINE.ambs
        )
        for _ in range(2)
    ]
    drops = tuple(CalibrationDrop(name=f"drop {k}", lift=lift) for k, lift in enumerate(lifts))
    machine = MACHINE.calibrated_on(CalibrationOrigin(drops=drops, consistent=True))
    again = loads_machine(machine_text(machine))
    assert again == machine
    study = repeat_study(again, 600.0, duration=0.2)
    name = MACHINE.ambs[0].name
    up, sideways = (study.vary[f"{name}.{part}"].numbers for part in ("remanent_share", "remanent_share_x"))
    assert up == next_draw([(0.17, 0.05)] * 4, SPREAD).numbers
    assert up[0] > 0.12
    assert sideways[0] == pytest.approx(0.0, abs=1e-12)
    assert max(up[1], sideways[1]) < SPREAD
    assert repeat_study(MACHINE, 600.0, duration=0.2).vary[f"{name}.remanent_share"].numbers == (0.0, SPREAD)


def test_scores_are_those_of_the_normal_distribution():
    share = np.concatenate([np.logspace(-15.5, -1, 500), np.linspace(0.001, 0.999, 999)])
    np.testing.assert_allclose(normal_score(share), ndtri(share), rtol=2e-15, atol=1e-17)
