"""Twelve numbers against the full machine file, on hidden machines of the bench.

Usage: python studies/twelve_numbers/hidden.py [--check-only] ["60 kg:53" "5 kg:51" ...]
       python studies/twelve_numbers/hidden.py --summary

For every rotor and seed a machine is drawn around its description and dropped; the record is estimated with
the owner's machine file and with twelve numbers of it (balls and ring as they are: no designation has those
of the bench), and once more with the number that the estimate advises, as it truly is. Writes
results/ROTOR_SEED.json: errors of peak force and stress, whether the intervals hold, half widths, processor
time, the rotor found, what is advised, promised and achieved. What has its result is not done again. With
--check-only the rotor is found and the peak forces are those of the estimate without contact law, in a third
of the time; their intervals are its known accuracy, with the share of a beam for twelve numbers.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop import estimate_drop
from rotordrop.elements.rotor import Rotor
from rotordrop.errors import RotordropError
from rotordrop.evidence.evidence import read_evidence
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.record.record import read_record
from rotordrop.rotor.assembly import free_free_modes, rotor_fe
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import Unknown, all_unknowns
from rotordrop.track.input_state import corrections_by_record, input_state_estimate
from rotordrop.track.prior import fall_time
from rotordrop.twin.narrowing import DRAWING
from rotordrop.twin.problems import COARSE_BASIS, drop_problem, recorded_drop
from rotordrop.twin.rotor_search import with_found_rotor
from rotordrop.twin.search import ROTOR_SEEN
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop, write_synthetic
from rotordrop_bench.drops import SPEEDS
from rotordrop_bench.rotors import ROTORS

RESULTS = Path(__file__).parent / "results"
MEASURED = 0.01
"""Relative standard deviation of what is measured on advice [1]."""
MACHINES = (
    *("60 kg:53", "500 kg:55", "5 kg:51", "140 kg:54", "30 kg:52", "1.6 t:56", "6 t:57"),
    *("60 kg:63", "500 kg:65", "140 kg:64", "30 kg:62", "13 kg:61"),
)
"""Rotors and seeds of the study."""


def twelve_numbers_of(full: Machine) -> Machine:
    """The machine as somebody without a drawing of the rotor tells it."""
    rotor, bearings, sensors = full.rotor, full.touchdown_bearings, full.sensors
    at = rotor.node_positions
    assert full.balance_grade is not None
    known = SimpleMachine(
        mass=rotor.mass,
        centre=rotor.centre_of_gravity,
        length=at[-1],
        bearings=(at[bearings[0].node - 1], at[bearings[-1].node - 1]),
        sensors=(at[sensors[0].node - 1], at[sensors[-1].node - 1]),
        sensor_angle=float(sensors[0].angle),
        designation="7014 C",
        preload="300 N",
        gap=float(bearings[0].air_gap),
        speed=float(full.speed.nominal),
        grade=f"G {full.balance_grade.grade_mm_s}",
        support="stiff",
    )
    machine = simple_machine(known)
    return machine.changed(
        sensors=tuple(a.changed(name=b.name) for a, b in zip(machine.sensors, sensors, strict=True)),
        touchdown_bearings=tuple(
            a.changed(bearing=b.bearing, bore_radius=b.bore_radius, race=b.race)
            for a, b in zip(machine.touchdown_bearings, bearings, strict=True)
        ),
    )


def estimated(machine: Machine, folder: Path, truth: Mapping[str, Any], described: Rotor) -> dict[str, Any]:
    """Errors and intervals of one estimate."""
    began = time.process_time()
    try:
        record = read_record(folder / "d.h5", machine)
        found = estimate_drop(machine, record, read_record(folder / "d_tail.csv", machine))
    except RotordropError as error:
        return {"refused": str(error), "cpu_s": time.process_time() - began}
    row: dict[str, Any] = {"verdict": found.verdict.name, "cpu_s": round(time.process_time() - began, 1)}
    row["failed"] = [check.message for check in found.checks if not check.passed]
    for bearing in found.bearings:
        for name, known, true in (
            ("force", bearing.peak_force.known, truth["peak_force_N"][bearing.name]),
            ("stress", bearing.peak_stress.known, 1e6 * truth["max_stress_MPa"][bearing.name]),
        ):
            low, high = known.interval_90
            row[f"{bearing.name} {name}"] = {
                "error": round(known.value / true - 1.0, 4),
                "held": bool(low <= true <= high),
                "half_width": round(0.5 * (high - low) / true, 4),
                "half": 0.5 * (high - low),
            }
    row["advice"] = [
        {"measurement": one.measurement, "paths": one.paths, "half": one.half_widths, "left": one.narrowed}
        for one in found.advice
    ]
    if found.machine.rotor.is_beam:
        row["rotor"] = found_rotor(found.machine.rotor, described)
    return row


def told(
    known: Machine, true: Machine, advice: Sequence[Mapping[str, Any]]
) -> tuple[Mapping[str, Any], Machine] | None:
    """The first advice that a measurement of the true machine can follow, and the machine with it."""
    unknowns = {one.path: one for one in all_unknowns(build_drop_model(true))}
    for one in advice:
        if one["measurement"] == DRAWING:
            return one, drawn(known, true)
        if all(path in unknowns and not path.startswith("rotor.") for path in one["paths"]):
            return one, known.with_values({path: measured(unknowns[path]) for path in one["paths"]})
    return None


def drawn(known: Machine, true: Machine) -> Machine:
    """The machine of twelve numbers with the true rotor, everything at its nodes."""
    moved = {
        name: tuple(
            one.changed(node=other.node)
            for one, other in zip(getattr(known, name), getattr(true, name), strict=True)
        )
        for name in ("touchdown_bearings", "sensors", "ambs", "unbalances")
    }
    return known.changed(rotor=true.rotor, **moved)


def measured(unknown: Unknown) -> Known:
    """A number of the true machine as somebody measures it, to a percent."""
    mean = math.exp(unknown.mean) if unknown.logarithmic else unknown.mean
    value = float(unknown.published(unknown.mean) if unknown.published else mean)
    reach = NINETY * MEASURED * abs(value)
    return Known(
        value=value, status="estimated", interval_90=(value - reach, value + reach), source="measured"
    )


def compared(
    advice: Mapping[str, Any], before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, dict[str, float]]:
    """Half width left of the one there was, as promised and as it came out."""
    return {
        name: {
            "promised": round(advice["left"][name] / half, 3),
            "achieved": round(after[f"{name} force"]["half"] / before[f"{name} force"]["half"], 3),
        }
        for name, half in advice["half"].items()
    }


def checked(machine: Machine, folder: Path, truth: Mapping[str, Any], described: Rotor) -> dict[str, Any]:
    """The same of the estimate without contact law."""
    began = time.process_time()
    record, tail = read_record(folder / "d.h5", machine), read_record(folder / "d_tail.csv", machine)
    evidence = read_evidence(build_drop_model(machine), record, tail)
    until = ROTOR_SEEN * fall_time(machine)
    found = with_found_rotor(machine, [(evidence, recorded_drop(evidence, until))])
    problem = drop_problem(build_drop_model(found, COARSE_BASIS), evidence, 0.1)
    check = input_state_estimate(problem, corrections_by_record(problem))
    row: dict[str, Any] = {"cpu_s": round(time.process_time() - began, 1)}
    if found.rotor.is_beam:
        row["rotor"] = found_rotor(found.rotor, described)
    beam = NINETY * found.rotor.force_sigma
    for b, name in enumerate(problem.model.bearing_names):
        error = check.peak[b] / truth["peak_force_N"][name] - 1.0
        half = math.hypot(float(check.peak_error[b]), beam) * (1.0 + error)
        row[f"{name} force"] = {
            "error": round(float(error), 4),
            "held": bool(abs(error) <= half),
            "half_width": round(float(half), 4),
        }
    return row


def study(name: str, seed: int, *, check_only: bool) -> None:
    """Estimate one hidden machine in both ways, and with what was advised; what is there stays."""
    file = RESULTS / f"{'check_' if check_only else ''}{name.replace(' ', '_')}_{seed}.json"
    row: dict[str, Any] = {"rotor": name, "seed": seed, "speed_Hz": SPEEDS[name][0]}
    if file.exists():
        row = json.loads(file.read_text())
    if {"twelve numbers", "full"} <= row.keys() and (check_only or "advised number" in row):
        return
    full = ROTORS[name]()
    hidden = hidden_machine(full, seed, "none")
    drop = synthesize_drop(
        hidden, 2.0 * math.pi * SPEEDS[name][0], 9000 + seed, sensor_chain=SensorChain(), name="d"
    )
    known, described = twelve_numbers_of(full), full.rotor
    way = checked if check_only else estimated
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        write_synthetic(drop, folder, formats=("h5",), histories=False)
        for label, machine in (("twelve numbers", known), ("advised number", None), ("full", full)):
            if label in row or (check_only and machine is None):
                continue
            if machine is None:
                found = told(known, hidden.machine, row["twelve numbers"].get("advice", ()))
                row[label] = {"measurement": "nothing is advised"}
                if found is not None:
                    after = estimated(found[1], folder, drop.truth, described)
                    row[label] = {"measurement": found[0]["measurement"], **after}
                    if "refused" not in after:
                        row[label]["left"] = compared(found[0], row["twelve numbers"], after)
            else:
                row[label] = way(machine, folder, drop.truth, described)
            print(name, seed, label, json.dumps(row[label]), flush=True)
            RESULTS.mkdir(exist_ok=True)
            file.write_text(json.dumps(row, indent=1) + "\n")


def found_rotor(rotor: Rotor, true: Rotor) -> dict[str, Any]:
    """Errors of the first free bending frequencies and of the transverse inertia."""
    fe, described = rotor_fe(rotor), rotor_fe(true)
    bending = free_free_modes(fe, 5).frequency[2:] / free_free_modes(described, 5).frequency[2:] - 1.0
    return {
        "bending frequencies": np.round(bending, 3).tolist(),
        "transverse inertia": round(fe.diametral_inertia / described.diametral_inertia - 1.0, 3),
    }


def summary() -> None:
    """Errors and coverage over all results there are."""
    rows = [json.loads(file.read_text()) for file in sorted(RESULTS.glob("*.json"))]
    for label in ("twelve numbers", "advised number", "full"):
        for quantity in ("force", "stress"):
            found = [
                value
                for row in rows
                for key, value in row.get(label, {}).items()
                if key.endswith(quantity) and isinstance(value, dict)
            ]
            if found:
                errors = 100.0 * np.abs([one["error"] for one in found])
                held = 100.0 * np.mean([one["held"] for one in found])
                wide = 100.0 * np.median([one["half_width"] for one in found])
                print(
                    f"{label}, peak {quantity}: {len(found)} values, median error {np.median(errors):.1f} %, "
                    f"worst {np.max(errors):.0f} %, held {held:.0f} %, half width {wide:.1f} %"
                )


if __name__ == "__main__":
    if "--summary" in sys.argv:
        summary()
    else:
        for argument in [a for a in sys.argv[1:] if ":" in a] or MACHINES:
            study(argument.split(":")[0], int(argument.split(":")[1]), check_only="--check-only" in sys.argv)
