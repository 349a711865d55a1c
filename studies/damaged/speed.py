"""Bits and processor time of two versions, measured in turn: what digests and checks cost.

Usage: python studies/damaged/speed.py BEFORE NOW

Both are folders with the sources of a version, one of them unpacked by
`git archive COMMIT src bench | tar -x -C BEFORE`. Each is asked five times, in turn, in a process of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rotordrop import example_machine, read_record
from rotordrop.evidence.quality import check_record
from rotordrop.record.examples import example_record_path
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study.folder import Shard, open_folder, publish
from rotordrop.study.plan import read_study
from rotordrop.study.quantities import columns_of
from rotordrop.study.summary import load_results

ROUNDS, SHARDS, DROPS = 5, 50, 64
MACHINE = example_machine("lp400")
STUDY = {
    "drops": SHARDS * DROPS,
    "shard": DROPS,
    "vary": {"speed": {"uniform": ["60 Hz", "200 Hz"]}},
}


def _written(folder: Path) -> None:
    study = read_study(STUDY, MACHINE)
    place, numbers = open_folder(study, folder), np.ones((DROPS, len(columns_of(MACHINE))))
    for shard in range(SHARDS):
        first = shard * DROPS
        drawn = study.values(first, first + DROPS)
        publish(place, study, shard, Shard(first=first, varied=drawn, numbers=numbers, reasons=("",) * DROPS))


def measured() -> dict[str, object]:
    """Fingerprint, and processor time of everything by name [s]."""
    paths = [example_record_path(name) for name in ("lp400_drop_060", "lp400_drop_060_tail")]
    record, tail = (read_record(path, MACHINE) for path in paths)
    with tempfile.TemporaryDirectory() as name:
        folders = iter(Path(name) / str(k) for k in range(ROUNDS))
        work: dict[str, Callable[[], object]] = {
            "record, HDF5": lambda: read_record(paths[0], MACHINE),
            "record, text": lambda: read_record(paths[1], MACHINE),
            f"{SHARDS} shards of {DROPS} drops, written": lambda: _written(next(folders)),
            "the same, read": lambda: load_results(Path(name) / "0"),
            "gate": lambda: check_record(record, MACHINE, tail),
        }
        spent = {what: min(_spent(do) for _ in range(3)) for what, do in work.items()}
    return {"fingerprint": fingerprint(), **spent}


def _spent(do: Callable[[], object]) -> float:
    begun = time.process_time()
    do()
    return time.process_time() - begun


def _asked(folder: str) -> dict[str, object]:
    source = Path(folder).resolve()
    path = os.pathsep.join(str(source / part) for part in ("src", "bench/src"))
    done = subprocess.run(
        [sys.executable, __file__], env=os.environ | {"PYTHONPATH": path}, capture_output=True, check=True
    )
    return json.loads(done.stdout)


def main() -> None:
    """Ask both in turn and print a row for each thing."""
    rounds = [[_asked(folder) for folder in sys.argv[1:]] for _ in range(ROUNDS)]
    prints = {str(one["fingerprint"])[:16] for both in rounds for one in both}
    print(f"fingerprints: {', '.join(sorted(prints))}")
    for what in list(rounds[0][0])[1:]:
        before, now = (np.array([float(str(both[k][what])) for both in rounds]) for k in (0, 1))
        ratio = now / before
        print(
            f"{what:36} {1e3 * np.median(before):8.1f} {1e3 * np.median(now):8.1f} ms, "
            f"{np.median(ratio):.2f} ({np.min(ratio):.2f} to {np.max(ratio):.2f})"
        )


if __name__ == "__main__":
    main() if len(sys.argv) > 1 else print(json.dumps(measured()))
