"""What really happened: a machine drawn around its description, and the conditions of one drop."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, field, replace

import numpy as np

from rotordrop.elements.table import structure_rows as structure_rows_of
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.simulate.case import LevitatedStart
from rotordrop_bench.departing import departing
from rotordrop_bench.structure import departures_of, pushed, violated
from rotordrop_bench.violations import Violations

FINER = Reduction(modes=14, attachment=True)
"""Basis of the true rotor: finer than that of any estimator."""

LARGEST_ORBIT = 12e-6
"""Largest radius of the synchronous orbit at an AMB [m]; chosen, not measured."""

LARGEST_JITTER = 1e-3
"""The true power-off lies within this time of the trigger [s]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class HiddenMachine:
    """A machine as it really is, beside what its owner knows of it."""

    machine: Machine
    """The true machine."""
    known: Machine
    """The description it was drawn around."""
    seed: int
    """Seed it was drawn with."""
    violations: Violations
    """What breaks the estimator's assumptions."""
    model: DropModel = field(repr=False)
    """The true machine with all that departs from any estimator's model, ready to be simulated."""


@dataclass(frozen=True, kw_only=True)
class DropConditions:
    """What differs from drop to drop of one machine."""

    speed: float
    """Speed at power-off [rad/s]."""
    start: LevitatedStart
    """Rotor angle, position held, remanent force."""
    jitter: float
    """True power-off in record time [s]."""


def hidden_machine(
    machine: Machine,
    seed: int,
    violations: Violations | None = None,
    *,
    drawn: bool = True,
    reduction: Reduction = FINER,
) -> HiddenMachine:
    """Draw a machine whose owner knows it as described.

    Supports differ by -40 to +45 %; air gap, contact, friction, preload, race, damping, drag, first ball and
    unbalance differ as first guesses do. Values keep to the range the description states; the same seed gives
    the same machine, and without ``drawn`` the description is the truth.
    """
    broken = violations or Violations()
    broken.check_names(machine)
    if machine.loads or machine.base is not None:
        raise UsageError(
            f"the machine {machine.name!r} has loads or a base that accelerates, with which no recording can "
            "be made yet; leave them out"
        )
    true = machine.with_values(_drawn_values(machine, stream(seed, "machine"))) if drawn else machine
    true = violated(true, broken)
    model = build_drop_model(true, reduction)
    rows = departures_of(true, broken)
    if len(rows):
        # a departing support does not have the structures that a machine file may state
        for bearing in true.touchdown_bearings:
            stated = {row.path: row.stated(bearing) for row in structure_rows_of("bearing")}
            lost = ["mount"] if bearing.mount.present else []
            lost += [path for path, own in stated.items() if own is not None and float(own) != 0.0]
            if lost:
                raise UsageError(
                    f"the machine file states {bearing.name}.{lost[0]}, and the drop has violations too, "
                    "which would take its place; leave it out of the machine file, or give it as one of them "
                    "(support.axes_angle, support.hardening, foundation)"
                )
    return HiddenMachine(
        machine=true,
        known=machine,
        seed=seed,
        violations=broken,
        model=pushed(departing(model, rows), broken),
    )


def drop_conditions(hidden: HiddenMachine, speed: float, seed: int) -> DropConditions:
    """Draw rotor angle, levitated position, remanent force and trigger error of one drop."""
    if not speed > 0.0:
        raise UsageError(f"a drop at {speed:g} rad/s cannot be synthesized; give a speed above zero")
    random = stream(seed, "drop")
    magnets = len(hidden.machine.ambs)
    share = hidden.machine.rotor.mass * float(hidden.machine.gravity) / max(magnets, 1)
    remanent = share * np.column_stack(
        [random.uniform(-0.03, 0.03, magnets), random.uniform(0.05, 0.3, magnets)]
    )
    gap = min(float(bearing.air_gap) for bearing in hidden.machine.touchdown_bearings)
    radius = np.minimum(LARGEST_ORBIT, 0.05 * gap) * random.uniform(0.3, 1.0, magnets)
    start = LevitatedStart(
        rotor_angle=float(random.uniform(0.0, 2.0 * math.pi)),
        offset=0.08 * gap * random.uniform(-1.0, 1.0, (magnets, 2)),
        remanent_force=remanent,
        remanence_time_constant=float(random.uniform(1.5e-3, 2.5e-3)),
        orbit=radius * np.exp(2j * math.pi * random.uniform(0.0, 1.0, magnets)),
    )
    if (lasts := hidden.violations["magnets.remanence_time"]) is not None:
        start = replace(start, remanence_time_constant=lasts)
    jitter = float(random.uniform(-LARGEST_JITTER, LARGEST_JITTER))
    return DropConditions(speed=speed, start=start, jitter=jitter)


