"""Bearings with radial clearance: contact angle, play, and how many balls carry a radial load."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.physics.ball_bearing import bearing_constants, free_contact_angle
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.physics.ball_set import loose_race_seat, static_deflection

GROOVES = BallBearingGeometry(
    ball_diameter=12.7e-3,
    ball_count=9,
    pitch_diameter=65e-3,
    contact_angle=0.0,
    conformity_inner=0.52,
    conformity_outer=0.52,
    ball_youngs_modulus=208e9,
    ball_poisson_ratio=0.3,
    clearance=15e-6,
    arrangement="single",
)
"""A 209 bearing, the example of Harris, Rolling Bearing Analysis."""

SJOVALL = {0.1: 0.1156, 0.2: 0.1590, 0.3: 0.1892, 0.4: 0.2117, 0.5: 0.2288}
"""Sjövall's radial integral of point contacts by the extent of the load zone (Harris, load integrals)."""


def loads(bearing, load):
    """Ball loads of a loose bearing with its race at rest under a load downwards."""
    constants = bearing_constants(bearing)
    dx, dy = loose_race_seat(constants, load)
    response = bearing_response(constants, [dx, dy, 0.0, 0.0, 0.0])
    assert response.force[:2] == pytest.approx([0.0, load], abs=1e-9 * load)
    return response.ball_loads


def test_free_contact_angle_and_end_play_of_a_209_bearing():
    constants = bearing_constants(GROOVES)
    assert math.degrees(constants.contact_angle) == pytest.approx(9.0 + 52.0 / 60.0, abs=0.02)
    assert constants.axial_play == pytest.approx(0.1739e-3, rel=1e-3)
    assert free_contact_angle(0.0, 1e-3) == 0.0


def test_within_its_play_a_loose_bearing_has_no_force():
    constants = bearing_constants(GROOVES)
    assert constants.radial_play == pytest.approx(7.5e-6, rel=1e-12)
    for part, axis in ((constants.radial_play, 1), (0.5 * constants.axial_play, 2)):
        for share, touches in ((0.999, False), (1.001, True)):
            q = np.zeros(5)
            q[axis] = share * part
            assert (np.max(bearing_response(constants, q).ball_loads) > 0.0) == touches


@pytest.mark.parametrize("epsilon", SJOVALL)
def test_the_load_zone_is_that_of_sjovalls_integral(epsilon):
    # ε = ½ (1 − P_d / (2 δ_r)) with the shift δ_r of the race; many balls make the sum an integral.
    many = replace(GROOVES, ball_count=1200, ball_diameter=1e-3, clearance=15e-6 if epsilon < 0.5 else 0.0)
    constants = bearing_constants(many)
    shift = 7.5e-6 / (1.0 - 2.0 * epsilon) if epsilon < 0.5 else 10e-6
    response = bearing_response(constants, [0.0, -shift, 0.0, 0.0, 0.0])
    share = response.force[1] / (1200 * np.max(response.ball_loads))
    assert share == pytest.approx(SJOVALL[epsilon], abs=1e-4)
    zone = np.mean(response.ball_loads > 0.0)
    assert zone == pytest.approx(math.acos(1.0 - 2.0 * epsilon) / math.pi, abs=2e-3)
    dx, dy = loose_race_seat(constants, float(response.force[1]))
    assert (dx, dy) == pytest.approx((0.0, -shift), abs=1e-13)


def test_stribecks_number_is_4_37_without_clearance_and_grows_past_5_with_it():
    factors = [
        60 * np.max(loads(replace(GROOVES, ball_count=60, ball_diameter=2e-3, clearance=c), 500.0)) / 500.0
        for c in (0.0, 2e-6, 5e-6, 15e-6, 40e-6)
    ]
    assert factors[0] == pytest.approx(4.37, abs=0.01)
    assert np.all(np.diff(factors) > 0.0)
    assert factors[-1] > 5.0


@pytest.mark.parametrize("clearance", [0.0, 15e-6, 60e-6])
@pytest.mark.parametrize("phase", [0.0, 0.1, 0.25, 0.4, 0.5])
@pytest.mark.parametrize("count", [3, 5, 9])
def test_a_few_balls_carry_the_load_wherever_the_first_one_stands(clearance, phase, count):
    turned = replace(
        GROOVES, ball_count=count, clearance=clearance, first_ball_angle=phase * 2.0 * math.pi / count
    )
    for load in (1.0, 300.0, 20e3):
        carried = loads(turned, load)
        assert np.sum(carried > 0.0) >= 1
        deflection, stiffness = static_deflection(bearing_constants(turned), load)
        assert deflection > 0.5 * clearance
        more, _ = static_deflection(bearing_constants(turned), load * (1.0 + 1e-6))
        assert stiffness == pytest.approx(1e-6 * load / (more - deflection), rel=2e-3)


def test_a_pair_that_just_touches_is_the_limit_of_a_vanishing_preload():
    pair = replace(GROOVES, contact_angle=math.radians(15.0), clearance=None, arrangement="X", ball_count=19)
    least = static_deflection(bearing_constants(replace(pair, preload=1e-6)), 800.0)
    assert static_deflection(bearing_constants(pair), 800.0) == pytest.approx(least, rel=1e-4)


def test_a_pair_mounted_with_play_touches_at_the_end_of_it_with_less_angle():
    pair = replace(GROOVES, contact_angle=math.radians(15.0), clearance=20e-6, arrangement="X")
    constants = bearing_constants(pair)
    A = constants.groove_distance
    assert constants.radial_play == pytest.approx(10e-6, rel=1e-9)
    assert math.cos(constants.radial_contact_angle) == pytest.approx(math.cos(math.radians(15.0)) + 10e-6 / A)
    assert constants.axial_offset < A * math.sin(math.radians(15.0))


def test_a_preload_on_deep_grooves_acts_at_the_angle_the_clearance_leaves():
    constants = bearing_constants(replace(GROOVES, preload=200.0, arrangement="X"))
    response = bearing_response(constants, np.zeros(5))
    assert constants.preloaded
    assert constants.radial_play == 0.0
    assert np.min(np.abs(response.contact_angles)) > math.radians(9.86)
    row = np.sum(response.ball_loads[0] * np.abs(np.sin(response.contact_angles[0])))
    assert row == pytest.approx(200.0, rel=1e-9)
