"""Measured displacement carried from the planes of the sensors to the bearings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.machine import Machine

Array = NDArray[np.float64]

CARRIED = (
    "The measured motion is carried from the planes of the sensors to the bearings along the straight line "
    "through them; the bending in between, a few micrometres, is left out."
)


def measured_at_bearings(machine: Machine, along: Array) -> Array:
    """Displacement of the rotor at the bearings from the displacements along the sensors.

    Parameters
    ----------
    machine : Machine
        Gives the angles and nodes of the sensors and the nodes of the bearings.
    along : ndarray, shape (N, C)
        Displacement [m] in the direction of each sensor's angle, polarity, gain and offset removed.

    Returns
    -------
    ndarray, shape (N, B, 2)
        Displacement (x, y) [m] at the bearings, on the straight line through the planes of the sensors.

    Notes
    -----
    Not validated: bending between the planes of sensors and bearings is neglected; for figures only.
    """
    nodes = np.array([sensor.node for sensor in machine.sensors])
    angles = np.array([float(sensor.angle) for sensor in machine.sensors])
    planes = np.unique(nodes)
    motion = np.empty((len(along), len(planes), 2))
    for index, node in enumerate(planes):
        chosen = np.flatnonzero(nodes == node)
        directions = np.column_stack([np.cos(angles[chosen]), np.sin(angles[chosen])])
        motion[:, index] = along[:, chosen] @ np.linalg.pinv(directions).T
    return np.asarray(np.einsum("bp,npc->nbc", _line_weights(machine, planes), motion))


def _line_weights(machine: Machine, planes: NDArray[np.int64]) -> Array:
    """Weight (B, P) of every plane in the straight line at every bearing."""
    positions = np.asarray(machine.rotor.node_positions)
    at_sensors = positions[planes - 1]
    at_bearings = positions[np.array([bearing.node for bearing in machine.touchdown_bearings]) - 1]
    if len(planes) == 1:
        return np.ones((len(at_bearings), 1))
    design = np.column_stack([np.ones(len(planes)), at_sensors])
    return np.asarray(np.column_stack([np.ones(len(at_bearings)), at_bearings]) @ np.linalg.pinv(design))
