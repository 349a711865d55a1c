"""Estimate the drops that were predicted, as their owner would, and keep estimate, interval and truth.

    python studies/repeat/reliability.py FOLDER --minutes 9 [--drops 25]    # continues where it was

FOLDER is that of `prediction.py`. Each drop is followed by the quick method with the machine calibrated on
two other drops. Drops are taken in turn from all machines, so that a part is a smaller study.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from prediction import DURATION, HZ, PREDICTED_AT

from rotordrop.errors import RotordropError
from rotordrop.estimation import Tracked, estimate_drop
from rotordrop.machine import Machine, example_machine, load_machine
from rotordrop.synthesis.event import HiddenMachine, hidden_machine
from rotordrop.synthesis.recording import synthesize_drop

TRUTHS = (("peak_force", "peak_force_N", 1.0), ("peak_stress", "max_stress_MPa", 1e6))


def estimated(hidden: HiddenMachine, machine: Machine, seed: int, number: int) -> dict[str, Any]:
    """Estimate of one true drop beside its truth."""
    made = synthesize_drop(
        hidden,
        HZ * PREDICTED_AT,
        7000 * seed + number,
        duration=DURATION + 0.03,
        tail=False,
        name=f"{seed}_{number}",
    )
    row: dict[str, Any] = {"seed": seed, "number": number}
    began = time.process_time()
    try:
        found = estimate_drop(machine, made.record, method=Tracked(quick=True))
    except RotordropError as error:
        return row | {"refused": str(error)}
    row |= {"processor_s": round(time.process_time() - began, 2), "consistent": found.consistent}
    for bearing in found.bearings:
        for (column, key, unit), known in zip(
            TRUTHS, (bearing.peak_force.known, bearing.peak_stress.known), strict=True
        ):
            row[f"{bearing.name}.{column}"] = {
                "estimate": known.value,
                "interval_90": known.interval_90,
                "truth": unit * made.truth[key][bearing.name],
            }
    return row


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--minutes", type=float, default=9.0)
    parser.add_argument("--drops", type=int, default=25)
    asked = parser.parse_args()
    file = asked.folder / "estimates.jsonl"
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {(row["seed"], row["number"]) for row in rows}
    files = sorted(asked.folder.glob("calibrated_*.toml"))
    machines = {int(one.stem.split("_")[1]): load_machine(one) for one in files}
    hidden = {seed: hidden_machine(example_machine("lp400"), seed) for seed in machines}
    until = time.monotonic() + 60.0 * asked.minutes
    for number in range(asked.drops):
        for seed, machine in machines.items():
            if (seed, number) in done:
                continue
            if time.monotonic() > until:
                return
            row = estimated(hidden[seed], machine, seed, number)
            with file.open("a", encoding="utf-8") as out:
                out.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
