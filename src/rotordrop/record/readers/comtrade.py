"""COMTRADE (IEEE C37.111): a configuration and its samples, with the scale factors of the configuration."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.readers import refuse_large
from rotordrop.record.recording import Recording, damaged, spelled, split_unit

_FORMATS = {"BINARY": ("<i2", -(2**15)), "BINARY32": ("<i4", -(2**31)), "FLOAT32": ("<f4", None)}
"""How an analogue sample is stored and what stands for a missing one (IEEE C37.111)."""

_SECTION = re.compile(
    rb"^--- *file type: *(?P<kind>[A-Z]{3})[ A-Z0-9]*(?:: *(?P<bytes>[0-9]{1,10}))? *---[ \t]*\r?\n",
    re.MULTILINE | re.IGNORECASE,
)
"""The line before a part of a .cff; that of binary samples tells their bytes."""

_SAME_DURATION = 0.01
"""Share by which the durations by rates and by time stamps may differ [1] (chosen): stamps are rounded."""


class _Analogue(NamedTuple):
    name: str
    unit: str
    factor: float
    offset: float
    skew: float


class _Configuration(NamedTuple):
    analogue: list[_Analogue]
    digital: int
    rates: list[tuple[float, int]]
    start: float
    kind: str
    time_factor: float
    entries: dict[str, str]


def read_comtrade(path: Path, profile: Profile) -> Recording:
    """Read a recording by its configuration (.cfg); the samples (.dat) lie beside it, or both in one .cff.

    Record time is zero at the trigger. A channel that the configuration says was sampled later (skew) has a
    clock of its own.
    """
    if path.suffix.lower() == ".cff":
        configuration = samples = path
        text, content = _sections(path)
    else:
        configuration = path if path.suffix.lower() == ".cfg" else _beside(path, "cfg")
        text, samples = configuration.read_bytes(), _beside(configuration, "dat")
        content = samples.read_bytes()
    rules = _configuration(text, configuration)
    numbers, stamps, table = (_ascii if rules.kind == "ASCII" else _binary)(content, rules, samples)
    declared = rules.rates[-1][1]
    if len(table) != declared:
        more = f", {len(table) - declared} more" if len(table) > declared else ""
        what = "the two belong to other recordings" if more else "the file is truncated or damaged"
        words = f": the configuration declares {declared} samples and {len(table)} are present{more}"
        raise damaged(samples, f"{words}, {what}")
    time = rules.start + _seconds(numbers, stamps, rules, samples)
    channels = [
        profile.channel(
            split_unit(entry.name)[0],
            entry.unit,
            table[:, i] * entry.factor + entry.offset,
            time + entry.skew if entry.skew else time,
            label=entry.name,
        )
        for i, entry in enumerate(rules.analogue)
    ]
    # rates and time stamps say the same twice; where they do not, one of them is damaged
    by_rates, by_stamps = float(time[-1] - time[0]), float(stamps[-1] - stamps[0]) * rules.time_factor
    words = f"last {by_rates:.6g} s by the sampling rates and {by_stamps:.6g} s by their time stamps"
    agree = not by_stamps > 0.0 or by_rates <= 0.0 or abs(by_stamps / by_rates - 1.0) < _SAME_DURATION
    warnings = () if agree else (f"the samples {words}; the rates are used",)
    return Recording(channels=tuple(channels), metadata=rules.entries, warnings=warnings)


def _sections(path: Path) -> tuple[bytes, bytes]:
    """Configuration and samples of a single file, whose parts begin with a line that names them."""
    parts: dict[str, bytes] = {}
    content = path.read_bytes()
    found = list(_SECTION.finditer(content))
    for number, mark in enumerate(found):
        end = found[number + 1].start() if number + 1 < len(found) else len(content)
        body = content[mark.end() : end]
        if mark["bytes"]:  # binary samples may hold anything, line ends and such marks too
            body = content[mark.end() : mark.end() + int(mark["bytes"])]
            if len(body) < int(mark["bytes"]):
                declared = f"its samples declare {int(mark['bytes'])} bytes and {len(body)} are present"
                raise damaged(path, f" is truncated: {declared}")
        parts.setdefault(mark["kind"].decode().upper(), body)
    for kind in ("CFG", "DAT"):
        if kind not in parts:
            have = ", ".join(parts) or "none"
            raise damaged(path, f" has no section {kind} (it has {have}), it is cut off or no COMTRADE file")
    return parts["CFG"], parts["DAT"]


def _beside(path: Path, suffix: str) -> Path:
    for name in (suffix, suffix.upper(), suffix.capitalize()):
        if (found := path.with_suffix(f".{name}")).is_file():
            refuse_large(found)
            return found
    raise RecordError(f"{path} needs {path.with_suffix('.' + suffix).name} beside it; copy both files")


def _configuration(text: bytes, path: Path) -> _Configuration:
    try:
        lines = text.decode("utf-8-sig").splitlines()  # as the edition of 2013 has it
    except UnicodeDecodeError:
        lines = text.decode("latin-1").splitlines()
    rows = [line.split(",") for line in lines]
    number = 0

    def row(least: int) -> list[str]:
        nonlocal number
        number += 1
        if number > len(rows) or len(rows[number - 1]) < least:
            have = len(rows[number - 1]) if number <= len(rows) else 0
            raise damaged(path, f", line {number}: {have} entries where {least} are expected")
        return [entry.strip() for entry in rows[number - 1]]

    try:
        station = row(2)
        counts = row(3)
        analogue_count, digital_count = int(counts[1].rstrip("Aa")), int(counts[2].rstrip("Dd"))
        if not 0 < analogue_count <= 1000 or not 0 <= digital_count <= 10_000:
            raise ValueError(f"{analogue_count} analogue and {digital_count} digital channels")
        analogue = []
        for _ in range(analogue_count):
            _, name, _, _, unit, factor, offset, skew, *_ = row(10)
            numbers = float(factor), float(offset), 1e-6 * float(skew or 0.0)
            analogue.append(_Analogue(name, spelled(unit), *numbers))
        for _ in range(digital_count):
            row(2)
        row(1)
        declared = [row(2) for _ in range(max(int(row(1)[0]), 1))]
        rates = [(float(rate), int(last)) for rate, last, *_ in declared]
        start, when = _instant(row(2), station)[1:], row(2)
        day, *trigger = _instant(when, station)
        kind = row(1)[0].upper()
        time_factor = float(rows[number][0]) if number < len(rows) and rows[number][0].strip() else 1.0
    except (ValueError, IndexError) as error:
        raise damaged(path, f", line {number}: {error}, the configuration is damaged") from error
    if kind != "ASCII" and kind not in _FORMATS:
        raise RecordError(f"{path}, line {number}: the format {kind!r} is not ASCII, {', '.join(_FORMATS)}")
    entries = {"station": station[0], "recorder": station[1], "trigger time": " ".join([day, *when[1:]])}
    before = (start[0] - trigger[0]) + (start[1] - trigger[1])
    return _Configuration(analogue, digital_count, rates, before, kind, 1e-6 * time_factor, entries)


def _instant(entries: list[str], station: list[str]) -> tuple[str, int, float]:
    """The day (ISO 8601), and whole seconds and the rest, of which only differences are used.

    The month comes first in the revision of 1991, which need not be named, and the day in those of
    1999 and 2013 (IEEE C37.111).
    """
    parts = re.split(r"[/:.]", f"{entries[0]}:{entries[1]}")
    first, second, year, hour, minute, whole = (int(part) for part in parts[:6])
    early = station[2:3] in ([], [""], ["1991"])
    day, month = (second, first) if second > 12 or (early and first <= 12) else (first, second)
    year += 0 if year > 99 else 1900 if year > 68 else 2000  # two digits as POSIX has them
    date = datetime(year, month, day)
    rest = float(f"0.{parts[6]}") if len(parts) > 6 else 0.0
    seconds = date.toordinal() * 86_400 + 3600 * hour + 60 * minute + whole
    return date.date().isoformat(), seconds, rest


def _ascii(content: bytes, rules: _Configuration, path: Path) -> tuple[Array, Array, Array]:
    lines = [line for line in content.decode("latin-1").split("\n") if line.strip(" \r\x1a")]
    wide = 2 + len(rules.analogue) + rules.digital
    table = np.full((len(lines), 2 + len(rules.analogue)), np.nan)
    for index, line in enumerate(lines):
        fields = [field.strip() for field in line.split(",")]
        if len(fields) != wide:
            raise RecordError(f"{path}, line {index + 1}: {len(fields)} entries where {wide} are expected")
        try:
            table[index] = [float(field) if field else np.nan for field in fields[: table.shape[1]]]
        except ValueError as error:
            raise damaged(path, f", line {index + 1}: {error}") from error
    return table[:, 0], table[:, 1], table[:, 2:]


def _binary(content: bytes, rules: _Configuration, path: Path) -> tuple[Array, Array, Array]:
    stored, missing = _FORMATS[rules.kind]
    words = -(-rules.digital // 16)
    parts = ("number", "<u4"), ("stamp", "<u4"), ("analogue", stored, (len(rules.analogue),))
    row = np.dtype([*parts, ("digital", "<u2", (words,))])
    if len(content) % row.itemsize:
        whole = f"{len(content)} bytes are no whole number of samples of {row.itemsize}"
        raise damaged(path, f" is truncated: {whole}")
    table = np.frombuffer(content, row)
    values = table["analogue"].astype(np.float64)
    if missing is not None:
        values[table["analogue"] == missing] = np.nan
    stamps = table["stamp"].astype(np.float64)
    stamps[table["stamp"] == 2**32 - 1] = np.nan
    return table["number"].astype(np.float64), stamps, values


def _seconds(numbers: Array, stamps: Array, rules: _Configuration, path: Path) -> Array:
    """Time of every sample from the first [s]: by the rates where there are any, else by the time stamps."""
    if not np.all(np.diff(numbers) == 1.0):
        at = int(np.argmax(np.diff(numbers) != 1.0))
        words = f": sample {numbers[at + 1]:.0f} follows sample {numbers[at]:.0f}"
        raise damaged(path, f"{words}, samples are missing or in disorder")
    stamped = np.isfinite(stamps).all()
    if all(rate > 0 for rate, _ in rules.rates):
        if len(rules.rates) == 1:
            return np.arange(len(numbers), dtype=np.float64) / rules.rates[0][0]
        last = [0, *(end for _, end in rules.rates)]
        steps = np.repeat([1.0 / rate for rate, _ in rules.rates], np.diff(last))
        by_rates = np.concatenate([[0.0], np.cumsum(steps[1:])])
        by_stamps = (stamps - stamps[0]) * rules.time_factor
        # the interval from one rate to the next is that of the time stamps
        return by_stamps if stamped and np.all(np.abs(by_stamps - by_rates) < sum(set(steps))) else by_rates
    if not stamped:
        raise RecordError(f"{path} has neither a sampling rate nor a time stamp for every sample")
    return np.asarray((stamps - stamps[0]) * rules.time_factor)
