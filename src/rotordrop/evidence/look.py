"""What a recorded drop says by itself, with nothing known of the machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.events import expected_gap
from rotordrop.evidence.paths import (
    Drop,
    Gap,
    Impact,
    Motion,
    Path,
    Whirl,
    drops_of,
    motion_of,
    whirls_of,
    with_impacts,
)
from rotordrop.evidence.quality import Finding, Kind, check_record, stops
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.finding import ranked
from rotordrop.evidence.quality.recorder import check_blocks, check_clock
from rotordrop.evidence.rest import standstill_of
from rotordrop.evidence.synchronous import Synchronous, synchronous_motion
from rotordrop.evidence.wall import GAIN, LEVER_DOUBT
from rotordrop.files import DIGEST
from rotordrop.json_schema import DIALECT, FLAG, MAYBE, MAYBE_PAIR, NUMBER, PAIR, TEXT, TEXTS, closed, listed
from rotordrop.known import NINETY
from rotordrop.record.arrangement import Arrangement
from rotordrop.record.impacts import slope
from rotordrop.record.profile import Profile, SpeedSource, rules_of
from rotordrop.record.record import Record, open_record
from rotordrop.units import in_si

if TYPE_CHECKING:
    from rotordrop.machine import Machine

BEFORE_RELEASE = 4e-3
"""Distance from the release [s], which a look knows to about 2 ms, up to which the rotor surely floats."""

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
    """False where the record leaves it open."""
    touch: float | None
    """When the shaft first touches its race [s]; None where the record does not show it."""
    touch_interval_90: tuple[float, float] | None
    """Interval that holds it with 90 % probability [s]."""
    contact_from: float | None
    """When the last impact began, after which the rotor no longer left its race [s]."""
    largest: float
    """Largest distance from the centre [m]."""
    largest_interval_90: tuple[float, float]
    """Interval that holds it with 90 % probability [m]: centre, gain, and the bearing beside the sensors."""
    largest_time: float
    """When [s]."""
    position_index: float
    """Mean distance from the centre over the air gap, from the release on for `INDEX_WINDOW` [1]."""
    velocity_index: float | None
    """Root mean square of the velocity of the shaft centre over shaft speed times air gap, over the same time
    [1]: 1 for a rotor that runs round its whole gap once per turn. None without a speed."""

    @property
    def excess(self) -> float:
        """How far the rotor went beyond the air gap [m]."""
        return self.largest - self.gap


@dataclass(frozen=True, kw_only=True)
class Look:
    """A recorded drop at a glance."""

    record: Record
    """The readings in SI units."""
    motion: Motion
    """The path of the shaft in every plane."""
    findings: tuple[Finding, ...]
    """What the quality gate says, the worst first."""
    drops: tuple[Drop, ...]
    """Every fall in the record, with its impacts."""
    whirls: tuple[Whirl, ...]
    """Of the first drop."""
    planes: tuple[PlaneLook, ...]
    """Of the first drop."""
    standstill: float | None
    """When the shaft came to rest [s]."""
    speed: float | None
    """Shaft speed at the release [rad/s]."""
    synchronous: tuple[Synchronous, ...]
    """1X before the drop against the mark of the shaft, per plane; empty without a keyphasor."""
    notes: tuple[str, ...]
    """What was guessed."""

    @property
    def impacts(self) -> tuple[Impact, ...]:
        """Impacts of the first drop, in the order of time."""
        return self.drops[0].impacts

    @property
    def first_end(self) -> str | None:
        """The plane that is touched first; None where the planes are less apart than their errors."""
        touched = sorted(
            (plane.touch, 0.5 * (plane.touch_interval_90[1] - plane.touch_interval_90[0]), plane.plane)
            for plane in self.planes
            if plane.touch is not None and plane.touch_interval_90 is not None
        )
        if len(touched) < len(self.planes):
            return None
        for (first, error, _), (then, doubt, _) in pairwise(touched[:2]):
            if then - first <= math.hypot(error, doubt):
                return None
        return touched[0][2]

    def timeline(self) -> tuple[tuple[float, str], ...]:
        """Events in the order of time: time [s] and words."""
        events = [(float(self.record.time[0]), "record begins, rotor levitated")]
        for number, drop in enumerate(self.drops, start=1):
            events.append((drop.release, "released" if number == 1 else f"released again, drop {number}"))
            if drop.permanent_contact is not None:
                events.append((drop.permanent_contact, "last impact, in contact from here on"))
            events.append((drop.end, "lifted again" if drop.lifted else "record ends"))
        for plane in self.planes:
            if plane.touch is not None and plane.touch_interval_90 is not None:
                half = 0.5e3 * (plane.touch_interval_90[1] - plane.touch_interval_90[0])
                events.append((plane.touch, f"first touch at {plane.plane} (± {half:.2g} ms)"))
        events += [
            (
                whirl.start,
                whirl.words,
            )
            for whirl in self.whirls
        ]
        if self.standstill is not None:
            events.append((self.standstill, "standstill"))
        return tuple(sorted(events))

    def as_json(self) -> dict[str, Any]:
        """Everything as JSON-ready numbers and text, in SI units; times in record time."""
        record = self.record
        return {
            "record": record.name,
            "sha256": record.sha256,
            "channels": [
                {"name": sensor.name, "plane": sensor.bearing, "angle_rad": float(sensor.angle)}
                for sensor in record.sensors
            ],
            "sampling_rate_Hz": record.sampling_rate,
            "start_s": float(record.time[0]),
            "end_s": float(record.time[-1]),
            "speed_rad_per_s": self.speed,
            "standstill_s": self.standstill,
            "findings": [
                {
                    "kind": found.kind,
                    "severity": found.severity,
                    "channel": found.channel,
                    "time_s": found.time,
                    "message": found.message,
                    "remedy": found.remedy,
                }
                for found in self.findings
            ],
            "drops": [
                {
                    "release_s": drop.release,
                    "end_s": drop.end,
                    "permanent_contact_s": drop.permanent_contact,
                    "lifted": drop.lifted,
                }
                for drop in self.drops
            ],
            "planes": [
                {
                    "plane": plane.plane,
                    "air_gap_m": plane.gap,
                    "air_gap_interval_90_m": None
                    if plane.gap_interval_90 is None
                    else list(plane.gap_interval_90),
                    "air_gap_determined": plane.gap_determined,
                    "first_touch_s": plane.touch,
                    "first_touch_interval_90_s": (
                        None if plane.touch_interval_90 is None else list(plane.touch_interval_90)
                    ),
                    "contact_from_s": plane.contact_from,
                    "largest_displacement_m": plane.largest,
                    "largest_displacement_interval_90_m": list(plane.largest_interval_90),
                    "largest_displacement_time_s": plane.largest_time,
                    "beyond_air_gap_m": plane.excess,
                    "position_index": plane.position_index,
                    "velocity_index": plane.velocity_index,
                }
                for plane in self.planes
            ],
            "impacts": [
                {
                    "plane": impact.plane,
                    "time_s": impact.time,
                    "azimuth_rad": impact.azimuth,
                    "depth_m": impact.depth,
                    "approach_m_per_s": impact.approach,
                    "rebound_m_per_s": impact.rebound,
                }
                for impact in self.impacts
            ],
            "whirls": [
                {
                    "plane": whirl.plane,
                    "start_s": whirl.start,
                    "end_s": whirl.end,
                    "turns": whirl.turns,
                    "frequency_Hz": whirl.frequency,
                    "sense": whirl.sense,
                }
                for whirl in self.whirls
            ],
            "synchronous": [
                {
                    "plane": found.plane,
                    "amplitude_m": found.amplitude,
                    "amplitude_interval_90_m": list(found.amplitude_interval_90),
                    "phase_rad": found.phase,
                    "phase_interval_90_rad": list(found.phase_interval_90),
                    "turns": found.turns,
                }
                for found in self.synchronous
            ],
            "timeline": [{"time_s": time, "event": words} for time, words in self.timeline()],
            "notes": list(self.notes),
        }


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
        When the recording cannot be read, no channels make a plane, or nothing falls.

    Notes
    -----
    The velocity index follows the idea of the non-dimensional velocity of the shaft centre (Vval) of ISMB13,
    paper 52, the position index that of its counterpart by distance; window and normalisation are those given
    at `PlaneLook`. Displacements are those of the sensor planes.
    Not validated: impacts are those of the displacement alone, without a model of the contact.
    """
    gap = None if gap is None else in_si(gap, "length", "gap")
    speed = None if speed is None else in_si(speed, "speed", "speed")
    read, arrangement = _read(record, machine, speed, mapping, profile)
    findings = _checked(read, machine)
    blocking = [found for found in findings if found.kind in _UNREADABLE and found.severity == "stop"]
    if blocking:
        raise RecordError(f"{read.name} cannot be looked at: {blocking[0]}")
    gaps = _gaps(read, machine, gap)
    motion = motion_of(read, gaps=gaps, angles_known=arrangement is None or arrangement.angles_known)
    drops = tuple(with_impacts(motion, drop) for drop in drops_of(motion))
    if not drops:
        raise RecordError(
            f"{read.name}: the rotor does not fall from where it floated; check channels and gap"
        )
    turning = _speed_at(read, drops[0].release)
    return Look(
        record=read,
        motion=motion,
        findings=findings,
        drops=drops,
        whirls=whirls_of(motion, drops[0]),
        planes=tuple(_plane_looks(motion, drops[0], turning)),
        standstill=standstill_of(read),
        speed=turning,
        synchronous=_synchronous(read, motion, drops[0].release),
        notes=(*read.notes, *(arrangement.notes if arrangement else ()), *motion.notes),
    )


