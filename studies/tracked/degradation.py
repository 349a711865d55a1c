"""How the error of the peak force grows when the recordings get worse.

Usage: python studies/tracked/degradation.py SEED [SEED ...] [--case NAME ...]

Machines of the paper's rotor, calibrated blind on two drops and scored on two others, all four recorded
in the same degraded way; a sensor is lost after the calibration. One JSON file per machine and case in
``results/degradation``.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from blind_calibration import HERE, drop_scores, half_width, holds

from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop
from rotordrop.known import Known
from rotordrop.machine import Machine, example_machine
from rotordrop.record.record import Record
from rotordrop.twin.calibrated import calibrate_machine
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.recording import SyntheticDrop

SPEEDS_HZ = (60.0, 150.0, 100.0, 210.0)
"""The first two drops calibrate, the last two are scored [Hz]."""


@dataclass(frozen=True, kw_only=True)
class Degradation:
    """What is worse than usual: the measuring chain, the records, the machine file."""

    chain: SensorChain = field(default_factory=SensorChain)
    with_tail: bool = True
    levitated: bool = True
    lost_sensor: int | None = None
    gap_range: tuple[float, float] | None = None


def _noise(sigma: float) -> Degradation:
    return Degradation(chain=SensorChain(noise=sigma))


CASES: dict[str, Degradation] = {
    "as usual (0.45 um, 20 kHz, 16 bit)": Degradation(),
    "noise 0.2 um": _noise(0.2e-6),
    "noise 1 um": _noise(1e-6),
    "noise 2 um": _noise(2e-6),
    "noise 3 um": _noise(3e-6),
    "10 kHz": Degradation(chain=SensorChain(sampling_rate=10e3)),
    "14 bit": Degradation(chain=SensorChain(bits=14)),
    "12 bit": Degradation(chain=SensorChain(bits=12)),
    "one sensor lost": Degradation(lost_sensor=1),
    "no levitated part": Degradation(levitated=False),
    "gap known to 5 um": Degradation(gap_range=(-5e-6, 5e-6)),
    "gap unknown (0.1 to 0.5 mm)": Degradation(gap_range=(-math.inf, math.inf)),
    "no tail": Degradation(with_tail=False),
}


def degraded_machine(known: Machine, hidden: Machine, case: Degradation) -> Machine:
    """The machine file the estimator gets."""
    machine = known
    if case.gap_range is not None:
        values = {}
        for bearing in hidden.touchdown_bearings:
            gap = float(bearing.air_gap)
            low, high = (
                (gap + d for d in case.gap_range) if math.isfinite(case.gap_range[0]) else (1e-4, 5e-4)
            )
            middle = gap if math.isfinite(case.gap_range[0]) else 2.5e-4
            values[f"{bearing.name}.air_gap"] = Known(value=middle, status="guess", range=(low, high))
        machine = machine.with_values(values)
    return machine


def with_sensors_left(machine: Machine, case: Degradation) -> Machine:
    """The machine after a sensor was lost."""
    kept = tuple(s for i, s in enumerate(machine.sensors) if i != case.lost_sensor)
    return machine.model_copy(update={"sensors": kept})


def with_signals_left(record: Record | None, machine: Machine, case: Degradation) -> Record | None:
    """The record of the sensors the machine still has."""
    if record is None or case.lost_sensor is None:
        return record
    kept = [i for i in range(len(record.sensors)) if i != case.lost_sensor]
    return replace(record, signals=np.ascontiguousarray(record.signals[:, kept]), sensors=machine.sensors)


def without_levitation(drop: SyntheticDrop) -> Record:
    """The record cut at power-off, as a logger leaves it that starts at the trigger."""
    record = drop.record
    keep = record.time >= drop.truth["t_off_in_record_s"]
    return replace(
        record,
        time=record.time[keep],
        signals=record.signals[keep],
        speed=None if record.speed is None else record.speed[keep],
    )


def study(seed: int, case: Degradation) -> dict[str, Any]:
    """Calibrate and score one machine."""
    known = example_machine("lp400")
    hidden = hidden_machine(known, seed)
    made = [
        synthesize_drop(
            hidden,
            2.0 * math.pi * hz,
            100 * seed + i,
            sensor_chain=case.chain,
            duration=0.23,
            tail=case.with_tail,
            name=f"degraded_{seed}_{i}",
        )
        for i, hz in enumerate(SPEEDS_HZ)
    ]
    machine = degraded_machine(known, hidden.machine, case)
    cut: Callable[[SyntheticDrop], Record] = (lambda d: d.record) if case.levitated else without_levitation
    records = [cut(drop) for drop in made]
    tails = [drop.tail if case.with_tail else None for drop in made]
    started = time.perf_counter()
    calibration = calibrate_machine(machine, records[:2], tails[:2], names=["a", "b"])
    scores = []
    left = with_sensors_left(calibration.machine, case)
    for drop, whole, settled in zip(made[2:], records[2:], tails[2:], strict=True):
        record, tail = (with_signals_left(one, left, case) for one in (whole, settled))
        try:
            tracked = estimate_drop(left, record, tail, name=drop.truth["name"])
        except RotordropError as error:  # a refused drop is a result too
            scores.append({"error": str(error)})
        else:
            scores.append(drop_scores(tracked, drop))
    gaps = {
        name: {
            "estimate": calibration.values[f"{name}.air_gap"].value,
            "interval_90": calibration.values[f"{name}.air_gap"].interval_90,
            "truth": made[0].truth["air_gap_m"][name],
        }
        for name in made[0].truth["air_gap_m"]
    }
    return {"air_gap_m": gaps, "drops": scores, "seconds": time.perf_counter() - started}


def summary(folder: Path) -> str:
    """Table of all cases: errors of peak force and stress, share covered, flags."""
    lines = [
        "| recordings | drops | peak force: median error | worst | covered | half-width "
        "| peak stress: median | air gap: median | consistent |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for label in CASES:
        results = [json.loads(f.read_text()) for f in sorted(folder.glob("*.json"))]
        results = [r for r in results if r["case"] == label]
        if not results:
            continue
        lost = [r["error"] for r in results if "error" in r]
        every = [d for r in results for d in r.get("drops", [])]
        drops = [d for d in every if "error" not in d]
        lost += ["a drop was refused"] * (len(every) - len(drops))
        if not drops:
            lines.append(f"| {label} | 0 | {'; '.join(lost)} | | | | | | |")
            continue
        bearings = [b for d in drops for b in d["bearings"].values()]
        peak = [b["peak_force_N"] for b in bearings]
        stress = [b["peak_stress_Pa"] for b in bearings]
        gap = [g for r in results for g in r.get("air_gap_m", {}).values()]
        error = np.array([abs(p["estimate"] / p["truth"] - 1.0) for p in peak])
        inside = np.mean([holds(p) for p in peak])
        half = np.median([half_width(p) / p["estimate"] for p in peak])
        of_stress = np.median([abs(p["estimate"] / p["truth"] - 1.0) for p in stress])
        of_gap = np.median([abs(g["estimate"] - g["truth"]) for g in gap])
        good = np.mean([d["consistent"] for d in drops])
        lines.append(
            f"| {label} | {len(every)} | {100 * np.median(error):.2f} % | {100 * error.max():.1f} % "
            f"| {100 * inside:.0f} % | {100 * half:.1f} % | {100 * of_stress:.2f} % | {1e6 * of_gap:.1f} µm "
            f"| {100 * good:.0f} % |" + (f" lost: {'; '.join(lost)}" if lost else "")
        )
    return "\n".join(lines)


def main() -> None:
    """Run the machines and cases named on the command line, and summarise all there are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="*")
    parser.add_argument("--case", action="append", choices=sorted(CASES))
    parser.add_argument("--out", type=Path, default=HERE / "results" / "degradation")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for seed in arguments.seeds:
        for label in arguments.case or CASES:
            number = list(CASES).index(label)
            file = arguments.out / f"{seed}_{number:02d}.json"
            if file.exists():
                continue
            try:
                result = study(seed, CASES[label])
            except Exception as error:  # a machine that cannot be calibrated is a result too
                result = {"error": f"{type(error).__name__}: {error}"}
            file.write_text(json.dumps({"seed": seed, "case": label, **result}, indent=1))
            print(label, result.get("error", "done"), flush=True, file=sys.stderr)
    text = summary(arguments.out)
    (arguments.out / "summary.md").write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
