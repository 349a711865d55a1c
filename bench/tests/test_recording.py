"""A synthetic recording against the truth it was made from."""

from dataclasses import replace

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine

from rotordrop.errors import UsageError
from rotordrop_bench import SensorChain, Violations, hidden_machine, synthesize_drop
from rotordrop_bench.event import drop_conditions
from rotordrop_bench.sensor_chain import PERFECT, drawn_errors, fitted_to, quantised, readings, shape_at
from rotordrop_bench.settled import settled_coordinates, swinging_amplitudes

SPEED = 2.0 * np.pi * 60.0


@pytest.fixture(scope="module")
def perfect(hidden):
    return synthesize_drop(hidden, SPEED, 8, sensor_chain=PERFECT, duration=0.05, tail=True)


def along(drop):
    """True displacement along the sensors on the clock of the record, by straight lines, shape (N, S)."""
    record, true = drop.record, drop.result
    time = record.time - drop.truth["t_off_in_record_s"]
    inside = (time > 0.0) & (time < 0.045)
    nodes = [sensor.node for sensor in record.sensors]
    places = true.at_nodes(nodes)
    angles = [float(sensor.angle) for sensor in record.sensors]
    columns = [
        np.interp(time[inside], true.time, places[:, s] @ [np.cos(a), np.sin(a)])
        for s, a in enumerate(angles)
    ]
    return inside, np.column_stack(columns)


def test_perfect_sensors_read_the_true_motion_and_others_with_their_errors(perfect, synthetic):
    inside, true = along(perfect)
    assert np.max(np.abs(true)) > 1e-4
    assert perfect.record.signals[inside] == pytest.approx(true, abs=2e-8)
    inside, true = along(synthetic)
    signals, truth = synthetic.record.signals[inside], synthetic.truth
    for s in range(4):
        (gain, offset), *_ = np.linalg.lstsq(
            np.column_stack([true[:, s], np.ones(len(true))]), signals[:, s], rcond=None
        )
        assert gain == pytest.approx(truth["sensor_gain"][s], abs=2e-3)
        assert offset == pytest.approx(truth["sensor_offset"][s], abs=3e-7)
        rest = signals[:, s] - truth["sensor_gain"][s] * true[:, s] - truth["sensor_offset"][s]
        assert np.std(rest) == pytest.approx(0.45e-6, rel=0.25)


def test_the_same_seed_makes_the_same_bits_and_another_one_does_not(hidden, synthetic):
    again = synthesize_drop(hidden, SPEED, 8, duration=0.21)
    assert again.record.signals.tobytes() == synthetic.record.signals.tobytes()
    assert again.tail.signals.tobytes() == synthetic.tail.signals.tobytes()
    assert again.truth == synthetic.truth
    other = synthesize_drop(hidden, SPEED, 9, duration=0.05, tail=False)
    assert other.truth["peak_force_N"] != synthetic.truth["peak_force_N"]
    assert other.tail is None
    for key in ("sensor_gain", "sensor_offset"):  # these belong to the machine
        assert other.truth[key] == synthetic.truth[key]


def test_the_levitated_part_is_a_circle_and_nothing_jumps(perfect, hidden):
    record = perfect.record
    before = record.time < perfect.truth["t_off_in_record_s"] - 1e-4
    displacement = record.motion
    z = displacement[before, 0, 0] + 1j * displacement[before, 0, 1]
    turn = np.exp(1j * SPEED * record.time[before])
    basis = np.column_stack([np.ones(len(z)), turn, turn.conj()])
    (offset, forward, backward), *_ = np.linalg.lstsq(basis, z, rcond=None)
    assert np.max(np.abs(z - basis @ [offset, forward, backward])) < 1e-12
    assert abs(forward) > 1e-6
    assert abs(backward) < 1e-12
    step = np.abs(np.diff(perfect.record.signals, n=2, axis=0))
    at = int(np.searchsorted(perfect.record.time, perfect.truth["t_off_in_record_s"]))
    # letting go changes the acceleration by some 30 m/s²; a jump of the velocity would show as 2e-7
    assert np.max(step[at - 5 : at + 5]) < 1.2e-7


