"""What the model leaves out, so that 90 % intervals hold what they say: chosen on drops, checked on others.

Usage: python studies/coverage/allowances.py BENCH ESTIMATES

BENCH is a folder of ``rotordrop-bench make``, ESTIMATES what ``studies/dropbench/estimates.py`` made of it.
An interval is made of what the record leaves open and of an allowance, as independent errors; for every
number the script gives half width and coverage with the allowance of the estimates and with the one chosen,
and the standard deviations left out that would have held 85, 90 and 95 % of the truths. The ensemble to
choose on: the first 39 drops of the bench that were estimated (`seen`). To check on: the rest of the bench.
Writes ``results.md``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.elements.table import parameter
from rotordrop.known import NINETY
from rotordrop.twin.allowances import (
    MODEL_FORCE_SIGMA,
    MODEL_MEAN_FORCE_SIGMA,
    MODEL_MEAN_STRESS_SIGMA,
    MODEL_STRESS_SIGMA,
)

NUMBERS = {
    "peak_force_N": ("peak_force_N", 1.0),
    "peak_stress_Pa": ("max_stress_MPa", 1e6),
    "mean_force_0p15_0p2_N": ("mean_force_0p15_0p2_N", 1.0),
    "mean_stress_Pa": ("mean_stress_MPa", 1e6),
    "air_gap_m": ("air_gap_m", 1.0),
}
"""Field of the estimate: name of the truth and its unit."""
EARLIER = {
    "peak_force_N": 0.012,
    "peak_stress_Pa": 0.004,
    "mean_force_0p15_0p2_N": 0.004,
    "mean_stress_Pa": 0.015,
    "air_gap_m": 0.008,
}
"""Standard deviations left out of the estimates that are read here."""
CHOSEN = {
    "peak_force_N": MODEL_FORCE_SIGMA,
    "peak_stress_Pa": MODEL_STRESS_SIGMA,
    "mean_force_0p15_0p2_N": MODEL_MEAN_FORCE_SIGMA,
    "mean_stress_Pa": MODEL_MEAN_STRESS_SIGMA,
    "air_gap_m": parameter("air_gap").model_error,
}
Row = tuple[str, float, float, float]
"""Number, error, half width by the record alone and by the allowance alone; relative."""


def seen(name: str) -> bool:
    """Whether a drop had been estimated when the allowances were chosen."""
    return int(name[-1]) in (1, 2, 6, 7) or (int(name[-1]) in (3, 8) and name <= "drop_043")


def of_bench(bench: Path, estimates: Path, *, chosen_on: bool) -> Iterator[Row]:
    """Numbers of one part of the bench."""
    for file in sorted(estimates.glob("drop_*.json")):
        if seen(file.stem) is not chosen_on:
            continue
        found = json.loads(file.read_text())
        truth = json.loads((bench / "truth" / file.name).read_text())
        for name, values in found["bearings"].items():
            for field, (key, unit) in NUMBERS.items():
                if field in values:
                    yield scored(field, values[field], truth[key][name] * unit)


def scored(field: str, value: dict[str, Any], truth: float) -> Row:
    """Relative error and half widths of one number."""
    size = abs(value["value"])
    whole = (value["interval_90"][1] - value["value"]) / size
    allowance = (value.get("allowance_90") or 0.0) / size
    return field, abs(value["value"] - truth) / size, np.sqrt(max(whole**2 - allowance**2, 0.0)), allowance


def line(ensemble: str, field: str, rows: list[Row]) -> str:
    """One line of the table."""
    error, record, allowance = np.array([row[1:] for row in rows]).T
    cells = [f"{100.0 * x:.2f}" for x in np.percentile(error, (50, 90, 100))]
    for factor in (1.0, CHOSEN[field] / EARLIER[field]):
        half = np.hypot(record, factor * allowance)
        cells += [f"{100.0 * np.median(half):.2f}", f"{np.mean(error <= half):.2f}"]
    for share in (0.85, 0.9, 0.95):
        left = np.sort(np.sqrt(np.maximum(error**2 - record**2, 0.0)))
        cells.append(f"{100.0 * left[int(np.ceil(share * len(left))) - 1] / NINETY:.2f}")
    return f"| {ensemble} | {field} | {len(rows)} | " + " | ".join(cells) + " |"


def main() -> None:
    """Write the table of both ensembles."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bench", type=Path)
    parser.add_argument("estimates", type=Path)
    folders = parser.parse_args()
    ensembles = {
        "chosen on: bench": list(of_bench(folders.bench, folders.estimates, chosen_on=True)),
        "checked on: bench": list(of_bench(folders.bench, folders.estimates, chosen_on=False)),
    }
    lines = [
        "| ensemble | number | values | error median, % | 90 %, % | worst, % | half width then, % | held "
        "| half width now, % | held | left out for 85 %, % | for 90 % | for 95 % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for ensemble, rows in ensembles.items():
        for field in NUMBERS:
            mine = [row for row in rows if row[0] == field]
            if mine:
                lines.append(line(ensemble, field, mine))
    (Path(__file__).parent / "results.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
