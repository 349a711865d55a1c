"""Unbalance phase against the mark of the shaft, recovered from simulated drops with tacho pulses.

Usage: python studies/unbalance/phase.py ROTOR FIRST LAST
       python studies/unbalance/phase.py count

Every seed is a hidden machine of a rotor (60 kg or 13 kg) dropped at a drawn speed. A keyphasor gives one
pulse per turn at the sampling rate of the record, its notch at a drawn angle; the passages are read from
those samples as from any recorder. One line of ``results/phase.jsonl`` each; what is there is not made again.
"""

from __future__ import annotations

import json
import math
import sys
import time as clock
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RotordropError
from rotordrop.estimation import estimate_drop
from rotordrop.machine import example_path, load_machine
from rotordrop.record.tacho import passages
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.event import drop_conditions
from rotordrop_bench.motion import true_motion

RESULTS = Path(__file__).parent / "results" / "phase.jsonl"
ROTORS = {"60 kg": ("lp400", (60.0, 250.0)), "13 kg": ("small", (150.0, 500.0))}
"""Bundled examples with the range of their speeds [Hz]."""
NOTCH = 0.25
"""Width of the notch that gives the pulse [rad]."""


def one(rotor: str, seed: int) -> dict[str, Any]:
    """Estimate one drop and set the phases beside the true ones."""
    example, speeds = ROTORS[rotor]
    machine = load_machine(example_path(example))
    random = np.random.default_rng((seed, 23))
    speed = 2.0 * math.pi * random.uniform(*speeds)
    notch = float(random.uniform(0.0, 2.0 * math.pi))
    hidden = hidden_machine(machine, seed)
    drop = synthesize_drop(hidden, speed, seed, duration=0.3)
    conditions = drop_conditions(hidden, speed, seed)
    record = drop.record
    dense = np.linspace(record.time[0], record.time[-1], 4 * len(record.time) - 3)
    angle = true_motion(hidden, drop.result, conditions, dense - conditions.jitter)[1][::4]
    inside = np.mod(angle - notch, 2.0 * math.pi) < NOTCH
    # a probe that looks into a notch sees its edge over a fifth of its width
    edge = np.clip(np.mod(angle - notch, 2.0 * math.pi) / (0.2 * NOTCH), 0.0, 1.0)
    pulses = 5.0 * inside * edge + random.normal(0.0, 0.05, len(angle))
    read = passages(record.time, pulses)
    begun = clock.process_time()
    line: dict[str, Any] = {"rotor": rotor, "seed": seed, "speed_Hz": round(speed / (2.0 * math.pi), 2)}
    try:
        estimate = estimate_drop(machine, replace(record, marks=read.marks), drop.tail)
    except RotordropError as error:
        return line | {"refused": str(error)[:200]}
    planes = []
    # half the rise of the edge later than the begin of the notch
    late = notch + 0.1 * NOTCH
    for found, true in zip(estimate.unbalance, hidden.machine.unbalances, strict=True):
        phase = found.phase
        wrong = (
            None if phase is None else math.remainder(phase.value - (float(true.phase) + late), 2.0 * math.pi)
        )
        half = None if phase is None or phase.interval_90 is None else 0.5 * float(np.ptp(phase.interval_90))
        assert found.amount.interval_90 is not None
        planes.append(
            {
                "node": found.node,
                "amount_g_mm": round(1e6 * found.amount.value, 2),
                "amount_90": [round(1e6 * end, 2) for end in found.amount.interval_90],
                "true_amount": round(1e6 * float(true.amount), 2),
                "error_deg": None if wrong is None else round(math.degrees(wrong), 2),
                "half_width_deg": None if half is None else round(math.degrees(half), 2),
            }
        )
    seconds = round(clock.process_time() - begun, 1)
    return line | {"consistent": estimate.consistent, "planes": planes, "seconds": seconds}


def lines() -> list[dict[str, Any]]:
    """Results so far."""
    return [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.is_file() else []


def count() -> None:
    """Print errors and how often the intervals hold."""
    for rotor in ROTORS:
        mine = [line for line in lines() if line["rotor"] == rotor]
        planes = [plane for line in mine for plane in line.get("planes", [])]
        told = [plane for plane in planes if plane["error_deg"] is not None]
        held = sum(abs(plane["error_deg"]) <= plane["half_width_deg"] for plane in told)
        sizes = sum(p["amount_90"][0] <= p["true_amount"] <= p["amount_90"][1] for p in planes)
        error = np.abs([plane["error_deg"] for plane in told]) if told else np.zeros(1)
        half = [plane["half_width_deg"] for plane in told] or [0.0]
        print(
            f"{rotor}: {len(mine)} drops, {len(planes)} planes, phase told {len(told)}, held {held}; error "
            f"median {np.median(error):.1f}, largest {np.max(error):.1f} deg; half width median "
            f"{np.median(half):.1f} deg; amount held {sizes}"
        )


def main() -> None:
    """Run what is missing, or count."""
    if sys.argv[1] == "count":
        count()
        return
    RESULTS.parent.mkdir(exist_ok=True)
    there = {(line["rotor"], line["seed"]) for line in lines()}
    with RESULTS.open("a") as out:
        for seed in range(int(sys.argv[2]), int(sys.argv[3])):
            if (sys.argv[1], seed) not in there:
                out.write(json.dumps(one(sys.argv[1], seed)) + "\n")
                out.flush()


if __name__ == "__main__":
    main()
