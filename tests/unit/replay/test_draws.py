"""What draws of a replayed drop are counted into: known numbers in, their spread out."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.replay import uncertainty


def test_the_spread_of_draws_is_their_root_mean_square_distance_from_the_mean_orbit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Orbits 3 µm left and right and 4 µm up and down of their mean: 5 µm apart from it, each of them."""
    mean = np.random.default_rng(1).normal(size=(9, 2, 2)) * 1e-4
    signs = (1.0, -1.0, 1.0, -1.0)
    orbits = [mean + sign * np.array([3e-6, 4e-6]) for sign in signs]
    numbers = [np.arange(10.0).reshape(5, 2) + 100.0 * k for k in range(4)]

    def drawn(problem: Any, candidate: int, duration: float) -> tuple[Any, Any]:
        assert (problem, duration) == ("problem", 0.2)
        return numbers[candidate], orbits[candidate]

    monkeypatch.setattr(uncertainty, "_keeping", lambda *_: ([0, 1, 2, 3], 7))
    monkeypatch.setattr(uncertainty, "_numbers", drawn)
    problem: Any = "problem"
    found = uncertainty.draw_drops(problem, np.zeros(1), np.eye(1), window=0.0, duration=0.2, count=4)
    assert found.spread == pytest.approx(np.full((9, 2), 5e-6))
    assert found.spread_time == pytest.approx(uncertainty.SPREAD_STEP * np.arange(9))
    assert (len(found), found.rejected) == (4, 7)
    rows = (found.peak_force, found.mean_force, found.peak_stress, found.mean_stress, found.gaps)
    for k, row in enumerate(rows):
        assert row == pytest.approx(np.array([number[k] for number in numbers]))


def test_a_zero_of_the_sensors_that_a_draw_has_wrong_is_no_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two draws of one motion, counted from the centre: one has it, and its rest, 7 µm higher.

    A rest 7 µm higher means a gap 7 µm smaller (`Replica.bearing_rows`), and sensors that read what the
    rotor is above it (`Replica.predicted`).
    """
    time = np.arange(0.0, 0.2, 5e-5)
    motion = np.zeros((len(time), 2, 2))
    motion[:, :, 1] = -1e-4 * np.sin(30.0 * time)[:, None] ** 2
    constant = np.ones((len(time), 2))
    orbits = []
    for height in (0.0, 7e-6):
        rest = np.array([[0.0, height]] * 2)
        result = SimpleNamespace(
            time=time,
            displacement=motion + np.array([0.0, height]),
            bearing_force_magnitude=200.0 * constant,
            max_stress=1e9 * constant,
        )
        monkeypatch.setattr(uncertainty, "whole_drop", lambda *_, given=result, **__: given)
        initial = SimpleNamespace(unknowns=SimpleNamespace(rest=slice(0, 4)))
        seen: list[Any] = []

        def rows(vector: Any, theta: Any, where: Any, seen: list[Any] = seen) -> Any:
            seen.append(where)
            return np.full((2, 3), 280e-6)

        problem: Any = SimpleNamespace(
            replica=SimpleNamespace(initial=initial, bearing_rows=rows), vector=None
        )
        candidate = uncertainty.Candidate(theta=np.zeros(1), fall=rest.ravel())
        numbers, orbit = uncertainty._numbers(problem, candidate, 0.2)
        assert np.array_equal(seen[0], rest)
        assert numbers == pytest.approx(np.array([[200.0] * 2] * 2 + [[1e9] * 2] * 2 + [[280e-6] * 2]))
        orbits.append(orbit)
    assert orbits[0] == pytest.approx(orbits[1], abs=1e-15)
    assert len(orbits[0]) == math.ceil(len(time) / 5)