_UNREADABLE = (Kind.MISSING_SAMPLES, Kind.BACKWARD_TIME, Kind.WRONG_RATE)


def _read(
    record: str | FilePath | Record,
    machine: Machine | None,
    speed: float | None,
    mapping: Sequence[str],
    profile: Profile | str | FilePath | None,
) -> tuple[Record, Arrangement | None]:
    if isinstance(record, Record):
        return record, None
    rules = rules_of(profile, mapping)
    if speed is not None:
        rules = rules.model_copy(update={"speed": SpeedSource(constant=f"{speed!r} rad/s")})
    return open_record(record, machine, profile=rules)


def _checked(record: Record, machine: Machine | None) -> tuple[Finding, ...]:
    """Pass the gate: the whole of it with a machine, else what single channels and the clock show."""
    if machine is not None:
        return check_record(record, machine)
    damage = [
        Finding(kind=Kind.DAMAGE, message=words, remedy="copy or export it again", severity="warning")
        for words in record.warnings
    ]
    findings = damage + check_clock(record) + check_channels(record)
    return ranked(findings if stops(findings) else findings + check_blocks(record))


def _gaps(record: Record, machine: Machine | None, gap: float | None) -> tuple[Gap | None, ...]:
    """Air gaps that are given, or that a machine file expects with their doubt."""
    if gap is not None:
        return ((gap, 0.0),) * len(record.planes)
    if machine is None:
        return (None,) * len(record.planes)
    return tuple(expected_gap(machine, plane) for plane in record.planes)


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
    for path, contact_from in zip(motion.paths, drop.lasting, strict=True):
        radius = np.where(during, path.radius, 0.0)
        at = int(np.argmax(radius))
        velocity = np.hypot(*slope(path.position[window], motion.rate).T)
        index = float(np.sqrt(np.mean(velocity**2))) / (speed * path.gap) if speed else None
        wall, touch = path.wall, path.wall.touch
        touched = None if touch is None else touch.when(motion.time)
        found.append(
            PlaneLook(
                plane=path.name,
                gap=path.gap,
                gap_interval_90=wall.interval_90 if wall.gap_error > 0.0 else None,
                gap_determined=wall.determined,
                touch=touched,
                touch_interval_90=(
                    None
                    if touch is None or touched is None
                    else (touched - NINETY * touch.error, touched + NINETY * touch.error)
                ),
                contact_from=contact_from,
                largest=float(radius[at]),
                largest_interval_90=_largest_between(path, at),
                largest_time=float(motion.time[at]),
                position_index=float(np.mean(path.radius[window])) / path.gap,
                velocity_index=index,
            )
        )
    return found


