"""Displacement x, y from sensors at any angles."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError
from rotordrop.record.axes import along_sensors, planar_of, sensor_directions, sensor_planes
from rotordrop.record.record import Record

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


def test_the_supplied_arrangement_is_that_of_its_description(drop):
    """A at 135° and B at 45°: x = (B − A)/√2, y = (A + B)/√2."""
    displacement, nodes = drop.motion, tuple(plane.node for plane in drop.planes)
    a, b = drop.signals[:, 0], drop.signals[:, 1]
    assert nodes == (5, 25)
    np.testing.assert_allclose(displacement[:, 0, 0], (b - a) / np.sqrt(2), atol=1e-18)
    np.testing.assert_allclose(displacement[:, 0, 1], (a + b) / np.sqrt(2), atol=1e-18)


def test_polarity_gain_and_offset_are_taken_into_account():
    sensors = [
        sensor("A", 135, polarity=-1, gain=1.02, offset="8 um"),
        sensor("B", 45, gain=0.98, offset="-3 um"),
    ]
    displacement = seen_by(sensors).motion
    np.testing.assert_allclose(displacement[:, 0], MOTION, rtol=0, atol=1e-15)


def test_turning_all_sensors_turns_the_motion():
    """A law: readings do not change when sensors and motion are turned together."""
    angle = np.radians(33.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    plain = seen_by([sensor("A", 135), sensor("B", 45)])
    turned = replace(plain, sensors=(sensor("A", 168), sensor("B", 78)))
    np.testing.assert_allclose(turned.motion[:, 0], plain.motion[:, 0] @ turn.T, atol=1e-15)


def test_sensors_along_one_line_are_refused():
    with pytest.raises(
        RecordError, match=r"plane at node 5 has sensors along one line \(A at 135°, B at 315°\)"
    ):
        sensor_planes([sensor("A", 135), sensor("B", 315)])


def test_sensors_almost_along_one_line_are_refused():
    with pytest.raises(RecordError, match=r"A at 90°, B at 92°.* at least 3° away"):
        sensor_planes([sensor("A", 90), sensor("B", 92)])


def test_a_plane_with_one_sensor_is_refused():
    with pytest.raises(RecordError, match=r"plane at node 9 has one sensor \(C at 0°\)"):
        sensor_planes([sensor("A", 135), sensor("B", 45), sensor("C", 0, node=9)])


def test_planes_may_be_taken_one_by_one(drop):
    planes = sensor_planes(drop.sensors)
    along = along_sensors(drop.signals, drop.sensors)
    np.testing.assert_array_equal(planar_of(along, planes[1:])[:, 0], drop.motion[:, 1])
