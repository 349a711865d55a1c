"""A pass of filter, smoother and forces as plain Python: every index is checked, the result is the same."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.track.forces import force_history
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, PassSettings, forward, smooth, smooth_means

SAMPLES = 3
SCRIPT = """
import pickle, sys
from tests.unit.track.test_interpreted_pass import whole_pass
with open(sys.argv[1], "rb") as file:
    problem = pickle.load(file)
with open(sys.argv[2], "wb") as file:
    pickle.dump(whole_pass(problem), file)
"""


def whole_pass(problem: DropProblem) -> dict[str, np.ndarray]:
    """What filter, smoother and forces make of a few samples."""
    filtered = forward(problem, PassSettings(impulse=3e-3, share=0.03))
    again = forward(problem, PassSettings(impulse=3e-3, share=0.03), reference=filtered.means)
    smoothed = smooth(again, watched=problem.watched, kept=(0, SAMPLES - 1))
    history = force_history(problem, smoothed)
    return {
        "means": smoothed.means,
        "alone": smooth_means(again)[0],
        "watched": smoothed.watched,
        "information": smoothed.information,
    } | {name: getattr(history, name) for name in ("force", "magnitude_sigma", "stress", "contact_force")}


def in_contact(problem: DropProblem, filtered: Forward) -> DropProblem:
    """The few samples after the first contact, with the filtered estimate before them as prior."""
    layout, shape = problem.model.layout, problem.model.parameters.bearing_shape
    means = filtered.means[: filtered.done]
    across = [means[:, part] @ shape.T for part in (layout.modal_x, layout.modal_y)]
    radius = np.hypot(*across)
    gaps = [k for k, unknown in enumerate(problem.unknowns) if unknown.path.endswith(".air_gap")]
    touching = np.any(radius > means[:, problem.n_dynamic + np.array(gaps)] + 2e-6, axis=1)
    first = int(np.argmax(touching))
    assert touching[first]
    chosen = slice(first, first + SAMPLES)
    return replace(
        problem,
        unknowns=tuple(replace(unknown, published=None) for unknown in problem.unknowns),  # cannot be pickled
        time=problem.time[chosen],
        readings=problem.readings[chosen],
        speed=problem.speed[chosen],
        mean=means[first],
        covariance=filtered.covariance(first),
    )


@pytest.mark.slow
def test_a_pass_over_a_contact_is_the_same_interpreted(impacts, impacts_filtered, tmp_path):
    """Compiled code reads and writes beyond the end of an array without a word; plain Python does not."""
    problem = in_contact(impacts, impacts_filtered)
    (tmp_path / "problem").write_bytes(pickle.dumps(problem))
    root = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "problem"), str(tmp_path / "result")],
        cwd=root,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    interpreted, compiled = pickle.loads((tmp_path / "result").read_bytes()), whole_pass(problem)
    assert np.max(compiled["contact_force"]) > 10.0
    for name, values in compiled.items():
        size = np.max(np.abs(values))
        assert interpreted[name] == pytest.approx(values, rel=1e-5, abs=1e-6 * size), name
