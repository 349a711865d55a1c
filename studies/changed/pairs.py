"""Pairs of recorded drops of a hidden machine: unchanged, and with changes of the sizes that are asked for.

    python studies/changed/pairs.py SEED [SEED ...] --out FOLDER

Four drops of each machine are estimated from guesses: two as it is, one after a change of gap (+10 µm) at one
bearing, support stiffness (-10 %) and drag (x 2) at the other, one after a change of friction (+20 %) and of
support damping (+20 %). Which bearing is which goes by the seed. Estimates are kept; a second call with the
same folder compares them again.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from rotordrop.estimation import Tracked, estimate_drop
from rotordrop.estimation.changed import changes
from rotordrop.machine import example_machine
from rotordrop.machine.parameter_paths import value_of_path
from rotordrop.model.parameters import build_drop_model
from rotordrop.synthesis.event import FINER, HiddenMachine, hidden_machine
from rotordrop.synthesis.recording import synthesize_drop

HZ = 2.0 * math.pi
BEARINGS = ("NDE", "DE")
CHANGES = (
    (("air_gap", 0), ("support.stiffness", 1), ("race.drag_coefficient", 1)),
    (("friction.dynamic", 0), ("support.damping", 1)),
)
"""What is changed together: the parameter, and at which of two bearings."""
CHANGED = {
    "air_gap": lambda value: value + 10e-6,
    "support.stiffness": lambda value: 0.9 * value,
    "support.damping": lambda value: 1.2 * value,
    "friction.dynamic": lambda value: 1.2 * value,
    "race.drag_coefficient": lambda value: 2.0 * value,
}
WITH_IT = {
    "support.stiffness": "support.stiffness_horizontal",
    "support.damping": "support.damping_horizontal",
    "friction.dynamic": "friction.static",
}
"""What follows a changed value."""


def altered(hidden: HiddenMachine, what: tuple[tuple[str, int], ...]) -> tuple[HiddenMachine, list[str]]:
    """The same machine after some changes, and the paths of what was changed."""
    values, paths = {}, []
    for part, place in what:
        name = BEARINGS[(place + hidden.seed) % 2]
        paths.append(f"{name}.{part}")
        for one in (part, WITH_IT.get(part)):
            if one is not None:
                values[f"{name}.{one}"] = CHANGED[part](value_of_path(hidden.machine, f"{name}.{one}"))
    machine = hidden.machine.with_values(values)
    return replace(hidden, machine=machine, model=build_drop_model(machine, FINER)), paths


def documents_of(seed: int, folder: Path) -> tuple[dict[str, Any], dict[str, list[str]]]:
    """Estimates of the four drops by name, and what was changed before each."""
    known = example_machine("lp400")
    hidden = hidden_machine(known, seed)
    one, first = altered(hidden, CHANGES[0])
    two, second = altered(hidden, CHANGES[1])
    drops = (
        ("first", hidden, 60.0, []),
        ("unchanged", hidden, 100.0, []),
        ("changed", one, 100.0, first),
        ("changed otherwise", two, 100.0, second),
    )
    documents, paths = {}, {}
    for k, (name, machine, speed, changed) in enumerate(drops):
        file = folder / f"{seed}_{k}.json"
        if not file.exists():
            made = synthesize_drop(machine, HZ * speed, 100 * seed + k, duration=0.23, name=name)
            found = estimate_drop(known, made.record, made.tail, method=Tracked()).to_dict()
            kept = ("record", "machine", "consistent", "verdict", "parameters", "joint")
            file.write_text(json.dumps({key: found[key] for key in kept}), encoding="utf-8")
        documents[name], paths[name] = json.loads(file.read_text()), changed
    return documents, paths


def scored(seed: int, folder: Path) -> dict[str, Any]:
    """What is named between the first drop and each of the others."""
    documents, paths = documents_of(seed, folder)
    first, rows = documents["first"], []
    for name, document in documents.items():
        if name == "first":
            continue
        for way, drop in (("joint", {}), ("alone", {"joint": None})):
            found = changes({**first, **drop}, {**document, **drop})
            rows.append(
                {
                    "pair": name,
                    "way": way,
                    "changed": paths[name],
                    "named": [one.path for one in found.named],
                    "of_the_changed": [
                        [one.path, one.change, *one.interval_90, one.probability, one.determined]
                        for one in found.found
                        if one.path in paths[name]
                    ],
                }
            )
    return {"seed": seed, "pairs": rows}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    for seed in asked.seeds:
        try:
            row = scored(seed, asked.out)
        except Exception as error:  # a drop that cannot be judged is a result
            row = {"seed": seed, "refused": str(error)}
        (asked.out / f"pair_{seed}.json").write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
        print(json.dumps(row, indent=1), flush=True)


if __name__ == "__main__":
    main()
