"""Excel: the first sheet that holds a table, read as the text it would be exported to."""

from __future__ import annotations

import re
import zipfile
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


def read_excel(path: Path, profile: Profile) -> Recording:
    """Read the sheet with the most rows of a workbook (.xlsx); numbers keep every digit that is stored."""
    from rotordrop.record.readers.delimited import recording_of_lines

    sheet = unpack(path, "excel").attributes
    text = profile.text.model_copy(update={"separator": "\t", "decimal": str(sheet["decimal"])})
    ruled = profile.model_copy(update={"text": text})
    lines = str(sheet["lines"]).split("\n")
    return recording_of_lines(lines, True, str(sheet["origin"]), path, ruled)


def unpacked(path: Path) -> Content:
    """In the child: the sheet with the most rows, as lines of fields with tabs between them."""
    import openpyxl

    try:
        with zipfile.ZipFile(path) as archive:
            unpacked_bytes = sum(entry.file_size for entry in archive.infolist())
        refuse_bomb(unpacked_bytes // 8, path.stat().st_size, path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
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
    name, (lines, decimal) = max(sheets.items(), key=lambda one: len(one[1][0]), default=("", ([], ".")))
    if not lines:
        raise RecordError(f"{path} holds no sheet with cells")
    others = ", ".join(repr(other) for other, (rows, _) in sheets.items() if rows and other != name)
    origin = f"sheet {name!r}" + (f" (left out: {others})" if others else "")
    return Content(items=(), attributes={"origin": origin, "lines": "\n".join(lines), "decimal": decimal})


def _field(cell: Any, decimal: str) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell).replace(".", decimal)
    if isinstance(cell, datetime | time):
        return cell.isoformat(" ") if isinstance(cell, datetime) else cell.isoformat()
    return str(cell).replace("\t", " ").replace("\n", " ")
