"""What an accepted extension says of the machine, in one sentence with intervals."""

from __future__ import annotations

from rotordrop.elements.parameter import Values
from rotordrop.estimate.estimate import Structure
from rotordrop.machine import Machine
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.twin.search import Accepted


def structure_of(accepted: Accepted, machine: Machine, values: Values) -> Structure:
    """What an accepted extension says of the machine, with 90 % intervals in brackets."""
    load = float(sum(bearing_load_shares(machine))) / len(machine.touchdown_bearings)
    found = accepted.extension.found(machine, values, load)
    return Structure(name=accepted.extension.name, gain=accepted.gain, sentence=f"Found: {found}.")
