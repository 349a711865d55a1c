"""Pairs of recorded drops of a hidden machine: unchanged, and with a change of the size that is asked for.

    python studies/changed/pairs.py SEED [SEED ...] --out FOLDER

Three drops of each machine are estimated from guesses: two as it is, one after a change of gap (+10 µm), of
support stiffness (−10 %), friction (+20 %) or drag (× 2) at one bearing, in turn by seed.
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
CHANGES = (
    ("NDE.air_gap", lambda value: value + 10e-6),
    ("DE.support.stiffness", lambda value: 0.9 * value),
    ("NDE.friction.dynamic", lambda value: 1.2 * value),
    ("DE.race.drag_coefficient", lambda value: 2.0 * value),
)


def altered(hidden: HiddenMachine, path: str, change: Any) -> HiddenMachine:
    """The same machine after a change of one value."""
    values = {path: change(value_of_path(hidden.machine, path))}
    if path.endswith("support.stiffness"):
        sideways = f"{path}_horizontal"
        values[sideways] = change(value_of_path(hidden.machine, sideways))
    if path.endswith("friction.dynamic"):
        static = path.replace("dynamic", "static")
        values[static] = change(value_of_path(hidden.machine, static))
    machine = hidden.machine.with_values(values)
    return replace(hidden, machine=machine, model=build_drop_model(machine, FINER))


def scored(seed: int) -> dict[str, Any]:
    """What is named between the unchanged drops, and between them and the changed one."""
    known = example_machine("lp400")
    hidden = hidden_machine(known, seed)
    path, change = CHANGES[seed % len(CHANGES)]
    drops = (
        ("first", hidden, 60.0),
        ("second", hidden, 100.0),
        ("changed", altered(hidden, path, change), 100.0),
    )
    documents = {}
    for k, (name, machine, speed) in enumerate(drops):
        made = synthesize_drop(machine, HZ * speed, 100 * seed + k, duration=0.23, name=name)
        documents[name] = estimate_drop(known, made.record, made.tail, method=Tracked()).to_dict()
        print(seed, name, documents[name]["verdict"], flush=True)
    row: dict[str, Any] = {"seed": seed, "changed": path}
    for label, pair in (("unchanged", ("first", "second")), ("after", ("first", "changed"))):
        found = changes(documents[pair[0]], documents[pair[1]])
        row[label] = {"named": [one.path for one in found.named], "sentence": found.sentence()}
        row[f"{label}_all"] = [
            [one.path, one.change, *one.interval_90, one.probability] for one in found.found if one.determined
        ]
    return row


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    for seed in asked.seeds:
        try:
            row = scored(seed)
        except Exception as error:  # a drop that cannot be judged is a result
            row = {"seed": seed, "refused": str(error)}
        (asked.out / f"pair_{seed}.json").write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
        print(json.dumps(row, indent=1), flush=True)


if __name__ == "__main__":
    main()
