"""What happens when: release, impacts, whirl, permanent contact, standstill, told from displacement alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.evidence.events import FALLEN_SHARE
from rotordrop.evidence.look.motion import GRAVITY, Motion, Path, slope
from rotordrop.evidence.settled import STANDSTILL
from rotordrop.physics.whirl_spells import whirl_spells
from rotordrop.record.record import Record
from rotordrop.record.recording import Array

_NEAR = 0.85
"""An impact turns the rotor back at this share of the gap or beyond."""

_FOLLOWED = 2e-4
"""Time between the angles by which a whirl is followed [s]."""


@dataclass(frozen=True, kw_only=True)
class Impact:
    """The rotor thrown back by its touchdown bearing."""

    plane: str
    """Sensor plane."""
    time: float
    """Deepest point [s]."""
    azimuth: float
    """Direction of the contact from the centre [rad], counter-clockwise from +x."""
    depth: float
    """How far beyond the air gap the rotor went, negative for short of it [m]."""
    approach: float
    rebound: float
    """Largest radial velocity in the 2 ms before and after, by straight lines over 1 ms and so up to 5 mm/s
    too small [m/s], both positive."""


@dataclass(frozen=True, kw_only=True)
class Whirl:
    """A spell in which the rotor runs round the bearing by two turns or more."""

    plane: str
    """Sensor plane."""
    start: float
    end: float
    """When [s]."""
    turns: float
    """Turns, positive for forward whirl (with the spin), negative for backward."""
    frequency: float
    """Mean frequency [Hz]."""

    @property
    def sense(self) -> str:
        """Forward (with the spin) or backward."""
        return "forward" if self.turns > 0 else "backward"

    @property
    def words(self) -> str:
        """The spell in words."""
        turns = abs(self.turns)
        return f"{self.sense} whirl at {self.plane}, {self.frequency:.3g} Hz, {turns:.1f} turns"


@dataclass(frozen=True, kw_only=True)
class Drop:
    """One fall from levitation, to the next levitation or the end of the record."""

    release: float
    """When the rotor began to fall [s], to about 2 ms."""
    end: float
    """When it was lifted again, or the record ends [s]."""
    permanent_contact: float | None
    """From when on it no longer left its bearings until `end` [s]."""
    lifted: bool
    """Whether it was lifted again in the record."""


def drops_of(motion: Motion) -> tuple[Drop, ...]:
    """Every fall in the record: the ends of levitated spells."""
    floats = motion.floats
    ends = np.flatnonzero(floats[:-1] & ~floats[1:]) + 1
    begins = np.flatnonzero(~floats[:-1] & floats[1:]) + 1
    found = []
    for start in ends:
        later = begins[begins > start]
        stop = int(later[0]) if len(later) else len(floats)
        release = _release(motion, int(start), stop)
        if release is None:
            continue
        found.append(
            Drop(
                release=release,
                end=float(motion.time[stop - 1]),
                permanent_contact=_permanent(motion, int(start), stop),
                lifted=bool(len(later)),
            )
        )
    return tuple(found)


def _release(motion: Motion, start: int, stop: int) -> float | None:
    """When a fall of gravity began that reached a share of the gap where it did; None where nothing fell."""
    begun = []
    for path in motion.paths:
        sunk = path.levitated[1] - path.position[start - 1 : stop, 1] > FALLEN_SHARE * path.gap
        if not sunk.any():
            return None
        fallen = float(motion.time[start - 1 + int(np.argmax(sunk))])
        begun.append(fallen - float(np.sqrt(2.0 * FALLEN_SHARE * path.gap / GRAVITY)))
    return max(min(begun), float(motion.time[0]))


def _permanent(motion: Motion, start: int, stop: int) -> float | None:
    """Time after the last sample at which any plane was off its race, if the rotor stayed there for 50 ms."""
    free = np.zeros(stop - start, dtype=np.bool_)
    for path in motion.paths:
        free |= path.radius[start:stop] < path.gap - max(0.1 * path.gap, 5.0 * path.noise)
    last = np.flatnonzero(free)
    first = start + (int(last[-1]) + 1 if len(last) else 0)
    return float(motion.time[first]) if (stop - first) > 0.05 * motion.rate else None


def impacts_of(motion: Motion, drop: Drop) -> tuple[Impact, ...]:
    """Find every impact of a drop, first to last."""
    found = [impact for path in motion.paths for impact in _impacts(motion, path, drop)]
    return tuple(sorted(found, key=lambda impact: impact.time))


def _impacts(motion: Motion, path: Path, drop: Drop) -> list[Impact]:
    inside = (motion.time >= drop.release) & (motion.time <= drop.end)
    first = int(np.argmax(inside))
    radius = path.radius[inside]
    least = max(0.04 * path.gap, 6.0 * path.noise)
    speed = slope(radius, motion.rate)
    reach = max(int(2e-3 * motion.rate), 1)
    impacts = []
    for at in _peaks(radius, _NEAR * path.gap, least):
        x, y = path.position[first + at]
        before, after = speed[max(at - reach, 0) : at + 1], speed[at : at + reach + 1]
        impacts.append(
            Impact(
                plane=path.name,
                time=float(motion.time[first + at]),
                azimuth=float(np.arctan2(y, x)),
                depth=float(radius[at] - path.gap),
                approach=max(float(np.max(before)), 0.0),
                rebound=max(float(-np.min(after)), 0.0),
            )
        )
    return impacts


def _peaks(values: Array, floor: float, least: float) -> list[int]:
    """Maxima above a floor between which the values fall by at least `least`."""
    peaks: list[int] = []
    best, lowest, rising = 0, float(values[0]), True
    for i, value in enumerate(values.tolist()):
        if rising:
            if value > values[best]:
                best = i
            elif values[best] - value > least:
                if values[best] >= floor:
                    peaks.append(best)
                rising, lowest = False, value
        elif value < lowest:
            lowest = value
        elif value - lowest > least:
            rising, best = True, i
    return peaks


def whirls_of(motion: Motion, drop: Drop) -> tuple[Whirl, ...]:
    """Find the spells of a drop in which the rotor runs round, in every plane."""
    found = [whirl for path in motion.paths for whirl in _whirls(motion, path, drop)]
    return tuple(sorted(found, key=lambda whirl: whirl.start))


def _whirls(motion: Motion, path: Path, drop: Drop) -> list[Whirl]:
    inside = np.flatnonzero((motion.time >= drop.release) & (motion.time <= drop.end))
    chosen = inside[:: max(int(_FOLLOWED * motion.rate), 1)]
    spells = whirl_spells(motion.time[chosen], path.position[chosen], path.gap)
    return [
        Whirl(plane=path.name, start=s.start, end=s.end, turns=s.turns, frequency=abs(s.frequency))
        for s in spells
    ]


def standstill_of(record: Record) -> float | None:
    """When the shaft came to rest by its speed readings [s]; None where it did not or nothing tells."""
    if record.speed_time is None or record.speed_readings is None:
        return None
    slow = np.abs(record.speed_readings) <= STANDSTILL
    if not slow[-1] or slow.all():
        return None
    return float(record.speed_time[int(np.flatnonzero(~slow)[-1]) + 1])
