"""Excel: sheets that hold tables, read as the text they would be exported to."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from datetime import datetime, time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotordrop.errors import RecordError
from rotordrop.record.recording import Recording, damaged
from rotordrop.record.sandbox import Content, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_COMMA, _LOOKED_AT = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?"), 200
"""A number as text with a decimal comma, and the rows of a sheet in which one is looked for."""


_ENOUGH = 4
"""Channels of a sheet that is a recording by itself: two planes."""


def read_excel(path: Path, profile: Profile) -> Recording:
    """Read the largest sheet of a workbook, and those beside it that have other channels of the same time."""
    from rotordrop.record.readers.delimited import recording_of_lines

    parts, left = dict[str, Recording](), []
    for name, (decimal, lines) in unpack(path, "excel").attributes.items():
        text = profile.text.model_copy(update={"separator": "\t", "decimal": decimal})
        ruled = profile.model_copy(update={"text": text})
        try:
            part = recording_of_lines(lines.split("\n"), True, f"sheet {name!r}", path, ruled)
        except RecordError:
            if not parts:
                raise
            left.append(repr(name))
            continue
        first = next(iter(parts.values()), part)
        again = {one.label for one in part.channels} & {one.label for one in first.channels}
        if parts and (not _together(part, first) or (again and len(first.channels) >= _ENOUGH)):
            left.append(repr(name))
        else:  # tabs and decimal signs are those of the unpacked lines, not of the workbook
            parts[name] = replace(part, notes=(f"sheet {name!r}", *part.notes[1:]))
    labels = [one.label for part in parts.values() for one in part.channels]
    channels = tuple(
        one
        if labels.count(one.label) == 1
        else replace(one, name=f"{name} {one.name}", label=f"{name} {one.label}")
        for name, part in parts.items()
        for one in part.channels
    )
    (origin, *notes), *others = (part.notes for part in parts.values())
    notes += [note for more in others for note in more]
    sheets = f"{origin} (left out: {', '.join(left)})" if left else origin
    notes += ["what a sheet that is left out holds is read from a workbook of its own"] if left else []
    warnings = tuple(word for part in parts.values() for word in part.warnings)
    return replace(parts[next(iter(parts))], channels=channels, notes=(sheets, *notes), warnings=warnings)


def _together(one: Recording, other: Recording) -> bool:
    """Whether two sheets hold the same time for the most part."""
    (a, b), (c, d) = ((part.channels[0].time[0], part.channels[0].time[-1]) for part in (one, other))
    return bool(min(b, d) - max(a, c) > 0.5 * (d - c))


def unpacked(path: Path) -> Content:
    """In the child: the sheets, that with the most rows first, as lines of fields with tabs between them."""
    import openpyxl

    try:
        with zipfile.ZipFile(path) as archive:
            unpacked_bytes = sum(entry.file_size for entry in archive.infolist())
        refuse_bomb(unpacked_bytes // 8, path.stat().st_size, path)
        book = openpyxl.load_workbook(path.open("rb"), read_only=True, data_only=True)
        sheets = {}
        for sheet in book.worksheets:
            rows = list(sheet.iter_rows(values_only=True))
            comma = any(_COMMA.fullmatch(str(cell)) for row in rows[:_LOOKED_AT] for cell in row)
            decimal = "," if comma else "."
            lines = ["\t".join(_field(cell, decimal) for cell in row) for row in rows]
            sheets[sheet.title] = [line for line in lines if line.strip()], decimal
    except (RecordError, MemoryError):
        raise
    except Exception as error:  # the library fails in many ways on damaged workbooks
        raise damaged(path, f" cannot be read as a workbook: {error}") from error
    filled = sorted(((name, one) for name, one in sheets.items() if one[0]), key=lambda one: -len(one[1][0]))
    if not filled:
        raise RecordError(f"{path} holds no sheet with cells")
    told = {name: (decimal, "\n".join(lines)) for name, (lines, decimal) in filled}
    return Content(items=(), attributes=told)


def _field(cell: Any, decimal: str) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell).replace(".", decimal)
    if isinstance(cell, datetime | time):
        return cell.isoformat(" ") if isinstance(cell, datetime) else cell.isoformat()
    return str(cell).replace("\t", " ").replace("\n", " ")
