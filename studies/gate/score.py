"""Let the gate judge spoiled and clean records, and count what it says.

Usage: python studies/gate/score.py faults FOLDER FIRST LAST
       python studies/gate/score.py clean FOLDER FIRST LAST
       python studies/gate/score.py count [FIRST LAST]

Every judgement is one line of ``results/faults.jsonl`` or ``results/clean.jsonl``; what is there already is
not made again, so a run that was stopped goes on. FOLDER keeps the clean records (`records.py`). A seed
stands for one clean record, spoiled in every way once. A record whose levitated orbit is wider than
0.3 air gaps is left out: no machine runs so (zone limit B/C of ISO 14839-2 is 0.4).
"""

from __future__ import annotations

import json
import sys
import time
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from faults import FAULTS
from records import kept, rotor_of

from rotordrop.errors import RecordError
from rotordrop.evidence import check_record
from rotordrop.record.record import Record

RESULTS = Path(__file__).parent / "results"


def judged(record: Record, tail: Record, seed: int) -> dict[str, Any]:
    """Findings that are more than notes, the worst first, and the processor time it took [s]."""
    begun = time.process_time()
    try:
        found = check_record(record, rotor_of(seed), tail)
        said = [[one.kind, one.severity] for one in found if one.severity != "note"]
        notes = [one.kind for one in found if one.severity == "note"]
    except RecordError as error:
        said, notes = [[f"refused: {str(error)[:120]}", "stop"]], []
    return {"findings": said, "notes": notes, "seconds": round(time.process_time() - begun, 2)}


def done(path: Path) -> set[tuple[str, int]]:
    """Kinds and seeds of the lines that are there."""
    lines = lines_of(path, range(10**9))
    return {(line.get("fault", ""), line["seed"]) for line in lines}


def _wide(record: Record, seed: int) -> bool:
    """Whether the rotor circles wider before the drop than machines are run."""
    gap = min(float(bearing.air_gap) for bearing in rotor_of(seed).touchdown_bearings)
    return float(np.max(np.ptp(record.signals[record.time < -5e-3], axis=0))) > 2.0 * 0.3 * gap


def run(kind: str, folder: Path, seeds: range) -> None:
    """Judge what is missing."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{kind}.jsonl"
    there = done(path)
    with path.open("a") as out:
        for seed in seeds:
            wanted = [fault for fault in (FAULTS if kind == "faults" else [""]) if (fault, seed) not in there]
            if not wanted:
                continue
            record, tail = kept(folder, seed)
            if _wide(record, seed):
                continue
            for fault in wanted:
                line: dict[str, Any] = {"seed": seed, "rotor": rotor_of(seed).name}
                if fault:
                    random = np.random.default_rng((seed, zlib.crc32(fault.encode())))
                    spoiled, end, size = FAULTS[fault].make(record, tail, random)
                    line |= {"fault": fault, "size": size} | judged(spoiled, end, seed)
                else:
                    line |= judged(record, tail, seed)
                out.write(json.dumps(line) + "\n")
                out.flush()


def wilson(hits: int, count: int) -> str:
    """Share with its 95 % interval after Wilson."""
    if not count:
        return "-"
    z, p = 1.96, hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return f"{hits}/{count} = {p:.1%} ({max(middle - half, 0.0):.1%} to {min(middle + half, 1.0):.1%})"


def lines_of(path: Path, seeds: range) -> list[dict[str, Any]]:
    """What was judged of some seeds."""
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.is_file() else []
    return [line for line in lines if line["seed"] in seeds]


def count(seeds: range) -> None:
    """Print what was caught, and under its right name."""
    clean = RESULTS / "clean.jsonl"
    alarms: set[int] = set()
    if lines := lines_of(clean, seeds):
        said = [line for line in lines if line["findings"]]
        alarms = {line["seed"] for line in said}
        kinds = Counter(kind for line in said for kind, _ in line["findings"])
        print(f"false alarms {wilson(len(said), len(lines))} {dict(kinds)}")
    lines = lines_of(RESULTS / "faults.jsonl", seeds)
    total = Counter[str]()
    for fault, one in FAULTS.items():
        mine = [line for line in lines if line["fault"] == fault]
        caught = [line for line in mine if line["findings"]]
        right = [line for line in caught if line["findings"][0][0] in one.names]
        first = Counter(line["findings"][0][0] for line in caught if line not in right)
        total.update(made=len(mine), caught=len(caught), right=len(right))
        print(f"{fault:32} caught {wilson(len(caught), len(mine))}, right name {len(right)}; {dict(first)}")
    print(f"caught {wilson(total['caught'], total['made'])}")
    print(f"right name {wilson(total['right'], total['made'])}; seeds with a false alarm: {sorted(alarms)}")


if __name__ == "__main__":
    if sys.argv[1] == "count":
        count(range(*map(int, sys.argv[2:4] or (1000, 10**6))))
    else:
        run(sys.argv[1], Path(sys.argv[2]), range(int(sys.argv[3]), int(sys.argv[4])))
