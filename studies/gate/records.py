"""Clean records of the study of the gate, by seed; kept in a folder once made.

Usage: python studies/gate/records.py FOLDER FIRST LAST

A seed draws rotor, hidden machine, speed, sampling rate, noise, runout, converter and length. The rotors take
turns: those of DropBench (5 kg to 6 t, with the bundled ones), and two of them with a third sensor plane.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop_bench import SensorChain, SyntheticDrop, hidden_machine, synthesize_drop
from rotordrop_bench.drops import SPEEDS
from rotordrop_bench.rotors import ROTORS, bench_rotor

THREE_PLANES = {"13 kg, three planes": "13 kg", "500 kg, three planes": "500 kg"}
NAMES = (*ROTORS, *THREE_PLANES)
"""Rotors by name, in turn by seed."""

SHORT, LONG = 0.3, 0.65
"""What is recorded after power-off [s]: that of DropBench; every fifth record and those spoiled: longer."""

RATES = (10e3, 20e3, 20e3, 25.6e3, 51.2e3, 100e3)


@lru_cache(maxsize=len(NAMES))
def rotor_named(name: str) -> Machine:
    """A rotor as its owner knows it, with a third plane of sensors in its middle where the name says so."""
    machine = bench_rotor(THREE_PLANES.get(name, name))
    if name not in THREE_PLANES:
        return machine
    middle = 1 + len(machine.rotor.node_positions) // 2
    first = machine.sensors[0].node
    more = tuple(
        sensor.model_copy(update={"name": f"MID{sensor.name[-1]}", "node": middle})
        for sensor in machine.sensors
        if sensor.node == first
    )
    return machine.model_copy(update={"sensors": (*machine.sensors, *more)})


def name_of(seed: int) -> str:
    """Rotor of a seed."""
    return NAMES[seed % len(NAMES)]


def rotor_of(seed: int) -> Machine:
    """Machine of a seed, as its owner knows it."""
    return rotor_named(name_of(seed))


def made(seed: int, *, long: bool) -> SyntheticDrop:
    """Record, settled tail and truth of a seed."""
    random = np.random.default_rng((seed, 26))
    machine, name = rotor_of(seed), name_of(seed)
    speeds = SPEEDS[THREE_PLANES.get(name, name)]
    speed = 2.0 * math.pi * random.uniform(min(speeds), max(speeds))
    chain = SensorChain(
        sampling_rate=float(random.choice(RATES)),
        noise=float(np.exp(random.uniform(np.log(0.15e-6), np.log(1.0e-6)))),
        runout_1x=float(random.uniform(0.0, 1.0e-6)),
        runout_2x=float(random.uniform(0.0, 0.5e-6)),
        bits=int(random.choice([14, 16, 16, 24])),
    )
    return synthesize_drop(
        hidden_machine(machine, seed),
        speed,
        seed,
        sensor_chain=chain,
        duration=LONG if long else SHORT,
        before=float(random.choice([0.15, 0.25])),
        tolerance=1e-6,
    )


def kept(folder: Path, seed: int, *, long: bool = False) -> tuple[Record, Record]:
    """Record and tail of a seed from the folder, made first where they are not there."""
    long = long or seed % 5 == 0
    path = folder / f"{seed}{'_long' if long else ''}.npz"
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        drop = made(seed, long=long)
        record, tail = drop.record, drop.tail
        assert tail is not None
        part = path.with_name(f"{path.stem}.part.npz")
        np.savez_compressed(
            part,
            time=record.time,
            signals=record.signals,
            speed_time=np.asarray(record.speed_time),
            speed_readings=np.asarray(record.speed_readings),
            tail_time=tail.time,
            tail_signals=tail.signals,
        )
        part.rename(path)
    held = np.load(path)
    time, when = held["time"], held["tail_time"]
    record = Record(
        time=time,
        signals=held["signals"],
        sensors=rotor_of(seed).sensors,
        sampling_rate=float(np.round(1.0 / np.mean(np.diff(time)), 6)),
        speed=np.interp(time, held["speed_time"], held["speed_readings"]),
        speed_time=held["speed_time"],
        speed_readings=held["speed_readings"],
    )
    tail = replace(
        record,
        time=when,
        signals=held["tail_signals"],
        sampling_rate=float(np.round(1.0 / np.mean(np.diff(when)), 6)),
        speed=None,
        speed_time=None,
        speed_readings=None,
    )
    return record, tail


if __name__ == "__main__":
    for number in range(int(sys.argv[2]), int(sys.argv[3])):
        kept(Path(sys.argv[1]), number)
