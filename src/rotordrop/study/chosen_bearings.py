"""Bearings chosen by designation: a number says which of a list, and the machine gets that bearing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.study.distributions import Distribution

PART = ".bearing"
"""End of the name of a choice among bearings, ``"DE.bearing"`` or ``"*.bearing"``."""
AS_DESCRIBED = -1.0
"""In place of a number of the list: the bearing of the machine file."""


def is_bearing(name: str) -> bool:
    """Whether a name means a whole bearing, not a number."""
    return name.endswith(PART) and name.count(".") == 1


def read_bearings(machine: Machine, name: str, table: Any) -> Distribution:
    """Read a choice such as ``{choices = ["B7014-E", "HCB7014-E"]}``; every one must fit the machine.

    Raises
    ------
    UsageError
        If it is no list of designations, or the machine cannot have one of them.
    """
    listed = table.get("choices") if isinstance(table, Mapping) and len(table) == 1 else None
    if not (isinstance(listed, list) and len(listed) > 1 and all(isinstance(one, str) for one in listed)):
        raise UsageError(
            f"{name} is chosen from {table!r}; expected designations, as in "
            '{choices = ["XCB71914-E", "HCB71914-E"]}'
        )
    twice = sorted({one for one in listed if listed.count(one) > 1})
    if twice:
        raise UsageError(f"{name}: {', '.join(twice)} listed twice; expected each designation once")
    spread = bearings_of(listed)
    for number in spread.numbers:
        with_chosen(machine, {name: spread}, {name: number})
    return spread


def bearings_of(designations: list[str]) -> Distribution:
    """A choice among bearings, as likely as one another."""
    return Distribution(
        shape="choices", numbers=tuple(map(float, range(len(designations)))), names=tuple(designations)
    )


def with_chosen(machine: Machine, choose: Mapping[str, Distribution], values: Mapping[str, float]) -> Machine:
    """The machine with the bearings that the values say; itself where none is chosen."""
    for name, spread in choose.items():
        if spread.names and values[name] != AS_DESCRIBED:
            owner, designation = name.removesuffix(PART), spread.names[int(values[name])]
            owners = [b.name for b in machine.touchdown_bearings] if owner == "*" else [owner]
            for one in owners:
                machine = machine.with_bearing(one, designation)
    return machine