def _drawn_values(machine: Machine, random: np.random.Generator) -> dict[str, float]:
    constant = machine.speed.aero_time_constant
    values = {
        "rotor.modal_damping": float(machine.rotor.modal_damping) * _log_uniform(random, 0.7, 1.3),
        "speed.aero_time_constant": float(random.uniform(6.0, 14.0))
        if constant is None
        else _within(constant, _log_uniform(random, 0.75, 1.35)),
    }
    for index, unbalance in enumerate(machine.unbalances):
        values[f"unbalance.{index}.amount"] = _within(unbalance.amount, _log_uniform(random, 0.5, 1.5))
        values[f"unbalance.{index}.phase"] = float(random.uniform(-math.pi, math.pi))
    for amb in machine.ambs:
        values[f"ambs.{amb.name}.stiffness"] = _within(amb.stiffness, _log_uniform(random, 0.4, 1.3))
        values[f"ambs.{amb.name}.damping"] = _within(amb.damping, _log_uniform(random, 0.6, 1.6))
    common = {
        "contact": _log_uniform(random, 0.75, 1.45),
        "dynamic": float(random.uniform(0.07, 0.15)),
        "static": float(random.uniform(1.2, 1.5)),
        "stribeck": float(random.uniform(0.6, 1.4)),
        "lambda": float(random.uniform(0.6, 1.4)),
        "damping_time": _log_uniform(random, 0.6, 1.6),
        "drag": _log_uniform(random, 0.3, 1.2),
        "race_mass": float(random.uniform(0.9, 1.1)),
    }
    for bearing in machine.touchdown_bearings:
        mine = _bearing_values(bearing, common, random)
        values |= {f"{bearing.name}.{path}": value for path, value in mine.items()}
    return values


def _bearing_values(
    bearing: TouchdownBearing, common: dict[str, float], random: np.random.Generator
) -> dict[str, float]:
    support, contact, friction, balls = bearing.support, bearing.contact, bearing.friction, bearing.bearing
    stiffness = _within(support.stiffness, _log_uniform(random, 0.6, 1.45))
    mass = _within(support.mass, _log_uniform(random, 0.6, 1.45))
    ratio = float(support.damping) / (2.0 * math.sqrt(float(support.stiffness) * float(support.mass)))
    ratio *= _log_uniform(random, 0.6, 1.6)
    dynamic = common["dynamic"]
    if friction.dynamic.range is None and friction.dynamic.status == "given":
        dynamic = float(friction.dynamic) * common["stribeck"]
    return {
        "air_gap": _within(bearing.air_gap, float(random.uniform(0.95, 1.15))),
        "support.stiffness": stiffness,
        "support.mass": mass,
        "support.damping": 2.0 * ratio * math.sqrt(stiffness * mass),
        "contact.stiffness": _within(contact.stiffness, common["contact"] * _log_uniform(random, 0.93, 1.07)),
        "contact.damping": _within(contact.damping, common["lambda"]),
        "friction.dynamic": dynamic,
        "friction.static": dynamic * common["static"],
        "friction.stribeck_speed": _within(friction.stribeck_speed, common["stribeck"]),
        "preload": _within(balls.preload, _log_uniform(random, 0.8, 1.25)),
        "bearing.first_ball_angle": float(random.uniform(0.0, 2.0 * math.pi / balls.ball_count)),
        "race.inertia": _within(bearing.race.inertia, _log_uniform(random, 0.85, 1.2)),
        "race.mass": _within(bearing.race.mass, common["race_mass"]),
        "race.drag_coefficient": float(bearing.race.drag_coefficient) * common["drag"],
        "damping_time": _within(bearing.damping_time, common["damping_time"]),
    }


def _log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    return math.exp(float(random.uniform(math.log(low), math.log(high))))


def _within(value: Known, factor: float) -> float:
    """A value times a factor, kept inside the range its owner states."""
    drawn = float(value) * factor
    return drawn if value.range is None else min(max(drawn, value.range[0]), value.range[1])


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Generator (Philox) for one purpose; adding a purpose never shifts the numbers of another."""
    sequence = np.random.SeedSequence([seed, zlib.crc32(purpose.encode())])
    return np.random.Generator(np.random.Philox(sequence))
