"""What an accepted extension says of the machine, in one sentence with intervals."""

from __future__ import annotations

from rotordrop.elements.extension import Values
from rotordrop.estimate.estimate import Structure
from rotordrop.machine import Machine
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.twin.structure_search import Kept


def structure_of(kept: Kept, machine: Machine, values: Values) -> Structure:
    """What an accepted extension says of the machine, with 90 % intervals in brackets."""
    load = float(sum(bearing_load_shares(machine))) / len(machine.touchdown_bearings)
    found = kept.extension.found(machine, values, load)
    return Structure(name=kept.extension.name, gain=kept.gain, sentence=f"Found: {found}.")
