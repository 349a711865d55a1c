"""Subset simulation of a drop against brute force at one in a thousand, and what one in a million costs.

python studies/rare/drop.py --drops 12000 --folder FOLDER --out studies/rare/drop.json
python studies/rare/drop.py --million --runs 4 --seed 3 --out studies/rare/million.json
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from rotordrop import example_machine
from rotordrop.study.plan import read_study
from rotordrop.study.rare import rare_drops
from rotordrop.study.run import run_study

COLUMN = "DE.peak_force"
TABLE = {
    "name": "first contacts at 100 Hz",
    "drops": 1,
    "speed": "100 Hz",
    "duration": "12 ms",
    "output_step": "20 us",
    "reduction": "quick",
    "seed": 1,
    "shard": 500,
    "vary": {
        "*.friction.dynamic": {"uniform": [0.05, 0.25]},
        "remanent_share": {"normal": [0.0, 0.2]},
        "DE.support.stiffness": {"log_normal": ["1e8 N/m", 0.3]},
        "DE.air_gap": {"normal": ["285 um", "10 um"]},
    },
}


FAR = 4850.0
"""A peak force that a pilot run (four repeats of 200 points, another seed) put near one in a million [N]."""


def million(out: Path, runs: int, seed: int) -> None:
    """One in a million, with what it costs; beside what other seeds found."""
    study = read_study(TABLE | {"seed": seed}, example_machine("paper"))
    began = time.process_time()
    found = rare_drops(study, COLUMN, FAR, samples=500, runs=runs, threads=1)
    summary = json.loads(out.read_text()) if out.exists() else {"column": COLUMN, "limit_N": FAR}
    summary[f"seed {seed}"] = asdict(found) | {"processor_seconds": round(time.process_time() - began)}
    out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(summary, indent=1))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--drops", type=int, default=12_000)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--runs", type=int, default=6)
    parser.add_argument("--million", action="store_true", help="one in a million alone")
    parser.add_argument("--seed", type=int, default=3, help="of one in a million")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    if asked.million or asked.folder is None:
        million(asked.out, asked.runs, asked.seed)
        return
    study = read_study(TABLE | {"drops": asked.drops}, example_machine("paper"))
    began = time.process_time()
    brute = run_study(study, asked.folder / "brute", threads=1)
    seconds = time.process_time() - began
    first, second = np.array_split(brute.column(COLUMN), 2)
    limit = float(np.quantile(first, 0.999))
    counted = type(brute).exceedance(
        replace(
            brute,
            drop=brute.drop[len(first) :],
            numbers={COLUMN: second},
            varied={},
            reasons=brute.reasons[len(first) :],
        ),
        COLUMN,
        limit,
    )
    began = time.process_time()
    found = rare_drops(replace(study, seed=2), COLUMN, limit, samples=500, runs=asked.runs, threads=1)
    summary = {
        "study": study.document(),
        "column": COLUMN,
        "limit_N": limit,
        "brute_force": asdict(counted),
        "subset_simulation": asdict(found),
        "intervals_overlap": bool(found.lower <= counted.upper and counted.lower <= found.upper),
        "processor_seconds": [round(seconds), round(time.process_time() - began)],
    }
    asked.out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    print(json.dumps({key: value for key, value in summary.items() if key != "study"}, indent=1))


if __name__ == "__main__":
    main()
