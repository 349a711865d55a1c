"""What a file holds, before anybody has said which column is which sensor of the machine."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.units import parse_quantity

SPEED_UNITS = ("Hz", "rpm", "rad/s")
"""Units by which a channel is known to be a shaft speed."""

_SPELLINGS = {
    "m": "m м metre meter", "mm": "mm мм 毫米", "nm": "nm нм", "mil": "mil mils thou", "in": "in inch",
    "um": "um µm μm micron microns micrometer micrometre mikrometer мкм mkm 微米 ㎛",
    "V": "v volt volts в 伏", "mV": "mv мв", "s": "s sec second seconds sekunden с сек 秒",
    "ms": "ms msec millisecond milliseconds мс 毫秒",
    "us": "us µs μs usec µsec microsecond microseconds мкс 微秒",
    "ns": "ns nanosecond nanoseconds нс", "min": "min minute minutes", "h": "hour hours", "d": "day days",
    "Hz": "hz hertz гц", "kHz": "khz кгц", "MHz": "mhz",
    "rad/s": "rad/s rad/sec rad_s rad_per_s rad_per_sec radps rad·s⁻¹", "deg": "deg ° degree degrees grad",
    "rad": "rad radian radians",
    "rpm": "rpm 1/min u/min r/min tr/min rev/min min-1 min^-1 min⁻¹ /min об/мин 转/分 1_min u_min r_min",
}  # fmt: skip
_UNITS = {written: unit for unit, spellings in _SPELLINGS.items() for written in spellings.split()}
_MICRO_LOST = re.compile(r"(?:[^\x00-\x7f]{1,4}|\?{1,2})m")
"""What is left of "µm" where a text was written or read in another encoding."""

_SPACED_UNIT = re.compile(
    r"(?i)(.*[^\s,]),?\s([µμu]m|мкм|mm|mils?|rpm|1/min|min-1|Hz|Гц|mV|об/мин|(?<=,\s)с)"
)
_SENSITIVITY = re.compile(r"((?:(?<![^\s:=;,(])[+-])?\d+(?:[.,]\d+)?)\s*(m?V)\s*/\s*([uµμm]?m|mil)\b")
_RPM = re.compile(r"(?i)(?:[a-z]+[ _.-])?n?rpm[ _.-]?\d{0,2}")
_OPENS = {")": "(", "]": "[", "}": "{", ">": "<"}
_LONGEST_NAME = 200
"""Characters of a column name or a unit that are looked at (chosen): damaged files hold megabytes."""

TIME_NAMES = re.compile(
    r"(?:time( ?stamps?)?|zeit(stempel)?|t|temps|tempo|tiempo|时间|время|x_value|x[- _]?axis([- _]value)?)\b",
    re.IGNORECASE,
)
"""What columns of the time are called."""

OWN_TIME = re.compile(
    r"(?P<before>.*[^ _.:/-])[ _.:/-]?(?:time ?stamps?|time|zeitstempel|zeit)"
    r"|(?:time ?stamps?|time|zeitstempel|zeit|t)[ _.:/-](?P<behind>.+)",
    re.IGNORECASE,
)
"""What the time of one channel is called, "X1_time" or "time X1"."""
_TIME_WITHIN = re.compile(r"(?<=[^\W_])[ _.:/-](?:time|zeit)(?=[ _.:/-][^\W_])", re.IGNORECASE)

FULL_SCALE = "of full scale"
"""Unit of readings that a file holds as shares of a full scale it does not tell."""

_LENGTHS = ("m", "mm", "um", "nm", "mil", "in")
_PHASE = re.compile(r"phase|phasor|lag\b", re.IGNORECASE)

MARKS = "mark_passages"
"""Channel of a saved record that holds when a mark of the shaft passed [s]."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One column, dataset or variable of a file, with its own clock."""

    name: str
    """Name without the unit."""
    label: str
    """Name as written in the file, unit in brackets removed."""
    unit: str
    """Unit as this package spells it, empty where the file names none."""
    values: Array
    """Samples, in `unit`, shape (N,)."""
    time: Array
    """Time of each sample by the channel's own clock [s], shape (N,)."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """All channels of a file, in its order, and what the file says about them."""

    channels: tuple[Channel, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Header entries as written."""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """Choices the reader made, and damage that it worked around; each warning says what is missing."""
    sensitivities: tuple[float, ...] = ()
    """Volts per metre [V/m] that the file states: one for all channels, or several and not whose they are."""
    voltage_offset: float = 0.0
    """Voltage at zero displacement [V] that it states for all channels."""


def whose_time(name: str, names: Iterable[str] = ()) -> str | None:
    """The channel whose time a column of this name holds, empty for that of all; None for no time.

    Of known `names` one may have the time within it, as Dewesoft has "Data1_time_X" for "Data1_X".
    """
    if TIME_NAMES.fullmatch(name):
        return ""
    if (within := _TIME_WITHIN.sub("", name)) != name and within in names:
        return within
    own = OWN_TIME.fullmatch(name)
    return ("" if TIME_NAMES.match(name) else None) if own is None else own["before"] or own["behind"]


