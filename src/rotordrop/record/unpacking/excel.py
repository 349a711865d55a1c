"""Workbooks of Excel."""

from __future__ import annotations

import zipfile
from datetime import datetime, time
from pathlib import Path
from typing import Any

import openpyxl

from rotordrop.errors import RecordError
from rotordrop.record.unpacking import Content, refuse_bomb


def unpacked(path: Path) -> Content:
    """Give the sheet with the most rows as lines of fields with tabs between them."""
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked_bytes = sum(entry.file_size for entry in archive.infolist())
        refuse_bomb(unpacked_bytes // 8, path.stat().st_size, path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: _lines(sheet) for sheet in book.worksheets}
    except (RecordError, MemoryError):
        raise
    except Exception as error:  # the library fails in many ways on damaged workbooks
        raise RecordError(f"{path} cannot be read as a workbook: {error}; save it again") from error
    name, lines = max(sheets.items(), key=lambda sheet: len(sheet[1]), default=("", []))
    if not lines:
        raise RecordError(f"{path} holds no sheet with cells")
    return Content(items=(), attributes={"name": name, "lines": "\n".join(lines)})


def _lines(sheet: Any) -> list[str]:
    rows = [[_field(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
    return ["\t".join(row) for row in rows if any(row)]


def _field(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, datetime | time):
        return cell.isoformat(" ") if isinstance(cell, datetime) else cell.isoformat()
    return str(cell).replace("\t", " ").replace("\n", " ")
