"""Balls of a race: the force of each, the largest, energy and stiffness, and what their inertia adds."""

import dataclasses
import math

import numpy as np
import pytest
from tests.plain_bearing import BallBearingGeometry

from rotordrop.errors import SimulationError
from rotordrop.machine import example_machine
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.physics.ball_loads import ball_loads, displacement_under, loads_and_angles
from rotordrop.physics.ball_set import (
    ball_set_energy,
    ball_set_entries,
    ball_set_force,
    ball_set_gradient,
    ball_set_load,
    balls_of,
    lane_sum,
)
from rotordrop.physics.fast_balls import FastBalls, ball_equilibrium

RADIAL, AXIAL, GROOVE, K = 5.18e-4, 2.47e-4, 5.715e-4, 1.06e10
ENTRIES = np.array([K, GROOVE, RADIAL, AXIAL, 1.0])
SHIFTS = [(0.0, 0.0), (3e-6, -8e-6), (-11e-6, 2e-6), (0.0, -40e-6)]


@pytest.fixture
def balls():
    """23 balls that stand for two each, without symmetry, and one entry of padding that stands for none."""
    angles = np.append(0.6 * math.pi + 2.0 * math.pi * np.arange(23) / 23, 0.0)
    weights = np.append(np.full(23, 2.0), 0.0)
    return np.array([np.cos(angles), np.sin(angles), weights])


def squeezes(shift, balls):
    across = RADIAL + shift[0] * balls[0] + shift[1] * balls[1]
    return np.maximum(np.hypot(across, AXIAL) - GROOVE, 0.0)


@pytest.mark.parametrize("shift", SHIFTS)
def test_largest_load_and_energy_of_all_balls(balls, shift):
    real = squeezes(shift, balls)[:23]
    found = ball_set_load(ENTRIES, balls, *shift)[0]
    assert found == pytest.approx(K * np.max(real) ** 1.5, rel=1e-9)
    found = ball_set_energy(ENTRIES, balls, *shift)
    assert found == pytest.approx(np.sum(balls[2] * 0.4 * K * squeezes(shift, balls) ** 2.5), rel=1e-9)


def test_padding_and_balls_out_of_contact_carry_no_load_and_lanes_add_everything(balls):
    """Pushed towards the padded entry, away from every ball."""
    alone = balls.copy()
    alone[2, :23] = 0.0
    alone[2, 11] = 1.0
    found = ball_set_load(ENTRIES, alone, 20e-6, 0.0)[0]
    expected = K * squeezes((20e-6, 0.0), balls)[11] ** 1.5
    assert found == pytest.approx(expected, rel=1e-9)
    assert found < 0.5 * K * squeezes((20e-6, 0.0), balls)[23] ** 1.5
    loose = np.array([K, GROOVE + 50e-6, RADIAL, AXIAL, 1.0])
    assert ball_set_load(loose, balls, 1e-6, 2e-6) == (0.0, 0.0)
    assert ball_set_energy(loose, balls, 1e-6, 2e-6) == 0.0
    assert ball_set_force(loose, balls, 1e-6, 2e-6, np.empty((2, 24))) == (0.0, 0.0)
    assert ball_set_gradient(loose, balls, 1e-6, 2e-6) == (0.0, 0.0, 0.0, 0.0, 0.0)
    values = np.arange(24.0) ** 2
    assert lane_sum(values) == 4324.0


BALLS = {"ball_diameter": 9.525e-3, "conformity_inner": 0.53, "conformity_outer": 0.53}
WIDE = BALLS | {"ball_count": 23, "pitch_diameter": 85e-3, "contact_angle": 0.436, "preload": 200.0}
PLAY = BALLS | {"ball_count": 9, "pitch_diameter": 46e-3, "contact_angle": 0.0, "preload": 0.0}
PAIR, TURNED = BallBearingGeometry(**WIDE), BallBearingGeometry(**WIDE, second_row_offset=0.5)
DEEP = BallBearingGeometry(**PLAY, clearance=20e-6, arrangement="single")
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


@pytest.mark.parametrize("size", [1e-4, 1e-2, 1.0, 1e2, 1e4])
def test_a_race_with_play_bears_a_force_of_any_size_in_any_direction(size):
    constants = bearing_constants(DEEP)
    angles = constants.row_ball_angles
    at = np.linspace(0.0, 2.0 * np.pi, 401)
    force = size * np.stack([np.cos(at), np.sin(at)], axis=1)
    found = displacement_under(constants, force)
    load, contact = loads_and_angles(constants, found)
    push = load * np.cos(contact)
    pushed = np.stack([(push * np.cos(angles)).sum(axis=(1, 2)), (push * np.sin(angles)).sum(axis=(1, 2))], 1)
    np.testing.assert_allclose(pushed, -force, atol=1e-6 * size)


