"""A record in memory: from arrays, planar from sensors at any angles, cut, brought to one clock."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError
from rotordrop.machine import example_machine
from rotordrop.record.axes import along_sensors, planar_of, sensor_directions, sensor_planes
from rotordrop.record.event_date import event_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers import read_recording
from rotordrop.record.record import Record, record_of
from rotordrop.record.recording import Channel, Recording


def test_a_window_holds_the_samples_at_its_bounds_whatever_their_rounding(drop):
    step = 1.0 / drop.sampling_rate
    first, last = 100, 5000
    for off in (-1e-6 * step, 0.0, 1e-6 * step):
        cut = drop.window(drop.time[first] + off, drop.time[last] + off)
        np.testing.assert_array_equal(cut.time, drop.time[first : last + 1])
        np.testing.assert_array_equal(cut.signals, drop.signals[first : last + 1])
    later = drop.window(drop.time[first] + 0.5 * step, drop.time[last] - 0.5 * step)
    np.testing.assert_array_equal(later.time, drop.time[first + 1 : last])


@pytest.mark.parametrize(
    ("metadata", "date"),
    [
        ({"start": "2019-10-16T13:42:07.250000Z"}, "2019-10-16T13:42:07.250000Z"),
        ({"Trigger_Time": "16.10.2019 13:42"}, "2019-10-16T13:42"),
        ({"start": "trigger", "date": "2019-10-16"}, "2019-10-16"),
        ({"machine": "LP 400"}, ""),
        ({"start": "-0.12", "Datum": "24.11.2026 13:05"}, "2026-11-24T13:05"),
        ({"Datum": "3.4.2026", "Uhrzeit": "13:05:06,5"}, "2026-04-03T13:05:06.500000"),
        ({"Datum/Uhrzeit": "24. November 2026, 13:05 Uhr"}, "2026-11-24T13:05"),
        ({"Datum": "1. März 2026"}, "2026-03-01"),
        ({"Date": "11/24/2026 1:05 PM"}, "2026-11-24T13:05"),
        ({"Date": "24/11/2026"}, "2026-11-24"),
        ({"Date": "2026/11/24 13:05"}, "2026-11-24T13:05"),
        ({"Recorded at": "Nov 24, 2026 12:05:07 am"}, "2026-11-24T00:05:07"),
        ({"date": "24-Nov-2026", "time": "13:05:06+01:00"}, "2026-11-24T13:05:06+01:00"),
        ({"date": "04 MAY 2023"}, "2023-05-04"),
        ({"Datum": "31.02.2026"}, ""),
        ({"Date": "24.11.26"}, ""),
        ({"Date": "03/04/2026"}, ""),
        ({"Date": "10.20.30.40"}, ""),
    ],
)
def test_the_date_of_the_event_comes_from_the_header(drop, metadata, date):
    assert replace(drop, metadata=metadata).event_date == date


@pytest.mark.parametrize("text", ["03/04/2026 13:05", "24.11.26"])
def test_a_date_that_leaves_the_day_open_is_left_out_and_named(text):
    recording = replace(_unequal(1), metadata={"Datum": text})
    record = record_of(recording, example_machine("lp400").sensors)
    assert record.event_date == ""
    assert any(
        f"the date {text!r} behind 'datum' leaves open which day it is" in note for note in record.notes
    )


@pytest.mark.parametrize(
    ("head", "date"),
    [
        ("Datum: 24.11.2026 13:05", "2026-11-24T13:05"),
        ("Datum;24.11.2026;13:05:06", "2026-11-24T13:05:06"),
        ("# Date: Nov 24, 2026 1:05 PM", "2026-11-24T13:05"),
        ("Messung 24.11.2026 13:05;Anlage 4711", "2026-11-24T13:05"),
        ("Kalibriert: 24.11.2026", ""),
        ("Datum: 03/04/2026", ""),
    ],
)
def test_the_date_of_the_event_is_read_from_the_head_of_a_table(tmp_path, head, date):
    rows = [f"{0.001 * k:.3f};{k % 7},5;{k % 5},25" for k in range(30)]
    file = tmp_path / "drop.csv"
    file.write_text("\n".join([head, "Zeit [s];X [um];Y [um]", *(row.replace(".", ",") for row in rows)]))
    recording = read_recording(file, Profile())
    assert event_of(recording.metadata)[0] == date


def _unequal(times, shift=0.0):
    """Four sensors, the first two sampled `times` as fast as the others."""
    channels = []
    for number, name in enumerate(("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")):
        rate = 10_000.0 * (times if number < 2 else 1)
        time = np.arange(round(0.2 * rate)) / rate + (shift if number < 2 else 0.0)
        values = np.sin(2.0 * np.pi * 60.0 * time + number)
        channels.append(Channel(name=name, label=name, unit="um", values=values, time=time))
    return Recording(channels=tuple(channels))


@pytest.mark.parametrize("times", [2, 5])
def test_channels_of_several_rates_come_to_the_slowest_with_samples_as_they_were_read(times):
    recording = _unequal(times)
    record = record_of(recording, example_machine("lp400").sensors)
    assert record.sampling_rate == 10_000.0
    assert np.array_equal(record.signals[:, 0], 1e-6 * recording.channels[0].values[::times])
    assert np.array_equal(record.signals[:, 3], 1e-6 * recording.channels[3].values)
    assert [note for note in record.notes if f"every {times}th sample is used" in note] != []


def test_channels_between_the_others_are_read_off_and_those_that_never_meet_refused():
    with pytest.raises(RecordError, match=r"has 10000 Hz and 'S_NDE_A' 15000 Hz; .* sampled together"):
        record_of(_unequal(1.5), example_machine("lp400").sensors)
    record = record_of(_unequal(2, 20e-6), example_machine("lp400").sensors)
    for number in range(4):
        truth = 1e-6 * np.sin(2.0 * np.pi * 60.0 * record.time + number)
        np.testing.assert_allclose(record.signals[:, number], truth, rtol=0.0, atol=1e-13)
    assert sum("cubics through them" in note for note in record.notes) == 2


MACHINE = example_machine("paper")
NAMES = [sensor.name for sensor in MACHINE.sensors]
COUNT = 200
MICRONS = np.arange(COUNT * len(NAMES), dtype=float).reshape(COUNT, -1)


def test_columns_become_metres_with_names_units_and_speed():
    record = Record.from_arrays(MACHINE, "20 kHz", MICRONS, unit="um", start="-1 ms")
    assert record.channel_names == tuple(NAMES)
    assert record.sampling_rate == pytest.approx(20e3)
    assert record.time[0] == pytest.approx(-1e-3)
    np.testing.assert_allclose(record.reading(NAMES[2]), 1e-6 * MICRONS[:, 2])
    assert record.measured_speed is None
    time = np.arange(COUNT) * 0.05
    signals = {name: MICRONS[:, k] for k, name in reversed(list(enumerate(NAMES)))}
    units = dict.fromkeys(NAMES, "um") | {NAMES[0]: "mm"}
    rpm = np.linspace(3600.0, 3500.0, COUNT)
    record = Record.from_arrays(MACHINE, time, signals, unit=units, time_unit="ms", speed=(rpm, "rpm"))
    np.testing.assert_allclose(record.reading(NAMES[0]), 1e-3 * MICRONS[:, 0])
    np.testing.assert_allclose(record.reading(NAMES[1]), 1e-6 * MICRONS[:, 1])
    assert record.speed[0] == pytest.approx(2.0 * math.pi * 60.0)
    assert not record.speed_by_hand
    for start, speed in (("-0.25 s", "60 Hz"), (-0.25, 2.0 * math.pi * 60.0)):
        record = Record.from_arrays(MACHINE, "20 kHz", MICRONS, unit="um", start=start, speed=speed)
        assert record.speed_by_hand and record.time[0] == -0.25
        assert record.speed[0] == pytest.approx(2.0 * math.pi * 60.0)
        assert "speed given by hand: 60.0 Hz (3600 rpm)" in record.notes


def test_a_table_is_read_as_the_file_of_the_same_columns_would_be():
    pandas = pytest.importorskip("pandas")
    columns = {f"{name} [um]": MICRONS[:, k] for k, name in enumerate(NAMES)}
    table = pandas.DataFrame(
        {
            "time [ms]": np.arange(COUNT) * 0.05,
            **columns,
            "Drehzahl [1/min]": np.full(COUNT, 3600.0),
            "state": "OK",
        }
    )
    record = Record.from_dataframe(MACHINE, table)
    np.testing.assert_allclose(record.signals, 1e-6 * MICRONS)
    assert record.sampling_rate == pytest.approx(20e3)
    assert record.speed[0] == pytest.approx(2.0 * math.pi * 60.0)
    bare = pandas.DataFrame(MICRONS, columns=NAMES, index=pandas.Index(np.arange(COUNT) * 5e-5, name="t [s]"))
    np.testing.assert_allclose(Record.from_dataframe(MACHINE, bare, unit="um").signals, 1e-6 * MICRONS)
    stamped = bare.set_index(pandas.date_range("2026-01-01", periods=COUNT, freq="50us"))
    np.testing.assert_allclose(
        Record.from_dataframe(MACHINE, stamped, unit="um").time, record.time, atol=1e-12
    )


TIME = np.arange(50) / 1e4
MOTION = np.column_stack([20e-6 * np.cos(2 * np.pi * 300 * TIME), -250e-6 * TIME / TIME[-1]])


def sensor(name, degrees, node=5, **more):
    return Sensor(name=name, node=node, angle=f"{degrees} deg", bearing="NDE", **more)


def seen_by(sensors, motion=MOTION):
    along = motion @ sensor_directions(sensors).T
    gain = np.array([float(s.gain) for s in sensors])
    offset = np.array([float(s.offset) for s in sensors])
    return Record(time=TIME.copy(), signals=along / gain + offset, sensors=tuple(sensors), sampling_rate=1e4)


@pytest.mark.parametrize("angles", [(135, 45), (0, 90), (10, 70), (-30, 200, 95), (0, 120, 240), (45, 50)])
def test_any_angles_give_x_and_y(angles):
    record = seen_by([sensor(f"S{i}", angle) for i, angle in enumerate(angles)])
    displacement, nodes = record.motion, tuple(plane.node for plane in record.planes)
    assert nodes == (5,)
    np.testing.assert_allclose(displacement[:, 0], MOTION, rtol=0, atol=1e-15)


def test_planar_motion_follows_the_description_of_the_sensors(drop):
    """A at 135° and B at 45°: x = (B − A)/√2, y = (A + B)/√2."""
    displacement, nodes = drop.motion, tuple(plane.node for plane in drop.planes)
    a, b = drop.signals[:, 0], drop.signals[:, 1]
    assert nodes == (5, 25)
    np.testing.assert_allclose(displacement[:, 0, 0], (b - a) / np.sqrt(2), atol=1e-18)
    np.testing.assert_allclose(displacement[:, 0, 1], (a + b) / np.sqrt(2), atol=1e-18)
    sensors = [
        sensor("A", 135, polarity=-1, gain=1.02, offset="8 um"),
        sensor("B", 45, gain=0.98, offset="-3 um"),
    ]
    displacement = seen_by(sensors).motion
    np.testing.assert_allclose(displacement[:, 0], MOTION, rtol=0, atol=1e-15)
    # A law: readings do not change when sensors and motion are turned together.
    angle = np.radians(33.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    plain = seen_by([sensor("A", 135), sensor("B", 45)])
    turned = replace(plain, sensors=(sensor("A", 168), sensor("B", 78)))
    np.testing.assert_allclose(turned.motion[:, 0], plain.motion[:, 0] @ turn.T, atol=1e-15)


@pytest.mark.parametrize(
    ("angles", "said"),
    [
        ({"A": 135, "B": 315}, r"plane at node 5 has sensors along one line \(A at 135°, B at 315°\)"),
        ({"A": 90, "B": 92}, r"A at 90°, B at 92°.* at least 3° away"),
        ({"C": 0}, r"plane at node 5 has one sensor \(C at 0°\)"),
    ],
)
def test_a_plane_that_sees_one_direction_is_refused(angles, said):
    with pytest.raises(RecordError, match=said):
        sensor_planes(
            [sensor("A", 135, node=2), sensor("B", 45, node=2), *map(sensor, angles, angles.values())]
        )


def test_planes_may_be_taken_one_by_one(drop):
    planes = sensor_planes(drop.sensors)
    along = along_sensors(drop.signals, drop.sensors)
    np.testing.assert_array_equal(planar_of(along, planes[1:])[:, 0], drop.motion[:, 1])
