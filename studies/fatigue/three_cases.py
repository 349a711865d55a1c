"""Segments, ISO/TS 16281 and rainflow on three cases, and why they differ.

python studies/fatigue/three_cases.py --out studies/fatigue/three_cases.json
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

import numpy as np

from rotordrop import DropCase, example_machine, simulate_drop
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.severity.fatigue import fatigue_shares
from rotordrop.simulate.case import LevitatedStart

HZ = 2.0 * math.pi


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    machine = example_machine("paper")
    numbers = numbers_of(machine.touchdown_bearings[1])
    ratings = numbers.ratings()
    assert ratings is not None
    time = np.linspace(0.0, 1.0, 20_001)
    full = np.full(len(time), 60.0 * HZ)
    whirl = 2500.0 * np.column_stack([np.cos(-92.0 * HZ * time), np.sin(-92.0 * HZ * time)])
    settled = np.tile([0.0, -410.0], (len(time), 1))
    cases = {
        "backward whirl of 2.5 kN at 92 Hz, race at 60 Hz, 1 s": (
            time,
            numbers.element_loads_under(whirl),
            full,
        ),
        "settled, 410 N, race at 60 Hz, 1 s": (time, numbers.element_loads_under(settled), full),
    }
    case = DropCase(
        speed=60.0 * HZ, start=LevitatedStart(rotor_angle=1.0), reduction="quick", output_step=5e-5
    )
    drop = simulate_drop(machine, case)
    cases["drop at 60 Hz, 0.2 s, as simulated"] = (
        drop.time,
        drop.ball_loads(machine, "DE"),
        drop.race_speed[:, 1],
    )
    names = ("segments", "iso_16281", "rainflow")
    found = {
        name: dict(zip(names, fatigue_shares(ratings, *one), strict=True)) for name, one in cases.items()
    }
    asked.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
