"""What a shard costs beside its drops, with 1 to 64 workers that claim in one folder, and what 1e7 drops do.

    python studies/engines/overhead.py --out studies/engines/overhead.json

The workers are processes with the real claims and the real files, but their drops take time only and no
processor, so that 64 of them can be watched on two cores. A folder with as many finished shards as a large
study has is listed beside it: every worker that shows its progress does so twice a second.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop import example_machine
from rotordrop.study import run as engine
from rotordrop.study.folder import Shard, StudyFolder, open_folder
from rotordrop.study.plan import Study, read_study
from rotordrop.study.quantities import columns_of

WORKERS = (1, 2, 4, 8, 16, 32, 64)
SHARD, DROP, ROUNDS = 200, 0.0104, 4
"""Drops of a shard, processor time of one [s] (`studies/atlas`), and shards of each worker."""
MANY = 50_000


def study(shards: int) -> Study:
    """A study of so many shards."""
    return read_study(
        {"drops": SHARD * shards, "shard": SHARD, "speed": "60 Hz", "duration": "50 ms"},
        example_machine("paper"),
    )


def slept(plan: Study, model: Any, shard: int, claim: Any = None, stop: Any = None) -> Shard:
    """The shard of a worker that computes nothing for as long as the drops would take."""
    time.sleep(DROP * SHARD)
    count = len(plan.drops_of(shard))
    return Shard(
        first=shard * SHARD,
        varied=plan.values(shard * SHARD, shard * SHARD + count),
        numbers=np.zeros((count, len(columns_of(plan.machine)))),
        reasons=("",) * count,
    )


def worked(plan: Study, folder: Path, start: Any) -> None:
    """One worker, by the code that every worker runs."""
    engine.compute_shard, engine.build_drop_model = slept, lambda *_: None  # type: ignore[assignment]
    start.wait()
    place = StudyFolder(folder)
    for shard in range(plan.shards):
        engine._work(plan, None, place, shard, None)  # type: ignore[arg-type]


def measured(workers: int) -> dict[str, float]:
    """Time and processor time of a shard beside its drops [s], with so many workers."""
    plan = study(workers * ROUNDS)
    context = multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory() as place:
        open_folder(plan, Path(place) / "study")
        start = context.Event()
        everybody = [
            context.Process(target=worked, args=(plan, Path(place) / "study", start)) for _ in range(workers)
        ]
        for one in everybody:
            one.start()
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        start.set()
        for one in everybody:
            one.join()
        wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        assert len(StudyFolder(Path(place) / "study").finished()) == plan.shards
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "workers": workers,
        "beside_the_drops_ms_per_shard": 1e3 * (wall / ROUNDS - DROP * SHARD),
        "processor_ms_per_shard": 1e3 * spent / plan.shards,
    }


def listed() -> float:
    """Time of one look at a folder of many finished shards [s]."""
    with tempfile.TemporaryDirectory() as place:
        folder = StudyFolder(Path(place))
        folder.shards.mkdir()
        for shard in range(MANY):
            folder.shard_path(shard).touch()
        times = []
        for _ in range(5):
            began = time.process_time()
            folder.finished()
            times.append(time.process_time() - began)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = [measured(workers) for workers in WORKERS]
    look, shards = listed(), 1e7 / SHARD
    projection = [
        {
            "workers": row["workers"],
            "hours_for_1e7_drops": shards
            * (DROP * SHARD + 1e-3 * row["beside_the_drops_ms_per_shard"])
            / row["workers"]
            / 3600.0,
        }
        for row in rows
    ]
    content = {
        "drop_s": DROP,
        "drops_of_a_shard": SHARD,
        "rows": rows,
        "look_at_50000_shards_s": look,
        "projection": projection,
        "gigabytes_for_1e7_drops": math.ceil(1e7 * 600.0 / 1e8) / 10.0,
    }
    asked.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(content, indent=1))


if __name__ == "__main__":
    main()
