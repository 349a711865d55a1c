"""Atlas of the paper's machine: speed, unbalance, friction and support damping, drops of 50 ms.

    python studies/atlas/atlas.py run FOLDER --minutes 9      # as often as it takes; continues where it was
    python studies/atlas/atlas.py show FOLDER --out studies/atlas

The plan has 100,000 drops (Sobol points). What is finished is an unbroken row of them: part of it is a small
atlas of the same plan.
"""

from __future__ import annotations

import argparse
import json
import math
import threading
import time
from pathlib import Path
from typing import Any

from rotordrop import example_machine
from rotordrop.report.page import write_page
from rotordrop.report.study_page import study_numbers, study_page
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.study.folder import StudyFolder, open_folder, publish
from rotordrop.study.plan import Study, read_study
from rotordrop.study.run import compute_shard
from rotordrop.study.summary import load_results

BY = ("speed", "unbalance.0.amount", "*.friction.dynamic", "*.support.damping")
LIMITS = {"peak_stress": 2.2e9}
KEPT = ("peak_force", "peak_stress", "settling_time", "backward_whirl", "whirl_frequency", "sliding_energy")
"""Quantities whose quantiles stand in the summary."""


def plan() -> Study:
    """The plan of the atlas."""
    machine = example_machine("paper")
    amount = float(machine.unbalances[0].amount)
    table: dict[str, Any] = {
        "name": "atlas: speed, unbalance, friction, support damping",
        "drops": 100_000,
        "shard": 200,
        "seed": 20,
        "design": "sobol",
        "duration": "50 ms",
        "output_step": "20 us",
        "reduction": "quick",
        "vary": {
            "speed": {"uniform": ["20 Hz", "550 Hz"]},
            "*.friction.dynamic": {"uniform": [0.02, 0.3]},
            "*.support.damping": {"log_uniform": ["1e3 N s/m", "5e4 N s/m"]},
            "unbalance.0.amount": {"log_uniform": [f"{0.2e6 * amount} g mm", f"{10e6 * amount} g mm"]},
        },
    }
    return read_study(table, machine)


def run(folder: Path, minutes: float) -> None:
    """Compute shards in their order until the time is over."""
    study = plan()
    place = open_folder(study, folder)
    model = build_drop_model(study.machine, study.reduction)
    until, stop = time.monotonic() + 60.0 * minutes, threading.Event()
    spent, done, began = time.process_time(), 0, time.monotonic()
    first = len(place.finished())
    for shard in range(first, study.shards):
        if time.monotonic() > until:
            break
        found = compute_shard(study, model, shard, stop=stop)
        assert found is not None
        publish(place, study, shard, found)
        done += len(found.reasons)
    cost = {"drops": done, "processor_s": time.process_time() - spent, "wall_s": time.monotonic() - began}
    with (folder / "cost.jsonl").open("a") as file:
        file.write(json.dumps(cost) + "\n")


def rounded(tree: Any) -> Any:
    """The same content with five digits."""
    if isinstance(tree, dict):
        return {key: rounded(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [rounded(value) for value in tree]
    return float(f"{tree:.5g}") if isinstance(tree, float) else tree


def show(folder: Path, out: Path) -> None:
    """Summary with maps, and the page to look at."""
    results = load_results(folder)
    numbers = study_numbers(results, BY, LIMITS)
    rows = [json.loads(line) for line in (folder / "cost.jsonl").read_text().splitlines()]
    drops, seconds = (math.fsum(row[key] for row in rows) for key in ("drops", "processor_s"))
    numbers["cost"] = {
        "planned_drops": plan().drops,
        "finished_drops": len(results),
        "processor_ms_per_drop": 1e3 * seconds / max(drops, 1.0),
        "processor_minutes_for_100000": 1e5 * seconds / max(drops, 1.0) / 60.0,
        "processor_hours_for_1e7": 1e7 * seconds / max(drops, 1.0) / 3600.0,
        "bytes_per_shard": StudyFolder(folder).shard_path(0).stat().st_size,
    }
    numbers["quantiles"] = {k: v for k, v in numbers["quantiles"].items() if k.split(".")[-1] in KEPT}
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(
        json.dumps(rounded(numbers), separators=(",", ":")) + "\n", encoding="utf-8"
    )
    write_page(study_page(results, BY, LIMITS), folder / "atlas.html")
    print(json.dumps(numbers["cost"], indent=1))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("action", choices=("run", "show"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--minutes", type=float, default=9.0)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    asked = parser.parse_args()
    if asked.action == "run":
        run(asked.folder, asked.minutes)
    else:
        show(asked.folder, asked.out)


if __name__ == "__main__":
    main()
