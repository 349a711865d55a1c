"""How many modes a rotor needs for its impacts: as many as reach beyond the frequency of the contact.

An impact is a pulse of about half a period of rotor and support against each other on contact and bearing in
series. Modes far above that frequency give way statically, which attachment modes at the bearings hold; those
near it swing, and a sensor far from the bearings shows it.
"""

from __future__ import annotations

import math

import numpy as np

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.machine import Machine
from rotordrop.physics.contact import contact_tangent
from rotordrop.rotor.assembly import RotorFE, build_rotor_fe
from rotordrop.rotor.modes import free_free_modes, rigid_modes
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.statics import bearing_load_shares

PEAK_OVER_WEIGHT = 10.0
"""Usual ratio of the largest force of a drop to the static load [1]: 11 to 17 on machines of 13 to 130 kg."""


def contact_frequency(machine: Machine, fe: RotorFE | None = None) -> float:
    """Frequency [Hz] of rotor and support against each other in contact, of the stiffest bearing."""
    fe = build_rotor_fe(machine) if fe is None else fe
    rigid = rigid_modes(fe)
    found = []
    for bearing, share in zip(machine.touchdown_bearings, bearing_load_shares(machine, fe), strict=True):
        force = PEAK_OVER_WEIGHT * float(share)
        contact = contact_tangent(bearing.contact.law, force)
        stiffness = 1.0 / (1.0 / contact + 1.0 / numbers_of(bearing).tangent_stiffness(force))
        rotor = float(np.sum(rigid[2 * (bearing.node - 1)] ** 2))
        found.append(math.sqrt(stiffness * (rotor + 1.0 / float(bearing.support.mass))) / (2.0 * math.pi))
    return max(found)


def reduction_for_contact(machine: Machine, *, least: int, reach: float) -> Reduction:
    """Basis of a rotor with the modes below some multiple of its contact frequency.

    Parameters
    ----------
    machine : Machine
        The machine.
    least : int
        Modes it has at least, the two rigid ones included.
    reach : float
        The highest mode is not below this multiple of the contact frequency [1], where the rotor has it.
    """
    fe = build_rotor_fe(machine)
    frequency = free_free_modes(fe).frequency
    needed = int(np.searchsorted(frequency, reach * contact_frequency(machine, fe))) + 1
    return Reduction(modes=min(max(least, needed), fe.size), attachment=True)
