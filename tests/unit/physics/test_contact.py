"""Contact force: values of the law, no pull, and its derivative and energy."""

from __future__ import annotations

import pytest

from rotordrop.physics.contact import (
    contact_energy,
    contact_force,
    contact_gradient,
    contact_law,
    contact_tangent,
    depth_at,
    stiffness_of_exponent,
)

K, N, LAM = 8.3e8, 10.0 / 9.0, 0.08
LAW = contact_law(K, N, LAM)


def test_force_of_a_line_contact():
    """10 µm at 8.3e8 N/m^(10/9): K δ^(10/9), and 1.5 λ δ̇ more while it closes."""
    still, elastic = contact_force(LAW, 1e-5, 0.0)
    assert elastic == still
    assert still == pytest.approx(8.3e8 * 1e-5 * 1e-5 ** (1.0 / 9.0), rel=1e-12)
    assert still == pytest.approx(2309.6, rel=1e-3)
    assert contact_force(LAW, 1e-5, 0.5) == pytest.approx((1.06 * still, still), rel=1e-12)
    assert contact_force(LAW, 1e-5, -0.5) == pytest.approx((0.94 * still, still), rel=1e-12)


@pytest.mark.parametrize("rate", [-8.4, -20.0])
def test_contact_never_pulls(rate):
    assert contact_force(LAW, 1e-6, rate)[0] == 0.0
    assert contact_gradient(LAW, 1e-6, rate) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("rate", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize("delta", [2e-7, 1e-5])
def test_gradient_is_the_derivative(delta, rate):
    force, by_delta, by_rate = contact_gradient(LAW, delta, rate)
    assert force == contact_force(LAW, delta, rate)[0]
    h = 1e-4 * delta
    upper, lower = (contact_force(LAW, delta + s, rate)[0] for s in (h, -h))
    assert by_delta == pytest.approx((upper - lower) / (2 * h), rel=1e-6)
    upper, lower = (contact_force(LAW, delta, rate + s)[0] for s in (1e-3, -1e-3))
    assert by_rate == pytest.approx((upper - lower) / 2e-3, rel=1e-9)


def test_energy_is_the_work_of_the_elastic_force():
    h = 1e-9
    upper, lower = (contact_energy(LAW, 1e-5 + s) for s in (h, -h))
    assert (upper - lower) / (2 * h) == pytest.approx(contact_force(LAW, 1e-5, 0.0)[0], rel=1e-7)
    assert contact_energy(LAW, 1e-12) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("load", [30.0, 3e4])
def test_depth_carries_the_load_and_the_tangent_is_its_slope(load):
    depth = depth_at(LAW, load)
    assert contact_force(LAW, depth, 0.0)[0] == pytest.approx(load, rel=1e-12)
    assert contact_tangent(LAW, load) == pytest.approx(contact_gradient(LAW, depth, 0.0)[1], rel=1e-12)


def test_another_exponent_is_as_deep_under_the_load():
    other = contact_law(stiffness_of_exponent(LAW, 1500.0, 1.5), 1.5, LAM)
    assert depth_at(other, 1500.0) == pytest.approx(depth_at(LAW, 1500.0), rel=1e-12)
