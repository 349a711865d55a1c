"""Universal file format, dataset 58 (functions at nodal degrees of freedom), text or binary."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace
from itertools import accumulate, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.clock import TIME_UNITS
from rotordrop.record.recording import Channel, Recording, damaged, known_unit, listed, split_unit
from rotordrop.record.sandbox import refuse_bomb

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_ONLY = rb"[ \t]*-1[ \t]*\r?(?:\n|\Z)"
_DELIMITER, _NEXT_DELIMITER = re.compile(_ONLY), re.compile(rb"(?<=\n)" + _ONLY)
"""A line that holds only -1; some pad it with blanks, and the last one may have no line end."""

_SIGN = re.compile(rb"[^ \t\r\n]")
_KIND = re.compile(rb"58b?(?!\S)|(?:1[58]|55|56|82|\d{3,4})(?!\S)")
"""Types of datasets: the one that is read, and others that stand in universal files."""

_HEAD_LINES = 11
"""Lines of a dataset 58 before its samples: five of text, the degrees of freedom, the form, four axes."""

_FORM = {2: ("f4", 13, 13), 4: ("f8", 20, 13)}
"""Real ordinates by their code: how one is stored, its width in text, and the width of a time stamp."""

_UNITS = re.compile(rb"^[ \t]*164[ \t]*\r?\n[^\n]*\n([^\n]*)\n", re.MULTILINE)
"""Dataset 164, whose third line begins with the units of length in a metre, in 25 columns."""

_DISPLACEMENT = "8"
_FREQUENCY = 18
"""Code of an abscissa that is no time."""


def read_uff(path: Path, profile: Profile) -> Recording:
    """Read the time histories of a universal file; channels are named in the first identification line."""
    content = path.read_bytes()
    channels: list[Channel] = []
    points: list[str] = []
    others: list[str] = []
    entries: dict[str, str] = {}
    per_metre = None  # units of length, by dataset 164
    with suppress(ValueError):
        per_metre = float(told[1][:25].replace(b"D", b"E")) if (told := _UNITS.search(content)) else None
    at = _behind_blanks(content, 0)
    while at < len(content):
        opening = _DELIMITER.match(content, at)
        line_end = len(content) if opening is None else content.find(b"\n", opening.end())
        kind = b"" if opening is None else content[opening.end() : line_end].strip()
        if not _KIND.match(kind):
            found = f"at byte {at} stands {content[at : at + 30]!r} where a line -1 and the type of a dataset"
            raise damaged(path, f": {found} are expected; it is no universal file, cut off or damaged")
        at = line_end + 1
        if kind.startswith(b"58"):
            head, at = _head(content, at, path)
            time, values, at = _samples(content, at, kind.split(), head, path)
            time = TIME_UNITS.get(known_unit(head[7][47:69]) or "s", 1.0) * time
            name, label, unit = split_unit(head[0].strip())
            unit = unit if head[8][47:69].strip() in ("", "NONE") else head[8][47:69].strip()
            if not unit and per_metre and values is not None and head[8].split()[:1] == [_DISPLACEMENT]:
                unit, values = "m", values / per_metre
            if values is None:
                others.append(f"spectrum {label!r}")
            else:
                channels.append(profile.channel(name, unit, values, time, label=label))
                entries.setdefault("id2", head[1].strip())
                points.append(_point(head[5]))
            closing = _DELIMITER.match(content, _behind_blanks(content, at))
        else:
            others += [] if kind == b"164" else [f"dataset {kind.decode()[:6]}"]
            closing = _NEXT_DELIMITER.search(content, at - 1)
        if closing is None:
            words = f"has no closing -1 (the file has {len(content)} bytes)"
            raise damaged(path, f" is truncated or damaged: dataset {len(channels) + len(others)} {words}")
        at = _behind_blanks(content, closing.end())
    if not channels:
        have = listed(others) or "no dataset"
        raise RecordError(f"{path} holds no time history of dataset 58 (it has {have}); export time signals")
    if len(set(points)) == len(points) > len({one.label for one in channels}):  # one name for all
        channels = [replace(one, name=p, label=p) for one, p in zip(channels, points, strict=True)]
    notes = (f"left out, no time histories: {listed(others)}",) if others else ()
    return Recording(channels=tuple(channels), metadata=entries, notes=notes)


def _point(line: str) -> str:
    """Where and along which axis a channel reads: entity, node and direction of the response."""
    axis = line[51:55].strip()
    sign = "-" if axis.startswith("-") else ""
    letter = {"1": "X", "2": "Y", "3": "Z"}.get(axis.lstrip("+-"), axis)
    entity = line[31:41].strip().replace("NONE", "")
    return f"{entity} {line[41:51].strip()} {sign}{letter}".strip()


def _behind_blanks(content: bytes, at: int) -> int:
    """Where the next sign stands that is no blank."""
    return len(content) if (found := _SIGN.search(content, at)) is None else found.start()


def _head(content: bytes, at: int, path: Path) -> tuple[list[str], int]:
    """The lines before the samples, whose fields stand at fixed columns, and where they end."""
    lines = []
    for _ in range(_HEAD_LINES):
        end = content.find(b"\n", at)
        if end < 0:
            raise damaged(path, " is truncated: it ends within the header of a dataset")
        lines.append(content[at:end].rstrip(b"\r"))
        at = end + 1
    try:
        return [line.decode("utf-8") for line in lines], at
    except UnicodeDecodeError:
        return [line.decode("latin-1") for line in lines], at


def _samples(
    content: bytes, at: int, kind: list[bytes], head: list[str], path: Path
) -> tuple[Array, Array | None, int]:
    """Time [s] and samples, no samples where they are those of a spectrum, and where they end."""
    place = f"{path}: dataset {head[0].strip()!r}"
    try:
        code, count, even = (int(part) for part in head[6].split()[:3])
        start, step = (float(part.replace("D", "E")) for part in head[6].split()[3:5])
        abscissa = int(head[7].split()[0])
    except (ValueError, IndexError) as error:
        raise damaged(place, " has no readable line 7 (type, count, spacing, start, step)") from error
    if code not in (2, 4, 5, 6) or count < 0:
        raise damaged(place, f" declares {count} samples of the unknown type {code}")
    expected = count * (1 if even else 2)
    refuse_bomb(expected, len(content), path)
    stored, wide, wide_time = _FORM[2 if code in (2, 5) else 4]
    parts = 2 if code in (5, 6) else 1
    time = start + step * np.arange(count, dtype=np.float64)
    spectrum = parts == 2 or abscissa == _FREQUENCY
    if kind[0] == b"58b":
        clock = "f4" if code in (2, 5) else "f8"
        row = np.dtype([("time", clock, (0 if even else 1,)), ("y", stored, (parts,))])
        try:
            order, declared = int(kind[1]), int(kind[4])
        except (ValueError, IndexError) as error:
            raise damaged(place, f" does not declare its bytes ({b' '.join(kind)!r})") from error
        present = min(declared, len(content) - at)
        if declared != count * row.itemsize or present < declared:
            needed = f"{count} samples ({count * row.itemsize} bytes) in {declared} bytes"
            words = f"{needed} and {present} bytes are present"
            raise damaged(place, f" declares {words}, it is truncated or damaged")
        table = np.frombuffer(content, row.newbyteorder("<" if order == 1 else ">"), count, at)
        values = table["y"][:, 0].astype(np.float64)
        time = time if even else table["time"][:, 0].astype(np.float64)
        return time, None if spectrum else values, at + declared
    closing = _NEXT_DELIMITER.search(content, at - 1)
    end = len(content) if closing is None else closing.start()
    if spectrum:
        return time, None, end
    widths = [wide] * (80 // wide) if even else [wide_time, wide] * (80 // (wide_time + wide))
    try:
        numbers = _numbers(content[at:end].decode("latin-1").replace("D", "E"), expected, widths)
    except ValueError as error:
        raise damaged(place, f": {error}") from error
    if len(numbers) != expected:
        present = len(numbers) // (1 if even else 2)
        words = f"{count} samples and {present} are present"
        raise damaged(place, f" declares {words}, it is truncated or damaged")
    return (time, numbers, end) if even else (numbers[::2], numbers[1::2], end)


def _numbers(text: str, expected: int, widths: list[int]) -> Array:
    """Numbers with blanks between them, else those at fixed columns, where a sign may follow a digit."""
    with suppress(ValueError):
        numbers = np.array(text.split(), dtype=np.float64)
        if len(numbers) == expected:
            return numbers
    edges = list(pairwise([0, *accumulate(widths)]))
    cut = (line[first:last] for line in text.splitlines() for first, last in edges)
    return np.array([field for field in cut if field.strip()], dtype=np.float64)
