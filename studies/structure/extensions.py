"""Machines that differ from the usual model in structure: the twin without extensions and with them.

Usage: python studies/structure/extensions.py CASE SEED [SEED ...] [--machine lp400] [--half | --calibrated]

Each machine is drawn around the description of its owner, who gives guesses only, with the structure of
the case, synthesized by `rotordrop_bench`, which shares nothing with the extensions. One drop
with its settled tail is estimated alone, without extensions and with them; ``--half`` makes the
departure half as large. With ``--calibrated`` the machine is calibrated on two other drops first, and the
estimate is made with it, as it is. ``forms`` runs the forms that no extension stands for. Seeds up to 9999
were used while building; those from 20001 on are scored. ``results/summary.md`` is
written at the end.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop
from rotordrop.machine import Machine
from rotordrop.machine.examples import example_machine
from rotordrop.twin import search as model_search
from rotordrop.twin.calibrated import calibrate_machine
from rotordrop_bench import SyntheticDrop, hidden_machine, synthesize_drop
from rotordrop_bench.departures import LARGE, SLIGHT, departures
from rotordrop_bench.violations import Violations

RESULTS = Path(__file__).parent / "results"
SCORED_FROM = 20001
SPEED_HZ = {"lp400": 120.0, "small": 300.0}
CALIBRATION_HZ = {"lp400": (60.0, 150.0), "small": (200.0, 400.0)}

CASES: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "none": ({}, {}, ""),
    "turned axes": (
        {"support": {"stiffness_ratio": 0.65, "axes_angle": "30 deg"}},
        {"support": {"stiffness_ratio": 0.82, "axes_angle": "30 deg"}},
        "turned support axes",
    ),
    "cubic": (
        {"support": {"hardening": 0.5, "hardening_force": "2.6 kN"}},
        {"support": {"hardening": 0.25, "hardening_force": "2.6 kN"}},
        "cubic support",
    ),
    "foundation": (
        {"foundation": {"mass": "500 kg", "frequency": "95 Hz", "damping_ratio": 0.03}},
        {"foundation": {"mass": "1000 kg", "frequency": "95 Hz", "damping_ratio": 0.03}},
        "foundation mode",
    ),
    "lag 2 kHz": (
        {"sensors": {"time_constant": "80 us"}},
        {"sensors": {"time_constant": "40 us"}},
        "sensor lag",
    ),
    "cross-axis 1 %": (
        {"sensors": {"cross_axis": 0.01}},
        {"sensors": {"cross_axis": 0.005}},
        "cross-axis sensitivity",
    ),
    "cross-axis 5 %": (
        {"sensors": {"cross_axis": 0.05}},
        {"sensors": {"cross_axis": 0.025}},
        "cross-axis sensitivity",
    ),
    "brackets 30 %": (
        {"sensors": {"follows_housing": 0.3}},
        {"sensors": {"follows_housing": 0.15}},
        "brackets that follow the housing",
    ),
    "planes 15 mm off": (
        {"sensors": {"plane_shift": "15 mm"}},
        {"sensors": {"plane_shift": "7.5 mm"}},
        "sensor planes elsewhere",
    ),
    "remanence 50 ms": (
        {"magnets": {"remanence_time": "50 ms"}},
        {"magnets": {"remanence_time": "25 ms"}},
        "long remanence",
    ),
    "unbalance x 1.5": (
        {"rotor": {"unbalance": 1.5}},
        {"rotor": {"unbalance": 1.25}},
        "unbalance beyond its grade",
    ),
    "modulus -3 %": (
        {"rotor": {"youngs_modulus": 0.97}},
        {"rotor": {"youngs_modulus": 0.985}},
        "rotor stiffness",
    ),
}
"""What is true, half of it, and the extension that says so."""

_UNEQUAL = {"support": {"stiffness_ratio": 0.8}}
_CROSS, _LAG = {"cross_axis": 0.02}, {"time_constant": "16 us"}
PAIRS: dict[str, dict[str, Any]] = {
    "unequal stiffness and cross-axis 2 %": {**_UNEQUAL, "sensors": _CROSS},
    "unequal stiffness and sensors of 10 kHz": {**_UNEQUAL, "sensors": _LAG},
    "cross-axis 2 % and sensors of 10 kHz": {"sensors": {**_CROSS, **_LAG}},
}
"""Mild departures, two at once: no extension is needed for them."""
_SAID_OF = {"unequal": "turned support axes", "cross-axis": "cross-axis sensitivity", "sensors": "sensor lag"}

UNEQUAL_DAMPING, FRICTION_FOR_DAMPING = "unequal damping", "hysteretic support"
FORMS = (
    UNEQUAL_DAMPING,
    FRICTION_FOR_DAMPING,
    "contact exponent",
    "contact law",
    "race tilt",
    "gap drift",
    "thermal gap",
    "ball phase",
    "bearing centres",
    "friction",
    "unbalance jump",
)
"""Forms that no extension stands for, most as the bench makes them, in the measure of the machine."""


def departure(kind: str, case: str, size: str) -> dict[str, Any]:
    """What is true of a machine in a case."""
    if case == UNEQUAL_DAMPING:
        return {"support": {"axes_angle": "30 deg", "damping_ratio": 1.4 if size == "half" else 2.0}}
    if case in FORMS:
        kinds = ((case, SLIGHT if size == "half" else LARGE),)
        parts = departures(example_machine(kind), 2.0 * np.pi * SPEED_HZ[kind], kinds)
        if case == FRICTION_FOR_DAMPING:  # which loses about as much at the frequency of the support
            parts["support"]["damping"] = 0.0
        return parts
    return PAIRS[case] if case in PAIRS else CASES[case][1 if size == "half" else 0]


def expected(case: str) -> str:
    """The extension that says what is true; empty where none is expected."""
    return CASES[case][2] if case in CASES else ""


def says_so(case: str) -> set[str]:
    """Extensions that say something true of a machine in a case."""
    if case in PAIRS:
        return {_SAID_OF[half.split()[0]] for half in case.split(" and ")}
    return {expected(case)}


def recorded(kind: str, case: str, seed: int, size: str = "whole") -> list[SyntheticDrop]:
    """Drops of a machine with the structure of a case: one to estimate, then two to calibrate on."""
    broken = Violations.model_validate(departure(kind, case, size))
    hidden = hidden_machine(example_machine(kind), seed, broken)
    speeds = (SPEED_HZ[kind], *CALIBRATION_HZ[kind])
    return [
        synthesize_drop(hidden, 2.0 * np.pi * hz, seed + 100_000 * k, duration=0.3, name=f"{case} {seed} {k}")
        for k, hz in enumerate(speeds)
    ]


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


def compared(kind: str, case: str, seed: int, size: str) -> dict[str, Any]:
    """The estimate without extensions and with them; the first fit, which both share, is made once."""
    machine, drop = example_machine(kind), recorded(kind, case, seed, size)[0]
    extensions, first_fit = model_search.EXTENSIONS, model_search.Search.fit_base
    made: dict[str, Any] = {}

    def once(search: Any, described: Machine) -> Any:
        if "fit" not in made:
            started = time.process_time()
            made["fit"], made["seconds"] = first_fit(search, described), time.process_time() - started
        return made["fit"]

    model_search.Search.fit_base = once  # type: ignore[method-assign]
    try:
        model_search.EXTENSIONS = ()
        before = scored(machine, drop)
        model_search.EXTENSIONS = extensions
        after = scored(machine, drop)
    finally:
        model_search.EXTENSIONS, model_search.Search.fit_base = extensions, first_fit  # type: ignore[method-assign]
    after["seconds"] += made.get("seconds", 0.0)
    return {"before": before, "after": after}


def calibrated(kind: str, case: str, seed: int, size: str) -> dict[str, Any]:
    """The estimate with a machine calibrated on two other drops, and what the calibration found."""
    machine = example_machine(kind)
    drop, *others = recorded(kind, case, seed, size)
    started = time.process_time()
    try:
        known = calibrate_machine(machine, [one.record for one in others], [one.tail for one in others])
    except RotordropError as error:
        return {"after": {"error": f"{type(error).__name__}: {error}", "seconds": 0.0}}
    taken = time.process_time() - started
    found = [{"name": s.name, "gain": s.gain, "sentence": s.sentence} for s in known.structure]
    after = scored(known.machine, drop)
    after["seconds"] += taken
    if "found" in after:
        after["found"] = found + after["found"]
    return {"after": after, "consistent": known.consistent}


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


def line(one: dict[str, Any]) -> str:
    """One line of the table."""
    before, after = one.get("before"), one["after"]
    found = after.get("found", [])
    names = ", ".join(f["name"] for f in found) or "nothing"
    right = all(f["name"] in says_so(one["case"]) for f in found)
    wrong = " (in its place)" if one["case"] in FORMS else " (wrong)"
    gain = ", ".join("inf" if not np.isfinite(f["gain"]) else f"{f['gain']:.0f}" for f in found)

    def both(text: Any, arrow: str = " → ") -> str:
        return text(after) if before is None else f"{text(before)}{arrow}{text(after)}"

    cells = (
        f"{one['machine']} {one['seed']}",
        one["case"],
        "calibrated" if before is None else one["size"],
        "" if before is None else error_text(before, "peak_force"),
        error_text(after, "peak_force"),
        error_text(after, "peak_stress"),
        "" if before is None else error_text(before, "air_gap"),
        error_text(after, "air_gap"),
        both(lambda e: f"{e.get('nis', float('nan')):.2f}"),
        f"{names}{'' if right else wrong}",
        gain,
        both(lambda e: e.get("verdict", "refused")),
        both(lambda e: f"{e['seconds']:.0f}"),
    )
    return "| " + " | ".join(cells) + " |"


def totals(ones: list[dict[str, Any]], which: str) -> str:
    """Median, 90th percentile and worst error of the peak, how many are lost, and intervals that hold."""
    errors, held, count = [], 0, 0
    for one in ones:
        for bearing in one.get(which, {}).get("bearings", {}).values():
            peak = bearing["peak_force"]
            errors.append(100.0 * abs(peak["estimate"] / peak["truth"] - 1.0))
            for entry in bearing.values():
                low, high = entry["interval_90"]
                held, count = held + (low <= entry["truth"] <= high), count + 1
    if not errors:
        return "none"
    median, ninety = np.percentile(errors, (50.0, 90.0))
    lost = sum(error > 10.0 for error in errors)
    return (
        f"{median:.2f} / {ninety:.2f} / {max(errors):.2f} % over {len(errors)} peaks, "
        f"{lost} off by more than 10 %, {held} of {count} intervals of peak force, peak stress and gap hold"
    )


def summary(folder: Path) -> str:
    """One line for every scored machine, before and after side by side."""
    ones = [json.loads(file.read_text()) for file in sorted(folder.glob("*.json"))]
    ones = [one for one in ones if one["seed"] >= SCORED_FROM]
    lines = [
        "| machine | case | departure | peak force before, % | after, % | peak stress after, % "
        "| air gap before, µm | after, µm | NIS | found | gain | verdict | processor time, s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | ---: | --- | --- |",
        *map(line, ones),
        "",
    ]
    alone = [one for one in ones if "before" in one and one["case"] not in FORMS]
    for size in ("whole", "half"):
        chosen = [one for one in alone if one["size"] == size]
        lines += [f"- alone, {size}, without extensions: {totals(chosen, 'before')}"]
        lines += [f"- alone, {size}, with them: {totals(chosen, 'after')}"]
    lines += [f"- calibrated on two drops: {totals([one for one in ones if 'before' not in one], 'after')}"]
    forms = [one for one in ones if one["case"] in FORMS]
    lines += [f"- forms that no extension stands for: {totals(forms, 'after')}"]
    return "\n".join(lines)


def main() -> None:
    """Run the machines named on the command line, and summarise all there are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", choices=(*CASES, *PAIRS, *FORMS, "all", "forms", "summary"))
    parser.add_argument("seeds", type=int, nargs="*")
    parser.add_argument("--machine", choices=tuple(SPEED_HZ), default="lp400")
    parser.add_argument("--half", action="store_true")
    parser.add_argument("--calibrated", action="store_true")
    chosen = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    size = "half" if chosen.half else "whole"
    every = [*CASES, *([] if chosen.half else PAIRS)]
    for seed in chosen.seeds:
        for case in {"all": every, "forms": FORMS}.get(chosen.case, [chosen.case]):
            way = "calibrated" if chosen.calibrated else size
            stem = f"{chosen.machine}_{case}_{way}_{seed}".replace(" ", "_").replace("%", "pct")
            if (file := RESULTS / f"{stem}.json").is_file():
                continue
            found = (calibrated if chosen.calibrated else compared)(chosen.machine, case, seed, size)
            said = {"case": case, "machine": chosen.machine, "seed": seed, "size": size}
            file.write_text(json.dumps({**said, "expected": expected(case), **found}, indent=1) + "\n")
            print(line(json.loads(file.read_text())), flush=True)
    (RESULTS / "summary.md").write_text(summary(RESULTS) + "\n")


if __name__ == "__main__":
    main()
