"""What the sensors say about the rotor: rows of the reduced basis, and the motion at the bearings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.elements.sensor import Sensor
from rotordrop.elements.table import parameter
from rotordrop.errors import IdentificationError
from rotordrop.record.axes import sensor_directions
from rotordrop.record.recording import Array
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import settled_sag
from rotordrop.rotor.unknowns import sensor_prior, smallest_gap

WEAKEST_DIRECTION = 0.05
"""Smallest ratio of singular values with which four rigid motions count as resolved [1]."""


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """Sensors in front of a reduced rotor; S sensors, B bearings, m modes per plane."""

    names: tuple[str, ...]
    """Channels."""
    directions: Array
    """Unit vector (x, y) of positive reading, polarity included [1], shape (S, 2)."""
    rows: Array
    """Displacement along each sensor [m] per modal amplitude, x amplitudes before y, shape (S, 2m)."""
    to_bearings: Array
    """Displacement (x, y) at the bearing nodes per displacement along the sensors, for a straight rotor [1],
    shape (B, 2, S)."""
    from_bearings: Array
    """Displacement along the sensors per displacement at the bearing nodes, for a straight rotor [1], shape
    (S, B, 2)."""
    settled_bend: Array
    """Displacement along the sensors [m] by which the resting rotor bends away from the line through the
    bearings, shape (S,)."""
    gain_sigma: Array
    offset_sigma: Array
    """Standard deviations of gain [1] and zero [m], shape (S,)."""

    def at_bearings(self, along: Array) -> Array:
        """Displacement at the bearings [m], shape (..., B, 2), from that along the sensors (..., S)."""
        return np.asarray(np.einsum("bcs,...s->...bc", self.to_bearings, along))


def build_sensing(model: DropModel, sensors: tuple[Sensor, ...]) -> Sensing:
    """Put the sensors of a record in front of a model's rotor.

    Raises
    ------
    IdentificationError
        If the sensors cannot resolve the four rigid motions, for instance because all lie in one plane.
    """
    directions = sensor_directions(sensors)
    nodes = [sensor.node for sensor in sensors]
    shapes = np.array([model.basis.node_row(node) for node in nodes])
    z = np.asarray(model.fe.node_positions)
    z_sensor = z[np.array(nodes) - 1]
    z_bearing = z[[bearing.node - 1 for bearing in model.machine.touchdown_bearings]]
    rigid = _rigid_rows(directions, z_sensor, z)
    _check_resolved(rigid, sensors, z_sensor)
    inverse = np.linalg.pinv(rigid)
    line = np.column_stack([np.ones_like(z_bearing), _scaled(z_bearing, z)])
    to_bearings = np.stack([line @ inverse[:2], line @ inverse[2:]], axis=1)
    bend = np.asarray(settled_sag(model.fe, model.machine))[0::2][np.array(nodes) - 1]
    return Sensing(
        names=tuple(sensor.name for sensor in sensors),
        directions=directions,
        rows=np.hstack([directions[:, :1] * shapes, directions[:, 1:] * shapes]),
        to_bearings=to_bearings,
        from_bearings=_from_bearings(directions, z_sensor, z_bearing),
        settled_bend=directions[:, 1] * bend,
        gain_sigma=_sigmas("gain", sensors, model),
        offset_sigma=_sigmas("offset", sensors, model),
    )


def _scaled(position: Array, z: Array) -> Array:
    return np.asarray((position - z.mean()) / (z.max() - z.min()))


def _rigid_rows(directions: Array, z_sensor: Array, z: Array) -> Array:
    """Displacement along the sensors per shift and tilt in x, shift and tilt in y, shape (S, 4)."""
    tilt = _scaled(z_sensor, z)
    x, y = directions[:, 0], directions[:, 1]
    return np.column_stack([x, x * tilt, y, y * tilt])


def _check_resolved(rigid: Array, sensors: tuple[Sensor, ...], z_sensor: Array) -> None:
    strength = np.linalg.svd(rigid, compute_uv=False)
    if len(strength) == 4 and strength[-1] >= WEAKEST_DIRECTION * strength[0]:
        return
    places = ", ".join(
        f"{s.name} at node {s.node} ({z:.4g} m)" for s, z in zip(sensors, z_sensor, strict=True)
    )
    weakest = strength[-1] / strength[0] if len(strength) == 4 else 0.0
    raise IdentificationError(
        f"the {len(sensors)} sensors ({places}) do not resolve the four rigid motions of the rotor: the "
        "weakest motion "
        f"shows {weakest:.2g} of the strongest, at least {WEAKEST_DIRECTION:g} is needed. Use two sensor "
        "planes that lie apart, with two directions in each, and check node and angle in the machine file."
    )


def _from_bearings(directions: Array, z_sensor: Array, z_bearing: Array) -> Array:
    """Straight line through the bearing nodes as the sensors see it, shape (S, B, 2)."""
    if len(z_bearing) == 1:
        weights = np.ones((len(z_sensor), 1))
    else:
        centre = z_bearing.mean()
        line = np.column_stack([np.ones_like(z_bearing), z_bearing - centre])
        weights = np.column_stack([np.ones_like(z_sensor), z_sensor - centre]) @ np.linalg.pinv(line)
    return np.asarray(weights[:, :, None] * directions[:, None, :])


def _sigmas(path: str, sensors: tuple[Sensor, ...], model: DropModel) -> Array:
    row, gap = parameter(path, "sensor"), smallest_gap(model.machine)
    return np.array([sensor_prior(row, row.described(sensor), gap).sigma for sensor in sensors])
