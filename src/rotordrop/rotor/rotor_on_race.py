"""Pressure between rotor and race: the shaft in the bore of the inner race as a line contact."""

from __future__ import annotations

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.physics.hertz import LineContact, compliance, cylinder_in_bore


def rotor_on_race(machine: Machine, bearing: TouchdownBearing) -> LineContact:
    """Line contact of the rotor with the race of one touchdown bearing, over the width of the race.

    The rotor is of the material of the shaft at the bearing's node, the race of that of the rings.
    """
    beside = machine.rotor.elements[max(0, bearing.node - 2)]
    eta = compliance(beside.youngs_modulus, beside.poisson_ratio, *numbers_of(bearing).ring_material)
    bore = float(bearing.bore_radius)
    return cylinder_in_bore(bore - float(bearing.air_gap), bore, float(bearing.race.width), eta)
