"""The first touches of shaft and touchdown bearings, and the forces behind them, without any contact model.

Until the first touch the rotor follows the fitted fall; what deviates from it afterwards is the answer of the
free rotor to forces at its touchdown bearings. These forces are found by regularised least squares. The rotor
model is all that enters: no contact law, no friction, no support.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.release import GRID, response_at, rotor_pushed_at_bearings, tabulate_response
from rotordrop.record.recording import Array

if TYPE_CHECKING:
    from rotordrop.evidence.events import DropInstant
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

_KNOTS = 1e-4
"""Spacing of the knots between which a force runs straight [s]."""

_BEND = 0.5
"""Standard deviation of the change of slope at a knot over the weight of the rotor [1 per knot]: about a half
sine of seven times the weight in 1 ms."""

_SIZE = 8.5
"""Standard deviation of a force over the weight of the rotor [1]."""

_LEAST_SHARE = 0.15
"""A contact force counts from this share of the largest, and from three standard errors."""


@dataclass(frozen=True, kw_only=True)
class EarlyForces:
    """Forces on the rotor at its touchdown bearings during the first contacts."""

    time: Array
    """Record time [s], shape (K,)."""
    force: Array
    """Force on the rotor, x and y [N]; straight lines between the times, shape (K, B, 2)."""
    error: Array
    """Standard error of a component from noise and regularisation [N]; the rotor model counts as exact, shape
    (K, B)."""
    bearings: tuple[str, ...]
    """Names of the touchdown bearings."""


@dataclass(frozen=True, kw_only=True)
class FirstForce:
    """First force at a touchdown bearing."""

    bearing: str
    """Name of the touchdown bearing."""
    start: float
    """When the force sets in, in record time [s]."""
    end: float | None
    """When it has gone; None when it lasts beyond the forces known [s]."""
    time_error: float
    """Standard uncertainty of both [s]."""
    peak_force: float
    peak_error: float
    """Largest force and its standard error [N]."""
    azimuth: float
    """Direction of the push at the peak [rad], counter-clockwise from +x."""


def early_forces(record: Record, machine: Machine, drop: DropInstant, *, span: float = 6e-3) -> EarlyForces:
    """Find the bearing forces from the end of the free fall on.

    Parameters
    ----------
    record : Record
        The record.
    machine : Machine
        The machine; its rotor model must be right, sensor positions included.
    drop : DropInstant
        The drop with its fitted fall.
    span : float
        Time covered [s]; errors of the fall grow with it.

    Raises
    ------
    RecordError
        When the fall was fitted without a rotor model, or the sensors are too few for the bearings.
    """
    if len({amb.node for amb in machine.ambs}) < 2:
        raise RecordError(
            f"{record.name}: the first contact forces need a fall fitted by the rotor model, and the machine "
            "has "
            f"{len(machine.ambs)} AMB planes; give the AMB nodes in the machine file"
        )
    rotor = rotor_pushed_at_bearings(machine, record.planes)
    if len(record.planes) < len(rotor.force_rows):
        raise RecordError(
            f"{len(record.planes)} sensor planes cannot tell the forces of {len(rotor.force_rows)} touchdown "
            "bearings apart"
        )
    begin = drop.fall.end - 2 * _KNOTS
    keep = (record.time >= begin) & (record.time <= begin + span)
    time = record.time[keep]
    knots = np.arange(begin, min(begin + span, float(time[-1])), _KNOTS)
    deviation = (record.signals[keep] - drop.fall.predicted(time)) * record.gains
    table = tabulate_response(rotor, 2 * np.pi * drop.levitated.frequency, 0.0, span + 2 * _KNOTS)
    ramp = np.concatenate(
        [np.zeros_like(table[:1]), np.cumsum(0.5 * GRID * (table[1:] + table[:-1]), axis=0)]
    )
    columns = _columns(ramp, time, knots, record)
    weight = rotor.mass * float(machine.gravity)
    force, error = _regularised(
        columns, deviation, drop.levitated.noise * record.gains, weight, (len(knots), len(rotor.force_rows))
    )
    names = tuple(bearing.name for bearing in machine.touchdown_bearings)
    return EarlyForces(time=knots, force=force, error=error, bearings=names)


def _columns(ramp: np.ndarray, time: Array, knots: Array, record: Record) -> Array:
    """Displacement along the sensors per force at bearing and knot, x then y: shape (T · S, 2 · B · K)."""
    seen = record.directions[:, 0] - 1j * record.directions[:, 1]
    parts = []
    for knot in knots:
        since = time - knot
        hat = (
            response_at(ramp, since + _KNOTS)
            - 2 * response_at(ramp, since)
            + response_at(ramp, since - _KNOTS)
        )
        parts.append(hat[:, record.plane_of, :] * seen[None, :, None] / _KNOTS)
    stacked = np.stack(parts, axis=-1)
    both = np.concatenate([stacked.real, -stacked.imag], axis=2)
    return both.reshape(len(time) * len(seen), -1)


def _regularised(
    columns: Array, deviation: Array, noise: Array, weight: float, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Forces, shape (K, B, 2), with little change of slope, and their standard error, shape (K, B).

    Two integrations lie between a force and a reading, so fast changes of a force hardly show in it; without
    a prior on them they would be all noise. The weight [N] of the rotor sets their size.
    """
    knots, bearings = shape
    accuracy = np.tile(1.0 / noise, len(deviation))
    weighted = columns * accuracy[:, None]
    bend = np.diff(np.eye(knots), 2, axis=0) / (_BEND * weight)
    prior = np.kron(np.eye(2 * bearings), bend.T @ bend + np.eye(knots) / (_SIZE * weight) ** 2)
    normal = np.linalg.inv(weighted.T @ weighted + prior)
    solution = normal @ (weighted.T @ (deviation.reshape(-1) * accuracy))
    error = np.sqrt(np.diag(normal)).reshape(2, bearings, knots)
    force = solution.reshape(2, bearings, knots).transpose(2, 1, 0)
    return force, np.max(error, axis=0).T


