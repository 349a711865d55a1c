"""Excel: the first sheet that holds a table, read as the text it would be exported to."""

from __future__ import annotations

import zipfile
from datetime import datetime, time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotordrop.errors import RecordError
from rotordrop.record.recording import Recording
from rotordrop.record.sandbox import Content, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile


def read_excel(path: Path, profile: Profile) -> Recording:
    """Read the sheet with the most rows of a workbook (.xlsx); numbers keep every digit that is stored."""
    from rotordrop.record.readers.delimited import recording_of_lines

    sheet = unpack(path, "excel").attributes
    text = profile.text.model_copy(update={"separator": "\t", "decimal": "."})
    ruled = profile.model_copy(update={"text": text})
    lines = str(sheet["lines"]).split("\n")
    return recording_of_lines(lines, True, f"sheet {sheet['name']!r}", path, ruled)


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
            rows = [[_field(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
            sheets[sheet.title] = ["\t".join(row) for row in rows if any(row)]
    except (RecordError, MemoryError):
        raise
    except Exception as error:  # the library fails in many ways on damaged workbooks
        raise RecordError(f"{path} cannot be read as a workbook: {error}; save it again") from error
    name, lines = max(sheets.items(), key=lambda sheet: len(sheet[1]), default=("", []))
    if not lines:
        raise RecordError(f"{path} holds no sheet with cells")
    return Content(items=(), attributes={"name": name, "lines": "\n".join(lines)})


def _field(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, datetime | time):
        return cell.isoformat(" ") if isinstance(cell, datetime) else cell.isoformat()
    return str(cell).replace("\t", " ").replace("\n", " ")
