"""Steps of a fit: damped ones hold the parameters to where they were."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.arrays import Array
from rotordrop.track import calibration
from rotordrop.track.calibration import MOST_REPEATS, Stage, converged, track
from rotordrop.track.problem import DropProblem


def test_damping_holds_the_parameters_to_the_pass_before(impacts: DropProblem) -> None:
    """So strong that nothing moves, what does not drift stays; the prior then asks for nothing either."""
    stage = Stage(until=0.012, force=0.35, share=0.03, passes=2)
    sigma = np.array([unknown.sigma for unknown in impacts.unknowns])
    start = impacts.start[impacts.parameter_slice]

    def steps(damping: float) -> Array:
        fit = track([impacts], (replace(stage, damping=damping),))
        found = fit.smoothed[0]
        return np.abs(found.means[found.filtered.parameter_sample][impacts.parameter_slice] - start) / sigma

    constant = impacts.targets.drift == 0.0
    free, held, between = (steps(damping)[constant] for damping in (0.0, 1e8, 1.0))
    assert constant.sum() > 5 and free.max() > 0.3
    assert held.max() < 1e-3
    assert between[np.argmax(free)] < free.max()


@pytest.mark.parametrize(
    ("scores", "passes"),
    [
        ([-100.0, -120.0, -121.0], 3),  # it has come to rest
        ([-100.0, -60.0, -150.0, -154.0], 4),  # a fall is no rest
        ([10.0 * (-1.0) ** k for k in range(9)], MOST_REPEATS),  # it swings for ever
    ],
)
def test_passes_go_on_while_the_likelihood_changes(
    monkeypatch: pytest.MonkeyPatch, scores: list[float], passes: int
) -> None:
    """Each begins where the one before ended, half way where the likelihood fell, with the same noise."""
    seen: list[Any] = []

    def one_pass(
        _problems: Any, _stages: Any, *, references: Any, noise_factor: float, progress: Any, **_: Any
    ) -> Any:
        seen.append((references[0][0, 0], noise_factor))
        progress("fitting", 0.0)
        ended = [np.full((3, 1), float(len(seen)))]
        return SimpleNamespace(negative_log_likelihood=scores[len(seen) - 1], trajectories=ended)

    monkeypatch.setattr(calibration, "track", one_pass)
    stage = Stage(until=0.2, force=0.07, share=0.01, passes=2)
    shares: list[float] = []
    converged([], stage, [np.zeros((4, 1))], noise_factor=0.5, progress=lambda _, share: shares.append(share))
    place, begins = 0.0, []
    for k in range(passes):
        begins.append((place, 0.5))
        fell = k > 0 and scores[k] > scores[k - 1]
        place = 0.5 * (place + k + 1.0) if fell else k + 1.0
    assert seen == begins
    assert shares == [k / MOST_REPEATS for k in range(passes)]


def test_a_pass_that_lost_a_drop_gives_no_middle_to_begin_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three passes the second follows one of two drops less far."""
    begun: list[list[int]] = []
    ends = [(30, 30), (30, 12), (30, 30), (30, 30)]

    def one_pass(_problems: Any, _stages: Any, *, references: Any, **_: Any) -> Any:
        begun.append([len(one) for one in references])
        number = len(begun) - 1
        reached = [np.zeros((end, 1)) for end in ends[number]]
        return SimpleNamespace(
            negative_log_likelihood=[-100.0, -50.0, -20.0, -20.0][number], trajectories=reached
        )

    monkeypatch.setattr(calibration, "track", one_pass)
    stage = Stage(until=0.2, force=0.07, share=0.01, passes=1)
    converged([], stage, [np.zeros((20, 1))] * 2)
    assert begun == [[20, 20], [30, 30], [30, 12], [30, 30]]
