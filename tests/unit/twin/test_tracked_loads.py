"""Intervals of forces and stresses: how wide, in which parts, and what they hold beside."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.known import NINETY, Known
from rotordrop.track.input_state import InputEstimate
from rotordrop.twin.tracked_loads import (
    loads_of_cross_check,
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
