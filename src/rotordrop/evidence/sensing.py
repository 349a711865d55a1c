"""What the sensors say about the rotor: rows of the reduced basis, and the motion at the bearings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.table import parameter
from rotordrop.errors import IdentificationError
from rotordrop.record.axes import sensor_directions
from rotordrop.rotor.statics import settled_sag
from rotordrop.rotor.unknowns import sensor_prior, smallest_gap

if TYPE_CHECKING:
    from rotordrop.rotor.parameters import DropModel

WEAKEST_DIRECTION = 0.05
"""Smallest ratio of singular values with which four rigid motions count as resolved [1] (chosen)."""


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

    @property
    def height_sigma(self) -> Array:
        """Standard deviation of the height at the bearings by the zeros of the sensors [m], shape (B,)."""
        return np.asarray(np.sqrt(np.sum((self.to_bearings[:, 1, :] * self.offset_sigma) ** 2, axis=1)))

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
    directions, count = sensor_directions(sensors), len(sensors)
    at_sensors = np.array([sensor.node for sensor in sensors]) - 1
    bearings = [bearing.node - 1 for bearing in model.machine.touchdown_bearings]
    z = np.asarray(model.fe.node_positions)
    scaled = (z - z.mean()) / (z.max() - z.min())
    x, y = directions[:, 0], directions[:, 1]
    # displacement along the sensors per shift and tilt in x, shift and tilt in y
    rigid = np.column_stack([x, x * scaled[at_sensors], y, y * scaled[at_sensors]])
    _refuse_unresolved(rigid, sensors, z[at_sensors])
    inverse = np.linalg.pinv(rigid)
    line = np.column_stack([np.ones(len(bearings)), scaled[bearings]])
    # the straight line through the bearings, level where there is one, as the sensors see it
    weights = np.ones((count, 1))
    if len(bearings) > 1:
        away, centre = z[bearings] - z[bearings].mean(), z[bearings].mean()
        through = np.column_stack([np.ones_like(away), away])
        weights = np.column_stack([np.ones(count), z[at_sensors] - centre]) @ np.linalg.pinv(through)
    bend = np.asarray(settled_sag(model.fe, model.machine))[0::2][at_sensors]
    shapes = np.array([model.basis.node_row(sensor.node) for sensor in sensors])
    gap = smallest_gap(model.machine)
    return Sensing(
        names=tuple(sensor.name for sensor in sensors),
        directions=directions,
        rows=np.hstack([directions[:, :1] * shapes, directions[:, 1:] * shapes]),
        to_bearings=np.stack([line @ inverse[:2], line @ inverse[2:]], axis=1),
        from_bearings=weights[:, :, None] * directions[:, None, :],
        settled_bend=directions[:, 1] * bend,
        gain_sigma=sensor_sigmas("gain", sensors, gap),
        offset_sigma=sensor_sigmas("offset", sensors, gap),
    )


def _refuse_unresolved(rigid: Array, sensors: tuple[Sensor, ...], z_sensor: Array) -> None:
    strength = np.linalg.svd(rigid, compute_uv=False)
    if len(strength) == 4 and strength[-1] >= WEAKEST_DIRECTION * strength[0]:
        return
    places = ", ".join(
        f"{s.name} at node {s.node} ({z:.4g} m)" for s, z in zip(sensors, z_sensor, strict=True)
    )
    weakest = strength[-1] / strength[0] if len(strength) == 4 else 0.0
    raise IdentificationError(
        f"the {len(sensors)} sensors ({places}) do not resolve the four rigid motions of the rotor: the "
        f"weakest motion shows {weakest:.2g} of the strongest, at least {WEAKEST_DIRECTION:g} is needed. Use "
        "two sensor planes that lie apart, with two directions in each, and check node and angle in the "
        "machine file."
    )


def sensor_sigmas(path: str, sensors: Sequence[Sensor], gap: float) -> Array:
    """Standard deviation of gain [1] or offset [m] of every sensor; an unknown offset scales with the gap."""
    row = parameter(path, "sensor")
    return np.array([sensor_prior(row, row.described(sensor), gap).sigma for sensor in sensors])
