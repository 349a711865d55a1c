"""Are drops that are called worse with 93 % worse in 93 of 100 cases?

    python studies/repeat/ranking.py --out studies/repeat/ranking.json

Estimates with their intervals and truths are those of `studies/tracked/scaled` (four drops of each calibrated
machine), of `studies/tracked/noise` (the same with the likeliest unknown impulses, as estimates are made now)
and of `studies/changed` (eight drops of each machine from guesses, likeliest impulses too). Within a machine
every drop is ranked with every other. `diagram.py` draws what comes out.
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.severity.ranking import DropSeverity, worse_probability, worst_probability

STUDIES = Path(__file__).parent.parent
EDGES = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
Row = tuple[DropSeverity, float]


def of_calibrated(folder: Path) -> Iterator[tuple[str, str, Row]]:
    """Machine, quantity, and estimate with truth."""
    for file in sorted(folder.glob("*_none.json")):
        drops = [one for one in json.loads(file.read_text())["drops"] if "bearings" in one]  # else refused
        for k, drop in enumerate(drops):
            for bearing, entry in drop["bearings"].items():
                for field, known in entry.items():
                    if isinstance(known, dict) and known.get("interval_90"):
                        yield f"{folder.name} {file.stem}", f"{bearing} {field}", row(f"{k}", known)


def of_changed(file: Path) -> Iterator[tuple[str, str, Row]]:
    """The same of the drops that are compared in `studies/changed`."""
    for line in file.read_text().splitlines():
        one = json.loads(line)
        for field, known in one.items():
            if isinstance(known, dict) and known.get("interval_90"):
                yield f"guessed {one['seed']}", field, row(str(one["drop"]), known)


def row(name: str, known: dict[str, Any]) -> Row:
    """An estimate as the ranking takes it, and the truth."""
    low, high = known["interval_90"]
    return DropSeverity.from_interval(name, known["estimate"], (low, high)), float(known["truth"])


def diagram(told: list[float], came: list[bool]) -> list[dict[str, float]]:
    """How often it came true, by what was said."""
    said, true = np.array(told), np.array(came)
    found = []
    for low, high in itertools.pairwise(EDGES):
        inside = (said >= low) & ((said < high) | (high == 1.0))
        if inside.any():
            found.append(
                {
                    "from": low,
                    "to": high,
                    "pairs": int(inside.sum()),
                    "said": float(said[inside].mean()),
                    "true": float(true[inside].mean()),
                }
            )
    return found


def told_of(drops: list[DropSeverity]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values and standard errors."""
    return np.array([one.value for one in drops]), np.array([one.standard_error for one in drops])


def scored(rows: Iterator[tuple[str, str, Row]]) -> dict[str, Any]:
    """Reliability of all pairs, and of the drop called worst."""
    groups: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for machine, quantity, one in rows:
        groups[machine, quantity].append(one)
    said, came, worst_said, worst_came = [], [], [], []
    for drops in groups.values():
        for pair in itertools.combinations(drops, 2):
            (one, true), (other, true_other) = sorted(pair, key=lambda drop: -drop[0].value)
            said.append(float(worse_probability(*told_of([one, other]))[0]))
            came.append(true > true_other)
        share = worst_probability(*told_of([one for one, _ in drops]))
        first = int(np.argmax(share))
        worst_said.append(float(share[first]))
        worst_came.append(first == int(np.argmax([true for _, true in drops])))
    return {
        "machines": len({machine for machine, _ in groups}),
        "drops": len({(machine, one.name) for (machine, _), drops in groups.items() for one, _ in drops}),
        "worse_than_another": {
            "pairs": len(said),
            "said": float(np.mean(said)),
            "true": float(np.mean(came)),
            "diagram": diagram(said, came),
        },
        "worst_of_all": {
            "sets": len(worst_said),
            "said": float(np.mean(worst_said)),
            "true": float(np.mean(worst_came)),
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    before = list(of_calibrated(STUDIES / "tracked" / "scaled"))
    now = list(of_calibrated(STUDIES / "tracked" / "noise"))
    now += of_changed(STUDIES / "changed" / "drops.jsonl")
    content = {
        "usual impulses": scored(iter(before)),
        "likeliest impulses": scored(iter(now)),
        "all": scored(iter(before + now)),
    }
    asked.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(content, indent=1))


if __name__ == "__main__":
    main()
