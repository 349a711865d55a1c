"""Load of every single ball: sums to the force on the race, and is found back from it."""

import numpy as np
import pytest

from rotordrop.errors import SimulationError
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry
from rotordrop.physics.ball_loads import ball_loads, displacement_under
from rotordrop.physics.ball_set import ball_set_entries, ball_set_gradient, ball_set_load, balls_of

GROOVES = {"conformity_inner": 0.53, "conformity_outer": 0.53}
PAIR = BallBearingGeometry(
    ball_diameter=9.525e-3,
    ball_count=23,
    pitch_diameter=85e-3,
    contact_angle=0.436,
    preload=200.0,
    **GROOVES,
)
TURNED = BallBearingGeometry(**{**vars(PAIR), "second_row_offset": 0.5})
DEEP = BallBearingGeometry(
    ball_diameter=9.525e-3,
    ball_count=9,
    pitch_diameter=46e-3,
    contact_angle=0.0,
    preload=0.0,
    clearance=20e-6,
    arrangement="single",
    **GROOVES,
)
MOVED = np.array([[12e-6, -25e-6], [0.0, -40e-6], [-30e-6, 5e-6]])


@pytest.mark.parametrize("bearing", [PAIR, TURNED, DEEP])
def test_balls_sum_to_the_force_of_the_whole_set(bearing):
    constants = bearing_constants(bearing)
    loads = ball_loads(constants, MOVED)
    assert loads.shape == (3, constants.row_count, bearing.ball_count)
    entries, balls = ball_set_entries(constants), balls_of(constants)
    for k, (dx, dy) in enumerate(MOVED):
        largest, _ = ball_set_load(entries, balls, dx, dy)
        assert loads[k].max() == pytest.approx(largest, rel=1e-9)
        radial = constants.radial_offset + dx * np.cos(constants.row_ball_angles)
        radial += dy * np.sin(constants.row_ball_angles)
        share = radial / np.hypot(radial, constants.axial_offset)
        force = [
            float(np.sum(loads[k] * share * direction))
            for direction in (np.cos(constants.row_ball_angles), np.sin(constants.row_ball_angles))
        ]
        assert force == pytest.approx(ball_set_gradient(entries, balls, dx, dy)[:2], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("bearing", [PAIR, TURNED, DEEP])
def test_the_displacement_is_found_back_from_the_force_on_the_race(bearing):
    constants = bearing_constants(bearing)
    entries, balls = ball_set_entries(constants), balls_of(constants)
    force = np.array([-np.array(ball_set_gradient(entries, balls, dx, dy)[:2]) for dx, dy in MOVED])
    found = displacement_under(constants, force)
    np.testing.assert_allclose(
        ball_loads(constants, found), ball_loads(constants, MOVED), rtol=1e-6, atol=1e-6
    )


def test_without_a_force_the_balls_of_a_pair_carry_their_preload_and_loose_ones_nothing():
    none = np.zeros((1, 2))
    pair, deep = bearing_constants(PAIR), bearing_constants(DEEP)
    np.testing.assert_allclose(
        ball_loads(pair, displacement_under(pair, none)), pair.preload_ball_load, rtol=1e-6
    )
    np.testing.assert_array_equal(ball_loads(deep, displacement_under(deep, none)), 0.0)


def test_a_force_that_no_bearing_bears_is_refused_and_not_answered_with_a_place():
    constants = bearing_constants(PAIR)
    bearable, beyond = np.array([[0.0, -1e4]]), np.array([[0.0, -1e4], [0.0, -1e12]])
    assert 1e-6 < abs(displacement_under(constants, bearable)[0, 1]) < 1e-4
    with pytest.raises(SimulationError, match=r"1e\+12 N \(1 of 2 instants"):
        displacement_under(constants, beyond)
