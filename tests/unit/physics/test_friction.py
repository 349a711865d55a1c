"""Stribeck friction: the curve's corners, its smoothness and its derivative."""

from __future__ import annotations

import math

import pytest

from rotordrop.physics.friction import stribeck_coefficient, stribeck_gradient

STATIC, DYNAMIC, DECAY, SMOOTH = 0.13, 0.10, 0.5, 0.02
LAW = (STATIC, DYNAMIC, DECAY, SMOOTH)


def test_corners_of_the_curve():
    assert stribeck_coefficient(0.0, *LAW) == 0.0
    assert stribeck_coefficient(SMOOTH, *LAW) == pytest.approx(STATIC, rel=1e-14)
    assert stribeck_coefficient(SMOOTH + DECAY, *LAW) == pytest.approx(DYNAMIC + 0.03 / math.e, rel=1e-12)
    assert stribeck_coefficient(100.0, *LAW) == pytest.approx(DYNAMIC, rel=1e-12)


@pytest.mark.parametrize("speed", [0.003, 0.0199, 0.02, 0.4, 13.0])
def test_the_coefficient_is_odd_and_the_gradient_even(speed):
    assert stribeck_coefficient(-speed, *LAW) == -stribeck_coefficient(speed, *LAW) < 0.0
    assert stribeck_gradient(-speed, *LAW)[1] == stribeck_gradient(speed, *LAW)[1]


@pytest.mark.parametrize("speed", [-0.7, -0.015, -0.001, 0.004, 0.012, 0.019, 0.05, 0.5, 2.0])
def test_gradient_is_the_derivative(speed):
    value, slope = stribeck_gradient(speed, *LAW)
    assert value == pytest.approx(stribeck_coefficient(speed, *LAW), rel=1e-14)
    h = 1e-6
    upper, lower = (stribeck_coefficient(speed + s, *LAW) for s in (h, -h))
    assert slope == pytest.approx((upper - lower) / (2 * h), rel=1e-5)


def test_value_and_slope_continue_at_the_smoothing_speed():
    below, above = SMOOTH * (1 - 1e-9), SMOOTH * (1 + 1e-9)
    assert stribeck_coefficient(below, *LAW) == pytest.approx(stribeck_coefficient(above, *LAW), rel=1e-8)
    assert stribeck_gradient(below, *LAW)[1] == pytest.approx(stribeck_gradient(above, *LAW)[1], rel=1e-5)
    assert stribeck_gradient(above, *LAW)[1] == pytest.approx(-0.03 / DECAY, rel=1e-6)
