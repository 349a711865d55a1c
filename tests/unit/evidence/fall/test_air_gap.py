"""The settled tail gives the air gap; what it cannot tell is stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError, RecordError
from rotordrop.evidence.rest import LARGEST_SWAY, Rest, identify_air_gap, rest_of, resting_record
from rotordrop.evidence.sensing import Sensing
from rotordrop.machine import Machine
from rotordrop.record.axes import sensor_directions
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import DropModel, sag_of_model
from rotordrop_bench import SyntheticDrop


def gaps(model: DropModel) -> np.ndarray:
    return np.array([float(bearing.air_gap) for bearing in model.machine.touchdown_bearings])


def test_air_gap_is_found_to_a_tenth_of_a_micrometre(rest: Rest, model: DropModel, sensing: Sensing) -> None:
    assert identify_air_gap(rest, model, sensing).value == pytest.approx(gaps(model), abs=0.1e-6)


def test_gap_moves_by_the_sag_of_another_support(rest: Rest, model: DropModel, sensing: Sensing) -> None:
    softer = model.with_values({"NDE.support.stiffness": 5e7})
    moved = identify_air_gap(rest, softer, sensing).value - identify_air_gap(rest, model, sensing).value
    load = float(model.load_shares[0])
    assert moved == pytest.approx([-load / 5e7 + load / 1e8, 0.0], abs=1e-12)


def test_vertical_zero_of_the_sensors_reads_like_a_gap(
    drop: SyntheticDrop, model: DropModel, sensing: Sensing
) -> None:
    assert drop.tail is not None
    up = sensor_directions(drop.tail.sensors)[:, 1]
    shifted = replace(drop.tail, signals=drop.tail.signals - 5e-6 * up)
    gap = identify_air_gap(rest_of(shifted, sensing), model, sensing)
    assert gap.value == pytest.approx(gaps(model) + 5e-6, abs=0.1e-6)


def test_sway_does_not_lift_the_rest_position(drop: SyntheticDrop, sensing: Sensing, rest: Rest) -> None:
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


def test_sag_is_load_over_stiffness_in_the_support(model: DropModel) -> None:
    assert sag_of_model(model).support == pytest.approx(np.asarray(model.load_shares) / [1e8, 4e8], rel=1e-12)


def test_limits_enclose_the_gap_and_zero_error_dominates(
    rest: Rest, model: DropModel, sensing: Sensing
) -> None:
    vague = replace(sensing, offset_sigma=np.full(4, 10e-6))
    gap = identify_air_gap(rest, model, vague)
    assert np.all(gap.lower <= gap.value) and np.all(gap.value <= gap.upper)
    assert gap.standard_error == pytest.approx([10e-6, 10e-6], rel=0.1)


def test_record_that_ends_while_the_shaft_turns_is_no_rest(drop: SyntheticDrop, truth: Machine) -> None:
    with pytest.raises(RecordError, match=r"shaft still turns at .* Hz .* ends at 0.06 s; .*settled tail"):
        resting_record(drop.record, None, truth)


def test_record_without_speed_is_no_rest(drop: SyntheticDrop, truth: Machine) -> None:
    silent = replace(drop.record, speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(RecordError, match=r"has no measured shaft speed.*settled tail"):
        resting_record(silent, None, truth)


def test_standstill_at_the_end_of_the_record_serves_as_tail(drop: SyntheticDrop, truth: Machine) -> None:
    assert drop.tail is not None
    time = drop.tail.time
    whole = replace(
        drop.tail, speed_time=time, speed_readings=np.where(np.arange(len(time)) < 1000, 5.0, 0.0)
    )
    assert resting_record(whole, None, truth).time[0] == pytest.approx(float(time[1000]), abs=0.11)


def test_short_tail_is_refused(drop: SyntheticDrop, sensing: Sensing) -> None:
    assert drop.tail is not None
    short: Record = drop.tail.window(float(drop.tail.time[0]), float(drop.tail.time[0]) + 0.1)
    with pytest.raises(IdentificationError, match=r"0.1 s of settled rotor; at least 0.2 s"):
        rest_of(short, sensing)


def test_a_short_tail_says_how_little_it_knows(drop: SyntheticDrop, sensing: Sensing) -> None:
    """A tail of one block had no scatter and so no error; of two, nine in ten means lie within 6.3 errors."""
    assert drop.tail is not None
    begin = float(drop.tail.time[0])
    rest = rest_of(drop.tail.window(begin, begin + 0.4), sensing)
    halves = rest.radius_upper - rest.radius_lower
    assert np.all(rest.standard_error > 0.0)
    assert rest.standard_error == pytest.approx(0.5 * halves * 6.3137515 / 1.6448536, rel=1e-6)


def test_levitated_rotor_is_no_rest(drop: SyntheticDrop, sensing: Sensing) -> None:
    assert drop.tail is not None
    floating = replace(drop.tail, signals=-drop.tail.signals)
    with pytest.raises(IdentificationError, match=r"not at rest on its bearings: mean height 2\d\d"):
        rest_of(floating, sensing)


def test_a_rotor_that_swings_in_one_bearing_alone_is_not_at_rest(
    drop: SyntheticDrop, sensing: Sensing, rest: Rest
) -> None:
    assert drop.tail is not None
    time = np.arange(4000) * 1e-3
    place = np.zeros((len(time), 2, 2))
    place[..., 1] = -rest.radius

    def tail() -> Record:
        assert drop.tail is not None
        along = np.einsum("sbc,tbc->ts", sensing.from_bearings, place) + sensing.settled_bend
        return replace(drop.tail, time=time, signals=along)

    assert rest_of(tail(), sensing).radius == pytest.approx(rest.radius)
    place[:, 1, 0] = 1.5 * LARGEST_SWAY * rest.radius[1] * np.sin(2.0 * np.pi * 8.0 * time)
    with pytest.raises(IdentificationError, match=r"the rotor is not at rest on its bearings"):
        rest_of(tail(), sensing)
