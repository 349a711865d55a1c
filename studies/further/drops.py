"""Hidden machines with further physics, by equations of the bench, and how their estimates hold.

Usage: python studies/further/drops.py FOLDER [--limit SECONDS] [--drops N] [--score]

Six machines of 5 kg to 6 t: fast balls, springs that hold the preload, a stop, a ribbon, a load, thrust.
Each drop is estimated with the structure known (a), with a guess at it (b) and without it (c). What has its
estimate in FOLDER is not made again; after --limit seconds no further one is begun. --drops N takes the first
N of the ten drops of each machine. --score writes ``results/table.md`` over the estimates there are.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.machine import Machine, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop_bench.rotors import bench_rotor

sys.path.insert(0, str(Path(__file__).parent))
from hidden_drops import cell, estimate, scored, truth_of, write_drop

FIRST_SEED = 410_000
DROPS = 10
WAYS = {"a": "structure known", "b": "guess", "c": "without it"}
SHOWN = ("peak_force_N", "peak_stress_Pa")
LOST = 0.2
"""Error of a peak from which it is lost [1], that of the bench."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A machine: rotor of the bench, speed at power-off [Hz], what is hidden and what two owners write."""

    rotor: str
    speed: float
    hidden: str
    """In the measure of the machine: W static load [N], K stiffness of the support [N/m], g air gap [m]."""
    known: str
    guessed: str
    """Lines for every touchdown bearing, or behind the file where they begin with [[."""


FACE = 'face = {{ gap = "1 um", inner_radius = "{inner} m", outer_radius = "{outer} m", side = "+z" }}'
STOP = 'mount = [{{ kind = "stop", gap = {{ guess = "{MIDDLE} m", range = ["{less} m", "{END} m"] }} }}]'

CASES = {
    "fast balls": Case(
        rotor="5 kg",
        speed=500.0,
        hidden="balls.inertia = true",
        known="bearing: ball_inertia = true",
        guessed='bearing: ball_inertia = true, ball_material = "steel"',
    ),
    "spring preload": Case(
        rotor="30 kg",
        speed=150.0,
        hidden="balls.held_preload = true",
        known='bearing: preload_kind = "spring", spring_rate = "{rate} N/m", '
        'ring_mass = {{ guess = "{ring} kg", range = ["{lighter} kg", "{heavier} kg"] }}, '
        "fit_friction = {{ guess = 0.02, range = [0.0, 0.05] }}",
        guessed='bearing: preload_kind = "spring"',
    ),
    "stop": Case(
        rotor="140 kg",
        speed=120.0,
        hidden='support = {{ stop_gap = "{stop} m", stop_stiffness = "{stiff} N/m", stop_damping = 0.2 }}',
        known=STOP.replace("MIDDLE", "stop").replace("END", "more"),
        guessed=STOP.replace("MIDDLE", "more").replace("END", "most"),
    ),
    "ribbon": Case(
        rotor="500 kg",
        speed=80.0,
        hidden='support = {{ ribbon_stiffness = "{spring} N/m", ribbon_slip = "{slip} N" }}',
        known='mount = [{{ kind = "ribbon", friction_stiffness = {{ guess = "{spring} N/m" }}, '
        'slip_force = {{ guess = "{slip} N" }} }}]',
        guessed='mount = [{{ kind = "ribbon" }}]',
    ),
    "load": Case(
        rotor="1.6 t",
        speed=60.0,
        hidden='side_force = {{ node = 11, force = "{push} N", direction = "-60 deg", '
        'growth = 0.05, growth_time = "0.3 s" }}',
        known='[[loads]]\nnode = 11\ndirection = "-60 deg"\nforce = {{ guess = "0 N" }}',
        guessed='[[loads]]\nnode = 11\ndirection = "-90 deg"\nforce = {{ guess = "0 N" }}',
    ),
    "thrust": Case(
        rotor="6 t",
        speed=35.0,
        hidden='bearing.DE.face = {{ thrust = "{thrust} N", gap = "1 um", arm = "{arm} m" }}',
        known=FACE + '\n[[loads]]\nnode = 11\ndirection = "axial"\nforce = "{thrust} N"',
        guessed=FACE + '\n[[loads]]\nnode = 11\ndirection = "axial"\nforce = "{half} N"',
    ),
}


def measures(machine: Machine) -> dict[str, str]:
    """Sizes of what is hidden, in the measure of a machine; chosen, not measured."""
    bearing = machine.touchdown_bearings[1]
    weight = float(max(bearing_load_shares(machine)))
    soft = float(machine.touchdown_bearings[0].support.stiffness)
    stop, radius = 4.0 * weight / soft, float(bearing.bore_radius)
    ring = 0.04 * float(bearing.race.mass)  # light: those of the bench follow without any mass
    found = {
        "stop": stop,
        "less": 0.6 * stop,
        "more": 1.5 * stop,
        "most": 2.5 * stop,
        "stiff": 6.0 * soft,
        "spring": 0.8 * soft,
        "slip": 1.5 * weight,
        "rate": 0.003 * soft,
        "ring": ring,
        "lighter": 0.25 * ring,
        "heavier": 4.0 * ring,
        "push": 0.3 * 2.0 * weight,
        "thrust": 0.8 * weight,
        "half": 0.4 * weight,
        "inner": radius,
        "outer": 1.15 * radius,
        "arm": 1.077 * radius,
    }
    return {name: f"{value:.6g}" for name, value in found.items()}


