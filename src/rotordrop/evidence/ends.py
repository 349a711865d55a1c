"""Which ends of a rotor fall: all, but those whose magnets the machine says to stay on."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record


def held_planes(record: Record, machine: Machine) -> tuple[bool, ...]:
    """Whether the magnet nearest to a plane stays on, plane by plane."""
    return tuple(_stays(machine, plane.node) for plane in record.planes)


def held_bearings(machine: Machine) -> tuple[str, ...]:
    """Names of the touchdown bearings whose nearest magnet stays on."""
    return tuple(one.name for one in machine.touchdown_bearings if _stays(machine, one.node))


def _stays(machine: Machine, node: int) -> bool:
    place = machine.rotor.node_positions
    near = min(machine.ambs, key=lambda amb: abs(place[amb.node - 1] - place[node - 1]), default=None)
    return near is not None and near.stays_on


def falling(record: Record, machine: Machine) -> Record:
    """The whole planes of a record whose end fell: all of them but in a drop of one end."""
    whole = record.whole
    held = held_planes(whole, machine)
    if not any(held) or all(held):
        return whole
    return whole.of_channels(
        sorted(c for plane, stays in zip(whole.planes, held, strict=True) if not stays for c in plane.columns)
    )
