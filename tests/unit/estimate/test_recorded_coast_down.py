"""A recorded coast-down counts from the centre of the bearing, wherever the rotor floated before."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop import look
from rotordrop.estimate.coast_down import recorded_coast_down, with_found_air_gaps
from rotordrop.spectrum.candidates import machine_candidates, swing_ranges
from rotordrop.spectrum.coast_down import displacement_history, find_settling

# Of the bundled recording, which is simulated: the DE floats 26.5 µm below the centre of its bearing.
TRUE_GAP = {"NDE": 275e-6, "DE": 285e-6}
TRUE_LARGEST = {"NDE": 306.7e-6, "DE": 308.6e-6}


@pytest.fixture(scope="module")
def signal(machine, whole_drop):
    return recorded_coast_down(machine, whole_drop)


def displaced(record, sideways):
    """The record with all sensors reading a distance [m] aside, as with zeros that are off."""
    angle = np.array([float(sensor.angle) for sensor in record.sensors])
    return replace(record, signals=record.signals + sideways * np.cos(angle))


def test_the_gap_is_that_of_the_estimate_and_handed_on(machine, whole_drop, signal):
    for name, moved in signal.planes.items():
        # The vertical zeros of the sensors are off by up to 7 µm, which the tail cannot tell from the gap.
        assert signal.air_gap[name] == pytest.approx(TRUE_GAP[name], abs=9e-6)
        assert abs(signal.air_gap[name] - TRUE_GAP[name]) < 1.65 * signal.air_gap_error[name]
        found = displacement_history(
            moved, signal.sampling_rate, air_gap=signal.air_gap[name], start_time=signal.start_time
        )
        beyond = TRUE_LARGEST[name] - TRUE_GAP[name]
        assert found.largest_indentation == pytest.approx(beyond, abs=3e-6)
    assert found.largest == pytest.approx(TRUE_LARGEST["DE"], abs=1.5e-6)
    assert found.largest_time == pytest.approx(8.9e-3, abs=0.4e-3)
    # The interval is that of a normal error on both sides; a search may not leave it.
    for name, gap in signal.air_gap.items():
        found = with_found_air_gaps(machine, signal).bearing(name).air_gap
        half = 1.6448536 * signal.air_gap_error[name]
        assert float(found) == gap and found.status == "estimated"
        assert found.interval_90 == pytest.approx((gap - half, gap + half), rel=1e-6)
        assert (found.lower, found.upper) == pytest.approx((gap - half, gap + half), rel=1e-6)
    rough = replace(signal, air_gap_error=dict(signal.air_gap))
    for name, gap in signal.air_gap.items():
        assert with_found_air_gaps(machine, rough).bearing(name).air_gap.lower == 0.5 * gap


def test_neither_level_nor_swing_matter_and_time_counts_from_power_off(machine, whole_drop, signal):
    """One that was given by hand says from where the rotor fell, not how it slowed down."""
    time, speed = whole_drop.measured_speed
    np.testing.assert_array_equal(signal.speed, speed)
    assert np.ptp(time - signal.speed_time) < 1e-9
    falling = signal.start_time + np.arange(signal.planes["DE"].shape[0]) / signal.sampling_rate
    off = time[0] - signal.speed_time[0]
    assert whole_drop.time[whole_drop.time >= off][0] - off == pytest.approx(falling[0], abs=1e-9)
    assert signal.profile is not None
    assert signal.profile.speed_at([0.0])[0] == pytest.approx(2.0 * np.pi * 60.0, rel=2e-3)
    by_hand = recorded_coast_down(machine, replace(whole_drop, speed_by_hand=True))
    assert (by_hand.speed, by_hand.speed_time, by_hand.profile) == (None, None, None)
    aside = recorded_coast_down(machine, displaced(whole_drop, 30e-6))
    for name, moved in signal.planes.items():
        assert aside.planes[name][:] == pytest.approx(moved[:], abs=1e-9)
        assert aside.air_gap[name] == pytest.approx(signal.air_gap[name], abs=1e-9)
    for name, moved in signal.planes.items():
        settled = find_settling(
            moved, signal.sampling_rate, air_gap=signal.air_gap[name], start_time=signal.start_time
        )
        assert 2 <= len(settled.touched) <= 8
        assert 0.015 < settled.contact_from < 0.06


def test_probes_on_a_gap_voltage_show_the_same_gap(machine, whole_drop, signal):
    moved = recorded_coast_down(machine, replace(whole_drop, signals=whole_drop.signals - 1.2e-3))
    for name, gap in moved.air_gap.items():
        assert gap == pytest.approx(signal.air_gap[name], abs=1.65 * moved.air_gap_error[name])


def test_impacts_are_those_of_a_look_at_the_record(machine, whole_drop, signal):
    """One circle, one rule: counts, times and their intervals are the same, from power-off on."""
    looked = look(whole_drop, machine=machine)
    off = looked.planes[0].settling.touched[0] - signal.settling["NDE"].touched[0]
    for plane in looked.planes:
        found = signal.settling[plane.plane]
        assert found.touched + off == pytest.approx(plane.settling.touched, abs=1e-9)
        assert found.count_interval_90 == plane.settling.count_interval_90
        assert found.contact_from + off == pytest.approx(plane.settling.contact_from, abs=1e-9)
        begun = plane.settling.contact_from_interval_90
        assert np.add(found.contact_from_interval_90, off) == pytest.approx(begun, abs=1e-9)


def test_pendulum_length_and_plane_follow_from_the_found_gap(machine, whole_drop, signal):
    found = with_found_air_gaps(machine, signal)
    swings = {swing.bearing: swing for swing in swing_ranges(found)}
    assert swings["DE"].length == pytest.approx(287.3e-6, abs=2e-6)
    assert swings["DE"].small == pytest.approx(29.4, abs=0.1)
    assert swings["DE"].lowest < 28.8 < 29.4 < swings["DE"].highest
    named = {c.name: c.planes for c in machine_candidates(found, {name: name for name in signal.planes})}
    assert named["pendulum NDE"] == ("NDE",)
    assert named["pendulum DE"] == ("DE",)


def cut(record, seconds):
    """The record until so long after the nominal power-off [s]."""
    early = record.time < seconds
    speed = None if record.speed is None else record.speed[early]
    return replace(record, time=record.time[early], signals=record.signals[early], speed=speed)


def test_a_record_that_ends_too_early_says_what_its_centre_is(machine, whole_drop):
    signal = recorded_coast_down(machine, cut(whole_drop, 0.3))
    for name, gap in signal.air_gap.items():
        assert abs(gap - TRUE_GAP[name]) < min(1.65 * signal.air_gap_error[name], 20e-6)
    assert recorded_coast_down(machine, displaced(cut(whole_drop, 0.3), 20e-6)).air_gap == pytest.approx(
        signal.air_gap, abs=1e-6
    )
    signal = recorded_coast_down(machine, cut(whole_drop, 7e-3))
    assert signal.air_gap == {"NDE": 250e-6, "DE": 250e-6}
    assert signal.air_gap_error is None
    assert with_found_air_gaps(machine, signal) is machine
