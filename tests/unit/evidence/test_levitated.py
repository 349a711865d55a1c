"""The levitated part of a record: level, orbit, runout, hum; white noise, coloured noise and lines."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.colour import SlowNoise, decay, slow_noise
from rotordrop.evidence.levitated import fit_levitated
from rotordrop.evidence.measured_speed import RotorAngle, rotor_angle

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


def test_the_levitated_part_ends_before_the_fall_and_needs_its_length(drop):
    """Four milliseconds of a free fall, which are 78 µm, in a window of 250 ms."""
    record = levitated(drop)
    since = np.maximum(record.time + 4e-3, 0.0)
    fallen = replace(record, signals=record.signals - 4.9 * since[:, None] ** 2)
    model = fit_levitated(fallen, 0.0, speed=150.03 * HZ)
    assert -5e-3 <= model.end < -3e-3
    np.testing.assert_allclose(model.noise, 0.45e-6, rtol=0.05)
    assert fit_levitated(record, 0.0, speed=150.03 * HZ).end == record.time[-1]
    with pytest.raises(
        RecordError, match=r"20 ms of levitated rotor before -0.23 s are 1.2 revolutions; at least 1.5"
    ):
        fit_levitated(drop, -0.23, speed=60.0 * HZ)


@pytest.mark.parametrize("mains", [50.0, 60.0, 400.0, 50.0 / 3.0])
def test_the_mains_frequency_is_found(drop, mains):
    model = fit_levitated(levitated(drop, mains=mains, hum=1.5e-6), 0.0, speed=150.0 * HZ)
    assert model.hum == pytest.approx(mains)
    np.testing.assert_allclose(model.noise, 0.45e-6, rtol=0.04)


def test_hum_is_taken_off_but_near_the_speed_or_slow(drop):
    """At 51 Hz a quarter of a second does not tell 50 Hz from 1X; 60 Hz it does."""
    model = fit_levitated(levitated(drop, frequency=51.0, hum=0.0), 0.0, speed=51.0 * HZ)
    assert model.hum == 60.0
    record = levitated(drop, hum=5e-6)
    model = fit_levitated(record, 0.0, speed=150.0 * HZ)
    clean = replace(record, signals=record.signals - model.hum_readings(record.time))
    left = fit_levitated(clean, 0.0, speed=150.0 * HZ)
    assert np.max(np.abs(left.amplitudes[2])) < 5e-8
    # Wander at 5 to 30 Hz holds 16.7 Hz too, but no line: it must not be carried on into the fall.
    record = levitated(drop, hum=0.0)
    rng = np.random.default_rng(3)
    bins = np.fft.rfftfreq(len(record.time), 1 / RATE)
    low = np.where((bins > 5.0) & (bins < 30.0), 1.0, 0.0)[:, None]
    shape = (len(bins), 4)
    wander = np.fft.irfft(low * (rng.normal(size=shape) + 1j * rng.normal(size=shape)), axis=0)
    record = replace(record, signals=record.signals + 3e-6 * wander / wander.std())
    assert fit_levitated(record, 0.0, speed=150.0 * HZ).hum in (50.0, 60.0)


def test_noise_is_that_it_was_made_with_whatever_is_missing(drop):
    record = levitated(drop)
    signals = record.signals.copy()
    signals[100:400, 0] = np.nan
    signals[:, 3] = np.nan
    model = fit_levitated(replace(record, signals=signals), 0.0, speed=150.0 * HZ)
    np.testing.assert_allclose(model.mean[:3], [1e-6, 2e-6, 3e-6], atol=0.05e-6)
    np.testing.assert_allclose(model.noise[:3], 0.45e-6, rtol=0.06)
    assert np.isnan(model.noise[3]) and np.isnan(model.mean[3])
    np.testing.assert_array_equal(model.of_channels([2, 0]).mean, model.mean[[2, 0]])
    # Its description: noise 0.447 µm rms, hum 0.1 µm.
    model = fit_levitated(drop, -0.004, speed=60.0 * HZ)
    np.testing.assert_allclose(model.noise, 0.447e-6, rtol=0.03)
    np.testing.assert_allclose(np.abs(model.amplitudes[2]), 0.1e-6, atol=0.03e-6)


@pytest.mark.parametrize("speed", [0.0, 0.5, 1.0])
def test_a_slow_rotor_needs_no_turns_and_its_motion_goes_on_into_the_fall(speed, drop):
    slow = levitated(drop, frequency=speed)
    model = fit_levitated(slow, -0.01, speed=HZ * speed)
    np.testing.assert_allclose(
        np.mean((slow.signals - model.readings(slow.time))[-200:], axis=0), 0.0, atol=3e-7
    )


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


def test_the_angle_is_the_integral_of_the_speed_whatever_a_tacho_adds(drop):
    record, true = slowing(drop)
    at, spread = rotor_angle(record, 0.0, HZ * 500.0).at(record.time)
    np.testing.assert_allclose(at, true, atol=0.02)
    assert np.all(spread == 0.0)
    assert abs(HZ * 500.0 * 0.2 - true[-1]) > 7.0  # what a constant speed would say
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


SIZES = (0.45e-6, 1e-6, 2e-6)
TONES = (120.0, 240.0, 50.0)


def first_order(random, count, rate, corner):
    """First-order noise of variance 1."""
    from scipy.signal import lfilter

    a = float(decay(np.array([corner]), 1.0 / rate)[0])
    noise = np.sqrt(1.0 - a * a) * random.standard_normal(count)
    noise[0] /= np.sqrt(1.0 - a * a)
    return lfilter([1.0], [1.0, -a], noise)


def flicker(random, count):
    """Noise of rms 1 whose power falls as one over the frequency."""
    lines = np.fft.rfft(random.standard_normal(count))
    lines[0] = 0.0
    lines[1:] /= np.sqrt(np.arange(1, len(lines)))
    noise = np.fft.irfft(lines, n=count)
    return noise / np.std(noise)


@pytest.mark.parametrize(("rate", "count"), [(20e3, 5000), (5e3, 800), (50e3, 40000)])
def test_white_noise_has_no_slow_part(rate, count):
    """60 channels, some of them with missing readings and quantised, at three rates."""
    random = np.random.default_rng(3)
    for _ in range(20):
        noise = SIZES * random.standard_normal((count, 3))
        noise[:, 1] = 0.3e-6 * np.round(noise[:, 1] / 0.3e-6)
        noise[random.uniform(size=count) < 0.3, 2] = np.nan
        found = slow_noise(noise, rate, TONES)
        assert len(found.channel) == 0
        variances = np.array(SIZES) ** 2
        np.testing.assert_array_equal(found.variances(variances), variances)


@pytest.mark.parametrize("rate", [5e3, 20e3, 50e3])
def test_the_spectrum_of_1_over_f_noise_is_followed(rate):
    """Its slowest parts are seen for a few periods only: of 15 records, the mean."""
    random, count = np.random.default_rng(4), round(0.25 * rate)
    noise = 1e-6 * random.standard_normal((count, 16))
    noise[:, 1:] += 2e-6 * np.column_stack([flicker(random, count) for _ in range(15)])
    found = slow_noise(noise, rate, TONES)
    assert set(found.channel) == set(range(1, 16))
    whole = found.variances(np.full(16, 1e-12))
    assert whole[0] == 1e-12
    assert 4e-12 < np.median(whole[1:]) < 8e-12  # never less than there is
    frequency = np.geomspace(20.0, 0.4 * rate, 8)
    lines = np.sum(1.0 / np.arange(1, count // 2 + 1))
    true = 1e-12 + 4e-12 * (0.5 * count) / (lines * frequency * count / rate)
    turn, a = 2.0 * np.pi * frequency / rate, decay(found.frequency, 1.0 / rate)[:, None]
    slow = found.variance[:, None] * (1 - a * a) / (1 - 2 * a * np.cos(turn) + a * a)
    parts = len(found.channel) // 15
    spectra = found.white[::parts, None] + slow.reshape(15, parts, -1).sum(axis=1)
    ratio = np.median(spectra, axis=0) / true
    assert np.all((ratio > 0.7) & (ratio < 3.0)), ratio
    assert np.all(np.abs(ratio[4:] - 1.0) < 0.2), ratio


def test_variances_of_first_order_noise_are_found():
    random, rate, count = np.random.default_rng(5), 20e3, 20000
    corner = rate / count * (0.5 * count) ** 0.25
    noise = 0.5e-6 * random.standard_normal((count, 1))
    noise[:, 0] += 1e-6 * first_order(random, count, rate, corner)
    found = slow_noise(noise, rate, ())
    assert found.frequency[0] == pytest.approx(corner)
    assert found.white[0] == pytest.approx(0.25e-12, rel=0.05)
    assert found.variance[0] == pytest.approx(1e-12, rel=0.3)
    assert np.all(found.variance[1:] < 0.02e-12)


def test_what_each_sample_brings_anew_is_white():
    """Noise of two parts over 300 samples and of fewer, of one channel of two whose gain is 1.1."""
    random, rate = np.random.default_rng(9), 20e3
    slow = SlowNoise(
        channel=np.array([1, 1]),
        frequency=np.array([20.0, 900.0]),
        variance=np.array([4e-12, 1e-12]),
        white=np.full(2, 1e-13),
    )
    a = decay(slow.frequency, 1.0 / rate)
    # a corner of 20 Hz forgets in 1 / (2 π 20 Hz) = 7.958 ms, in 159.15 samples
    assert a[0] ** 159.155 == pytest.approx(math.exp(-1.0), rel=1e-5)
    apart = np.abs(np.subtract.outer(np.arange(300), np.arange(300)))
    covariance = 1e-13 * np.eye(300) + sum(v * x**apart for v, x in zip(slow.variance, a, strict=True))
    root = np.linalg.cholesky(covariance)
    noise, gains = np.array([2e-6, 3e-6]), np.array([1.0, 1.1])
    values = random.standard_normal((300, 2, 5))
    values[:, 1] = 1.1 * np.tensordot(root, values[:, 1], 1)
    found = slow.over_noise(values, noise, gains, 1.0 / rate)
    np.testing.assert_allclose(1.1 * np.tensordot(root, found[:, 1], 1), values[:, 1], rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(found[:, 0], values[:, 0] * (1.0 / 2e-6))
    fewer = slow.over_noise(values[:120, :, 0], noise, gains, 1.0 / rate)
    np.testing.assert_allclose(fewer, found[:120, :, 0], rtol=1e-9)
    np.testing.assert_array_equal(slow.of_channels([1]).channel, [0, 0])
    assert len(slow.of_channels([0]).channel) == 0


def test_lines_are_no_slow_noise_and_count_roughly_as_white():
    """A third harmonic of the runout or a switching line would bend the whole spectrum."""
    random, rate, count = np.random.default_rng(6), 20e3, 5000
    time = np.arange(count) / rate
    line = 2e-6 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 777.3 * time)
    noise = 0.5e-6 * random.standard_normal((count, 2)) + line[:, None]
    noise[:, 1] += 1e-6 * flicker(random, count)
    found = slow_noise(noise, rate, TONES)
    assert set(found.channel) == {1}
    assert found.variances(np.full(2, 4.25e-12))[1] == pytest.approx(5.25e-12, rel=0.35)
    assert np.sum(found.variance) < 1.6e-12


def test_a_channel_without_readings_has_none():
    noise = 1e-6 * np.random.default_rng(7).standard_normal((2000, 2)).cumsum(axis=0)
    noise[:, 0] = np.nan
    assert set(slow_noise(noise, 20e3, ()).channel) == {1}
