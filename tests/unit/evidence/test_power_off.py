"""Power-off of records without a levitated part, and of records with a plane that lost a sensor."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rotordrop.errors import RecordError
from rotordrop.evidence.events import DropInstant, sinking
from rotordrop.evidence.evidence import Evidence
from rotordrop.machine import example_machine, load_machine
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.rotors import bench_rotor

LONG_ROTOR = Path(__file__).parents[2] / "machines" / "long_rotor.toml"


def power_off(record, machine):
    return Evidence(record=record, machine=machine).power_off


@pytest.fixture(scope="module")
def drop():
    machine = example_machine("lp400")
    return machine, synthesize_drop(
        hidden_machine(machine, 71), 2.0 * math.pi * 100.0, 71, duration=0.05, tail=False
    )


def from_time(record, start):
    keep = record.time >= start
    return replace(record, time=record.time[keep], signals=record.signals[keep], speed=record.speed[keep])


@pytest.mark.parametrize("late", [0.0, 1e-3, 2.5e-3])
def test_a_record_that_begins_with_the_fall_gives_power_off_to_its_stated_error(drop, late):
    machine, made = drop
    true = made.truth["t_off_in_record_s"]
    found = power_off(from_time(made.record, true + late), machine)
    assert not isinstance(found, DropInstant)
    assert abs(found.value - true) < 2.5 * found.standard_error
    assert found.standard_error < 2e-3
    assert "no levitated part" in found.notes[0]
    assert 3e-3 < found.contact - true < 12e-3


def test_a_record_with_levitation_is_read_as_before(drop):
    machine, made = drop
    assert isinstance(power_off(made.record, machine), DropInstant)


def test_a_record_that_begins_just_before_contact_is_refused(drop):
    machine, made = drop
    late = from_time(made.record, made.truth["t_off_in_record_s"] + 6e-3)
    with pytest.raises(RecordError, match=r"pre-trigger|no drop in the record"):
        power_off(late, machine)


def test_a_plane_that_lost_a_sensor_is_left_out(drop):
    _, made = drop
    record = made.record
    keep = [0, 2, 3]
    three = replace(
        record,
        signals=np.ascontiguousarray(record.signals[:, keep]),
        sensors=tuple(record.sensors[i] for i in keep),
    )
    assert three.whole.signals.shape[1] == 2 and len(three.whole.planes) == 1
    assert record.whole is record and len(record.planes) == 2
    one = replace(three, signals=three.signals[:, :1], sensors=three.sensors[:1])
    with pytest.raises(RecordError, match="has one sensor"):
        _ = one.whole.planes


def test_a_plane_that_circles_widely_while_levitated_does_not_begin_the_fall():
    """Between the bearings, near a bending critical speed, an orbit may be as wide as a third of the gap."""
    low = np.zeros((1000, 3), dtype=bool)
    low[10:700:7, 2] = True  # once a turn
    low[800:, 0] = low[806:, 1] = low[792:, 2] = True
    assert sinking(low) == 792
    assert sinking(low[800:]) == 0
    assert sinking(low[:, :2]) == 800


def test_power_off_of_a_long_rotor_that_circles_widely_at_mid_span():
    """Three planes, 217 micrometres from side to side at the third: taken for a record without levitation."""
    machine = load_machine(LONG_ROTOR)
    made = synthesize_drop(
        hidden_machine(machine, 41), 2.0 * math.pi * 140.0, 4101, duration=0.05, tail=False, tolerance=1e-6
    )
    found = power_off(made.record, machine)
    assert abs(found.value - made.truth["t_off_in_record_s"]) < 3.0 * found.standard_error < 1e-4


@pytest.mark.parametrize(("seed", "speed"), [(81102, 179.1), (81152, 129.2)])
def test_the_lowest_of_several_minima_is_the_power_off(seed, speed):
    """Another explains the whole fall at noise level, 0.7 to 1.2 ms before, by forces of no magnet."""
    hidden = hidden_machine(bench_rotor("30 kg"), seed)
    chain = SensorChain(sampling_rate=20e3, noise=0.4e-6)
    made = synthesize_drop(
        hidden, 2.0 * math.pi * speed, seed, sensor_chain=chain, duration=0.05, before=0.15, tail=False
    )
    found = power_off(made.record, bench_rotor("30 kg"))
    assert abs(found.value - made.truth["t_off_in_record_s"]) < 3.0 * found.standard_error < 2e-4
