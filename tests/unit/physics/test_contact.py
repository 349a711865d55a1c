"""Contact force: values of the law, no pull, and its derivative and energy."""

from __future__ import annotations

import pytest

from rotordrop.physics.contact import elastic_contact_energy, hunt_crossley_force, hunt_crossley_gradient

K, N, LAM = 8.3e8, 10.0 / 9.0, 0.08


def test_force_of_a_line_contact():
    """10 µm at 8.3e8 N/m^(10/9): K δ^(10/9), and 1.5 λ δ̇ more while it closes."""
    still = hunt_crossley_force(1e-5, 0.0, K, N, LAM)
    assert still == pytest.approx(8.3e8 * 1e-5 * 1e-5 ** (1.0 / 9.0), rel=1e-12)
    assert still == pytest.approx(2309.6, rel=1e-3)
    assert hunt_crossley_force(1e-5, 0.5, K, N, LAM) == pytest.approx(1.06 * still, rel=1e-12)
    assert hunt_crossley_force(1e-5, -0.5, K, N, LAM) == pytest.approx(0.94 * still, rel=1e-12)


@pytest.mark.parametrize(("delta", "rate"), [(-1e-6, 0.1), (0.0, 0.1), (1e-6, -8.4), (1e-6, -20.0)])
def test_contact_never_pulls(delta, rate):
    assert hunt_crossley_force(delta, rate, K, N, LAM) == 0.0
    assert hunt_crossley_gradient(delta, rate, K, N, LAM) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("rate", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize("delta", [2e-7, 1e-5])
def test_gradient_is_the_derivative(delta, rate):
    force, by_delta, by_rate = hunt_crossley_gradient(delta, rate, K, N, LAM)
    assert force == hunt_crossley_force(delta, rate, K, N, LAM)
    h = 1e-4 * delta
    upper, lower = (hunt_crossley_force(delta + s, rate, K, N, LAM) for s in (h, -h))
    assert by_delta == pytest.approx((upper - lower) / (2 * h), rel=1e-6)
    upper, lower = (hunt_crossley_force(delta, rate + s, K, N, LAM) for s in (1e-3, -1e-3))
    assert by_rate == pytest.approx((upper - lower) / 2e-3, rel=1e-9)


def test_energy_is_the_work_of_the_elastic_force():
    h = 1e-9
    upper, lower = (elastic_contact_energy(1e-5 + s, K, N) for s in (h, -h))
    assert (upper - lower) / (2 * h) == pytest.approx(hunt_crossley_force(1e-5, 0.0, K, N, LAM), rel=1e-7)
    assert elastic_contact_energy(-1e-6, K, N) == 0.0
    assert elastic_contact_energy(1e-12, K, N) == pytest.approx(0.0, abs=1e-12)
