"""First touches and impacts of records alone, against the truth of drops simulated here.

Usage: python studies/look/touches.py FOLDER FIRST LAST

FOLDER keeps the drops by seed, made where they are not there. Prints a line for every rotor: touches within
0.3 ms, 90 % intervals that hold, which end is said to touch first, and counts of impacts within two.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from score import WINDOW, order_of, true_impacts

from rotordrop.evidence.paths import drops_of, motion_of, with_impacts
from rotordrop.known import NINETY
from rotordrop.record.record import Record
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.drops import SPEEDS
from rotordrop_bench.rotors import ROTORS, bench_rotor

KEPT = ("t_off_in_record_s", "first_contact_time_s", "air_gap_m", "contact_intervals_0_0p25_s")


def kept(folder: Path, seed: int) -> tuple[str, Record, dict[str, Any]]:
    """Rotor, record and truth of a seed."""
    names = tuple(ROTORS)
    name = names[seed % len(names)]
    machine, path = bench_rotor(name), folder / f"{seed}.npz"
    if not path.is_file():
        random = np.random.default_rng((seed, 26))
        speed = 2.0 * math.pi * random.uniform(min(SPEEDS[name]), max(SPEEDS[name]))
        rate = float(random.choice((20e3, 20e3, 20e3, 10e3, 50e3)))
        noise = float(np.exp(random.uniform(np.log(0.15e-6), np.log(1e-6))))
        made = synthesize_drop(
            hidden_machine(machine, seed),
            speed,
            seed,
            sensor_chain=SensorChain(sampling_rate=rate, noise=noise),
            duration=0.27,
            before=0.15,
            tail=False,
            tolerance=1e-6,
        )
        folder.mkdir(parents=True, exist_ok=True)
        truth = {key: made.truth[key] for key in KEPT}
        path.with_suffix(".json").write_text(json.dumps(truth, default=float))
        np.savez(path, time=made.record.time, signals=made.record.signals, rate=made.record.sampling_rate)
    held = np.load(path)
    rate = float(np.round(held["rate"], 6))
    record = Record(time=held["time"], signals=held["signals"], sensors=machine.sensors, sampling_rate=rate)
    return name, record, json.loads(path.with_suffix(".json").read_text())


def scored(name: str, record: Record, truth: dict[str, Any]) -> dict[str, Any]:
    """Errors of one drop, by bearing."""
    motion = motion_of(record, gaps=(None,) * len(record.planes), angles_known=True)
    drop, off = with_impacts(motion, drops_of(motion)[0]), truth["t_off_in_record_s"]
    seen, errors, held, counts = {}, [], [], []
    for path in motion.paths:
        true, touch = truth["first_contact_time_s"][path.name], path.wall.touch
        if touch is not None:
            at, half = touch.when(motion.time) - off, NINETY * touch.error
            seen[path.name] = (at, at - half, at + half)
        errors.append(abs(seen[path.name][0] - true) if touch is not None else math.inf)
        held.append(touch is not None and errors[-1] <= NINETY * touch.error)
        hits = sum(hit.plane == path.name and hit.time - off < WINDOW for hit in drop.impacts)
        contacts = truth["contact_intervals_0_0p25_s"][path.name]
        counts.append(hits - len(true_impacts(contacts, truth["air_gap_m"][path.name])))
    return {
        "rotor": name,
        "errors": errors,
        "held": held,
        "counts": counts,
        "order": order_of(truth["first_contact_time_s"], seen),
    }


def told(name: str, rows: list[dict[str, Any]]) -> str:
    """One line of the table."""
    errors, held, counts = (
        np.concatenate([row[key] for row in rows]) for key in ("errors", "held", "counts")
    )
    orders = [row["order"] for row in rows]
    stated = sum(order in ("right", "wrong") for order in orders)
    return (
        f"| {name} | {len(errors)} | {100 * np.mean(errors < 0.3e-3):.0f} | {100 * np.mean(held):.0f} "
        f"| {orders.count('right')}/{stated} ({len(orders) - stated}) "
        f"| {100 * np.mean(np.abs(counts) <= 2):.0f} |"
    )


if __name__ == "__main__":
    rows = [scored(*kept(Path(sys.argv[1]), seed)) for seed in range(int(sys.argv[2]), int(sys.argv[3]))]
    print(
        "| | bearings | touch within 0.3 ms [%] | held [%] | end first (not determined) | impacts ± 2 [%] |"
    )
    print("|---|---|---|---|---|---|")
    print(told("all", rows))
    for rotor in dict.fromkeys(row["rotor"] for row in rows):
        print(told(rotor, [row for row in rows if row["rotor"] == rotor]))