def described(machine: Machine, lines: str) -> Machine:
    """A machine with the lines of its owner."""
    text = machine_text(machine)
    own, _, behind = lines.partition("[[")
    head, *bearings = text.split("[[touchdown_bearings]]")
    of_thrust = own.startswith("face")
    for index, part in enumerate(bearings):
        if own.startswith("bearing: "):
            wanted = own.removeprefix("bearing: ").strip()
            for key in ("ball_material", "fit_friction", "ring_mass", "spring_rate"):
                wanted = wanted.replace(f", {key}", f"\n{key}")
            part = part.replace("\ncontact_angle", f"\n{wanted}\ncontact_angle", 1)
        elif own.strip() and (index == 1 or not of_thrust):
            part = part.replace("\nnode = ", f"\n{own.strip()}\nnode = ", 1)
        bearings[index] = part
    text = "[[touchdown_bearings]]".join([head, *bearings])
    return loads_machine(f"{text}\n[[{behind}" if behind else text)


def place_of(folder: Path, name: str, drop: int) -> Path:
    """Where the files of one drop are."""
    return folder / name.replace(" ", "_") / f"{drop:02d}"


def make(folder: Path, name: str, drop: int) -> Path:
    """Machine files, recording, tail and truth of one drop; where they are."""
    place, case, number = place_of(folder, name, drop), CASES[name], list(CASES).index(name)
    if not truth_of(place).is_file():
        machine = bench_rotor(case.rotor)
        sizes = measures(machine)
        lines = {"a": case.known, "b": case.guessed, "c": ""}
        owned = {way: machine_text(described(machine, one.format(**sizes))) for way, one in lines.items()}
        seeds = FIRST_SEED + number, FIRST_SEED + 100 * (number + 1) + drop
        write_drop(place, machine, case.speed, seeds, case.hidden.format(**sizes), owned)
    return place


def peaks_of(score: dict[str, Any]) -> list[dict[str, Any]]:
    """Peaks of one estimate."""
    return [own[field] for own in score["bearings"].values() for field in SHOWN if field in own]


def table(folder: Path, drops: int) -> str:
    """Table of the estimates there are, and what they say together."""
    rows = [
        "Error ± half width of the 90 % interval [%] of peak force and stress, both ends; ! outside it.",
        "",
        "| machine | drop | estimated | consistent | named | peak force and stress, NDE, DE |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    sums: dict[str, list[dict[str, Any]]] = {way: [] for way in WAYS}
    for name, case in CASES.items():
        for drop in range(drops):
            for way, words in WAYS.items():
                file = place_of(folder, name, drop) / f"{way}.json"
                if not file.is_file():
                    continue
                one = scored(file)
                head = f"| {name}, {case.rotor} | {drop} | {words} |"
                if "failed" in one:
                    rows.append(f"{head} none | | {one['failed']} |")
                    continue
                peaks = peaks_of(one)
                sums[way].append(one | {"peaks": peaks})
                flag, named = "yes" if one["consistent"] else "no", ", ".join(one["named"]) or "–"
                rows.append(f"{head} {flag} | {named} | {'; '.join(map(cell, peaks))} |")
    rows.append("")
    for way, words in WAYS.items():
        if not sums[way]:
            continue
        peaks = [peak for one in sums[way] for peak in one["peaks"]]
        held = sum(peak["covered"] for peak in peaks)
        lost = sum(abs(peak["relative_error"]) > LOST for peak in peaks)
        flagged = sum(not one["consistent"] for one in sums[way])
        silent = sum(
            one["consistent"] and not all(peak["covered"] for peak in one["peaks"]) for one in sums[way]
        )
        rows.append(
            f"- {words}: {len(sums[way])} estimates, {held} of {len(peaks)} peaks held, {lost} lost, "
            f"{flagged} flagged, {silent} with a peak outside its interval and not flagged"
        )
    return "\n".join(rows) + "\n"


def main() -> None:
    """Make and estimate what is missing, or score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--limit", type=float, default=math.inf)
    parser.add_argument("--drops", type=int, default=DROPS)
    parser.add_argument("--only", nargs="*", default=list(CASES), choices=CASES)
    parser.add_argument("--score", action="store_true")
    asked = parser.parse_args()
    if asked.score:
        results = Path(__file__).parent / "results"
        results.mkdir(exist_ok=True)
        (results / "table.md").write_text(table(asked.folder, asked.drops))
        print(table(asked.folder, asked.drops))
        return
    began = time.monotonic()
    for drop in range(asked.drops):
        for way in ("a", "c", "b"):
            for name in asked.only:
                if time.monotonic() - began > asked.limit:
                    return
                place = make(asked.folder, name, drop)
                file = place / f"{way}.json"
                if not file.is_file():
                    estimate(place, f"{way}.toml", file)
                    one = scored(file)
                    said = one.get("failed") or "; ".join(map(cell, peaks_of(one)))
                    print(name, drop, way, said, flush=True)


if __name__ == "__main__":
    main()
