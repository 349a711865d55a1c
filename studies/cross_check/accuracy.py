"""How well forces are found without a contact law: by sampling rate, sensor noise and rotor.

Usage: python studies/cross_check/accuracy.py [CASE ...] [--seeds SEED ...]

The cross-check is given settled tail (or none) and machine file with guesses, nothing of the twin. Seeds 41
and 42 set the error model of `rotordrop.track.input_state`; those from 61 on are scored and used nowhere
else. One JSON file per case and seed in ``results``; ``results/summary.md`` is written at the end, also
without cases.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tests.scaled_machines import scaled_machine

from rotordrop.evidence.evidence import read_evidence
from rotordrop.machine import Machine, example_machine, load_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track.input_state import corrections_by_record, input_state_estimate
from rotordrop.twin.problems import twin_problem
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop

HERE = Path(__file__).parent
RESULTS = HERE / "results"
SCORED_FROM = 61
LONG_ROTOR = HERE.parents[1] / "tests" / "machines" / "long_rotor.toml"


@dataclass(frozen=True, kw_only=True)
class Case:
    """One kind of recording: machine, speeds at power-off [Hz], sampling rate [Hz], noise [m], tail."""

    machine: str
    speeds: tuple[float, ...]
    rate: float = 20e3
    noise: float = 0.45e-6
    tail: bool = True


SPEEDS = {"lp400": (60.0, 150.0), "small": (250.0, 400.0)}
CASES: dict[str, Case] = {
    **{
        f"{machine}, {rate:g} kHz": Case(machine=machine, speeds=speeds, rate=1e3 * rate)
        for machine, speeds in SPEEDS.items()
        for rate in (10, 20, 50, 100)
    },
    **{
        f"{machine}, noise {noise:g} um": Case(machine=machine, speeds=speeds, noise=1e-6 * noise)
        for machine, speeds in SPEEDS.items()
        for noise in (0.1, 2.0)
    },
    **{
        f"{machine}, no tail": Case(machine=machine, speeds=speeds, tail=False)
        for machine, speeds in SPEEDS.items()
    },
    "long rotor, 130 kg, three planes": Case(machine="long", speeds=(90.0, 140.0)),
    "5 kg": Case(machine="5", speeds=(250.0, 400.0)),
    "130 kg": Case(machine="130", speeds=(80.0, 150.0)),
    "6000 kg": Case(machine="6000", speeds=(20.0, 40.0)),
}


def machine_of(name: str) -> Machine:
    """The machine of a case: an example, the long rotor of the tests, or a plain one of a mass [kg]."""
    if name == "long":
        return load_machine(LONG_ROTOR)
    return scaled_machine(float(name)) if name.isdigit() else example_machine(name)


def study(case: Case, seed: int) -> Iterator[dict[str, Any]]:
    """Estimate and truth of every bearing in every drop of one hidden machine."""
    hidden = hidden_machine(machine_of(case.machine), seed)
    chain = SensorChain(sampling_rate=case.rate, noise=case.noise)
    for i, hz in enumerate(case.speeds):
        drop = synthesize_drop(
            hidden, 2.0 * math.pi * hz, 100 * seed + i, sensor_chain=chain, duration=0.23, tail=case.tail
        )
        started = time.perf_counter()
        evidence = read_evidence(build_drop_model(hidden.known, "quick"), drop.record, drop.tail)
        problem = twin_problem(hidden.known, evidence)
        found = input_state_estimate(problem, corrections_by_record(problem))
        vectors = np.hypot(*_late_mean(drop).T)
        for b, name in enumerate(problem.model.bearing_names):
            at = int(np.argmax(found.magnitude[:, b]))
            yield {
                "speed_Hz": hz,
                "bearing": name,
                "seconds": time.perf_counter() - started,
                "turn_rad_per_s": found.turn,
                "sigma_at_peak_N": float(np.hypot(*found.sigma[at, b])),
                "put_back": float(found.put_back[b]),
                "stated_errors": [float(found.peak_error[b]), float(found.stress_error[b])],
                "weight_N": float(problem.model.load_shares[b]),
                "peak_force_N": [float(found.peak[b]), drop.truth["peak_force_N"][name]],
                "peak_stress_Pa": [float(found.peak_stress[b]), 1e6 * drop.truth["max_stress_MPa"][name]],
                "mean_force_N": [
                    float(found.mean_magnitude_late[b]),
                    drop.truth["mean_force_0p15_0p2_N"][name],
                ],
                "force_of_the_mean_N": [float(found.mean_late[b]), float(vectors[b])],
            }


def _late_mean(drop: Any) -> Any:
    """Mean of the true bearing force from 150 to 200 ms, shape (B, 2) [N]."""
    late = (drop.result.time >= 0.15) & (drop.result.time <= 0.2)
    return drop.result.bearing_force[late].mean(axis=0)


QUANTITIES = ("peak_force_N", "peak_stress_Pa", "mean_force_N", "force_of_the_mean_N")


def summary(folder: Path) -> str:
    """Table of all cases: median, 90th percentile and worst of the errors, and how many peaks were held."""
    lines = [
        "| recordings | peaks | peak force, % | peak stress, % | mean force, % | force of the mean, % "
        "| peaks within their stated error | stated error of a peak, % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    results = [json.loads(file.read_text()) for file in sorted(folder.glob("*.json"))]
    for label in CASES:
        entries = [e for result in results if result["case"] == label for e in result["bearings"]]
        if not entries:
            continue
        cells = []
        for quantity in QUANTITIES:
            apart = [100.0 * abs(e[quantity][0] / e[quantity][1] - 1.0) for e in entries]
            cells.append(f"{np.median(apart):.1f} / {np.quantile(apart, 0.9):.1f} / {np.max(apart):.1f}")
        held = sum(
            abs(e["peak_force_N"][0] - e["peak_force_N"][1]) <= e["stated_errors"][0] * e["peak_force_N"][0]
            for e in entries
        )
        stated = np.median([100.0 * e["stated_errors"][0] for e in entries])
        lines.append(
            f"| {label} | {len(entries)} | {' | '.join(cells)} | {held} of {len(entries)} | {stated:.0f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the cases named on the command line (all of them by default), and summarise all there are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*")
    parser.add_argument("--seeds", type=int, nargs="*", default=[])
    chosen = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    for seed in chosen.seeds:
        for label in chosen.cases or CASES:
            file = RESULTS / f"{label.replace(', ', '_').replace(' ', '_')}_{seed}.json"
            if file.exists():
                continue
            entries = list(study(CASES[label], seed))
            file.write_text(json.dumps({"case": label, "seed": seed, "bearings": entries}, indent=1) + "\n")
            print(file.name, *(f"{e['peak_force_N'][0] / e['peak_force_N'][1] - 1:+.3f}" for e in entries))
    text = summary(RESULTS)
    (RESULTS / "summary.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
