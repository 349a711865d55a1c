"""What a recording does not say by itself, and the options that say it: a profile as far as it is guessed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import RecordError
from rotordrop.record.arrangement import (
    fitting,
    given_planes,
    pairs_of,
    planes_as_listed,
    sensors_of_planes,
    sure_of,
)
from rotordrop.record.columns import find_speed, likeliest, options_for, units_missing
from rotordrop.record.keys import speed_told
from rotordrop.record.profile import Profile
from rotordrop.record.record import record_of
from rotordrop.record.recording import Channel, Recording, called, listed

_PULSES = re.compile(r"(?<![^\W_])(KPH|key ?phas|ta[ck]ho|trigger|phase ?mark)", re.IGNORECASE)
"""Names of channels that hold pulses of the shaft."""


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


def guess_profile(recording: Recording, given: Profile, sensors: Sequence[Sensor] = ()) -> Guess:
    """Complete a profile from a recording that was read with it, for sensors that need a channel each."""
    mapped = given.channels | (sensors_of_planes(recording, sensors, given) if sensors else {})
    for sensor in sensors:
        hits = fitting(recording.channels, sensor.name)
        if sensor.name not in mapped and len(hits) == 1:
            mapped[sensor.name] = hits[0].label
    seated = likeliest(recording, sensors)
    likely = {name: channel.label for name, channel in seated.items()}
    if given.likely or sure_of(seated, sensors):
        mapped = {**likely, **mapped}
    unmapped = [sensor.name for sensor in sensors if sensor.name not in mapped]
    missing: list[str] = []
    if unmapped:
        free = [channel.label for channel in recording.channels if channel.label not in mapped.values()]
        options = options_for(recording, sensors, unmapped)
        missing.append(f"channels of {listed(unmapped)}: {options} (there are {listed(free)})")
    pairs = {name: [one.label for one in pair] for name, pair, _ in pairs_of(recording.channels)[0]}
    if given.planes and not sensors:
        pairs = {n: [one.label for one, _ in pair] for n, pair in given_planes(recording, given)}
    pairs = {} if sensors else pairs
    planes = given.planes or {name: ", ".join(pair) for name, pair in pairs.items()}
    paired = [label for pair in pairs.values() for label in pair]
    looked_at = (likely | mapped).values() if sensors else paired or [c.label for c in recording.channels]
    used = [c for c in recording.channels if c.label in looked_at and c.label != given.speed.pulses]
    profile = given.model_copy(update={"channels": mapped, "planes": {} if sensors else planes})
    profile, speed = _with_speed(recording, profile, used if sensors else [])
    if speed is None and sensors:  # a look needs none
        pulses = next(
            (c.label for c in recording.channels if c.label not in looked_at and _PULSES.search(c.name)),
            "...",
        )
        missing.append(f'the shaft speed: --speed-channel "...", --pulses "{pulses}" or --speed "60 Hz"')
    sensitive = recording.sensitivities or (sensors and all(one.sensitivity is not None for one in sensors))
    missing += units_missing([c for c in used if c.label != speed], profile, sensitive=bool(sensitive))
    found = []
    for channel in recording.channels:
        span = f"{channel.values.min():.4g} to {channel.values.max():.4g} {channel.unit or '(no unit)'}"
        rate = (len(channel.time) - 1) / max(float(channel.time[-1] - channel.time[0]), 1e-12)
        named = called("channel", channel.label)
        found.append(f"{named}: {len(channel.values)} samples at {rate:.6g} Hz, {span}")
    found += [f"sensor {name}: {called('channel', label)}" for name, label in mapped.items()]
    found += [f"{called('plane', name)}: {text}" for name, text in planes.items() if not sensors]
    unsaid = "not known; an estimate needs --speed-channel, --pulses or --speed"
    found.append(f"shaft speed: {speed or unsaid}")
    if not sensors and not planes:
        likely = planes_as_listed(recording)
    if sensors and not missing:  # what a look would refuse
        record_of(recording, tuple(sensors), profile=profile)
    return Guess(profile=profile, found=tuple(found), missing=tuple(missing), likely=likely)


def _with_speed(
    recording: Recording, profile: Profile, taken: Sequence[Channel]
) -> tuple[Profile, str | None]:
    """The profile with the channel of the speed, and where the speed comes from; None where nothing tells."""
    rules = profile.speed
    if rules.constant is not None or rules.pulses is not None:
        return profile, rules.constant or f"pulses of {rules.pulses}"
    with suppress(RecordError):
        if (channel := find_speed(recording, taken, profile, "the recording")) is not None:
            speed = rules.model_copy(update={"channel": channel.label})
            return profile.model_copy(update={"speed": speed}), channel.label
    constant, told = speed_told(recording.metadata)
    return profile, None if constant is None else told
