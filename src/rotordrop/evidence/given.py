"""Records of drops as public functions are given them: of this machine, as many as tails and names."""

from __future__ import annotations

from typing import Any

from rotordrop.errors import RecordError, UsageError
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop.require import each, require


def require_drop(record: Any, machine: Any, name: str = "record", *, none: bool = False) -> None:
    """Refuse what is no record, and one whose sensors the machine does not have, or not there."""
    require(machine, "machine", Machine)
    sensors = () if require(record, name, Record, none=none) is None else record.sensors
    nodes = {sensor.name: sensor.node for sensor in machine.sensors}
    for sensor in sensors:
        if nodes.get(sensor.name) != sensor.node:
            there = f"has it at {nodes[sensor.name]}" if sensor.name in nodes else f"has {', '.join(nodes)}"
            raise RecordError(
                f"{name} has sensor {sensor.name} at node {sensor.node}; the machine {there}. It was read "
                "for another machine: give that one, or read it again with this one"
            )


def require_tail(tail: Any, record: Record, machine: Machine) -> None:
    """Refuse what is no tail of a record: it has the same channels."""
    require_drop(tail, machine, "tail", none=True)
    if tail is not None and tail.channel_names != record.channel_names:
        raise RecordError(f"tail has {', '.join(tail.channel_names)}; give it all channels of its record")


def given_drops(
    machine: Machine, records: Any, tails: Any, names: Any
) -> tuple[tuple[Record, ...], tuple[Record | None, ...], tuple[str, ...]]:
    """Records of drops of a machine, their tails and names, by default the stems of their files.

    Raises
    ------
    UsageError
        When they are none, not as many, or one is there twice: its errors would look smaller.
    """
    require(machine, "machine", Machine)
    drops = each(records, "records", Record)
    if not drops:
        raise UsageError("records is empty; expected one Record at least.")
    rests = each(
        [None] * len(drops) if tails is None else tails, "tails", Record, none=True, records=len(drops)
    )
    for record, rest in zip(drops, rests, strict=True):
        require_drop(record, machine)
        require_tail(rest, record, machine)
    names = None if names is None else each(names, "names", str, records=len(drops))
    if names is not None and len(set(names)) < len(drops):
        raise UsageError(f"names are {', '.join(names)}; expected one of its own for each record.")
    stems = [r.path.stem if r.path else f"drop_{i + 1}" for i, r in enumerate(drops)]
    names = tuple(stems) if names is None else names
    seen: dict[str, str] = {}
    for name, record in zip(names, drops, strict=True):
        if names.count(name) > 1:
            raise UsageError(
                f"{names.count(name)} records are named {name!r}; expected a name of its own for each, as "
                "they name the results. Rename the files, or give each once."
            )
        if record.sha256 and (other := seen.setdefault(record.sha256, name)) != name:
            raise UsageError(
                f"{other} and {name} are the same recording (equal content); leave one of them out."
            )
    return drops, rests, names
