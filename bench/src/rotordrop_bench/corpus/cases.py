"""The cases of the harness: which there are, what is true of each, and the files an estimator is given."""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.elements.table import rows
from rotordrop.errors import SimulationError, UsageError
from rotordrop.files import digest_of_file
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import (
    Unknown,
    all_unknowns,
    file_path,
    inferred_together,
    sensor_prior,
    smallest_gap,
)
from rotordrop_bench.departures import DEPARTURES, SIZES, departures
from rotordrop_bench.event import drop_conditions, hidden_machine, stream
from rotordrop_bench.faults import FAULTS, PLAIN, spoiled
from rotordrop_bench.recording import SyntheticDrop, drop_path, synthesize_drop, truth_path, write_drop
from rotordrop_bench.rotors import ROTORS, bench_rotor, scaled_rotor
from rotordrop_bench.sensor_chain import SensorChain, fitted_to
from rotordrop_bench.violations import Violations

PLAN, LIST = (resources.files(__package__).joinpath(f"{name}.toml") for name in ("cases", "dropbench"))
DROPBENCH = tomllib.loads(LIST.read_text(encoding="utf-8"))
VERSION, SPEEDS = DROPBENCH["version"], DROPBENCH["speeds"]
"""Version of DropBench, and speeds of every rotor [Hz]."""
KINDS = (*(kind for kind in DEPARTURES if kind != "unbalance jump"), "unbalance jump")
"""Departures, in turn over the cases of the corpus that have one."""
TRIES, TRY = 20, 100_000
"""Draws from the prior until a rotor drops within its record, and what a further one adds to the seed."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One drop with known truth; the name says nothing of what is hidden."""

    name: str
    group: str
    """What is scored together."""
    rotor: str
    """Rotor, by its name in `ROTORS`."""
    speed: float = 0.0
    """Speed at power-off [Hz]; 0 where it is drawn."""
    seeds: tuple[int, int]
    """Of the hidden machine and of the drop."""
    departures: tuple[tuple[str, int], ...] = ()
    """Kinds and sizes of what the description of the machine does not have."""
    tail: bool = True
    """Whether the settled tail was recorded."""
    sampling_rate: float = 20e3
    """Samples per second [Hz]."""
    fault: str = ""
    clean: str = ""
    """The fault of the record, and the case whose record is the same without it."""
    plan: Mapping[str, Any] = field(default_factory=dict)
    """How a case of the corpus is drawn; empty for a drop of DropBench."""


Drop = tuple[str, int, tuple[tuple[str, int], ...], int, dict[str, Any]]
"""Family, seed of the machine, departures, turn of the rotors, and what a drop has besides."""


def _dropbench() -> Iterator[Case]:
    kinds, rotors, split = list(DEPARTURES), list(ROTORS), DROPBENCH["first"]

    def single(family: str, own: list[str], seed: int, turn: int) -> Iterator[Drop]:
        for size, word in enumerate(SIZES):
            for i, kind in enumerate(own):
                yield f"{family}, {word}", seed + 100 * size + i, ((kind, size),), turn * size + i, {}

    right = (("right", True), ("right, without tail", False))
    first: list[Drop] = [
        (name, 700 + i, (), i, {"tail": tail}) for i in range(len(ROTORS)) for name, tail in right
    ]
    # a turn longer than the kinds, else each would meet one rotor in both sizes
    first += single("one departure", kinds[:split], 800, split + 1)
    turn = 2 * (split + 1)
    for seed, (family, groups) in zip((1000, 1100), DROPBENCH["groups"].items(), strict=True):
        for i, named in enumerate(groups):
            first.append((family, seed + i, tuple((kind, 0) for kind in named), turn, {}))
            turn += 1
    first += [
        ("other sampling rates", 1200 + i, (), turn + i, {"sampling_rate": rate})
        for i, rate in enumerate(DROPBENCH["rates"])
    ]
    later, last = kinds[split:-1], kinds[-1]
    play: list[Drop] = [
        (f"{last}, {SIZES[i % 2]}", 1500 + i, ((last, i % 2),), i, {"speed": SPEEDS[rotor][1]})
        for i, rotor in enumerate(ROTORS)
    ]
    for start, drops in ((1, first), (101, single("later kinds", later, 1300, len(later))), (201, play)):
        speeds = {rotor: cycle(values) for rotor, values in SPEEDS.items()}
        for number, (group, seed, own, turn, more) in enumerate(drops, start):
            rotor = rotors[turn % len(rotors)]
            yield Case(
                name=f"drop_{number:03d}",
                group=group,
                rotor=rotor,
                seeds=(seed, 9000 + number),
                departures=own,
                **{"speed": next(speeds[rotor])} | more,
            )


