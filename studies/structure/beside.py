"""What each extension brings beside a usual model that fits: rises of the log marginal likelihood.

Usage: python studies/structure/beside.py MACHINE CASE SEED [SEED ...]

Machines are those of ``extensions.py``. The usual model is fitted by the coarse basis, then every extension
gets one pass, and those that rise a few more, as ``extension_when_consistent`` does. Writes
``beside.json``, in which a rise of null after more passes means that the first pass brought nothing.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

from extensions import CASES, SPEED_HZ, recorded

from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop
from rotordrop.machine.examples import example_machine
from rotordrop.twin import search as model_search
from rotordrop.twin.search import RELINEARISED_PASSES, Candidate, Fits, gain_of

FOUND = Path(__file__).parent / "beside.json"
CASES["cross-axis 2 %"] = ({"sensors": {"cross_axis": 0.02}}, {}, "cross-axis sensitivity")


class _Measured(Exception):
    """Ends an estimate where the extensions have been measured."""


def rises(kind: str, case: str, seed: int) -> dict[str, list[float | None]] | str:
    """One pass and more passes of every extension, or why there are none."""
    drop = recorded(kind, case, seed)[0]
    found: dict[str, list[float | None]] = {}

    def measure(base: Candidate, search: Fits) -> Candidate:
        plain = search.likelihood(base.fit, base.machine)
        again = replace(base, fit=search.relinearise(base.fit, base.machine, RELINEARISED_PASSES))
        for one in EXTENSIONS:
            machine = one.added_to(base.machine)
            rise, more = plain - search.likelihood(base.fit, machine), None
            if rise > 0.0:
                fit = search.relinearise(base.fit, machine, RELINEARISED_PASSES)
                more = round(gain_of(Candidate(machine=machine, fit=fit), again), 1)
            found[one.name] = [round(rise, 1), more]
        raise _Measured

    plain_way, model_search.extension_when_consistent = model_search.extension_when_consistent, measure
    try:
        estimate_drop(example_machine(kind), drop.record, drop.tail, name="drop")
    except _Measured:
        return found
    except RotordropError as error:
        return str(error)
    finally:
        model_search.extension_when_consistent = plain_way
    return "the usual model does not fit"


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
