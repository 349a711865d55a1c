"""Balls of a race that moves in its plane: largest load, energy and stiffness from the force of one ball."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.physics.ball_set import (
    ball_set_energy,
    ball_set_force,
    ball_set_gradient,
    ball_set_load,
    lane_sum,
)

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


def force(shift, balls):
    return ball_set_force(ENTRIES, balls, *shift, np.empty((2, 24)))


@pytest.mark.parametrize("shift", SHIFTS)
def test_largest_load_is_that_of_the_ball_squeezed_most(balls, shift):
    real = squeezes(shift, balls)[:23]
    found = ball_set_load(ENTRIES, balls, *shift)[0]
    assert found == pytest.approx(K * np.max(real) ** 1.5, rel=1e-9)


def test_padding_carries_no_load(balls):
    """Pushed towards the padded entry, away from every ball."""
    alone = balls.copy()
    alone[2, :23] = 0.0
    alone[2, 11] = 1.0
    found = ball_set_load(ENTRIES, alone, 20e-6, 0.0)[0]
    expected = K * squeezes((20e-6, 0.0), balls)[11] ** 1.5
    assert found == pytest.approx(expected, rel=1e-9)
    assert found < 0.5 * K * squeezes((20e-6, 0.0), balls)[23] ** 1.5


def test_balls_out_of_contact_carry_no_load(balls):
    loose = np.array([K, GROOVE + 50e-6, RADIAL, AXIAL, 1.0])
    assert ball_set_load(loose, balls, 1e-6, 2e-6) == (0.0, 0.0)
    assert ball_set_energy(loose, balls, 1e-6, 2e-6) == 0.0
    assert ball_set_force(loose, balls, 1e-6, 2e-6, np.empty((2, 24))) == (0.0, 0.0)
    assert ball_set_gradient(loose, balls, 1e-6, 2e-6) == (0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("shift", SHIFTS)
def test_energy_of_all_balls(balls, shift):
    found = ball_set_energy(ENTRIES, balls, *shift)
    assert found == pytest.approx(np.sum(balls[2] * 0.4 * K * squeezes(shift, balls) ** 2.5), rel=1e-9)


@pytest.mark.parametrize("shift", SHIFTS[1:])
def test_force_is_the_slope_of_the_energy_and_stiffness_that_of_the_force(balls, shift):
    h = 1e-9
    steps = [np.array([h, 0.0]), np.array([0.0, h])]
    found = ball_set_gradient(ENTRIES, balls, *shift)
    assert found[:2] == pytest.approx(force(shift, balls), rel=1e-9, abs=1e-6)
    slope = []
    for step in steps:
        upper, lower = np.array(shift) + step, np.array(shift) - step
        energies = [ball_set_energy(ENTRIES, balls, *s) for s in (upper, lower)]
        slope.append((energies[0] - energies[1]) / (2 * h))
    assert slope == pytest.approx(force(shift, balls), rel=1e-5, abs=1e-2)
    columns = [
        (np.array(force(np.array(shift) + s, balls)) - force(np.array(shift) - s, balls)) / (2 * h)
        for s in steps
    ]
    expected = [columns[0][0], columns[0][1], columns[1][1]]
    assert found[2:] == pytest.approx(expected, rel=1e-4, abs=1e-5 * abs(expected[0]))


def test_lane_sum_adds_everything():
    values = np.arange(24.0) ** 2
    assert lane_sum(values) == 4324.0
