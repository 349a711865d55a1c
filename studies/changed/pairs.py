"""Pairs of recorded drops of a hidden machine: unchanged, and with one change of the size that is asked for.

    python studies/changed/pairs.py estimate FOLDER SEED [SEED ...] [--minutes 9]    # continues where it was
    python studies/changed/pairs.py score FOLDER --out studies/changed/pairs.json

Eight drops of each machine are estimated from guesses: two as it is, one after each of five changes at one
bearing (gap +10 µm, support stiffness -10 %, its damping +10 %, friction +20 %, drag x 2), and one more as it
is. The first is compared with each of the others, and then every unchanged one with every other. Which
bearing is changed goes by the seed. Estimates are
kept with their peaks and true peaks, which `studies/repeat/ranking.py` takes too (``drops.jsonl``).
Seeds up to 3101 were looked at while the comparison was made; only later ones are scored.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from rotordrop.errors import RotordropError
from rotordrop.estimate.changed import changes
from rotordrop.estimate.published import drop_of
from rotordrop.estimation import Tracked, estimate_drop
from rotordrop.machine import example_machine
from rotordrop.machine.machine import value_of_path
from rotordrop.rotor.parameters import build_drop_model
from rotordrop_bench.event import FINER, HiddenMachine, hidden_machine
from rotordrop_bench.recording import synthesize_drop

HZ = 2.0 * math.pi
BEARINGS = ("NDE", "DE")
CHANGED: dict[str, Callable[[float], float]] = {
    "air_gap": lambda value: value + 10e-6,
    "support.stiffness": lambda value: 0.9 * value,
    "support.damping": lambda value: 1.1 * value,
    "friction.dynamic": lambda value: 1.2 * value,
    "race.drag_coefficient": lambda value: 2.0 * value,
}
WITH_IT = {
    "support.stiffness": "support.stiffness_horizontal",
    "support.damping": "support.damping_horizontal",
    "friction.dynamic": "friction.static",
}
"""What follows a changed value."""
DROPS: tuple[tuple[str | None, float], ...] = (
    (None, 60.0),
    (None, 100.0),
    *((part, 100.0) for part in CHANGED),
    (None, 80.0),
)
"""What is changed before a drop, and its speed [Hz]; the first drop is compared with the others."""
TRUTHS = (("peak_force", "peak_force_N", 1.0), ("peak_stress", "max_stress_MPa", 1e6))


def altered(hidden: HiddenMachine, part: str, path: str) -> HiddenMachine:
    """The same machine after a change."""
    owner = path.removesuffix(f".{part}")
    paths = [f"{owner}.{one}" for one in (part, WITH_IT.get(part)) if one is not None]
    machine = hidden.machine.with_values(
        {one: CHANGED[part](value_of_path(hidden.machine, one)) for one in paths}
    )
    return replace(hidden, machine=machine, model=build_drop_model(machine, FINER))


def estimated(seed: int, k: int) -> dict[str, Any]:
    """One drop as its owner estimates it, beside the truth."""
    known = example_machine("lp400")
    hidden = hidden_machine(known, seed)
    part, speed = DROPS[k]
    path = None if part is None else f"{BEARINGS[(seed + k) % 2]}.{part}"
    machine = hidden if part is None or path is None else altered(hidden, part, path)
    made = synthesize_drop(machine, HZ * speed, 100 * seed + k, duration=0.23, name=f"{seed}_{k}")
    began = time.process_time()
    row: dict[str, Any] = {"changed": path}
    try:
        found = estimate_drop(known, made.record, made.tail, method=Tracked())
    except RotordropError as error:
        return row | {"refused": str(error)}
    whole = found.to_dict()
    row |= {"processor_s": round(time.process_time() - began, 1), "document": whole}
    for bearing in found.bearings:
        told = (bearing.peak_force.known, bearing.peak_stress.known)
        for (name, key, unit), known_one in zip(TRUTHS, told, strict=True):
            row[f"{bearing.name}.{name}"] = {
                "estimate": known_one.value,
                "interval_90": known_one.interval_90,
                "truth": unit * made.truth[key][bearing.name],
            }
    row["truth"] = {
        one["path"]: value_of_path(machine.machine, one["path"])
        for one in whole["parameters"]
        if one["path"].split(".", 1)[1] in CHANGED
    }
    return row


def estimate_all(folder: Path, seeds: list[int], minutes: float) -> None:
    """Estimate what is not estimated yet, until the time is over."""
    until = time.monotonic() + 60.0 * minutes
    for seed in seeds:
        for k in range(len(DROPS)):
            file = folder / f"{seed}_{k}.json"
            if not file.exists() and time.monotonic() < until:
                file.write_text(json.dumps(estimated(seed, k)), encoding="utf-8")
                print(file, flush=True)


def compared(seed: int, k: int, first: dict[str, Any], row: dict[str, Any]) -> dict[str, Any]:
    """What is said of one pair, beside the truth."""
    pair: dict[str, Any] = {"seed": seed, "drop": k, "changed": row["changed"]}
    try:
        found = changes(*(drop_of(one["document"], f"drop {one['changed']}") for one in (first, row)))
    except (RotordropError, KeyError) as error:
        return pair | {"refused": str(error)}
    pair["named"] = [one.path for one in found.named]
    pair["parameters"] = {}
    for one in found.found:
        before, after = first["truth"][one.path], row["truth"][one.path]
        pair["parameters"][one.path] = {
            "true": after / before if one.factor else after - before,
            "change": one.change,
            "interval_90": one.interval_90 if one.determined else None,
            "smallest": one.smallest if math.isfinite(one.smallest) else None,
        }
    return pair


def wilson(hits: int, count: int) -> dict[str, Any]:
    """A share with its 95 % interval."""
    found = binomtest(hits, max(count, 1))
    low, high = found.proportion_ci(0.95, "wilson")
    return {"count": hits, "of": count, "share": found.statistic, "wilson_95": [float(low), float(high)]}


def summary_of(pairs: list[dict[str, Any]]) -> dict[str, Any]:
    """Power by parameter, false alarms, and how often the intervals hold."""
    judged = [pair for pair in pairs if "refused" not in pair]
    still = [pair for pair in judged if pair["changed"] is None]
    power, hides, smallest = {}, {}, {}
    for part in CHANGED:
        moved = [pair for pair in judged if (pair["changed"] or "").endswith(part)]
        hit = [pair["changed"] in pair["named"] for pair in moved]
        power[part] = wilson(sum(hit), len(moved))
        cells = [one for pair in judged for path, one in pair["parameters"].items() if path.endswith(part)]
        known = sorted(math.inf if one["smallest"] is None else one["smallest"] for one in cells)
        middle = [known[int(q * (len(known) - 1))] for q in (0.1, 0.5, 0.9)] if known else []
        smallest[part] = [one if math.isfinite(one) else None for one in middle]
        told = [one for one in cells if one["interval_90"]]
        held = sum(one["interval_90"][0] <= one["true"] <= one["interval_90"][1] for one in told)
        hides[part] = wilson(held, len(told))
    everywhere = [path for pair in judged for path in pair["named"] if path != pair["changed"]]
    return {
        "machines": len({pair["seed"] for pair in pairs}),
        "pairs": len(pairs),
        "refused": len(pairs) - len(judged),
        "found": power,
        "found_all": wilson(
            sum(one["count"] for one in power.values()), sum(one["of"] for one in power.values())
        ),
        "false_alarms_on_unchanged_pairs": wilson(sum(bool(pair["named"]) for pair in still), len(still)),
        "wrong_names_in_all_pairs": wilson(len(everywhere), len(judged)),
        "intervals_held": hides,
        "smallest_change_shown_10_50_90": smallest,
    }


def score(folder: Path, out: Path) -> None:
    """Compare the first drop of every machine with its others."""
    rows = {}
    for file in sorted(folder.glob("[0-9]*_[0-9].json")):
        seed, k = map(int, file.stem.split("_"))
        rows[seed, k] = json.loads(file.read_text(encoding="utf-8"))
    pairs = [
        {"before": before} | compared(seed, k, rows[seed, before], row)
        for (seed, k), row in rows.items()
        for before in range(8)
        if (seed, before) in rows and rows[seed, before]["changed"] is None
        if before < k or (row["changed"] is not None and before != k)
    ]
    summary = {
        "first drop with every other": summary_of([pair for pair in pairs if pair["before"] == 0]),
        "every unchanged drop with every other": summary_of(pairs),
    }
    out.write_text(json.dumps({"summary": summary, "pairs": pairs}) + "\n", encoding="utf-8")
    peaks = [
        {"seed": seed, "drop": k}
        | {key: row[key] for key in row if key.endswith(tuple(t[0] for t in TRUTHS))}
        for (seed, k), row in rows.items()
    ]
    out.with_name("drops.jsonl").write_text(
        "".join(json.dumps(one) + "\n" for one in peaks), encoding="utf-8"
    )
    print(json.dumps(summary, indent=1))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=("estimate", "score"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("seeds", type=int, nargs="*")
    parser.add_argument("--minutes", type=float, default=9.0)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "pairs.json")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    if asked.what == "estimate":
        estimate_all(asked.folder, asked.seeds, asked.minutes)
    else:
        score(asked.folder, asked.out)


if __name__ == "__main__":
    main()