def _largest_between(path: Path, at: int) -> tuple[float, float]:
    """Interval of a distance from the centre [m], 90 %: at the sensors, or at the bearing beside them."""
    here = float(path.radius[at])
    aside = float(np.hypot(*path.bearing_position[at])) - here
    outward = float(np.hypot(*(path.bearing_position - path.position)[at]))
    beside = LEVER_DOUBT / max(abs(path.wall.lever), LEVER_DOUBT) * outward
    half = NINETY * math.hypot(path.wall.centre_error.max(), GAIN * here, beside)
    return here + min(aside, 0.0) - half, here + max(aside, 0.0) + half


__all__ = ["Drop", "Impact", "Look", "PlaneLook", "Synchronous", "Whirl", "look"]


def look_schema() -> dict[str, Any]:
    """JSON Schema of a look at a record: SI units, times in record time, positive turns with the spin."""
    content = closed(
        {DIGEST: TEXT},
        record=TEXT,
        sha256=TEXT,
        channels=listed(name=TEXT, plane=TEXT, angle_rad=NUMBER),
        sampling_rate_Hz=NUMBER,
        start_s=NUMBER,
        end_s=NUMBER,
        speed_rad_per_s=MAYBE,
        standstill_s=MAYBE,
        findings=listed(
            kind=TEXT,
            severity={"enum": ["stop", "warning", "note"]},
            channel={"type": ["string", "null"]},
            time_s=MAYBE,
            message=TEXT,
            remedy=TEXT,
        ),
        drops=listed(release_s=NUMBER, end_s=NUMBER, permanent_contact_s=MAYBE, lifted=FLAG),
        planes=listed(
            plane=TEXT,
            air_gap_m=NUMBER,
            air_gap_interval_90_m=MAYBE_PAIR,
            air_gap_determined=FLAG,
            first_touch_s=MAYBE,
            first_touch_interval_90_s=MAYBE_PAIR,
            contact_from_s=MAYBE,
            largest_displacement_m=NUMBER,
            largest_displacement_interval_90_m=PAIR,
            largest_displacement_time_s=NUMBER,
            beyond_air_gap_m=NUMBER,
            position_index=NUMBER,
            velocity_index=MAYBE,
        ),
        impacts=listed(
            plane=TEXT,
            time_s=NUMBER,
            azimuth_rad=NUMBER,
            depth_m=NUMBER,
            approach_m_per_s=NUMBER,
            rebound_m_per_s=NUMBER,
        ),
        whirls=listed(
            plane=TEXT,
            start_s=NUMBER,
            end_s=NUMBER,
            turns=NUMBER,
            frequency_Hz=NUMBER,
            sense={"enum": ["forward", "backward"]},
        ),
        synchronous=listed(
            plane=TEXT,
            amplitude_m=NUMBER,
            amplitude_interval_90_m=PAIR,
            phase_rad=NUMBER,
            phase_interval_90_rad=PAIR,
            turns=NUMBER,
        ),
        timeline=listed(time_s=NUMBER, event=TEXT),
        notes=TEXTS,
    )
    head = {"$schema": DIALECT, "title": "rotordrop look"}
    return {**head, **content}
