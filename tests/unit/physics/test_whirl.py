"""Whirl kinematics and race spin-up against the spin and friction kernels."""

from __future__ import annotations

import math

import pytest
from tests.reference.closed_forms import rolling_whirl_speed, whirl_force

from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.physics.spin import surface_speed
from rotordrop.physics.whirl import race_spin_up_time


def test_rolling_whirl_leaves_no_surface_speed() -> None:
    omega_r, R_i, c_r = 377.0, 0.035, 2.75e-4
    backward = -rolling_whirl_speed(omega_r, R_i, c_r)
    whirling = backward * c_r  # velocity of the rotor centre along the tangent x→y
    assert surface_speed(whirling, omega_r, R_i, 0.0, R_i) == pytest.approx(0.0, abs=1e-9)
    assert surface_speed(whirling, omega_r, R_i - c_r, 0.0, R_i) == pytest.approx(-omega_r * c_r, rel=1e-9)


def test_whirl_force_grows_with_the_square_of_the_speed() -> None:
    assert whirl_force(10.0, 1e-4, 300.0) == pytest.approx(9.0 * whirl_force(10.0, 1e-4, 100.0), rel=1e-12)
    assert whirl_force(2.0, 0.5, 3.0) == pytest.approx(9.0, rel=1e-12)


@pytest.mark.parametrize("r_r", [0.035, 0.030])
def test_spin_up_ends_when_the_surfaces_run_together(r_r: float) -> None:
    """Constant torque of the friction kernel until the surface speed vanishes."""
    inertia, mu, F_r, R_i, omega_r = 3e-4, 0.1, 400.0, 0.035, 377.0
    T = race_spin_up_time(inertia, mu, F_r, R_i, omega_r, r_r)
    sliding = stribeck_coefficient(surface_speed(0.0, omega_r, r_r, 0.0, R_i), mu, mu, 0.5, 0.02)
    omega_i = sliding * F_r * R_i / inertia * T
    assert surface_speed(0.0, omega_r, r_r, omega_i, R_i) == pytest.approx(0.0, abs=1e-10)
    assert math.isclose(
        race_spin_up_time(inertia, mu, F_r, R_i, omega_r),
        race_spin_up_time(inertia, mu, F_r, R_i, omega_r, R_i),
    )
