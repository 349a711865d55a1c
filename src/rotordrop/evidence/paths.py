"""The path of the shaft in its clearance circle, and what happens on it: told from displacement alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import NothingFallsError, RecordError
from rotordrop.evidence.events import FALLEN_SHARE, fall_accelerations, planes_at_bearings
from rotordrop.evidence.impacts import BEGUN, SMOOTHING, Settling, find_impacts
from rotordrop.evidence.touch import crossing
from rotordrop.evidence.wall import CENTRED, Wall, find_wall
from rotordrop.known import NINETY
from rotordrop.machine import Machine
from rotordrop.machine.plausibility import USUAL_GAP
from rotordrop.physics.whirl_spells import FOLLOWED_TURNS, WhirlSpell, whirl_spells
from rotordrop.record.record import Record
from rotordrop.series import MANY, in_parts, noise_by_differences, running_mean, runs_of, stride_of
from rotordrop.units import GRAVITY, fall_time

SLOWEST_FALL = 0.2
"""Share of gravity with which the fastest end of a dropped rotor falls at least [1]."""

BEYOND = 0.06
"""A kink so far beyond the air gap, over it, is not that of the first touch [1] (chosen)."""

_LASTS, _STAYS = 0.1, 0.5
"""A dropped rotor is away, on average over this time [s], by this share of its largest distance [1]; one that
its magnets catch swings back.

Chosen: a mass on magnets of 40 Hz and a tenth of critical damping that rubs for 20 ms reaches 0.37, one that
bounces half as fast as it falls 0.8.
"""

_RELEASED, _ORBIT, _LEAVES = 2e-3, 0.05, 1.1
"""Half width to which a fall from rest dates the release, length of the levitated motion whose orbit counts
[s], and how far outside that orbit, over its radius, a rotor has left it [1] (chosen)."""

DROWNED = 9e-6
"""Noise from which on an air gap is not stated that only the record shows [m] (chosen)."""

_LEAST_FALL = 0.5 * USUAL_GAP[0]
"""A dropped rotor goes at least this far [m] (chosen)."""

Gap = tuple[float, float]
"""An air gap and its standard error [m]."""


@dataclass(frozen=True, kw_only=True)
class Path:
    """Where the shaft is in one sensor plane."""

    name: str
    """Plane, by its touchdown bearing or by the names of its channels."""
    position: Array
    """Displacement from the centre of the clearance circle [m], y up, shape (N, 2)."""
    levitated: Array
    """Mean levitated position [m], shape (2,)."""
    wall: Wall
    """The clearance circle, with what the record leaves open; its centre is that of `position`."""
    noise: float
    """Standard deviation of the readings beside their motion [m]."""
    at_bearing: bool = True
    """Whether no other plane is nearer to its touchdown bearing; else the path meets no race."""
    turn: Array = field(default_factory=lambda: np.eye(2))
    """From the axes of the record to those of the path, shape (2, 2)."""
    opposite: Path | None = None
    """The path at the other end."""

    @property
    def gap(self) -> float:
        """Radius of the clearance circle [m]."""
        return self.wall.gap

    @property
    def gap_determined(self) -> bool:
        """Whether the record determines the air gap, and noise does not hide where it touches."""
        return self.wall.determined and self.noise <= DROWNED

    @property
    def radius(self) -> Array:
        """Distance from the centre [m], shape (N,)."""
        return np.hypot(self.position[:, 0], self.position[:, 1])

    def at_race(self, part: slice | int | NDArray[np.int64]) -> Array:
        """Position at the touchdown bearing, a little outside the sensors, if the shaft is straight [m]."""
        if self.opposite is None:
            return np.asarray(self.position[part])
        place = self.opposite.levitated - self.opposite.position[part]
        _turn(place, self.turn @ self.opposite.turn.T)
        place += self.position[part]
        place -= self.levitated
        place *= self.wall.lever
        place += self.position[part]
        return place


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The paths in all planes, and what had to be guessed."""

    time: Array
    rate: float
    paths: tuple[Path, ...]
    floats: NDArray[np.bool_]
    notes: tuple[str, ...]
    falls: tuple[float, ...] = ()
    """With which acceleration each plane first falls [m/s²]; empty where nothing does."""

    @property
    def walls(self) -> dict[str, Wall]:
        """The circle in which the shaft moves, by the bearing that is nearest."""
        return {path.name: path.wall for path in self.at_bearings}

    @property
    def at_bearings(self) -> tuple[Path, ...]:
        """The paths in the planes nearest to the touchdown bearings."""
        return tuple(path for path in self.paths if path.at_bearing)


