"""When the impacts at a bearing began, told by its contacts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.estimate.bearing_drop import (
    AirGap,
    Band,
    BearingDrop,
    History,
    Impact,
    Motion,
    Origin,
    highest,
    published_bearing,
    when_largest,
)
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


def test_a_peak_may_be_wherever_the_force_may_be_largest() -> None:
    """Two impacts of 100 and 96 N: errors of 5 N leave open which was larger, of 1 N do not."""
    time = np.arange(0.0, 0.05, 1e-4)
    values = sum(size * np.exp(-(((time - at) / 1e-3) ** 2)) for size, at in ((100.0, 0.01), (96.0, 0.03)))
    force = History(label="estimated", time=time, values=values)

    def within(error: float, doubt: float = 0.0) -> tuple[float, float]:
        return when_largest(force, Band(time=time, lower=values - error, upper=values + error), doubt)

    low, high = within(5.0)
    assert 0.009 < low < 0.01 and 0.03 <= high < 0.031
    low, high = within(1.0)
    # a share of √2 % below the top lies √(√2 %) widths beside it
    assert (low, high) == pytest.approx((0.01 - 0.119e-3, 0.01 + 0.119e-3), abs=0.5e-4)
    assert within(1.0, 1e-3) == pytest.approx((0.009, 0.011), abs=0.02e-3)


def test_times_and_counts_are_published_with_their_intervals() -> None:
    drop = fallen((BEGUN[0], BEGUN[0] + CONTACT))
    plain = published_bearing(drop).model_dump(exclude_none=True)
    assert not {"impacts_interval_90", "contact_from_interval_90_s"} & plain.keys()
    peak = replace(drop.peak_force, time_interval_90=(0.01, 0.02))
    known = replace(drop, peak_force=peak, count_interval_90=(1, 3), contact_from_interval_90=(0.007, 0.03))
    told = published_bearing(known).model_dump(exclude_none=True)
    assert told["peak_force_N"]["time_interval_90_s"] == [0.01, 0.02]
    assert told["impacts_interval_90"] == [1, 3]
    assert told["contact_from_interval_90_s"] == [0.007, 0.03]
