"""Between the motion of the rotor and what its displacement sensors read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import MachineFileError
from rotordrop.machine import Machine
from rotordrop.model.reduction import RotorBasis
from rotordrop.units import format_quantity

Array = NDArray[np.float64]

SMALLEST_SINGULAR_VALUE = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorMap:
    """Directions and planes of a machine's sensors.

    A sensor reads ``polarity (x cos α + y sin α) / gain + offset`` of the displacement (x, y) at its node.

    Attributes
    ----------
    names : tuple of str
        Names of the sensors (channels), in the machine's order.
    nodes : ndarray of int, shape (S,)
        Node of each sensor, counted from 1.
    directions : ndarray, shape (S, 2)
        Reading per displacement (x, y): polarity, gain (true over reading) and angle together [1].
    offsets : ndarray, shape (S,)
        Reading of the centred rotor [m].
    plane_nodes : tuple of int
        Nodes that carry sensors, from the NDE to the DE.
    """

    names: tuple[str, ...]
    nodes: NDArray[np.int64]
    directions: Array
    offsets: Array
    plane_nodes: tuple[int, ...]

    def readings(self, displacement: Array) -> Array:
        """Readings, shape (…, S) [m], of displacements (x, y) at the sensor planes, (…, P, 2) [m]."""
        place = [self.plane_nodes.index(node) for node in self.nodes]
        return np.asarray(np.sum(displacement[..., place, :] * self.directions, axis=-1) + self.offsets)

    def planar(self, readings: Array) -> Array:
        """Displacement (x, y) at the sensor planes, shape (…, P, 2) [m], of readings (…, S) [m].

        Least squares where a plane has more than two sensors.
        """
        measured = readings - self.offsets
        planes = []
        for node in self.plane_nodes:
            chosen = np.flatnonzero(self.nodes == node)
            self._check_plane(node, chosen)
            planes.append(measured[..., chosen] @ np.linalg.pinv(self.directions[chosen]).T)
        return np.stack(planes, axis=-2)

    def rows(self, basis: RotorBasis) -> Array:
        """Reading per amplitude, shape (S, 2m): amplitudes in x, then those in y; offsets left out."""
        shapes = np.array([basis.node_row(int(node)) for node in self.nodes])
        return np.hstack([self.directions[:, :1] * shapes, self.directions[:, 1:] * shapes])

    def check_resolves(self, basis: RotorBasis, modes: int) -> Array:
        """Rows (S, 2·modes) for the lowest modes of each plane, if the sensors tell them apart.

        Raises
        ------
        MachineFileError
            If the rows do not have full column rank (Neisi 2020, eq. (14): the pseudo-inverse needs it).
        """
        rows = self.rows(basis)
        chosen = np.concatenate([np.arange(modes), basis.size + np.arange(modes)])
        rows = rows[:, chosen]
        scaled = rows / np.maximum(np.linalg.norm(rows, axis=0), np.finfo(float).tiny)
        strength = np.linalg.svd(scaled, compute_uv=False)
        if len(strength) < 2 * modes or strength[-1] < SMALLEST_SINGULAR_VALUE:
            raise MachineFileError(
                self._why_not(modes, float(strength[-1]) if len(strength) == 2 * modes else 0.0)
            )
        return rows

    def _check_plane(self, node: int, chosen: NDArray[np.intp]) -> None:
        unit = self.directions[chosen] / np.linalg.norm(self.directions[chosen], axis=1)[:, None]
        strength = np.linalg.svd(unit, compute_uv=False)
        if len(chosen) < 2 or strength[-1] < SMALLEST_SINGULAR_VALUE:
            listed = ", ".join(f"{self.names[c]} at {_angle(self.directions[c])}" for c in chosen)
            raise MachineFileError(
                f"the sensors at node {node} ({listed}) see one direction only; displacement in x and y "
                "needs two sensors there whose angles differ by clearly more than 0° and less than 180°"
            )

    def _why_not(self, modes: int, strength: float) -> str:
        planes = ", ".join(f"node {node}" for node in self.plane_nodes)
        return (
            f"the {len(self.names)} sensors at {planes} cannot tell {modes} modes per plane apart (smallest "
            f"singular value {strength:.2g}, at least {SMALLEST_SINGULAR_VALUE} wanted): {modes} modes need "
            f"sensors in {modes} planes that are apart along the rotor, two directions in each"
        )


def sensor_map(machine: Machine) -> SensorMap:
    """Directions and planes of a machine's sensors."""
    sensors = machine.sensors
    if not sensors:
        raise MachineFileError(f"machine {machine.name!r} has no sensors; describe them under [[sensors]]")
    angles = np.array([float(sensor.angle) for sensor in sensors])
    factors = np.array([sensor.polarity / float(sensor.gain) for sensor in sensors])
    nodes = np.array([sensor.node for sensor in sensors], dtype=np.int64)
    return SensorMap(
        names=tuple(sensor.name for sensor in sensors),
        nodes=nodes,
        directions=factors[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]),
        offsets=np.array([float(sensor.offset) for sensor in sensors]),
        plane_nodes=tuple(int(node) for node in np.unique(nodes)),
    )


def _angle(direction: Array) -> str:
    return format_quantity(float(np.arctan2(direction[1], direction[0])), "angle")