DROPS: tuple[Case, ...] = tuple(_dropbench())
"""All drops of DropBench, in order."""


def chosen_drops(only: Iterable[str]) -> tuple[Case, ...]:
    """Drops of DropBench by name, by family or by rotor; all without any."""
    wanted = set(only)
    keys = {drop.name: {drop.name, drop.group, drop.rotor} for drop in DROPS}
    if unknown := sorted(wanted - set().union(*keys.values())):
        raise UsageError(
            f"the bench has no drop {unknown[0]!r}; name one of {DROPS[0].name} to {DROPS[-1].name}, a rotor "
            f"such as {DROPS[0].rotor!r}, or a family, as 'rotordrop-bench list' prints them"
        )
    return tuple(drop for drop in DROPS if not wanted or keys[drop.name] & wanted)


def plan_digest() -> str:
    """SHA-256 of the plan of the corpus; tables of different plans do not compare."""
    return hashlib.sha256(PLAN.read_bytes()).hexdigest()


def listed(*, short: bool = False) -> Iterator[Case]:
    """The cases of the corpus, or those of the short one."""
    plan = tomllib.loads(PLAN.read_text(encoding="utf-8"))
    for group, own in plan["groups"].items():
        for number in range(own["short" if short else "count"]):
            yield _of_corpus(plan, group, number)


def _of_corpus(plan: Mapping[str, Any], group: str, number: int) -> Case:
    own, kinds, rotors = plan["record"] | plan["groups"][group], list(FAULTS), list(ROTORS)
    name, turn = f"{group}-{number:03d}", number // len(KINDS)
    if group == "faults":
        further = number - own["plain"]
        fault = kinds[number % PLAIN] if further < 0 else kinds[PLAIN + further % (len(kinds) - PLAIN)]
        clean = _of_corpus(plan, "facts", number % plan["groups"]["facts"]["count"])
        return replace(clean, name=name, group=group, fault=fault, clean=clean.name)
    if "durations" in own:
        own["duration"] = own["durations"][number % len(own["durations"])]
    return Case(
        name=name,
        group=group,
        rotor=rotors[(number + turn) % len(rotors)],
        seeds=(own["seed"] + number,) * 2,
        departures=((KINDS[number % len(KINDS)], turn % 2),) if group == "departures" else (),
        tail=number % own["without_tail"] != 0,
        sampling_rate=own["sampling_rate"],
        plan=own,
    )


def known_machine(rotor: str, seed: int) -> Machine:
    """The machine as its owner knows it, drawn around a rotor of the bench."""
    scale = ROTORS[rotor]
    if isinstance(scale, str):
        return bench_rotor(rotor)
    random = stream(seed, "nominal")
    mass = scale[0] * math.exp(random.uniform(-0.2, 0.2))
    return scaled_rotor(
        float(f"{mass:.4g}"), float(random.uniform(1.0, 1.3)), float(random.uniform(0.0, 0.4))
    )


def drawn_from_prior(known: Machine, random: np.random.Generator) -> tuple[Machine, dict[str, float]]:
    """One draw from the estimator's prior around a machine file.

    Returns
    -------
    Machine
        The true machine.
    dict of float
        What no machine file has, by path [SI]: remanent forces and their time constant.
    """
    model = build_drop_model(known)
    unknowns = [one for one in all_unknowns(model) if one.owner or one.scope == "drop"]  # the rotor as it is
    block = np.diag([one.sigma**2 for one in unknowns])
    inferred_together(model, unknowns, block)
    theta = np.array([one.mean for one in unknowns]) + np.linalg.cholesky(block) @ random.standard_normal(
        len(unknowns)
    )
    found = {one.path: one.value_of(float(at)) for one, at in zip(unknowns, theta, strict=True)}
    by_path: dict[str, Unknown] = {one.path: one for one in unknowns}
    values = {file_path(path): value for path, value in found.items() if by_path[path].scope == "machine"}
    mean_load = float(np.mean(model.load_shares))
    for bearing in known.touchdown_bearings:
        own, contact, friction = f"{bearing.name}.", bearing.contact, bearing.friction
        if own + "support.anisotropy" in found:
            values[own + "support.stiffness_horizontal"] *= values[own + "support.stiffness"]
        # the exponent is drawn with the force at a typical depth kept
        change = float(contact.exponent) - values[own + "contact.exponent"]
        values[own + "contact.stiffness"] *= contact.typical_depth(mean_load) ** change
        ratio = float(friction.static) / float(friction.dynamic)
        values[own + "friction.static"] = ratio * values[own + "friction.dynamic"]
    for plane in range(len(known.unbalances)):
        across, along = (found[f"unbalance.{plane}.{part}"] for part in ("sine", "cosine"))
        values[f"unbalance.{plane}.amount"] = math.hypot(across, along)
        values[f"unbalance.{plane}.phase"] = math.atan2(across, along)
    values["speed.aero_time_constant"] = found["speed.aero_time_constant"]
    return known.with_values(values), {path: found[path] for path in found if "remanen" in path}


