"""Make the recordings of the bench on demand; what is there already stays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import UsageError
from rotordrop.files import make_folder, write_json
from rotordrop.machine.saving import save_machine
from rotordrop.record.record import sha256_of
from rotordrop_bench.departures import departures
from rotordrop_bench.drops import DROPS, SINCE, BenchDrop
from rotordrop_bench.event import hidden_machine
from rotordrop_bench.files import TRUTH_FOLDER, write_record
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop
from rotordrop_bench.rotors import bench_rotor
from rotordrop_bench.sensor_chain import SensorChain
from rotordrop_bench.violations import Violations

DURATION = 0.3
"""What is recorded after power-off [s]; chosen, not measured."""
LATEST_CONTACT = 0.1
"""A drop counts when the rotor has touched every bearing within this time of power-off [s]; chosen, not
measured."""

DROPS_FOLDER = "drops"


def bench_recording(drop: BenchDrop) -> SyntheticDrop:
    """Simulate and record one drop of the bench; the same bits wherever the probe drop has the same."""
    machine = bench_rotor(drop.rotor)
    speed = 2.0 * math.pi * drop.speed
    broken = Violations.model_validate(departures(machine, speed, drop.departures))
    hidden = hidden_machine(machine, drop.machine_seed, broken)
    largest = max(float(bearing.air_gap) for bearing in hidden.machine.touchdown_bearings)
    chain = SensorChain(sampling_rate=drop.sampling_rate, full_scale=max(600e-6, 2.0 * largest))
    return synthesize_drop(
        hidden, speed, drop.drop_seed, sensor_chain=chain, duration=DURATION, tail=drop.tail, name=drop.name
    )


def happened(made: SyntheticDrop) -> bool:
    """Whether every bearing was reached within `LATEST_CONTACT`."""
    first = [made.result.contacts.of_bearing(b).start for b in range(len(made.result.bearing_names))]
    return all(len(start) > 0 and float(np.min(start)) <= LATEST_CONTACT for start in first)


def chosen_drops(only: Iterable[str]) -> tuple[BenchDrop, ...]:
    """Drops by name, by family, by rotor or by version (``version 1``); all without any."""
    wanted = list(only)
    if not wanted:
        return DROPS
    known = {key for drop in DROPS for key in _keys(drop)}
    for key in wanted:
        if key not in known:
            families = ", ".join(repr(f) for f in dict.fromkeys(drop.family for drop in DROPS))
            raise UsageError(
                f"the bench has no drop {key!r}; name one of {DROPS[0].name} to {DROPS[-1].name}, a rotor "
                f"such as {DROPS[0].rotor!r}, a version such as 'version 1', or a family: {families}"
            )
    return tuple(drop for drop in DROPS if _keys(drop) & set(wanted))


def _keys(drop: BenchDrop) -> set[str]:
    return {drop.name, drop.family, drop.rotor, f"version {SINCE[drop.name]}"}


def make_bench(
    folder: str | Path,
    only: Iterable[str] = (),
    report: Callable[[str, float], None] = lambda name, share: None,
) -> list[str]:
    """Make what is missing of the bench and give the names of the drops made.

    ``drops/NAME`` gets machine file, recording and tail; ``truth/NAME.json`` the truth, written last: a drop
    that has it is complete. ``only`` holds names of drops, families, rotors or versions; empty means all.
    """
    folder = Path(folder)
    drops = chosen_drops(only)
    missing = [drop for drop in drops if not truth_path(folder, drop.name).is_file()]
    for i, drop in enumerate(missing):
        report(drop.name, i / len(missing))
        made = bench_recording(drop)
        if not happened(made):
            raise UsageError(
                f"{drop.name} of version {SINCE[drop.name]} is no drop here: a bearing was not "
                f"reached within {LATEST_CONTACT:g} s. Your computer rounds differently (rotordrop doctor "
                "--fingerprint); leave it out"
            )
        place = folder / DROPS_FOLDER / drop.name
        make_folder(place)
        make_folder(folder / TRUTH_FOLDER)
        save_machine(bench_rotor(drop.rotor), place / "machine.toml")
        write_record(made.record, place / "record.csv")
        if made.tail is not None:
            write_record(made.tail, place / "tail.csv")
        truth: dict[str, Any] = made.truth | {
            "bench_version": SINCE[drop.name],
            "family": drop.family,
            "rotor": drop.rotor,
            "record_sha256": {"record.csv": sha256_of(place / "record.csv")},
        }
        write_json(truth_path(folder, drop.name), truth, sealed=True)
    return [drop.name for drop in missing]


def truth_path(folder: Path, name: str) -> Path:
    """Where the truth of a drop stands."""
    return folder / TRUTH_FOLDER / f"{name}.json"
