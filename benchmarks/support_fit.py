"""How long one fit of the supports takes, from 8 starts, on a recorded drop.

    python benchmarks/support_fit.py [--output benchmarks/support_fit.json] [--rounds 5] [--threads 2]

The record is made here: a machine drawn around the example of the records, which the fit knows by its owner's
guesses. Only the fit is timed, after one that fills the caches. Wall time is that of the machine as it is.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import json
import math
import statistics
import time
from pathlib import Path
from typing import Any

from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.machine import example_machine
from rotordrop.replay.first_impacts import first_impacts
from rotordrop.replay.support_and_friction import SupportFit, fit_support
from rotordrop.rotor.parameters import build_drop_model
from rotordrop_bench import hidden_machine, synthesize_drop

STARTS = 8
SEED = 1000
SPEED = 2.0 * math.pi * 60.0
UNTIL = 0.06


def fallen() -> Evidence:
    """The steps before the fit."""
    known = example_machine("lp400")
    drop = synthesize_drop(hidden_machine(known, SEED), SPEED, SEED)
    return read_evidence(build_drop_model(known), drop.record, drop.tail)


def fit(evidence: Evidence, threads: int) -> SupportFit:
    """One fit as the replay makes it."""
    coarse, fine = (
        first_impacts(evidence, model, until=UNTIL)
        for model in (build_drop_model(evidence.model.machine, "quick"), evidence.model)
    )
    return fit_support(coarse, fine, evidence.latest_first_contact, starts=STARTS, threads=threads)


def main() -> None:
    """Time the fit in several rounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    evidence = fallen()
    fit(evidence, options.threads)
    walls, processors = [], []
    for _ in range(options.rounds):
        wall, processor = time.perf_counter(), time.process_time()
        found = fit(evidence, options.threads)
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
        print(f"wall {walls[-1]:.2f} s, processor {processors[-1]:.2f} s", flush=True)
    results: dict[str, Any] = {
        "starts": STARTS,
        "threads": options.threads,
        "simulations": found.coarse.evaluations + found.search.evaluations,
        "misfit": found.search.best.misfit,
        "wall_s": walls,
        "processor_s": processors,
        "median_wall_s": statistics.median(walls),
        "median_processor_s": statistics.median(processors),
        "load_at_end": os.getloadavg()[0],
        "cores": os.cpu_count(),
    }
    print(
        "median wall {median_wall_s:.2f} s, processor {median_processor_s:.2f} s, {simulations} simulations, "
        "load {load_at_end:.1f}".format(**results)
    )
    if options.output:
        options.output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
