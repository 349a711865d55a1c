"""What readings at standstill show: a rotor at the bottom of its bearings, swinging along the race."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import RecordError, UnsettledError
from rotordrop.evidence.events import nominal_gaps
from rotordrop.evidence.evidence import Missing
from rotordrop.evidence.levitated import MAINS, LevitatedModel
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.record.axes import Plane, along_sensors, planar_of
from rotordrop.record.recording import Array
from rotordrop.series import noise_by_differences
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

MOST_LEAN = 25.0
"""A rotor at rest may lie this far from straight below its levitated position [deg]."""

_SOME_LEAN = 10.0

_TURNED_LEAN = 65.0
"""A rest that leans less has turned sensors: exchanged or inverted ones turn it by a quarter [deg]."""

DEPTH = (0.6, 1.7)
"""How far it may lie below it, in nominal air gaps."""

_VISIBLE_SWING = 4e-6

_NO_DEPTH, _SAME_NOISE = 0.2, 0.2
"""A level that is not recorded: distance over the air gap, and noise over that of the record [1]."""


def check_tail(still: Record | Missing, machine: Machine, levitated: LevitatedModel) -> list[Finding]:
    """Check where the rotor came to rest and in which direction it swings.

    Parameters
    ----------
    still : Record or Missing
        Readings of the rotor at rest, in the planes whose sensors give x and y.
    machine : Machine
        The machine.
    levitated : LevitatedModel
        The readings before the drop.
    """
    if isinstance(still, Missing):
        if not isinstance(still.error, UnsettledError):
            raise still.error or RecordError(still.reason)
        return [
            Finding(
                kind=Kind.NOT_SETTLED,
                message=f"tail: {still.error.seen}",
                remedy=still.error.remedy,
                severity="stop",
            )
        ]
    path = planar_of(still.along - along_sensors(levitated.mean, still.sensors), still.planes)
    gaps = nominal_gaps(machine, still)
    if _without_level(still, path, gaps, levitated.noise):
        return [
            Finding(
                kind=Kind.AC_COUPLING,
                message="tail: the rotor rests where it levitated in all planes, with the noise that the "
                "record has too: the level is not recorded",
                remedy="record with DC coupling; a high-pass takes away where the rotor lies",
                severity="stop",
            )
        ]
    findings = []
    for number, (plane, gap) in enumerate(zip(still.planes, gaps.tolist(), strict=True)):
        findings += _place(path[:, number], plane, gap)
        findings += _swing(path[:, number], plane, still.sampling_rate)
    return findings


def _without_level(rest: Record, path: Array, gaps: Array, noise: Array) -> bool:
    """Whether a tail shows no rest although its readings are no smaller than those of the record.

    A unit that is wrong makes the noise as small as the distance, a high-pass takes the distance alone.
    """
    still = np.hypot(*np.mean(path, axis=0).T) < _NO_DEPTH * gaps
    own = np.array([noise_by_differences(column, 3) for column in rest.signals.T])
    return bool(np.all(still)) and float(np.nanmedian(own / noise)) > _SAME_NOISE


def _place(path: Array, plane: Plane, gap: float) -> list[Finding]:
    x, y = np.mean(path, axis=0)
    depth, lean = float(np.hypot(x, y)), float(np.degrees(np.arctan2(abs(x), -y)))
    names = ", ".join(plane.names)
    if not DEPTH[0] <= depth / gap <= DEPTH[1]:
        return [
            Finding(
                kind=Kind.WRONG_UNIT,
                message=f"tail: the rotor rests {format_quantity(depth, 'length')} from its levitated "
                "position, "
                f"{depth / gap:.3g} × the nominal air gap of {format_quantity(gap, 'length')}",
                remedy="correct unit, sensitivity or offset of the tail, or the nominal air gap",
                severity="stop",
                channel=names,
            )
        ]
    if _SOME_LEAN < lean <= MOST_LEAN:
        return [
            Finding(
                kind=Kind.LEANING_REST,
                message=f"tail: the rotor rests {lean:.0f}° from straight below its levitated position "
                f"(x = {x * 1e6:+.4g} µm, y = {y * 1e6:+.4g} µm)",
                remedy="check gains, angles and offsets of this plane, and whether the race is round",
                severity="warning",
                channel=names,
            )
        ]
    if lean > MOST_LEAN:
        return [
            Finding(
                kind=Kind.SWAPPED_AXES if lean > _TURNED_LEAN else Kind.TURNED,
                message=f"tail: the rotor rests at x = {x * 1e6:+.4g} µm, y = {y * 1e6:+.4g} µm from its "
                "levitated "
                f"position, {lean:.0f}° from straight below",
                remedy="correct the polarity or the angles in the machine file, or the channel map of the "
                "tail",
                severity="stop",
                channel=names,
            )
        ]
    return []


def _without_hum(path: Array, rate: float) -> Array:
    """Motion about the mean without what the mains add to it."""
    time = np.arange(len(path)) / rate
    waves = [part(2.0 * np.pi * mains * time) for mains in MAINS for part in (np.cos, np.sin)]
    design = np.column_stack([np.ones(len(path)), *waves])
    return np.asarray(path - design @ np.linalg.lstsq(design, path, rcond=None)[0])


def _swing(path: Array, plane: Plane, rate: float) -> list[Finding]:
    """A rotor that rests on the race can only swing along it: level at the bottom."""
    deviation = _without_hum(path, rate)
    values, vectors = np.linalg.eigh(deviation.T @ deviation / len(deviation))
    size = float(np.sqrt(2 * values[1]))
    if size < _VISIBLE_SWING or values[1] < 9.0 * values[0]:
        return []
    slope = float(np.degrees(np.arctan2(abs(vectors[1, 1]), abs(vectors[0, 1]))))
    if slope <= MOST_LEAN:
        return []
    return [
        Finding(
            kind=Kind.SWAPPED_CHANNELS,
            message=f"tail: at node {plane.node} the rotor swings by {format_quantity(size, 'length')} at "
            f"{slope:.0f}° to the "
            "level, but it can only swing along the race",
            remedy="a channel of this plane is inverted or belongs to the other end; correct the channel map",
            severity="stop",
            channel=", ".join(plane.names),
        )
    ]
