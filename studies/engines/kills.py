"""Kill a study at random moments on each engine: no finished shard may be lost, no bit may change.

    python studies/engines/kills.py --kills 20 --out studies/engines/kills.json

Engines: threads of one process; two processes that claim shards; the driver of a local Dask cluster; two
processes and a cluster in one folder.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from rotordrop import example_machine
from rotordrop.study.plan import Study, read_study
from rotordrop.study.run import run_study

TABLE = {
    "drops": 800,
    "shard": 8,
    "duration": "15 ms",
    "reduction": "quick",
    "seed": 7,
    "vary": {"speed": {"uniform": ["60 Hz", "200 Hz"]}, "*.friction.dynamic": {"uniform": [0.05, 0.2]}},
}
ENGINES = ("threads", "claim", "dask", "mixed")


def study() -> Study:
    """The study that is killed."""
    return read_study(TABLE, example_machine("lp400"))


def hashes(folder: Path) -> dict[str, str]:
    """Finished shards by name."""
    files = sorted((folder / "shards").glob("[0-9]*.npy"))
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def work(engine: str, folder: Path) -> None:
    """One process of an engine."""
    if engine == "dask":
        run_study(study(), folder, dask="local")
    else:
        run_study(study(), folder, threads=2 if engine == "threads" else 1)


def started(engine: str, folder: Path) -> list[subprocess.Popen[bytes]]:
    """The processes of an engine, each in a group of its own."""
    everybody = {"claim": ["claim"] * 2, "mixed": ["claim", "claim", "dask"]}.get(engine, [engine])
    quiet = subprocess.DEVNULL
    return [
        subprocess.Popen(
            [sys.executable, __file__, "--work", one, str(folder)], start_new_session=True, stderr=quiet
        )
        for one in everybody
    ]


def awaited(children: list[subprocess.Popen[bytes]], folder: Path, known: int, chance: random.Random) -> None:
    """Wait for the moment of a kill: now and then while the engine starts, else soon after a new shard."""
    early = chance.random() < 0.3
    wait = time.monotonic() + (chance.uniform(0.5, 10.0) if early else 60.0)
    while any(one.poll() is None for one in children) and time.monotonic() < wait:
        time.sleep(0.02)
        if not early and len(hashes(folder)) > known:
            early, wait = True, time.monotonic() + chance.uniform(0.0, 2.0)


def killed(engine: str, serial: dict[str, str], kills: int, chance: random.Random) -> dict[str, Any]:
    """Kill an engine again and again, finish, and compare."""
    lost = changed = rounds = done = orphans = 0
    different: list[str] = []
    while done < kills:
        folder = Path(tempfile.mkdtemp()) / "study"
        rounds += 1
        before: dict[str, str] = {}
        while len(before) < len(serial):
            children = started(engine, folder)
            awaited(children, folder, len(before), chance)
            for one in children:
                if one.poll() is None:
                    one.send_signal(signal.SIGKILL)  # the driver alone: its workers must not live on
                    one.wait()
                    done += 1
            now = hashes(folder)
            lost += len(before.keys() - now.keys())
            changed += sum(now[name] != value for name, value in before.items() if name in now)
            before = now
            orphans += sum(ended(one.pid) for one in children)
        work("threads", folder)
        if hashes(folder) != serial:
            different.append(str(rounds))
        shutil.rmtree(folder.parent, ignore_errors=True)
    return {
        "kills": done,
        "studies": rounds,
        "finished_shards_lost": lost,
        "finished_shards_changed": changed,
        "results_different": len(different),
        "groups_that_lived_on": orphans,
    }


def ended(group: int) -> bool:
    """Whether somebody of a process group still lives after some seconds; ends it then."""
    until = time.monotonic() + 15.0
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.2)
    os.killpg(group, signal.SIGKILL)
    return True


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", nargs=2)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1, help="moments of the kills; --out is added to")
    parser.add_argument("--engine", action="append", choices=ENGINES)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    if asked.work:
        work(asked.work[0], Path(asked.work[1]))
        return
    with tempfile.TemporaryDirectory() as place:
        run_study(study(), Path(place) / "serial", threads=1)
        serial = hashes(Path(place) / "serial")
    chance = random.Random(asked.seed)
    summary = json.loads(asked.out.read_text()) if asked.out and asked.out.exists() else {}
    for engine in asked.engine or ENGINES:
        found = killed(engine, serial, asked.kills, chance)
        known = summary.get(engine, {})
        summary[engine] = {key: value + known.get(key, 0) for key, value in found.items()}
        print(engine, json.dumps(summary[engine]), flush=True)
        if asked.out:
            asked.out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
