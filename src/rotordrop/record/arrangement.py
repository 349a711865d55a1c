"""Which channels of a recording look at the shaft in which plane, with nothing known of the machine."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UsageError
from rotordrop.known import Known
from rotordrop.record.recording import Channel, Recording
from rotordrop.units import parse_quantity

_LENGTHS = ("m", "mm", "um", "nm", "mil", "in", "V", "mV", "")
_AXES = ("XY", "AB", "HV", "UW", "VW", "12")
_ENTRY = re.compile(r"\s*(?P<channel>.+?)\s+(?P<angle>[+-]?[0-9.]+\s*(?:°|deg|rad))\s*")


@dataclass(frozen=True, kw_only=True)
class Arrangement:
    """Sensors made for the channels of a recording, and what was guessed about them."""

    sensors: tuple[Sensor, ...]
    """One per channel used; the node numbers the plane, counted from 1."""
    angles_known: bool
    """Whether the angles were given; else two sensors of a plane are taken as perpendicular."""
    notes: tuple[str, ...]
    """Guesses in words."""


def arrangement_of(recording: Recording, given: Sequence[str] = ()) -> Arrangement:
    """Pair the displacement channels of a recording into planes.

    Parameters
    ----------
    recording : Recording
        The channels.
    given : sequence of str
        One text per plane, ``"NDE: X1 0 deg, Y1 90 deg"``; where empty, names that differ in one letter only
        (X and Y, A and B, H and V, 1 and 2) are a pair.

    Raises
    ------
    RecordError
        When no pair is found.
    UsageError
        When a text cannot be read.
    """
    if given:
        planes = [_given_plane(text, recording) for text in given]
        sensors = [
            _sensor(channel, name, number, angle)
            for number, (name, entries) in enumerate(planes, start=1)
            for channel, angle in entries
        ]
        return Arrangement(sensors=tuple(sensors), angles_known=True, notes=())
    pairs = _pairs([channel for channel in recording.channels if channel.unit in _LENGTHS])
    if not pairs:
        names = ", ".join(channel.label for channel in recording.channels)
        raise RecordError(
            f"no two channels of {names} are a pair by their names (X and Y, A and B, H and V); name them, "
            'for example --map "NDE: X1 0 deg, Y1 90 deg"'
        )
    sensors = [
        _sensor(channel, name, number, angle)
        for number, (name, pair) in enumerate(pairs, start=1)
        for channel, angle in zip(pair, (0.0, math.pi / 2), strict=True)
    ]
    spoken = "; ".join(f"{name}: {pair[0].label} and {pair[1].label}" for name, pair in pairs)
    return Arrangement(
        sensors=tuple(sensors),
        angles_known=False,
        notes=(f"planes by the names of the channels ({spoken}), their sensors taken as perpendicular",),
    )


def _sensor(channel: Channel, plane: str, number: int, angle: float) -> Sensor:
    return Sensor.model_construct(
        name=channel.name,
        node=number,
        position=None,
        angle=Known(value=angle, unit="rad"),
        polarity=1,
        gain=Known(value=1.0),
        offset=Known(value=0.0, unit="m"),
        sensitivity=None,
        bearing=plane,
        position_error=Known(value=0.0, unit="m"),
    )


def _given_plane(text: str, recording: Recording) -> tuple[str, list[tuple[Channel, float]]]:
    name, colon, rest = text.partition(":")
    entries = [_ENTRY.fullmatch(entry) for entry in rest.split(",")]
    if not colon or len(entries) < 2 or not all(entries):
        raise UsageError(
            f'{text!r} is not "PLANE: CHANNEL angle, CHANNEL angle"; write for example '
            '"NDE: X1 0 deg, Y1 90 deg"'
        )
    found = []
    for entry in entries:
        assert entry is not None
        hits = [c for c in recording.channels if entry["channel"] in (c.label, c.name)]
        if len(hits) != 1:
            known = ", ".join(channel.label for channel in recording.channels)
            raise UsageError(f"{text!r}: there is no channel {entry['channel']!r}; there are {known}")
        found.append((hits[0], parse_quantity(entry["angle"], "angle")))
    return name.strip(), found


def _pairs(channels: Sequence[Channel]) -> list[tuple[str, tuple[Channel, Channel]]]:
    """Channels whose names differ only in one letter that names an axis, in the order of the file."""
    found: list[tuple[str, tuple[Channel, Channel]]] = []
    left = list(channels)
    for first in channels:
        for second in channels:
            if first in left and second in left and (name := _common(first.name, second.name)) is not None:
                found.append((name or f"plane {len(found) + 1}", (first, second)))
                left = [channel for channel in left if channel is not first and channel is not second]
    return found


def _common(first: str, second: str) -> str | None:
    """What two names have in common where they differ in the letters of two axes only."""
    if len(first) != len(second) or first == second:
        return None
    places = [i for i, (a, b) in enumerate(zip(first, second, strict=True)) if a != b]
    letters = "".join((first[i] + second[i]).upper() for i in places)
    if len(places) != 1 or letters not in _AXES:
        return None
    if letters == "12" and re.search(r"[0-9]", first[: places[0]] + first[places[0] + 1 :]):
        return None
    plain = first[: places[0]] + first[places[0] + 1 :]
    return re.sub(r"^(S|P|CH|SENSOR|PROBE)[ _-]|[ _-]+$|^[ _-]+", "", plain, flags=re.IGNORECASE).strip(" _-")
