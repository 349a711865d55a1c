"""When the impacts at a bearing began, told by its contacts."""

from __future__ import annotations

import math

import numpy as np

from rotordrop.estimate.bearing_drop import AirGap, BearingDrop, History, Impact, Motion, Origin, highest
from rotordrop.known import Known
from rotordrop.record.impacts import shortest_flight
from rotordrop.units import GRAVITY

GAP, RATE = 300e-6, 20000.0
FALL = math.sqrt(2.0 * GAP / GRAVITY)
CONTACT, HOP = 1e-3, 6e-3
"""How long every contact and the flight between two of them last [s]."""
BEGUN = (FALL, FALL + CONTACT + HOP)
"""When the two contacts begin [s]."""


def fallen(*contacts: tuple[float, float]) -> BearingDrop:
    """A rotor that falls, hops once and stays; with such contacts in its list [s]."""
    time = np.arange(0.0, 0.1, 1.0 / RATE)
    height = -0.5 * GRAVITY * time**2
    for begun in BEGUN:
        speed = GRAVITY * (FALL if begun == FALL else 0.5 * HOP)
        inside = (time >= begun) & (time < begun + CONTACT)
        phase = math.pi * (time[inside] - begun) / CONTACT
        height[inside] = -GAP - speed * CONTACT / math.pi * np.sin(phase)
        flown = time[time >= begun + CONTACT] - begun - CONTACT
        height[time >= begun + CONTACT] = -GAP + np.maximum(0.5 * GRAVITY * flown * (HOP - flown), 0.0)
    height[time >= BEGUN[1] + CONTACT] = -GAP
    nothing = Known(value=1.0, status="determined")
    force = History(label="estimated", time=time, values=1.0 + time)
    peak = highest(force, "N", Origin.TWIN)
    return BearingDrop(
        name="NDE",
        motions=(Motion(label="estimated", time=time, displacement=np.stack([0.0 * time, height], axis=1)),),
        air_gap=AirGap.of(GAP),
        force=force,
        stress=force,
        peak_force=peak,
        peak_stress=peak,
        impacts=tuple(
            Impact(
                start=start,
                end=end,
                azimuth=0.0,
                peak_time=start,
                peak_force=nothing,
                impulse=nothing,
                dissipated_energy=nothing,
            )
            for start, end in contacts
        ),
    )


def test_an_impact_ends_a_flight_between_contacts() -> None:
    """By the contacts, which the estimate knows better than its displacement shows them."""
    first, second = BEGUN
    listed = fallen((first, first + CONTACT), (second, second + CONTACT))
    assert listed.touched.tolist() == [first, second]
    assert listed.contact_from == second
    chatter = shortest_flight(GAP) - 0.1e-3
    bounced = fallen((first, first + CONTACT), (first + CONTACT + chatter, second), (second + HOP, math.nan))
    assert bounced.after_flight == (True, False, True)
    assert bounced.contact_from == second + HOP


def test_without_contacts_no_impact_is_told() -> None:
    assert fallen().touched.tolist() == [] and fallen().contact_from is None
