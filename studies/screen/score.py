"""Intervals of the first screen of an estimate, against the truth of simulated drops.

    python studies/screen/score.py ESTIMATE.json TRUTH.json [ESTIMATE.json TRUTH.json ...]

Counts how often the 90 % intervals of the time of the peak, the number of impacts, the begin of the lasting
contact and the largest displacement hold, for estimates called consistent and for the others apart.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.record.impacts import after_flights, lasting_from

WINDOW = 0.2
"""End of what an estimate covers, from power-off [s]."""
SHOWN = ("time of the peak", "impacts", "in contact from", "largest displacement")


def held(found: dict[str, Any], truth: dict[str, Any], name: str) -> dict[str, tuple[bool, float] | None]:
    """Whether each interval of a bearing holds the truth, and its half width [ms, 1, ms, µm]."""
    bearing, gap = found["bearings"][name], float(truth["air_gap_m"][name])
    begun, ended, _ = np.array(truth["contact_intervals_0_0p25_s"][name]).T
    inside = begun < WINDOW
    begun = begun[inside][after_flights(begun[inside], np.minimum(ended[inside], WINDOW), gap)]
    last = lasting_from(begun, WINDOW)
    true = (truth["peak_force_time_s"][name], len(begun), last, truth["max_radial_displacement_m"][name])
    ranges = (
        bearing["peak_force_N"].get("time_interval_90_s"),
        bearing.get("impacts_interval_90"),
        bearing.get("contact_from_interval_90_s"),
        bearing.get("largest_displacement_m", {}).get("interval_90"),
    )
    rows: dict[str, tuple[bool, float] | None] = {}
    for shown, value, range_, unit in zip(SHOWN, true, ranges, (1e3, 1.0, 1e3, 1e6), strict=True):
        if range_ is None or value is None:
            rows[shown] = None if range_ is None and value is None else (False, float("nan"))
        else:
            rows[shown] = (range_[0] <= value <= range_[1], 0.5 * unit * (range_[1] - range_[0]))
    return rows


def main() -> None:
    """Print one table."""
    files = [Path(name) for name in sys.argv[1:]]
    sums: dict[tuple[str, str], list[tuple[bool, float]]] = defaultdict(list)
    for estimate, answer in zip(files[::2], files[1::2], strict=True):
        found, truth = (json.loads(one.read_text()) for one in (estimate, answer))
        if "bearings" not in found:
            continue
        verdict = "consistent" if found["consistent"] else "flagged"
        for name in found["bearings"]:
            for shown, row in held(found, truth, name).items():
                if row is not None:
                    sums[verdict, shown].append(row)
                    if not row[0]:
                        print("outside:", estimate, name, shown)
    print("| estimates | shown | bearings | held | half width, median |")
    print("| --- | --- | --- | --- | --- |")
    for (verdict, shown), rows in sorted(sums.items(), key=lambda one: (one[0][0], SHOWN.index(one[0][1]))):
        share = np.mean([row[0] for row in rows])
        width = np.nanmedian([row[1] for row in rows])
        print(f"| {verdict} | {shown} | {len(rows)} | {100 * share:.0f} % | {width:.3g} |")


if __name__ == "__main__":
    main()
