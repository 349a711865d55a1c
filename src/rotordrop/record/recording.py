"""What a file holds, before anybody has said which column is which sensor of the machine."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rotordrop.arrays import Array

SPEED_UNITS = ("Hz", "rpm", "rad/s")
"""Units by which a channel is known to be a shaft speed."""

_UNITS = {
    "m": "m", "mm": "mm", "um": "um", "µm": "um", "μm": "um", "micron": "um", "microns": "um", "nm": "nm",
    "micrometer": "um", "mikrometer": "um", "mil": "mil", "mils": "mil", "in": "in", "inch": "in",
    "v": "V", "volt": "V", "volts": "V", "mv": "mV", "second": "s", "seconds": "s", "sekunden": "s",
    "hz": "Hz", "hertz": "Hz", "rpm": "rpm", "1/min": "rpm", "u/min": "rpm", "r/min": "rpm", "min-1": "rpm",
    "min^-1": "rpm", "min⁻¹": "rpm", "/min": "rpm",
    "rad/s": "rad/s", "s": "s", "sec": "s", "ms": "ms", "us": "us", "µs": "us", "μs": "us", "min": "min",
}  # fmt: skip

_SPACED_UNIT = re.compile(r"(.*[^\s,]),?\s(µm|μm|um|mm|mil|mils|rpm|1/min|min-1|Hz|mV)", re.IGNORECASE)
_LONGEST_NAME = 200
"""Characters of a column name or a unit that are looked at (chosen): damaged files hold megabytes."""

FULL_SCALE = "of full scale"
"""Unit of readings that a file holds as shares of a full scale it does not tell."""

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
    """Time of each sample [s], shape (N,)."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """All channels of a file, in its order, and what the file says about them."""

    channels: tuple[Channel, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Header entries as written."""
    notes: tuple[str, ...] = ()
    """Choices the reader made, for the report."""
    warnings: tuple[str, ...] = ()
    """Damage the reader worked around; each says what is missing."""
    sensitivity: float | None = None
    """Volts per metre [V/m] stated in the file for all channels."""
    voltage_offset: float = 0.0
    """Voltage at zero displacement stated in the file [V]."""


def recording_of(
    time: Array,
    signals: Array,
    names: Sequence[str],
    *,
    speed_time: Array | None = None,
    speed: Array | None = None,
    marks: Array | None = None,
    metadata: Mapping[str, str] | None = None,
    notes: tuple[str, ...] = (),
    warnings: tuple[str, ...] = (),
) -> Recording:
    """Make a recording of displacement readings and, where known, the shaft speed.

    Parameters
    ----------
    time : array, shape (N,)
        Time of the samples [s].
    signals : array, shape (N, S)
        Readings [m].
    names : sequence of str, length S
        Names of the channels.
    speed_time, speed : array, shape (K,), optional
        When the speed was read [s] and what was read [rad/s].
    marks : array, shape (M,), optional
        When a mark of the shaft passed [s].
    metadata : mapping of str to str, optional
        Header entries.
    notes, warnings : tuple of str
        Kept with the recording.
    """
    channels = [
        Channel(name=name, label=name, unit="m", values=signals[:, i], time=time)
        for i, name in enumerate(names)
    ]
    if speed is not None and speed_time is not None:
        turns = np.asarray(speed) / (2 * np.pi)
        channels.append(Channel(name="speed", label="speed", unit="Hz", values=turns, time=speed_time))
    if marks is not None:
        channels.append(Channel(name=MARKS, label=MARKS, unit="s", values=marks, time=marks))
    return Recording(channels=tuple(channels), metadata=dict(metadata or {}), notes=notes, warnings=warnings)


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
    return _UNITS.get(bare.lower())


def spelled(unit: str) -> str:
    """A unit in this package's spelling, or as written where it is not one found in recordings.

    One that is too long to be one ends in dots, which no unit does.
    """
    return known_unit(unit) or (unit if len(unit) <= _LONGEST_NAME else f"{unit[:_LONGEST_NAME]}…")


def split_unit(written: str) -> tuple[str, str, str]:
    """Take a column name apart into name, label and unit (empty when there is none).

    ``"S_A [um]"`` gives ``("S_A", "S_A", "um")`` and ``"S_A_um"`` gives ``("S_A", "S_A_um", "um")``: a
    unit-like ending stays in the label, as ``Probe_V`` may be a vertical probe.
    """
    written = " ".join(written[:_LONGEST_NAME].split())
    if spaced := _SPACED_UNIT.fullmatch(written):  # "VE-101X um"; a V or s there may be part of the name
        return spaced[1], spaced[1], spelled(spaced[2])
    if written.endswith((")", "]")):
        name, mark, unit = written[:-1].rpartition("[" if written[-1] == "]" else "(")
        if mark:
            name, unit = name.strip(), unit.strip()
            return name, name, spelled(unit)
    name, mark, unit = written.rpartition("/")
    if mark and name.strip() and (name[-1] == " " or unit[:1] == " ") and known_unit(unit):
        return name.strip(), name.strip(), spelled(unit)
    name, mark, unit = written.rpartition("_")
    if name and mark and unit.isalpha() and known_unit(unit):
        return name, written, spelled(unit)
    return written, written, ""
