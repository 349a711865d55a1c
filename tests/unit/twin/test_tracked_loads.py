"""Intervals of forces and stresses: how wide, in which parts, and what they hold beside."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from rotordrop.known import NINETY, Known
from rotordrop.record.impacts import shortest_flight
from rotordrop.track.forces import ForceHistory
from rotordrop.track.input_state import InputEstimate
from rotordrop.twin.tracked_loads import (
    loads_of_cross_check,
    race_moved,
    widened_to,
    widened_to_cross_check,
    with_interval,
)


def test_a_magnitude_has_no_interval_below_zero() -> None:
    assert with_interval(100.0, 200.0).interval_90 == pytest.approx((0.0, 100.0 + NINETY * 200.0))
    assert with_interval(-5.0, 1.0).interval_90 == pytest.approx((-5.0 - NINETY, -5.0 + NINETY))
    held = widened_to(with_interval(100.0, 10.0), 3.0, 0.15).interval_90
    assert held == pytest.approx((100.0 - NINETY * 10.0, 345.0))


def test_what_the_model_leaves_out_is_a_part_of_the_interval() -> None:
    known = with_interval(100.0, 5.0, 2.0, "N", left_out=3.0)
    assert known.allowance_90 == pytest.approx(2.0 * NINETY * 3.0)
    assert with_interval(100.0, 5.0).allowance_90 is None
    assert widened_to(known, 3.0, 0.15).allowance_90 is None  # the cross-check made it as wide as it is


def check_of(force: np.ndarray, time: np.ndarray) -> InputEstimate:
    """A cross-check of one bearing that found this force (N, 2) [N]."""
    magnitude, one = np.hypot(*force.T)[:, None], np.ones(1)
    late = (time >= 0.15) & (time <= 0.2)
    return InputEstimate(
        time=time,
        turn=1e4,
        force=force[:, None, :],
        sigma=np.zeros((len(time), 1, 2)),
        magnitude=magnitude,
        peak=magnitude.max(axis=0),
        put_back=0.0 * one,
        peak_error=0.1 * one,
        stress=1e9 * np.cbrt(magnitude / 1e3),
        peak_stress=1e9 * np.cbrt(magnitude.max(axis=0) / 1e3),
        stress_error=0.1 * one,
        mean_late=np.hypot(*force[late].mean(axis=0)) * one,
        mean_magnitude_late=magnitude[late].mean(axis=0),
    )


def test_noise_taken_for_force_does_not_push_the_mean_beyond_its_interval() -> None:
    """A 5 kg rotor: 23 N of weight under 20 N of noise in each direction have a mean magnitude of 33 N."""
    time = np.arange(0.0, 0.2005, 5e-5)
    noisy = np.array([0.0, 23.0]) + 20.0 * np.random.default_rng(0).standard_normal((len(time), 2))
    stated = loads_of_cross_check(check_of(noisy, time), 0).means["mean_force_0p15_0p2_N"]
    assert stated.value > 30.0 and stated.low < 23.0 < stated.high
    turning = 30.0 * np.column_stack([np.cos(300.0 * time), np.sin(300.0 * time)])
    whirl = loads_of_cross_check(check_of(turning, time), 0).means["mean_force_0p15_0p2_N"]
    assert whirl.high > 30.0  # with a mean vector near zero, all of it may be noise
    assert whirl.low == pytest.approx(0.95 * float(check_of(turning, time).mean_late[0]))


def test_a_preload_far_from_its_prior_widens_the_mean_stress() -> None:
    time = np.arange(0.0, 0.2005, 5e-5)
    check = check_of(np.tile([0.0, 23.0], (len(time), 1)), time)
    own = loads_of_cross_check(check, 0)
    preload = Known(value=679.0, interval_90=(42.0, 1046.0), unit="N")
    stress = widened_to_cross_check(own, check, 0, preload).means["mean_stress_Pa"]
    value = own.means["mean_stress_Pa"].value
    assert stress.low == pytest.approx(0.9 * (42.0 / 679.0) ** (1 / 3) * value)
    assert stress.high >= 1.1 * (1046.0 / 679.0) ** (1 / 3) * value * (1.0 - 1e-9)


def test_an_impact_is_sure_whose_flight_is_one_with_the_race_nearer_and_farther() -> None:
    """Two contacts with a flight as long as the shortest that ends in an impact, and one much longer."""
    gap, step, error = Known(value=300e-6, unit="m"), 5e-5, 0.5e-6
    time = np.arange(0.0, 0.1, step)
    flight = shortest_flight(gap.value)
    touching = np.zeros(len(time), dtype=bool)
    begins = (0.008, 0.009 + flight, 0.010 + 3.0 * flight)
    for begin in begins:
        touching |= (time >= begin) & (time < begin + 1e-3)
    off = np.minimum.reduce([np.abs(time - at) for begin in begins for at in (begin, begin + 1e-3)])
    blank = {one.name: np.zeros((len(time), 1)) for one in fields(ForceHistory)}
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = -np.linspace(0.0, 310e-6, len(time))
    forces = ForceHistory(
        **{
            **blank,
            "time": time,
            "displacement": place,
            "displacement_sigma": np.full_like(place, 2e-6),
            # the rotor nears the race and leaves it by 10 mm/s
            "indentation": (np.where(touching, 1.0, -1.0) * 0.01 * (off + 0.3 * step))[:, None],
            "indentation_sigma": np.full((len(time), 1), error),
        }
    )
    seen = race_moved(forces, 0, gap, 1.0, 0.0)
    assert seen["count_interval_90"] == (2, 3)
    low, high = seen["contact_from_interval_90"]
    moved = NINETY * error / 0.01 + step
    assert begins[2] - moved - step < low < begins[2] < high <= begins[2] + moved + step
    assert seen["largest"].value == pytest.approx(310e-6)
    assert seen["largest"].high == pytest.approx(310e-6 + NINETY * math.hypot(2e-6, 0.008 * 310e-6))
    sharp = replace(forces, indentation_sigma=np.zeros((len(time), 1)))
    assert race_moved(sharp, 0, gap, 1.0, 0.0)["count_interval_90"] in ((2, 3), (2, 2))
    assert race_moved(forces, 0, gap, 20.0, 0.0)["count_interval_90"][1] >= 3
