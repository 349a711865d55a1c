"""Clean records of three rotors for the study of the gate, by seed; kept in a folder once made.

Usage: python studies/gate/records.py FOLDER FIRST LAST

A seed draws rotor, hidden machine, speed, sampling rate, noise and converter. Seeds below 1020 were used
while the gate was built, those from 1020 on only to score it.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.rotors import bench_rotor

ROTORS = {"5 kg": (100.0, 450.0), "60 kg": (40.0, 400.0), "140 kg": (30.0, 180.0)}
"""Rotors by name with the range of their speeds [Hz]."""

DURATION = 0.65
RATES = (10e3, 20e3, 20e3, 25.6e3, 51.2e3)


def rotor_of(seed: int) -> Machine:
    """Machine of a seed, as its owner knows it."""
    return bench_rotor(list(ROTORS)[seed % len(ROTORS)])


def made(seed: int) -> tuple[Record, Record]:
    """Record and settled tail of a seed."""
    random = np.random.default_rng((seed, 11))
    name = list(ROTORS)[seed % len(ROTORS)]
    speed = 2.0 * math.pi * random.uniform(*ROTORS[name])
    chain = SensorChain(
        sampling_rate=float(random.choice(RATES)),
        noise=float(np.exp(random.uniform(np.log(0.15e-6), np.log(1.0e-6)))),
        bits=int(random.choice([14, 16, 16, 24])),
    )
    hidden = hidden_machine(rotor_of(seed), seed)
    drop = synthesize_drop(hidden, speed, seed, sensor_chain=chain, duration=DURATION, tolerance=1e-6)
    assert drop.tail is not None
    return drop.record, drop.tail


def kept(folder: Path, seed: int) -> tuple[Record, Record]:
    """Record and tail of a seed from the folder, made first where they are not there."""
    path = folder / f"{seed}.npz"
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        record, tail = made(seed)
        part = path.with_name(f"{seed}.part.npz")
        np.savez(
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
    sensors = rotor_of(seed).sensors
    time = held["time"]
    rate = float(np.round(1.0 / np.mean(np.diff(time)), 6))
    record = Record(
        time=time,
        signals=held["signals"],
        sensors=sensors,
        sampling_rate=rate,
        speed=np.interp(time, held["speed_time"], held["speed_readings"]),
        speed_time=held["speed_time"],
        speed_readings=held["speed_readings"],
    )
    when = held["tail_time"]
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
