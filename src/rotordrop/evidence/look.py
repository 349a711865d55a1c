"""What a recorded drop says by itself, with nothing known of the machine."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter, itemgetter
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from rotordrop.document import stated, typed
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import NothingFallsError, RecordError, UnpairedError, UsageError
from rotordrop.evidence.events import expected_gap
from rotordrop.evidence.evidence import Evidence, Missing, sought
from rotordrop.evidence.given import require_drop
from rotordrop.evidence.held import HeldContact, Level, held_contacts, level_of, masses_at
from rotordrop.evidence.impacts import AFTER_LAST, Settling, slope
from rotordrop.evidence.one_end import as_dropped, one_end
from rotordrop.evidence.paths import (
    TOO_SLOW,
    Drop,
    Gap,
    Impact,
    Motion,
    Path,
    Whirl,
    drops_of,
    held_motion,
    motion_of,
    whirls_along,
    whirls_of,
    with_impacts,
)
from rotordrop.evidence.quality import Finding, gate, not_seen, stops
from rotordrop.evidence.quality.arrangement import BEFORE_RELEASE, check_alone, check_senses, falls_aside
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.finding import found, ranked, standing
from rotordrop.evidence.quality.motion import (
    LOUD,
    check_fall,
    check_given_gap,
    check_noise,
    check_rotation_line,
    check_slow_fall,
)
from rotordrop.evidence.quality.recorder import check_blocks, check_clock, check_coupling
from rotordrop.evidence.rest import STANDSTILL, standstill_of
from rotordrop.evidence.synchronous import Synchronous, synchronous_motion
from rotordrop.evidence.wall import GAIN, LEVER_DOUBT
from rotordrop.files import DIGEST, digest_of_file
from rotordrop.json_schema import DIALECT, NUMBER, PAIR, TEXT, Schema, closed
from rotordrop.known import NINETY
from rotordrop.machine import Machine
from rotordrop.record.arrangement import Arrangement
from rotordrop.record.axes import sees_both_directions
from rotordrop.record.profile import Profile, SpeedSource, rules_of
from rotordrop.record.readers import read_recording
from rotordrop.record.record import Record, open_record
from rotordrop.require import each, require
from rotordrop.sketch import sketch
from rotordrop.units import format_quantity, in_si

LARGEST_GAP, LARGEST_SPAN = 0.1, 10.0
"""Largest length taken for an air gap, and largest span of readings that are looked at [m] (chosen): readings
taken a thousand times too large are seen by the fall."""

INDEX_WINDOW = 0.2
"""Time from the release on over which the indices are taken [s], or to the end where that comes first."""


@dataclass(frozen=True, kw_only=True)
class PlaneLook:
    """What one plane shows of a drop; displacements are those at its sensors."""

    plane: str
    """Name of the plane."""
    gap: float
    """Air gap used [m]."""
    gap_interval_90: tuple[float, float] | None
    """Interval that holds it with 90 % probability [m]; None where it was given."""
    gap_determined: bool
    """False where the record, or its noise, leaves it open."""
    noise: float
    """Scatter of a position before the drop [m]."""
    touch: float | None
    """When the shaft first touches its race [s]; None where the record does not show it."""
    touch_interval_90: tuple[float, float] | None
    """Interval that holds it with 90 % probability [s]."""
    settling: Settling
    """Its impacts, and from when on the rotor no longer left its race."""
    largest: float
    """Largest distance from the centre [m]."""
    largest_interval_90: tuple[float, float]
    """Interval that holds it with 90 % probability [m]: centre, gain, and the bearing beside the sensors."""
    largest_time: float
    """When [s]."""
    position_index: float
    """Mean distance from the centre over the air gap, from the release on for `INDEX_WINDOW` [1]."""
    position_index_interval_90: tuple[float, float]
    """Interval that holds it with 90 % probability [1], by centre and gap."""
    velocity_index: float | None
    """Root mean square of the velocity of the shaft centre over shaft speed times air gap, over the same time
    [1]: 1 for a rotor that runs round its whole gap once per turn. None without a speed."""
    velocity_index_interval_90: tuple[float, float] | None
    """Interval that holds it with 90 % probability [1], by gap and gain."""

    @property
    def excess(self) -> float:
        """How far the rotor went beyond the air gap [m]."""
        return self.largest - self.gap

    @property
    def excess_interval_90(self) -> tuple[float, float]:
        """Interval that holds it with 90 % probability [m]."""
        low, high = self.gap_interval_90 or (self.gap, self.gap)
        below = math.hypot(self.largest - self.largest_interval_90[0], high - self.gap)
        above = math.hypot(self.largest_interval_90[1] - self.largest, self.gap - low)
        return self.excess - below, self.excess + above


@dataclass(frozen=True, kw_only=True)
class Look:
    """A recorded drop at a glance."""

    record: Record
    """The readings in SI units."""
    motion: Motion
    """The path of the shaft in every plane."""
    findings: tuple[Finding, ...]
    """What the quality gate says, the worst first."""
    not_seen: str
    """What its checks cannot see of this record."""
    drops: tuple[Drop, ...]
    """Every fall in the record, with its impacts; empty where nothing falls."""
    contacts: tuple[HeldContact, ...] = ()
    """Where a race turned the rotor back though nothing falls, in the order of time."""
    levels: tuple[Level, ...] = ()
    """What every channel reads, where nothing falls."""
    no_fall: str = ""
    """Why there is no drop, in words."""
    whirls: tuple[Whirl, ...]
    """Of the first drop."""
    planes: tuple[PlaneLook, ...]
    """Of the first drop."""
    standstill: float | None
    """From when on the speed readings stay below `STANDSTILL` [s]."""
    speed: float | None
    """Shaft speed at the release [rad/s]."""
    synchronous: tuple[Synchronous, ...]
    """1X before the drop against the mark of the shaft, per plane; empty without a keyphasor."""
    notes: tuple[str, ...]
    """What was guessed."""

    def __repr__(self) -> str:
        """Record, drops and impacts of the first one."""
        speed = "" if self.speed is None else f" at {format_quantity(self.speed, 'speed')}"
        return f"<Look {self.record.name}: drops {len(self.drops)}{speed}, impacts {len(self.impacts)}>"

    def _repr_html_(self) -> str:
        heights = {path.name: (self.motion.time, path.position[:, 1]) for path in self.motion.paths}
        return sketch(repr(self), "time [s]", "vertical displacement [µm]", heights, 1e6)

    @property
    def unit_doubted(self) -> bool:
        """Whether gravity or the air gap contradict the unit of the readings, so that no length holds."""
        return _unit_doubted(self.findings)

    @property
    def impacts(self) -> tuple[Impact, ...]:
        """Impacts of the first drop, in the order of time."""
        return self.drops[0].impacts if self.drops else ()

    @property
    def first_end(self) -> str | None:
        """The plane that is touched first; None where the planes are less apart than their errors."""
        touched = sorted(
            (plane.touch, plane.touch_interval_90[1] - plane.touch, plane.plane)
            for plane in self.planes
            if plane.touch is not None and plane.touch_interval_90 is not None
        )
        if not touched or len(touched) < len(self.planes):
            return None
        (first, error, name), (then, doubt, _) = (*touched, (math.inf, 0.0, ""))[:2]
        return name if then - first > math.hypot(error, doubt) else None

    def timeline(self) -> tuple[tuple[float, str], ...]:
        """Events in the order of time: time of the record [s] and words, intervals on that clock (90 %)."""
        events = [(float(self.record.time[0]), f"record begins{', rotor levitated' if self.drops else ''}")]
        if not self.drops:
            events.append((float(self.record.time[-1]), "record ends"))
        events += [
            (one.time, f"contact at {one.plane}, {math.degrees(one.azimuth):.0f}°".replace("-", "−"))
            for one in self.contacts
        ]
        for number, drop in enumerate(self.drops, start=1):
            events.append((drop.release, "released" if number == 1 else f"released again, drop {number}"))
            last, between = drop.permanent_contact, drop.permanent_contact_interval_90
            if last is not None and between is not None:
                early, late = (1e3 * abs(end - last) for end in between)
                events.append((last, f"last impact, {AFTER_LAST} (−{early:.0f}, +{late:.0f} ms)"))
            events.append((drop.end, "lifted again" if drop.lifted else "record ends"))
        for plane in self.planes:
            if plane.touch is not None and plane.touch_interval_90 is not None:
                half = 1e3 * 0.5 * (plane.touch_interval_90[1] - plane.touch_interval_90[0])
                events.append((plane.touch, f"first touch at {plane.plane} (± {half:.2g} ms)"))
        events += [(whirl.start, whirl.words) for whirl in self.whirls]
        if self.standstill is not None:
            events.append(
                (self.standstill, f"slower than {format_quantity(STANDSTILL, 'speed')} from here on")
            )
        return tuple(sorted(events))

    def as_json(self) -> dict[str, Any]:
        """Everything as JSON-ready numbers and text, in SI units; times in record time."""
        document: dict[str, Any] = _DOCUMENT[1](self)
        return document


def look(
    record: str | FilePath | Record,
    *,
    machine: Machine | None = None,
    gap: float | str | None = None,
    speed: float | str | None = None,
    mapping: Sequence[str] = (),
    profile: Profile | str | FilePath | None = None,
) -> Look:
    """Look at a recorded drop with nothing known of the machine, or with its description.

    Parameters
    ----------
    record : path-like or Record
        The recording, or one that was read before.
    machine : Machine, optional
        Names and places the sensors and gives the air gaps.
    gap : float or str, optional
        Air gap of all planes [m], or a text such as "0.28 mm".
    speed : float or str, optional
        Shaft speed before the drop [rad/s], or a text such as "60 Hz", where the recording has none.
    mapping : sequence of str
        Planes with channels and angles, ``"NDE: X1 0 deg, Y1 90 deg"``, or sensors, ``"S_NDE_A = X1"``.
    profile : Profile or path-like, optional
        Reading rules of the recorder.

    Raises
    ------
    RecordError
        When the recording cannot be read.

    Notes
    -----
    The velocity index follows the idea of the non-dimensional velocity of the shaft centre (Vval) of ISMB13,
    paper 52, the position index that of its counterpart by distance; window and normalisation are those given
    at `PlaneLook`. Displacements are those of the sensor planes.
    Not validated: impacts are those of the displacement alone, without a model of the contact.
    Where the magnets of one end hold on, the look is of the end that falls, and its first note says so.
    Where nothing falls, the look has no drop but the contacts of a rotor that its magnets hold; where no two
    channels make a plane, it has the levels of the channels.
    """
    gap, speed = _given(record, machine, gap, speed, mapping, profile)
    try:
        read, arrangement = _read(record, machine, speed, mapping, profile)
    except UnpairedError as error:
        return _look_at_channels(FilePath(str(record)), profile, error)
    machine = None if machine is None else as_dropped(read, machine)
    evidence = None if machine is None else Evidence(record=read, machine=machine, name=read.name)
    passed = None if evidence is None else gate(evidence)
    findings = _checked(read) if passed is None else passed.findings
    blocking = [found for found in findings if found.kind in _UNREADABLE and found.severity == "stop"]
    if blocking:
        raise RecordError(f"{read.name} cannot be looked at: {blocking[0]}")
    findings, gaps = _gaps(read, evidence, gap, findings)
    guessed = (*read.notes, *(arrangement.notes if arrangement else ()))
    every = gaps
    fell, gaps = _living(read, gaps, findings)
    ends = one_end(fell, None if None in gaps else np.array([one[0] for one in gaps if one]))
    if ends is not None:
        guessed = (ends.words(fell), *guessed)
        fell = fell.of_channels(ends.columns(fell, held=False))
        gaps = tuple(one for one, stays in zip(gaps, ends.held, strict=True) if not stays)
    try:
        motion, stated = _motion_of(fell, gaps, arrangement, machine)
        if evidence is None:
            turning = _speed_at(read, float(motion.time[int(np.argmin(motion.floats))]))
            wiring = check_alone(fell, motion, turning) if stated else check_senses(fell, motion)
            findings = ranked([*findings, *wiring, *check_noise(motion, fell)])
        drops = tuple(with_impacts(motion, drop) for drop in drops_of(motion))
        if not drops:
            raise NothingFallsError(
                "the rotor does not fall from where it floated", "correct channels or gap"
            )
        turning = _speed_at(read, drops[0].release)
        if evidence is None:
            before = drops[0].release - BEFORE_RELEASE
            line = [] if turning is None else check_rotation_line(fell, before, turning)
            coupled = check_coupling(fell, None, drops[0].release)
            findings = ranked(standing([*findings, *check_fall(motion), *line, *coupled]))
        if _unit_doubted(findings):
            raise NothingFallsError("no length is known", "give the right unit")
    except NothingFallsError as error:
        unseen = not_seen(evidence, fell=False)
        notes = guessed if ends is None else guessed[1:]  # what held one end is no news where none fell
        rest = tuple(one for one in findings if one.message != error.seen)
        held = _look_at_held(read, rest, unseen, every, notes, machine, str(error))
        if held.contacts or evidence is not None or error.moved is None:
            return held
        return replace(held, findings=ranked([*rest, *check_slow_fall(*error.moved)]))
    return Look(
        record=read,
        motion=motion,
        findings=findings,
        not_seen=not_seen(evidence, passed=passed, stated=stated),
        drops=drops,
        whirls=whirls_of(motion, drops[0]),
        planes=tuple(_plane_looks(motion, drops[0], turning)),
        standstill=standstill_of(read),
        speed=turning,
        synchronous=_synchronous(fell, motion, drops[0].release),
        notes=(*guessed, *motion.notes),
    )


def _motion_of(
    record: Record, gaps: tuple[Gap | None, ...], arrangement: Arrangement | None, machine: Machine | None
) -> tuple[Motion, bool]:
    """The motion, and whether by stated angles: those in names of channels only where the fall agrees."""
    stated = arrangement is None or arrangement.angles_known
    motion = motion_of(record, gaps=gaps, angles_known=stated, machine=machine)
    if arrangement is None or not arrangement.angles_named or not falls_aside(record, motion):
        return motion, stated
    words = (
        "by the angles in the names of the channels the rotor does not fall down: they count from another "
        "axis, or the sensors are wired otherwise, and are left out"
    )
    motion = motion_of(record, gaps=gaps, angles_known=False, machine=machine)
    return replace(motion, notes=(words, *motion.notes)), False


def _given(
    record: object, machine: Machine | None, gap: object, speed: object, mapping: object, profile: object
) -> tuple[float | None, float | None]:
    """Refuse what cannot be looked at, or by what nothing is read; the gap [m] and the speed [rad/s]."""
    require(record, "record", str, PathLike, Record)
    if require(machine, "machine", Machine, none=True) is not None and isinstance(record, Record):
        require_drop(record, machine)
    told = each(mapping, "mapping", str) or profile is not None or speed is not None
    if isinstance(record, Record) and told:
        raise UsageError("speed, mapping and profile tell how a file is read; expected none with a Record.")
    gap = None if gap is None else in_si(gap, "length", "gap")
    speed = None if speed is None else in_si(speed, "speed", "speed")
    require(gap, "gap [m]", float, none=True, above=0.0, most=LARGEST_GAP)
    return gap, require(speed, "speed [rad/s]", float, none=True)


def _look_at_held(
    record: Record,
    findings: tuple[Finding, ...],
    unseen: str,
    gaps: tuple[Gap | None, ...],
    notes: tuple[str, ...],
    machine: Machine | None,
    why: str,
) -> Look:
    """A record in which nothing falls: contacts, whirl, levels; the levels alone where the unit is wrong."""
    motion = held_motion(record, gaps)
    contacts: list[HeldContact] = []
    whirls: list[Whirl] = []
    seen = [] if _unit_doubted(findings) else zip(motion.paths, record.planes, gaps, strict=True)
    for path, plane, gap in seen:
        found = held_contacts(
            path.name,
            motion.time,
            path.position,
            motion.rate,
            gap=None if gap is None else gap[0],
            masses=None if machine is None else masses_at(machine, plane.node),
        )
        contacts += found
        if found:  # a rotor runs round its race, if at all, from a contact on
            reach = min(one.distance for one in found)
            whirls += whirls_along(path, motion, reach, (found[0].time, float(motion.time[-1])))
    levels = tuple(
        level_of(name, "m", column, record.sampling_rate)
        for name, column in zip(record.channel_names, record.signals.T, strict=True)
    )
    return Look(
        record=record,
        motion=motion,
        findings=findings,
        not_seen=unseen,
        drops=(),
        contacts=tuple(sorted(contacts, key=lambda one: one.time)),
        levels=levels,
        no_fall=why,
        whirls=tuple(sorted(whirls, key=lambda whirl: whirl.start)),
        planes=(),
        standstill=standstill_of(record),
        speed=_speed_at(record, float(record.time[-1])),
        synchronous=_synchronous(record, motion, float(record.time[-1]) + BEFORE_RELEASE),
        notes=(*notes, *motion.notes),
    )


def _look_at_channels(path: FilePath, profile: Profile | str | FilePath | None, why: UnpairedError) -> Look:
    """A recording of single channels: what each reads, on the clock of the first."""
    recording = read_recording(path, rules_of(profile, ()))
    channels = [one for one in recording.channels if len(one.values) >= _FEWEST and np.ptp(one.time) > 0.0]
    if not channels:
        raise UnpairedError(
            f"{why.seen}; no channel has the {_FEWEST} readings that show a level", why.remedy
        )
    time = channels[0].time
    record = Record(
        time=time,
        signals=np.empty((len(time), 0)),
        sensors=(),
        sampling_rate=(len(time) - 1) / float(np.ptp(time)),
        path=path,
        sha256=digest_of_file(path),
        metadata=recording.metadata,
        notes=recording.notes,
        warnings=recording.warnings,
    )
    levels = tuple(
        level_of(one.label, one.unit, one.values, (len(one.time) - 1) / float(np.ptp(one.time)))
        for one in channels
    )
    return Look(
        record=record,
        motion=held_motion(record, ()),
        findings=(),
        not_seen="No check looks at channels of which no two make a plane",
        drops=(),
        levels=levels,
        no_fall=why.seen,
        whirls=(),
        planes=(),
        standstill=None,
        speed=None,
        synchronous=(),
        notes=(why.remedy, *record.notes),
    )


def _unit_doubted(findings: Iterable[Finding]) -> bool:
    return any(one.kind == "wrong unit factor" and one.severity == "stop" for one in findings)


_FEWEST = 16
"""Samples a channel needs to show a level."""

_UNREADABLE = ("missing samples", "non-monotonic time", "wrong sampling rate")


def _read(
    record: str | FilePath | Record,
    machine: Machine | None,
    speed: float | None,
    mapping: Sequence[str],
    profile: Profile | str | FilePath | None,
) -> tuple[Record, Arrangement | None]:
    if isinstance(record, Record):
        return _near(record), None
    rules = rules_of(profile, mapping)
    if speed is not None:
        rules = rules.model_copy(update={"speed": SpeedSource(constant=f"{speed!r} rad/s")})
    read, arrangement = open_record(record, machine, profile=rules)
    return _near(read), arrangement


def _near(record: Record) -> Record:
    """Refuse readings that are no lengths of a rotor in its bearings, before anything is fitted to them."""
    span = float(np.fmax.reduce(record.signals, axis=None) - np.fmin.reduce(record.signals, axis=None))
    if span > LARGEST_SPAN:
        raise RecordError(
            f"{record.name} cannot be looked at: its readings span {format_quantity(span, 'length')}, and no "
            "rotor moves so far in its bearings. Give the right unit, unit='um' of arrays or [units] of a "
            "profile"
        )
    return record


def _checked(record: Record) -> tuple[Finding, ...]:
    """Pass as much of the gate as needs no machine: what single channels and the clock show."""
    damage = [found("damage", words=words) for words in record.warnings]
    findings = damage + check_clock(record) + check_channels(record)
    return ranked(findings if stops(findings) else findings + check_blocks(record))


def _living(
    record: Record, gaps: tuple[Gap | None, ...], findings: Iterable[Finding]
) -> tuple[Record, tuple[Gap | None, ...]]:
    """The record without dead or long stuck channels and planes that they leave half blind, and its gaps."""
    lost = ("dead channel", "stuck channel", "zeroed block")
    dead = {one.channel for one in findings if one.kind in lost and one.severity == "stop"}
    living = [one for one in record.sensors if one.name not in dead]
    seeing = [sees_both_directions([s for s in living if s.node == p.node]) for p in record.planes]
    if not dead or not any(seeing):
        return record, gaps
    columns = [i for i, s in enumerate(record.sensors) if s in living and seeing[record.plane_of[i]]]
    return record.of_channels(columns), tuple(one for one, sees in zip(gaps, seeing, strict=True) if sees)


def _gaps(
    record: Record, evidence: Evidence | None, gap: float | None, findings: tuple[Finding, ...]
) -> tuple[tuple[Finding, ...], tuple[Gap | None, ...]]:
    """Air gaps that are given or that a machine file expects, with their doubt, and findings on them.

    One that was given by hand holds though the record contradicts it; what it contradicts of a machine file
    is left out.
    """
    alone = (None,) * len(record.planes)
    if gap is not None:
        own = sought(lambda: motion_of(record, gaps=alone, angles_known=True))
        said = [] if isinstance(own, Missing) else check_given_gap(own, record, gap)
        return ranked([*findings, *said]), ((gap, 0.0),) * len(record.planes)
    if evidence is None:
        return findings, alone
    walls = {} if isinstance(evidence.motion, Missing) else evidence.motion.walls
    expected = ((plane.bearing, expected_gap(evidence.machine, plane)) for plane in record.planes)
    return findings, tuple(
        None if name in walls and walls[name].contradicts(one) else one for name, one in expected
    )


def _speed_at(record: Record, release: float) -> float | None:
    if record.speed_time is None or record.speed_readings is None:
        return None
    before = record.speed_readings[record.speed_time <= release]
    chosen = before[-5:] if len(before) else record.speed_readings[:1]
    return abs(float(np.median(chosen)))


def _synchronous(record: Record, motion: Motion, release: float) -> tuple[Synchronous, ...]:
    if record.marks is None:
        return ()
    found = (
        synchronous_motion(path.name, motion.time, path.position, record.marks, release - BEFORE_RELEASE)
        for path in motion.paths
    )
    return tuple(one for one in found if one is not None)


def _plane_looks(motion: Motion, drop: Drop, speed: float | None) -> list[PlaneLook]:
    during = (motion.time >= drop.release) & (motion.time <= drop.end)
    window = during & (motion.time <= drop.release + INDEX_WINDOW)
    found = []
    for path, settling in zip(motion.at_bearings, drop.settlings, strict=True):
        radius = np.where(during, path.radius, 0.0)
        at = int(np.argmax(radius))
        velocity = np.hypot(*slope(path.position[window], motion.rate).T)
        rms = float(np.sqrt(np.mean(velocity**2)))
        index = rms / (speed * path.gap) if speed and path.noise <= LOUD else None
        wall, touch = path.wall, path.wall.touch
        narrow, wide = wall.interval_90 if wall.gap_error > 0.0 else (path.gap, path.gap)
        distance, doubt = float(np.mean(path.radius[window])), NINETY * float(wall.centre_error.max())
        gain = 0.0 if wall.gap_error > 0.0 else NINETY * GAIN  # a gap of the record has the same gain
        shares = ((1.0 - gain) * path.gap / wide, (1.0 + gain) * path.gap / narrow)
        touched = None if touch is None else touch.when(motion.time)
        found.append(
            PlaneLook(
                plane=path.name,
                gap=path.gap,
                gap_interval_90=wall.interval_90 if wall.gap_error > 0.0 else None,
                gap_determined=path.gap_determined,
                noise=path.noise,
                touch=touched,
                touch_interval_90=(
                    None
                    if touch is None or touched is None
                    else (touched - NINETY * touch.error, touched + NINETY * touch.error)
                ),
                settling=settling,
                largest=float(radius[at]),
                largest_interval_90=_largest_between(path, at, int(during.sum())),
                largest_time=float(motion.time[at]),
                position_index=distance / path.gap,
                position_index_interval_90=(
                    max(distance - doubt, 0.0) / path.gap * shares[0],
                    (distance + doubt) / path.gap * shares[1],
                ),
                velocity_index=index,
                velocity_index_interval_90=None if index is None else (index * shares[0], index * shares[1]),
            )
        )
    return found


def _largest_between(path: Path, at: int, count: int) -> tuple[float, float]:
    """Interval of the largest of so many distances from the centre [m], 90 %: at sensors or bearing beside.

    The largest of noisy readings lies above the largest distance by what the largest noise is at most.
    """
    here = float(path.radius[at])
    aside = float(np.hypot(*path.at_race(at))) - here
    outward = float(np.hypot(*(path.at_race(at) - path.position[at])))
    beside = LEVER_DOUBT / max(abs(path.wall.lever), LEVER_DOUBT) * outward
    half = NINETY * math.hypot(path.wall.centre_error.max(), GAIN * here, beside)
    below = math.hypot(half, path.noise * math.sqrt(2.0 * math.log(count / 0.05)))
    above = math.hypot(half, NINETY * path.noise)
    return max(here + min(aside, 0.0) - below, 0.0), here + max(aside, 0.0) + above


__all__ = ["Drop", "HeldContact", "Impact", "Level", "Look", "PlaneLook", "Synchronous", "Whirl", "look"]

Part = tuple[Schema, Callable[[Any], Any]]
"""A part of the document: its schema, and how it is read off."""


def _part(cls: type, keys: str, **own: Part) -> Part:
    """An object of a class, by keys as `stated` has them; ``own`` are those that no attribute is."""
    schema = typed(cls, keys, **{key: part for key, (part, _) in own.items()})
    return schema, lambda one: stated(one, keys, **{key: read(one) for key, (_, read) in own.items()})


def _rows(cls: type, path: str, keys: str, **own: Part) -> Part:
    """A list of such objects, from a field or a method."""
    schema, read = _part(cls, keys, **own)

    def rows(whole: Any) -> list[Any]:
        found = attrgetter(path)(whole)
        return [read(one) for one in (found() if callable(found) else found)]

    return {"type": "array", "items": schema}, rows


_DOCUMENT = _part(
    Look,
    "record=record.name sha256=record.sha256 simulated_record=record.is_simulated channels "
    "sampling_rate_Hz=record.sampling_rate start_s end_s speed_rad_per_s standstill_s findings not_seen "
    "no_fall drops planes impacts contacts levels whirls synchronous timeline notes",
    channels=_rows(
        Sensor,
        "record.sensors",
        "name plane=bearing angle_rad",
        angle_rad=(NUMBER, lambda sensor: float(sensor.angle)),
    ),
    start_s=(NUMBER, lambda seen: seen.record.time[0]),
    end_s=(NUMBER, lambda seen: seen.record.time[-1]),
    findings=_rows(Finding, "findings", "kind severity channel time_s message remedy"),
    drops=_rows(
        Drop,
        "drops",
        "release_s release_interval_90_s end_s permanent_contact_s permanent_contact_interval_90_s lifted",
    ),
    planes=_rows(
        PlaneLook,
        "planes",
        "plane air_gap_m=gap air_gap_interval_90_m=gap_interval_90 air_gap_determined=gap_determined "
        "first_touch_s=touch first_touch_interval_90_s=touch_interval_90 impacts "
        "impacts_interval_90=settling.count_interval_90 contact_from_s=settling.contact_from "
        "contact_from_interval_90_s=settling.contact_from_interval_90 largest_displacement_m=largest "
        "largest_displacement_interval_90_m=largest_interval_90 largest_displacement_time_s=largest_time "
        "beyond_air_gap_m=excess beyond_air_gap_interval_90_m=excess_interval_90 position_index "
        "position_index_interval_90 velocity_index velocity_index_interval_90",
        impacts=(NUMBER, lambda plane: len(plane.settling.touched)),
    ),
    impacts=_rows(
        Impact,
        "impacts",
        "plane time_s time_interval_90_s azimuth_rad azimuth_interval_90_rad depth_m depth_interval_90_m "
        "approach_m_per_s approach_bounds_m_per_s rebound_m_per_s rebound_bounds_m_per_s",
        approach_bounds_m_per_s=(PAIR, lambda hit: [hit.approach, hit.approach + TOO_SLOW]),
        rebound_bounds_m_per_s=(PAIR, lambda hit: [hit.rebound, hit.rebound + TOO_SLOW]),
    ),
    contacts=_rows(
        HeldContact,
        "contacts",
        "plane time_s azimuth_rad distance_m approach_m_per_s approach_interval_90_m_per_s departure_m_per_s "
        "departure_interval_90_m_per_s velocity_change_bounds_m_per_s=velocity_change "
        "impulse_bounds_N_s=impulse",
    ),
    levels=_rows(
        Level,
        "levels",
        "channel unit mean rms peak_to_peak resolution_Hz lines",
        lines=_rows(
            tuple,
            "lines",
            "frequency_Hz amplitude",
            frequency_Hz=(NUMBER, itemgetter(0)),
            amplitude=(NUMBER, itemgetter(1)),
        ),
    ),
    whirls=_rows(
        Whirl,
        "whirls",
        "plane start_s end_s turns turns_interval_90 frequency_Hz frequency_interval_90_Hz fastest_Hz "
        "fastest_interval_90_Hz last_Hz last_interval_90_Hz sense",
        frequency_Hz=(NUMBER, lambda one: abs(one.frequency)),
        fastest_Hz=(NUMBER, lambda one: abs(one.fastest)),
        fastest_interval_90_Hz=(PAIR, lambda one: one.interval_90(one.fastest)),
        last_Hz=(NUMBER, lambda one: abs(one.last)),
        last_interval_90_Hz=(PAIR, lambda one: one.interval_90(one.last)),
    ),
    synchronous=_rows(
        Synchronous,
        "synchronous",
        "plane amplitude_m amplitude_interval_90_m phase_rad phase_interval_90_rad turns",
    ),
    timeline=_rows(
        tuple, "timeline", "time_s event", time_s=(NUMBER, itemgetter(0)), event=(TEXT, itemgetter(1))
    ),
)
"""The document of a look: SI units, times in record time, positive turns with the spin."""


def look_schema() -> dict[str, Any]:
    """JSON Schema of a look at a record."""
    content = closed({DIGEST: TEXT}, **_DOCUMENT[0]["properties"])
    return {"$schema": DIALECT, "title": "rotordrop look", **content}