def motion_of(
    record: Record, *, gaps: tuple[Gap | None, ...], angles_known: bool, machine: Machine | None = None
) -> Motion:
    """Find down, centre and gap in every plane.

    Parameters
    ----------
    record : Record
        Readings in metres.
    gaps : tuple, length P
        Air gap of every plane and its standard error [m], 0 where it counts as exact; None where it has to
        come from the record, by `find_wall`.
    angles_known : bool
        Whether the angles of the sensors are known. Where not, the fall shows where down is, and which way
        round the plane is seen follows from the orbit before it, taken as running counter-clockwise.
    machine : Machine, optional
        Tells which of several planes is nearest to a touchdown bearing; without it each is.

    Raises
    ------
    NothingFallsError
        When nothing falls.
    """
    raw, rate, stride = record.resolved(), record.sampling_rate, stride_of(len(record.time))
    begin, sunk, falls = _first_fall(raw[::stride], rate / stride)
    begin, sunk = stride * begin, stride * sunk
    # where the rotor lies: the last quarter after the fall
    rest_from = sunk + max(3 * (len(raw) - sunk) // 4, 1) if len(raw) - sunk > 8 else len(raw) - 1
    rest = np.median(raw[rest_from::stride], axis=0)
    near = set(range(raw.shape[1])) if machine is None else planes_at_bearings(machine, record)
    paths: list[Path] = []
    opposite = []
    for number, plane in enumerate(record.planes):
        position, floated = raw[:, number], np.mean(raw[:begin, number], axis=0)
        # the plane at the other end is the one that moves most unlike this
        thin = raw[::stride].swapaxes(0, 1)
        unlike = [float(np.hypot(*np.std(place - thin[number], axis=0))) for place in thin]
        opposite.append(int(np.argmax(unlike)))
        wall = find_wall(position, raw[:, opposite[-1]], rate, (begin, sunk), gaps[number])
        turn = np.eye(2) if angles_known else _upright(position[:begin][-MANY:], rest[number] - floated)
        paths.append(
            Path(
                name=plane.bearing if number in near else ", ".join(plane.names),
                at_bearing=number in near,
                position=position,
                levitated=turn @ (floated - wall.centre),
                turn=turn,
                wall=wall,
                noise=noise_by_differences(position[:MANY], 3),
            )
        )
    for path in paths:  # in place: copies of a minute would fill a gigabyte
        np.subtract(path.position, path.wall.centre, out=path.position)
        _turn(path.position, path.turn)
    for number, (path, other) in enumerate(zip(paths.copy(), opposite, strict=True)):
        path = replace(path, opposite=paths[other])
        wall, radius = path.wall, np.hypot(*path.at_race(slice(None)).T)
        if wall.touch is None or wall.touch.when(radius) > (1.0 + BEYOND) * wall.gap:
            wall = replace(wall, touch=crossing(radius, begin, rate, wall.gap, wall.gap_error))
        paths[number] = replace(path, wall=wall)
    sought = [path for path, given in zip(paths, gaps, strict=True) if given is None and path.at_bearing]
    open_ones = ", ".join(path.name for path in sought if not path.gap_determined)
    how = f"not determined by this record at {open_ones}" if open_ones else "by where the rotor touched"
    notes = [f"air gap {how} (unsure on soft supports); give it where it is known"] if sought else []
    if not angles_known:
        notes.append("vertical and sense of rotation taken from the record")
    return Motion(
        time=record.time,
        rate=rate,
        paths=tuple(paths),
        floats=where_floating(paths, rate),
        notes=tuple(notes),
        falls=falls,
    )


def held_motion(record: Record, gaps: tuple[Gap | None, ...]) -> Motion:
    """The paths of a record in which nothing falls, from where the rotor usually is."""
    paths = []
    for number, gap in enumerate(gaps):
        plane, position = record.planes[number], record.motion[:, number]
        usual = np.median(position, axis=0)
        wall = Wall(
            centre=usual,
            centre_error=np.full(2, np.nan),
            gap=np.nan if gap is None else gap[0],
            gap_error=np.nan if gap is None else gap[1],
            lever=0.0,
            touch=None,
        )
        paths.append(
            Path(
                name=plane.bearing,
                position=position - usual,
                levitated=np.zeros(2),
                wall=wall,
                noise=noise_by_differences(position[:MANY], 3),
            )
        )
    return Motion(
        time=record.time,
        rate=record.sampling_rate,
        paths=tuple(paths),
        floats=np.ones(len(record.time), dtype=np.bool_),
        notes=("displacements count from where the rotor usually is; the record shows no centre",),
    )


def _first_fall(raw: Array, rate: float) -> tuple[int, int, tuple[float, ...]]:
    """Last sample of the levitated part, first sample by which the rotor lies away from it, accelerations.

    No gap is known yet: every plane is scaled by how far it strays in all. A running mean keeps the largest
    of many noisy readings from counting as motion.
    """
    first = max(int(0.01 * rate), 8)
    raw = _calmed(raw, rate)
    away = np.column_stack([_distance(path, np.mean(path[:first], axis=0)) for path in raw.swapaxes(0, 1)])
    reach = np.percentile(away, 98, axis=0)
    usual = np.max(away[:first], axis=0)
    still = bool(np.any(reach < 4.0 * usual))
    moved = np.min(away / np.maximum(reach, 1e-15), axis=1) > FALLEN_SHARE
    sunk = int(np.argmax(moved))
    found = [fall_accelerations(path, far, rate) for path, far in zip(away.T, reach, strict=True)]
    fastest = max(float(one.max()) for one in found)
    if still or np.any(reach < 5e-6):
        ended = np.hypot(*np.median(raw[3 * len(raw) // 4 :] - np.mean(raw[:first], axis=0), axis=0).T)
        what = "as one that its magnets hold throughout, or one that was dropped before"
        if np.any(ended > np.maximum(usual, _LEAST_FALL)):
            what = (
                f"but ends {1e6 * float(np.max(ended)):.3g} µm from there: whether it falls, or was dropped "
                "before, is not determined"
            )
        raise NothingFallsError(
            f"the shaft strays by {1e6 * float(np.max([reach, usual])):.3g} µm in all and by "
            f"{1e6 * float(np.max(usual)):.3g} µm in its first 10 ms, {what}",
            "give a recording in which the rotor is let go: this one ends before that or begins after it",
            None if still else (float(np.max(reach)), fastest),
        )
    if fastest < SLOWEST_FALL * GRAVITY:
        raise NothingFallsError(
            f"the shaft moves away by {1e6 * float(np.max(reach)):.3g} µm with {fastest:.2g} m/s², as one "
            f"that swings on its bearings; a fall shows {SLOWEST_FALL * GRAVITY:.2g} m/s² or more",
            "give the recording of the drop: readings at standstill are its settled tail; if it is the drop, "
            "correct unit or sampling rate",
            (float(np.max(reach)), fastest),
        )
    window, largest = round(_LASTS * rate), np.percentile(away, 99.9, axis=0)
    if len(away) - sunk > window:
        stays = np.max(running_mean(away, window), axis=0)
        if np.all(stays < _STAYS * largest) or np.any(reach < _LEAST_FALL):
            raise NothingFallsError(
                f"the shaft moves away by {1e6 * float(np.max(largest)):.3g} µm and is back within "
                f"{1e3 * _LASTS:.0f} ms, or by {1e6 * float(np.min(reach)):.3g} µm for longer, as one that "
                f"its magnets hold; a dropped rotor goes {1e6 * _LEAST_FALL:.0f} µm at least and stays there",
                "give a recording in which the rotor is let go; if this is one, correct unit or channels",
            )
    back = int(fall_time(float(np.max(reach))) * rate) + int(3e-3 * rate)
    return max(sunk - back, first), sunk, tuple(float(one[0]) for one in found)


def _calmed(path: Array, rate: float) -> Array:
    """Running mean along the first axis over `SMOOTHING`: a fall stays as it is, noise hardly does."""
    half, mean = int(0.5 * SMOOTHING * rate), np.empty_like(path)
    for at in np.ndindex(path.shape[1:]):  # one after the other: a minute of them together fills memory
        mean[:, *at] = running_mean(np.pad(path[:, *at], half, mode="edge"), 2 * half + 1)
    return mean


def _distance(path: Array, place: Array, rate: float | None = None) -> Array:
    """Distance of a path (N, 2), or with a rate of its running mean, from a place [m], shape (N,)."""
    away = (path if rate is None else _calmed(path, rate)) - place
    return np.hypot(away[:, 0], away[:, 1])


def _turn(path: Array, turn: Array) -> None:
    """Turn the axes of a path (N, 2), in place and part by part: NumPy is slow on a long one."""
    for part in np.array_split(path, 1 + len(path) // MANY):
        part[:] = part @ turn.T


def _upright(levitated: Array, fall: Array) -> Array:
    """Rotation, or rotation with reflection, that brings the fall down and the levitated orbit forward."""
    down = fall / np.hypot(*fall)
    turn = np.array([[-down[1], down[0]], [-down[0], -down[1]]])
    path = (levitated - np.mean(levitated, axis=0)) @ turn.T
    swept = float(np.sum(path[:-1, 0] * np.diff(path[:, 1]) - path[:-1, 1] * np.diff(path[:, 0])))
    return turn if swept >= 0 else np.diag([-1.0, 1.0]) @ turn


def where_floating(paths: list[Path], rate: float) -> NDArray[np.bool_]:
    """Samples at which all planes stay near where they floated for longer than any flight between impacts."""
    near = np.ones(len(paths[0].position), dtype=np.bool_)
    for path in paths:
        size = max(0.5 * path.gap, 2.0 * float(np.hypot(*path.levitated)) if path.gap else 0.0)
        away = in_parts(_distance, path.position, path.levitated, rate, beside=int(SMOOTHING * rate))
        near &= away < min(size, 0.7 * path.gap)
    flight = 4.0 * fall_time(max(path.gap for path in paths))
    for start, length in zip(*runs_of(near), strict=True):
        if start > 0 and length < flight * rate:
            near[start : start + length] = False
    return near


_FOLLOWED = 2e-4
"""Time between the angles by which a whirl is followed [s] (chosen)."""

TOO_SLOW = 5e-3
"""By how much velocities of impacts by straight lines over 1 ms are too small at most [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Impact:
    """The rotor thrown back by its touchdown bearing."""

    plane: str
    """Sensor plane."""
    time: float
    """When it touches, by the kink of its velocity [s]."""
    azimuth: float
    """Direction of the deepest point from the centre [rad], counter-clockwise from +x."""
    depth: float
    """How far beyond the air gap the rotor went, negative for short of it [m]."""
    approach: float
    rebound: float
    """Largest radial velocity before and after, by straight lines over 1 ms and so up to `TOO_SLOW` too small
    [m/s], both positive."""
    time_interval_90: tuple[float, float]
    azimuth_interval_90: tuple[float, float]
    depth_interval_90: tuple[float, float]
    """Intervals that hold the three with 90 % probability [s], [rad], [m]: the latter by centre and gap."""


@dataclass(frozen=True, kw_only=True)
class Whirl(WhirlSpell):
    """A spell in which the rotor runs round the bearing by two turns or more."""

    plane: str
    """Sensor plane."""
    angle_error: float
    """Standard error of the direction at either end by that of the centre [rad]."""

    def interval_90(self, frequency: float, turns: float = FOLLOWED_TURNS) -> tuple[float, float]:
        """Interval that holds the size of a frequency over so many turns with 90 % probability [Hz]."""
        half = NINETY * math.sqrt(2.0) * self.angle_error / math.tau
        half *= abs(frequency) / min(abs(self.turns) - 1.0, turns)
        return abs(frequency) - half, abs(frequency) + half

    @property
    def frequency_interval_90(self) -> tuple[float, float]:
        """Interval that holds the mean frequency with 90 % probability [Hz]; it is that without the run-in,
        half a turn at either end.
        """
        return self.interval_90(self.frequency, math.inf)

    @property
    def turns_interval_90(self) -> tuple[float, float]:
        """Interval that holds the turns with 90 % probability [1]."""
        low, high = (self.turns * one / abs(self.frequency) for one in self.frequency_interval_90)
        return min(low, high), max(low, high)

    @property
    def sense(self) -> Literal["forward", "backward"]:
        """Forward (with the spin) or backward."""
        return "forward" if self.turns > 0 else "backward"

    @property
    def words(self) -> str:
        """The spell in words: how fast it is at most and in the end, where they are not the same."""

        def known(value: float, interval: tuple[float, float]) -> str:
            half = 0.5 * (interval[1] - interval[0])
            places = max(-math.floor(math.log10(half)), 0) if half > 0.0 else 2
            return f"{abs(value):.{places}f} ± {half:.{places}f}"

        most, last = self.interval_90(self.fastest), self.interval_90(self.last)
        frequency = f"{known(self.frequency, self.frequency_interval_90)} Hz"
        if most[0] > last[1]:
            frequency = f"up to {known(self.fastest, most)} Hz, {known(self.last, last)} Hz in the end"
        turns = known(self.turns, self.turns_interval_90)
        return f"{self.sense} whirl at {self.plane}, {frequency}, {turns} turns"


@dataclass(frozen=True, kw_only=True)
class Drop:
    """One fall from levitation, to the next levitation or the end of the record."""

    release: float
    """When the rotor began to fall [s]."""
    release_interval_90: tuple[float, float]
    """Interval that holds it with 90 % probability [s]."""
    end: float
    """When it was lifted again, or the record ends [s]."""
    lifted: bool
    """Whether it was lifted again in the record."""
    impacts: tuple[Impact, ...] = ()
    """In the order of time."""
    settlings: tuple[Settling, ...] = ()
    """How many impacts each plane has, and from when on the rotor stayed in contact."""

    @property
    def permanent_contact(self) -> float | None:
        """When the last impact of all began [s]; None where one plane has none."""
        known = [one.contact_from for one in self.settlings if one.contact_from is not None]
        return max(known) if known and len(known) == len(self.settlings) else None

    @property
    def permanent_contact_interval_90(self) -> tuple[float, float] | None:
        """Interval that holds it with 90 % probability [s]."""
        known = [one.contact_from_interval_90 for one in self.settlings]
        ends = [one for one in known if one is not None]
        if not ends or len(ends) < len(known):
            return None
        return max(low for low, _ in ends), max(high for _, high in ends)

    @property
    def count_interval_90(self) -> tuple[int, int]:
        """Interval that holds the number of impacts with 90 % probability, planes apart from each other."""
        below = math.hypot(*(len(one.touched) - one.count_interval_90[0] for one in self.settlings))
        above = math.hypot(*(one.count_interval_90[1] - len(one.touched) for one in self.settlings))
        return math.floor(len(self.impacts) - below), math.ceil(len(self.impacts) + above)


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
                release=release[0],
                release_interval_90=release[1],
                end=float(motion.time[stop - 1]),
                lifted=bool(len(later)),
            )
        )
    return tuple(found)


def _release(motion: Motion, start: int, stop: int) -> tuple[float, tuple[float, float]] | None:
    """When a fall of gravity began that reached a share of the gap where it did, and its interval [s].

    An unbalance flings a rotor above its bending mode aside: where it left its orbit later than by gravity,
    either may date the release. None where nothing fell.
    """
    time, begun, early, late = motion.time, [], [], []
    for path in motion.at_bearings:
        sunk = path.levitated[1] - path.position[start - 1 : stop, 1] > FALLEN_SHARE * path.gap
        if not sunk.any():
            return None
        begun.append(float(time[start - 1 + int(np.argmax(sunk))]) - fall_time(FALLEN_SHARE * path.gap))
    release = max(min(begun), float(time[0]))
    held = int(np.searchsorted(time, release - _RELEASED))
    first = max(held - int(_ORBIT * motion.rate), 0)
    for path in motion.at_bearings if held > first else ():
        away = in_parts(_distance, path.position[first:stop], path.levitated)
        reach = _LEAVES * float(np.max(away[: held - first]))
        late.append(float(time[first + int(np.argmax(away > reach))]))
        early.append(late[-1] - fall_time(2.0 * reach))
    flung = max(0.5 * (min(late) - release), 0.0) if late and release < max(early) else 0.0
    return release + flung, (release + min(flung - _RELEASED, 0.0), release + flung + max(_RELEASED, flung))


def with_impacts(motion: Motion, drop: Drop) -> Drop:
    """A drop with its impacts and the begin of lasting contact, by the rule of `find_impacts`."""
    first = int(np.searchsorted(motion.time, drop.release))
    inside = slice(first, int(np.searchsorted(motion.time, drop.end, side="right")))
    time = motion.time[inside]
    impacts, settlings = [], []
    for path in motion.at_bearings:
        hits = find_impacts(path.at_race(inside), motion.rate, path.gap, path.noise)
        touched, surely, perhaps = (time[at] for at in (hits.touched, hits.surely, hits.perhaps))
        begun = np.full(len(touched), BEGUN)
        touch, centre = path.wall.touch, NINETY * float(path.wall.centre_error.max())
        near = 3e-3 * motion.rate
        if len(touched) and touch is not None and abs(touch.sample - first - hits.touched[0]) < near:
            touched[0] = surely[0] = perhaps[0] = touch.when(motion.time)
            begun[0] = touch.error
        deepest = path.at_race(first + hits.deepest)
        each = zip(touched, begun, deepest, hits.approach, hits.rebound, strict=True)
        for begins, error, place, approach, rebound in each:
            away = float(np.hypot(*place))
            half, azimuth, depth = NINETY * float(error), float(np.arctan2(*place[::-1])), away - path.gap
            aside, doubt = centre / away, path.wall.distance_error
            impacts.append(
                Impact(
                    plane=path.name,
                    time=float(begins),
                    azimuth=azimuth,
                    depth=depth,
                    approach=float(approach),
                    rebound=float(rebound),
                    time_interval_90=(float(begins) - half, float(begins) + half),
                    azimuth_interval_90=(azimuth - aside, azimuth + aside),
                    depth_interval_90=(depth - doubt, depth + doubt),
                )
            )
        settlings.append(Settling.of(touched, surely, perhaps, drop.end))
    return replace(drop, impacts=tuple(sorted(impacts, key=lambda hit: hit.time)), settlings=tuple(settlings))


def whirls_of(motion: Motion, drop: Drop) -> tuple[Whirl, ...]:
    """Find the spells of a drop in which the rotor runs round, in every plane."""
    span = (drop.release, drop.end)
    found = [whirl for path in motion.paths for whirl in whirls_along(path, motion, path.gap, span)]
    return tuple(sorted(found, key=lambda whirl: whirl.start))


def whirls_along(path: Path, motion: Motion, reach: float, span: tuple[float, float]) -> list[Whirl]:
    """Spells between two times [s] in which the rotor runs round a circle of about a radius [m]."""
    inside = np.flatnonzero((motion.time >= span[0]) & (motion.time <= span[1]))
    chosen = inside[:: max(int(_FOLLOWED * motion.rate), 1)]
    spells = whirl_spells(motion.time[chosen], path.position[chosen], reach)
    centre = float(path.wall.centre_error.max()) / reach
    error = centre if math.isfinite(centre) else CENTRED
    return [Whirl(plane=path.name, angle_error=error, **vars(spell)) for spell in spells]


LYING = 0.7
"""Share of the air gap below which a rotor that lay on its bearings is being lifted [1]."""


def split_drops(record: Record) -> tuple[Record, ...]:
    """Cut a record into its drops, each with the levitated part before it.

    A drop ends where the rotor is lifted off its bearings again; while it is lifted, no sample belongs to any
    drop. No sample is changed.

    Parameters
    ----------
    record : Record
        The record.

    Returns
    -------
    tuple of Record
        One record per drop, named ``..._drop1`` and so on; the record itself where it holds one drop only.

    Raises
    ------
    RecordError
        When nothing falls in the record.
    """
    motion = motion_of(record, gaps=(None,) * len(record.planes), angles_known=True)
    drops = drops_of(motion)
    if not drops:
        raise RecordError(f"{record.name}: the rotor does not fall from where it floated; there is no drop")
    if len(drops) == 1:
        return (record,)
    # the rotor is back where it floated, the controller calm, with the first sample after a drop
    again = [float(motion.time[np.searchsorted(motion.time, drop.end) + 1]) for drop in drops[:-1]]
    starts = [float(record.time[0]), *again]
    return tuple(
        _cut(record, number, start, _lifted(motion, drop), len(drops))
        for number, (start, drop) in enumerate(zip(starts, drops, strict=True), start=1)
    )


def _lifted(motion: Motion, drop: Drop) -> float:
    """The last time the rotor lay on its bearings in a drop [s]."""
    if not drop.lifted:
        return drop.end
    inside = (motion.time >= drop.release) & (motion.time <= drop.end)
    lies = np.all([path.radius[inside] > LYING * path.gap for path in motion.paths], axis=0)
    at = np.flatnonzero(lies)
    return float(motion.time[inside][at[-1]]) if len(at) else drop.end


def _cut(record: Record, number: int, start: float, end: float, count: int) -> Record:
    part = record.window(start, end)
    path = record.path
    return replace(
        part,
        speed_time=_inside(record.speed_time, record.speed_time, start, end),
        speed_readings=_inside(record.speed_readings, record.speed_time, start, end),
        marks=_inside(record.marks, record.marks, start, end),
        path=None if path is None else path.with_name(f"{path.stem}_drop{number}{path.suffix}"),
        metadata={**record.metadata, "split_from": f"{record.name}, drop {number} of {count}"},
        notes=(*record.notes, f"drop {number} of {count} in {record.name}, {start:.6g} to {end:.6g} s"),
    )


def _inside(values: Array | None, time: Array | None, start: float, end: float) -> Array | None:
    """What was read between two times; where nothing was, the reading before them."""
    if values is None or time is None:
        return None
    chosen = np.flatnonzero((time >= start) & (time <= end))
    if not len(chosen):
        chosen = np.array([max(int(np.searchsorted(time, start)) - 1, 0)])
    return values[chosen]