def of_polar(recording: Recording, place: object) -> Recording:
    """The recording with x and y in place of a radius and an angle for each of two planes or more."""
    bare = [one for one in recording.channels if not one.unit]
    angles = [one for one in recording.channels if one.unit in ("deg", "rad")]
    angles = angles or [one for one in bare if _PHASE.search(one.name)]
    radii = [one for one in recording.channels if one.unit in _LENGTHS]
    radii = radii or [one for one in bare if all(one is not other for other in angles)]
    positive = [one for one in radii if not np.nanmin(one.values, initial=0.0) < 0.0]
    if not 2 <= len(angles) <= len(positive):
        return recording
    named, pairs = listed(one.label for one in angles), list(zip(radii, angles, strict=False))
    several = len(radii) > len(angles) or any(len(r.values) != len(a.values) for r, a in pairs)
    if several or any(_PHASE.search(one.name) for one in angles):
        words = f"the angles {named} may be those of the shaft, of a tone or of a mark"
        ask = "or one 'radius [um]' and one 'angle [deg]' for each"
        raise RecordError(f"{place}: {words}; export x and y of each plane and no angles, {ask}")
    xy: dict[int, Channel] = {}
    for radius, angle in pairs:
        turned = np.radians(angle.values) if angle.unit == "deg" else angle.values
        for one, axis, share in ((radius, "X", np.cos), (angle, "Y", np.sin)):
            name = f"{radius.name} {axis}"
            xy[id(one)] = replace(radius, name=name, label=name, values=radius.values * share(turned))
    note = f"{named} are taken as angles from x to y, with the radii {listed(one.label for one in radii)}"
    channels = tuple(xy.get(id(one), one) for one in recording.channels)
    return replace(recording, channels=channels, notes=(*recording.notes, note))


def plain_name(name: str) -> str:
    """A name without signs and case."""
    return re.sub(r"[\W_]", "", name.lower())


def damaged(place: object, words: str) -> RecordError:
    """A refusal of a file that is not what its recorder wrote."""
    return RecordError(f"{place}{words}; copy or export it again")


def channels_in_words(count: int) -> str:
    """A number of channels, as "1 channel"."""
    return f"{count} channel{'' if count == 1 else 's'}"


def called(what: str, name: str) -> str:
    """A name after the word for what it is, unless it begins with it: "channel X1", but "channel 1"."""
    return name if name.lower().startswith(what) else f"{what} {name}"


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names in a message: eight of them and how many more there are."""
    known = list(names)
    more = f" and {len(known) - most} more" if len(known) > most else ""
    return ", ".join(known[:most]) + more


def known_unit(text: str) -> str | None:
    """Give a unit in this package's spelling, or None when the text is not one found in recordings."""
    bare = text.strip()
    if bare[:1] in ("[", "(") and bare[-1:] in ("]", ")"):
        bare = bare[1:-1].strip()
    return _UNITS.get(bare.lower()) or ("um" if _MICRO_LOST.fullmatch(bare) else None)


def spelled(unit: str) -> str:
    """A unit in this package's spelling, or as written where it is not one found in recordings.

    One that is too long to be one ends in dots, which no unit does.
    """
    return known_unit(unit) or (unit if len(unit) <= _LONGEST_NAME else f"{unit[:_LONGEST_NAME]}…")


def sensitivities_in(text: str) -> tuple[float, ...]:
    """Volts per metre [V/m] that a text gives, as "8 mV/um" or "-200 mV/mil", each once."""
    found = _SENSITIVITY.findall(text)
    written = (f"{number.replace(',', '.')} {volts}/{known_unit(length)}" for number, volts, length in found)
    return tuple(dict.fromkeys(parse_quantity(one, "voltage_sensitivity") for one in written))


def split_unit(written: str) -> tuple[str, str, str]:
    """Take a column name apart into name, label and unit (empty when there is none).

    ``"S_A [um]"`` gives ``("S_A", "S_A", "um")`` and ``"S_A_um"`` gives ``("S_A", "S_A_um", "um")``: a
    unit-like ending stays in the label, as ``Probe_V`` may be a vertical probe.
    """
    written = " ".join(written[:_LONGEST_NAME].split())
    name, mark, unit = f" {written}".rpartition(" in ")
    if mark and known_unit(unit):  # "CH1 in V", "in s"
        return name.strip() or "time", name.strip() or "time", spelled(unit)
    if spaced := _SPACED_UNIT.fullmatch(written):  # "VE-101X um"; a V or s there may be part of the name
        return spaced[1], spaced[1], spelled(spaced[2])
    for slash in re.finditer("/", written):  # "X / um", "X/um", "omega/(rad/s)"
        name, unit = written[: slash.start()], written[slash.end() :]
        apart = name[-1:] == " " or unit[:1] == " " or len(unit) > 2 or unit in ("um", "µm", "mm", "ms", "Hz")
        if name.strip() and known_unit(unit) and (apart or TIME_NAMES.fullmatch(name)):
            return name.strip(), name.strip(), spelled(unit.strip().strip("()"))
    if opens := _OPENS.get(written[-1:]):
        name, mark, unit = written[:-1].rpartition(opens)
        if mark:
            name, unit = name.strip(), unit.strip()
            return name, name, spelled(unit)
    for ending in re.finditer(r"(?<=.)[_.](?=.)", written):  # "X_um", "n_1_min", "omega_rad/s"
        if known := known_unit(written[ending.end() :]):
            return written[: ending.start()], written, known
    return written, written, "rpm" if _RPM.fullmatch(written) else ""
