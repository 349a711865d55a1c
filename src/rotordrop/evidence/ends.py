"""Which ends of a rotor fall: all, but those whose magnets the machine says to stay on."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record


def held_planes(record: Record, machine: Machine) -> tuple[bool, ...]:
    """Whether the magnet nearest to a plane stays on, plane by plane."""
    position = machine.rotor.node_positions

    def stays(node: int) -> bool:
        near = min(machine.ambs, key=lambda amb: abs(position[amb.node - 1] - position[node - 1]))
        return near.stays_on

    return tuple(bool(machine.ambs) and stays(plane.node) for plane in record.planes)


def held_bearings(machine: Machine) -> tuple[str, ...]:
    """Names of the touchdown bearings whose nearest magnet stays on."""
    if not any(amb.stays_on for amb in machine.ambs):
        return ()
    position = machine.rotor.node_positions
    return tuple(
        bearing.name
        for bearing in machine.touchdown_bearings
        if min(
            machine.ambs, key=lambda amb: abs(position[amb.node - 1] - position[bearing.node - 1])
        ).stays_on
    )


def falling(record: Record, machine: Machine) -> Record:
    """The whole planes of a record whose end fell: all of them but in a drop of one end."""
    whole = record.whole
    held = held_planes(whole, machine)
    if not any(held) or all(held):
        return whole
    return whole.of_channels(
        sorted(c for plane, stays in zip(whole.planes, held, strict=True) if not stays for c in plane.columns)
    )
