"""Lift checks of worn, dirty and hardly sampled bearings: is the gap within its interval?

Usage: python studies/clearance/lifts.py FIRST LAST

The generator shares nothing with the program: a hand pushes the shaft to a few places at the wall or rolls it
along, trembles there, sometimes falls short of the wall; the hole has grown by wear, has a groove where the
rotor ran and lumps of dirt on its wall; sensors stand at 45 and 135 degrees with offset, noise, slow drift
and a converter of 14 to 16 bits. Two planes that move on their own, one check before and one after the wear.
The gap sought is the radius of the hole without groove and dirt. A third check is read with the machine file:
contact, races and supports give way to a push of half to twice the weight, which differs by a fifth from
place to place, and gains are off as the machine file says they may be. Seeds below 100 served to mend the
program, those from 100 on to score it, once. Results are in ``results/lifts.json``.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.errors import RecordError
from rotordrop.evidence.clearance import Clearance, measure_clearance, wear_between
from rotordrop.evidence.sensing import sensor_sigmas
from rotordrop.machine import Machine, example_machine
from rotordrop.record.record import Record
from rotordrop.rotor.statics import bearing_load_shares

RESULTS = Path(__file__).parent / "results" / "lifts.json"
KINDS = ("few places", "few places, dirt", "few places, wear", "rolled, dirt, wear", "few places, dirt, wear")


def hole(angle: Array, radius: float, groove: float, lumps: list[tuple[float, float, float]]) -> Array:
    """Radius of the wall [m] by direction: groove at the bottom, lumps of (direction, height, width)."""
    bottom = np.angle(np.exp(1j * (angle + 0.5 * math.pi)))
    wall = radius + groove * np.exp(-0.5 * (bottom / math.radians(9.0)) ** 2)
    for direction, height, width in lumps:
        wall = wall - height * np.exp(-0.5 * (np.angle(np.exp(1j * (angle - direction))) / width) ** 2)
    return np.asarray(wall)


def ease(count: int) -> Array:
    """From 0 to 1 as a hand moves."""
    s = np.linspace(0.0, 1.0, count)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def pushes(random: np.random.Generator, rate: float, wall: Any) -> Array:
    """Six to ten places at the wall, unevenly spread, with straight ways between them through the hole."""
    number = int(random.integers(6, 11))
    places = 2.0 * math.pi * (np.arange(number) + random.uniform(-0.3, 0.3, number)) / number
    places += random.uniform(0.0, 2.0 * math.pi)
    at, pieces = np.zeros(2), []
    for place in random.permutation(places):
        stay = int(random.uniform(0.25, 0.7) * rate)
        tremble = np.cumsum(random.normal(0.0, math.radians(0.3) / math.sqrt(rate), stay))
        angle = place + tremble
        short = random.uniform(5e-6, 40e-6) if random.random() < 0.1 else 0.0
        there = (wall(angle) - short)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        way = ease(int(random.uniform(0.15, 0.4) * rate))[:, None]
        pieces += [at + (there[0] - at) * way, there]
        at = there[-1]
    return np.vstack(pieces)


def rolled(random: np.random.Generator, rate: float, wall: Any) -> Array:
    """Once to twice round the wall, leaving it here and there."""
    count = int(random.uniform(8.0, 16.0) * rate)
    angle = random.uniform(0.0, 6.0) + random.uniform(1.1, 2.0) * 2.0 * math.pi * ease(count)
    away = np.zeros(count)
    for _ in range(int(random.integers(1, 5))):
        middle, width = random.uniform(0, count), random.uniform(0.1, 0.4) * rate
        away += random.uniform(10e-6, 120e-6) * np.exp(-0.5 * ((np.arange(count) - middle) / width) ** 2)
    return np.asarray((wall(angle) - away)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


def check(random: np.random.Generator, kind: str, radii: tuple[float, float], worn: float) -> Record:
    """One lift check as a record of the example's four sensors."""
    rate = float(random.choice([500.0, 1000.0, 2000.0, 5000.0]))
    paths = []
    for radius in radii:
        groove = random.uniform(0.2, 1.0) * worn if "wear" in kind else 0.0
        lumps = [
            (random.uniform(0, 6.3), random.uniform(3e-6, 20e-6), math.radians(random.uniform(1.5, 5.0)))
            for _ in range(int(random.integers(1, 3)) if "dirt" in kind else 0)
        ]

        def wall(angle: Array, radius: float = radius, groove: float = groove, lumps: Any = lumps) -> Array:
            return hole(angle, radius, groove, lumps)

        paths.append((rolled if "rolled" in kind else pushes)(random, rate, wall))
    count = min(map(len, paths)) if "rolled" in kind else max(map(len, paths))
    sensors = example_machine("lp400").sensors
    nodes = list(dict.fromkeys(sensor.node for sensor in sensors))
    step = 1200e-6 / 2 ** int(random.integers(14, 17))
    noise = float(np.exp(random.uniform(np.log(0.2e-6), np.log(2e-6))))
    columns = []
    for sensor in sensors:
        path = paths[nodes.index(sensor.node)]
        path = np.vstack([path, np.repeat(path[-1:], max(count - len(path), 0), axis=0)])[:count]
        along = path @ np.array([math.cos(float(sensor.angle)), math.sin(float(sensor.angle))])
        drift = random.normal(0.0, 0.2e-6) * np.linspace(0.0, 1.0, count)
        read = along + random.uniform(-100e-6, 100e-6) + drift + random.normal(0.0, noise, count)
        columns.append(step * np.round(read / step))
    time = np.arange(count) / rate
    return Record(time=time, signals=np.column_stack(columns), sensors=sensors, sampling_rate=rate)


