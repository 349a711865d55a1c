"""Calibrate a hidden machine at 60 and 100 Hz, predict its drops at 210 Hz, and look where they lie.

    python studies/repeat/prediction.py SEED [SEED ...] --out FOLDER

The hidden machine differs from what its owner knows as first guesses do. Its true drops at 210 Hz are made
with a finer rotor; each is placed among the virtual repeats of the calibrated machine. Places of a right
prediction are uniform (Kolmogorov and Smirnov), and nine of ten true drops lie in the predicted range.
Seeds 2001 to 2005 were used while the prediction was made; only later ones are scored.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.known import Known
from rotordrop.machine import Machine, example_machine, load_machine
from rotordrop.machine.saving import save_machine
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.study.repeat import place_among, repeat_study
from rotordrop.study.run import run_study
from rotordrop.twin.calibrated import calibrate_machine
from rotordrop_bench.event import HiddenMachine, drop_conditions, hidden_machine
from rotordrop_bench.recording import synthesize_drop

HZ = 2.0 * math.pi
CALIBRATED_AT, PREDICTED_AT = (60.0, 100.0), 210.0
DURATION, TRUE_DROPS, SIMULATED = 0.2, 25, 400


def calibrated(hidden: HiddenMachine, seed: int, folder: Path) -> Machine:
    """The machine as its owner knows it after one drop at each of two speeds; kept in the folder."""
    file = folder / f"calibrated_{seed}.toml"
    if not file.exists():
        shown = [
            synthesize_drop(hidden, HZ * speed, 100 * seed + k, duration=0.23, name=f"{seed}_{k}")
            for k, speed in enumerate(CALIBRATED_AT)
        ]
        found = calibrate_machine(hidden.known, [one.record for one in shown], [one.tail for one in shown])
        save_machine(found.machine, file)
    return load_machine(file)


def true_peaks(hidden: HiddenMachine, seed: int, number: int) -> dict[str, float]:
    """What one of the true drops that are predicted did to its bearings [SI], by column of a study."""
    conditions = drop_conditions(hidden, HZ * PREDICTED_AT, 7000 * seed + number)
    case = DropCase(speed=conditions.speed, duration=DURATION, start=conditions.start, tolerance=1e-7)
    result, found = simulate_drop(hidden.model, case), {}
    for b, name in enumerate(result.bearing_names):
        found[f"{name}.peak_force"] = result.peak_force(b)[0]
        found[f"{name}.peak_stress"] = float(result.max_stress[:, b].max())
    return found


def predicted(seed: int, folder: Path) -> dict[str, Any]:
    """Places of the true drops of one hidden machine among those predicted for it."""
    hidden = hidden_machine(example_machine("lp400"), seed)
    began = time.process_time()
    machine = calibrated(hidden, seed, folder)
    spent = time.process_time() - began
    assert machine.calibration is not None
    study = repeat_study(machine, HZ * PREDICTED_AT, duration=DURATION, drops=SIMULATED, reduction="quick")
    results = run_study(study, folder / f"predicted_{seed}", threads=1)
    true = [true_peaks(hidden, seed, k) for k in range(TRUE_DROPS)]
    values = {name: [one[name] for one in true] for name in true[0]}
    places = {
        name: [place_among(results.column(name), Known(value=x)).value for x in found]
        for name, found in values.items()
    }
    return {
        "seed": seed,
        "consistent": machine.calibration.consistent,
        "lift": [dict(lift) for drop in machine.calibration.drops for lift in drop.lift],
        "failed": dict(results.failed),
        "processor_seconds_to_calibrate": round(spent),
        "processor_seconds": round(time.process_time() - began),
        "true": values,
        "places": places,
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
        for name, places in row["places"].items():
            inside = np.mean((np.array(places) > 0.05) & (np.array(places) < 0.95))
            print(f"{seed} {name}: mean place {np.mean(places):.2f}, {inside:.2f} inside 90 %", flush=True)


if __name__ == "__main__":
    main()
