"""Machines that differ from the usual model in structure: the twin without extensions and with them.

Usage: python studies/structure/extensions.py CASE SEED [SEED ...] [--machine lp400]

Each machine is drawn around the description of its owner, who gives guesses only, with the structure of
the case, synthesized by `rotordrop.synthesis`, which shares nothing with the extensions. One drop
from 120 Hz with its settled tail is estimated alone, without extensions and with them. Seeds up to 9999 were
used while building; those from 20001 on are scored. ``results/summary.md`` is written at the end.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop, structure_search, tracked
from rotordrop.machine import Machine
from rotordrop.machine.examples import example_machine
from rotordrop.synthesis import SyntheticDrop, hidden_machine, synthesize_drop
from rotordrop.synthesis.violations import Violations

RESULTS = Path(__file__).parent / "results"
SCORED_FROM = 20001
SPEED = 2.0 * np.pi * 120.0

CASES: dict[str, tuple[dict[str, Any], str]] = {
    "none": ({}, ""),
    "turned axes": ({"support": {"stiffness_ratio": 0.65, "axes_angle": "30 deg"}}, "turned support axes"),
    "cubic": ({"support": {"hardening": 0.5, "hardening_force": "2.6 kN"}}, "cubic support"),
    "foundation": (
        {"foundation": {"mass": "500 kg", "frequency": "95 Hz", "damping_ratio": 0.03}},
        "foundation mode",
    ),
    "lag 2 kHz": ({"sensors": {"time_constant": "80 us"}}, "sensor lag"),
    "cross-axis 1 %": ({"sensors": {"cross_axis": 0.01}}, "cross-axis sensitivity"),
    "cross-axis 5 %": ({"sensors": {"cross_axis": 0.05}}, "cross-axis sensitivity"),
    "brackets 30 %": ({"sensors": {"follows_housing": 0.3}}, "brackets that follow the housing"),
    "planes 15 mm off": ({"sensors": {"plane_shift": "15 mm"}}, "sensor planes elsewhere"),
    "remanence 50 ms": ({"magnets": {"remanence_time": "50 ms"}}, "long remanence"),
    "unbalance x 1.5": ({"rotor": {"unbalance": 1.5}}, "unbalance beyond its grade"),
    "modulus -3 %": ({"rotor": {"youngs_modulus": 0.97}}, "rotor stiffness"),
}
"""What is true, and the extension that says so."""


def recorded(machine: Machine, case: str, seed: int) -> SyntheticDrop:
    """One drop of the machine with the structure of a case."""
    hidden = hidden_machine(machine, seed, Violations.model_validate(CASES[case][0]))
    return synthesize_drop(hidden, SPEED, seed, duration=0.3, name=f"{case} {seed}")


def scored(machine: Machine, drop: SyntheticDrop) -> dict[str, Any]:
    """Errors and intervals of one estimate."""
    started = time.process_time()
    try:
        estimate = estimate_drop(machine, drop.record, drop.tail, name="drop")
    except RotordropError as error:
        return {"error": f"{type(error).__name__}: {error}", "seconds": time.process_time() - started}
    truth = drop.truth
    bearings = {}
    for one in estimate.bearings:
        numbers = {
            "peak_force": (one.peak_force.known, truth["peak_force_N"][one.name]),
            "peak_stress": (one.peak_stress.known, 1e6 * truth["max_stress_MPa"][one.name]),
            "air_gap": (one.values["air_gap_m"], truth["air_gap_m"][one.name]),
        }
        bearings[one.name] = {
            name: {"estimate": known.value, "interval_90": known.interval_90, "truth": true}
            for name, (known, true) in numbers.items()
        }
    return {
        "seconds": time.process_time() - started,
        "verdict": estimate.verdict.name,
        "nis": estimate.nis,
        "found": [{"name": s.name, "gain": s.gain, "sentence": s.sentence} for s in estimate.structure],
        "bearings": bearings,
    }


def compared(machine: Machine, case: str, seed: int) -> dict[str, Any]:
    """The estimate without extensions and with them; the first fit, which both share, is made once."""
    drop = recorded(machine, case, seed)
    extensions, first_fit = structure_search.EXTENSIONS, tracked._Search.first_fit
    made: dict[str, Any] = {}

    def once(search: Any, described: Machine) -> Any:
        if "fit" not in made:
            started = time.process_time()
            made["fit"], made["seconds"] = first_fit(search, described), time.process_time() - started
        return made["fit"]

    tracked._Search.first_fit = once  # type: ignore[method-assign]
    try:
        structure_search.EXTENSIONS = ()
        before = scored(machine, drop)
        structure_search.EXTENSIONS = extensions
        after = scored(machine, drop)
    finally:
        structure_search.EXTENSIONS, tracked._Search.first_fit = extensions, first_fit  # type: ignore[method-assign]
    after["seconds"] += made.get("seconds", 0.0)
    return {"case": case, "seed": seed, "expected": CASES[case][1], "before": before, "after": after}


def error_text(one: dict[str, Any], field: str) -> str:
    """Errors at both bearings [%], or [µm] of the gap; ! outside the interval."""
    if "error" in one:
        return "refused"
    texts = []
    for bearing in one["bearings"].values():
        entry = bearing[field]
        apart = entry["estimate"] - entry["truth"]
        shown = 1e6 * apart if field == "air_gap" else 100.0 * apart / entry["truth"]
        low, high = entry["interval_90"]
        texts.append(f"{shown:+.1f}{'' if low <= entry['truth'] <= high else '!'}")
    return " / ".join(texts)


def summary(folder: Path) -> str:
    """One line for every scored machine, before and after side by side."""
    lines = [
        "| case | seed | peak force before, % | after, % | peak stress after, % | air gap before, µm "
        "| after, µm | NIS | found | gain | verdict | processor time, s |",
        "| --- | ---: | --- | --- | --- | --- | --- | --- | --- | ---: | --- | --- |",
    ]
    for file in sorted(folder.glob("*.json")):
        one = json.loads(file.read_text())
        if one["seed"] < SCORED_FROM:
            continue
        before, after = one["before"], one["after"]
        found = after.get("found", [])
        names = ", ".join(f["name"] for f in found) or "nothing"
        right = [f["name"] for f in found] == [one["expected"]] or (not found and not one["expected"])
        gain = ", ".join("inf" if not np.isfinite(f["gain"]) else f"{f['gain']:.0f}" for f in found)
        nis = f"{before.get('nis', float('nan')):.2f} → {after.get('nis', float('nan')):.2f}"
        lines.append(
            f"| {one['case']} | {one['seed']} | {error_text(before, 'peak_force')} "
            f"| {error_text(after, 'peak_force')} | {error_text(after, 'peak_stress')} "
            f"| {error_text(before, 'air_gap')} | {error_text(after, 'air_gap')} | {nis} "
            f"| {names}{'' if right else ' (wrong)'} | {gain} "
            f"| {before.get('verdict', 'refused')} → {after.get('verdict', 'refused')} "
            f"| {before['seconds']:.0f} → {after['seconds']:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the machines named on the command line, and summarise all there are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", choices=(*CASES, "summary"))
    parser.add_argument("seeds", type=int, nargs="*")
    parser.add_argument("--machine", default="lp400")
    chosen = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    machine = example_machine(chosen.machine)
    for seed in chosen.seeds:
        found = compared(machine, chosen.case, seed)
        stem = f"{chosen.machine}_{chosen.case}_{seed}".replace(" ", "_").replace("%", "pct")
        (RESULTS / f"{stem}.json").write_text(json.dumps(found, indent=1) + "\n")
    text = summary(RESULTS)
    (RESULTS / "summary.md").write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
