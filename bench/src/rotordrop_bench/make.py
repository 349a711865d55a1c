"""Make the recordings of the bench on demand; what is there already stays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path

from rotordrop.errors import UsageError
from rotordrop_bench.departures import departures
from rotordrop_bench.drops import DROPS, VERSION, BenchDrop
from rotordrop_bench.event import hidden_machine
from rotordrop_bench.files import TRUTH_FOLDER, write_drop
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop
from rotordrop_bench.rotors import bench_rotor
from rotordrop_bench.sensor_chain import SensorChain, fitted_to
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
    broken = Violations.of(departures(machine, speed, drop.departures))
    hidden = hidden_machine(machine, drop.machine_seed, broken)
    chain = fitted_to(SensorChain(sampling_rate=drop.sampling_rate), hidden.machine)
    return synthesize_drop(
        hidden, speed, drop.drop_seed, sensor_chain=chain, duration=DURATION, tail=drop.tail, name=drop.name
    )


def chosen_drops(only: Iterable[str]) -> tuple[BenchDrop, ...]:
    """Drops by name, by family or by rotor; all without any."""
    wanted = list(only)
    if not wanted:
        return DROPS
    keys = {drop.name: {drop.name, drop.family, drop.rotor} for drop in DROPS}
    if unknown := [key for key in wanted if not any(key in own for own in keys.values())]:
        families = ", ".join(repr(f) for f in dict.fromkeys(drop.family for drop in DROPS))
        raise UsageError(
            f"the bench has no drop {unknown[0]!r}; name one of {DROPS[0].name} to {DROPS[-1].name}, a rotor "
            f"such as {DROPS[0].rotor!r}, or a family: {families}"
        )
    return tuple(drop for drop in DROPS if keys[drop.name] & set(wanted))


def make_bench(
    folder: str | Path,
    only: Iterable[str] = (),
    report: Callable[[str, float], None] = lambda name, share: None,
) -> list[str]:
    """Make what is missing of the bench and give the names of the drops made.

    ``drops/NAME`` gets machine file, recording and tail; ``truth/NAME.json`` the truth, written last: a drop
    that has it is complete. ``only`` holds names of drops, families or rotors; empty means all.
    """
    folder = Path(folder)
    drops = chosen_drops(only)
    missing = [drop for drop in drops if not truth_path(folder, drop.name).is_file()]
    for i, drop in enumerate(missing):
        report(drop.name, i / len(missing))
        made = bench_recording(drop)
        if not made.reached(LATEST_CONTACT):
            raise UsageError(
                f"{drop.name} is no drop here: a bearing was not reached within "
                f"{LATEST_CONTACT:g} s. Your computer rounds differently (rotordrop doctor "
                "--fingerprint); leave it out"
            )
        facts = {"bench_version": VERSION, "family": drop.family, "rotor": drop.rotor}
        place = folder / DROPS_FOLDER / drop.name
        write_drop(made, bench_rotor(drop.rotor), place, truth_path(folder, drop.name), **facts)
    return [drop.name for drop in missing]


def truth_path(folder: Path, name: str) -> Path:
    """Where the truth of a drop stands."""
    return folder / TRUTH_FOLDER / f"{name}.json"
