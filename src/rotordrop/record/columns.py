"""Which channel of a recording is which sensor of the machine, and what one unit of it is worth.

`match_sensors` reads by it; `rotordrop.evidence.unsaid` writes it down for a recorder nobody described.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from difflib import get_close_matches

from rotordrop.arrays import Array
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UnmatchedError, UsageError, mapped
from rotordrop.record.arrangement import fitting, pairs_of, seats, sensors_of_planes, sure_of
from rotordrop.record.profile import LIKELY, Profile
from rotordrop.record.recording import (
    FULL_SCALE,
    SPEED_UNITS,
    Channel,
    Recording,
    listed,
    plain_name,
    sensitivities_in,
    spelled,
)
from rotordrop.units import format_quantity, parse_quantity

_SPEED_NAMES = re.compile(
    r"(shaft|rotor|rotational)?[ _-]*(speed|drehzahl|rpm|n|tacho|shaft)\b", re.IGNORECASE
)
_VOLTS = ("V", "mV")
_DISAGREE = 5e-3
"""Share by which sensitivities of recording and machine file may differ without a word (chosen)."""


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
    found = {} if all(hits.values()) else likeliest(recording, sensors)
    if profile.likely or sure_of(found, sensors):
        hits |= {name: [channel] for name, channel in found.items() if not hits[name]}
    missing = [name for name in wanted if not hits[name]]
    if missing:
        # all of them at once, with what would map them
        present = [channel.label for channel in recording.channels]
        free = [
            label for label in present if all(label != one.label for found in hits.values() for one in found)
        ]
        close = get_close_matches(wanted[missing[0]], present, 1, 0.5)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        several = f" ({len(missing)} sensors have none)" if len(missing) > 1 else ""
        left = [f"; {one}" for one in (*recording.notes, *recording.warnings) if one.startswith("left out")]
        sensitive = bool(recording.sensitivities) or all(one.sensitivity is not None for one in sensors)
        more = units_missing(
            [*found.values()] or [c for c in recording.channels if not c.unit], profile, sensitive=sensitive
        )
        gone = {one.bearing or "" for one in sensors} - {
            one.bearing or "" for one in sensors if hits[one.name]
        }
        pairs, _ = pairs_of([channel for channel in recording.channels if channel.label in free])
        if profile.likely:
            left += [f"; {LIKELY!r} finds pairs for {len(pairs)} of {len(_by_plane(sensors))} planes"]
        if gone and len(missing) < len(sensors) and not pairs:
            raise UnmatchedError(
                f"{place} has no channels of the plane {listed(sorted(gone))} (sensors {listed(missing)}); "
                f"it has {listed(present)}",
                "export them too, or set lost = true for these sensors in the machine file, or look at the "
                "record without the machine",
            )
        raise UnmatchedError(
            f"{place} has no channel {wanted[missing[0]]!r} for sensor {missing[0]}{several}{hint}; it has "
            f"{listed(present)}{''.join(left)}",
            f"say which is which, {options_for(recording, sensors, missing)}, or keep it in a profile with "
            f"'rotordrop profile'{''.join(f'; say there too {one}' for one in more)}",
        )
    taken: list[Channel] = []
    for name, channels in hits.items():
        wrong = ""
        if len(channels) > 1:
            labels = ", ".join(repr(channel.label) for channel in channels)
            wrong = f"sensor {name} fits the channels {labels}; choose one with the channel map of a "
            wrong += f'profile: [channels] {name} = "..."'
        elif any(channels[0] is other for other in taken):
            wrong = f"channel {channels[0].label!r} is mapped to two sensors, the second is {name}"
        if wrong:
            raise RecordError(f"{place}: {wrong}")
        taken += channels
    return tuple(taken)


RULE = "planes in their order, axes by the names of the sensors, else X a quarter turn before Y"
"""How the likeliest channels of sensors are found where no names tell."""


def likeliest(recording: Recording, sensors: Sequence[Sensor]) -> dict[str, Channel]:
    """The likeliest channel of each sensor, where as many pairs of channels as planes are found."""
    pairs, _ = pairs_of(recording.channels)
    members = _by_plane(sensors)
    if len(pairs) != len(members) or any(len(found) != 2 for found in members):
        return {}
    of_end = {plain_name(found[0].bearing): found for found in members}
    if len(of_end) == len(members) and of_end.keys() == {plain_name(name) for name, _, _ in pairs}:
        members = [of_end[plain_name(name)] for name, _, _ in pairs]  # whatever order the file has
    return {
        sensor.name: channel
        for (_, pair, _), found in zip(pairs, members, strict=True)
        for channel, sensor in zip(pair, seats(pair, found), strict=True)
    }


def _by_plane(sensors: Sequence[Sensor]) -> list[list[Sensor]]:
    """The sensors of each plane: those at one end, or at one node where an end has several planes."""
    ends: dict[object, list[Sensor]] = {}
    nodes: dict[object, list[Sensor]] = {}
    for sensor in sensors:
        ends.setdefault(sensor.bearing, []).append(sensor)
        nodes.setdefault(sensor.node, []).append(sensor)
    return [*(ends if max(map(len, ends.values()), default=0) < 3 else nodes).values()]


def options_for(recording: Recording, sensors: Sequence[Sensor], missing: Sequence[str]) -> str:
    """Options that would map the sensors without a channel: the likeliest planes, with their angles."""
    likely = likeliest(recording, sensors)
    if not likely:
        return mapped(*(f"{name}=..." for name in missing[:8]))
    planes: dict[str, list[str]] = {}
    at = {sensor.name: sensor for sensor in sensors}
    for name, channel in likely.items():
        entry = f"{channel.label} {math.degrees(float(at[name].angle)):.4g} deg"
        planes.setdefault(at[name].bearing or "", []).append(entry)
    lacking = {at[name].bearing or "" for name in missing}
    told = [f"{plane}: {', '.join(two)}" for plane, two in planes.items() if plane in lacking]
    if any(len(two) > 2 for two in planes.values()):  # an end with two planes has no name for each
        told = [f"{name}={likely[name].label}" for name in missing]
    maps = mapped(*told)
    return f"likeliest {maps} ({RULE}), or {mapped(LIKELY)}"


def find_speed(
    recording: Recording, taken: Sequence[Channel], profile: Profile, place: str
) -> Channel | None:
    """Find the channel of the shaft speed, or None when the file has none."""
    if profile.speed.channel is not None or profile.speed.pulses is not None:
        return find_named(recording, taken, profile.speed.channel, "speed channel", place)
    free = [channel for channel in recording.channels if all(channel is not other for other in taken)]
    in_speed_unit = [channel for channel in free if channel.unit in SPEED_UNITS]
    candidates = in_speed_unit or [channel for channel in free if _SPEED_NAMES.match(channel.name)]
    if len(candidates) > 1:
        labels = ", ".join(repr(channel.label) for channel in candidates)
        words = "could all be the shaft speed; choose with the profile"
        raise RecordError(f'{place}: {labels} {words}: [speed] channel = "..."')
    return candidates[0] if candidates else None


def find_named(
    recording: Recording, taken: Sequence[Channel], name: str | None, what: str, place: str
) -> Channel | None:
    """Find the channel beside those taken that the profile names, or None when it names none."""
    free = (channel for channel in recording.channels if all(channel is not other for other in taken))
    found = next((one for one in free if name in (one.label, one.name)), None)
    if found is None and name is not None:
        have = listed(channel.label for channel in recording.channels)
        raise RecordError(f"{place} has no {what} {name!r}; it has {have}")
    return found


def units_missing(used: Sequence[Channel], profile: Profile, *, sensitive: bool) -> list[str]:
    """What has to be said of the units of displacements, each with the option of 'rotordrop profile'."""
    bare, volts = [], False
    for channel in used:
        unit = channel.unit or ("V" if profile.sensitivity else "")
        unit = profile.units.get(channel.label) or profile.unit or unit
        if channel.unit not in (*SPEED_UNITS, FULL_SCALE):
            try:
                volts |= worth_of(unit)[1] == "voltage"
            except UsageError:
                bare.append(f"{channel.label} ({unit!r} is none)" if unit else channel.label)
    missing = [f'the unit of {listed(bare)}: --unit um, or of volts --sensitivity "8 mV/um"'] if bare else []
    if any(channel.unit == FULL_SCALE for channel in used):
        missing.append('what full scale is: --full-scale "500 um"')
    if volts and not (profile.sensitivity or sensitive):
        missing.append('the sensitivity of the channels in volts: --sensitivity "8 mV/um"')
    return missing


def worth_of(unit: str) -> tuple[float, str]:
    """What one of a unit is in SI units and its kind, "length" or "voltage"; a unit may be "0.02 um" too."""
    if sensitivities_in(unit):  # "V (200 mV/mil)"
        unit = "mV" if unit.lower().startswith("mv") else "V"
    amount = unit if unit[:1].isdigit() else f"1 {spelled(unit)}"
    kind = "voltage" if amount.split(" ")[-1] in _VOLTS else "length"
    return parse_quantity(amount, kind), kind


NO_FILE = "the recording"
"""What a recording is called that was not read from a file."""


def _profile_with(option: str, place: str) -> str:
    """The command that writes a profile with an option for a file, to be copied."""
    file = "FILE" if place == NO_FILE else f'"{place}"' if " " in place else place
    return f"'rotordrop profile {file} {option} -o recorder.toml'"


def displacement(
    channel: Channel, sensor: Sensor, recording: Recording, profile: Profile, place: str
) -> tuple[Array, list[str]]:
    """Give the reading of a sensor [m], shape (N,), with a word where two sensitivities disagree."""
    if channel.unit == FULL_SCALE:
        ask = _profile_with('--full-scale "500 um"', place)
        what = "shares of a full scale, from -1 to 1, and does not tell it"
        raise RecordError(f"{place} holds {what}: say what it is with {ask}")
    # a sensor may be called "S_V": the ending of its channel's name is then no unit
    suffixed = channel.label == sensor.name != channel.name and channel.label.startswith(channel.name)
    unit = profile.units.get(channel.label) or profile.unit or ("" if suffixed else channel.unit)
    unit = unit or ("V" if profile.sensitivity else "")
    if not unit:
        ask = f'name it in the profile: unit = "um", as {_profile_with("--unit um", place)} writes it'
        raise RecordError(f"{place}: channel {channel.label!r} has no unit; {ask}")
    try:
        factor, kind = worth_of(unit)
    except UsageError as error:
        raise RecordError(
            f"{place}: channel {channel.label!r} is in {unit!r}, which is neither a length nor a voltage; "
            f'name its unit in the profile: [units] "{channel.label}" = "um", or unit = "um" for all; '
            'one count that is worth less is a unit too, "0.02 um"'
        ) from error
    if kind == "length":
        return channel.values * factor, []
    sensitivity, words = _sensitivity(
        channel, sensor, sensitivities_in(unit) or recording.sensitivities, profile, place
    )
    return (channel.values * factor - recording.voltage_offset) / sensitivity, words


def _sensitivity(
    channel: Channel, sensor: Sensor, of_file: tuple[float, ...], profile: Profile, place: str
) -> tuple[float, list[str]]:
    """Volts per metre [V/m]: of the profile, else of the recording, else of the machine file."""
    kind = "voltage_sensitivity"
    if profile.sensitivity is not None:
        return parse_quantity(profile.sensitivity, kind), []
    of_machine = None if sensor.sensitivity is None else float(sensor.sensitivity)
    if len(of_file) > 1:
        told = [format_quantity(one, kind) for one in of_file]
        words = f"is in volts, the head gives several sensitivities, {listed(told)}"
        ask = f'say in the profile whose they are: [units] "{channel.label}" = "V ({told[0]})"'
        raise RecordError(f"{place}: {channel.label!r} {words}: {ask}")
    found = next(iter(of_file), of_machine)
    if found is None:
        what = "is in volts and neither the recording nor the machine file gives a sensitivity"
        ask = _profile_with('--sensitivity "8 mV/um"', place)
        raise RecordError(f"{place}: channel {channel.label!r} {what}; give it there, or in a profile: {ask}")
    if of_machine is None or abs(of_machine / found - 1.0) <= _DISAGREE:
        return found, []
    return found, [
        f"{sensor.name}: the recording gives {format_quantity(found, kind)}, the machine file "
        f"{format_quantity(of_machine, kind)}; the recording is used: correct the machine file or name the "
        "sensitivity in the profile"
    ]


def speed_factor(channel: Channel, profile: Profile, place: str) -> float:
    """Speed in rad/s of one unit of the speed channel."""
    unit = profile.speed.unit or profile.units.get(channel.label, channel.unit)
    words = f"{place}: the speed channel {channel.label!r}"
    if not unit:
        raise RecordError(f'{words} has no unit; name it in the profile: [speed] unit = "rpm", or "Hz"')
    try:
        return parse_quantity(unit if unit[:1].isdigit() else f"1 {unit}", "speed")
    except UsageError as error:
        ask = 'expected Hz, rpm or rad/s, name it in the profile: [speed] unit = "rpm"'
        more = f'or, if it holds pulses of a tacho, pulses = "{channel.label}"'
        raise RecordError(f"{words} is in {unit!r}; {ask}; {more}") from error
