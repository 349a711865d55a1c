"""What has to be said once about a recorder whose files do not say it themselves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches
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


class TextLayout(_Section):
    """How a text file is written, where guessing would go wrong."""

    encoding: str | None = Field(default=None, description="for example utf-8 or latin-1")
    separator: str | None = Field(
        default=None, min_length=1, max_length=1, description="one character between columns"
    )
    decimal: str | None = Field(default=None, pattern=r"^[.,]$", description="point or comma")
    first_data_line: int | None = Field(default=None, ge=1, description="counted from 1")
    names: tuple[str, ...] | None = Field(
        default=None, description="column names, for files without a header"
    )


class Clock(_Section):
    """Where the time of the samples comes from."""

    channel: str | None = Field(default=None, description="name of the time column")
    unit: str | None = Field(default=None, description="unit of the time column")
    step: Annotated[str, _of_kind("time")] | None = Field(
        default=None, description='time between samples, for example "50 us"'
    )
    start: Annotated[str, _of_kind("time")] | None = Field(
        default=None, description='time of the first sample, for example "-0.25 s"'
    )


class SpeedSource(_Section):
    """Where the shaft speed comes from."""

    channel: str | None = Field(default=None, description="name of the speed channel")
    unit: str | None = Field(default=None, description="unit of the speed channel")
    constant: Annotated[str, _of_kind("speed")] | None = Field(
        default=None, description='speed by hand, for example "60 Hz"'
    )
    pulses: str | None = Field(default=None, description="name of a channel of tacho or keyphasor pulses")
    pulses_per_turn: int = Field(default=1, ge=1, le=10_000, description="pulses in one turn of the shaft")
    edge: Edge = Field(default="rising", description="the edge of a pulse that counts, rising or falling")


class Profile(_Section):
    """A channel map and the reading rules of one recorder, saved once and used again."""

    format: str | None = None
    """Name of the reader, when the suffix of the file does not tell it."""
    channels: dict[str, str] = Field(default_factory=dict)
    """Sensor name of the machine file -> channel name in the recording."""
    planes: dict[str, str] = Field(default_factory=dict)
    """Plane -> its channels, with their angles where they are known: ``NDE = "X1 0 deg, Y1 90 deg"``."""
    units: dict[str, str] = Field(default_factory=dict)
    """Channel name in the recording -> unit."""
    unit: str | None = None
    """Unit of all displacement channels that name none."""
    sensitivity: Annotated[str, _of_kind("voltage_sensitivity")] | None = None
    """Volts per length of all channels, for example ``"8 mV/um"``."""
    full_scale: str | None = None
    """What full scale stands for where a file only knows shares of it (WAV), for example ``"10 V"``."""
    text: TextLayout = TextLayout()
    time: Clock = Clock()
    speed: SpeedSource = SpeedSource()

    def channel(
        self, name: str, unit: str, values: ArrayLike, time: Array, *, label: str | None = None
    ) -> Channel:
        """A channel as a file names it, in the unit that the profile says or else the file."""
        label = name if label is None else label
        return Channel(
            name=name,
            label=label,
            unit=spelled(self.units.get(label, unit)),
            values=np.asarray(values, dtype=np.float64),
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
    """Make a profile of the entries of a TOML file, or say which entry is wrong and what belongs there."""
    try:
        return Profile.model_validate(content)
    except ValidationError as error:
        told = "\n  also: ".join(_told(entry) for entry in error.errors())
        raise RecordError(f"{place}: {told}") from error


def _told(entry: Any) -> str:
    """One entry that does not fit, in words."""
    *sections, name = (str(part) for part in entry["loc"])
    section = sections[0] if sections and sections[0] in _SECTIONS else ""
    known = tuple((_SECTIONS[section] if section else Profile).model_fields)
    where = f"[{section}] " if section else ""
    if entry["type"] == "extra_forbidden":
        close = get_close_matches(name, known, 1, 0.6)
        hint = f"did you mean {close[0]!r}?" if close else f"it knows {', '.join(known)}"
        what = f"the section [{section}]" if section else "a profile"
        return f"{where}{name} = {entry['input']!r} is not known in {what}; {hint}"
    cause = entry.get("ctx", {}).get("error")
    return f"{where}{name} = {entry['input']!r} does not fit: {cause or _EXPECTED.get(name, entry['msg'])}"


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


def rules_of(profile: Profile | str | Path | None, mapping: Sequence[str] = ()) -> Profile:
    """A profile or its file, with "SENSOR=CHANNEL" and "PLANE: CHANNEL angle, CHANNEL angle" added."""
    rules = profile if isinstance(profile, Profile) else load_profile(profile) if profile else Profile()
    channels, planes = dict(rules.channels), {} if mapping else dict(rules.planes)
    for text in mapping:
        match = _SAID.fullmatch(text)
        if match is None:
            raise UsageError(
                f'{text!r} is neither "SENSOR=CHANNEL" nor "PLANE: CHANNEL angle, CHANNEL angle"; write for '
                'example "S_NDE_A=X1" or "NDE: X1 0 deg, Y1 90 deg"'
            )
        (channels if match["sign"] == "=" else planes)[match["name"]] = match["said"]
    return rules.model_copy(update={"channels": channels, "planes": planes})


_SAID = re.compile(r"\s*(?P<name>[^:=]*[^:=\s])\s*(?P<sign>[:=])\s*(?P<said>.*\S)\s*")


def save_profile(profile: Profile, path: str | Path) -> None:
    """Write a recorder profile as a TOML file."""
    import tomlkit

    write_text(path, tomlkit.dumps(profile.model_dump(exclude_defaults=True, exclude_none=True)))
