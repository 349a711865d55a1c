"""The size of the unknown impulses is the likeliest one, and the estimate is made with it."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.track import noise_size
from rotordrop.track.calibration import Stage, track
from rotordrop.track.noise_size import LARGEST, SMALLEST, forward_passes, likeliest_noise, likelihood_of

STAGE = Stage(until=0.012, force=0.07, share=0.01, passes=1)


def fit_that_needs(*factors: float) -> Any:
    """A fit of two drops whose last passes needed so much larger impulses."""
    drop = SimpleNamespace(means=np.zeros((10, 1)))
    return SimpleNamespace(noise_factors=factors, problems=[drop] * len(factors), trajectories=())


def pass_of(value: float, done: int = 10) -> Any:
    """A pass over ten samples with such a negative log likelihood."""
    return SimpleNamespace(done=done, means=range(10), negative_log_likelihood=value)


@pytest.mark.parametrize(
    ("likeliest", "needed"),
    [(0.125, 1.0), (0.3, 1.0), (0.9, 1.0), (1.1, 1.0), (2.9, 1.0), (30.0, 1.0), (17.0, 8.0)],
)
def test_the_size_is_that_of_the_least_improbability(
    likeliest: float, needed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A parabola in the logarithm is found exactly, wherever its lowest point lies."""

    def passes(_problems: Any, _references: Any, _stage: Stage, factor: float) -> list[Any]:
        value = 30.0 * math.log(factor / likeliest) ** 2
        return [pass_of(share * value) for share in (0.3, 0.7)]

    monkeypatch.setattr(noise_size, "forward_passes", passes)
    assert likeliest_noise(fit_that_needs(1.0, needed), STAGE) == pytest.approx(likeliest)


@pytest.mark.parametrize(("likeliest", "limit"), [(1e-4, SMALLEST), (1e4, LARGEST)])
def test_the_size_stays_within_its_limits(
    likeliest: float, limit: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def passes(_problems: Any, _references: Any, _stage: Stage, factor: float) -> list[Any]:
        return [
            SimpleNamespace(
                done=10, means=range(10), negative_log_likelihood=math.log(factor / likeliest) ** 2
            )
        ]

    monkeypatch.setattr(noise_size, "forward_passes", passes)
    assert likeliest_noise(fit_that_needs(1.0), STAGE) == limit


def test_no_size_is_smaller_than_the_one_that_followed_the_drop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a drop that the usual impulses lose would be called one that the model follows."""

    def passes(_problems: Any, _references: Any, _stage: Stage, factor: float) -> list[Any]:
        return [pass_of(math.log(factor / 2.0) ** 2)]

    monkeypatch.setattr(noise_size, "forward_passes", passes)
    assert likeliest_noise(fit_that_needs(8.0), STAGE) == 8.0


def test_a_size_that_loses_a_drop_is_not_the_likeliest(monkeypatch: pytest.MonkeyPatch) -> None:
    def passes(_problems: Any, _references: Any, _stage: Stage, factor: float) -> list[Any]:
        return [pass_of(factor, 10 if factor >= 1.0 else 9)]

    monkeypatch.setattr(noise_size, "forward_passes", passes)
    assert likeliest_noise(fit_that_needs(1.0), STAGE) == 1.0


def test_larger_impulses_make_the_readings_say_less(impacts: Any) -> None:
    fit = track([impacts], (STAGE,))
    found = likeliest_noise(fit, STAGE)
    best, other = (
        sum(map(likelihood_of, forward_passes(fit.problems, fit.trajectories, STAGE, factor)))
        for factor in (found, 4.0 * found)
    )
    assert best < other + 1.0, "the parabola is no exact one"
    means = fit.smoothed[0].means.copy()
    spread = {}
    for factor in (found, 16.0 * found):
        again = track([impacts], (STAGE,), references=fit.trajectories, noise_factor=factor)
        spread[factor] = again.smoothed[0].watched[:, 0, 0].copy()
        assert again.smoothed[0].means.shape == means.shape
        assert not any(again.diverged)
    assert np.all(spread[16.0 * found][5:] > spread[found][5:])
