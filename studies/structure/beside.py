"""What each extension brings beside a base model that has come to rest: rises of the log likelihood.

Usage: python studies/structure/beside.py MACHINE CASE SEED [SEED ...]

Machines are those of ``extensions.py``. The base model is fitted from guesses, and every extension is weighed
over the first impacts, as an estimate does it. Writes ``results/beside.json``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from extensions import CASES, SPEED_HZ, recorded

from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import RotordropError
from rotordrop.evidence.evidence import read_evidence
from rotordrop.machine.examples import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.twin.problems import Drops
from rotordrop.twin.search import CALIBRATION_STAGE, Candidate, Search

FOUND = Path(__file__).parent / "results" / "beside.json"
CASES["cross-axis 2 %"] = ({"sensors": {"cross_axis": 0.02}}, {}, "cross-axis sensitivity")


def rises(kind: str, case: str, seed: int) -> dict[str, float] | str:
    """The rise with every extension, or why there is none."""
    drop, machine = recorded(kind, case, seed)[0], example_machine(kind)
    evidence = read_evidence(build_drop_model(machine), drop.record, drop.tail, name="drop")
    search = Search(drops=Drops(evidence=(evidence,), calibrate_only=False), progress=None)
    try:
        found = search.refine(Candidate(machine=machine, fit=search.fit_base(machine)))
    except RotordropError as error:
        return str(error)
    able = [one for one in EXTENSIONS if one.values(machine)]
    return {one.name: round(rise, 1) for rise, one in search.rises(found, CALIBRATION_STAGE).of_all(able)}


def main() -> None:
    """Measure the drops named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("machine", choices=tuple(SPEED_HZ))
    parser.add_argument("case", choices=tuple(CASES))
    parser.add_argument("seeds", type=int, nargs="+")
    chosen = parser.parse_args()
    for seed in chosen.seeds:
        there = json.loads(FOUND.read_text()) if FOUND.is_file() else {}
        name = f"{chosen.machine}, {chosen.case}, {seed}"
        there[name] = rises(chosen.machine, chosen.case, seed)
        FOUND.write_text(json.dumps(there, indent=1) + "\n")
        print(name, there[name], flush=True)


if __name__ == "__main__":
    main()
