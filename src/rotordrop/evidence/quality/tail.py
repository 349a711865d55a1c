"""What readings at standstill show: a rotor at the bottom of its bearings, swinging along the race."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError, UnsettledError
from rotordrop.evidence.events import nominal_gaps, planes_at_bearings
from rotordrop.evidence.evidence import Missing
from rotordrop.evidence.levitated import MAINS, LevitatedModel
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.record.axes import Plane, along_sensors, planar_of
from rotordrop.series import noise_by_differences
from rotordrop.units import GRAVITY, format_quantity

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

MOST_LEAN = 25.0
"""A rotor at rest may lie this far from straight below its levitated position [deg] (chosen)."""

_SOME_LEAN = 10.0
"""From this lean on it is worth a word [deg] (chosen)."""

_TURNED_LEAN = 65.0
"""A rest that leans less has turned sensors: exchanged or inverted ones turn it by a quarter [deg]."""

DEPTH = (0.6, 1.7)
"""How far it may lie below it, in nominal air gaps (chosen)."""

_VISIBLE_SWING = 4e-6
"""Amplitude of a swing whose direction shows [m] (chosen): some times the noise of a good sensor."""

_BOUNCES = 1.4
"""Frequency over that of a small swing in the air gap from which no rotor swings along its race [1]: swings
of 4 machines have 0.75 to 1.03, bounces on their supports 1.7 and more."""

_NO_DEPTH, _SAME_NOISE = 0.2, 0.2
"""A level that is not recorded: distance over the air gap, and noise over that of the record [1]."""


_LATE = 0.2
"""Time at the end of a record in which the rotor's path is compared with its rest [s]: several swings."""

_NEAR_REST, _PASSED = 0.06, 50
"""Distance aside over the air gap within which the path is near the rest: the race rises by 0.2 % of the gap
there; and samples there that say how low the rotor passes [1]."""

_BAND = (5.0, 95.0)
"""Share of them by height [%] between which the rest should lie."""

_OFF_PATH, _OTHER_DROP = 0.02, 0.04
"""Distance of the rest from there over the air gap that is named, and from which on nothing is estimated with
the tail [1]: 0.5 % at most in 60 clean drops of all rotors."""

_PRESSED = 5.0
"""By how much of the sag a rotor that runs through the lowest point is pressed below its rest, over its
centrifugal acceleration there in gravities [1]: of 60 clean drops of all rotors one in a hundred planes needs
more than 3, as its supports are softer than described and it bounces too."""


def check_tail(
    still: Record | Missing, machine: Machine, levitated: LevitatedModel, record: Record
) -> list[Finding]:
    """Check where the rotor came to rest and in which direction it swings.

    Parameters
    ----------
    still : Record or Missing
        Readings of the rotor at rest, in the planes whose sensors give x and y.
    machine : Machine
        The machine.
    levitated : LevitatedModel
        The readings before the drop.
    record : Record
        The record of the drop.
    """
    if isinstance(still, Missing):
        if not isinstance(still.error, UnsettledError):
            raise still.error or RecordError(still.reason)
        return [found("not-settled", seen=still.error.seen, way_out=still.error.remedy)]
    path = planar_of(still.along - along_sensors(levitated.mean, still.sensors), still.planes)
    gaps = nominal_gaps(machine, still)
    if _without_level(still, path, gaps, record.window(levitated.start, levitated.end)):
        return [found("coupling-of-tail")]
    findings = []
    for number, (plane, gap) in enumerate(zip(still.planes, gaps.tolist(), strict=True)):
        findings += _place(path[:, number], plane, gap)
        findings += _swing(path[:, number], plane, still.sampling_rate, gap)
    return findings


def check_rest_in_record(
    still: Record, record: Record, machine: Machine, floating: Array, sag: float, drop: float = -np.inf
) -> list[Finding]:
    """See whether the rotor, while it still turned, passed the place where the tail says that it rests.

    A rotor that rolls or slides in its bearing passes the lowest point of the race again and again, pressed
    against it by its weight and, the faster it runs, by more.

    Parameters
    ----------
    still, record : Record
        Readings at rest and of the drop, in the planes whose sensors give x and y.
    machine : Machine
        The machine.
    floating : array, shape (S,)
        Readings of the levitated rotor [m].
    sag : float
        By how much the supports give way under the weight [m].
    drop : float
        When the rotor was let go, in record time [s]: what it does just then shows no rest.
    """
    begin = float(record.time[-1]) - _LATE
    if still.sensors != record.sensors or begin < drop:
        return []
    late = record.window(begin, np.inf)
    level = along_sensors(floating, record.sensors)
    path, rest = (planar_of(one.along - level, one.planes) for one in (late, still))
    gaps = nominal_gaps(machine, record)
    # between the bearings a turning rotor bends, and no race is passed
    for plane in set(range(len(gaps))) - planes_at_bearings(machine, record):
        path[:, plane], rest[:, plane] = np.nan, np.nan
    lowest, rate = np.mean(rest, axis=0), record.sampling_rate
    off, seen = (_off_the_path(path, lowest, gaps, gives, rate) for gives in (sag, 0.0))
    if not np.any(np.abs(off) > _OFF_PATH * gaps):
        return []
    seen[np.abs(off) <= 0.5 * _OFF_PATH * gaps] = 0.0
    # ends that are exchanged rest too high at one and too low at the other
    for first, second in combinations(np.flatnonzero(np.abs(off) > 0.5 * _OFF_PATH * gaps).tolist(), 2):
        order = list(range(len(gaps)))
        order[first], order[second] = second, first
        if np.all(np.abs(_off_the_path(path, lowest[order], gaps, sag, rate)) <= _OFF_PATH * gaps):
            one, other = (record.planes[i].names for i in (first, second))
            exchanged = {"first": " and ".join(one), "second": " and ".join(other)}
            words = {"off": _in_words(seen, record), "late": _LATE, **exchanged}
            return [found("ends-of-tail", words, channel=(*one, *other))]
    worst = int(np.argmax(np.abs(off) / gaps))
    return [
        found(
            "offset",
            severity="stop" if abs(off[worst]) > _OTHER_DROP * gaps[worst] else "warning",
            channel=record.planes[worst].names,
            off=_in_words(seen, record),
            within=abs(seen[worst]) - abs(off[worst]) + _OFF_PATH * gaps[worst],
            late=_LATE,
        )
    ]


