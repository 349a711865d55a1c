"""What turns and brakes: surface speed, drag of a race, air, remanence, support."""

from __future__ import annotations

import math

import pytest

from rotordrop.physics.aerodynamics import exponential_deceleration, speed_dependent_deceleration
from rotordrop.physics.remanence import remanent_fraction
from rotordrop.physics.spin import race_drag_torque, surface_speed


def test_surface_speed_of_a_rotor_that_rolls_is_zero():
    """35 mm at 100 rad/s against a race of 35.28 mm: 3.5 m/s at rest, zero at 99.2 rad/s."""
    assert surface_speed(0.0, 100.0, 0.035, 0.0, 0.03528) == pytest.approx(3.5)
    assert surface_speed(0.0, 100.0, 0.035, 100.0 * 0.035 / 0.03528, 0.03528) == pytest.approx(0.0, abs=1e-12)
    assert surface_speed(-0.2, 100.0, 0.035, 50.0, 0.03528) == pytest.approx(-0.2 + 3.5 - 1.764)


def test_drag_of_a_race_brakes_it_either_way():
    """0.002 of 1000 N on half of 85 mm: 0.085 N m."""
    assert race_drag_torque(1000.0, 200.0, 0.002, 0.085, 1.0) == pytest.approx(0.085, rel=1e-12)
    assert race_drag_torque(1000.0, -200.0, 0.002, 0.085, 1.0) == pytest.approx(-0.085, rel=1e-12)
    assert race_drag_torque(1000.0, 1.0, 0.002, 0.085, 2.0) == pytest.approx(0.085 * math.tanh(0.5))


def test_exponential_deceleration_is_the_derivative_of_the_profile():
    h, omega_0, tau = 1e-5, 377.0, 5.9
    profile = [omega_0 * math.exp(-(0.3 + s) / tau) for s in (h, -h)]
    expected = (profile[0] - profile[1]) / (2 * h)
    assert exponential_deceleration(0.3, omega_0, tau) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("omega", [-300.0, -1.0, 2.0, 377.0])
def test_air_brakes_either_way(omega):
    found = speed_dependent_deceleration(omega, 0.03, 2e-4)
    assert found == pytest.approx(-math.copysign(0.03 * abs(omega) + 2e-4 * omega**2, omega))


def test_remanence_starts_when_the_magnets_let_go():
    assert remanent_fraction(0.0009, 0.001, 0.002) == 0.0
    assert remanent_fraction(0.001, 0.001, 0.002) == 1.0
    assert remanent_fraction(0.003, 0.001, 0.002) == pytest.approx(1.0 / math.e)
    assert remanent_fraction(0.003, 0.001, 0.0) == 0.0
