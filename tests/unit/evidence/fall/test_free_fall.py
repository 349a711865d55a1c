"""A free fall, the first contact that ends it, and the sensors, speed and angle that show it."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop import Known
from rotordrop.errors import IdentificationError
from rotordrop.evidence.contacts import (
    contact_intervals,
    corrected_stiffness,
    equivalent_stiffness,
    identify_first_contacts,
)
from rotordrop.evidence.evidence import Evidence
from rotordrop.evidence.free_rotor import held_by
from rotordrop.evidence.sensing import build_sensing
from rotordrop.replay.replay import expand_initial_state, expansion_matrix
from rotordrop.rotor.statics import rest_on
from rotordrop.track.problem import sensor_rows

SPEED = 2.0 * np.pi * 150.0


def test_the_rotor_is_held_by_its_magnets_or_else_at_its_sensor_planes(model, drop):
    machine, planes = model.machine, drop.record.planes
    held = held_by(machine, planes, model.fe)
    assert held.nodes == tuple(amb.node for amb in machine.ambs)
    beside = held_by(machine.changed(ambs=()), planes, model.fe)
    assert not beside.by_magnets
    assert beside.nodes == tuple(plane.node for plane in planes)
    assert beside.lift == pytest.approx(rest_on(model.fe, beside.nodes, 9.81)[1])
    one = held_by(machine.changed(ambs=()), planes[:1], model.fe)
    assert one.nodes == tuple(bearing.node for bearing in machine.touchdown_bearings)


GAP, MASS, TURNING, GRAVITY = 250e-6, 40.0, 0.07, 9.81


def spring_contact(stiffness):
    """Time, radius, begin and end of the contact of a mass that hits a spring at the air gap."""
    omega = math.sqrt(stiffness / MASS)
    begin = 5e-3
    duration = (2.0 / omega) * (math.pi - math.atan(omega * TURNING / GRAVITY))
    time = np.arange(0.0, 0.02, 5e-5)
    t = time - begin
    inside = TURNING / omega * np.sin(omega * t) + GRAVITY / omega**2 * (1.0 - np.cos(omega * t))
    before = TURNING * t + 0.5 * GRAVITY * t**2
    after = -TURNING * (t - duration) + 0.5 * GRAVITY * (t - duration) ** 2
    beyond = np.where(t < 0.0, before, np.where(t < duration, inside, after))
    return time, GAP + beyond, begin, begin + duration


@pytest.mark.parametrize("stiffness", [5e6, 5e7, 4e8])
def test_contact_of_a_mass_on_a_spring_returns_its_stiffness(stiffness):
    time, radius, begin, end = spring_contact(stiffness)
    place = np.stack([np.zeros_like(radius), -radius], axis=-1)[:, None, :]
    (found,) = identify_first_contacts(
        time, place, np.array([GAP]), np.array([MASS * GRAVITY]), GRAVITY, 0.45e-6
    )
    assert found.start == pytest.approx(begin, abs=3e-6)
    assert found.end == pytest.approx(end, abs=3e-6)
    assert found.impact_speed == pytest.approx(TURNING, rel=1e-3)
    assert found.corrected_stiffness == pytest.approx(stiffness, rel=0.02)
    assert found.equivalent_stiffness < found.corrected_stiffness
    assert found.indentation == pytest.approx(radius.max() - GAP, abs=1e-12)


def test_equivalent_stiffness_is_eq_17():
    assert equivalent_stiffness(2e-3, 40.0) == pytest.approx(40.0 * (math.pi / 2e-3) ** 2, rel=1e-14)


def test_correction_vanishes_without_gravity():
    assert corrected_stiffness(2e-3, 40.0, 0.07, 1e-9) == pytest.approx(
        equivalent_stiffness(2e-3, 40.0), rel=1e-6
    )


@pytest.mark.parametrize("speed", [0.0, -2e-3])
def test_a_mass_laid_down_bounces_for_a_whole_period(speed):
    """A grazing contact, whose approach noise makes a departure, ended in a bare ValueError."""
    assert corrected_stiffness(2e-3, 40.0, speed, 9.81) == pytest.approx(40.0 * (2.0 * math.pi / 2e-3) ** 2)


def test_standard_error_follows_from_the_timing():
    time, radius, _, _ = spring_contact(5e7)
    place = np.stack([radius, np.zeros_like(radius)], axis=-1)[:, None, :]
    (found,) = identify_first_contacts(
        time, place, np.array([GAP]), np.array([MASS * GRAVITY]), GRAVITY, 1e-6
    )
    timing = math.hypot(5e-5 / math.sqrt(12.0), 1e-6 / found.impact_speed)
    assert found.timing_error == pytest.approx(timing, rel=1e-9)
    relative = 2.0 * math.sqrt(2.0) * timing / found.duration
    assert found.standard_error == pytest.approx(relative * found.equivalent_stiffness, rel=1e-9)


def test_intervals_list_every_contact_and_no_contact_is_refused():
    time = np.arange(0.0, 0.04, 5e-5)
    radius = GAP - 20e-6 + 40e-6 * np.sin(2.0 * np.pi * 100.0 * time) ** 2
    radius += np.random.default_rng(0).normal(0.0, 0.2e-6, len(time))
    intervals = contact_intervals(time, radius, GAP)
    assert len(intervals) == 8
    assert intervals[:, 1] - intervals[:, 0] == pytest.approx(np.full(8, 2.5e-3), abs=1e-4)
    time = np.arange(0.0, 0.01, 5e-5)
    radius = GAP + np.where(time < 5e-3, -50e-6, 10e-6)
    intervals = contact_intervals(time, radius, GAP)
    assert intervals == pytest.approx(np.array([[5e-3, time[-1]]]), abs=6e-5)
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = -100e-6
    with pytest.raises(IdentificationError, match=r"comes to 100 µm .* never reaches the air gap of 250 µm"):
        identify_first_contacts(time, place, np.array([GAP]), np.array([400.0]), GRAVITY, 1e-6)
    place[:, 0, 1] = np.where(time < 5e-3, -200e-6, -300e-6)
    with pytest.raises(IdentificationError, match=r"stays beyond the air gap of 250 µm from 5.*ms"):
        identify_first_contacts(time, place, np.array([GAP]), np.array([400.0]), GRAVITY, 1e-6)


def straight_rotor(model, sensors):
    """Displacements along the sensors and at the bearings of a rotor shifted and tilted in both planes."""
    z = np.asarray(model.fe.node_positions)

    def place(node):
        return np.array([20e-6 + 30e-6 * z[node - 1], -100e-6 + 50e-6 * z[node - 1]])

    along = []
    for sensor in sensors:
        angle = float(sensor.angle)
        direction = sensor.polarity * np.array([np.cos(angle), np.sin(angle)])
        along.append(direction @ place(sensor.node))
    return np.array(along), np.array([place(b.node) for b in model.machine.touchdown_bearings])


def test_the_rotor_is_found_by_its_sensors_at_any_angle_and_back(model, truth, sensing):
    along, at_bearings = straight_rotor(model, truth.sensors)
    assert sensing.at_bearings(along) == pytest.approx(at_bearings, abs=1e-15)
    odd = tuple(
        sensor.changed(angle=angle, polarity=polarity)
        for sensor, angle, polarity in zip(
            truth.sensors, ("10 deg", "75 deg", "-120 deg", "160 deg"), (1, -1, -1, 1), strict=True
        )
    )
    along, at_bearings = straight_rotor(model, odd)
    assert build_sensing(model, odd).at_bearings(along) == pytest.approx(at_bearings, abs=1e-15)
    along, at_bearings = straight_rotor(model, truth.sensors)
    assert np.einsum("sbc,bc->s", sensing.from_bearings, at_bearings) == pytest.approx(along, abs=1e-15)


def test_what_the_file_says_of_a_sensor_is_its_uncertainty(model, truth):
    """A guess lies in its range, an estimate in its interval; the range of a default is what is thinkable."""
    half = 1.6448536269514722
    gains = (
        Known(value=1.0, status="guess", range=(0.94, 1.06)),
        Known(value=1.0, status="estimated", interval_90=(0.97, 1.03)),
        Known(value=1.0, status="estimated", standard_error=0.004),
        Known(value=1.0, status="default", range=(0.94, 1.06)),
    )
    sensors = tuple(
        sensor.model_copy(update={"gain": gain, "offset": replace(gain, value=0.0)})
        for sensor, gain in zip(truth.sensors, gains, strict=True)
    )
    sensing = build_sensing(model, sensors)
    expected = [0.06 / half, 0.03 / half, 0.004]
    assert sensing.gain_sigma == pytest.approx([*expected, 0.01], rel=1e-3)
    gap = min(float(bearing.air_gap) for bearing in model.machine.touchdown_bearings)
    assert sensing.offset_sigma == pytest.approx([*expected, 0.04 * gap], rel=1e-3)


def test_what_the_sensors_do_not_resolve_is_refused(model, truth, sensing):
    one_plane = tuple(sensor.model_copy(update={"node": 5}) for sensor in truth.sensors)
    with pytest.raises(
        IdentificationError, match=r"S_DE_A at node 5 .* shows .* of the strongest, at least 0.05"
    ):
        build_sensing(model, one_plane)
    with pytest.raises(IdentificationError, match=r"4 sensors cannot tell 3 modes per plane apart"):
        expansion_matrix(sensing.rows, 3)
    rows = sensing.rows.copy()
    rows[2:] = rows[:2]
    with pytest.raises(IdentificationError, match=r"smallest singular value .*e-[1-3]\d, at least 0.02"):
        expansion_matrix(rows, 2)


def test_modal_expansion_misses_the_sag_of_the_levitated_rotor(drop, model):
    rows = sensor_rows(model)
    time = drop.record.time - drop.truth["t_off_in_record_s"]
    expanded = expand_initial_state(time, drop.record.along, rows, model)
    missed = np.abs(expanded.at_bearings[0] - drop.result.displacement[0]).max()
    assert 0.2e-6 < missed < 6e-6
    assert not np.any(expanded.amplitudes[:, 2:])


def test_expansion_matrix_returns_rigid_amplitudes(sensing):
    m = sensing.rows.shape[1] // 2
    amplitudes = np.zeros(2 * m)
    amplitudes[[0, 1, m, m + 1]] = [3e-5, -2e-5, 1e-4, 4e-5]
    found = expansion_matrix(sensing.rows, 2) @ (sensing.rows @ amplitudes)
    assert found == pytest.approx([3e-5, -2e-5, 1e-4, 4e-5], rel=1e-12)


INITIAL = 2.0 * np.pi * 60.0


def test_the_speed_at_the_drop_is_that_before_it_and_of_its_orbit(drop, model):
    time = np.arange(-0.25, 2.0, 0.01)
    read = INITIAL * np.exp(-np.maximum(time, 0.0) / 9.0) + np.random.default_rng(2).normal(
        0.0, 0.1, len(time)
    )
    record = replace(drop.record, speed_time=time, speed_readings=read)

    def speed(turning):
        levitated = None if turning is None else SimpleNamespace(frequency=turning / (2.0 * np.pi))
        told = {"power_off": SimpleNamespace(value=0.0), "levitated": levitated}
        return Evidence(record=record, machine=model.machine).with_facts(**told).speed.value

    assert speed(None) == pytest.approx(INITIAL, abs=0.3)
    assert speed(INITIAL + 0.01) == pytest.approx(INITIAL + 0.01, rel=1e-12)
    assert speed(2.0 * INITIAL) == speed(None)