def _in_words(off: Array, record: Record) -> str:
    """How far the rest lies off in every plane."""
    words = [
        f"{format_quantity(abs(float(size)), 'length')} {'lower' if size > 0 else 'higher'} at node "
        f"{plane.node}"
        for size, plane in zip(off, record.planes, strict=True)
        if size != 0.0
    ]
    return ", ".join(words)


def _off_the_path(path: Array, rest: Array, gaps: Array, sag: float, rate: float) -> Array:
    """How far the path passes above the rest [m], per plane; 0 where it passes through it or never near.

    It may pass below it by what a rotor that runs there at its speed is pressed down beyond its weight.
    """
    off = np.zeros(len(gaps))
    for plane, gap in enumerate(gaps):
        near = np.abs(path[:, plane, 0] - rest[plane, 0]) < _NEAR_REST * gap
        if int(np.sum(near)) < _PASSED:
            continue
        low, high = np.percentile(path[near, plane, 1] - rest[plane, 1], _BAND)
        speed = rate * np.gradient(path[:, plane, 0])[near]
        gravities = float(np.mean(speed**2)) / (gap * GRAVITY)
        off[plane] = max(low, 0.0) + min(high + _PRESSED * gravities * sag, 0.0)
    return off


def _without_level(rest: Record, path: Array, gaps: Array, floating: Record) -> bool:
    """Whether a tail shows no rest although its readings are no smaller than those of the record.

    A unit that is wrong makes the noise as small as the distance, a high-pass takes the distance alone.
    """
    still = np.hypot(*np.mean(path, axis=0).T) < _NO_DEPTH * gaps
    own, noise = (
        np.array([noise_by_differences(column, 3) for column in one.signals.T]) for one in (rest, floating)
    )
    return bool(np.all(still)) and float(np.nanmedian(own)) > _SAME_NOISE * float(np.nanmedian(noise))


def _place(path: Array, plane: Plane, gap: float) -> list[Finding]:
    x, y = np.mean(path, axis=0)
    depth, lean = float(np.hypot(x, y)), float(np.degrees(np.arctan2(abs(x), -y)))
    if not DEPTH[0] <= depth / gap <= DEPTH[1]:
        return [found("unit-of-tail", channel=plane.names, depth=depth, ratio=depth / gap, gap=gap)]
    if lean <= _SOME_LEAN:
        return []
    row = "leaning-rest" if lean <= MOST_LEAN else "turned-tail"
    kind = "swapped axes" if lean > _TURNED_LEAN else None
    return [found(row, kind=kind, channel=plane.names, lean=lean, x=1e6 * x, y=1e6 * y)]


def _without_hum(path: Array, rate: float) -> Array:
    """Motion about the mean without what the mains add to it."""
    time = np.arange(len(path)) / rate
    waves = [part(2.0 * np.pi * mains * time) for mains in MAINS for part in (np.cos, np.sin)]
    design = np.column_stack([np.ones(len(path)), *waves])
    return np.asarray(path - design @ np.linalg.lstsq(design, path, rcond=None)[0])


def _swing(path: Array, plane: Plane, rate: float, gap: float) -> list[Finding]:
    """A rotor that rests on the race can only swing along it: level at the bottom, and slowly."""
    deviation = _without_hum(path, rate)
    values, vectors = np.linalg.eigh(deviation.T @ deviation / len(deviation))
    size = float(np.sqrt(2 * values[1]))
    if size < _VISIBLE_SWING or values[1] < 9.0 * values[0]:
        return []
    slope = float(np.degrees(np.arctan2(abs(vectors[1, 1]), abs(vectors[0, 1]))))
    if slope <= MOST_LEAN:
        return []
    power = np.abs(np.fft.rfft(deviation @ vectors[:, 1]))
    frequency = float(np.argmax(power)) * rate / len(deviation)
    if 2.0 * np.pi * frequency > _BOUNCES * np.sqrt(GRAVITY / gap):
        seen = f"at node {plane.node} the rotor still bounces by {format_quantity(size, 'length')}"
        way_out = "give a later tail, of the rotor at rest"
        return [found("not-settled", severity="warning", seen=f"{seen}; {way_out}", way_out=way_out)]
    return [found("swing", channel=plane.names, node=plane.node, size=size, slope=slope)]