def test_the_trigger_is_off_by_the_jitter(hidden, perfect):
    conditions = drop_conditions(hidden, SPEED, 8)
    assert perfect.truth["t_off_in_record_s"] == conditions.jitter != 0.0
    later = replace(conditions, jitter=conditions.jitter + 1e-3)
    shifted = synthesize_drop(
        hidden, SPEED, 8, sensor_chain=PERFECT, duration=0.03, tail=False, conditions=later
    )
    rows = slice(4000, 5400)
    moved = shifted.record.signals[rows.start + 20 : rows.stop + 20]
    assert moved == pytest.approx(perfect.record.signals[rows], abs=1e-10)


def test_the_tail_lies_where_the_rotor_rests(hidden, perfect):
    rest = settled_coordinates(hidden.model)
    layout = hidden.model.layout
    mean = np.mean(perfect.tail.motion, axis=0)
    for p, node in enumerate(dict.fromkeys(s.node for s in hidden.known.sensors)):
        row = hidden.model.basis.node_row(node)
        assert mean[p, 1] == pytest.approx(row @ rest[layout.modal_y], abs=1.5e-6)
        assert abs(mean[p, 0]) < 1.5e-6
    assert perfect.tail.sampling_rate == 1000.0
    assert perfect.tail.duration == pytest.approx(3.0, abs=0.01)


def test_settled_place_of_the_supplied_machine(known):
    """The supplied truth gives the mean place after its own simulation; the DE still swung by 0.107 rad."""
    values = {
        "NDE.air_gap": 275e-6, "DE.air_gap": 285e-6,
        "NDE.support.stiffness": 78e6, "DE.support.stiffness": 550e6,
        "NDE.contact.stiffness": 1.05e9, "DE.contact.stiffness": 1.18e9,
        "NDE.preload": 460.0, "DE.preload": 495.0,
    }  # fmt: skip
    model = hidden_machine(known.with_values(values), 0, drawn=False).model
    rest = settled_coordinates(model)
    radius = np.abs(model.parameters.bearing_shape @ rest[model.layout.modal_y])
    swing = np.array([0.0, 0.107])
    assert radius * (1.0 - swing**2 / 4.0) == pytest.approx([278.358e-6, 287.302e-6], abs=0.1e-6)


def test_swinging_ends_stay_on_their_circles(hidden):
    rest = settled_coordinates(hidden.model)
    time = np.linspace(0.0, 0.2, 500)
    m = hidden.model.layout.n_modes
    amplitudes = swinging_amplitudes(hidden.model, rest, np.array([0.2, 0.0]), np.zeros(2), 1e9, time)
    shape = hidden.model.parameters.bearing_shape
    x, y = amplitudes[:, :m] @ shape.T, amplitudes[:, m:] @ shape.T
    assert np.hypot(x, y)[:, 0] == pytest.approx(np.abs(shape[0] @ rest[m : 2 * m]), rel=1e-9)
    assert np.max(np.abs(x[:, 1])) < 1e-15
    zero = time[np.flatnonzero(np.diff(np.sign(x[:, 0])))]
    period = 2.0 * np.mean(np.diff(zero))
    assert period == pytest.approx(2.0 * np.pi * np.sqrt(np.hypot(x[0, 0], y[0, 0]) / 9.81), rel=0.01)


def test_the_speed_is_read_every_hundredth_of_a_second(synthetic):
    record = synthetic.record
    assert np.diff(record.speed_time) == pytest.approx(0.01, abs=1e-9)
    before = record.speed_time < -0.001
    assert np.mean(record.speed_readings[before]) == pytest.approx(SPEED, abs=0.1)
    steps = record.speed_readings / (2 * np.pi * 0.01)
    assert steps == pytest.approx(np.round(steps), abs=1e-6)


