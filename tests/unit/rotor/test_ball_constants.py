"""What follows from the balls is found once for equal bearings, and anew for others."""

from __future__ import annotations

from rotordrop.elements.race_bearing import numbers_of
from rotordrop.machine import example_machine


def test_equal_bearings_share_their_constants_and_others_do_not():
    machine = example_machine("paper")
    first = numbers_of(machine.touchdown_bearings[0]).constants
    other_friction = machine.with_values({"NDE.friction.dynamic": 0.2}).touchdown_bearings[0]
    assert numbers_of(other_friction).constants is first
    preload = 1.2 * float(machine.touchdown_bearings[0].bearing.preload)
    loaded = machine.with_values({"NDE.preload": preload}).touchdown_bearings[0]
    assert numbers_of(loaded).constants is not first
    assert numbers_of(loaded).constants.axial_offset != first.axial_offset