def synthesized(case: Case) -> tuple[SyntheticDrop, Machine]:
    """Recording of a case with its truth, before any fault, and the machine as its owner knows it."""
    for attempt in range(TRIES if case.plan else 1):
        try:
            made = _from_prior(case, case.seeds[0] + TRY * attempt) if case.plan else _as_described(case)
        except (SimulationError, UsageError):  # an extreme draw that no machine stands
            if not case.plan:
                raise
            continue
        if made[0].reached(0.5 * made[0].record.time[-1]):
            return made
    raise SimulationError(
        f"{case.name} is no drop here: a bearing was not reached within half of its record. Your computer "
        "rounds differently (rotordrop doctor --fingerprint); leave it out"
    )


def _as_described(case: Case) -> tuple[SyntheticDrop, Machine]:
    """A machine drawn around its description."""
    known, speed = bench_rotor(case.rotor), 2.0 * math.pi * case.speed
    hidden = hidden_machine(known, case.seeds[0], Violations.of(departures(known, speed, case.departures)))
    chain = fitted_to(SensorChain(sampling_rate=case.sampling_rate), hidden.machine)
    made = synthesize_drop(hidden, speed, case.seeds[1], sensor_chain=chain, tail=case.tail, name=case.name)
    return made, known


def _from_prior(case: Case, seed: int) -> tuple[SyntheticDrop, Machine]:
    """A machine and a drop drawn from the estimator's prior."""
    plan, random = case.plan, stream(seed, "case")
    known = known_machine(case.rotor, seed)
    low, high = math.log(min(SPEEDS[case.rotor])), math.log(max(SPEEDS[case.rotor]))
    speed = 2.0 * math.pi * math.exp(random.uniform(low, high))
    true, drop = drawn_from_prior(known, stream(seed, "prior"))
    broken = Violations.of(departures(known, speed, case.departures))
    hidden = replace(hidden_machine(true, seed, broken, drawn=False), known=known)
    conditions = drop_conditions(hidden, speed, seed)
    force = [[drop[f"{amb.name}.remanent_force.{axis}"] for axis in "xy"] for amb in known.ambs]
    start = replace(
        conditions.start,
        remanent_force=np.array(force),
        remanence_time_constant=drop["remanence.time_constant"],
    )
    row = {one.path: one for one in rows("sensor")}
    gain, offset = (
        sensor_prior(row[path], row[path].described(known.sensors[0]), smallest_gap(known)).sigma
        for path in ("gain", "offset")
    )
    chain = SensorChain(sampling_rate=case.sampling_rate, gain_error=gain, offset=offset, normal=True)
    if "noise" in plan:
        chain = replace(
            chain,
            sampling_rate=float(random.choice(plan["sampling_rates"])),
            noise=math.exp(random.uniform(*np.log(plan["noise"]))),
            bits=int(random.choice(plan["bits"])),
        )
    gap = max(float(bearing.air_gap) for bearing in known.touchdown_bearings)
    fall = math.sqrt(2.0 * gap / float(known.gravity))
    made = synthesize_drop(
        hidden,
        speed,
        seed,
        sensor_chain=fitted_to(chain, true),
        duration=plan.get("duration", round(plan["falls"] * fall, 3)),
        before=max(plan["before"], 4.0 * math.pi / speed),
        tail=case.tail,
        conditions=replace(conditions, start=start),
        name=case.clean or case.name,
    )
    return made, known


def made(case: Case, folder: Path) -> Path:
    """The folder of a case with ``machine.toml``, ``record.csv`` and ``tail.csv``, made once.

    The truth stands apart and is written last: a case that has it is complete.
    """
    if truth_path(folder, case.name).is_file():
        return drop_path(folder, case.name)
    drop, known = synthesized(case)
    if case.fault:
        record, known = spoiled(drop.record, known, case.fault, case.name)
        drop = replace(drop, record=record)
    facts = {"bench_version": VERSION, "family": case.group, "rotor": case.rotor}
    return write_drop(drop, known, folder, case.name, **facts)


def digest(place: Path) -> str:
    """Digest of what a version is given of a case, 12 hexadecimal digits."""
    parts = [digest_of_file(place / name) for name in ("record.csv", "tail.csv") if (place / name).is_file()]
    return hashlib.sha256("".join(parts).encode()).hexdigest()[:12]
