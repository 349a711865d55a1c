"""Estimates of the drops of a bench by this package, one process each, and their table.

Usage: python studies/dropbench/estimates.py BENCH ESTIMATES [--only NAME ...] [--limit SECONDS]
    [--table NAME] [--calibrated]

BENCH is a folder of 'rotordrop-bench make'. Estimates that are there already stay; a drop that the estimator
refuses leaves NAME.txt with its reason. Stops by itself after the limit; call it again to go on. Writes
``results/NAME.json`` and ``results/NAME.md`` over all estimates there are of the drops chosen.

With ``--calibrated`` each machine is calibrated first, on two more drops of the same hidden machine at the
two other speeds of its rotor; its drop of the bench is then estimated with the machine file that came out.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

from rotordrop.known import NINETY
from rotordrop_bench import score_bench, score_estimate
from rotordrop_bench.drops import SINCE, SPEEDS, BenchDrop
from rotordrop_bench.files import write_record
from rotordrop_bench.make import bench_recording, chosen_drops, truth_path

HERE = Path(__file__).parent
STEP = 5
CALIBRATION_SEEDS = (20000, 30000)
"""Added to the seed of a drop for the two on which its machine is calibrated."""
SILENT = 0.05
"""Relative error of a peak force beyond which its interval must not miss it without a word [1]."""
SHOWN = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N", "air_gap_m", "parameters")


def estimated(bench: Path, out: Path, name: str, machine: Path) -> float:
    """Estimate one drop; processor time it took [s]."""
    place = bench / "drops" / name
    tail = ["--tail", str(place / "tail.csv")] if (place / "tail.csv").is_file() else []
    call = ["estimate", str(machine), str(place / "record.csv"), *tail, "--json", str(out / f"{name}.json")]
    return called(call, out / f"{name}.json", out / f"{name}.txt")


def calibrated(bench: Path, out: Path, drop: BenchDrop) -> Path:
    """The machine of a drop, calibrated on two other drops; the file is not there where it was refused."""
    machine, place = out / f"{drop.name}.toml", out / drop.name
    if machine.is_file():
        return machine
    place.mkdir(exist_ok=True)
    calls: tuple[list[str], list[str]] = ([], [])
    others = [speed for speed in SPEEDS[drop.rotor] if speed != drop.speed]
    for i, speed in enumerate(others):
        made = bench_recording(replace(drop, speed=speed, drop_seed=drop.drop_seed + CALIBRATION_SEEDS[i]))
        for files, record, kind in zip(calls, (made.record, made.tail), ("record", "tail"), strict=True):
            if record is not None:
                file = place / f"{kind}_{i + 1}.csv"
                write_record(record, file)
                files.append(str(file))
    tails = [part for file in calls[1] for part in ("--tail", file)]
    known = str(bench / "drops" / drop.name / "machine.toml")
    call = ["calibrate", known, *calls[0], *tails, "--output", str(machine), "--even-if-inconsistent"]
    spent = called(call, machine, out / f"{drop.name}.txt")
    print(f"{drop.name} calibrated: {spent:.0f} s of processor time", flush=True)
    return machine


def called(arguments: list[str], written: Path, reason: Path) -> float:
    """Call the program; where it did not write its file, leave what it said. Processor time it took [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "rotordrop", *arguments], capture_output=True, text=True, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if not written.is_file():
        reason.write_text(f"exit code {done.returncode}\n{done.stderr}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def table(bench: Path, out: Path, names: list[str]) -> tuple[str, dict[str, Any]]:
    """The table of all estimates there are, as text, and the scores behind it."""
    scores = score_bench(bench, out, names)
    lines = [
        f"DropBench, version {' and '.join(sorted({SINCE[n] for n in names}))}: {len(scores.drops)} drops.",
        "",
        "| family | quantity | values | missing | median | 90 % | worst | > 10 % | covered | half width |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in scores.rows:
        if row.quantity in SHOWN:
            shares = (row.median, row.ninetieth, row.worst, row.lost, row.covered, row.half_width)
            cells = ["" if s is None else f"{100 * s:.1f} %" for s in shares]
            lines.append(
                f"| {row.family} | {row.quantity} | {row.values} | {row.missing} | {' | '.join(cells)} |"
            )
    lines += ["", _silent(bench, out, scores.drops)]
    lines += [
        "",
        "Peak force: error ± half width of the 90 % interval; ! where that does not hold the truth.",
        "",
        "| drop | family | rotor | what it has | named | consistent | peak force |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for drop in scores.drops:
        name = drop["name"]
        found = scores.unscored.get(name)
        if found is None:
            scored = score_estimate(out / f"{name}.json", truth_path(bench, name), drop=name)
            found = ", ".join(_peak(b, own["peak_force_N"]) for b, own in scored["bearings"].items())
        has, named = (", ".join(drop[key]) for key in ("violated", "named"))
        cells = [name, drop["family"], drop["rotor"], has, named, str(drop["consistent"]), found]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n", scores.as_json()


def _silent(bench: Path, out: Path, drops: Sequence[dict[str, Any]]) -> str:
    """How many peaks are silent, and how many the stated widths would leave so by chance."""
    found, chance, normal = 0, 0.0, NormalDist()
    consistent = [drop["name"] for drop in drops if drop["consistent"]]
    for name in consistent:
        scored = score_estimate(out / f"{name}.json", truth_path(bench, name), drop=name)
        for own in scored["bearings"].values():
            peak = own["peak_force_N"]
            error, half = abs(peak["relative_error"]), peak["half_width"]
            found += error > max(half, SILENT)
            chance += 2.0 * normal.cdf(-NINETY * max(half, SILENT) / half)
    return (
        f"Silent (of {len(consistent)} drops called consistent, outside the interval and more than "
        f"{100 * SILENT:.0f} % off): {found} of the peaks. By chance, errors being normal with the widths "
        f"stated, it would be {chance:.1f}."
    )


def _peak(bearing: str, score: dict[str, Any]) -> str:
    half = f" ± {100 * score['half_width']:.1f}" if "half_width" in score else ""
    outside = "" if score.get("covered", True) else " !"
    return f"{bearing} {100 * score['relative_error']:+.1f}{half} %{outside}"


def main() -> None:
    """Estimate what is missing, then score all there is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bench", type=Path)
    parser.add_argument("estimates", type=Path)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--limit", type=float, default=float("inf"))
    parser.add_argument("--table", default="table")
    parser.add_argument("--calibrated", action="store_true")
    arguments = parser.parse_args()
    out = arguments.estimates
    out.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    drops = chosen_drops(arguments.only)
    names = [drop.name for drop in drops]
    # in steps through the list, so that the part that is done says something of every family
    for drop in [drop for first in range(STEP) for drop in drops[first::STEP]]:
        name = drop.name
        done = (out / f"{name}.json").is_file() or (out / f"{name}.txt").is_file()
        if done or time.monotonic() - started > arguments.limit:
            continue
        machine = arguments.bench / "drops" / name / "machine.toml"
        if arguments.calibrated:
            machine = calibrated(arguments.bench, out, drop)
        if machine.is_file():
            spent = estimated(arguments.bench, out, name, machine)
            print(f"{name}: {spent:.0f} s of processor time", flush=True)
    there = [n for n in names if (out / f"{n}.json").is_file() or (out / f"{n}.txt").is_file()]
    text, scores = table(arguments.bench, out, there)
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results" / f"{arguments.table}.md").write_text(text)
    (HERE / "results" / f"{arguments.table}.json").write_text(json.dumps(scores, indent=1) + "\n")
    print(text)


if __name__ == "__main__":
    main()
