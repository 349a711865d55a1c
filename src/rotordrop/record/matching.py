"""Which channel of a recording is which sensor of the machine, and what one unit of it is worth."""

from __future__ import annotations

import re
from difflib import get_close_matches

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError, UsageError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Array, Channel, Recording
from rotordrop.units import format_quantity, parse_quantity

_SPEED_UNITS = ("Hz", "rpm", "rad/s")
_SPEED_NAMES = re.compile(
    r"(shaft|rotor|rotational)?[ _-]*(speed|drehzahl|rpm|n|tacho|shaft)\b", re.IGNORECASE
)
_VOLTS = ("V", "mV")
_DISAGREE = 5e-3
"""Sensitivities of recording and machine file may differ by this share before it is worth a word."""


def match_sensors(
    recording: Recording, sensors: tuple[Sensor, ...], profile: Profile, place: str
) -> tuple[Channel, ...]:
    """Find the channel of every sensor, by the map of the profile or by name.

    Parameters
    ----------
    recording : Recording
        The channels of the file.
    sensors : tuple of Sensor
        Sensors of the machine; one channel is found for each, in this order.
    profile : Profile
        Map of sensor names to channel names.
    place : str
        What to call the file in messages.

    Raises
    ------
    RecordError
        When a sensor has no channel, or more than one, or two sensors share one.
    """
    unknown = sorted(set(profile.channels) - {sensor.name for sensor in sensors})
    if unknown:
        names = ", ".join(sensor.name for sensor in sensors)
        raise RecordError(f"the channel map names a sensor {unknown[0]!r}; the machine has {names}")
    _refuse_missing(recording, sensors, profile, place)
    found = tuple(_match(recording, sensor.name, profile, place) for sensor in sensors)
    for index, channel in enumerate(found):
        if any(channel is other for other in found[:index]):
            raise RecordError(
                f"{place}: channel {channel.label!r} is mapped to two sensors, the second is "
                f"{sensors[index].name}"
            )
    return found


def _match(recording: Recording, sensor: str, profile: Profile, place: str) -> Channel:
    wanted = profile.channels.get(sensor, sensor)
    rules = (
        lambda channel: channel.label == wanted,
        lambda channel: channel.name == wanted,
        lambda channel: _plain(channel.name) == _plain(wanted),
    )
    for rule in rules:
        hits = [channel for channel in recording.channels if rule(channel)]
        if len(hits) == 1:
            return hits[0]
        if hits:
            labels = ", ".join(repr(hit.label) for hit in hits)
            raise RecordError(
                f"{place}: sensor {sensor} fits the channels {labels}; choose one with the channel map of a "
                f'profile: [channels] {sensor} = "..."'
            )
    raise AssertionError(f"{sensor} was found to have a channel")


def _refuse_missing(recording: Recording, sensors: tuple[Sensor, ...], profile: Profile, place: str) -> None:
    """Name every sensor without a channel at once, with the lines of a profile that would map them."""
    names = {text for c in recording.channels for text in (c.label, c.name, _plain(c.name)) if text}
    wanted = {sensor.name: profile.channels.get(sensor.name, sensor.name) for sensor in sensors}
    missing = [n for n, channel in wanted.items() if not {channel, _plain(channel)} & names]
    if not missing:
        return
    present = [channel.label for channel in recording.channels]
    close = get_close_matches(wanted[missing[0]], present, 1, 0.5)
    hint = f"; did you mean {close[0]!r}?" if close else "."
    several = f" ({len(missing)} sensors have none)" if len(missing) > 1 else ""
    lines = ", ".join(f'{name} = "..."' for name in missing)
    raise RecordError(
        f"{place} has no channel {wanted[missing[0]]!r} for sensor {missing[0]}{several}; it has "
        f"{', '.join(present)}{hint} Map them in a profile: [channels] {lines}, or make one with "
        "'rotordrop profile'"
    )


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def find_speed(
    recording: Recording, taken: tuple[Channel, ...], profile: Profile, place: str
) -> Channel | None:
    """Find the channel of the shaft speed, or None when the file has none.

    Raises
    ------
    RecordError
        When several channels could be the speed.
    """
    free = [channel for channel in recording.channels if all(channel is not other for other in taken)]
    if profile.speed.channel is not None:
        return _named(free, profile.speed.channel, "speed channel", recording, place)
    if profile.speed.pulses is not None:
        return None
    in_speed_unit = [channel for channel in free if channel.unit in _SPEED_UNITS]
    candidates = in_speed_unit or [channel for channel in free if _SPEED_NAMES.match(channel.name)]
    if len(candidates) > 1:
        labels = ", ".join(repr(channel.label) for channel in candidates)
        raise RecordError(
            f"{place}: {labels} could all be the shaft speed; choose with the profile: [speed] channel = "
            '"..."'
        )
    return candidates[0] if candidates else None


def find_pulses(
    recording: Recording, taken: tuple[Channel, ...], profile: Profile, place: str
) -> Channel | None:
    """Find the channel of tacho pulses that the profile names, or None when it names none.

    Raises
    ------
    RecordError
        When there is no such channel.
    """
    if profile.speed.pulses is None:
        return None
    free = [channel for channel in recording.channels if all(channel is not other for other in taken)]
    return _named(free, profile.speed.pulses, "channel of pulses", recording, place)


def _named(free: list[Channel], name: str, what: str, recording: Recording, place: str) -> Channel:
    for channel in free:
        if name in (channel.label, channel.name):
            return channel
    raise RecordError(
        f"{place} has no {what} {name!r}; it has {', '.join(channel.label for channel in recording.channels)}"
    )


def displacement(
    channel: Channel, sensor: Sensor, recording: Recording, profile: Profile, place: str
) -> tuple[Array, list[str]]:
    """Give the reading of a sensor [m], shape (N,), with a word where two sensitivities disagree.

    Raises
    ------
    RecordError
        When the unit is missing, is no length, or is volts without a sensitivity.
    """
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
            "name its "
            f'unit in the profile: [units] "{channel.label}" = "um"'
        ) from error


def _sensitivity(
    channel: Channel, sensor: Sensor, recording: Recording, profile: Profile, place: str
) -> tuple[float, list[str]]:
    """Volts per metre [V/m]: of the profile, else of the recording, else of the machine file."""
    if profile.sensitivity is not None:
        return parse_quantity(profile.sensitivity, "voltage_sensitivity"), []
    of_machine = None if sensor.sensitivity is None else float(sensor.sensitivity)
    of_file = recording.sensitivity
    if of_file is None:
        if of_machine is None:
            raise RecordError(
                f"{place}: channel {channel.label!r} is in volts and neither the recording nor the machine "
                "file "
                f'gives a sensitivity; add sensitivity = "8 mV/um" to sensor {sensor.name}'
            )
        return of_machine, []
    if of_machine is not None and abs(of_machine / of_file - 1.0) > _DISAGREE:
        kind = "voltage_sensitivity"
        return of_file, [
            f"{sensor.name}: the recording gives {format_quantity(of_file, kind)}, the machine file "
            f"{format_quantity(of_machine, kind)}; the recording is used: correct the machine file or name "
            "the "
            "sensitivity in the profile"
        ]
    return of_file, []


def speed_factor(channel: Channel, profile: Profile, place: str) -> float:
    """Speed in rad/s of one unit of the speed channel.

    Raises
    ------
    RecordError
        When the unit is missing or is no unit of speed.
    """
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
