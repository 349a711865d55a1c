"""Fatigue of raceways: limits in which the three ways must agree, and where they must not."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.elements.catalog.inference import dynamic_rating
from rotordrop.severity.fatigue import (
    LIFE,
    ball_row,
    rainflow,
    share_by_16281,
    share_by_rainflow,
    share_by_segments,
)

BALLS, DIAMETER, PITCH = 16, 10e-3, 70e-3
C = dynamic_rating(BALLS, DIAMETER, PITCH, 0.0)
ROW = ball_row(C, BALLS, DIAMETER / PITCH, 1.0, 0.52, 0.52)
SPIN = 2.0 * np.pi * 50.0


def zone(radial, count=BALLS):
    """Ball loads of a radial load without clearance: Q cos^1.5, whose sum along the load is the load."""
    at = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    shape = np.maximum(np.cos(at), 0.0) ** 1.5
    return radial * (count / BALLS) / np.sum(shape * np.cos(at)) * shape


def steady(radial, turns, points=4000, count=BALLS):
    time = np.linspace(0.0, turns * 2.0 * np.pi / SPIN, points)
    return time, np.tile(zone(radial, count), (points, 1)), np.full(points, SPIN)


def test_the_rating_load_lasts_a_million_turns():
    """C is by definition the radial load of that life (ISO 281); 0.407 and 0.389 come from its load zone."""
    share = share_by_16281(ROW, *steady(C, 20.0))
    assert share == pytest.approx(20.0 / LIFE, rel=5e-3)


@pytest.mark.parametrize(("balls", "ratio"), [(8, 0.24), (9, 0.2), (16, 0.12)])
def test_at_a_tenth_of_the_rating_life_is_a_thousand_times_longer(balls, ratio):
    """The load zone of a bearing without play, by ISO/TS 16281, against the rating life by ISO 281."""
    dynamic = dynamic_rating(balls, 10e-3, 10e-3 / ratio, 0.0)
    row = ball_row(dynamic, balls, ratio, 1.0, 0.52, 0.52)
    at = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    shape = np.maximum(np.cos(at), 0.0) ** 1.5
    load = 0.1 * dynamic * (360 / balls) / np.sum(shape * np.cos(at)) * shape
    time = np.array([0.0, 2.0 * np.pi / SPIN])
    share = share_by_16281(row, time, np.tile(load, (2, 1)), np.full(2, SPIN))
    assert share == pytest.approx(1e-3 / LIFE, rel=5e-3)


@pytest.mark.parametrize("ratio", [0.1, 0.5])
def test_life_goes_with_the_cube_of_the_load(ratio):
    whole, less = (share_by_16281(ROW, *steady(part * C, 5.0)) for part in (1.0, ratio))
    assert less == pytest.approx(ratio**3 * whole, rel=1e-9)


def test_segments_are_the_standard_for_a_ring_that_turns_on():
    time, loads, spin = steady(0.3 * C, 60.0, 60_000, count=64)
    fine = np.tile(zone(0.3 * C), (len(time), 1))
    assert share_by_segments(ROW, time, loads, spin, 360) == pytest.approx(
        share_by_16281(ROW, time, fine, spin), rel=0.03
    )


def test_a_part_of_a_turn_harms_a_part_of_the_ring_more():
    """A tenth of a turn: the same passes on few segments; the weakest spot counts more than its share."""
    time, loads, spin = steady(0.3 * C, 0.02, 2000, count=64)
    fine = np.tile(zone(0.3 * C), (len(time), 1))
    ratio = share_by_segments(ROW, time, loads, spin) / share_by_16281(ROW, time, fine, spin)
    assert 1.02 < ratio < 2.0


def test_rainflow_counts_the_example_of_the_standard():
    """ASTM E1049-85, figure 6."""
    counted = rainflow(np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]))
    total = {size: counted[counted[:, 0] == size, 1].sum() for size in np.unique(counted[:, 0])}
    assert total == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}


def test_rainflow_sees_no_balls_rolling_under_a_steady_load():
    time, loads, spin = steady(0.3 * C, 50.0)
    assert share_by_rainflow(ROW, loads.max(axis=1)) == 0.0
    assert share_by_16281(ROW, time, loads, spin) > 0.0
    bounces = 0.3 * C * np.maximum(np.sin(np.linspace(0.0, 60.0 * np.pi, 5000)), 0.0)
    still = np.zeros(5000)
    assert share_by_rainflow(ROW, bounces) > 0.0
    assert share_by_segments(ROW, np.linspace(0, 1, 5000), np.outer(bounces, zone(1.0)), still) == 0.0
