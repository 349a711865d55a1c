"""The cases of the corpus: which there are, what is true of each, and the files that a version is given."""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import resources
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
from rotordrop_bench.departures import DEPARTURES, departures
from rotordrop_bench.drops import SPEEDS
from rotordrop_bench.event import DropConditions, HiddenMachine, drop_conditions, hidden_machine, stream
from rotordrop_bench.faults import FAULTS, SIZED, spoiled
from rotordrop_bench.files import write_drop
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop
from rotordrop_bench.rotors import ROTORS, bench_rotor, scaled_rotor
from rotordrop_bench.sensor_chain import SensorChain, fitted_to
from rotordrop_bench.violations import Violations

PLAN = resources.files(__package__).joinpath("cases.toml")
KINDS = (*(kind for kind in DEPARTURES if kind != "unbalance jump"), "unbalance jump")
"""Departures, in turn over the cases that have one."""
TRIES, TRY = 20, 100_000
"""Draws of a case until its rotor drops within the record, and what a further one adds to the seed."""

SCALED = {"5 kg": 5.0, "30 kg": 30.0, "140 kg": 140.0, "500 kg": 500.0, "1.6 t": 1600.0, "6 t": 6000.0}
"""Mass [kg] around which a machine file is drawn; the other rotors are as their files have them."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One case of the corpus."""

    group: str
    number: int
    """Counted from 0 within its group."""
    plan: dict[str, Any]
    """What the group has in the file of the plan, over what holds for all records."""

    @property
    def name(self) -> str:
        """Name, which stands in the table."""
        return f"{self.group}-{self.number:03d}"

    @property
    def rotor(self) -> str:
        """Rotor, by its name in `ROTORS`."""
        return list(ROTORS)[(self.number + self.number // len(KINDS)) % len(ROTORS)]

    @property
    def departure(self) -> tuple[str, int] | None:
        """What the machine has beyond its file: kind and size."""
        if self.group != "departures":
            return None
        return KINDS[self.number % len(KINDS)], self.number // len(KINDS) % 2

    @property
    def fault(self) -> str:
        """The fault of its record; nothing where it has none."""
        if self.group != "faults":
            return ""
        kinds, further = list(FAULTS), self.number - int(self.plan["plain"])
        return kinds[self.number % len(kinds)] if further < 0 else list(SIZED)[further % len(SIZED)]

    @property
    def clean(self) -> Case:
        """The case whose record is the same without a fault."""
        number = self.number % int(self.plan.get("clean", self.number + 1))
        return replace(self, group="facts" if self.fault else self.group, number=number)

    @property
    def has_tail(self) -> bool:
        """Whether the settled tail was recorded."""
        return self.number % int(self.plan["without_tail"]) != 0


def plan_digest() -> str:
    """SHA-256 of the plan; tables of different plans do not compare."""
    return hashlib.sha256(PLAN.read_bytes()).hexdigest()


def listed(*, short: bool = False) -> Iterator[Case]:
    """The cases of the corpus, or those of the short one."""
    plan = tomllib.loads(PLAN.read_text(encoding="utf-8"))
    facts = plan["groups"]["facts"]
    plan["groups"]["faults"] = facts | {"clean": facts["count"]} | plan["groups"]["faults"]
    for group, own in plan["groups"].items():
        for number in range(own["short" if short else "count"]):
            yield Case(group=group, number=number, plan=plan["record"] | own)


def known_machine(rotor: str, seed: int) -> Machine:
    """The machine as its owner knows it, drawn around a rotor of the bench."""
    if rotor not in SCALED:
        return bench_rotor(rotor)
    random = stream(seed, "nominal")
    mass = SCALED[rotor] * math.exp(random.uniform(-0.2, 0.2))
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


def true_conditions(
    hidden: HiddenMachine, speed: float, seed: int, drawn: dict[str, float]
) -> DropConditions:
    """Conditions of a drop whose remanent forces were drawn from the prior."""
    conditions = drop_conditions(hidden, speed, seed)
    force = [[drawn[f"{amb.name}.remanent_force.{axis}"] for axis in "xy"] for amb in hidden.known.ambs]
    start = replace(
        conditions.start,
        remanent_force=np.array(force),
        remanence_time_constant=drawn["remanence.time_constant"],
    )
    return replace(conditions, start=start)


def synthesized(case: Case) -> tuple[SyntheticDrop, Machine]:
    """Recording of a case with its truth, and the machine as its owner knows it."""
    for attempt in range(TRIES):
        seed = int(case.plan["seed"]) + case.number + TRY * attempt
        try:
            made = _drawn(case, seed)
        except (SimulationError, UsageError):  # an extreme draw that no machine stands
            continue
        if made[0].reached(0.5 * made[0].record.time[-1]):
            return made
    raise SimulationError(f"{case.name}: no draw of {TRIES} drops within its record")


def _drawn(case: Case, seed: int) -> tuple[SyntheticDrop, Machine]:
    plan, random = case.plan, stream(seed, "case")
    known = known_machine(case.rotor, seed)
    low, high = math.log(min(SPEEDS[case.rotor])), math.log(max(SPEEDS[case.rotor]))
    speed = 2.0 * math.pi * math.exp(random.uniform(low, high))
    true, drop = drawn_from_prior(known, stream(seed, "prior"))
    kinds = () if case.departure is None else (case.departure,)
    broken = Violations.of(departures(known, speed, kinds))
    hidden = replace(hidden_machine(true, seed, broken, drawn=False), known=known)
    row = {one.path: one for one in rows("sensor")}
    sigma = {
        path: sensor_prior(row[path], row[path].described(known.sensors[0]), smallest_gap(known)).sigma
        for path in ("gain", "offset")
    }
    rate = float(plan["sampling_rate"])
    chain = SensorChain(sampling_rate=rate, gain_error=sigma["gain"], offset=sigma["offset"], normal=True)
    gap = max(float(bearing.air_gap) for bearing in known.touchdown_bearings)
    duration = round(float(plan["falls"]) * math.sqrt(2.0 * gap / float(known.gravity)), 3)
    if "noise" in plan:
        duration = float(plan["durations"][case.number % len(plan["durations"])])
        chain = replace(
            chain,
            sampling_rate=float(random.choice(plan["sampling_rates"])),
            noise=math.exp(random.uniform(*np.log(plan["noise"]))),
            bits=int(random.choice(plan["bits"])),
        )
    made = synthesize_drop(
        hidden,
        speed,
        seed,
        sensor_chain=fitted_to(chain, true),
        duration=duration,
        before=max(float(plan["before"]), 4.0 * math.pi / speed),
        tail=case.has_tail,
        conditions=true_conditions(hidden, speed, seed, drop),
        name=case.name,
    )
    return made, known


def made(case: Case, folder: Path) -> Path:
    """The folder of a case with ``machine.toml``, ``record.csv``, ``tail.csv`` and ``truth.json``, made once.

    The truth is written last: a case that has it is complete.
    """
    place = folder / "cases" / case.name
    if not (place / "truth.json").is_file():
        drop, known = synthesized(case.clean)
        if case.fault:
            record, known = spoiled(drop.record, known, case.fault, case.name)
            drop = replace(drop, record=record)
        write_drop(drop, known, place, place / "truth.json")
    return place


def digest(place: Path) -> str:
    """Digest of what a version is given of a case, 12 hexadecimal digits."""
    parts = [digest_of_file(place / name) for name in ("record.csv", "tail.csv") if (place / name).is_file()]
    return hashlib.sha256("".join(parts).encode()).hexdigest()[:12]
