"""Steps of a fit: damped ones hold the parameters to where they were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.track.calibration import Stage, track
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import parameter_sample

Array = NDArray[np.float64]


def test_damping_holds_the_parameters_to_the_pass_before(impacts: DropProblem) -> None:
    """So strong that nothing moves, what does not drift stays; the prior then asks for nothing either."""
    stage = Stage(until=0.012, force=0.35, share=0.03, passes=2)
    sigma = np.array([unknown.sigma for unknown in impacts.unknowns])
    start = impacts.start[impacts.parameter_slice]

    def steps(damping: float) -> Array:
        fit = track([impacts], (replace(stage, damping=damping),))
        found = fit.smoothed[0]
        return np.abs(found.means[parameter_sample(found)][impacts.parameter_slice] - start) / sigma

    constant = impacts.targets.drift == 0.0
    free, held, between = (steps(damping)[constant] for damping in (0.0, 1e8, 1.0))
    assert constant.sum() > 5 and free.max() > 0.3
    assert held.max() < 1e-3
    assert between[np.argmax(free)] < free.max()
