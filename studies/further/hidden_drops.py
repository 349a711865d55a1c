"""Drops of hidden machines as studies make, estimate, score and show them."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

from rotordrop import estimate_drop
from rotordrop.document import read_json
from rotordrop.errors import RotordropError
from rotordrop.files import make_folder, write_json
from rotordrop.machine import Machine, load_machine
from rotordrop.record.record import read_record
from rotordrop_bench import score_estimate
from rotordrop_bench.event import hidden_machine
from rotordrop_bench.files import write_synthetic
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop
from rotordrop_bench.sensor_chain import SensorChain
from rotordrop_bench.violations import Violations


def hidden_drop(
    machine: Machine, speed: float, seeds: tuple[int, int], hidden: str | Violations, name: str = "record"
) -> SyntheticDrop:
    """A drop at a speed [Hz] by sensors that see the gap; seeds of hidden machine and drop."""
    drawn = hidden_machine(machine, seeds[0], hidden)
    largest = max(float(bearing.air_gap) for bearing in drawn.machine.touchdown_bearings)
    chain = SensorChain(sampling_rate=20e3, full_scale=max(600e-6, 2.0 * largest))
    return synthesize_drop(drawn, 2.0 * math.pi * speed, seeds[1], sensor_chain=chain, name=name)


def truth_of(place: Path) -> Path:
    """Truth of the drop in a folder, which is there where the drop was made."""
    return place / "truth" / "record.json"


def write_drop(
    place: Path, machine: Machine, speed: float, seeds: tuple[int, int], hidden: str, owned: dict[str, str]
) -> None:
    """Write one drop: what is hidden, what its owners have as machine files, recording, tail and truth."""
    make_folder(place)
    for name, text in {"hidden": f"{hidden}\n", **owned}.items():
        (place / f"{name}.toml").write_text(text)
    made = hidden_drop(machine, speed, seeds, str(place / "hidden.toml"))
    write_synthetic(made, place, name="record", histories=False)


def estimate(place: Path, machine_file: str, file: Path) -> None:
    """One estimate, or why there is none."""
    began = time.process_time()
    machine = load_machine(place / machine_file)
    record, tail = (read_record(place / f"{one}.csv", machine) for one in ("record", "record_tail"))
    try:
        found: dict[str, Any] = estimate_drop(machine, record, tail, name="record").to_dict()
    except RotordropError as error:
        found = {"failed": f"{type(error).__name__}: {error}"}
    write_json(file, found | {"took_s": time.process_time() - began}, sealed=True)


def scored(file: Path) -> dict[str, Any]:
    """Score of an estimate beside its drop, with parameters and time, or why it failed."""
    found = dict(read_json(file, "the script of this study"))
    if "failed" in found:
        return found
    kept = {"took_s": found.pop("took_s"), "parameters": found["parameters"]}
    return score_estimate(found, truth_of(file.parent), drop="record") | kept


def cell(one: dict[str, Any], unit: str = "") -> str:
    """Error ± half width of the 90 % interval [%]; ! where it does not hold the truth."""
    outside = "" if one.get("covered", True) else " !"
    return f"{100 * one['relative_error']:+.1f} ± {100 * one['half_width']:.1f}{unit}{outside}"
