"""Velocities from displacements."""

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.contacts import local_polynomial

RATE = 20000.0


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
