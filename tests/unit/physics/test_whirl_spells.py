"""Whirl is told from swinging: sense and frequency of synthetic motion."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.physics.whirl_spells import whirl_spells

GAP = 250e-6
TIME = np.arange(0.0, 0.2, 5e-5)


def circle(frequency, *, time=TIME, radius=1.02 * GAP, phase=0.0):
    angle = 2 * np.pi * frequency * time + phase
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def pendulum(amplitude, frequency=29.0):
    angle = -0.5 * np.pi + amplitude * np.cos(2 * np.pi * frequency * TIME)
    return 1.02 * GAP * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("frequency", [30.0, -30.0, 92.0, -92.0, 250.0, -250.0])
def test_sense_and_frequency_of_a_circle(frequency):
    (spell,) = whirl_spells(TIME, circle(frequency), GAP)
    assert spell.frequency == pytest.approx(frequency, abs=0.05)
    assert spell.duration == pytest.approx(TIME[-1], abs=1.5e-4)
    (mirrored,) = whirl_spells(TIME, circle(frequency), GAP, spin=-300.0)
    assert mirrored.frequency == pytest.approx(-frequency, abs=0.05)


@pytest.mark.parametrize("amplitude", [0.1, 0.5, 1.5, 3.0])
def test_a_pendulum_does_not_whirl_however_far_it_swings(amplitude):
    assert whirl_spells(TIME, pendulum(amplitude), GAP) == ()


def test_noise_and_bounces_neither_make_nor_end_whirl():
    random = np.random.default_rng(1)
    noise = 1e-6 * random.standard_normal((len(TIME), 2))
    bounces = 1.0 - 0.3 * np.abs(np.sin(2 * np.pi * 170 * TIME))[:, None]
    (spell,) = whirl_spells(TIME, circle(-80.0) * bounces + noise, GAP)
    assert spell.frequency == pytest.approx(-80.0, abs=0.1)
    assert whirl_spells(TIME, pendulum(0.4) * bounces + noise, GAP) == ()


def test_swinging_then_backward_then_forward_whirl():
    third = len(TIME) // 3
    path = np.concatenate(
        [
            pendulum(0.8)[:third],
            circle(-90.0, time=TIME[:third], phase=-1.5),
            circle(120.0, time=TIME[: len(TIME) - 2 * third], phase=1.0),
        ]
    )
    spells = whirl_spells(TIME, path, GAP)
    assert [round(spell.frequency) for spell in spells] == [-90, 120]
    assert spells[0].start == pytest.approx(TIME[third], abs=0.02)
    assert spells[1].start == pytest.approx(TIME[2 * third], abs=0.01)


def test_one_turn_is_no_whirl_and_a_crossing_of_the_middle_ends_it():
    assert whirl_spells(TIME, circle(9.0), GAP) == ()
    path = circle(60.0)
    path[2000:2010] *= 0.3
    assert len(whirl_spells(TIME, path, GAP)) == 2


def test_a_rotor_that_flies_through_the_middle_does_not_whirl():
    assert whirl_spells(TIME, circle(60.0, radius=0.3 * GAP), GAP) == ()
