"""Which channel of a recording is which sensor of the machine, and what one unit of it is worth.

`match_sensors` reads by it; `guess_profile` writes down what it finds for a recorder nobody described.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from rotordrop.arrays import Array
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UnmatchedError, UsageError
from rotordrop.record.arrangement import (
    fitting,
    pairs_of,
    plain,
    planes_as_listed,
    seats,
    sensors_of_planes,
)
from rotordrop.record.profile import Profile
from rotordrop.record.recording import FULL_SCALE, SPEED_UNITS, Channel, Recording, called, listed
from rotordrop.units import format_quantity, parse_quantity

_SPEED_NAMES = re.compile(
    r"(shaft|rotor|rotational)?[ _-]*(speed|drehzahl|rpm|n|tacho|shaft)\b", re.IGNORECASE
)
_VOLTS = ("V", "mV")
_DISAGREE = 5e-3
"""Share by which sensitivities of recording and machine file may differ without a word (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Guess:
    """A profile and what it still lacks."""

    profile: Profile
    """What was given and what could be guessed."""
    found: tuple[str, ...]
    """What was found, in words."""
    missing: tuple[str, ...]
    """What has to be said, each with the way to say it; empty when the profile is complete."""
    likely: Mapping[str, str]
    """What is likeliest where it has to be said: sensor -> channel, or plane -> channels without sensors."""


def match_sensors(
    recording: Recording, sensors: tuple[Sensor, ...], profile: Profile, place: str
) -> tuple[Channel, ...]:
    """The channel of every sensor of the machine, in their order, by the map of the profile or by name."""
    unknown = sorted(set(profile.channels) - {sensor.name for sensor in sensors})
    if unknown:
        names = ", ".join(sensor.name for sensor in sensors)
        raise RecordError(f"the channel map names a sensor {unknown[0]!r}; the machine has {names}")
    said = profile.channels | sensors_of_planes(recording, sensors, profile)
    wanted = {sensor.name: said.get(sensor.name, sensor.name) for sensor in sensors}
    hits = {name: fitting(recording.channels, channel) for name, channel in wanted.items()}
    missing = [name for name in wanted if not hits[name]]
    if missing:
        # all of them at once, with what would map them
        present = [channel.label for channel in recording.channels]
        close = get_close_matches(wanted[missing[0]], present, 1, 0.5)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        several = f" ({len(missing)} sensors have none)" if len(missing) > 1 else ""
        raise UnmatchedError(
            f"{place} has no channel {wanted[missing[0]]!r} for sensor {missing[0]}{several}{hint}; it has "
            f"{listed(present)}",
            f"say which is which, {_options(recording, sensors, missing)}, or keep it in a profile with "
            "'rotordrop profile'",
        )
    taken: list[Channel] = []
    for name, channels in hits.items():
        if len(channels) > 1:
            labels = ", ".join(repr(channel.label) for channel in channels)
            raise RecordError(
                f"{place}: sensor {name} fits the channels {labels}; choose one with the channel map of a "
                f'profile: [channels] {name} = "..."'
            )
        if any(channels[0] is other for other in taken):
            raise RecordError(
                f"{place}: channel {channels[0].label!r} is mapped to two sensors, the second is {name}"
            )
        taken += channels
    return tuple(taken)


RULE = "planes in their order, X a quarter turn before Y"
"""How the likeliest channels of sensors are found where no names tell."""


def likeliest(recording: Recording, sensors: Sequence[Sensor]) -> dict[str, Channel]:
    """The likeliest channel of each sensor, where as many pairs of channels as planes are found."""
    pairs, _ = pairs_of(recording.channels)
    planes = list(dict.fromkeys(sensor.bearing for sensor in sensors))
    members = [[sensor for sensor in sensors if sensor.bearing == plane] for plane in planes]
    if len(pairs) != len(planes) or any(len(found) != 2 for found in members):
        return {}
    return {
        sensor.name: channel
        for (_, pair, _), found in zip(pairs, members, strict=True)
        for channel, sensor in zip(pair, seats(pair, found), strict=True)
    }


def _options(recording: Recording, sensors: Sequence[Sensor], missing: Sequence[str]) -> str:
    """Options that would map the sensors without a channel: the likeliest planes, with their angles."""
    likely = likeliest(recording, sensors)
    if not likely:
        return " ".join(f'--map "{name}=..."' for name in missing[:8])
    planes: dict[str, list[str]] = {}
    at = {sensor.name: sensor for sensor in sensors}
    for name, channel in likely.items():
        told = f"{channel.label} {math.degrees(float(at[name].angle)):.4g} deg"
        planes.setdefault(at[name].bearing or "", []).append(told)
    lacking = {at[name].bearing or "" for name in missing}
    maps = " ".join(f'--map "{plane}: {", ".join(two)}"' for plane, two in planes.items() if plane in lacking)
    return f"likeliest {maps} ({RULE})"


def find_speed(
    recording: Recording, taken: Sequence[Channel], profile: Profile, place: str
) -> Channel | None:
    """Find the channel of the shaft speed, or None when the file has none."""
    free = [channel for channel in recording.channels if all(channel is not other for other in taken)]
    if profile.speed.channel is not None:
        return _named(free, profile.speed.channel, "speed channel", recording, place)
    if profile.speed.pulses is not None:
        return None
    in_speed_unit = [channel for channel in free if channel.unit in SPEED_UNITS]
    candidates = in_speed_unit or [channel for channel in free if _SPEED_NAMES.match(channel.name)]
    if len(candidates) > 1:
        labels = ", ".join(repr(channel.label) for channel in candidates)
        raise RecordError(
            f"{place}: {labels} could all be the shaft speed; choose with the profile: [speed] channel = "
            '"..."'
        )
    return candidates[0] if candidates else None


def find_pulses(
    recording: Recording, taken: Sequence[Channel], profile: Profile, place: str
) -> Channel | None:
    """Find the channel of tacho pulses that the profile names, or None when it names none."""
    if profile.speed.pulses is None:
        return None
    free = [channel for channel in recording.channels if all(channel is not other for other in taken)]
    return _named(free, profile.speed.pulses, "channel of pulses", recording, place)


def _named(free: list[Channel], name: str, what: str, recording: Recording, place: str) -> Channel:
    for channel in free:
        if name in (channel.label, channel.name):
            return channel
    raise RecordError(f"{place} has no {what} {name!r}; it has {listed(c.label for c in recording.channels)}")


def displacement(
    channel: Channel, sensor: Sensor, recording: Recording, profile: Profile, place: str
) -> tuple[Array, list[str]]:
    """Give the reading of a sensor [m], shape (N,), with a word where two sensitivities disagree."""
    if channel.unit == FULL_SCALE:
        raise RecordError(
            f"{place} holds shares of a full scale, from -1 to 1, and does not tell it: say what it is with "
            f"'rotordrop profile {Path(place).name} --full-scale \"500 um\" -o recorder.toml'"
        )
    # a sensor may be called "S_V": the ending of its channel's name is then no unit
    suffixed = channel.label == sensor.name and channel.name != channel.label
    unit = profile.units.get(channel.label, "" if suffixed else channel.unit) or profile.unit or ""
    if unit in _VOLTS:
        volts = channel.values * parse_quantity(f"1 {unit}", "voltage") - recording.voltage_offset
        sensitivity, words = _sensitivity(channel, sensor, recording, profile, place)
        return volts / sensitivity, words
    if not unit:
        raise RecordError(
            f'{place}: channel {channel.label!r} has no unit; name it in the profile: unit = "um"'
        )
    try:
        return channel.values * parse_quantity(f"1 {unit}", "length"), []
    except UsageError as error:
        raise RecordError(
            f"{place}: channel {channel.label!r} is in {unit!r}, which is neither a length nor a voltage; "
            f'name its unit in the profile: [units] "{channel.label}" = "um"'
        ) from error


def _sensitivity(
    channel: Channel, sensor: Sensor, recording: Recording, profile: Profile, place: str
) -> tuple[float, list[str]]:
    """Volts per metre [V/m]: of the profile, else of the recording, else of the machine file."""
    kind = "voltage_sensitivity"
    if profile.sensitivity is not None:
        return parse_quantity(profile.sensitivity, kind), []
    of_machine = None if sensor.sensitivity is None else float(sensor.sensitivity)
    of_file = recording.sensitivity
    if of_file is None:
        if of_machine is None:
            raise RecordError(
                f"{place}: channel {channel.label!r} is in volts and neither the recording nor the machine "
                f'file gives a sensitivity; add sensitivity = "8 mV/um" to sensor {sensor.name}'
            )
        return of_machine, []
    if of_machine is not None and abs(of_machine / of_file - 1.0) > _DISAGREE:
        return of_file, [
            f"{sensor.name}: the recording gives {format_quantity(of_file, kind)}, the machine file "
            f"{format_quantity(of_machine, kind)}; the recording is used: correct the machine file or name "
            "the sensitivity in the profile"
        ]
    return of_file, []


def speed_factor(channel: Channel, profile: Profile, place: str) -> float:
    """Speed in rad/s of one unit of the speed channel."""
    unit = profile.speed.unit or profile.units.get(channel.label, channel.unit)
    if not unit:
        raise RecordError(
            f"{place}: the speed channel {channel.label!r} has no unit; name it in the profile: [speed] unit "
            '= "Hz"'
        )
    try:
        return parse_quantity(f"1 {unit}", "speed")
    except UsageError as error:
        raise RecordError(
            f"{place}: the speed channel {channel.label!r} is in {unit!r}; expected Hz, rpm or rad/s, name "
            f'it in the profile: [speed] unit = "rpm"; or, if it holds pulses of a tacho, pulses = '
            f'"{channel.label}"'
        ) from error


def guess_profile(recording: Recording, given: Profile, sensors: Sequence[Sensor] = ()) -> Guess:
    """Complete a profile from a recording that was read with it, for sensors that need a channel each."""
    mapped = given.channels | sensors_of_planes(recording, sensors, given)
    for sensor in sensors:
        hits = fitting(recording.channels, sensor.name) or [
            channel for channel in recording.channels if plain(channel.label) == plain(sensor.name)
        ]
        if sensor.name not in mapped and len(hits) == 1:
            mapped[sensor.name] = hits[0].label
    unmapped = [sensor.name for sensor in sensors if sensor.name not in mapped]
    missing: list[str] = []
    if unmapped:
        free = [channel.label for channel in recording.channels if channel.label not in mapped.values()]
        options = _options(recording, sensors, unmapped)
        missing.append(f"channels of {listed(unmapped)}: {options} (there are {listed(free)})")
    pairs = [] if sensors else pairs_of(recording.channels)[0]
    planes = given.planes or {name: f"{one.label}, {other.label}" for name, (one, other), _ in pairs}
    paired = [channel.label for _, pair, _ in pairs for channel in pair]
    used = [
        channel
        for channel in recording.channels
        if (
            not sensors
            and channel.label in (paired or [channel.label])
            and channel.label != given.speed.pulses
        )
        or channel.label in mapped.values()
    ]
    profile = given.model_copy(update={"channels": mapped, "planes": {} if sensors else planes})
    profile, speed = _with_speed(recording, profile, used if sensors else [])
    if speed is None and sensors:  # a look needs none
        missing.append('the shaft speed: --speed-channel "...", --pulses "..." or --speed "60 Hz"')
    units = {
        channel.label: profile.units.get(channel.label) or channel.unit or profile.unit
        for channel in used
        if channel.label != speed and channel.unit not in SPEED_UNITS
    }
    bare = [label for label, unit in units.items() if not unit]
    if bare:
        missing.append(f"the unit of {listed(bare)}: --unit um")
    if any(channel.unit == FULL_SCALE for channel in used):
        missing.append('what full scale is: --full-scale "500 um"')
    sensitive = bool(sensors) and all(sensor.sensitivity is not None for sensor in sensors)
    in_volts = any(unit in _VOLTS for unit in units.values())
    if in_volts and not (recording.sensitivity or profile.sensitivity or sensitive):
        missing.append('the sensitivity of the channels in volts: --sensitivity "8 mV/um"')
    found = []
    for channel in recording.channels:
        span = f"{channel.values.min():.4g} to {channel.values.max():.4g} {channel.unit or '(no unit)'}"
        rate = (len(channel.time) - 1) / max(float(channel.time[-1] - channel.time[0]), 1e-12)
        named = called("channel", channel.label)
        found.append(f"{named}: {len(channel.values)} samples at {rate:.6g} Hz, {span}")
    found += [f"sensor {name}: {called('channel', label)}" for name, label in mapped.items()]
    found += [f"{called('plane', name)}: {text}" for name, text in planes.items() if not sensors]
    found.append(
        f"shaft speed: {speed or 'not known; an estimate needs --speed-channel, --pulses or --speed'}"
    )
    likely = {name: channel.label for name, channel in likeliest(recording, sensors).items()}
    if not sensors and not planes:
        likely = planes_as_listed(recording)
    return Guess(profile=profile, found=tuple(found), missing=tuple(missing), likely=likely)


def _with_speed(
    recording: Recording, profile: Profile, taken: Sequence[Channel]
) -> tuple[Profile, str | None]:
    """The profile with the channel of the speed, and where the speed comes from; None where nothing tells."""
    rules = profile.speed
    if rules.constant is not None or rules.pulses is not None:
        return profile, rules.constant or f"pulses of {rules.pulses}"
    try:
        channel = find_speed(recording, taken, profile, "the recording")
    except RecordError:
        channel = None
    if channel is None:
        return profile, None
    speed = rules.model_copy(update={"channel": channel.label})
    return profile.model_copy(update={"speed": speed}), channel.label
