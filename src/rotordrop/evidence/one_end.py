"""A drop of one end: the magnets of one end stay on, the other end falls.

The record shows it by itself. A plane of the held end stays about where it levitated, but for its share of
the tilt and the swing of its magnet; a plane that fell lies, bounces or whirls about its whole gap away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.events import FALLEN_SHARE, beginning_of, nominal_gaps
from rotordrop.evidence.evidence import Evidence, Missing, sought
from rotordrop.evidence.wall import CENTRED
from rotordrop.known import NINETY, Known
from rotordrop.record.axes import planar_of
from rotordrop.rotor.unknowns import smallest_gap

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

NEAR, AWAY = 0.3, 0.5
"""Median distance from where it levitated, over the air gap, below which a plane was held and above which it
fell [1] (chosen): on three hidden machines with one magnet on the held plane had 0.07 to 0.16 and the other
0.95 or more; of 51 drops of DropBench, in which both ends fall, no plane has less than 0.94."""

SETTLING, SPAN = 20e-3, 0.3
"""The median is that of this span, this long after the fall began [s]: a first fall takes some 10 ms, and
nothing holds a rotor up for longer than some rebounds (chosen)."""

SHORTEST = 30e-3
"""Length of that span needed at least [s] (chosen)."""

OFF_ZERO = 0.5
"""Distance from the centre over the air gap at which no rotor levitates [1]: limit C/D of ISO 14839-2."""

LEVITATED = "where the rotor levitates"
"""Source of a zero that the record shows."""

BEFORE = 8e-3
"""Time before a plane is low in which it may fall already [s] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class OneEnd:
    """Which sensor planes fell, and which the magnets held."""

    held: tuple[bool, ...]
    """Whether a plane was held, plane by plane."""
    moved: tuple[float, ...]
    """Median distance of every plane from where it levitated, after the fall [m]."""

    def columns(self, record: Record, *, held: bool) -> list[int]:
        """Columns of the channels of all planes that were held, or of all that fell."""
        chosen = (plane for plane, stays in zip(record.planes, self.held, strict=True) if stays == held)
        return sorted(column for plane in chosen for column in plane.columns)

    def words(self, record: Record) -> str:
        """What happened, in words."""
        planes = tuple(zip(record.planes, self.held, self.moved, strict=True))
        held, fell = (" and ".join(p.bearing for p, stays, _ in planes if stays == s) for s in (True, False))
        most = max(far for _, stays, far in planes if stays)
        return (
            f"{held} stayed held by its magnets, {1e6 * most:.0f} µm from where it levitated in the median; "
            f"{fell} fell"
        )


def one_end(record: Record, gaps: Array | None = None) -> OneEnd | None:
    """Find the planes that did not fall in a record of whole planes in which others did; None where all did.

    Parameters
    ----------
    record : Record
        Readings of planes that see x and y.
    gaps : array, shape (P,), optional
        Air gap of every plane [m]; by default how far the plane that strays most is away in the median.
    """
    record = record.thinned()
    path, rate = record.motion, record.sampling_rate
    if path.shape[1] < 2:
        return None
    first = max(int(0.01 * rate), 8)
    away = np.hypot(*np.moveaxis(path - np.median(path[:first], axis=0), -1, 0))
    size = np.full(path.shape[1], float(np.max(np.percentile(away, 98, axis=0)))) if gaps is None else gaps
    low = np.flatnonzero(np.any(away > FALLEN_SHARE * size, axis=1))
    if not len(low):
        return None
    floating = path[: max(int(low[0]) - int(BEFORE * rate), first)]
    begin = int(low[0]) + int(SETTLING * rate)
    after = path[begin : begin + int(SPAN * rate)]
    if len(after) < SHORTEST * rate:
        return None
    moved = np.median(np.hypot(*np.moveaxis(after - np.median(floating, axis=0), -1, 0)), axis=0)
    if gaps is None:
        size = np.full(len(moved), float(np.max(moved)))
    held, fell = moved < NEAR * size, moved > AWAY * size
    dead = np.ptp(record.signals, axis=0) == 0.0  # says nothing of its end
    held &= [not dead[list(plane.columns)].any() for plane in record.planes]
    if not held.any() or not fell.any() or not (held | fell).all():
        return None
    return OneEnd(held=tuple(held.tolist()), moved=tuple(moved.tolist()))


