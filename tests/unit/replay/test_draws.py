"""What draws of a replayed drop are counted into: known numbers in, their spread out."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.replay.open_loop import interval, orbit_spread


def test_the_spread_of_draws_is_their_root_mean_square_distance_from_the_mean_orbit() -> None:
    """Orbits 3 µm left and right and 4 µm up and down of their mean: 5 µm apart from it, each of them."""
    mean = np.random.default_rng(1).normal(size=(9, 2, 2)) * 1e-4
    orbits = np.array([mean + sign * np.array([3e-6, 4e-6]) for sign in (1.0, -1.0, 1.0, -1.0)])
    assert orbit_spread(orbits) == pytest.approx(np.full((9, 2), 5e-6))


def test_nine_of_ten_draws_lie_in_the_interval() -> None:
    assert interval(np.arange(101.0)) == pytest.approx((5.0, 95.0))
