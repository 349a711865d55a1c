"""Which channels of a recording look at the shaft in which plane, by their names or as it was said."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import UnpairedError, UsageError, mapped
from rotordrop.known import Known
from rotordrop.record.clock import TIME_UNITS
from rotordrop.record.profile import Profile
from rotordrop.record.recording import (
    FULL_SCALE,
    Channel,
    Recording,
    channels_in_words,
    known_unit,
    listed,
    plain_name,
)
from rotordrop.units import is_unit, parse_quantity

_FAR = re.compile(r"NDE|NAS", re.IGNORECASE)
"""The end away from the drive in names of planes and bearings, English and German."""

One = TypeVar("One")


def far_end_first(things: Iterable[One], name: Callable[[One], str]) -> list[One]:
    """The things with those first whose name is of the end away from the drive, else in their order."""
    return sorted(things, key=lambda one: not _FAR.search(name(one)))


_LENGTHS = ("m", "mm", "um", "nm", "mil", "in", "V", "mV", FULL_SCALE, "")
_AXES = ("XY", "HV", "UW", "VW", "LR", "+-", "AB", "12")
"""Letters of two axes, the surest first: A and B may be bearings, 1 and 2 anything."""

_WORDS = {
    "H": r"horiz(?:ontal)?|hor|waager?echt|waagrecht",
    "V": r"vert(?:ical|ikal)?|ver|senkrecht",
    "L": r"left|links",
    "R": r"right|rechts",
}
_SPOKEN = {
    letter: re.compile(rf"(?<![^\W_])(?:{words})(?![^\W_])", re.IGNORECASE)
    for letter, words in _WORDS.items()
}

_COUNTER = re.compile(
    r"^(?:(?:channel|chan|ch|kanal|input|in|ai|voie|trace|#)[ _.#:-]*)?"
    r"[(\[]?\d{1,3}[)\]]?[ _.:;/|-]+(?=.*[^\W\d_])",
    re.IGNORECASE,
)
"""A number of the channel in front of its tag, as in "Ch1 VE-101X", "3:NDE X", "[2] X"."""

_ANGLE = re.compile(
    r"(?P<angle>(?:(?<![^\s(@])[+-])?\d{1,3}(?:\.\d+)?(?= ?(?:°|deg\b))"
    r"|(?:(?<=[ _])|(?<=\w-))(?:0|45|90|135|180|225|270|315)$)(?: ?(?:°|deg\b))?",
    re.IGNORECASE,
)
"""An angle in a name, as in "DE 45°", "NDE_135deg", "DE (-45°)"; of eighths at its end, "NDE_135"."""

_SENSOR = re.compile(r"^(?:S|P|CH|SENSOR|PROBE)[ _-]", re.IGNORECASE)
_LONGEST_UNIT = 30
"""Characters of a unit of displacements that is not known (chosen)."""

_COUNTED = re.compile(r"(?P<word>.*?)(?P<number>\d{1,3}|(?<![^\W_])[a-d])", re.IGNORECASE)
"""A name that may only count channels: CH1, C2, Channel A, Sensor 3, 4."""

_NO_READING = re.compile(
    r"(status|state|flags?|alarm|trigger|valid|quality|counter|index|event)\b", re.IGNORECASE
)
_KKS = re.compile(r"[A-Z]{3}\d{2} ?C[A-Z]\d{2}$", re.IGNORECASE)
"""End of a tag of a power station (KKS) before the last digit of its measuring point, "10MKA11CY01"."""

_ENTRY = re.compile(r"\s*(?P<channel>.+?)(?:\s+(?P<angle>[+-]?[0-9.]+\s*(?:°|deg|rad)))?\s*")
_SAME_ANGLE = math.radians(3.0)
"""How far a given angle and that of the machine may differ to be the same sensor (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Arrangement:
    """Sensors made for the channels of a recording, and what was guessed about them."""

    sensors: tuple[Sensor, ...]
    """One per channel used; the node numbers the plane, counted from 1."""
    channels: Mapping[str, str]
    """Name of a sensor -> label of its channel."""
    angles_known: bool
    """Whether the angles were given; else two sensors of a plane are taken as perpendicular."""
    notes: tuple[str, ...]
    """Guesses in words."""
    angles_named: bool = False
    """Whether the angles are those that the names of the channels tell."""


def arrangement_of(recording: Recording, profile: Profile) -> Arrangement:
    """Planes of a recording: those of the profile, else pairs by its names for channels or the file's."""
    known = False
    notes: tuple[str, ...] = ()
    if profile.planes:
        planes = given_planes(recording, profile)
        known = all(angle is not None for _, entries in planes for _, angle in entries)
    else:
        named = {name: fitting(recording.channels, label) for name, label in profile.channels.items()}
        called = {id(hits[0]): name for name, hits in named.items() if len(hits) == 1}
        pairs, guessed = pairs_of(recording.channels, lambda channel: called.get(id(channel), channel.name))
        planes = [(name, [*zip(pair, _angles(pair), strict=True)]) for name, pair, _ in pairs]
        known = all(angle is not None for _, entries in planes for _, angle in entries)
        how = "" if known else ", sensors 90° apart"
        notes = (f"planes {'and angles' if known else 'guessed'} by the {guessed} of the channels{how}",)
        paired = {id(channel) for _, pair, _ in pairs for channel in pair}
        left = [c.label for c in recording.channels if _may_read(c) and id(c) not in paired]
        left = [label for label in left if label not in (profile.speed.channel, profile.speed.pulses)]
        if pairs and left:
            ask = f"say which look at one, as {mapped('PLANE: CHANNEL 0 deg, CHANNEL 90 deg')}"
            notes += (f"in no plane, and not looked at: {listed(left)}; {ask}",)
    if not planes:
        labels = [channel.label for channel in recording.channels if _may_read(channel)]
        if len(labels) < 2:
            have = listed(f"{channel.label} in {channel.unit or '?'}" for channel in recording.channels)
            raise UnpairedError(
                f"the recording holds {channels_in_words(len(labels))} that can be displacements (in a unit "
                f"of length or in volts), and a plane needs two; it has {have}",
                "export the displacements of a plane together, or say their unit where the file has another "
                "('rotordrop profile --unit um')",
            )
        as_listed = mapped(*(f"{end}: {two}" for end, two in planes_as_listed(recording).items()))
        raise UnpairedError(
            f"no two channels of {listed(channel.label for channel in recording.channels)} are a pair by "
            "their names (X and Y, A and B, H and V, left and right)",
            f"say which look at one plane: if they are listed in pairs, {as_listed}; angles that are known "
            f'go with their channels ("{labels[0]} 45 deg")',
        )
    sensors = [
        Sensor.model_construct(
            name=channel.name,
            node=number,
            angle=Known(value=place * math.pi / 2 if angle is None else angle, unit="rad"),
            gain=Known(value=1.0),
            offset=Known(value=0.0, unit="m"),
            bearing=name,
            position_error=Known(value=0.0, unit="m"),
        )
        for number, (name, entries) in enumerate(planes, start=1)
        for place, (channel, angle) in enumerate(entries)
    ]
    labels = [channel.label for _, entries in planes for channel, _ in entries]
    return Arrangement(
        sensors=tuple(sensors),
        channels={sensor.name: label for sensor, label in zip(sensors, labels, strict=True)},
        angles_known=known,
        notes=notes,
        angles_named=known and not profile.planes,
    )


def planes_as_listed(recording: Recording) -> dict[str, str]:
    """Planes and their channels, were these listed in pairs: what is asked where no names tell."""
    labels = [channel.label for channel in recording.channels if _may_read(channel)]
    by_two = list(zip(labels[::2], labels[1::2], strict=False))
    ends = ("NDE", "DE") if len(by_two) == 2 else [f"plane {k + 1}" for k in range(len(by_two))]
    return {end: ", ".join(two) for end, two in zip(ends, by_two, strict=True)}


def seats(channels: Sequence[Channel], sensors: Sequence[Sensor]) -> list[Sensor]:
    """The sensor of each channel of a plane whose angles are not told: by their names, or in their order.

    Sensors named by the axes of their channels tell; else X stands a quarter turn before Y,
    counter-clockwise, the right probe before the left.
    """
    if len(channels) != len(sensors) or len(sensors) != 2:
        return list(sensors)
    by_angle = [_at_angle(sensors, told_by(channel)[1]) for channel in channels]
    if all(by_angle) and by_angle[0] != by_angle[1]:
        return [one for found in by_angle for one in found]
    (pair, axes), (own, said) = _axes_of(channels, channels), _axes_of(channels, sensors)
    one, other = sensors
    if axes and axes == said:
        one, other = sensors if own[0] is channels[0] else (other, one)
    elif axes not in ("XY", "HV", "LR"):
        return [one, other]
    elif (math.sin(float(other.angle) - float(one.angle)) > 0.0) != (axes != "LR"):
        one, other = other, one
    return [one, other] if channels[0] is pair[0] else [other, one]


def told_by(channel: Channel) -> tuple[str, float | None]:
    """Plane and angle [rad] that the name of a channel tells, as "DE 45°" does; None without an angle."""
    angle = _ANGLE.search(channel.name)
    plane = _tag(_ANGLE.sub("", channel.name).strip()).strip(" _-,:;/@()")
    return plane, angle and math.radians(float(angle["angle"]))


def _angles(pair: Sequence[Channel]) -> Sequence[float | None]:
    """Angles that the names of a pair tell [rad]; none where one is missing, or both are the plane's."""
    angles = [told_by(channel)[1] for channel in pair]
    return [None] * len(pair) if None in angles or len({*angles}) == 1 else angles


def _at_angle(sensors: Sequence[Sensor], angle: float | None) -> list[Sensor]:
    """The sensors that stand at an angle [rad]."""
    away = [abs(math.remainder((angle or 0.0) - float(one.angle), 2 * math.pi)) for one in sensors]
    return [one for one, off in zip(sensors, away, strict=True) if angle is not None and off <= _SAME_ANGLE]


def sure_of(seated: Mapping[str, Channel], sensors: Sequence[Sensor]) -> bool:
    """Whether the names of channels tell plane and angle of the sensors in which they are seated."""
    return bool(seated) and all(
        _at_angle([one], told_by(seated[one.name])[1])
        and plain_name(told_by(seated[one.name])[0]) == plain_name(one.bearing)
        for one in sensors
    )


def _axes_of(channels: Sequence[Channel], named: Sequence[Channel | Sensor]) -> tuple[Sequence[Channel], str]:
    """Two channels in the order of the axes that the names of their counterparts show, and their letters."""
    names = {id(channel): one.name for channel, one in zip(channels, named, strict=True)}
    pairs, _ = pairs_of(channels, lambda channel: names[id(channel)])
    return pairs[0][1:] if pairs else (channels, "")


def given_planes(
    recording: Recording, profile: Profile
) -> list[tuple[str, list[tuple[Channel, float | None]]]]:
    """The planes of a profile: their names, and each channel with its angle [rad] where that is given."""
    planes: list[tuple[str, list[tuple[Channel, float | None]]]] = []
    for name, text in profile.planes.items():
        entries = [_ENTRY.fullmatch(entry) for entry in text.split(",")]
        found: list[tuple[Channel, float | None]] = []
        for entry in entries:
            hits = fitting(recording.channels, entry["channel"]) if entry else []
            if entry is None or len(hits) != 1 or len(entries) < 2:
                have = listed(channel.label for channel in recording.channels)
                what = f"there is no channel {entry['channel']!r}" if entry and not hits else "unclear"
                ask = 'write "PLANE: CHANNEL angle, CHANNEL angle", as "NDE: X1 0 deg, Y1 90 deg"'
                raise UsageError(f'the plane "{name}: {text}": {what}; {ask}; there are {have}')
            if any(hits[0] is channel for _, others in (*planes, (name, found)) for channel, _ in others):
                words = f"{hits[0].label} was named before; every channel is of one sensor"
                ask = "Name another one, or leave the plane out: a plane needs two"
                raise UsageError(f'the plane "{name}: {text}": {words}. {ask}')
            found.append((hits[0], parse_quantity(entry["angle"], "angle") if entry["angle"] else None))
        planes.append((name, found))
    return planes


def sensors_of_planes(recording: Recording, sensors: Sequence[Sensor], profile: Profile) -> dict[str, str]:
    """Channel of each sensor of the machine by the planes of a profile: by angle, or as `seats` has it."""
    mapped: dict[str, str] = {}
    for name, entries in given_planes(recording, profile):
        members = [sensor for sensor in sensors if (sensor.bearing or "").lower() == name.lower()]
        if len(members) != len(entries):  # of several planes at a bearing one is told by its sensors
            members = [one for one in sensors if one.name.lower().startswith(name.lower())] or members
        stand = ", ".join(f"{s.name} at {math.degrees(float(s.angle)):.4g} deg" for s in members)
        if len(members) != len(entries):
            known = list(dict.fromkeys(sensor.bearing or "" for sensor in sensors))
            ask = f'--map "{known[0]}: {", ".join(one.label for one, _ in entries)}", one for each plane'
            raise UsageError(
                f"the plane {name!r} names {channels_in_words(len(entries))}; the machine has "
                + (f"{len(members)} sensors there ({stand})" if members else f"the planes {listed(known)}")
                + f"; say which is which in place of [planes]: {ask}"
            )
        untold = seats([channel for channel, _ in entries], members)
        for seat, (channel, angle) in zip(untold, entries, strict=True):
            at = [seat] if angle is None else _at_angle(members, angle)
            if not at or at[0].name in mapped:
                words = f"at {math.degrees(angle or 0.0):.4g} deg is none of the sensors ({stand})"
                ask = "correct one of them, or leave out the angles where the order is the same"
                raise UsageError(f"the plane {name!r}: {channel.label} {words}; {ask}")
            mapped[at[0].name] = channel.label
    return mapped


def fitting(channels: Sequence[Channel], wanted: str) -> list[Channel]:
    """Channels of a name: as the file writes it, without its unit, but for signs, case, counter, prefix."""
    rules: tuple[Callable[[Channel], bool], ...] = (
        lambda channel: channel.label == wanted,
        lambda channel: channel.name == wanted,
        lambda channel: plain_name(channel.name) == plain_name(wanted),
        lambda channel: plain_name(_tag(channel.name)) == plain_name(_tag(wanted)),
    )
    return next((hits for rule in rules if (hits := [c for c in channels if rule(c)])), [])


def _tag(name: str) -> str:
    """A name without the counter of the channel and without "sensor" in front."""
    return _SENSOR.sub("", _COUNTER.sub("", name))


def _may_read(channel: Channel) -> bool:
    """Whether a channel can be a displacement: by its unit, and no status, counter or switch."""
    other = known_unit(channel.unit) or (channel.unit != "%" and is_unit(channel.unit))
    unknown = len(channel.unit) <= _LONGEST_UNIT and not other
    if channel.unit not in _LENGTHS and not unknown:
        return False
    switch = not channel.unit and bool(np.all((channel.values == 0.0) | (channel.values == 1.0)))
    clock = not channel.unit and known_unit(channel.name) in TIME_UNITS
    return not switch and not clock and not _NO_READING.match(channel.name)


def _counted(channels: Sequence[Channel], called: Callable[[Channel], str]) -> list[Channel]:
    """Channels whose names only count, in their order; none where one name says more.

    Displacements go before voltages, which a keyphasor may have too.
    """
    lengths = [channel for channel in channels if channel.unit not in ("V", "mV", "", "%")]
    for some in (channels, lengths):
        found = [_COUNTED.fullmatch(called(channel)) for channel in some]
        if len(found) < 4 or None in found or len({plain_name(one["word"]) for one in found if one}) > 1:
            continue
        numbers = [one["number"].lower() for one in found if one]
        order = [int(text) if text.isdigit() else ord(text) for text in numbers]
        if order == list(range(order[0], order[0] + len(order))):
            return lengths if 4 <= len(lengths) < len(some) else list(some)
    return []


def pairs_of(
    channels: Sequence[Channel], called: Callable[[Channel], str] = lambda channel: channel.name
) -> tuple[list[tuple[str, tuple[Channel, Channel], str]], str]:
    """Channels that look at one plane, in the order of the file, and whether by their names or their order.

    The name of a plane, its two channels, and the letters of their axes, empty where they are only counted.

    Names of a pair differ only in a letter or word for an axis, once as they are, once without counters.
    Names that only count (CH1, CH2, …) are taken two by two.
    """
    left = [channel for channel in channels if _may_read(channel)]
    if counted := _counted(left, called):
        pairs = zip(counted[::2], counted[1::2], strict=False)
        return [(f"plane {k}", pair, "") for k, pair in enumerate(pairs, start=1)], "order"
    found = _pairs_by_angle(left)
    left = [one for one in left if not any(one is member for _, pair, _ in found for member in pair)]
    for strip in (False, True):
        names = {}
        for channel in left:
            spoken = _COUNTER.sub("", called(channel)) if strip else called(channel)
            for letter, words in _SPOKEN.items():
                spoken = words.sub(letter, spoken)
            names[id(channel)] = spoken
        for axes in _AXES:
            for first in list(left):
                for second in list(left):
                    if not any(first is c for c in left) or not any(second is c for c in left):
                        continue
                    if (name := _common(names[id(first)], names[id(second)], axes)) is not None:
                        found.append((name, (first, second), axes))
                        left = [c for c in left if c is not first and c is not second]
    order = {id(channel): place for place, channel in enumerate(channels)}
    found.sort(key=lambda entry: min(order[id(channel)] for channel in entry[1]))
    # an HDF5 file lists its channels by the alphabet, DE first; every format shows the ends in one order
    found = far_end_first(found, lambda entry: entry[0] or "")
    numbered = enumerate(found, start=1)
    return [(name or f"plane {number}", pair, axes) for number, (name, pair, axes) in numbered], "names"


def _pairs_by_angle(channels: Sequence[Channel]) -> list[tuple[str, tuple[Channel, Channel], str]]:
    """Two channels whose names tell one plane and an angle each, without letters of axes."""
    told: dict[str, list[Channel]] = {}
    for channel in channels:
        plane, angle = told_by(channel)
        if angle is not None and plane.upper() not in ("X", "Y", "H", "V"):  # of "X_45" the number is a plane
            told.setdefault(plane, []).append(channel)
    return [(plane, (two[0], two[1]), "") for plane, two in told.items() if len(two) == 2]


def _common(first: str, second: str, axes: str) -> str | None:
    """What two names have in common where they differ in the letters of two axes only."""
    if len(first) != len(second) or first == second:
        return None
    places = [i for i, (a, b) in enumerate(zip(first, second, strict=True)) if a != b]
    if len(places) != 1 or (first[places[0]] + second[places[0]]).upper() != axes:
        return None
    before, behind = first[: places[0]], first[places[0] + 1 :]
    if axes == "12" and re.search(r"[0-9]", before + behind) and not _KKS.search(before):
        return None
    left = re.sub(r" {2,}", " ", before + behind)  # of "Weg A oben" without its A
    return _SENSOR.sub("", left).strip(" _-")
