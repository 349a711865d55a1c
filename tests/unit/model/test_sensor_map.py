"""Sensor directions: there and back, faults of the description, what the sensors cannot tell apart."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.errors import MachineFileError
from rotordrop.model.reduction import reduce_rotor
from rotordrop.model.sensor_map import sensor_map


def sensor(name, node, degrees, *, polarity=1, gain=1.0, offset=0.0):
    return SimpleNamespace(
        name=name, node=node, angle=math.radians(degrees), polarity=polarity, gain=gain, offset=offset
    )


def machine(*sensors):
    return SimpleNamespace(name="test", sensors=sensors)


PAIR = (sensor("A", 4, 135.0), sensor("B", 4, 45.0))
ODD = (
    sensor("C", 26, 100.0, polarity=-1, gain=1.02, offset=3e-6),
    sensor("D", 26, 20.0, gain=0.97, offset=-5e-6),
)


def test_forty_five_degrees_by_hand():
    """The right-hand sensor (45°) sees (x + y)/√2, the left-hand one (135°) (y − x)/√2."""
    mapping = sensor_map(machine(*PAIR))
    readings = mapping.readings(np.array([[3e-6, 5e-6]]))
    assert readings == pytest.approx(np.array([2e-6, 8e-6]) / math.sqrt(2.0))


def test_polarity_gain_and_offset_by_hand():
    mapping = sensor_map(machine(*ODD))
    x, y = 2e-6, -7e-6
    along = x * math.cos(math.radians(100.0)) + y * math.sin(math.radians(100.0))
    assert mapping.readings(np.array([[x, y]]))[0] == pytest.approx(-along / 1.02 + 3e-6)


def test_readings_and_displacements_are_inverse():
    mapping = sensor_map(machine(*ODD, *PAIR))
    assert mapping.plane_nodes == (4, 26)
    displacement = np.random.default_rng(3).normal(size=(7, 2, 2)) * 1e-4
    np.testing.assert_allclose(mapping.planar(mapping.readings(displacement)), displacement, atol=1e-18)
    readings = np.random.default_rng(4).normal(size=(7, 4)) * 1e-4
    np.testing.assert_allclose(mapping.readings(mapping.planar(readings)), readings, atol=1e-18)


def test_a_third_sensor_is_used_by_least_squares():
    mapping = sensor_map(machine(*PAIR, sensor("E", 4, 90.0)))
    readings = mapping.readings(np.array([[1e-5, 2e-5]])) + np.array([0.0, 0.0, 3e-6])
    directions = np.array([[-1, 1], [1, 1], [0, math.sqrt(2)]]) / math.sqrt(2)
    expected = np.linalg.lstsq(directions, readings, rcond=None)[0]
    assert mapping.planar(readings)[0] == pytest.approx(expected)
    assert expected[1] == pytest.approx(2e-5 + 1.5e-6)


def test_rows_read_the_rotor_through_its_modes(paper, paper_fe):
    basis = reduce_rotor(paper_fe, "quick", (4, 26))
    mapping = sensor_map(paper)
    amplitudes = np.random.default_rng(2).normal(size=(2, basis.size)) * 1e-5
    displacement = np.array([[row @ plane for plane in amplitudes] for row in map(basis.node_row, (4, 26))])
    read = mapping.rows(basis) @ amplitudes.ravel() + mapping.offsets
    assert read == pytest.approx(mapping.readings(displacement), abs=1e-18)


def test_two_planes_tell_the_rigid_modes_and_no_more(paper, paper_fe):
    basis = reduce_rotor(paper_fe, "quick", (4, 26))
    mapping = sensor_map(paper)
    rows = mapping.check_resolves(basis, 2)
    assert rows.shape == (4, 4)
    assert np.linalg.matrix_rank(rows) == 4
    with pytest.raises(
        MachineFileError, match=r"4 sensors at node 4, node 26 cannot tell 3 modes per plane apart"
    ):
        mapping.check_resolves(basis, 3)


def test_planes_side_by_side_cannot_tell_tilt(paper_fe):
    basis = reduce_rotor(paper_fe, "quick", (4, 26))
    near = machine(*PAIR, sensor("C", 5, 135.0), sensor("D", 5, 45.0))
    with pytest.raises(
        MachineFileError, match=r"at node 4, node 5 cannot tell 2 modes .* singular value 0\.0\d+"
    ):
        sensor_map(near).check_resolves(basis, 2)


def test_parallel_sensors_are_named_with_their_angles():
    mapping = sensor_map(machine(sensor("A", 4, 45.0), sensor("B", 4, 225.0)))
    with pytest.raises(MachineFileError, match=r"node 4 \(A at 45\.0°, B at -135°\) see one direction only"):
        mapping.planar(np.zeros(2))


def test_no_sensors_is_an_error():
    with pytest.raises(MachineFileError, match="machine 'test' has no sensors"):
        sensor_map(machine())
