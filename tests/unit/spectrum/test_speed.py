"""Speed of a coast-down: smooth profile, exponential and drag fits with intervals, standstill."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.spectrum.coast_down_law import (
    find_standstill,
    fit_drag,
    fit_exponential,
)
from rotordrop.spectrum.speed_profile import exact_speed_profile, fit_speed_profile

TURN = 2.0 * np.pi
TIME = np.arange(0.0, 57.0, 0.05)


def drag_speed(time, first=60.0 * TURN, dry=0.16, linear=0.11, quadratic=0.0):
    """Integrated with very small steps, independent of the fit's own integrator."""
    fine = np.linspace(0.0, float(time[-1]), 200_001)
    step = fine[1]
    speed = np.empty(fine.size)
    speed[0] = omega = first
    for k in range(1, fine.size):
        slope = dry + linear * omega + quadratic * omega**2
        middle = max(omega - 0.5 * step * slope, 0.0)
        omega = max(omega - step * (dry + linear * middle + quadratic * middle**2), 0.0)
        speed[k] = omega
    return np.interp(time, fine, speed)


@pytest.mark.parametrize("step", [0.0, 1.0 / 60.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_profile_is_far_better_than_the_recording(seed, step):
    rng = np.random.default_rng(seed)
    truth = 58.5 * np.exp(-TIME / 8.0) + 1.5 * np.exp(-TIME / 0.2)
    recorded = truth + 0.05 * rng.standard_normal(TIME.size)
    if step:
        recorded = np.round(recorded / step) * step
    profile = fit_speed_profile(TIME, TURN * recorded)
    error = profile.speed_at(TIME) / TURN - truth
    later = TIME > 1.0
    assert np.sqrt(np.mean(error[later] ** 2)) < 0.02
    assert profile.noise / TURN == pytest.approx(np.hypot(0.05, step / np.sqrt(12.0)), rel=0.2)


def test_angle_is_the_integral_of_the_speed():
    omega = TURN * 60.0 * np.exp(-TIME / 5.9)
    profile = exact_speed_profile(TIME, omega)
    expected = TURN * 60.0 * 5.9 * (1.0 - np.exp(-TIME / 5.9))
    assert profile.angle_at(TIME) == pytest.approx(expected, abs=1e-4)
    assert profile.change_at(10.0) == pytest.approx(-TURN * 60.0 / 5.9 * np.exp(-10.0 / 5.9), rel=1e-4)
    beyond = profile.angle_at(TIME[-1] + 2.0) - profile.angle_at(TIME[-1])
    assert beyond == pytest.approx(2.0 * omega[-1])


def test_speed_before_power_off_is_constant():
    time = np.arange(-1.0, 10.0, 0.05)
    omega = TURN * np.where(time < 0.0, 60.0, 60.0 * np.exp(-np.maximum(time, 0.0) / 8.0))
    noisy = omega + TURN * 0.05 * np.random.default_rng(0).standard_normal(time.size)
    profile = fit_speed_profile(time, noisy, power_off=0.0)
    assert profile.speed_at([-0.9, -0.5]) / TURN == pytest.approx([60.0, 60.0], abs=0.05)


def test_a_double_tacho_pulse_is_left_out():
    omega = TURN * 60.0 * np.exp(-TIME / 8.0)
    omega = omega + TURN * 0.02 * np.random.default_rng(0).standard_normal(TIME.size)
    omega[200] *= 2.0
    omega[400] *= 0.5
    profile = fit_speed_profile(TIME, omega)
    assert profile.rejected == 2
    assert profile.speed_at(TIME[200]) / TURN == pytest.approx(60.0 * np.exp(-TIME[200] / 8.0), abs=0.03)


def test_exponential_fit_returns_its_law_and_knows_another():
    rng = np.random.default_rng(2)
    recorded = TURN * (60.0 * np.exp(-TIME / 5.9) + 0.05 * rng.standard_normal(TIME.size))
    fit = fit_exponential(TIME, recorded, start=0.0)
    low, high = fit.time_constant.interval_90
    assert low < 5.9 < high and high - low < 0.02
    assert "follows this law" in fit.statement
    other = fit_exponential(TIME, drag_speed(TIME, quadratic=2e-4), start=0.0)
    assert "does not follow" in other.statement
    exact = fit_exponential(TIME, TURN * 60.0 * np.exp(-TIME / 5.9), start=0.0)
    assert exact.residual_rms < 1e-4 * TURN * 60.0
    assert "the speed follows this law." in exact.statement
    assert other.residual_rms > 5.0 * other.noise


def test_drag_fit_returns_all_three_parts():
    truth = drag_speed(TIME, dry=0.16, linear=0.08, quadratic=1.5e-4)
    inside = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        fit = fit_drag(TIME, truth + TURN * 0.05 * rng.standard_normal(TIME.size), start=1.0)
        assert fit.linear.value == pytest.approx(0.08, rel=0.02)
        assert fit.quadratic.value == pytest.approx(1.5e-4, rel=0.02)
        assert fit.residual_rms == pytest.approx(TURN * 0.05, rel=0.1)
        for value, true in ((fit.constant, 0.16), (fit.linear, 0.08), (fit.quadratic, 1.5e-4)):
            inside += value.interval_90[0] < true < value.interval_90[1]
    assert 27 <= inside <= 36  # 32.4 of 36 expected


def test_drag_that_is_not_there_is_at_its_bound():
    recorded = drag_speed(TIME) + TURN * 0.05 * np.random.default_rng(0).standard_normal(TIME.size)
    fit = fit_drag(TIME, recorded, start=1.0)
    assert fit.quadratic.status in ("at its bound", "the record does not determine it")
    assert fit.quadratic.interval_90[1] < 2e-5
    assert fit.linear.status == "determined"
    assert fit.speed_at([5.0, 20.0]) == pytest.approx(drag_speed(TIME)[[100, 400]], abs=0.05 * TURN)


@pytest.mark.parametrize("seed", range(5))
def test_standstill_is_found_within_its_interval(seed):
    truth = drag_speed(TIME, dry=0.25)
    stop = TIME[np.flatnonzero(truth <= 0.0)[0]]
    noisy = truth + TURN * 0.05 * np.random.default_rng(seed).standard_normal(TIME.size)
    cut = find_standstill(TIME, np.maximum(noisy, 0.0))
    assert cut.status == "determined"
    assert cut.value == pytest.approx(stop, abs=4.0 * cut.standard_error + 0.1)
    assert cut.standard_error < 1.0
    assert cut.lower < stop


def test_a_record_that_ends_before_standstill_says_so():
    early = TIME < 15.0
    found = find_standstill(TIME[early], drag_speed(TIME)[early])
    assert found.status == "the record does not determine it"
    assert found.lower == pytest.approx(TIME[early][-1], abs=0.1)


def test_wrong_records_are_refused():
    with pytest.raises(RecordError, match=r"time does not rise at value 5 \(4\.000000 s, then 3\.000000 s\)"):
        fit_speed_profile([0, 1, 2, 3, 4, 3, 6, 7, 8], np.ones(9))
    with pytest.raises(RecordError, match="3 valid recorded speeds"):
        fit_speed_profile([0.0, 1.0, 2.0], np.ones(3))
    with pytest.raises(RecordError, match=r"0 recorded speeds between 100\.0000 s and the end"):
        fit_drag(TIME, np.ones(TIME.size), start=100.0)
