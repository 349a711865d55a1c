"""What draws of a replayed drop are counted into: known motions in, their numbers and spread out."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.replay import draws
from rotordrop.replay.first_impacts import Trial


def drawn(monkeypatch: pytest.MonkeyPatch, results: list[Any], rests: list[np.ndarray], refused: int) -> Any:
    """Draws whose drops and rest positions are given, after some that do not keep to the record."""
    costs = iter([0.0, *([1e9] * refused), *([0.0] * 99)])
    drops, errors = iter(zip(results, rests, strict=True)), dict[int, np.ndarray]()

    def whole_drop(problem: Any, trial: Trial, *, duration: float) -> Any:
        assert duration == 0.2
        result, errors[id(trial)] = next(drops)
        return result

    monkeypatch.setattr(draws, "whole_drop", whole_drop)
    problem: Any = SimpleNamespace(
        table=SimpleNamespace(lower=np.full(1, -9.0), upper=np.full(1, 9.0), sigma=np.ones(1)),
        directions=SimpleNamespace(remaining=np.zeros((1, 1))),
        residual=lambda x, window: np.sqrt([next(costs)]),
        trial=lambda x: Trial(x, np.zeros(1)),
        rest_error=lambda trial: errors[id(trial)],
    )
    return draws.draw_drops(
        problem, np.zeros(1), np.eye(1), window=0.0, duration=0.2, count=len(results), threads=1
    )


def drop(displacement: np.ndarray, force: float, stress: float, step: float) -> Any:
    """A simulated drop of steady force and stress."""
    constant = np.ones(displacement.shape[:2])
    return SimpleNamespace(
        time=step * np.arange(len(displacement)),
        displacement=displacement,
        bearing_force_magnitude=force * constant,
        max_stress=stress * constant,
    )


def test_the_spread_of_draws_is_their_root_mean_square_distance_from_the_mean_orbit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Orbits 3 µm left and right and 4 µm up and down of their mean: 5 µm apart from it, each of them."""
    mean = np.random.default_rng(1).normal(size=(900, 2, 2)) * 1e-4
    signs = (1.0, -1.0, 1.0, -1.0)
    results = [
        drop(mean + sign * np.array([3e-6, 4e-6]), 100.0 * (k + 1), 1e8 * (k + 1), draws.SPREAD_STEP)
        for k, sign in enumerate(signs)
    ]
    found = drawn(monkeypatch, results, [np.zeros((2, 2))] * 4, refused=3)
    assert found.spread == pytest.approx(np.full((900, 2), 5e-6))
    assert found.spread_time == pytest.approx(draws.SPREAD_STEP * np.arange(900))
    assert (len(found), found.rejected) == (4, 3)
    for k in range(4):
        for row in (found.peak_force, found.mean_force):
            assert row[k] == pytest.approx([100.0 * (k + 1)] * 2)
        for row in (found.peak_stress, found.mean_stress):
            assert row[k] == pytest.approx([1e8 * (k + 1)] * 2)


def test_a_zero_of_the_sensors_that_a_draw_has_wrong_is_no_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two draws of one motion, counted from the centre: one has it, and its rest, 7 µm higher."""
    time = np.arange(0.0, 0.2, 5e-5)
    motion = np.zeros((len(time), 2, 2))
    motion[:, :, 1] = -1e-4 * np.sin(30.0 * time)[:, None] ** 2
    rests = [np.array([[0.0, height]] * 2) for height in (0.0, 7e-6)]
    results = [drop(motion + rest, 200.0, 1e9, 5e-5) for rest in rests]
    found = drawn(monkeypatch, results, rests, refused=0)
    assert len(found.spread) == math.ceil(len(time) / 5)
    assert found.spread == pytest.approx(np.zeros_like(found.spread), abs=1e-15)