def giving_way(random: np.random.Generator, machine: Machine, gap: float) -> Record:
    """A lift check of a whole shaft whose bearings give way to the push, by sensors whose gains are off."""
    rate, position = 1000.0, np.asarray(machine.rotor.node_positions)
    push = float(np.exp(random.uniform(math.log(0.5), math.log(2.0))))
    gone = []
    for bearing, weight in zip(machine.touchdown_bearings, bearing_load_shares(machine), strict=True):
        load, contact = push * float(weight), bearing.contact
        depth = (load / float(contact.stiffness)) ** (1.0 / float(contact.exponent))
        races = numbers_of(bearing).deflection(load)[0]
        gone.append(depth + races + load / float(bearing.support.stiffness))
    at = position[[bearing.node - 1 for bearing in machine.touchdown_bearings]]
    line = np.polynomial.Polynomial.fit(at, gap + np.array(gone), 1)
    more = np.mean(gone) * random.normal(0.0, 0.2, 16)
    path = pushes(random, rate, lambda angle: gap + more[np.floor(angle / 0.4).astype(int) % 16])
    columns = []
    for sensor in machine.sensors:
        away = path * line(position[sensor.node - 1]) / gap
        along = away @ np.array([math.cos(float(sensor.angle)), math.sin(float(sensor.angle))])
        gain = random.normal(1.0, sensor_sigmas("gain", [sensor], gap)[0])
        columns.append(along * gain + random.uniform(-100e-6, 100e-6) + random.normal(0.0, 0.5e-6, len(path)))
    return Record(
        time=np.arange(len(path)) / rate,
        signals=np.column_stack(columns),
        sensors=machine.sensors,
        sampling_rate=rate,
    )


def by_machine(seed: int) -> list[dict[str, Any]]:
    """Gaps of a check that is read with the machine file."""
    random, machine = np.random.default_rng((seed, 32)), example_machine("lp400")
    gap = float(random.uniform(150e-6, 400e-6))
    try:
        found = measure_clearance(giving_way(random, machine, gap), machine=machine)
    except RecordError:
        return []
    return [_set(one, gap) for one in found]


def one(seed: int) -> dict[str, Any]:
    """Before and after wear, both planes."""
    random = np.random.default_rng((seed, 31))
    kind = KINDS[seed % len(KINDS)]
    radii = (random.uniform(120e-6, 450e-6), random.uniform(120e-6, 450e-6))
    worn = random.uniform(3e-6, 25e-6) if "wear" in kind else 0.0
    line: dict[str, Any] = {"seed": seed, "kind": kind, "machine": by_machine(seed)}
    try:
        before = measure_clearance(check(random, kind.replace("wear", ""), radii, 0.0))
        after = measure_clearance(check(random, kind, (radii[0] + worn, radii[1] + worn), worn))
    except RecordError as error:
        return line | {"refused": str(error)[:200]}
    pairs = [*zip(before, radii, strict=True), *zip(after, (r + worn for r in radii), strict=True)]
    line["gaps"] = [_set(found, true) for found, true in pairs]
    line["wear"] = [
        {
            "error_um": round(1e6 * (wear.growth - worn), 3),
            "held": bool(wear.interval_90[0] <= worn <= wear.interval_90[1]),
        }
        for wear in wear_between(before, after)
    ]
    return line


def _set(found: Clearance, true: float) -> dict[str, Any]:
    low, high = found.interval_90
    return {
        "true_um": round(1e6 * true, 2),
        "error_um": round(1e6 * (found.gap - true), 3),
        "half_um": round(0.5e6 * (high - low), 3),
        "held": bool(low <= true <= high),
    }


def main() -> None:
    """Run all, write and count."""
    lines = [one(seed) for seed in range(int(sys.argv[1]), int(sys.argv[2]))]
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(lines, indent=1) + "\n")
    gaps = [gap for line in lines for gap in line["machine"]]
    error, half = ([abs(gap[key]) for gap in gaps] for key in ("error_um", "half_um"))
    print(
        f"with the machine file: gaps held {sum(gap['held'] for gap in gaps)} of {len(gaps)}, error median "
        f"{np.median(error):.2f}, half width median {np.median(half):.2f} um"
    )
    for kind in KINDS:
        mine = [line for line in lines if line["kind"] == kind]
        gaps = [gap for line in mine for gap in line.get("gaps", [])]
        wear = [w for line in mine for w in line.get("wear", [])]
        error = np.abs([gap["error_um"] for gap in gaps] or [0.0])
        half = np.median([gap["half_um"] for gap in gaps] or [0.0])
        print(
            f"{kind:24} {len(mine)} checks, refused {sum('refused' in line for line in mine)}; gaps held "
            f"{sum(gap['held'] for gap in gaps)} of {len(gaps)}, error median {np.median(error):.2f}, "
            f"largest {np.max(error):.2f} um, half width median {half:.2f} um; "
            f"wear held {sum(w['held'] for w in wear)} of {len(wear)}"
        )


if __name__ == "__main__":
    main()
