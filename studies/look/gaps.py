"""What records show of their air gaps by themselves, against the truth: clean drops of the study of the gate.

Usage: python studies/look/gaps.py FOLDER FIRST LAST

FOLDER keeps the records of `studies/gate/records.py`, made where they are not there. Prints a line for every
rotor: root mean square and median of the error, median half width of the 90 % interval, share that holds.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.events import planes_at_bearings
from rotordrop.evidence.paths import motion_of
from rotordrop_bench import hidden_machine

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "gate"))
from records import kept, name_of, rotor_of

Row = tuple[str, float, float]
"""Rotor, error of the gap over it and half width of its interval over it [1]."""


def rows_of(folder: Path, seed: int) -> list[Row]:
    """One row for every plane beside a bearing."""
    record, machine = kept(folder, seed)[0], rotor_of(seed)
    try:
        paths = motion_of(record, gaps=(None,) * len(record.planes), angles_known=True).paths
    except RecordError as error:
        print(seed, error)
        return []
    true = {
        bearing.name: float(bearing.air_gap)
        for bearing in hidden_machine(machine, seed).machine.touchdown_bearings
    }
    found = []
    for number in sorted(planes_at_bearings(machine, record)):
        wall, gap = paths[number].wall, true[record.planes[number].bearing]
        low, high = wall.interval_90
        found.append((name_of(seed), wall.gap / gap - 1.0, (high - low) / 2.0 / gap))
    return found


def told(name: str, rows: list[Row]) -> str:
    """One line of the table."""
    error, half = (np.array([row[k] for row in rows]) for k in (1, 2))
    return (
        f"| {name} | {len(rows)} | {100 * np.sqrt(np.mean(error**2)):.1f} "
        f"| {100 * np.median(np.abs(error)):.1f} "
        f"| {100 * np.median(half):.1f} | {100 * np.mean(np.abs(error) <= half):.0f} |"
    )


if __name__ == "__main__":
    rows = [
        row for seed in range(int(sys.argv[2]), int(sys.argv[3])) for row in rows_of(Path(sys.argv[1]), seed)
    ]
    print("| | planes | error, rms [%] | median [%] | half width [%] | held [%] |\n|---|---|---|---|---|---|")
    print(told("all", rows))
    for name in dict.fromkeys(row[0] for row in rows):
        print(told(name, [row for row in rows if row[0] == name]))
