"""One drop of an unknown machine, from guesses: with its settled tail and without.

Usage: python studies/tracked/lone_drops.py KIND SEED [SEED ...]

The first thing a newcomer does, and the hardest case for the fit: nothing but the guesses of the machine
file, one recording, perhaps no tail. Every machine is recorded at two speeds; every recording is estimated by
itself, twice. Seeds 4001 to 4006 set the width of the interval of a lone drop's air gap; those from 4101 on are
scored and used nowhere else.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from blind_calibration import drop_scores, drops_of

from rotordrop.errors import RotordropError
from rotordrop.estimation.tracked import estimate_tracked

RESULTS = Path(__file__).parent / "results" / "lone_drops"


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
                drop = estimate_tracked(known, [recording.record], [tail], names=[name])[0]
            except RotordropError as error:  # a refused drop is a result too
                entry["error"] = f"{type(error).__name__}: {error}"
            else:
                entry |= drop_scores(drop, recording)
                entry["air_gaps"] = {
                    bearing: {
                        "estimate": values["air_gap_m"].value,
                        "interval_90": values["air_gap_m"].interval_90,
                        "truth": true_gaps[bearing],
                    }
                    for bearing, values in drop.values.items()
                }
            entry["seconds"] = time.perf_counter() - started
            found.append(entry)
            print(
                json.dumps({key: entry.get(key) for key in ("name", "tail", "nis", "consistent", "error")}),
                flush=True,
            )
    return found


def main() -> None:
    """Run the machines named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("lp400", "small"))
    parser.add_argument("seeds", type=int, nargs="+")
    chosen = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    for seed in chosen.seeds:
        drops = study(chosen.kind, seed)
        target = RESULTS / f"{chosen.kind}_{seed}.json"
        target.write_text(json.dumps({"kind": chosen.kind, "seed": seed, "drops": drops}, indent=1) + "\n")


if __name__ == "__main__":
    main()
