"""Runs of a condition and noise beside a motion, on series that are known."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.series import curvature, median_of_five, noise_by_differences, runs_of


def test_runs_are_found_with_starts_and_lengths_at_the_ends_too() -> None:
    mask = np.array([True, True, False, True, False, False, True, True, True])
    starts, lengths = runs_of(mask)
    assert starts.tolist() == [0, 3, 6]
    assert lengths.tolist() == [2, 1, 3]
    for nothing in (np.zeros(4, dtype=np.bool_), np.empty(0, dtype=np.bool_)):
        assert [part.size for part in runs_of(nothing)] == [0, 0]


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("shape", [(20_000,), (20_000, 2)])
def test_the_noise_is_found_beside_a_motion_and_a_few_jumps(order: int, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(order)
    time = np.arange(shape[0]) / 20e3
    motion = 2e-4 * np.sin(2.0 * np.pi * 60.0 * time)
    motion[::500] += 1e-4
    values = (motion if len(shape) == 1 else motion[:, None]) + rng.normal(0.0, 0.4e-6, shape)
    assert noise_by_differences(values, order) == pytest.approx(0.4e-6, rel=0.04)


def test_missing_samples_are_left_out_of_the_noise() -> None:
    values = np.random.default_rng(4).normal(0.0, 0.4e-6, 20_000)
    values[100:4000:7] = np.nan
    assert noise_by_differences(values, 3) == pytest.approx(0.4e-6, rel=0.05)


@pytest.mark.parametrize("count", [1, 2, 4, 5, 101])
def test_the_median_of_five_is_that_of_each_value_with_its_neighbours(count: int) -> None:
    values = np.random.default_rng(count).normal(size=count)
    padded = np.pad(values, 2, mode="edge")
    assert median_of_five(values).tolist() == [np.median(padded[i : i + 5]) for i in range(count)]


def test_the_curvature_of_a_cubic_is_exact_and_nothing_where_samples_are_missing() -> None:
    rate = 1000.0
    time = np.arange(200)[:, None] / rate + np.array([0.2, -0.1])
    values = time**3
    assert curvature(values, rate, 11)[5:-5] == pytest.approx(6.0 * time[5:-5], abs=1e-9)
    assert not curvature(values, rate, 11)[[*range(5), *range(-5, 0)]].any()
    assert not curvature(values[:8], rate, 11).any()
