"""What the header of a delimited text file says: clock, trigger, sensitivity."""

from __future__ import annotations

import re
from dataclasses import dataclass

from rotordrop.errors import UsageError
from rotordrop.record.recording import known_unit, split_unit
from rotordrop.units import parse_quantity

_STEP = ("dt", "step", "increment", "sampleinterval", "samplinginterval", "abtastintervall", "schrittweite")
_RATE = ("fs", "samplerate", "samplingrate", "samplingfrequency", "abtastrate", "abtastfrequenz", "rate")
_TRIGGER = ("triggersample", "triggerindex", "triggerposition", "pretriggersamples")
_PRE_TRIGGER = ("pretrigger", "pretriggertime", "vorlauf")
_COUNT = (
    *("samples", "samplecount", "numberofsamples", "numsamples", "nsamples", "points", "numberofpoints"),
    *("recordlength", "anzahlwerte", "anzahlmesswerte", "anzahlabtastwerte", "messwerte"),
)
_START = ("t0", "starttime", "firstsample", "startoffset")
_SENSITIVITY = re.compile(r"(\d+(?:[.,]\d+)?)\s*(m?V)\s*/\s*([uµμm]?m|mil)\b")
_VOLTAGE_OFFSET = re.compile(r"offset\s*[:=]?\s*([+-]?\d+(?:[.,]\d+)?)\s*(m?V)\b", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Header:
    """What the header says."""

    entries: dict[str, str]
    """Keys and values as written."""
    step: float | None
    """Time between samples [s]."""
    start: float | None
    """Time of the first sample [s]."""
    trigger_sample: int | None
    """Sample at which the record time is zero."""
    count: int | None
    """Number of samples."""
    sensitivity: float | None
    """Volts per metre [V/m]."""
    voltage_offset: float
    """Voltage at zero displacement [V]."""


def read_header(lines: list[str], separator: str) -> Header:
    """Read the comment and header lines above the columns."""
    entries: dict[str, str] = {}
    for line in lines:
        _collect(line, separator, entries)
    text = "\n".join(lines)
    step = _time(entries, _STEP)
    rate = _number(entries, _RATE, "frequency", "Hz")
    if step is None and rate:
        step = 1.0 / rate
    trigger = _plain(entries, _TRIGGER)
    start = _time(entries, _START)
    pre_trigger = _time(entries, _PRE_TRIGGER)
    if start is None and pre_trigger is not None:
        start = -abs(pre_trigger)
    return Header(
        entries=entries,
        step=step,
        start=start,
        trigger_sample=None if trigger is None else round(trigger),
        count=_whole(entries, _COUNT),
        sensitivity=_sensitivity(text),
        voltage_offset=_voltage_offset(text),
    )


def _collect(line: str, separator: str, entries: dict[str, str]) -> None:
    """Add the entries of a line: ``key: value;key: value`` or ``key;value;unit``."""
    plain = line.strip().lstrip("#%/!* ").strip()
    fields = [field.strip().strip('"').strip() for field in plain.split(separator)]
    pairs = [
        re.split("[:=]", field, maxsplit=1) for field in fields if re.match(r"[^:=]{2,40}[:=]\s*\S", field)
    ]
    if plain and pairs and not re.fullmatch(r"[\d:.\-T ]+", fields[0]):
        entries.update((key.strip(), value.strip()) for key, value in pairs if not re.search(r"\d$", key))
    if line.lstrip().startswith("#"):
        if plain and not pairs:
            entries.setdefault(f"comment {len(entries) + 1}", plain)
    elif len(fields) > 1 and fields[0] and ":" not in fields[0]:
        entries.setdefault(fields[0], " ".join(fields[1:3]).strip())


def _find(entries: dict[str, str], names: tuple[str, ...]) -> tuple[str, str] | None:
    for key, value in entries.items():
        name, _, unit = split_unit(key)
        if re.sub(r"[^a-z0-9]", "", name.lower()) in names:
            return value, unit
    return None


def _number(entries: dict[str, str], names: tuple[str, ...], kind: str, default_unit: str) -> float | None:
    found = _find(entries, names)
    if found is None:
        return None
    value, unit = found
    match = re.match(r"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*(\S*)", value)
    if not match:
        return None
    number = match.group(1).replace(",", ".")
    unit = unit or known_unit(match.group(2)) or match.group(2) or default_unit
    try:
        return parse_quantity(f"{number} {unit}", kind)
    except UsageError:
        return None


def _time(entries: dict[str, str], names: tuple[str, ...]) -> float | None:
    return _number(entries, names, "time", "s")


def _plain(entries: dict[str, str], names: tuple[str, ...]) -> float | None:
    found = _find(entries, names)
    match = re.match(r"\d+", found[0]) if found else None
    return float(match.group()) if match else None


def _whole(entries: dict[str, str], names: tuple[str, ...]) -> int | None:
    """A whole number and nothing else: "Samples: 5 per channel" declares no length."""
    found = _find(entries, names)
    return int(found[0]) if found and re.fullmatch(r"[1-9]\d{0,9}", found[0].strip()) else None


def _sensitivity(text: str) -> float | None:
    match = _SENSITIVITY.search(text)
    if not match:
        return None
    number, volts, length = match.groups()
    unit = f"{volts}/{known_unit(length)}"
    return parse_quantity(f"{number.replace(',', '.')} {unit}", "voltage_sensitivity")


def _voltage_offset(text: str) -> float:
    match = _VOLTAGE_OFFSET.search(text)
    if not match:
        return 0.0
    return parse_quantity(f"{match.group(1).replace(',', '.')} {match.group(2)}", "voltage")