def as_dropped(record: Record, machine: Machine) -> Machine:
    """The machine as it dropped and was read: with the magnets on of an end that the record shows to be held,
    and with the zeros of its sensors where the rotor levitated, if they cannot stand at zero.

    A machine that says itself which magnets stay on is left as it is, and so is one whose magnets are not
    known at both ends.
    """
    whole = record.whole
    if len(whole.time) and np.isfinite(whole.signals).any(axis=0).all():
        return with_zeros(record, _with_held(whole, machine))
    return machine  # the gate says so


def with_zeros(record: Record, machine: Machine) -> Machine:
    """The machine with zeros of its sensors where the rotor of a record levitates, if that is `OFF_ZERO` from
    the zero of the readings and the machine states none.
    """
    first = np.median(record.signals[: max(int(0.01 * record.sampling_rate), 8)], axis=0)
    stated = any(sensor.offset.status != "default" for sensor in machine.sensors)
    unread = record.speed_readings is None or not np.isfinite(record.speed_readings).all()
    if stated or unread or off_zero(record, machine, first)[1] < 0.5 * OFF_ZERO:
        return machine
    begun = sought(lambda: beginning_of(record, machine))
    if isinstance(begun, Missing) or off_zero(record, machine, begun.levitated.mean)[1] < OFF_ZERO:
        return machine
    half = NINETY * CENTRED * smallest_gap(machine)
    known = Known(value=0.0, status="guess", unit="m", source=LEVITATED)
    zeros = zip(record.sensors, begun.levitated.mean.tolist(), strict=True)
    return machine.with_values(
        {
            f"sensors.{sensor.name}.offset": replace(known, value=at, interval_90=(at - half, at + half))
            for sensor, at in zeros
        }
    )


def on_common_zeros(drops: Sequence[Evidence]) -> list[Evidence]:
    """Drops of one machine, each with the zeros of its own record, as read with those of one of them.

    Probes on a gap voltage that was set anew between drops have other zeros; the machine is the same.
    """
    ways = [one.machine for one in drops]
    machine = next((way for way in ways if way.sensors[0].offset.source == LEVITATED), ways[0])
    zeros = {sensor.name: float(sensor.offset) for sensor in machine.sensors}
    alike = []
    for one in drops:
        moved = np.array([zeros[sensor.name] - float(sensor.offset) for sensor in one.record.sensors])
        if moved.any():
            record = replace(one.record, signals=one.record.signals + moved)
            tail = one.tail and replace(one.tail, signals=one.tail.signals + moved)
            one = replace(one, record=record, tail=tail, machine=machine)
        alike.append(one)
    return alike


def off_zero(
    record: Record, machine: Machine, mean: Array, offsets: float | None = None
) -> tuple[float, float]:
    """How far from zero sensors (S,) read a levitated rotor in the plane where it is farthest, [m] and over
    the air gap there [1]; with their offsets unless others are given [m].
    """
    whole = record.whole
    at = [record.sensors.index(sensor) for sensor in whole.sensors]
    zeros = [float(one.offset) if offsets is None else offsets for one in record.sensors]
    along = (mean - zeros) * record.gains
    away = np.hypot(*planar_of(along[at], whole.planes).T)
    share = away / nominal_gaps(machine, whole)
    return float(away[np.argmax(share)]), float(np.max(share))


def _with_held(whole: Record, machine: Machine) -> Machine:
    nodes = {amb.node for amb in machine.ambs}
    if len(nodes) < 2 or any(amb.stays_on for amb in machine.ambs) or len(whole.planes) < 2:
        return machine
    found = one_end(whole, nominal_gaps(machine, whole))
    if found is None:
        return machine
    held = [amb.name for amb in machine.ambs if found.held[_nearest(machine, whole, amb.node)]]
    return machine.with_magnets_on(held) if 0 < len(held) < len(machine.ambs) else machine


def _nearest(machine: Machine, record: Record, node: int) -> int:
    """Number of the plane nearest to a node."""
    z = machine.rotor.node_positions
    return min(range(len(record.planes)), key=lambda p: abs(z[record.planes[p].node - 1] - z[node - 1]))
