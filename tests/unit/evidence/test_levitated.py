"""The levitated part of a record: level, orbit, runout by the rotor angle, hum of any mains, noise."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.levitated import fit_levitated
from rotordrop.record.speed import RotorAngle, rotor_angle

RATE = 20000.0
HZ = 2 * np.pi


def levitated(drop, *, frequency=150.0, hum=0.4e-6, noise=0.45e-6, mains=50.0):
    time = np.arange(-5000, 0) / RATE
    rng = np.random.default_rng(11)
    signals = np.empty((len(time), 4))
    for k in range(4):
        signals[:, k] = (1 + k) * 1e-6 + 9e-6 * np.cos(HZ * frequency * time - 0.7 * k)
        signals[:, k] += 0.8e-6 * np.cos(2 * HZ * frequency * time + k) + hum * np.cos(
            HZ * mains * time + 0.3
        )
    signals += noise * rng.normal(size=signals.shape)
    return replace(drop, time=time, signals=signals, speed=None)


def test_constant_tones_hum_and_noise_are_found(drop):
    model = fit_levitated(levitated(drop), 0.0, speed=150.03 * HZ)
    error = 0.45e-6 * np.sqrt(2 / 5000)
    assert model.frequency == pytest.approx(150.0, abs=0.002)
    np.testing.assert_allclose(model.mean, [1e-6, 2e-6, 3e-6, 4e-6], atol=4 * error)
    np.testing.assert_allclose(np.abs(model.amplitudes[0]), 9e-6, atol=5 * error)
    np.testing.assert_allclose(np.abs(model.amplitudes[1]), 0.8e-6, atol=5 * error)
    np.testing.assert_allclose(np.angle(model.amplitudes[0]), -0.7 * np.arange(4), atol=0.02)
    np.testing.assert_allclose(model.noise, 0.45e-6, rtol=0.04)
    assert model.hum == 50.0
    np.testing.assert_allclose(np.abs(model.amplitudes[2]), 0.4e-6, atol=5 * error)


def test_a_window_that_reaches_into_the_fall_ends_before_it(drop):
    """Four milliseconds of a free fall, which are 78 µm, in a window of 250 ms."""
    record = levitated(drop)
    since = np.maximum(record.time + 4e-3, 0.0)
    fallen = replace(record, signals=record.signals - 4.9 * since[:, None] ** 2)
    model = fit_levitated(fallen, 0.0, speed=150.03 * HZ)
    assert -5e-3 <= model.end < -3e-3
    np.testing.assert_allclose(model.noise, 0.45e-6, rtol=0.05)
    assert fit_levitated(record, 0.0, speed=150.03 * HZ).end == record.time[-1]


@pytest.mark.parametrize("mains", [50.0, 60.0, 400.0, 50.0 / 3.0])
def test_the_mains_frequency_is_found(drop, mains):
    model = fit_levitated(levitated(drop, mains=mains, hum=1.5e-6), 0.0, speed=150.0 * HZ)
    assert model.hum == pytest.approx(mains)
    np.testing.assert_allclose(model.noise, 0.45e-6, rtol=0.04)


def test_slow_wander_of_the_rotor_is_no_railway_hum(drop):
    """Wander at 5 to 30 Hz holds 16.7 Hz too, but no line: it must not be carried on into the fall."""
    record = levitated(drop, hum=0.0)
    rng = np.random.default_rng(3)
    bins = np.fft.rfftfreq(len(record.time), 1 / RATE)
    low = np.where((bins > 5.0) & (bins < 30.0), 1.0, 0.0)[:, None]
    shape = (len(bins), 4)
    wander = np.fft.irfft(low * (rng.normal(size=shape) + 1j * rng.normal(size=shape)), axis=0)
    record = replace(record, signals=record.signals + 3e-6 * wander / wander.std())
    assert fit_levitated(record, 0.0, speed=150.0 * HZ).hum in (50.0, 60.0)


def test_hum_too_near_to_the_speed_is_left_alone(drop):
    """At 51 Hz a quarter of a second does not tell 50 Hz from 1X; 60 Hz it does."""
    model = fit_levitated(levitated(drop, frequency=51.0, hum=0.0), 0.0, speed=51.0 * HZ)
    assert model.hum == 60.0


def test_hum_is_taken_off(drop):
    record = levitated(drop, hum=5e-6)
    model = fit_levitated(record, 0.0, speed=150.0 * HZ)
    clean = replace(record, signals=record.signals - model.hum_readings(record.time))
    left = fit_levitated(clean, 0.0, speed=150.0 * HZ)
    assert np.max(np.abs(left.amplitudes[2])) < 5e-8


def test_missing_readings_do_not_spoil_the_other_channels(drop):
    record = levitated(drop)
    signals = record.signals.copy()
    signals[100:400, 0] = np.nan
    signals[:, 3] = np.nan
    model = fit_levitated(replace(record, signals=signals), 0.0, speed=150.0 * HZ)
    np.testing.assert_allclose(model.mean[:3], [1e-6, 2e-6, 3e-6], atol=0.05e-6)
    np.testing.assert_allclose(model.noise[:3], 0.45e-6, rtol=0.06)
    assert np.isnan(model.noise[3]) and np.isnan(model.mean[3])
    np.testing.assert_array_equal(model.of_channels([2, 0]).mean, model.mean[[2, 0]])


def test_the_bundled_record_has_the_noise_it_was_made_with(drop):
    """Its description: noise 0.447 µm rms, hum 0.1 µm."""
    model = fit_levitated(drop, -0.004, speed=60.0 * HZ)
    np.testing.assert_allclose(model.noise, 0.447e-6, rtol=0.03)
    np.testing.assert_allclose(np.abs(model.amplitudes[2]), 0.1e-6, atol=0.03e-6)


def test_too_little_levitated_record_is_refused(drop):
    with pytest.raises(
        RecordError, match=r"20 ms of levitated rotor before -0.23 s are 1.2 revolutions; at least 2"
    ):
        fit_levitated(drop, -0.23, speed=60.0 * HZ)


# the rotor angle, and the runout that turns with it


def slowing(drop, *, start=500.0, rate=62.5, by_hand=False):
    """A record at 500 Hz whose speed falls by 12.5 Hz in 0.2 s: its sensors show runout and nothing else."""
    time = np.arange(-5000, 4000) / RATE
    after = np.maximum(time, 0.0)
    angle = HZ * (start * time - 0.5 * rate * after**2)
    noise = 0.3e-6 * np.random.default_rng(5).normal(size=(len(time), 4))
    runout = 0.28e-6 * np.cos(2.0 * angle[:, None] + np.arange(4))
    orbit = np.where(time[:, None] < 0.0, 3e-6 * np.cos(angle[:, None]), 0.0)
    read = np.arange(-0.25, 0.2, 0.01)
    speed = HZ * (start - rate * np.maximum(read, 0.0))
    if by_hand:
        read, speed = time[[0, -1]], HZ * np.array([start, start])
    return replace(
        drop,
        time=time,
        signals=runout + orbit + noise,
        speed=np.interp(time, read, speed),
        speed_time=read,
        speed_readings=speed,
        speed_by_hand=by_hand,
    ), angle


def test_the_angle_is_the_integral_of_the_measured_speed(drop):
    record, true = slowing(drop)
    at, spread = rotor_angle(record, 0.0, HZ * 500.0).at(record.time)
    np.testing.assert_allclose(at, true, atol=0.02)
    assert np.all(spread == 0.0)
    assert abs(HZ * 500.0 * 0.2 - true[-1]) > 7.0  # what a constant speed would say


def test_a_tacho_that_reads_high_does_not_turn_the_rotor_faster(drop):
    record, true = slowing(drop)
    high = replace(record, speed_readings=record.speed_readings + 10.0)
    at, _ = rotor_angle(high, 0.0, HZ * 500.0).at(record.time)
    np.testing.assert_allclose(at, true, atol=0.02)


def test_runout_at_2x_follows_the_rotor_that_slows_down(drop):
    """By a constant speed, 15 rad off at 2X, the runout was added and not taken off."""
    record, _ = slowing(drop)
    model = fit_levitated(record, -0.001, speed=HZ * 500.0)
    late = record.time > 0.1
    left = (record.signals - model.disturbance(record.time, rotor_angle(record, 0.0, HZ * model.frequency)))[
        late
    ]
    np.testing.assert_allclose(left.std(axis=0), 0.3e-6, rtol=0.04)
    assert record.signals[late].std() > 1.15 * 0.3e-6
    even = RotorAngle(
        power_off=0.0, turning=HZ * 500.0, knots=np.array([0.0, 1.0]), speed=np.full(2, HZ * 500.0)
    )
    assert (record.signals - model.disturbance(record.time, even))[late].std() > 1.2 * 0.3e-6


def test_a_speed_given_by_hand_says_nothing_after_power_off(drop):
    """Runout fades out of what is taken off and counts as noise instead."""
    record, true = slowing(drop, by_hand=True)
    assert record.measured_speed is None
    model = fit_levitated(record, -0.001, speed=HZ * 500.0)
    angle = rotor_angle(record, 0.0, HZ * model.frequency, strongest_slowing=2.0 * HZ * 62.5)
    at, spread = angle.at(record.time)
    assert np.max(np.abs(at - true)) < 0.5  # half the strongest slowing is what this rotor does
    assert spread[-1] == pytest.approx(0.5 * 2.0 * HZ * 62.5 / np.sqrt(12.0) * 0.2**2, rel=1e-3)
    taken = model.disturbance(record.time, angle) - model.hum_readings(record.time)
    assert np.abs(taken[-200:]).max() < 0.02e-6 < np.abs(taken[:200]).max()
    falling = record.time > 0.0
    variance = model.unknown_runout(record.time[falling], angle)
    left = (record.signals - model.disturbance(record.time, angle))[falling]
    np.testing.assert_allclose(np.sqrt(variance + model.noise**2), left.std(axis=0), rtol=0.1)
