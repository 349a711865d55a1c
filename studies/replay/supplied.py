"""What every step says on records in a folder, against the truth where the folder has one.

    python studies/replay/supplied.py FOLDER [--only STEM ...] [--draws 64]

The folder holds ``<stem>.csv`` or ``.txt`` with ``<stem>_tail.csv`` or the tail of a drop of the same speed,
and ``truth/<stem>.json`` for some. Every record is replayed by itself; all but the first are also replayed
with the supports and the friction found on the first (Neisi 2020, section 5.1). The records used here are
simulated by another program.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from pathlib import Path
from typing import Any

from common import RESULTS, known_machine, write

from rotordrop.errors import RotordropError
from rotordrop.estimate.document import estimate_document
from rotordrop.estimation import Replay, estimate_drop
from rotordrop.record.record import Record, read_record
from rotordrop_bench.score import score_estimate

KEPT = ("value", "standard_error", "interval_90", "lower", "upper", "status", "time_s")


def records_of(folder: Path) -> list[Path]:
    """Records of drops, the tails left out; those with a name of their own first."""
    found = sorted([*folder.glob("drop_*.csv"), *folder.glob("drop_*.txt"), *folder.glob("repeat_*.csv")])
    return [path for path in found if not path.stem.endswith("_tail")]


def tail_of(path: Path) -> Path:
    """The tail of a record: its own, or that of a drop of the same speed."""
    own = path.with_name(f"{path.stem}_tail.csv")
    speed = re.findall(r"\d{3}", path.stem)[0]
    return own if own.exists() else path.with_name(f"drop_{speed}_tail.csv")


def brief(entry: dict[str, Any]) -> dict[str, Any]:
    """An entry of an estimate in short."""
    if "value" in entry:
        return {key: entry[key] for key in KEPT if key in entry}
    return {key: brief(value) for key, value in entry.items() if isinstance(value, dict)}


def score(document: dict[str, Any], truth: Path) -> dict[str, Any]:
    """Relative error in percent and coverage of every quantity; errors of gap and power-off as such."""
    found = score_estimate(document, truth)
    errors: dict[str, Any] = {"coverage": found["coverage"]}
    errors["drop_instant_error_us"] = 1e6 * found["drop"]["drop_instant_s"]["error"]
    for name, scores in found["bearings"].items():
        errors[name] = {
            path: {"error_percent": 100.0 * one["relative_error"], "covered": one.get("covered")}
            for path, one in scores.items()
        }
        errors[name]["air_gap_m"]["error_um"] = 1e6 * scores["air_gap_m"]["error"]
    return errors


def one(path: Path, record: Record, tail: Record, fixed: dict[str, Any] | None, draws: int) -> dict[str, Any]:
    """One replay in short."""
    began, used = time.perf_counter(), time.process_time()
    try:
        drop = estimate_drop(known_machine(), record, tail, method=Replay(fixed=fixed, draws=draws))
    except RotordropError as error:  # what it says is the result
        return {"refused": f"{type(error).__name__}: {error}"}
    document = estimate_document(drop)
    truth = path.parent / "truth" / f"{path.stem}.json"
    identification = {
        key: value for key, value in document["identification"].items() if key != "friction_sweep"
    }
    windows = document["agreement"]["windows"]
    short = {
        "speed_Hz": document["speed_Hz"],
        "drop_instant_s": document["drop_instant_s"],
        "bearings": {name: brief(entry) for name, entry in document["bearings"].items()},
        "first_contact": dict(document["first_contact"].items()),
        "identification": identification,
        "orbit_rms_um": {w["name"]: {b: 1e6 * rms for b, rms in w["rms"].items()} for w in windows},
        "horizon_s": {name: entry["horizon_s"] for name, entry in document["agreement"]["bearings"].items()},
        "expected_horizon_s": document["agreement"]["expected_horizon_s"],
        "warnings": document["warnings"],
        "wall_s": time.perf_counter() - began,
        "processor_s": time.process_time() - used,
    }
    if truth.exists():
        short["truth"] = score(document, truth)
    return short | {"document": document}


def say(name: str, found: dict[str, Any]) -> None:
    """One line."""
    if "refused" in found:
        print(name, found["refused"], flush=True)
        return
    peaks = {b: round(entry["peak_force_N"]["value"]) for b, entry in found["bearings"].items()}
    horizon = {b: round(1e3 * h, 1) for b, h in found["horizon_s"].items()}
    print(name, "peaks", peaks, "horizon ms", horizon, f"{found['processor_s']:.0f} s", flush=True)


def main() -> None:
    """Run the folder named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", default=())
    parser.add_argument("--draws", type=int, default=64)
    options = parser.parse_args()
    place = RESULTS / "supplied.json"
    content: dict[str, Any] = json.loads(place.read_text()) if options.only and place.exists() else {}
    first: dict[str, Any] | None = None
    machine = known_machine()
    for path in records_of(options.folder):
        if options.only and path.stem not in options.only and first is not None:
            continue
        record, tail = read_record(path, machine), read_record(tail_of(path), machine)
        own = one(path, record, tail, None, options.draws)
        say(path.stem, own)
        ways = {"own": own}
        if first is None:
            first = own["document"]
        else:
            ways["fixed"] = one(path, record, tail, first, options.draws)
            say(f"{path.stem}, fixed", ways["fixed"])
        content[path.stem] = {
            way: {key: value for key, value in found.items() if key != "document"}
            for way, found in ways.items()
        }
        write("supplied.json", content)


if __name__ == "__main__":
    main()
