"""Twelve numbers against the full machine file, on hidden machines of the bench.

Usage: python studies/twelve_numbers/hidden.py [--check-only] "60 kg:53" ["5 kg:51" ...]
       python studies/twelve_numbers/hidden.py --summary

For every rotor and seed a machine is drawn around its description and dropped; the record is estimated with
the owner's machine file and with twelve numbers of it (balls and ring as they are: no designation has those
of the bench). Writes results/ROTOR_SEED.json: errors of peak force and stress, whether the intervals hold,
half widths, processor time, the rotor found, and what the estimate advises. With --check-only the rotor is
found and the peak forces are those of the estimate without contact law, in a third of the time; their
intervals are its known accuracy, with the share of a beam for twelve numbers.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop import estimate_drop
from rotordrop.errors import RotordropError
from rotordrop.estimated import NINETY
from rotordrop.estimation.rotor_search import with_found_rotor
from rotordrop.estimation.tracked import COARSE_BASIS, ROTOR_SEEN, drop_problem, recorded_drop
from rotordrop.estimation.tracked_loads import BEAM_FORCE_SIGMA
from rotordrop.identification.evidence import read_evidence
from rotordrop.machine import Machine
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.measurement.record import read_record
from rotordrop.model.assembly import rotor_fe
from rotordrop.model.modes import free_free_modes
from rotordrop.model.parameters import build_drop_model
from rotordrop.model.rotor_form import is_beam
from rotordrop.synthesis import SensorChain, hidden_machine, synthesize_drop, write_synthetic
from rotordrop.synthesis.bench.drops import SPEEDS
from rotordrop.synthesis.bench.rotors import ROTORS
from rotordrop.tracking.input_state import input_state_estimate, lent_by_record
from rotordrop.tracking.problem import fall_time

RESULTS = Path(__file__).parent / "results"


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


def estimated(machine: Machine, folder: Path, truth: Mapping[str, Any]) -> dict[str, Any]:
    """Errors and intervals of one estimate."""
    began = time.process_time()
    try:
        record = read_record(folder / "d.h5", machine)
        found = estimate_drop(machine, record, read_record(folder / "d_tail.csv", machine))
    except RotordropError as error:
        return {"refused": str(error), "cpu_s": time.process_time() - began}
    row: dict[str, Any] = {"verdict": found.verdict.name, "cpu_s": round(time.process_time() - began, 1)}
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
            }
    row["advice"] = [one.sentence() for one in found.advice]
    row["rotor"] = found.machine.rotor
    return row


def checked(machine: Machine, folder: Path, truth: Mapping[str, Any]) -> dict[str, Any]:
    """The same of the estimate without contact law."""
    began = time.process_time()
    record, tail = read_record(folder / "d.h5", machine), read_record(folder / "d_tail.csv", machine)
    evidence = read_evidence(build_drop_model(machine), record, tail)
    until = ROTOR_SEEN * fall_time(machine)
    found = with_found_rotor(machine, [(evidence, recorded_drop(evidence, until))])
    problem = drop_problem(build_drop_model(found, COARSE_BASIS), evidence, 0.1)
    check = input_state_estimate(problem, lent_by_record(problem))
    row: dict[str, Any] = {"cpu_s": round(time.process_time() - began, 1), "rotor": found.rotor}
    beam = NINETY * BEAM_FORCE_SIGMA if is_beam(found.rotor) else 0.0
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
    """Estimate one hidden machine in both ways."""
    full = ROTORS[name]()
    hidden = hidden_machine(full, seed, "none")
    speed = 2.0 * math.pi * SPEEDS[name][0]
    drop = synthesize_drop(hidden, speed, 9000 + seed, sensor_chain=SensorChain(), name="d")
    folder = Path(tempfile.mkdtemp())
    write_synthetic(drop, folder, formats=("h5",), histories=False)
    row: dict[str, Any] = {"rotor": name, "seed": seed, "speed_Hz": SPEEDS[name][0]}
    for label, machine in (("twelve numbers", twelve_numbers_of(full)), ("full", full)):
        row[label] = (checked if check_only else estimated)(machine, folder, drop.truth)
        rotor = row[label].pop("rotor", None)
        if label == "twelve numbers" and rotor is not None:
            fe, true = rotor_fe(rotor), rotor_fe(full.rotor)
            bending = free_free_modes(fe, 5).frequency[2:] / free_free_modes(true, 5).frequency[2:] - 1.0
            row["bending frequencies"] = np.round(bending, 3).tolist()
            row["transverse inertia"] = round(fe.diametral_inertia / true.diametral_inertia - 1.0, 3)
        print(json.dumps(row), flush=True)
        RESULTS.mkdir(exist_ok=True)
        kind = "check_" if check_only else ""
        file = RESULTS / f"{kind}{name.replace(' ', '_')}_{seed}.json"
        file.write_text(json.dumps(row, indent=1) + "\n")


def summary() -> None:
    """Errors and coverage over all results there are."""
    rows = [json.loads(file.read_text()) for file in sorted(RESULTS.glob("*.json"))]
    for label in ("twelve numbers", "full"):
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
    for argument in sys.argv[1:]:
        if ":" in argument:
            study(argument.split(":")[0], int(argument.split(":")[1]), check_only="--check-only" in sys.argv)
