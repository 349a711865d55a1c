"""Processor time of following a drop while it is recorded, over the time that the record lasts.

    python benchmarks/stream.py [--output benchmarks/stream.json] [--rounds 3]

Drops of three rotors of the bench at 10 kHz, made here, whose machines are known as they are. Processor time
of one thread, after a round that fills the caches; what is done once, before the first readings, is left out.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import json
import math
import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop import Known, Machine, Record, track_stream
from rotordrop.evidence.evidence import Evidence
from rotordrop.machine.machine import value_of_path
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.rotors import bench_rotor

ROTORS = {"5 kg": 320.0, "60 kg": 210.0, "6 t": 35.0}
"""Rotors and their speeds [Hz]."""
RATE, BLOCK, SEED, LASTS = 10e3, 50, 77, 0.3
HELD = ("air_gap", "support.stiffness", "support.mass", "contact.stiffness")


def recorded(rotor: str, speed: float) -> tuple[Machine, Record, np.ndarray]:
    """The machine as it is, its levitated rotor, and the readings behind that."""
    hidden = hidden_machine(bench_rotor(rotor), SEED)
    chain = SensorChain(sampling_rate=RATE)
    made = synthesize_drop(
        hidden, 2.0 * math.pi * speed, SEED, sensor_chain=chain, duration=LASTS + 0.01, tail=False
    )
    machine, record = hidden.machine, made.record
    paths = [f"{bearing.name}.{path}" for bearing in machine.touchdown_bearings for path in HELD]
    known = {path: Known(value=value_of_path(machine, path), status="estimated") for path in paths}
    off = int(np.searchsorted(record.time, Evidence(record=record, machine=machine).power_off.value)) + 1
    levitated = replace(record, time=record.time[:off], signals=record.signals[:off], speed=None)
    return machine.with_values(known), levitated, record.signals[off:]


def ratio(machine: Machine, levitated: Record, readings: np.ndarray) -> float:
    """Processor time over time of the record, from the first samples handed out to the last but one."""
    blocks = (readings[i : i + BLOCK] for i in range(0, len(readings), BLOCK))
    marks, samples = [], []
    for step in track_stream(machine, levitated, blocks):
        marks.append(time.process_time())
        samples.append(len(step.time))
    return (marks[-2] - marks[0]) * RATE / sum(samples[1:-1])


def main() -> None:
    """Time the rotors in several rounds that take turns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    drops = {rotor: recorded(rotor, speed) for rotor, speed in ROTORS.items()}
    rounds = [{rotor: ratio(*drop) for rotor, drop in drops.items()} for _ in range(options.rounds + 1)][1:]
    results: dict[str, Any] = {
        rotor: {
            "ratio": statistics.median(one[rotor] for one in rounds),
            "rounds": [one[rotor] for one in rounds],
        }
        for rotor in ROTORS
    }
    results["load_at_end"] = os.getloadavg()[0]
    for rotor in ROTORS:
        print(f"{rotor}: {results[rotor]['ratio']:.2f} s of processor time per second of record")
    if options.output:
        options.output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