def first_forces(
    record: Record, machine: Machine, drop: DropInstant, *, span: float = 6e-3
) -> tuple[FirstForce, ...]:
    """Find the first force at every touchdown bearing from the forces of `early_forces`.

    Bearings not touched within `span` of the end of the free fall are left out. Touches less than 0.3 ms
    apart count as one.
    """
    forces = early_forces(record, machine, drop, span=span)
    found = (_first(forces, index) for index in range(len(forces.bearings)))
    return tuple(contact for contact in found if contact is not None)


def _first(forces: EarlyForces, index: int) -> FirstForce | None:
    size = np.hypot(*forces.force[:, index].T)
    sigma = forces.error[:, index]
    largest = float(np.max(np.hypot(forces.force[..., 0], forces.force[..., 1])[2:-3]))
    limit = np.maximum(_LEAST_SHARE * largest, 3.0 * sigma)
    above = size > limit
    above[[0, 1, -1, -2, -3]] = False  # the last knots are hardly seen by the samples
    if not above.any():
        return None
    first = int(np.argmax(above))
    below = np.flatnonzero(~above[first:])
    last = first + int(below[0]) - 1
    peak = first + int(np.argmax(size[first : last + 1]))
    ended = last < len(size) - 4
    return FirstForce(
        bearing=forces.bearings[index],
        start=_zero_crossing(forces.time, size, first, peak),
        end=_zero_crossing(forces.time, size, last, peak) if ended else None,
        time_error=_KNOTS / 2,
        peak_force=float(size[peak]),
        peak_error=float(sigma[peak]),
        azimuth=float(np.arctan2(forces.force[peak, index, 1], forces.force[peak, index, 0])),
    )


def _zero_crossing(time: Array, size: Array, edge: int, peak: int) -> float:
    """Where the flank of a force through its outermost knots meets zero [s]."""
    inward = 1 if peak > edge else -1
    inner = edge + inward if peak != edge else edge
    rise = size[inner] - size[edge]
    reach = size[edge] / rise if rise > 0 else 1.0
    return float(time[edge] - inward * _KNOTS * min(reach, 1.0))
