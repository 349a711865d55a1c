"""Ways in which a hidden machine breaks what an estimator takes for granted, by name or from a case file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pydantic import Field

from rotordrop.elements.description import Channel, Name
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.machine.loading import load_description
from rotordrop.machine.schema import description_schema
from rotordrop_bench.violation_parts import (
    BearingViolations,
    ChainViolation,
    MagnetViolation,
    RotorViolation,
    SensorViolation,
    UnbalanceJump,
)


class Violations(BearingViolations):
    """What is true of the hidden machine and unknown to the estimator."""

    bearing: dict[Name, BearingViolations] = Field(default_factory=dict)
    """At one touchdown bearing, before what is said for all."""
    sensors: ChainViolation = ChainViolation()
    """At every sensor."""
    sensor: dict[Channel, SensorViolation] = Field(default_factory=dict)
    """At one sensor, before what is said for all."""
    magnets: MagnetViolation = MagnetViolation()
    """The magnets."""
    rotor: RotorViolation = RotorViolation()
    """The rotor."""
    unbalance_jump: UnbalanceJump | None = None
    """An unbalance that comes during the drop."""

    def of_bearing(self, name: str) -> BearingViolations:
        """What holds at one bearing: what is said of it, then what is said of all."""
        own = self.bearing.get(name)
        parts = {
            key: _over(getattr(self, key), getattr(own, key) if own else None)
            for key in BearingViolations.model_fields
        }
        return BearingViolations(**parts)

    def of_sensor(self, name: str) -> SensorViolation:
        """What holds at one sensor: what is said of it, then what is said of all."""
        every = {key: getattr(self.sensors, key) for key in self.sensors.model_fields_set}
        every.pop("anti_alias_frequency", None)
        found: SensorViolation = _over(SensorViolation(**every), self.sensor.get(name))
        return found

    def check_names(self, machine: Machine) -> None:
        """Refuse names of bearings and sensors that the machine does not have, and a node outside it."""
        for what, named, there in (
            ("bearing", self.bearing, [b.name for b in machine.touchdown_bearings]),
            ("sensor", self.sensor, [s.name for s in machine.sensors]),
        ):
            for name in named:
                if name not in there:
                    raise UsageError(
                        f"the violations name the {what} {name!r}, which the machine does not have; "
                        f"it has {', '.join(there)}"
                    )
        nodes = len(machine.rotor.node_positions)
        if self.unbalance_jump is not None and self.unbalance_jump.node > nodes:
            raise UsageError(
                f"the unbalance comes at node {self.unbalance_jump.node}, outside the rotor; its nodes are 1 "
                f"to {nodes}"
            )


def _over(every: Any, own: Any) -> Any:
    """Violations of one part: its own values before those of all parts."""
    if own is None:
        return every
    given = {key: getattr(every, key) for key in every.model_fields_set}
    given |= {key: getattr(own, key) for key in own.model_fields_set}
    return type(every)(**given)


def _of(**parts: Any) -> Violations:
    return Violations.model_validate(parts)


VIOLATIONS: dict[str, Violations] = {
    "none": Violations(),
    "contact stiffness +25 %": _of(contact={"stiffness": 1.25}),
    "contact stiffness -25 %": _of(contact={"stiffness": 0.75}),
    "contact exponent 1.5": _of(contact={"exponent": 1.5}),
    "contact damping +50 %": _of(contact={"damping": 1.5}),
    "race inertia +25 %": _of(race={"inertia": 1.25}),
    "race inertia -25 %": _of(race={"inertia": 0.75}),
    "sharper friction": _of(friction={"stribeck_speed": 0.2, "static": 1.3}),
    "anisotropic support 0.6": _of(support={"stiffness_ratio": 0.6}),
    "sensor planes 30 mm off": _of(sensors={"plane_shift": "30 mm"}),
    "anti-alias filter": _of(sensors={"anti_alias_frequency": "4 kHz"}),
}


def load_violations(path: str | os.PathLike[str]) -> Violations:
    """Read violations from a TOML file; every refusal says where and what to do.

    Raises
    ------
    MachineFileError
        When the file cannot be used; the message holds file, line, column, the value and the way out.
    """
    return load_description(Violations, Path(path))


def violations_schema() -> dict[str, Any]:
    """Give the JSON Schema (draft 2020-12) of a file of violations."""
    return description_schema(Violations, "rotordrop violations of a hidden machine")


def named_violations(choice: str | Violations) -> Violations:
    """The violations of a name or of a case file (.toml), or the violations themselves."""
    if isinstance(choice, Violations):
        return choice
    if choice.endswith(".toml"):
        return load_violations(choice)
    if choice not in VIOLATIONS:
        raise UsageError(
            f"unknown violation {choice!r}; choose one of {', '.join(map(repr, VIOLATIONS))}, or give a "
            ".toml file"
        )
    return VIOLATIONS[choice]
