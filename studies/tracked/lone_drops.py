"""One drop of an unknown machine, from guesses: with its settled tail and without.

Usage: python studies/tracked/lone_drops.py KIND SEED [SEED ...]

The first thing a newcomer does, and the hardest case for the fit: nothing but the guesses of the machine
file, one recording, perhaps no tail. Every machine is recorded at two speeds; every recording is estimated by
itself, twice. Seeds 4001 to 4006 set the width of the interval of a lone drop's air gap; those from 4201 on
are scored and used nowhere else. ``results/lone_drops/summary.md`` is written at the end, also without seeds.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from blind_calibration import drop_scores, drops_of, holds

from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop

RESULTS = Path(__file__).parent / "results" / "lone_drops"
SCORED_FROM = 4201
FORCES = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N")


def study(kind: str, seed: int) -> list[dict[str, Any]]:
    """Both recordings of one machine, each with and without its tail."""
    known, recordings, _ = drops_of(kind, seed, "none")
    found = []
    for recording in recordings:
        true_gaps = recording.truth["air_gap_m"]
        for tail in (recording.tail, None):
            started = time.perf_counter()
            name = recording.truth["name"]
            entry: dict[str, Any] = {"name": name, "tail": tail is not None}
            try:
                drop = estimate_drop(known, recording.record, tail, name=name)
            except RotordropError as error:  # a refused drop is a result too
                entry["error"] = f"{type(error).__name__}: {error}"
            else:
                entry |= drop_scores(drop, recording)
                entry["air_gaps"] = {
                    bearing.name: {
                        "estimate": bearing.values["air_gap_m"].value,
                        "interval_90": bearing.values["air_gap_m"].interval_90,
                        "truth": true_gaps[bearing.name],
                    }
                    for bearing in drop.bearings
                }
            entry["seconds"] = time.perf_counter() - started
            found.append(entry)
            print(
                json.dumps({key: entry.get(key) for key in ("name", "tail", "nis", "consistent", "error")}),
                flush=True,
            )
    return found


def summary(folder: Path) -> str:
    """Table of the scored machines: errors as median, 90th percentile, worst; coverage of 90 % intervals."""
    lines = [
        "| rotor, recording | drops | peak force | peak stress | mean force | air gap | peaks covered "
        "| gaps covered | flagged | time |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind in ("lp400", "small"):
        files = [file for file in sorted(folder.glob(f"{kind}_*.json")) if _seed(file) >= SCORED_FROM]
        drops = [drop for file in files for drop in json.loads(file.read_text())["drops"]]
        for tail in (True, False):
            chosen = [drop for drop in drops if drop["tail"] == tail]
            if chosen:
                lines.append(_line(f"{kind}, {'with' if tail else 'without'} tail", chosen))
    return "\n".join(lines)


def _seed(file: Path) -> int:
    return int(file.stem.rpartition("_")[2])


def _line(label: str, drops: list[dict[str, Any]]) -> str:
    followed = [drop for drop in drops if "error" not in drop]
    entries = {
        field: [bearing[field] for drop in followed for bearing in drop["bearings"].values()]
        for field in FORCES
    }
    entries["air_gap"] = [gap for drop in followed for gap in drop["air_gaps"].values()]
    cells = []
    for field, found in entries.items():
        apart = [
            abs(e["estimate"] - e["truth"]) / (1e-6 if field == "air_gap" else e["truth"] / 100)
            for e in found
        ]
        low, high, worst = np.median(apart), np.quantile(apart, 0.9), np.max(apart)
        cells.append(f"{low:.2f} / {high:.2f} / {worst:.2f} {'µm' if field == 'air_gap' else '%'}")
    covered = [
        f"{sum(holds(entry) for entry in entries[field])} of {len(entries[field])}"
        for field in ("peak_force_N", "air_gap")
    ]
    flagged = sum(not drop["consistent"] for drop in followed)
    lost = len(drops) - len(followed)
    seconds = float(np.median([drop["seconds"] for drop in drops]))
    cells += [*covered, f"{flagged}" + (f", {lost} refused" if lost else ""), f"{seconds:.0f} s"]
    return f"| {label} | {len(drops)} | {' | '.join(cells)} |"


def main() -> None:
    """Run the machines named on the command line, and summarise all there are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("lp400", "small"))
    parser.add_argument("seeds", type=int, nargs="*")
    parser.add_argument("--out", type=Path, default=RESULTS)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    for seed in chosen.seeds:
        drops = study(chosen.kind, seed)
        target = chosen.out / f"{chosen.kind}_{seed}.json"
        target.write_text(json.dumps({"kind": chosen.kind, "seed": seed, "drops": drops}, indent=1) + "\n")
    text = summary(chosen.out)
    (chosen.out / "summary.md").write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
