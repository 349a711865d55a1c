"""The settled tail gives the air gap; what it cannot tell is stated."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError, RecordError
from rotordrop.evidence.rest import LARGEST_SWAY, identify_air_gap, rest_of, resting_record
from rotordrop.record.axes import sensor_directions
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import sag_of_model


def gaps(model):
    return np.array([float(bearing.air_gap) for bearing in model.machine.touchdown_bearings])


def test_the_gap_is_found_and_moves_by_the_sag_of_its_support(rest, model, sensing):
    assert identify_air_gap(rest, model, sensing).value == pytest.approx(gaps(model), abs=0.1e-6)
    softer = model.with_values({"NDE.support.stiffness": 5e7})
    moved = identify_air_gap(rest, softer, sensing).value - identify_air_gap(rest, model, sensing).value
    load = float(model.load_shares[0])
    assert moved == pytest.approx([-load / 5e7 + load / 1e8, 0.0], abs=1e-12)
    assert sag_of_model(model).support == pytest.approx(np.asarray(model.load_shares) / [1e8, 4e8], rel=1e-12)


def test_sway_does_not_lift_the_rest_position(drop, sensing, rest):
    assert drop.tail is not None
    time = np.arange(3000) * 1e-3
    angle = 0.12 * np.sin(2.0 * np.pi * 29.0 * time)
    radius = rest.radius
    place = np.stack([np.outer(np.sin(angle), radius), np.outer(-np.cos(angle), radius)], axis=-1)
    along = np.einsum("sbc,tbc->ts", sensing.from_bearings, place) + sensing.settled_bend
    swaying = rest_of(replace(drop.tail, time=time, signals=along), sensing)
    assert swaying.radius == pytest.approx(radius, abs=1e-9)
    assert swaying.sway == pytest.approx(0.12 * radius, rel=0.01)
    resting = -sensing.from_bearings[..., 1] @ radius + sensing.settled_bend
    assert swaying.along == pytest.approx(resting, abs=1e-8)


def test_an_error_of_the_zero_reads_like_a_gap(rest, model, sensing, drop):
    vague = replace(sensing, offset_sigma=np.full(4, 10e-6))
    gap = identify_air_gap(rest, model, vague)
    assert gap.standard_error == pytest.approx([10e-6, 10e-6], rel=0.1)
    assert drop.tail is not None
    up = sensor_directions(drop.tail.sensors)[:, 1]
    shifted = replace(drop.tail, signals=drop.tail.signals - 5e-6 * up)
    gap = identify_air_gap(rest_of(shifted, sensing), model, sensing)
    assert gap.value == pytest.approx(gaps(model) + 5e-6, abs=0.1e-6)


def test_rest_is_standstill_of_tail_or_record(drop, truth, sensing):
    with pytest.raises(RecordError, match=r"shaft still turns at .* Hz .* ends at 0.06 s; .*settled tail"):
        resting_record(drop.record, None, truth)
    silent = replace(drop.record, speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(RecordError, match=r"has no measured shaft speed.*settled tail"):
        resting_record(silent, None, truth)
    assert drop.tail is not None
    floating = replace(drop.tail, signals=-drop.tail.signals)
    with pytest.raises(IdentificationError, match=r"not at rest on its bearings: mean height 2\d\d"):
        rest_of(floating, sensing)
    time = drop.tail.time
    whole = replace(
        drop.tail, speed_time=time, speed_readings=np.where(np.arange(len(time)) < 1000, 5.0, 0.0)
    )
    assert resting_record(whole, None, truth).time[0] == pytest.approx(float(time[1000]), abs=0.11)


def test_a_short_tail_says_how_little_it_knows_or_is_refused(drop, sensing):
    assert drop.tail is not None
    short: Record = drop.tail.window(float(drop.tail.time[0]), float(drop.tail.time[0]) + 0.1)
    with pytest.raises(IdentificationError, match=r"0.1 s of settled rotor; at least 0.2 s"):
        rest_of(short, sensing)
    # A tail of one block had no scatter and so no error; of two, nine in ten means lie within 6.3 errors.
    begin = float(drop.tail.time[0])
    part = drop.tail.window(begin, begin + 0.4)
    rest = rest_of(part, sensing)
    place = sensing.at_bearings(part.along - sensing.settled_bend)
    place[..., 0] -= place[..., 0].mean(axis=0)
    radius = np.array_split(np.hypot(place[..., 0], place[..., 1]), 2)
    halves = np.abs(radius[0].mean(axis=0) - radius[1].mean(axis=0))
    assert np.all(rest.standard_error > 0.0)
    assert rest.standard_error == pytest.approx(0.5 * halves * 6.3137515 / 1.6448536, rel=1e-6)


def test_a_rotor_that_swings_in_one_bearing_alone_is_not_at_rest(drop, sensing, rest):
    assert drop.tail is not None
    time = np.arange(4000) * 1e-3
    place = np.zeros((len(time), 2, 2))
    place[..., 1] = -rest.radius

    def tail():
        along = np.einsum("sbc,tbc->ts", sensing.from_bearings, place) + sensing.settled_bend
        return replace(drop.tail, time=time, signals=along)

    assert rest_of(tail(), sensing).radius == pytest.approx(rest.radius)
    place[:, 1, 0] = 1.5 * LARGEST_SWAY * rest.radius[1] * np.sin(2.0 * np.pi * 8.0 * time)
    with pytest.raises(IdentificationError, match=r"the rotor is not at rest on its bearings"):
        rest_of(tail(), sensing)
