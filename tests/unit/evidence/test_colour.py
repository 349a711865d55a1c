"""Noise of the sensors that is not white, told from white noise and from lines."""

import math

import numpy as np
import pytest

from rotordrop.evidence.colour import SlowNoise, decay, slow_noise

SIZES = (0.45e-6, 1e-6, 2e-6)
TONES = (120.0, 240.0, 50.0)


def first_order(random: np.random.Generator, count: int, rate: float, corner: float) -> np.ndarray:
    """First-order noise of variance 1."""
    from scipy.signal import lfilter

    a = float(decay(np.array([corner]), 1.0 / rate)[0])
    noise = np.sqrt(1.0 - a * a) * random.standard_normal(count)
    noise[0] /= np.sqrt(1.0 - a * a)
    return lfilter([1.0], [1.0, -a], noise)


def flicker(random: np.random.Generator, count: int) -> np.ndarray:
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