def test_a_shifted_plane_reads_what_is_there_and_a_filter_is_late(known, perfect, hidden):
    """30 mm nearer to the middle of the rotor the sensors see another point of the shaft."""
    shifted = hidden_machine(known, 3, Violations.of({"sensors": {"plane_shift": "30 mm"}}))
    one, two = perfect, synthesize_drop(shifted, SPEED, 8, sensor_chain=PERFECT, duration=0.05, tail=False)
    assert two.truth["sensor_plane_shift"] == [0.03] * 4
    assert two.truth["peak_force_N"] == one.truth["peak_force_N"]
    difference = np.max(np.abs(two.record.signals - one.record.signals))
    assert 2e-6 < difference < 6e-5
    outside = hidden_machine(known, 3, Violations.of({"sensors": {"plane_shift": "-2 m"}}))
    with pytest.raises(UsageError, match=r"a sensor plane at .* mm lies outside the rotor"):
        synthesize_drop(outside, SPEED, 8, sensor_chain=PERFECT, duration=0.01, tail=False)
    filtered = hidden_machine(known, 3, Violations.of({"sensors": {"anti_alias_frequency": "4 kHz"}}))
    one, two = perfect, synthesize_drop(filtered, SPEED, 8, sensor_chain=PERFECT, duration=0.05, tail=False)
    assert two.record.signals.shape == one.record.signals.shape
    # fourth order at 4 kHz: a group delay of 2.6/(2π 4000 Hz) = 104 µs at low frequency
    delayed = np.interp(one.record.time - 1.04e-4, one.record.time, one.record.signals[:, 0])
    inner = slice(100, -10)
    late = np.max(np.abs(two.record.signals[inner, 0] - delayed[inner]))
    undelayed = np.max(np.abs(two.record.signals[inner, 0] - one.record.signals[inner, 0]))
    assert late < 0.15 * undelayed


@pytest.mark.parametrize("bits", [12, 14, 16])
def test_the_converter_rounds_to_its_steps_and_clips(bits):
    chain = SensorChain(bits=bits)
    step = 1.2e-3 / 2**bits
    values = np.array([0.4 * step, 0.6 * step, 1e-4, 2e-3, -2e-3])
    read = quantised(values, chain)
    assert read / step == pytest.approx(np.round(read / step), abs=1e-6)
    assert np.max(np.abs(read[:3] - values[:3])) <= 0.5 * step
    assert read[3] == pytest.approx(600e-6 - step)
    assert read[4] == pytest.approx(-600e-6)
    assert np.array_equal(quantised(values, replace(chain, bits=0)), values)


def test_hum_and_runout_have_their_frequencies():
    chain = replace(PERFECT, hum=1e-6)
    count, rate, turns = 4000, 20e3, 130.0
    time = np.arange(count) / rate
    zero = np.zeros((count, 1))
    errors = drawn_errors(PERFECT, 1, np.random.default_rng(1))
    errors = replace(errors, runout_1x=np.array([2e-6 + 0j]), runout_2x=np.array([3e-6j]))
    read = readings(zero, time, 2 * np.pi * turns * time, chain, errors, np.random.default_rng(1))[:, 0]
    size = 2.0 * np.abs(np.fft.rfft(read)) / count
    lines = {round(f * rate / count): size[f] for f in np.flatnonzero(size > 1e-9)}
    assert lines == pytest.approx({50: 1e-6, 130: 2e-6, 260: 3e-6}, rel=1e-6)


def test_the_shape_between_nodes_is_that_of_the_nodes_at_the_nodes(hidden):
    positions = np.asarray(hidden.machine.rotor.node_positions)
    basis = hidden.model.basis
    for node in (1, 5, 20, len(positions)):
        assert shape_at(positions, basis, positions[node - 1]) == pytest.approx(
            basis.node_row(node), abs=1e-15
        )
    middle = 0.5 * (positions[4] + positions[5])
    rigid = shape_at(positions, basis, middle)[:2]
    assert rigid == pytest.approx(0.5 * (basis.node_row(5) + basis.node_row(6))[:2], rel=1e-12)


def test_an_impossible_filter_is_refused():
    with pytest.raises(UsageError, match=r"corner frequency 1000000.0 Hz does not fit"):
        SensorChain(anti_alias_frequency=1e6)


def test_sensors_see_the_whole_gap_of_a_large_machine():
    machine = scaled_machine(6000.0)
    gap = float(machine.touchdown_bearings[0].air_gap)
    assert gap > 590e-6
    assert fitted_to(SensorChain(), machine).full_scale == 2.0 * gap
    assert fitted_to(SensorChain(full_scale=1e-4), machine).full_scale == 1e-4
    assert fitted_to(SensorChain(), scaled_machine(60.0)).full_scale == 600e-6
    made = synthesize_drop(
        hidden_machine(machine, 5), 2.0 * np.pi * 40.0, 1, duration=0.03, tail=False, tolerance=1e-6
    )
    assert np.abs(made.record.signals).max() > 600e-6
