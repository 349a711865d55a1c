"""Eight processes write to one log and are killed at random moments: nothing added may be lost or torn.

python studies/ledger/kills.py --entries 1000 --processes 8 --kills 40 --out studies/ledger/kills.json
python studies/ledger/kills.py --where postgresql://… --out studies/ledger/kills_postgresql.json
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from rotordrop.errors import UsageError
from rotordrop.ledger import LoggedDrop, Severity, add_drop, logged_drops
from rotordrop.ledger.book import QUANTITIES


def entry(process: int, k: int) -> LoggedDrop:
    """One drop with eight numbers of two bearings, known from its place alone."""
    severity = tuple(
        Severity(bearing=b, quantity=q, unit=unit, value=float(k), lower=k - 1.0, upper=k + 1.0)
        for b in ("NDE", "DE")
        for q, unit in QUANTITIES.items()
    )
    return LoggedDrop(
        machine="m",
        bearing_set="1",
        record=f"{process}-{k}",
        sha256=f"{process:02d}{k:062d}",
        speed=1.0 + k,
        duration=1.0,
        method="tracked",
        verdict="",
        severity=severity,
    )


def write(where: str, process: int, entries: int, said: Path) -> None:
    """Add the entries that are not there yet, and say every one that was acknowledged."""
    known = {int(line) for line in said.read_text().split()} if said.exists() else set()
    with said.open("a") as told:
        for k in range(entries):
            if k in known:
                continue
            with suppress(UsageError):  # it was written before the kill and not yet said
                add_drop(where, entry(process, k))
            told.write(f"{k}\n")
            told.flush()


def start(where: str, process: int, entries: int, said: Path) -> subprocess.Popen[bytes]:
    """A writer of its own."""
    return subprocess.Popen(
        [sys.executable, __file__, "--write", where, str(process), str(entries), str(said)]
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", nargs=4)
    parser.add_argument("--where")
    parser.add_argument("--entries", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=8)
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    if asked.write:
        where, process, entries, said = asked.write
        write(where, int(process), int(entries), Path(said))
        return
    with tempfile.TemporaryDirectory() as folder:
        summary = run(asked, Path(folder))
    print(json.dumps(summary, indent=1))
    if asked.out:
        asked.out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")


def run(asked: argparse.Namespace, folder: Path) -> dict[str, object]:
    """Write, kill, start again, and look at what is there in the end."""
    chance = random.Random(1)
    where = asked.where or str(folder / "log.sqlite")
    said = [folder / f"said-{p}" for p in range(asked.processes)]
    began, kills = time.monotonic(), 0
    running = {p: start(where, p, asked.entries, said[p]) for p in range(asked.processes)}
    while any(child.poll() is None for child in running.values()):
        time.sleep(chance.uniform(0.2, 1.5))
        alive = [p for p, child in running.items() if child.poll() is None]
        if alive and kills < asked.kills:
            p = chance.choice(alive)
            running[p].send_signal(signal.SIGKILL)
            running[p].wait()
            kills += 1
            running[p] = start(where, p, asked.entries, said[p])
    seconds = time.monotonic() - began
    found = logged_drops(where)
    there = {drop.record: drop for drop in found.values()}
    told = {f"{p}-{k}" for p in range(asked.processes) for k in said[p].read_text().split()}
    torn = [
        name
        for name, drop in there.items()
        if set(drop.severity) != set(entry(*map(int, name.split("-"))).severity)
    ]
    sound = "not asked"
    if asked.where is None:
        with sqlite3.connect(where) as connection:
            sound = connection.execute("PRAGMA integrity_check").fetchone()[0]
    return {
        "where": "SQLite" if asked.where is None else "PostgreSQL",
        "processes": asked.processes,
        "entries_each": asked.entries,
        "kills": kills,
        "seconds": round(seconds, 1),
        "acknowledged": len(told),
        "there": len(there),
        "doubled": len(found) - len(there),
        "lost": len(told - there.keys()),
        "torn": len(torn),
        "exit_codes": sorted({child.returncode for child in running.values()}),
        "integrity": sound,
    }


if __name__ == "__main__":
    main()
