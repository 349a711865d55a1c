"""Which sensor is which and which way it reads: decided from gravity and the sense of the orbit.

A fall shows where down is; the levitated 1X orbit runs with the spin. Together they tell an inverted sensor
from exchanged or turned ones in every plane. Which end is which shows only in how the rotor leaves its
levitated shape, see `rotordrop.evidence.quality.fall`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.evidence.synchronous import FEWEST_TURNS
from rotordrop.record.axes import Plane, along_sensors
from rotordrop.series import MANY
from rotordrop.units import fall_time

if TYPE_CHECKING:
    from rotordrop.evidence.paths import Motion
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

Tone = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

MOST_TILT = 30.0
"""A fall may lean this far from the vertical [deg] (chosen)."""

CLEAR_ORBIT = 3.0
"""Forward over backward part of the orbit above which its sense is clear [1] (chosen)."""

CLEAR_SENSE = 0.8
"""Power of the strongest line of an orbit that runs one way round, less what runs back, over both, from which
its sense is clear without a machine [1] (chosen)."""

BEFORE_RELEASE = 4e-3
"""Distance from a release of which a look knows to 2 ms [s], up to which the rotor surely floats."""

_AFTER_FALL = 0.06
"""Time over which the change by a fall is averaged [s] (chosen)."""
_SMALLEST_ORBIT = 3e-7
"""Orbit below which its sense may be that of runout [m] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class _Change:
    """A way the sensors of a plane could be wired other than described."""

    signs: tuple[int, ...]
    order: tuple[int, ...]

    @property
    def swaps(self) -> bool:
        return self.order != tuple(sorted(self.order))

    @property
    def effort(self) -> int:
        return sum(sign < 0 for sign in self.signs) + 2 * self.swaps

    def words(self, names: tuple[str, ...]) -> str:
        inverted = [name for name, sign in zip(names, self.signs, strict=True) if sign < 0]
        moved = [name for name, place in zip(names, self.order, strict=True) if names[place] != name]
        parts = [f"{' and '.join(moved)} exchanged"] if moved else []
        parts += [f"{' and '.join(inverted)} inverted"] if inverted else []
        return ", ".join(parts)


AS_DESCRIBED = _Change(signs=(), order=())


def _changes(count: int) -> list[_Change]:
    """One or all sensors inverted, or none, combined with no or one pair exchanged; not as described."""
    signs = [tuple(-1 if i == k else 1 for i in range(count)) for k in range(-1, count)] + [(-1,) * count]
    orders = [tuple(range(count))]
    for a, b in combinations(range(count), 2):
        order = list(range(count))
        order[a], order[b] = b, a
        orders.append(tuple(order))
    return [_Change(signs=sign, order=order) for order in orders for sign in signs][1:]


def check_ends_named(machine: Machine) -> list[Finding]:
    """Find magnetic bearings and sensors that bear the name of one touchdown bearing and stand at another."""
    places, bearings = machine.rotor.node_positions, machine.touchdown_bearings
    findings = []
    for what, parts in (("AMB", machine.ambs), ("sensor", machine.sensors)):
        for one in parts:
            # one letter names an axis as well as an end
            words = re.split(r"[^A-Za-z0-9]+", one.name)
            named = [
                bearing
                for bearing in bearings
                if len(bearing.name) > 1 and any(word.startswith(bearing.name) for word in words)
            ]
            nearest = min(bearings, key=lambda bearing: abs(places[bearing.node - 1] - places[one.node - 1]))
            if named and max(named, key=lambda bearing: len(bearing.name)) is not nearest:
                findings.append((f"{what} {one.name} at node {one.node}", nearest))
    seen = ", ".join(f"{what} next to touchdown bearing {near.name}" for what, near in findings)
    return [found("names", seen=seen)] if findings else []


def check_planes(
    planes: tuple[Plane, ...],
    sunk: Array,
    levitated_1x: Tone,
    *,
    fell_straight: bool = False,
) -> list[Finding]:
    """Check polarity and order of the sensors in every plane.

    Parameters
    ----------
    planes : tuple of Plane
        Sensor planes as described.
    sunk : array, shape (S,)
        Change of the readings by the fall [m].
    levitated_1x : array, shape (S,), complex
        1X tone of the levitated readings [m].
    fell_straight : bool
        Whether the free rotor with the sensors as described explains the fall before the first contact. Then
        what leans later is the rotor, whatever exchange would make it point down.
    """
    senses = [_sense(plane, levitated_1x, AS_DESCRIBED) for plane in planes]
    down = [_tilt(plane, sunk, AS_DESCRIBED) <= MOST_TILT for plane in planes]
    if all(down) and all(sense < 0 for sense in senses):
        return [found("all-backward", channel=(name for plane in planes for name in plane.names))]
    findings = []
    for plane, sense, falls in zip(planes, senses, down, strict=True):
        if falls and sense == 0:
            names = " and ".join(plane.names)
            findings.append(found("sense", channel=plane.names, bearing=plane.bearing, names=names))
        elif not falls or sense < 0:
            findings.append(_wired_otherwise(plane, falls, sense, sunk, levitated_1x, fell_straight))
    return findings


