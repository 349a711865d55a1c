"""A free fall, the first contact that ends it, and the sensors, speed and angle that show it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop import Known, build_drop_model, simulate_drop
from rotordrop.elements.load import Load
from rotordrop.errors import IdentificationError
from rotordrop.evidence.contacts import (
    contact_intervals,
    corrected_stiffness,
    equivalent_stiffness,
    identify_first_contacts,
)
from rotordrop.evidence.free_rotor import held_by, motion_of
from rotordrop.evidence.initial_state import build_free_fall, kernel_state
from rotordrop.evidence.sensing import build_sensing
from rotordrop.evidence.speed import identify_speed
from rotordrop.replay.modal_expansion import expansion_matrix
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.statics import levitated_sag, rest_on
from rotordrop.simulate.case import DropCase, LevitatedStart, StateStart
from rotordrop.simulate.levitation import levitated_orbit, start_of_drop

SPEED = 2.0 * np.pi * 150.0


@pytest.mark.parametrize("direction", [0.0, 0.5 * np.pi, -2.5])
def test_a_load_and_gravity_change_the_momentum_of_a_falling_rotor(truth, direction):
    """Newton's second law of the whole rotor, wherever the load acts and however it bends it."""
    load = Load(node=9, direction=f"{direction} rad", force="60 N")
    model = build_drop_model(truth.model_copy(update={"loads": (load,)}), Reduction(modes=6, attachment=True))
    fall = build_free_fall(model, SPEED, (8, 22))
    rates = fall.system[fall.velocity, fall.one].reshape(2, fall.n_modes)
    momentum = model.fe.rigid_shapes[:, 0] @ model.fe.mass @ model.basis.shapes
    weight = truth.rotor.mass * 9.81
    expected = (60.0 * np.cos(direction), 60.0 * np.sin(direction) - weight)
    assert rates @ momentum == pytest.approx(expected, rel=1e-6)


def test_fall_agrees_with_the_compiled_drop_to_the_first_contact(model):
    force = np.array([[5.0, 40.0], [-8.0, 90.0]])
    start = LevitatedStart(rotor_angle=0.7, remanent_force=force, remanence_time_constant=1.8e-3)
    case = DropCase(speed=SPEED, duration=5e-3, tolerance=1e-10, start=start, spin="coasting")
    result = simulate_drop(model, case)
    initial, parameters = start_of_drop(model, case)
    nodes = tuple(unbalance.node for unbalance in model.machine.unbalances)
    fall = build_free_fall(model, SPEED, nodes)
    state = np.zeros(fall.size)
    layout = model.layout
    state[fall.displacement] = np.concatenate([initial[layout.modal_x], initial[layout.modal_y]])
    state[fall.velocity] = np.concatenate(
        [initial[layout.velocity_of(layout.modal_x)], initial[layout.velocity_of(layout.modal_y)]]
    )
    state[fall.one] = 1.0
    state[fall.remanent] = force.ravel()
    turned = [
        float(u.amount) * np.exp(1j * (float(u.phase) + 0.5 * np.pi + 0.7)) for u in model.machine.unbalances
    ]
    state[fall.unbalance] = np.array([(u.real, u.imag) for u in turned]).ravel()
    later = fall.transition(1.8e-3, 5e-3) @ state
    expected = result.state[-1]
    expected_place = np.concatenate([expected[layout.modal_x], expected[layout.modal_y]])
    assert not len(result.contacts)
    assert later[fall.displacement] == pytest.approx(expected_place, abs=1e-11)
    assert parameters.flags[1] == 1


