"""Twelve numbers on hidden machines whose rotors, supports and preloads are drawn here.

Usage: python studies/twelve_numbers/hidden.py [NAME ...]
       python studies/twelve_numbers/hidden.py --table

Sixteen machines of four sizes. Each has a stepped shaft with discs, two bearings of one designation in a
preload class, two unlike supports, and values of contact, friction and drag from ranges that stand here and
not in the package. It is dropped with the sensor chain of the bench. Its owner says twelve numbers, rounded,
with the errors that such numbers have, and no preload; then comes what ``rotordrop estimate`` does. Writes
results/NAME.json; what has its result is not done again.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop import estimate_drop
from rotordrop.elements.catalog.lookup import find_bearing
from rotordrop.errors import RotordropError
from rotordrop.machine import Machine, loads_machine
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.record.record import read_record
from rotordrop.rotor.assembly import free_free_modes, rotor_fe
from rotordrop.severity.numbers import LOADS
from rotordrop_bench import SensorChain, SyntheticDrop, hidden_machine, synthesize_drop, write_synthetic
from rotordrop_bench.make import happened
from rotordrop_bench.truth import truth_of

RESULTS = Path(__file__).parent / "results"
SIZES: dict[str, dict[str, Any]] = {
    # bearings of two makers' lists and two that are inferred; speeds and gaps as such machines have
    "5 kg": {"mass": 5.0, "bearings": ("B71906-C", "HCB71906-C", "7006 C"), "speed": (300.0, 700.0)},
    "60 kg": {"mass": 60.0, "bearings": ("XCB71914-E", "B7014-C", "71914 C"), "speed": (80.0, 300.0)},
    "500 kg": {"mass": 500.0, "bearings": ("HCB7026-C", "B71926-C", "71926 C"), "speed": (50.0, 150.0)},
    "6 t": {"mass": 6000.0, "bearings": ("B71960-C", "B71964-C", "71956 C"), "speed": (20.0, 55.0)},
}
"""Mass [kg], designations and range of speeds [Hz] of each size."""
CLASSES = ("light", "medium", "heavy")
NAMES = tuple(f"{size} {number}" for size in SIZES for number in range(1, 5))
FIRST_SEED = 24_500
"""Seed of the first machine."""
QUANTITIES = [load.field for load in LOADS]


def stepped_rotor(random: np.random.Generator, mass: float, bore: float) -> str:
    """A stepped shaft with discs as text of a machine file.

    The body has the diameter that gives the rotor its mass. Nodes: NDE bearing 5, its sensors 8, DE bearing
    25, its sensors 22.
    """
    scale = (mass / 60.0) ** (1.0 / 3.0)
    long = scale * random.uniform(0.85, 1.2)
    overhang, body, wheel = (random.uniform(*one) for one in ((0.06, 0.12), (0.42, 0.6), (0.06, 0.2)))
    lengths = long * np.array([overhang, 0.05, 0.05, body, 0.05, 0.05, wheel])
    seat = bore * random.uniform(0.82, 0.95)
    discs = mass * random.uniform(0.0, 0.12, 3)  # at the ends and in the middle
    steel = 7800.0
    others = steel * math.pi / 4.0 * seat**2 * (lengths.sum() - lengths[3])
    width = math.sqrt((mass - others - discs.sum()) / (steel * math.pi / 4.0 * lengths[3]))
    thin, thinner = (seat * random.uniform(0.7, 1.0) for _ in range(2))
    diameters = [thin, seat, seat, width, seat, seat, thinner]
    text = ['[rotor]\nmaterial = "steel"', f"modal_damping = {random.uniform(0.003, 0.01):.4g}"]
    text.append(
        '[rotor.materials.steel]\nyoungs_modulus = "208 GPa"\npoisson_ratio = 0.29\ndensity = "7800 kg/m^3"'
    )
    for length, diameter, parts in zip(lengths, diameters, (4, 3, 2, 10, 2, 3, 4), strict=True):
        text.append(
            f'[[rotor.sections]]\nlength = "{length:.9g} m"\nelements = {parts}\n'
            f'outer_diameter = "{diameter:.9g} m"'
        )
    for node, disc in zip((1, 15, 29), discs, strict=True):
        radius = 0.5 * width * random.uniform(0.8, 1.4)
        text.append(
            f'[[rotor.discs]]\nnode = {node}\nmass = "{disc:.9g} kg"\n'
            f'polar_inertia = "{0.5 * disc * radius**2:.9g} kg m^2"\n'
            f'diametral_inertia = "{0.3 * disc * radius**2:.9g} kg m^2"'
        )
    return "\n".join(text)


def true_machine(name: str, random: np.random.Generator) -> tuple[Machine, dict[str, Any]]:
    """A machine as it is, and what of it the table shows."""
    size, number = name.rsplit(" ", 1)
    chosen = SIZES[size]
    mass = chosen["mass"] * random.uniform(0.85, 1.2)
    designation = str(random.choice(chosen["bearings"]))
    listed = find_bearing(designation)
    preload_class = CLASSES[(int(number) - 1 + list(SIZES).index(size)) % 3]
    scale = (mass / 60.0) ** (1.0 / 3.0)
    gap = 0.27e-3 * scale**0.5 * random.uniform(0.85, 1.25)
    stiffness = (
        1.2e8
        * scale
        * math.exp(random.uniform(-0.7, 0.7))
        * np.array([1.0, math.exp(random.uniform(0.4, 1.6))])
    )
    if random.uniform() < 0.5:
        stiffness = stiffness[::-1]
    friction, contact = random.uniform(0.06, 0.18), 0.9e9 * scale**0.9 * math.exp(random.uniform(-0.5, 0.5))
    rotor = stepped_rotor(random, mass, listed.bore)
    speed, drag = random.uniform(*chosen["speed"]), random.uniform(6.0, 14.0)
    text = [
        f'name = "hidden machine {name}"',
        f'speed = {{ nominal = "{1.1 * speed:.6g} Hz", aero_time_constant = "{drag:.4g} s" }}',
        f'balance_grade = {{ grade = "G 1", at_speed = "{1.1 * speed:.6g} Hz" }}',
        rotor,
    ]
    for end, node, k in (("NDE", 5, stiffness[0]), ("DE", 25, stiffness[1])):
        preload = listed.preload[preload_class] * random.uniform(0.85, 1.15)
        text.append(
            f'[[touchdown_bearings]]\nname = "{end}"\nnode = {node}\n'
            f'air_gap = "{gap * random.uniform(0.95, 1.05):.6g} m"\n'
            f'bore_radius = "{0.5 * listed.bore:.6g} m"\n'
            f'[touchdown_bearings.bearing]\ndesignation = "{designation}"\npreload = "{preload:.6g} N"\n'
            "[touchdown_bearings.contact]\n"
            f'stiffness = "{contact * random.uniform(0.9, 1.1):.6g} N/m^1.111"\n'
            f"[touchdown_bearings.friction]\ndynamic = {friction:.4g}\nstatic = {1.3 * friction:.4g}\n"
            f'[touchdown_bearings.support]\nmass = "{mass * random.uniform(0.25, 0.9):.6g} kg"\n'
            f'stiffness = "{k:.6g} N/m"\ndamping_ratio = {random.uniform(0.015, 0.05):.4g}'
        )
    text += [f'[[ambs]]\nname = "{end}"\nnode = {node}' for end, node in (("NDE", 9), ("DE", 21))]
    text += [
        f'[[sensors]]\nname = "{end}_{letter}"\nnode = {node}\nangle = "{angle} deg"'
        for end, node in (("NDE", 8), ("DE", 22))
        for letter, angle in (("A", 135), ("B", 45))
    ]
    machine = loads_machine("\n".join(text))
    drawn = {
        f"unbalance.{i}.amount": float(one.amount) * random.uniform(0.3, 1.6)
        for i, one in enumerate(machine.unbalances)
    } | {f"unbalance.{i}.phase": random.uniform(-math.pi, math.pi) for i in range(len(machine.unbalances))}
    shown = {
        "mass_kg": round(mass, 3),
        "designation": designation,
        "preload_class": preload_class,
        "preload_N": round(listed.preload[preload_class], 1),
        "support_N_per_m": [float(f"{k:.3g}") for k in stiffness],
        "speed_Hz": round(speed, 1),
        "bending_Hz": np.round(free_free_modes(rotor_fe(machine.rotor), 3).frequency[2:], 1).tolist(),
    }
    return machine.with_values(drawn), shown


def told_numbers(true: Machine, shown: dict[str, Any], random: np.random.Generator) -> SimpleMachine:
    """What the owner says of it: rounded, gap within 8 %, supports by a word, one value or two."""
    rotor, bearings = true.rotor, true.touchdown_bearings
    at = rotor.node_positions
    digits = 0 if rotor.mass > 100.0 else 1
    first, second = (float(b.support.stiffness) for b in bearings)
    ways = (
        "stiff",
        f"{math.sqrt(first * second) * math.exp(random.uniform(-0.4, 0.4)):.2g} N/m",
        ", ".join(f"{k * math.exp(random.uniform(-0.5, 0.5)):.2g} N/m" for k in (first, second)),
    )
    return SimpleMachine(
        mass=f"{rotor.mass:.{digits}f} kg",
        centre=f"{1e3 * rotor.centre_of_gravity:.0f} mm",
        length=f"{1e3 * at[-1]:.0f} mm",
        bearings=tuple(f"{1e3 * at[node - 1]:.0f} mm" for node in (5, 25)),  # type: ignore[arg-type]
        sensors=tuple(f"{1e3 * at[node - 1]:.0f} mm" for node in (8, 22)),  # type: ignore[arg-type]
        sensor_angle="135 deg",
        designation=shown["designation"],
        gap=f"{1e3 * float(bearings[0].air_gap) * random.uniform(0.92, 1.08):.2f} mm",
        speed=f"{60.0 / (2.0 * math.pi) * float(true.speed.nominal):.0f} rpm",
        grade="G 1",
        support=ways[int(random.integers(3))],
    )


def hidden_drop(name: str) -> tuple[SyntheticDrop, SimpleMachine, dict[str, Any]]:
    """The first machine of this name whose rotor touches both bearings within 0.1 s."""
    for attempt in range(20):
        seed = FIRST_SEED + 20 * NAMES.index(name) + attempt
        random = np.random.default_rng(seed)
        true, shown = true_machine(name, random)
        said = told_numbers(true, shown, random)
        if shown["bending_Hz"][0] < 1.3 * shown["speed_Hz"]:
            continue  # no such rotor is run
        hidden = hidden_machine(true, seed, "none", drawn=False)
        drop = synthesize_drop(
            hidden, 2.0 * math.pi * shown["speed_Hz"], seed, sensor_chain=SensorChain(), name="d"
        )
        if happened(drop):
            return drop, said, {"seed": seed, **shown, "support_said": said.support}
    raise RuntimeError(f"no machine {name} drops onto both bearings")


def study(name: str) -> None:
    """Drop one hidden machine, estimate it from twelve numbers, and keep what came out beside the truth."""
    file = RESULTS / f"{name.replace(' ', '_')}.json"
    if file.exists():
        return
    drop, said, row = hidden_drop(name)
    truth = truth_of(drop.truth)
    began = time.process_time()
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        write_synthetic(drop, folder, formats=("h5",), histories=False)
        try:
            machine = simple_machine(said)
            record = read_record(folder / "d.h5", machine)
            found = estimate_drop(machine, record, read_record(folder / "d_tail.csv", machine))
        except RotordropError as error:
            row["refused"] = str(error)
        else:
            row |= {
                "verdict": found.verdict.name,
                "failed": [check.message for check in found.checks if not check.passed],
                "advice": [one.measurement for one in found.advice],
                "values": {b.name: compared(b, truth) for b in found.bearings},
            }
    row["cpu_s"] = round(time.process_time() - began, 1)
    RESULTS.mkdir(exist_ok=True)
    file.write_text(json.dumps(row, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(json.dumps(row, ensure_ascii=False), flush=True)


def compared(bearing: Any, truth: Any) -> dict[str, Any]:
    """Value, 90 % interval and truth of each load."""
    known = {
        **bearing.values,
        "peak_force_N": bearing.peak_force.known,
        "peak_stress_Pa": bearing.peak_stress.known,
    }
    true = truth.of_bearing(bearing.name)
    return {
        field: {"value": known[field].value, "interval_90": known[field].interval_90, "true": true[field]}
        for field in QUANTITIES
        if field in known and known[field].interval_90 is not None
    }


def loads_of(rows: list[dict[str, Any]], field: str) -> tuple[list[bool], list[float], list[float]]:
    """Whether the interval holds, half width and error over the truth, of every bearing."""
    held, wide, error = [], [], []
    for row in rows:
        for numbers in row.get("values", {}).values():
            if field in numbers:
                (low, high), true = numbers[field]["interval_90"], numbers[field]["true"]
                held.append(low <= true <= high)
                wide.append(0.5 * (high - low) / true)
                error.append(numbers[field]["value"] / true - 1.0)
    return held, wide, error


def table() -> str:
    """Coverage and median half width by load and size, as a table of the documentation."""
    rows = [
        json.loads(file.read_text(encoding="utf-8")) | {"name": file.stem} for file in RESULTS.glob("*.json")
    ]
    lines = ["| | all: held, half width | " + " | ".join(SIZES) + " |", "|---|---|" + "---|" * len(SIZES)]
    for load in LOADS:
        cells = []
        for size in ("", *SIZES):
            of_size = [row for row in rows if row["name"].startswith(size.replace(" ", "_"))]
            held, wide, _ = loads_of(of_size, load.field)
            cells.append(
                f"{sum(held)} of {len(held)}, {100.0 * float(np.median(wide)):.0f} %" if held else "none"
            )
        lines.append(f"| {load.label} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if "--table" in sys.argv:
        print(table())
    else:
        for chosen_name in sys.argv[1:] or NAMES:
            study(chosen_name)
