"""Sensors at any angle and node give the motion at the bearings, or say why they cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import IdentificationError
from rotordrop.evidence.sensing import Sensing, build_sensing
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.replay.modal_expansion import expansion_matrix
from rotordrop.rotor.parameters import DropModel


def straight_rotor(model: DropModel, sensors: tuple[Sensor, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Displacements along the sensors and at the bearings of a rotor shifted and tilted in both planes."""
    z = np.asarray(model.fe.node_positions)

    def place(node: int) -> np.ndarray:
        return np.array([20e-6 + 30e-6 * z[node - 1], -100e-6 + 50e-6 * z[node - 1]])

    along = []
    for sensor in sensors:
        angle = float(sensor.angle)
        direction = sensor.polarity * np.array([np.cos(angle), np.sin(angle)])
        along.append(direction @ place(sensor.node))
    return np.array(along), np.array([place(b.node) for b in model.machine.touchdown_bearings])


def test_straight_rotor_is_found_at_the_bearings(model: DropModel, truth: Machine, sensing: Sensing) -> None:
    along, at_bearings = straight_rotor(model, truth.sensors)
    assert sensing.at_bearings(along) == pytest.approx(at_bearings, abs=1e-15)


def test_sensors_at_odd_angles_and_with_inverted_polarity_give_the_same(
    model: DropModel, truth: Machine
) -> None:
    odd = tuple(
        sensor.changed(angle=angle, polarity=polarity)
        for sensor, angle, polarity in zip(
            truth.sensors, ("10 deg", "75 deg", "-120 deg", "160 deg"), (1, -1, -1, 1), strict=True
        )
    )
    along, at_bearings = straight_rotor(model, odd)
    assert build_sensing(model, odd).at_bearings(along) == pytest.approx(at_bearings, abs=1e-15)


def test_line_through_the_bearings_goes_back_to_the_sensors(
    model: DropModel, truth: Machine, sensing: Sensing
) -> None:
    along, at_bearings = straight_rotor(model, truth.sensors)
    assert np.einsum("sbc,bc->s", sensing.from_bearings, at_bearings) == pytest.approx(along, abs=1e-15)


def test_what_the_file_says_of_a_sensor_is_its_uncertainty(model: DropModel, truth: Machine) -> None:
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


def test_sensors_in_one_plane_are_refused_with_their_names(model: DropModel, truth: Machine) -> None:
    one_plane = tuple(sensor.model_copy(update={"node": 5}) for sensor in truth.sensors)
    with pytest.raises(
        IdentificationError, match=r"S_DE_A at node 5 .* shows .* of the strongest, at least 0.05"
    ):
        build_sensing(model, one_plane)


def test_expansion_matrix_returns_rigid_amplitudes(sensing: Sensing) -> None:
    m = sensing.rows.shape[1] // 2
    amplitudes = np.zeros(2 * m)
    amplitudes[[0, 1, m, m + 1]] = [3e-5, -2e-5, 1e-4, 4e-5]
    found = expansion_matrix(sensing.rows, 2) @ (sensing.rows @ amplitudes)
    assert found == pytest.approx([3e-5, -2e-5, 1e-4, 4e-5], rel=1e-12)


def test_expansion_of_more_modes_than_sensors_resolve_is_refused(sensing: Sensing) -> None:
    with pytest.raises(IdentificationError, match=r"4 sensors cannot tell 3 modes per plane apart"):
        expansion_matrix(sensing.rows, 3)


def test_expansion_in_coinciding_planes_is_refused(sensing: Sensing) -> None:
    rows = sensing.rows.copy()
    rows[2:] = rows[:2]
    with pytest.raises(IdentificationError, match=r"smallest singular value .*e-[1-3]\d, at least 0.02"):
        expansion_matrix(rows, 2)
