"""Bits and processor time of two versions, measured in turn: what digests and checks cost.

Usage: python studies/damaged/speed.py BEFORE NOW
       python studies/damaged/speed.py show

Both are folders with the sources of a version, one of them unpacked by
`git archive COMMIT src bench | tar -x -C BEFORE`. Each is asked five times, in turn, in a process of its own.

`show` asks `rotordrop study show` of a folder of 1,000 drops, and the reading in it, with the shards compared
and with them taken as they are, in turn.
"""

from __future__ import annotations

import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from rotordrop import example_machine, read_record
from rotordrop.cli.app import run
from rotordrop.evidence.quality import check_record
from rotordrop.record.examples import example_record_path
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study import summary
from rotordrop.study.folder import Shard, StudyFolder, open_folder, publish
from rotordrop.study.plan import Study, read_study
from rotordrop.study.quantities import columns_of
from rotordrop.study.summary import load_results

ROUNDS, SHARDS, DROPS = 5, 50, 64
MACHINE = example_machine("lp400")
STUDY = {
    "drops": SHARDS * DROPS,
    "shard": DROPS,
    "vary": {"speed": {"uniform": ["60 Hz", "200 Hz"]}},
}


def _written(folder: Path, study: Study) -> None:
    place = open_folder(study, folder)
    for shard in range(study.shards):
        drops = study.drops_of(shard)
        drawn = study.values(drops.start, drops.stop)
        numbers = np.ones((len(drops), len(columns_of(MACHINE))))
        made = Shard(first=drops.start, varied=drawn, numbers=numbers, reasons=("",) * len(drops))
        publish(place, study, shard, made)


def measured() -> dict[str, object]:
    """Fingerprint, and processor time of everything by name [s]."""
    paths = [example_record_path(name) for name in ("lp400_drop_060", "lp400_drop_060_tail")]
    record, tail = (read_record(path, MACHINE) for path in paths)
    with tempfile.TemporaryDirectory() as name:
        study = read_study(STUDY, MACHINE)
        folders = iter(Path(name) / str(k) for k in range(ROUNDS))
        work: dict[str, Callable[[], object]] = {
            "record, HDF5": lambda: read_record(paths[0], MACHINE),
            "record, text": lambda: read_record(paths[1], MACHINE),
            f"{SHARDS} shards of {DROPS} drops, written": lambda: _written(next(folders), study),
            "the same, read": lambda: load_results(Path(name) / "0"),
            "gate": lambda: check_record(record, MACHINE, tail),
        }
        spent = {what: min(_spent(do) for _ in range(3)) for what, do in work.items()}
    return {"fingerprint": fingerprint(), **spent}


def _spent(do: Callable[[], object]) -> float:
    begun = time.process_time()
    do()
    return time.process_time() - begun


def _unverified(folder: StudyFolder, study: Study, shards: list[int]) -> Iterator[tuple[int, object]]:
    """Shards as they lie there: no digest, nothing drawn again."""
    for shard in shards:
        content = io.BytesIO(folder.shard_path(shard).read_bytes())
        yield shard, np.load(content, allow_pickle=False)


def show(folder: str, *, verified: bool) -> tuple[float, float]:
    """Processor time of reading a study folder and of the command that shows it [s]."""
    if not verified:
        summary.read_shards = _unverified
    place, study = summary.StudyFolder(Path(folder)), summary.study_of(folder)
    read = min(_spent(lambda: list(summary.read_shards(place, study, place.finished()))) for _ in range(20))
    begun = time.process_time()
    assert run(["study", "show", folder]) == 0
    return read, time.process_time() - begun


def main_show() -> None:
    """Show one folder in turn with and without comparing; print both times and their ratio."""
    with tempfile.TemporaryDirectory() as name:
        folder = str(Path(name) / "study")
        study = read_study(STUDY | {"drops": 1000, "shard": 16}, MACHINE)
        _written(Path(folder), study)
        rounds = []
        for _ in range(ROUNDS):
            for verified in (False, True):
                begun = resource.getrusage(resource.RUSAGE_CHILDREN)
                call = [sys.executable, __file__, "show", folder, *(["compare"] if verified else [])]
                done = subprocess.run(call, capture_output=True, text=True, check=True)
                spent = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begun.ru_utime
                rounds.append((*map(float, done.stdout.split()[-2:]), spent))
    table = np.array(rounds).reshape(ROUNDS, 2, 3)
    for k, what in enumerate(("reading 63 shards", "command", "whole process")):
        without, compared = table[:, 0, k], table[:, 1, k]
        ratio = compared / without
        print(
            f"{what:20} {1e3 * np.median(without):7.1f} {1e3 * np.median(compared):7.1f} ms, "
            f"{np.median(ratio):.2f} ({np.min(ratio):.2f} to {np.max(ratio):.2f})"
        )


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
    if sys.argv[1:] == ["show"]:
        main_show()
    elif sys.argv[1:2] == ["show"]:
        print(*show(sys.argv[2], verified="compare" in sys.argv))
    else:
        main() if len(sys.argv) > 1 else print(json.dumps(measured()))
