"""Drops of 50 ms on one thread, on two, and on a local Dask cluster of two processes, in short turns.

    python studies/engines/timing.py --turns 3 --out studies/engines/timing.json

A machine that others use too slows every engine now and then: the engines take turns, and the fastest turn of
each counts. Processor time (of all processes) does not depend on who else computes.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from rotordrop import example_machine
from rotordrop.study.plan import Study, read_study
from rotordrop.study.run import run_study

DROPS, SHARD = 400, 200


def study(seed: int) -> Study:
    """A part of the 10,000 drops."""
    return read_study(
        {
            "drops": DROPS,
            "shard": SHARD,
            "seed": seed,
            "duration": "50 ms",
            "output_step": "20 us",
            "reduction": "quick",
            "vary": {
                "speed": {"uniform": ["20 Hz", "550 Hz"]},
                "*.friction.dynamic": {"uniform": [0.02, 0.3]},
            },
        },
        example_machine("paper"),
    )


def spent() -> float:
    """Processor time of this process and all below it [s]."""
    me = psutil.Process()
    return sum(sum(one.cpu_times()[:2]) for one in (me, *me.children(recursive=True)))


def timed(**engine: Any) -> dict[str, float]:
    """Wall and processor time of a drop [ms]."""
    with tempfile.TemporaryDirectory() as place:
        before, began = spent(), time.monotonic()
        run_study(study(1), Path(place) / "study", **engine)
        wall, used = time.monotonic() - began, spent() - before
    return {"wall_ms": 1e3 * wall / DROPS, "processor_ms": 1e3 * used / DROPS}


def main() -> None:
    import distributed

    parser = argparse.ArgumentParser()
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    turns: dict[str, list[dict[str, float]]] = {
        "one thread": [],
        "two threads": [],
        "dask, two processes": [],
    }
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        engines = ({"threads": 1}, {"threads": 2}, {"dask": cluster.scheduler_address})
        timed(**engines[2])  # compiled kernels are loaded once by every process
        timed(**engines[0])
        for _ in range(asked.turns):
            for name, engine in zip(turns, engines, strict=True):
                turns[name].append(timed(**engine))
                print(name, turns[name][-1], flush=True)
    best = {name: min(row["wall_ms"] for row in rows) for name, rows in turns.items()}
    content = {
        "turns": turns,
        "best_wall_ms": best,
        "two_threads_over_one": best["one thread"] / best["two threads"],
        "dask_over_two_threads": best["dask, two processes"] / best["two threads"],
        "processor_s_for_10000_drops": 10.0 * min(row["processor_ms"] for row in turns["one thread"]),
    }
    asked.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(json.dumps({key: content[key] for key in content if key != "turns"}, indent=1))


if __name__ == "__main__":
    main()
