"""The levitated part of a record, and velocities."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.measurement import fit_levitated, local_polynomial, velocity, without_hum
from rotordrop.measurement.preprocess import acceleration

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


def test_the_other_mains_frequency_is_found(drop):
    assert fit_levitated(levitated(drop, mains=60.0), 0.0, speed=150.0 * HZ).hum == 60.0


def test_hum_too_near_to_the_speed_is_left_alone(drop):
    """At 51 Hz a quarter of a second does not tell 50 Hz from 1X; 60 Hz it does."""
    model = fit_levitated(levitated(drop, frequency=51.0, hum=0.0), 0.0, speed=51.0 * HZ)
    assert model.hum == 60.0


def test_hum_is_taken_off(drop):
    record = levitated(drop, hum=5e-6)
    clean = without_hum(record, fit_levitated(record, 0.0, speed=150.0 * HZ))
    left = fit_levitated(clean, 0.0, speed=150.0 * HZ)
    assert np.max(np.abs(left.amplitudes[2])) < 5e-8
    assert clean.notes[-1] == "mains hum of 50 Hz taken off"


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


def test_velocity_is_exact_for_a_parabola():
    time = np.arange(200) / RATE
    path = np.column_stack([3e-4 * time - 4.9 * time**2, 1e-3 * time])
    np.testing.assert_allclose(
        velocity(path, RATE), np.column_stack([3e-4 - 9.8 * time, np.full(200, 1e-3)]), atol=1e-12
    )
    np.testing.assert_allclose(acceleration(path, RATE), np.tile([-9.8, 0.0], (200, 1)), atol=1e-7)


def test_a_velocity_window_longer_than_the_record_is_refused():
    with pytest.raises(RecordError, match=r"window of 0.001 s has 21 samples; the record has 10"):
        velocity(np.zeros(10), RATE)


def test_both_sides_of_the_drop_give_a_far_better_velocity_than_a_difference():
    """20 kHz, 1 µm noise: a raw difference errs by 0.028 m/s, the polynomial by its stated error."""
    rng = np.random.default_rng(5)
    time = np.arange(-60, 61) / RATE
    errors, stated = [], []
    for _ in range(200):
        values = (-0.074 * time - 4.9 * time**2 + 1e-6 * rng.normal(size=len(time)))[:, None]
        value, slope, error = local_polynomial(time, values, 0.0, width=4e-3)
        errors.append(slope[0] + 0.074)
        stated.append(error[0])
        assert abs(value[0]) < 2e-6
    assert np.std(errors) < 2e-4
    assert np.std(errors) == pytest.approx(np.mean(stated), rel=0.15)


def test_a_polynomial_needs_samples(drop):
    with pytest.raises(
        RecordError, match=r"3 samples within 5e-05 s of 0 s; a polynomial of order 2 needs at least 4"
    ):
        local_polynomial(drop.time, drop.signals, 0.0, width=1e-4)
