"""A profile for a recorder nobody described: guessed from one of its files, with everything still missing."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError
from rotordrop.record.matching import find_speed
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Channel, Recording

_SPEEDS = ("Hz", "rpm", "rad/s")
_VOLTS = ("V", "mV")


@dataclass(frozen=True, kw_only=True)
class Guess:
    """A profile and what it still lacks."""

    profile: Profile
    """What was given and what could be guessed."""
    found: tuple[str, ...]
    """What was found, in words."""
    missing: tuple[str, ...]
    """What has to be said, each with the way to say it; empty when the profile is complete."""


def guess_profile(recording: Recording, given: Profile, sensors: Sequence[Sensor] = ()) -> Guess:
    """Complete a profile from a recording as far as the recording tells.

    Parameters
    ----------
    recording : Recording
        A file of the recorder, read with `given`.
    given : Profile
        What has been said already.
    sensors : sequence of Sensor
        Sensors of the machine that need a channel each.
    """
    missing: list[str] = []
    mapped = _mapped(recording.channels, sensors, given.channels)
    unmapped = [sensor.name for sensor in sensors if sensor.name not in mapped]
    if unmapped:
        free = [channel.label for channel in recording.channels if channel.label not in mapped.values()]
        options = " ".join(f'--channel "{name}=..."' for name in unmapped)
        missing.append(f"channels of {', '.join(unmapped)}: {options} (there are {', '.join(free)})")
    used = [
        channel
        for channel in recording.channels
        if (not sensors and channel.label != given.speed.pulses) or channel.label in mapped.values()
    ]
    profile = given.model_copy(update={"channels": mapped})
    profile, speed = _with_speed(recording, profile, used if sensors else [])
    if speed is None:
        missing.append('the shaft speed: --speed-channel "...", --pulses "..." or --speed "60 Hz"')
    shafts = [channel for channel in used if channel.label != speed and channel.unit not in _SPEEDS]
    bare = [c.label for c in shafts if not (profile.units.get(c.label) or c.unit or profile.unit)]
    if bare:
        missing.append(f"the unit of {', '.join(bare)}: --unit um")
    in_volts = any((profile.units.get(c.label) or c.unit or profile.unit) in _VOLTS for c in shafts)
    if in_volts and not (recording.sensitivity or profile.sensitivity or _all_sensitive(sensors)):
        missing.append('the sensitivity of the channels in volts: --sensitivity "8 mV/um"')
    found = [_spoken(channel) for channel in recording.channels]
    found += [f"sensor {name}: channel {label}" for name, label in mapped.items()]
    found += [f"shaft speed: {speed}"] if speed else []
    return Guess(profile=profile, found=tuple(found), missing=tuple(missing))


def _mapped(
    channels: Sequence[Channel], sensors: Sequence[Sensor], given: Mapping[str, str]
) -> dict[str, str]:
    """Channel of every sensor: given, or the only one whose name is the same but for signs and case."""
    found = dict(given)
    for sensor in sensors:
        hits = [c.label for c in channels if _plain(sensor.name) in (_plain(c.name), _plain(c.label))]
        if sensor.name not in found and len(hits) == 1:
            found[sensor.name] = hits[0]
    return found


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _with_speed(
    recording: Recording, profile: Profile, taken: Sequence[Channel]
) -> tuple[Profile, str | None]:
    if profile.speed.constant is not None:
        return profile, profile.speed.constant
    if profile.speed.pulses is not None:
        return profile, f"pulses of {profile.speed.pulses}"
    try:
        channel = find_speed(recording, tuple(taken), profile, "the recording")
    except RecordError:
        return profile, None
    if channel is None:
        return profile, None
    speed = profile.speed.model_copy(update={"channel": channel.label})
    return profile.model_copy(update={"speed": speed}), channel.label


def _all_sensitive(sensors: Sequence[Sensor]) -> bool:
    return bool(sensors) and all(sensor.sensitivity is not None for sensor in sensors)


def _spoken(channel: Channel) -> str:
    span = f"{channel.values.min():.4g} to {channel.values.max():.4g} {channel.unit or '(no unit)'}"
    rate = (len(channel.time) - 1) / max(float(channel.time[-1] - channel.time[0]), 1e-12)
    return f"channel {channel.label}: {len(channel.values)} samples at {rate:.6g} Hz, {span}"
