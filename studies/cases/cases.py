"""Machines unlike the paper's, end to end through the command line: synthesize, estimate, score.

Usage: python studies/cases/cases.py [CASE ...]

Bearings with play, a lost sensor that the machine file states, rings heavier than their size tells, two and
three planes on a long rotor, a small fast rotor, masses from 5 kg to 6 t; one drop each, from guesses.
``results/cases.json`` holds the scores.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.scaled_machines import scaled_machine

from rotordrop.known import Known
from rotordrop.machine import Machine, example_path
from rotordrop.machine.saving import save_machine

HERE = Path(__file__).parent
RESULTS = HERE / "results" / "cases.json"
LONG_ROTOR = HERE.parents[1] / "tests" / "machines" / "long_rotor.toml"
DEEP_GROOVE = (
    '{ rows = 1, clearance = "C3", bore_diameter = "80 mm", ball_diameter = "13.494 mm", ball_count = 14, '
    'pitch_diameter = "102.5 mm" }'
)
GUESSES = {
    "air_gap": (0.8, 1.3),
    "support.stiffness": (0.5, 2.0),
    "support.mass": (0.5, 2.0),
    "support.damping": (0.3, 3.0),
    "contact.stiffness": (0.6, 1.6),
    "friction.dynamic": (0.5, 2.0),
}
"""Ranges of what the owner of a plain machine knows, over the value."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One drop: machine recorded, speed [Hz], what the estimator is told, with tail or without."""

    machine: str
    speed: float
    seed: int = 5
    drop: int = 1
    told: str | None = None
    tail: bool = True


CASES = {
    "60 kg, deep grooves C3": Case(machine="60 play", speed=120.0),
    "130 kg, three planes": Case(machine="long", speed=130.0),
    "130 kg, two planes": Case(machine="long", speed=130.0, told="long two"),
    "130 kg, three planes, a sensor lost": Case(machine="long", speed=130.0, told="long lost"),
    "130 kg, two planes, a sensor lost": Case(machine="long", speed=130.0, told="long two lost"),
    "130 kg, three planes, heavy rings": Case(machine="long heavy", speed=130.0, told="long unsaid"),
    "130 kg, two planes, heavy rings": Case(machine="long heavy", speed=130.0, told="long two unsaid"),
    "13 kg, 450 Hz": Case(machine="small", speed=450.0),
    "13 kg, 450 Hz, no tail": Case(machine="small", speed=450.0, tail=False),
    "13 kg, 550 Hz": Case(machine="small", speed=550.0, seed=6, drop=2),
    "5 kg": Case(machine="5", speed=300.0),
    "130 kg": Case(machine="130", speed=150.0),
    "6 t": Case(machine="6000", speed=40.0),
    "6 t, no tail": Case(machine="6000", speed=40.0, tail=False),
}


def machine_file(name: str, folder: Path) -> Path:
    """File of a machine by its short name."""
    kind, *changes = name.split()
    if kind == "small":
        return Path(str(example_path(kind)))
    place = folder / f"{name.replace(' ', '_')}.toml"
    if kind == "long":
        text = LONG_ROTOR.read_text()
        head, *sensors = text.split("[[sensors]]")
        kept = [one for one in sensors if "two" not in changes or "S_MID" not in one]
        text = "[[sensors]]".join([head, *kept])
        if "lost" in changes:
            text = text.replace('name = "S_NDE_B"\n', 'name = "S_NDE_B"\nlost = true\n')
        if "heavy" in changes:  # 2.3 times what the size of the bearing tells: 0.443 kg and 8.93e-4 kg m²
            text = re.sub(r'(?m)^mass = "0.5 kg"', 'mass = "1.018 kg"', text)
            text = re.sub(r"(?m)^inertia = .*", 'inertia = "2.054e-3 kg m^2"', text)
        if "unsaid" in changes:
            text = re.sub(r"\[touchdown_bearings\.race\]\n(?:\w.*\n)*", "", text)
        place.write_text(text)
    else:
        save_machine(
            guessed(scaled_machine(float(kind), bearing=DEEP_GROOVE if "play" in changes else "")), place
        )
    return place


def guessed(machine: Machine) -> Machine:
    """A plain machine of which its owner knows ranges only."""
    values: dict[str, float | Known] = {}
    for bearing in machine.touchdown_bearings:
        ranges = dict(GUESSES)
        if float(bearing.bearing.preload) > 0.0:
            ranges["preload"] = (0.7, 1.4)
        for path, (low, high) in ranges.items():
            part: Any = bearing.bearing if path == "preload" else bearing
            for step in path.split("."):
                part = getattr(part, step)
            value = float(part)
            values[f"{bearing.name}.{path}"] = Known(
                value=value, status="guess", range=(low * value, high * value)
            )
    return machine.with_values(values)


def rotordrop(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a verb."""
    return command("rotordrop", *arguments)


def bench(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a verb of the bench."""
    return command("rotordrop_bench", *arguments)


def command(module: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command line."""
    line = [sys.executable, "-m", module, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, check=False)


def study(case: Case) -> dict[str, Any]:
    """Exit code, verdict and score of one case."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        machine = machine_file(case.machine, folder)
        made = folder / "made"
        made_with = ("--speed", f"{case.speed} Hz", "--seed", case.seed, "--first-drop", case.drop)
        done = bench("synthesize", machine, *made_with, "--output", made)
        if done.returncode:
            return {"exit": done.returncode, "said": done.stderr.strip()}
        record = next(file for file in made.glob("*.csv") if "tail" not in file.name)
        told = machine if case.told is None else machine_file(case.told, folder)
        tail = ("--tail", made / f"{record.stem}_tail.csv") if case.tail else ()
        written = folder / "estimate.json"
        done = rotordrop("estimate", told, record, *tail, "--json", written)
        if not written.exists():
            return {"exit": done.returncode, "said": done.stderr.strip()}
        scored = bench("score", written, made / "truth" / f"{record.stem}.json", "--json", "-")
        return {"exit": done.returncode, "score": json.loads(scored.stdout)}


def main() -> None:
    """Run the cases named on the command line, all by default, and keep their scores."""
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for label in sys.argv[1:] or CASES:
        results[label] = study(CASES[label])
        RESULTS.parent.mkdir(parents=True, exist_ok=True)
        RESULTS.write_text(json.dumps(results, indent=1) + "\n")
        print(label, results[label]["exit"], flush=True)


if __name__ == "__main__":
    main()
