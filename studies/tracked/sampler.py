"""Is the covariance of the linearised fit that of the posterior? Checked by importance sampling on one drop.

Usage: python studies/tracked/sampler.py [--seed 4001] [--draws 2000] [--window 0.025] [--structure NAME]

The parameters that matter for the force (gap, support, contact stiffness, friction of both bearings) are
drawn from a Student distribution about the linearised fit. The weight of a draw is its prior times the
likelihood of all readings by a filter that has these parameters fixed, takes all else as unknown and
linearises at its own estimate: nothing of the fit is used but its place and width. The parameters do not
drift here, so that both sides mean the same thing. With ``--structure`` the machine has one that the usual
model does not have, and its unknowns are fitted and sampled with the others.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.table import EXTENSIONS
from rotordrop.evidence.evidence import read_evidence
from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track.calibration import BLIND_SCHEDULE, Stage, stage_settings, track
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import PassSettings, forward
from rotordrop.twin.problems import COARSE_BASIS, drop_problem
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.violations import Violations

HERE = Path(__file__).parent
SAMPLED = (
    "air_gap",
    "support.stiffness",
    "support.mass",
    "support.damping",
    "contact.stiffness",
    "friction.dynamic",
)
STRUCTURES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "turned support axes": (
        {"support": {"stiffness_ratio": 0.65, "axes_angle": "30 deg"}},
        ("support.coupling",),
    ),
    "cross-axis sensitivity": ({"sensors": {"cross_axis": 0.03}}, ("cross_axis",)),
}
"""What is true of the machine of a structure, and the unknowns that the extension of that name has."""
FREEDOM = 7.0
"""Degrees of freedom of the Student distribution of the proposals."""


def steady(problem: DropProblem) -> DropProblem:
    """The same problem with parameters that do not drift."""
    still = np.zeros(len(problem.unknowns))
    return replace(problem, targets=problem.targets._replace(drift=still, late_drift=still))


def fixed_at(problem: DropProblem, places: NDArray[np.int64], values: Array) -> DropProblem:
    """The problem with some entries of the estimate known: what the prior ties to them follows."""
    block = problem.covariance[np.ix_(places, places)]
    gain = np.linalg.solve(block, problem.covariance[places]).T
    mean = problem.mean + gain @ (values - problem.mean[places])
    covariance = problem.covariance - gain @ problem.covariance[places]
    covariance[places] = 0.0
    covariance[:, places] = 0.0
    return replace(problem, mean=mean, covariance=0.5 * (covariance + covariance.T))


def log_posterior(
    problem: DropProblem, settings: PassSettings, places: NDArray[np.int64], values: Array, samples: int
) -> float:
    """Logarithm of prior times likelihood, up to a constant."""
    apart = values - problem.mean[places]
    prior = apart @ np.linalg.solve(problem.covariance[np.ix_(places, places)], apart)
    result = forward(fixed_at(problem, places, values), settings, samples=samples, keep="nothing")
    if result.done < samples:
        return -math.inf
    return -0.5 * float(prior) - result.negative_log_likelihood


def study(seed: int, draws: int, window: float, structure: str = "", threads: int = 2) -> dict[str, Any]:
    """Standard deviations of the linearised fit beside those of the weighted draws."""
    machine = example_machine("lp400")
    departure, more = STRUCTURES.get(structure, ({}, ()))
    hidden = hidden_machine(machine, seed, Violations.model_validate(departure))
    drop = synthesize_drop(hidden, 2.0 * math.pi * 60.0, seed)
    for extension in EXTENSIONS:
        machine = extension.added_to(machine) if extension.name == structure else machine
    evidence = read_evidence(build_drop_model(machine), drop.record, drop.tail)
    problem = steady(drop_problem(build_drop_model(machine, COARSE_BASIS), evidence, window + 0.01))
    last = Stage(until=window, force=0.14, share=0.02, passes=4)
    fitted = track([problem], (*(s for s in BLIND_SCHEDULE if s.until < window), last)).smoothed[0]
    settings = stage_settings(problem, last)
    samples = len(fitted.means)
    places = np.array(
        [problem.n_dynamic + k for k, u in enumerate(problem.unknowns) if u.path.endswith((*SAMPLED, *more))]
    )
    paths = [problem.unknowns[i - problem.n_dynamic].path for i in places]
    centre = fitted.means[-1][places]
    covariance = fitted.covariance(samples - 1)[np.ix_(places, places)]
    root = np.linalg.cholesky(covariance)
    random = np.random.default_rng(seed)
    normal = random.standard_normal((draws, len(places)))
    stretch = np.sqrt(FREEDOM / random.chisquare(FREEDOM, draws))
    deviations = normal * stretch[:, None]
    points = centre + deviations @ root.T
    d = len(places)
    log_proposal = -0.5 * (FREEDOM + d) * np.log1p(np.sum(deviations**2, axis=1) / FREEDOM)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        log_target = np.array(
            list(pool.map(lambda x: log_posterior(problem, settings, places, x, samples), points))
        )
    weight = np.exp(log_target - log_proposal - np.max(log_target - log_proposal))
    weight /= weight.sum()
    mean = weight @ points
    spread = np.sqrt(weight @ (points - mean) ** 2)
    truth = {b["name"] if "name" in b else str(i): b for i, b in enumerate(drop.truth["support"])}
    return {
        "seed": seed,
        "structure": structure,
        "draws": draws,
        "window_s": window,
        "effective_draws": float(1.0 / np.sum(weight**2)),
        "supports_truth": truth,
        "parameters": [
            {
                "path": path,
                "linearised_mean": float(centre[k]),
                "sampled_mean": float(mean[k]),
                "linearised_sigma": float(math.sqrt(covariance[k, k])),
                "sampled_sigma": float(spread[k]),
                "ratio": float(spread[k] / math.sqrt(covariance[k, k])),
                "shift_in_sigma": float((mean[k] - centre[k]) / math.sqrt(covariance[k, k])),
            }
            for k, path in enumerate(paths)
        ],
    }


def main() -> None:
    """Run the study and keep the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=4001)
    parser.add_argument("--draws", type=int, default=2000)
    parser.add_argument("--window", type=float, default=0.025)
    parser.add_argument("--structure", choices=tuple(STRUCTURES), default="")
    parser.add_argument("--out", type=Path, default=HERE / "results" / "sampler.json")
    arguments = parser.parse_args()
    result = study(arguments.seed, arguments.draws, arguments.window, arguments.structure)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(result, indent=1))
    print(f"{result['effective_draws']:.0f} effective of {arguments.draws} draws")
    for p in result["parameters"]:
        ratio, shift = p["ratio"], p["shift_in_sigma"]
        print(f"{p['path']:24s} sigma sampled / linearised {ratio:.2f}, shift {shift:+.2f} sigma")


if __name__ == "__main__":
    main()