def check_alone(record: Record, motion: Motion, speed: float | None) -> list[Finding]:
    """Check sensors whose angles were stated, without a machine: the fall, and 1X before it where it shows.

    The speed [rad/s] counts as counter-clockwise.
    """
    shown = _fall_shown(record, motion)
    if shown is None:
        return []
    begins, level, sunk = shown
    tone = np.zeros(len(level), dtype=np.complex128)
    turns = math.floor((record.time[begins] - record.time[0]) * (speed or 0.0) / (2.0 * math.pi))
    if speed and turns >= FEWEST_TURNS:
        first = int(np.searchsorted(record.time, record.time[begins] - turns * 2.0 * math.pi / speed))
        waves = np.exp(-1j * speed * record.time[first:begins])
        tone = 2.0 * np.mean((record.signals[first:begins] - level) * waves[:, None], axis=0) * record.gains
    seen = check_planes(record.planes, sunk, tone)
    return [one for one in seen if tone.any() or one.kind != "sense of the orbit"]


def falls_aside(record: Record, motion: Motion) -> bool:
    """Whether the rotor falls down in no plane by the angles of its sensors, as from another axis."""
    shown = _fall_shown(record, motion)
    return shown is not None and all(
        _tilt(plane, shown[2], AS_DESCRIBED) > MOST_TILT for plane in record.planes
    )


def _fall_shown(record: Record, motion: Motion) -> tuple[int, Array, Array] | None:
    """Sample before which the rotor floats, the level there, and its change by the fall [m], shape (S,)."""
    gone = np.flatnonzero(motion.floats[:-1] & ~motion.floats[1:])
    if not len(gone):
        return None
    sunk_at, took = int(gone[0]) + 1, fall_time(max(path.gap for path in motion.paths))
    begins = sunk_at - round((took + BEFORE_RELEASE) * record.sampling_rate)
    if begins < 2:
        return None
    level = np.mean(record.signals[:begins], axis=0)
    return begins, level, fall_of(record, level, sunk_at)


def check_senses(record: Record, motion: Motion) -> list[Finding]:
    """Compare which way round the levitated orbits run by their strongest line, where no angle was stated."""
    level = record.resolved()[: int(np.argmin(motion.floats))][-MANY:]
    if not len(level):
        return []
    moved = (level - np.mean(level, axis=0)) @ np.array([1.0, 1.0j])
    power = np.abs(np.fft.fft(moved * np.hanning(len(moved))[:, None], axis=0)) ** 2
    forward, backward = power[1 : len(power) // 2].max(axis=0), power[len(power) // 2 :].max(axis=0)
    sense = (forward - backward) / (forward + backward + 1e-300)
    if min(sense) > -CLEAR_SENSE or max(sense) < CLEAR_SENSE:
        return []
    names = [plane.bearing for plane in record.planes]
    one, other = (", ".join(np.compress(side * sense > 0.0, names)) for side in (1, -1))
    return [found("senses", one=one, other=other)]


def _corrected(plane: Plane, readings: Array | Tone, change: _Change) -> Tone:
    """Motion (x, y) of the plane as it would be read had the sensors been wired as described."""
    own = readings[list(plane.columns)]
    if change != AS_DESCRIBED:
        own = own[list(change.order)] * np.array(change.signs)
    return np.asarray(plane.to_planar @ own)


def _tilt(plane: Plane, sunk: Array, change: _Change) -> float:
    """Angle between the fall and straight down [deg]."""
    x, y = _corrected(plane, sunk, change).real
    return float(np.degrees(np.arctan2(abs(x), -y)))


def _sense(plane: Plane, tone: Tone, change: _Change) -> int:
    """1 for an orbit with the spin, −1 against it, 0 where it is too flat or small to tell."""
    x, y = _corrected(plane, tone, change)
    forward, backward = abs(x + 1j * y) / 2, abs(x - 1j * y) / 2
    if max(forward, backward) < _SMALLEST_ORBIT:
        return 0
    if forward > CLEAR_ORBIT * backward:
        return 1
    return -1 if backward > CLEAR_ORBIT * forward else 0


def _wired_otherwise(
    plane: Plane, falls: bool, sense: int, sunk: Array, tone: Tone, fell_straight: bool
) -> Finding:
    own = ", ".join(
        f"{name} by {sunk[i] * 1e6:+.3g} µm" for name, i in zip(plane.names, plane.columns, strict=True)
    )
    seen = f"the fall changes {own} and so leans {_tilt(plane, sunk, AS_DESCRIBED):.0f}° from straight down"
    if falls:
        seen = f"the fall changes {own}, but the levitated orbit at {plane.bearing} runs against the spin"
    fitting = [
        change
        for change in _changes(len(plane.columns))
        if _tilt(plane, sunk, change) <= MOST_TILT and _sense(plane, tone, change) >= 0
    ]
    if not fitting:
        why = "; no exchange or inversion explains it"
        return found("leaning", channel=plane.names, seen=seen, why=why)
    if fell_straight and sense >= 0:
        why = ", but before the first contact the rotor falls as described"
        return found("leaning", channel=plane.names, seen=seen, why=why)
    least = min(change.effort for change in fitting)
    simplest = [change for change in fitting if change.effort == least]
    kind = "swapped axes" if all(change.swaps for change in simplest) else None
    named = [
        name
        for i, name in enumerate(plane.names)
        if any(change.signs[i] < 0 or change.order[i] != i for change in simplest)
    ]
    causes = " or ".join(change.words(plane.names) for change in simplest)
    return found("inverted", kind=kind, channel=named, seen=seen, causes=causes)


def fall_of(record: Record, level: Array, sunk_at: int) -> Array:
    """Change of the readings by the fall, as true displacement along the sensors, shape (S,).

    Averaged over 60 ms from the fall on: at high speed the first milliseconds lead sideways as much as down.
    """
    last = sunk_at + max(int(_AFTER_FALL * record.sampling_rate), 1)
    mean = np.mean(record.signals[sunk_at:last], axis=0)
    return along_sensors(mean, record.sensors) - along_sensors(level, record.sensors)
