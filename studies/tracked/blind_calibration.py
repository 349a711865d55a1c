"""Hidden machines, calibrated blind on two drops and scored on four others.

Usage: python studies/tracked/blind_calibration.py KIND SEED [SEED ...] [--violation NAME]

KIND is ``lp400`` (the paper's rotor) or ``small`` (a 10–20 kg rotor at 500 Hz). Seeds below 1000 were
used while the estimator was made; only seeds from 1000 on are scored. One JSON file per machine,
with every raw number.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from pathlib import Path
from typing import Any

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np

from rotordrop.estimate.estimate import Estimate
from rotordrop.estimation import estimate_drop
from rotordrop.known import NINETY
from rotordrop.machine import example_machine
from rotordrop.twin.calibrated import calibrate_machine, calibration_json
from rotordrop_bench.event import hidden_machine
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop

SPEEDS_HZ = {
    "lp400": ((60.0, 150.0), (60.0, 100.0, 150.0, 210.0)),
    "small": ((200.0, 400.0), (150.0, 250.0, 350.0, 500.0)),
}
"""Speeds of the two drops to calibrate on and of the four scored [Hz]."""
HERE = Path(__file__).parent


def drops_of(kind: str, seed: int, violation: str) -> tuple[Any, list[SyntheticDrop], list[SyntheticDrop]]:
    """The known machine, two drops to calibrate on and four to score."""
    known = example_machine(kind)
    hidden = hidden_machine(known, seed, violation)
    made = []
    for part, speeds in enumerate(SPEEDS_HZ[kind]):
        made.append(
            [
                synthesize_drop(
                    hidden,
                    2.0 * math.pi * speed,
                    seed * 100 + 10 * part + i,
                    duration=0.23,
                    name=f"{kind}_{seed}_{part}_{i}",
                )
                for i, speed in enumerate(speeds)
            ]
        )
    return known, made[0], made[1]


def holds(entry: dict[str, Any]) -> bool:
    """Whether the interval of a scored number holds the truth; one that is not given holds nothing."""
    if entry["interval_90"] is None:
        return False
    low, high = entry["interval_90"]
    return bool(low <= entry["truth"] <= high)


def half_width(entry: dict[str, Any]) -> float:
    """Half the width of the interval [unit of the number]; infinite where none is given."""
    if entry["interval_90"] is None:
        return math.inf
    low, high = entry["interval_90"]
    return 0.5 * float(high - low)


def drop_scores(drop: Estimate, made: SyntheticDrop) -> dict[str, Any]:
    """Estimate, truth and interval of everything that is scored in one drop."""
    truth = made.truth
    scores: dict[str, Any] = {
        "consistent": drop.consistent,
        "failed_checks": [c.message for c in drop.checks if not c.passed],
        "nis": drop.nis,
        "noise_factor": drop.noise_factor,
        "instant_error_s": drop.drop_instant.value - truth["t_off_in_record_s"],
        "bearings": {},
    }
    for bearing in drop.bearings:
        name = bearing.name
        values = {
            **bearing.values,
            "peak_force_N": bearing.peak_force.known,
            "peak_stress_Pa": bearing.peak_stress.known,
        }
        entry: dict[str, Any] = {}
        for field, key, unit in (
            ("peak_force_N", "peak_force_N", 1.0),
            ("mean_force_0p15_0p2_N", "mean_force_0p15_0p2_N", 1.0),
            ("peak_stress_Pa", "max_stress_MPa", 1e6),
            ("mean_stress_Pa", "mean_stress_MPa", 1e6),
        ):
            if field in values:
                value = values[field]
                entry[field] = {
                    "estimate": value.value,
                    "interval_90": value.interval_90,
                    "truth": truth[key][name] * unit,
                }
        entry["impacts"] = impact_scores(drop, made, name)
        scores["bearings"][name] = entry
    return scores


def impact_scores(drop: Estimate, made: SyntheticDrop, name: str) -> list[list[float]]:
    """Rows of estimated peak, its stated standard error and true peak, for true impacts above 500 N."""
    rows = []
    result = made.result
    b = result.bearing_names.index(name)
    force = result.bearing_force_magnitude[:, b]
    bearing = drop.bearing(name)
    time_, mine = bearing.force.time, bearing.force.values
    assert bearing.force_band is not None
    sigma = (bearing.force_band.upper - mine) / NINETY
    for start, end, peak in zip(
        *(getattr(result.contacts.of_bearing(b), f) for f in ("start", "end", "peak_force")), strict=True
    ):
        if peak < 500.0 or not end < 0.195:
            continue
        near = (result.time >= start - 1e-4) & (result.time <= end + 1e-4)
        seen = (time_ >= start - 1e-4) & (time_ <= end + 1e-4)
        if not np.any(seen):
            continue
        at = np.flatnonzero(seen)[np.argmax(mine[seen])]
        rows.append([float(mine[at]), float(sigma[at]), float(force[near].max())])
    return rows


def parameter_scores(calibration: Any, made: SyntheticDrop) -> dict[str, Any]:
    """Calibrated values beside the true ones."""
    truth = made.truth
    names = list(truth["air_gap_m"])
    scores = {}
    for i, name in enumerate(names):
        for path, true in (
            ("air_gap", truth["air_gap_m"][name]),
            ("support.stiffness", truth["support"][i]["K"]),
            ("support.mass", truth["support"][i]["m"]),
            ("support.damping", truth["support"][i]["C"]),
            ("contact.stiffness", truth["contact"][i]["K"]),
            ("friction.dynamic", truth["contact"][i]["mu_d"]),
            ("preload", truth["bearing"][i]["preload_N"]),
            ("race.inertia", truth["ring"][i]["Ip"]),
            ("damping_time", truth["bearing"][i]["Cb_over_Kb"]),
        ):
            value = calibration.values[f"{name}.{path}"]
            scores[f"{name}.{path}"] = {
                "estimate": value.value,
                "interval_90": value.interval_90,
                "truth": true,
            }
    return scores


def study(kind: str, seed: int, violation: str) -> dict[str, Any]:
    """Everything about one hidden machine."""
    known, fit, scored = drops_of(kind, seed, violation)
    started = time.perf_counter()
    calibration = calibrate_machine(
        known, [d.record for d in fit], [d.tail for d in fit], names=[d.truth["name"] for d in fit]
    )
    calibrated_in = time.perf_counter() - started
    result: dict[str, Any] = {
        "kind": kind,
        "seed": seed,
        "violation": violation,
        "calibration_seconds": calibrated_in,
        "calibration_consistent": calibration.consistent,
        "calibration_checks": calibration_json(calibration)["checks"],
        "parameters": parameter_scores(calibration, fit[0]),
        "drops": [],
    }
    for drop in scored:
        started = time.perf_counter()
        try:
            tracked = estimate_drop(calibration.machine, drop.record, drop.tail, name=drop.truth["name"])
            entry = drop_scores(tracked, drop)
        except Exception as error:  # a lost drop is a result too
            entry = {"error": f"{type(error).__name__}: {error}"}
        entry["seconds"] = time.perf_counter() - started
        result["drops"].append(entry)
    return result


def main() -> None:
    """Run the machines named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=sorted(SPEEDS_HZ))
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--violation", default="none")
    parser.add_argument("--out", type=Path, default=HERE / "results")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for seed in arguments.seeds:
        label = arguments.violation.replace(" ", "_").replace("%", "pct")
        file = arguments.out / f"{arguments.kind}_{seed}_{label}.json"
        if file.exists():
            continue
        try:
            result = study(arguments.kind, seed, arguments.violation)
        except Exception as error:  # a machine that cannot be calibrated is a result too
            result = {
                "kind": arguments.kind,
                "seed": seed,
                "violation": arguments.violation,
                "error": f"{type(error).__name__}: {error}",
            }
        file.write_text(json.dumps(result, indent=1))
        print(file.name, "error" if "error" in result else "done", flush=True, file=sys.stderr)


if __name__ == "__main__":
    main()
