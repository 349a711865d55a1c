"""Calibrate a hidden machine at 60 and 100 Hz, predict its drops at 210 Hz, and look where they lie.

    python studies/repeat/prediction.py SEED [SEED ...] --out FOLDER

The hidden machine differs from what its owner knows as first guesses do. Its true drops at 210 Hz are made
with a finer rotor; each is placed among the virtual repeats of the calibrated machine. Places of a right
prediction are uniform (Kolmogorov and Smirnov), and nine of ten true drops lie in the predicted range.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import kstest

from rotordrop.estimation.calibrated import calibrate_machine
from rotordrop.machine import example_machine, load_machine, save_machine
from rotordrop.study.repeat import Recorded, place_among, repeat_study
from rotordrop.study.run import run_study
from rotordrop.synthesis.event import hidden_machine
from rotordrop.synthesis.recording import synthesize_drop

HZ = 2.0 * math.pi
CALIBRATED_AT, PREDICTED_AT = (60.0, 100.0), 210.0
DURATION, TRUE_DROPS, SIMULATED = 0.2, 24, 200
TRUTHS = (("peak_force", "peak_force_N", 1.0), ("peak_stress", "max_stress_MPa", 1e6))


def predicted(seed: int, folder: Path) -> dict[str, Any]:
    """Places of the true drops of one hidden machine among those predicted for it."""
    known = example_machine("lp400")
    hidden = hidden_machine(known, seed)
    began = time.monotonic()
    shown = [
        synthesize_drop(hidden, HZ * speed, 100 * seed + k, duration=0.23, name=f"{seed}_{k}")
        for k, speed in enumerate(CALIBRATED_AT)
    ]
    file = folder / f"calibrated_{seed}.toml"
    if not file.exists():
        found = calibrate_machine(known, [one.record for one in shown], [one.tail for one in shown])
        save_machine(found.machine, file)
    machine = load_machine(file)
    calibrated = time.monotonic() - began
    study = repeat_study(machine, HZ * PREDICTED_AT, duration=DURATION, drops=SIMULATED, reduction="quick")
    results = run_study(study, folder / f"predicted_{seed}", threads=1)
    true = [
        synthesize_drop(hidden, HZ * PREDICTED_AT, 7000 * seed + k, duration=DURATION, tail=False).truth
        for k in range(TRUE_DROPS)
    ]
    places: dict[str, list[float]] = {}
    for bearing in ("NDE", "DE"):
        for column, key, unit in TRUTHS:
            values = results.column(f"{bearing}.{column}")
            places[f"{bearing}.{column}"] = [
                place_among(values, Recorded(value=unit * one[key][bearing])).value for one in true
            ]
    return {
        "seed": seed,
        "consistent": machine.calibration is not None and machine.calibration.consistent,
        "failed": dict(results.failed),
        "seconds_to_calibrate": round(calibrated),
        "seconds": round(time.monotonic() - began),
        "places": places,
        "inside_90": {
            name: float(np.mean((np.array(p) > 0.05) & (np.array(p) < 0.95))) for name, p in places.items()
        },
        "mean_place": {name: float(np.mean(p)) for name, p in places.items()},
        "kolmogorov_smirnov_p": {name: float(kstest(p, "uniform").pvalue) for name, p in places.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    for seed in asked.seeds:
        row = predicted(seed, asked.out)
        (asked.out / f"prediction_{seed}.json").write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
        print(json.dumps({key: value for key, value in row.items() if key != "places"}, indent=1), flush=True)


if __name__ == "__main__":
    main()
