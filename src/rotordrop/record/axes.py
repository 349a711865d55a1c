"""From readings along sensor directions to displacements x, y in the planes of the sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError

LEAST_RATIO = 0.026
"""Smaller ratios of the singular values of the sensor directions count as singular (about 3° apart)."""


@dataclass(frozen=True, kw_only=True)
class Plane:
    """Sensors that share an axial position, and how to get x, y from them."""

    node: int
    """Node number, counted from 1."""
    bearing: str
    """Name of the touchdown bearing at this end."""
    columns: tuple[int, ...]
    """Sensors of the plane, as columns of the record's signals."""
    names: tuple[str, ...]
    """Their names."""
    to_planar: Array
    """Displacement (x, y) per displacement along the sensors, least squares, shape (2, S_p)."""


def sensor_directions(sensors: Sequence[Sensor]) -> Array:
    """Unit vectors (x, y) along which the sensors read positive, shape (S, 2)."""
    angles = np.array([float(sensor.angle) for sensor in sensors])
    return np.asarray(sensor_polarity(sensors)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


def sensor_polarity(sensors: Sequence[Sensor]) -> Array:
    """Sign of each sensor's reading in the direction of its angle, shape (S,): 1 or -1."""
    return np.array([sensor.polarity for sensor in sensors], dtype=np.float64)


def sees_both_directions(sensors: Sequence[Sensor]) -> bool:
    """Whether the sensors of a plane look in two directions that are far enough apart."""
    if len(sensors) < 2:
        return False
    strength = np.linalg.svd(sensor_directions(sensors), compute_uv=False)
    return bool(strength[1] >= LEAST_RATIO * strength[0])


def end_columns(sensors: Sequence[Sensor], positions: Sequence[float] | Array) -> list[int]:
    """Columns of the two planes with both directions that lie farthest apart; all where there are not three.

    Between them the rotor bends most. ``positions`` are those of the nodes [m].
    """
    of_node = {one.node: [i for i, other in enumerate(sensors) if other.node == one.node] for one in sensors}
    whole = [node for node, columns in of_node.items() if sees_both_directions([sensors[i] for i in columns])]
    if len(of_node) <= 2 or len(whole) < 2:
        return list(range(len(sensors)))
    whole.sort(key=lambda node: positions[node - 1])
    return sorted(of_node[whole[0]] + of_node[whole[-1]])


def along_sensors(signals: Array, sensors: Sequence[Sensor]) -> Array:
    """True displacement along every sensor [m], shape (N, S): offset taken off, gain applied."""
    offset = np.array([float(sensor.offset) for sensor in sensors])
    gain = np.array([float(sensor.gain) for sensor in sensors])
    return np.asarray((signals - offset) * gain)


def sensor_planes(sensors: Sequence[Sensor]) -> tuple[Plane, ...]:
    """Group the sensors by node and find how each group gives x and y.

    Raises
    ------
    RecordError
        When a plane has one sensor, or sensors that all look along one line.
    """
    planes = []
    for node in dict.fromkeys(sensor.node for sensor in sensors):
        columns = tuple(i for i, sensor in enumerate(sensors) if sensor.node == node)
        members = [sensors[i] for i in columns]
        if not sees_both_directions(members):
            seen = ", ".join(f"{one.name} at {math.degrees(float(one.angle)):.4g}°" for one in members)
            why = "one sensor" if len(members) < 2 else "sensors along one line"
            words = f"the plane at node {node} has {why} ({seen}): x and y cannot be found"
            raise RecordError(f"{words}; a second direction, at least 3° away, is needed at this node")
        planes.append(
            Plane(
                node=node,
                bearing=members[0].bearing,
                columns=columns,
                names=tuple(sensor.name for sensor in members),
                to_planar=np.asarray(np.linalg.pinv(sensor_directions(members)), dtype=np.float64),
            )
        )
    return tuple(planes)


def planar_of(along: Array, planes: Sequence[Plane]) -> Array:
    """Displacement (x, y) in each plane, shape (..., P, 2), from displacements along sensors (..., S)."""
    return np.stack([along[..., list(plane.columns)] @ plane.to_planar.T for plane in planes], axis=-2)
