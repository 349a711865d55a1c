"""Contact and what goes with it: no pull, derivative and energy; Stribeck friction; frictional heat."""

import math
from itertools import pairwise

import pytest

from rotordrop.physics.contact import (
    contact_energy,
    contact_force,
    contact_law,
    contact_tangent,
    depth_at,
    stiffness_of_exponent,
)
from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.physics.thermal import friction_heat, growth_of_race
from rotordrop.physics.whirl import race_spin_up_time

K, N, LAM = 8.3e8, 10.0 / 9.0, 0.08
LAW = contact_law(K, N, LAM)


@pytest.mark.parametrize("rate", [-8.4, -20.0])
def test_contact_never_pulls(rate):
    assert contact_force(LAW, 1e-6, rate)[0] == 0.0


def test_energy_is_the_work_of_the_elastic_force_and_another_exponent_as_deep():
    h = 1e-9
    upper, lower = (contact_energy(LAW, 1e-5 + s) for s in (h, -h))
    assert (upper - lower) / (2 * h) == pytest.approx(contact_force(LAW, 1e-5, 0.0)[0], rel=1e-7)
    assert contact_energy(LAW, 1e-12) == pytest.approx(0.0, abs=1e-12)
    other = contact_law(stiffness_of_exponent(LAW, 1500.0, 1.5), 1.5, LAM)
    assert depth_at(other, 1500.0) == pytest.approx(depth_at(LAW, 1500.0), rel=1e-12)


@pytest.mark.parametrize("load", [30.0, 3e4])
def test_depth_carries_the_load_and_the_tangent_is_its_slope(load):
    depth = depth_at(LAW, load)
    assert contact_force(LAW, depth, 0.0)[0] == pytest.approx(load, rel=1e-12)
    upper, lower = (contact_force(LAW, depth * (1.0 + s), 0.0)[0] for s in (1e-5, -1e-5))
    assert contact_tangent(LAW, load) == pytest.approx((upper - lower) / (2e-5 * depth), rel=1e-9)


STATIC, DYNAMIC, DECAY, SMOOTH = 0.13, 0.10, 0.5, 0.02
FRICTION = (STATIC, DYNAMIC, DECAY, SMOOTH)


def test_corners_of_the_curve():
    assert stribeck_coefficient(0.0, *FRICTION) == 0.0
    assert stribeck_coefficient(SMOOTH, *FRICTION) == pytest.approx(STATIC, rel=1e-14)
    assert stribeck_coefficient(SMOOTH + DECAY, *FRICTION) == pytest.approx(
        DYNAMIC + 0.03 / math.e, rel=1e-12
    )
    assert stribeck_coefficient(100.0, *FRICTION) == pytest.approx(DYNAMIC, rel=1e-12)
    below, above = SMOOTH * (1 - 1e-9), SMOOTH * (1 + 1e-9)
    assert stribeck_coefficient(below, *FRICTION) == pytest.approx(
        stribeck_coefficient(above, *FRICTION), rel=1e-8
    )
    step = 1e-8 * SMOOTH
    ends = [stribeck_coefficient(SMOOTH + s, *FRICTION) for s in (-step, 0.0, step)]
    slopes = [(high - low) / step for low, high in pairwise(ends)]
    assert slopes == pytest.approx([-0.03 / DECAY] * 2, rel=1e-5)


CASE = {"F_r": 400.0, "mu": 0.1, "omega_r": 377.0, "R_i": 0.035, "race_inertia": 1.3e-3}
CASE |= {"drag_coefficient": 0.002, "D_pw": 0.085}


def test_the_work_of_friction_is_heat_and_spin_at_every_time_and_then_drag():
    """A constant force that drags a body up to a constant speed loses exactly the energy it gives."""
    sliding, _ = friction_heat(**CASE, duration=10.0)
    assert sliding == pytest.approx(0.5 * CASE["race_inertia"] * CASE["omega_r"] ** 2, rel=1e-12)
    spin_up = race_spin_up_time(CASE["race_inertia"], CASE["mu"], CASE["F_r"], CASE["R_i"], CASE["omega_r"])
    torque = CASE["mu"] * CASE["F_r"] * CASE["R_i"]
    for share in (0.1, 0.5, 1.0):
        time = share * spin_up
        sliding, _ = friction_heat(**CASE, duration=time)
        gained = 0.5 * CASE["race_inertia"] * (share * CASE["omega_r"]) ** 2
        assert sliding + gained == pytest.approx(torque * CASE["omega_r"] * time, rel=1e-12)
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