def test_pairs_carry_their_preload_and_a_force_that_no_bearing_bears_is_refused():
    none = np.zeros((1, 2))
    pair, deep = bearing_constants(PAIR), bearing_constants(DEEP)
    np.testing.assert_allclose(
        ball_loads(pair, displacement_under(pair, none)), pair.preload_ball_load, rtol=1e-6
    )
    np.testing.assert_array_equal(ball_loads(deep, displacement_under(deep, none)), 0.0)
    constants = bearing_constants(PAIR)
    bearable, beyond = np.array([[0.0, -1e4]]), np.array([[0.0, -1e4], [0.0, -1e12]])
    assert 1e-6 < abs(displacement_under(constants, bearable)[0, 1]) < 1e-4
    with pytest.raises(SimulationError, match=r"1e\+12 N \(1 of 2 instants"):
        displacement_under(constants, beyond)


PLACES = np.array([-30e-6, -8e-6, 0.0, 12e-6, 60e-6])


@pytest.fixture(scope="module")
def numbers():
    return example_machine("paper").touchdown_bearings[0].bearing.numbers()


@pytest.fixture(scope="module")
def inert_balls(numbers):
    return FastBalls.of(numbers.balls, numbers.constants)


@pytest.mark.parametrize("force", [0.05, 20.0, 150.0])
def test_loads_balance_the_centrifugal_force(inert_balls, force):
    ball = ball_equilibrium(inert_balls, inert_balls.axial_offset, inert_balls.radial_offset + PLACES, force)
    axial = ball.inner_load * np.sin(ball.inner_angle) - ball.outer_load * np.sin(ball.outer_angle)
    radial = ball.inner_load * np.cos(ball.inner_angle) - ball.outer_load * np.cos(ball.outer_angle)
    assert np.max(np.abs(axial)) < 1e-6
    assert radial == pytest.approx(-force, abs=1e-6)


@pytest.mark.parametrize("force", [0.05, 20.0, 150.0])
def test_force_is_the_gradient_of_the_energy(inert_balls, force):
    step = 1e-9

    def at(axial=0.0, radial=0.0, more=0.0):
        places = inert_balls.radial_offset + PLACES + radial
        return ball_equilibrium(inert_balls, inert_balls.axial_offset + axial, places, force + more)

    ball = at()
    slope = (at(radial=step).energy - at(radial=-step).energy) / (2.0 * step)
    assert ball.radial_force == pytest.approx(slope, rel=1e-6, abs=1e-4)
    slope = (at(axial=step).energy - at(axial=-step).energy) / (2.0 * step)
    assert ball.axial_force == pytest.approx(slope, rel=1e-6, abs=1e-4)
    slope = (at(radial=step).radial_force - at(radial=-step).radial_force) / (2.0 * step)
    assert ball.radial_stiffness == pytest.approx(slope, rel=1e-4, abs=1e2)
    slope = (at(more=1e-3).energy - at(more=-1e-3).energy) / 2e-3
    assert -ball.radial == pytest.approx(slope, rel=1e-6)


def test_slow_balls_press_as_in_the_drop_model_and_fast_ones_on_the_outer_race(numbers, inert_balls):
    ball = ball_equilibrium(inert_balls, inert_balls.axial_offset, inert_balls.radial_offset + PLACES, 0.0)
    A = np.hypot(inert_balls.radial_offset + PLACES, inert_balls.axial_offset)
    delta = np.maximum(A - numbers.constants.groove_distance, 0.0)
    assert ball.inner_load == pytest.approx(numbers.constants.ball_stiffness * delta**1.5, rel=1e-9, abs=1e-9)
    assert ball.outer_load == pytest.approx(ball.inner_load, rel=1e-9, abs=1e-9)
    straight = dataclasses.replace(inert_balls, axial_offset=0.0)
    radial = inert_balls.inner_groove + inert_balls.outer_groove + 10e-6
    ball = ball_equilibrium(straight, 0.0, radial, 40.0)
    assert ball.outer_load == pytest.approx(ball.inner_load + 40.0, rel=1e-9)
    empty = inert_balls.outer_stiffness * 10e-6**1.5
    below, above = (ball_equilibrium(straight, 0.0, radial, share * empty) for share in (0.99, 1.01))
    assert below.inner_load[0] > 0.0 == above.inner_load[0]
