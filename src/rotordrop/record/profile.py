"""What has to be said once about a recorder whose files do not say it themselves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from rotordrop.arrays import Array
from rotordrop.document import parse_toml
from rotordrop.errors import RecordError, UsageError
from rotordrop.files import write_text
from rotordrop.record.recording import Channel, spelled
from rotordrop.record.tacho import Edge
from rotordrop.require import each, require
from rotordrop.units import parse_quantity


def _of_kind(kind: str) -> AfterValidator:
    """Accept texts that are a quantity of a kind."""

    def checked(text: str) -> str:
        try:
            parse_quantity(text, kind)
        except UsageError as error:
            raise ValueError(str(error)) from error
        return text

    return AfterValidator(checked)


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


_Time = Annotated[str, _of_kind("time")]


class TextLayout(_Section):
    """How a text file is written, where guessing would go wrong."""

    encoding: str | None = None
    """For example utf-8 or latin-1."""
    separator: str | None = Field(default=None, min_length=1, max_length=1)
    decimal: str | None = Field(default=None, pattern=r"^[.,]$")
    """Signs between columns and in numbers."""
    first_data_line: int | None = Field(default=None, ge=1)
    """Counted from 1."""
    names: tuple[str, ...] | None = None
    """Column names, for files without a header."""


class Clock(_Section):
    """Where the time of the samples comes from."""

    channel: str | None = None
    unit: str | None = None
    """Name and unit of the time column."""
    step: _Time | None = None
    start: _Time | None = None
    """Time between samples, ``"50 us"``, and of the first one, ``"-0.25 s"``."""


class SpeedSource(_Section):
    """Where the shaft speed comes from."""

    channel: str | None = None
    unit: str | None = None
    """Name and unit of the speed channel."""
    constant: Annotated[str, _of_kind("speed")] | None = None
    """Speed by hand, for example ``"60 Hz"``."""
    pulses: str | None = None
    """Name of a channel of tacho or keyphasor pulses."""
    pulses_per_turn: int = Field(default=1, ge=1, le=10_000)
    edge: Edge = "rising"
    """The edge of a pulse that counts."""


class Profile(_Section):
    """A channel map and the reading rules of one recorder, saved once and used again."""

    format: str | None = None
    """Name of the reader, when the suffix of the file does not tell it."""
    channels: dict[str, str] = Field(default_factory=dict)
    """Sensor name of the machine file -> channel name in the recording."""
    planes: dict[str, str] = Field(default_factory=dict)
    """Plane -> its channels, with their angles where they are known: ``NDE = "X1 0 deg, Y1 90 deg"``."""
    likely: bool = False
    """Whether sensors whose channels no name tells take the likeliest ones."""
    units: dict[str, str] = Field(default_factory=dict)
    """Channel name in the recording -> unit."""
    unit: str | None = None
    """Unit of all displacement channels, whatever the file says; what a count is worth too, ``"0.02 um"``."""
    sensitivity: Annotated[str, _of_kind("voltage_sensitivity")] | None = None
    """Volts per length of all channels, for example ``"8 mV/um"``."""
    full_scale: str | None = None
    """What full scale stands for where a file only knows shares of it (WAV), for example ``"10 V"``."""
    text: TextLayout = TextLayout()
    time: Clock = Clock()
    speed: SpeedSource = SpeedSource()

    def channel(
        self,
        name: str,
        unit: str,
        values: ArrayLike,
        time: Array | None,
        *,
        label: str | None = None,
        clocked: bool = False,
    ) -> Channel:
        """A channel as a file names it, with unit and clock of the profile where it has them.

        The clock has the step and the start given by hand, unless the reader has made it so (`clocked`).
        """
        label, readings = name if label is None else label, np.asarray(values, dtype=np.float64)
        begun = float(time[0]) if time is not None and len(time) else 0.0
        start = begun if self.time.start is None else parse_quantity(self.time.start, "time")
        if self.time.step is not None and not clocked:
            time = np.asarray(start + parse_quantity(self.time.step, "time") * np.arange(len(readings)))
        elif time is not None and start != begun and not clocked:
            time = time + (start - begun)
        if time is None:
            raise RecordError(f'{label!r} has no clock; give its step in a profile: [time] step = "50 us"')
        return Channel(
            name=name,
            label=label,
            unit=spelled(self.units.get(label) or self.units.get(name, unit)),
            values=readings,
            time=time,
        )


def load_profile(path: str | Path) -> Profile:
    """Read a recorder profile from a TOML file.

    Raises
    ------
    RecordError
        When the file is not TOML or has an entry a profile does not know; names the entry.
    """
    path = Path(path)
    try:
        content = parse_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordError(f"cannot read the profile {path}: {error.strerror}") from error
    except ValueError as error:
        raise RecordError(f"{path} is not a TOML file: {error}") from error
    return profile_of(content, str(path))


def profile_of(content: dict[str, Any], place: str) -> Profile:
    """Make a profile of entries of a file or of `OPTIONS`, or say which is wrong and what belongs there."""
    try:
        return Profile.model_validate(content)
    except ValidationError as error:
        told = "\n  also: ".join(_told(entry, place) for entry in error.errors())
        raise RecordError(f"{place}: {told}") from error


def _told(entry: Any, place: str) -> str:
    """One entry that does not fit, in words."""
    *sections, name = (str(part) for part in entry["loc"])
    section = sections[0] if sections and sections[0] in _SECTIONS else ""
    known = tuple((_SECTIONS[section] if section else Profile).model_fields)
    told = f"{f'[{section}] ' if section else ''}{name} = {entry['input']!r}"
    if place == OPTIONS:
        told = f"--{'speed' if name == 'constant' else name} {entry['input']!r}"
    if entry["type"] != "extra_forbidden":
        cause = entry.get("ctx", {}).get("error")
        return f"{told} does not fit: {cause or _EXPECTED.get(name, entry['msg'])}"
    close = get_close_matches(name, known, 1, 0.6)
    hint = f"did you mean {close[0]!r}?" if close else f"it knows {', '.join(known)}"
    return f"{told} is not known in {f'the section [{section}]' if section else 'a profile'}; {hint}"


OPTIONS = "the options"
"""The place of entries that stand for options of ``rotordrop profile``."""
_SECTIONS: dict[str, type[BaseModel]] = {"text": TextLayout, "time": Clock, "speed": SpeedSource}
_EXPECTED = {
    "channels": 'expected a table, [channels] S_NDE_A = "X1"',
    "planes": 'expected a table, [planes] NDE = "X1 0 deg, Y1 90 deg"',
    "units": 'expected a table, [units] "X1" = "um"',
    "separator": "expected one sign, such as ';'",
    "decimal": "expected '.' or ','",
    "first_data_line": "expected the number of a line, counted from 1",
    "pulses_per_turn": "expected a whole number from 1 on",
    "edge": "expected 'rising' or 'falling'",
    "names": 'expected a list of names, ["Time [s]", ...]',
}


LIKELY = "likely"
"""In place of a channel map: the likeliest one, where no names tell."""


def rules_of(profile: Profile | str | Path | None, mapping: Sequence[str] = ()) -> Profile:
    """A profile or its file, with "SENSOR=CHANNEL", "PLANE: CHANNEL angle, CHANNEL angle", "likely" added."""
    require(profile, "profile", Profile, str, PathLike, none=True)
    rules = profile if isinstance(profile, Profile) else load_profile(profile) if profile else Profile()
    said = [text for text in each(mapping, "mapping", str) if text.strip() != LIKELY]
    channels, planes = dict(rules.channels), {} if said else dict(rules.planes)
    likely = rules.likely or len(said) < len(mapping)
    for text in said:
        match = _SAID.fullmatch(text)
        if match is None:
            words = f'{text!r} is neither "SENSOR=CHANNEL" nor "PLANE: CHANNEL angle, CHANNEL angle"'
            raise UsageError(f'{words}; write for example "S_NDE_A=X1" or "NDE: X1 0 deg, Y1 90 deg"')
        (channels if match["sign"] == "=" else planes)[match["name"]] = match["said"]
    return rules.model_copy(update={"channels": channels, "planes": planes, "likely": likely})


_SAID = re.compile(r"\s*(?P<name>[^:=]*[^:=\s])\s*(?P<sign>[:=])\s*(?P<said>.*\S)\s*")


def save_profile(profile: Profile, path: str | Path) -> None:
    """Write a recorder profile as a TOML file."""
    import tomlkit

    write_text(path, tomlkit.dumps(profile.model_dump(exclude_defaults=True, exclude_none=True)))
