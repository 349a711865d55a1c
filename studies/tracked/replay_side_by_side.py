"""The paper's open-loop route on the drops that blind_calibration.py scores, from the same nominal guesses.

Usage: python studies/tracked/replay_side_by_side.py KIND SEED [SEED ...]

No draws are made: only the estimates are compared, and draws move no estimate. One JSON file per
machine in ``results/replay``.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

from blind_calibration import HERE, SPEEDS_HZ, drops_of

from rotordrop.estimate.document import estimate_document
from rotordrop.estimation import Replay, estimate_drop
from rotordrop.machine import Machine
from rotordrop_bench.recording import SyntheticDrop

FIELDS = (
    ("peak_force_N", "peak_force_N", 1.0),
    ("mean_force_0p15_0p2_N", "mean_force_0p15_0p2_N", 1.0),
    ("peak_stress_Pa", "max_stress_MPa", 1e6),
    ("air_gap_m", "air_gap_m", 1.0),
)


def replay_scores(machine: Machine, drop: SyntheticDrop) -> dict[str, Any]:
    """Estimates of the paper's route beside the truth; what went wrong when it gave none."""
    started = time.perf_counter()
    try:
        method = Replay(draws=0, threads=1)
        document = estimate_document(estimate_drop(machine, drop.record, drop.tail, method=method))
    except Exception as error:  # a failed drop is a result too
        return {"error": f"{type(error).__name__}: {error}"}
    bearings = {}
    for i, (name, values) in enumerate(document["bearings"].items()):
        bearings[name] = {
            field: {"estimate": values[field]["value"], "truth": drop.truth[key][name] * unit}
            for field, key, unit in FIELDS
        }
        support = drop.truth["support"][i]
        for field, key in (("stiffness_N_per_m", "K"), ("mass_kg", "m"), ("damping_N_s_per_m", "C")):
            bearings[name][f"support.{field}"] = {
                "estimate": values["support"][field]["value"],
                "truth": support[key],
            }
    return {"bearings": bearings, "seconds": time.perf_counter() - started}


def main() -> None:
    """Run the machines named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=sorted(SPEEDS_HZ))
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--out", type=Path, default=HERE / "results" / "replay")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for seed in arguments.seeds:
        file = arguments.out / f"{arguments.kind}_{seed}.json"
        if file.exists():
            continue
        known, _, scored = drops_of(arguments.kind, seed, "none")
        drops = [replay_scores(known, drop) for drop in scored]
        file.write_text(json.dumps({"kind": arguments.kind, "seed": seed, "drops": drops}, indent=1))
        print(file.name, [drop.get("error", "done") for drop in drops], flush=True, file=sys.stderr)


if __name__ == "__main__":
    main()