def test_orbit_columns_solve_the_levitated_rotor(model):
    orbit = levitated_orbit(model, SPEED)
    p = model.parameters
    nodes = tuple(unbalance.node for unbalance in model.machine.unbalances)
    fall = build_free_fall(model, SPEED, nodes)
    forward, backward = fall.orbit()
    turned = [float(u.amount) * np.exp(1j * (float(u.phase) + 0.5 * np.pi)) for u in model.machine.unbalances]
    at_magnets = p.magnet_shape @ orbit[:, 0]
    held = -(p.magnet[:, 4] + 1j * SPEED * p.magnet[:, 5]) * at_magnets
    found = forward @ np.array([*turned, *held])
    assert found.real == pytest.approx(orbit[:, 0].real, abs=1e-14)
    assert found.imag == pytest.approx(orbit[:, 1].real, abs=1e-14)
    # an orbit against the spin: what the motion by itself leaves of its rates is the force that holds it
    turning = np.vstack([backward, -1j * SPEED * backward])
    left = -1j * SPEED * turning - motion_of(model.basis, SPEED) @ turning
    assert left[: model.basis.size] == pytest.approx(0.0, abs=1e-15)
    assert left[model.basis.size :] == pytest.approx(p.magnet_shape.T, abs=1e-9)


def test_an_unbalance_keeps_its_place(model):
    fall = build_free_fall(model, SPEED, (8, 22))
    state = np.zeros(fall.size)
    state[fall.unbalance] = [2e-6, 1e-6, -3e-6, 4e-6]
    _, _, at_start = kernel_state(fall, state, 0.0)
    later = fall.transition(2e-3, 4e-3) @ state
    whole, _, found = kernel_state(fall, later, SPEED * 4e-3)
    assert found == pytest.approx(at_start, abs=1e-15)
    result = simulate_drop(model, DropCase(speed=SPEED, duration=1e-4, start=StateStart(state=whole)))
    assert result.finished


def test_the_rotor_is_held_by_its_magnets_or_else_at_its_sensor_planes(model, drop):
    machine, planes = model.machine, drop.record.planes
    held = held_by(machine, planes, model.fe)
    assert held.sag == pytest.approx(levitated_sag(model.fe, machine), abs=1e-15)
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


def test_expansion_matrix_returns_rigid_amplitudes(sensing):
    m = sensing.rows.shape[1] // 2
    amplitudes = np.zeros(2 * m)
    amplitudes[[0, 1, m, m + 1]] = [3e-5, -2e-5, 1e-4, 4e-5]
    found = expansion_matrix(sensing.rows, 2) @ (sensing.rows @ amplitudes)
    assert found == pytest.approx([3e-5, -2e-5, 1e-4, 4e-5], rel=1e-12)


INITIAL = 2.0 * np.pi * 60.0


def with_speed(record, end, loss=3.0, constant=9.0):
    """A record whose speed falls by air and, within the first 0.3 s, by friction."""
    time = np.arange(-0.25, end, 0.01)
    after = np.maximum(time, 0.0)
    speed = INITIAL * np.exp(-after / constant) - loss * (1.0 - np.exp(-after / 0.08))
    speed += np.random.default_rng(2).normal(0.0, 0.1, len(time))
    return replace(record, speed_time=time, speed_readings=speed)


def test_air_and_friction_are_told_apart_where_the_record_is_long(drop):
    fit = identify_speed(with_speed(drop.record, 2.0), 0.0)
    assert fit.aero_time_constant.value == pytest.approx(9.0, rel=0.02)
    assert fit.friction_loss == pytest.approx(3.0, rel=0.1)
    assert fit.profile_time_constant < 8.8
    low, high = fit.aero_time_constant.interval_90 or (0.0, 0.0)
    assert low < 9.0 < high
    fit = identify_speed(with_speed(drop.record, 0.4), 0.0)
    assert fit.aero_time_constant.status == "the record does not determine it"
    assert fit.aero_time_constant.value < 9.0


def test_the_speed_at_the_drop_is_that_before_it_and_of_its_orbit(drop):
    assert identify_speed(with_speed(drop.record, 2.0), 0.0).initial == pytest.approx(INITIAL, abs=0.3)
    record = with_speed(drop.record, 2.0)
    assert identify_speed(record, 0.0, turning=INITIAL + 0.01).initial == INITIAL + 0.01
    assert identify_speed(record, 0.0, turning=2.0 * INITIAL).initial == pytest.approx(INITIAL, abs=0.3)
    fit = identify_speed(with_speed(drop.record, 0.05), 0.0)
    assert np.isinf(fit.aero_time_constant.value)
