"""Frictional heat: energy is kept, and nothing is hot without friction."""

from __future__ import annotations

import pytest

from rotordrop.physics.thermal import friction_heat, growth_of_race
from rotordrop.physics.whirl import race_spin_up_time

CASE = {
    "F_r": 400.0,
    "mu": 0.1,
    "omega_r": 377.0,
    "R_i": 0.035,
    "race_inertia": 1.3e-3,
    "drag_coefficient": 0.002,
    "D_pw": 0.085,
}


def test_after_spin_up_sliding_has_cost_as_much_as_the_race_has_gained():
    """A constant force that drags a body up to a constant speed loses exactly the energy it gives."""
    sliding, _ = friction_heat(**CASE, duration=10.0)
    assert sliding == pytest.approx(0.5 * CASE["race_inertia"] * CASE["omega_r"] ** 2, rel=1e-12)


def test_the_work_of_friction_is_heat_and_spin_at_every_time():
    spin_up = race_spin_up_time(CASE["race_inertia"], CASE["mu"], CASE["F_r"], CASE["R_i"], CASE["omega_r"])
    torque = CASE["mu"] * CASE["F_r"] * CASE["R_i"]
    for share in (0.1, 0.5, 1.0):
        time = share * spin_up
        sliding, _ = friction_heat(**CASE, duration=time)
        gained = 0.5 * CASE["race_inertia"] * (share * CASE["omega_r"]) ** 2
        assert sliding + gained == pytest.approx(torque * CASE["omega_r"] * time, rel=1e-12)


def test_rolling_at_full_speed_costs_drag_times_speed():
    _, first = friction_heat(**CASE, duration=10.0)
    _, second = friction_heat(**CASE, duration=11.0)
    power = CASE["drag_coefficient"] * CASE["F_r"] * 0.5 * CASE["D_pw"] * CASE["omega_r"]
    assert second - first == pytest.approx(power, rel=1e-12)


@pytest.mark.parametrize("without", ["mu", "F_r"])
def test_no_friction_no_heat(without):
    assert friction_heat(**CASE | {without: 0.0}, duration=0.2) == (0.0, 0.0)


def test_a_hundred_joule_warm_half_a_kilogram_of_steel():
    """Worked by hand: 100 J / (0.5 kg · 460 J/(kg K)) = 0.4348 K; times 12e-6 1/K times 35 mm = 0.1826 µm."""
    warming, growth = growth_of_race(100.0, 0.5, 0.035)
    assert warming == pytest.approx(0.43478, rel=1e-4)
    assert growth == pytest.approx(0.18261e-6, rel=1e-4)
