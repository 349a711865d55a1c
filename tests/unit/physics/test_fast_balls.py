"""One ball between grooves under its centrifugal force: balance, energy, limits."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from rotordrop.machine import example_machine
from rotordrop.physics.fast_balls import FastBalls, ball_equilibrium, centred_balls, offset_on_springs

PLACES = np.array([-30e-6, -8e-6, 0.0, 12e-6, 60e-6])


@pytest.fixture(scope="module")
def numbers():
    return example_machine("paper").touchdown_bearings[0].bearing.numbers()


@pytest.fixture(scope="module")
def balls(numbers):
    return FastBalls.of(numbers.balls, numbers.constants)


@pytest.mark.parametrize("force", [0.05, 20.0, 150.0])
def test_loads_balance_the_centrifugal_force(balls, force):
    ball = ball_equilibrium(balls, balls.axial_offset, balls.radial_offset + PLACES, force)
    axial = ball.inner_load * np.sin(ball.inner_angle) - ball.outer_load * np.sin(ball.outer_angle)
    radial = ball.inner_load * np.cos(ball.inner_angle) - ball.outer_load * np.cos(ball.outer_angle)
    assert np.max(np.abs(axial)) < 1e-6
    assert radial == pytest.approx(-force, abs=1e-6)


@pytest.mark.parametrize("force", [0.05, 20.0, 150.0])
def test_force_is_the_gradient_of_the_energy(balls, force):
    step = 1e-9

    def at(axial=0.0, radial=0.0, more=0.0):
        places = balls.radial_offset + PLACES + radial
        return ball_equilibrium(balls, balls.axial_offset + axial, places, force + more)

    ball = at()
    slope = (at(radial=step).energy - at(radial=-step).energy) / (2.0 * step)
    assert ball.radial_force == pytest.approx(slope, rel=1e-6, abs=1e-4)
    slope = (at(axial=step).energy - at(axial=-step).energy) / (2.0 * step)
    assert ball.axial_force == pytest.approx(slope, rel=1e-6, abs=1e-4)
    slope = (at(radial=step).radial_force - at(radial=-step).radial_force) / (2.0 * step)
    assert ball.radial_stiffness == pytest.approx(slope, rel=1e-4, abs=1e2)
    slope = (at(more=1e-3).radial_force - at(more=-1e-3).radial_force) / 2e-3
    assert ball.by_centrifugal == pytest.approx(slope, rel=1e-3, abs=1e-4)
    slope = (at(more=1e-3).energy - at(more=-1e-3).energy) / 2e-3
    assert -ball.radial == pytest.approx(slope, rel=1e-6)


def test_slow_balls_are_those_of_the_drop_model(numbers, balls):
    ball = ball_equilibrium(balls, balls.axial_offset, balls.radial_offset + PLACES, 0.0)
    A = np.hypot(balls.radial_offset + PLACES, balls.axial_offset)
    delta = np.maximum(A - numbers.constants.groove_distance, 0.0)
    assert ball.inner_load == pytest.approx(numbers.constants.ball_stiffness * delta**1.5, rel=1e-9, abs=1e-9)
    assert ball.outer_load == pytest.approx(ball.inner_load, rel=1e-9, abs=1e-9)


def test_without_a_contact_angle_the_outer_race_carries_the_force_in_addition(balls):
    straight = dataclasses.replace(balls, axial_offset=0.0)
    radial = balls.inner_groove + balls.outer_groove + 10e-6
    ball = ball_equilibrium(straight, 0.0, radial, 40.0)
    assert ball.outer_load == pytest.approx(ball.inner_load + 40.0, rel=1e-9)
    empty = balls.outer_stiffness * 10e-6**1.5
    below, above = (ball_equilibrium(straight, 0.0, radial, share * empty) for share in (0.99, 1.01))
    assert below.inner_load[0] > 0.0 == above.inner_load[0]


def test_springs_keep_the_axial_force(numbers, balls):
    constants, omega = numbers.constants, 2.0 * math.pi * 550.0
    offset = offset_on_springs(balls, constants.ball_count, constants.preload, omega)
    ball, _ = centred_balls(balls, omega, offset)
    assert constants.ball_count * ball.axial_force[0] == pytest.approx(constants.preload, rel=1e-9)
    assert offset < constants.axial_offset
