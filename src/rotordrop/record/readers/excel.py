"""Excel: the first sheet that holds a table, read as the text it would be exported to."""

from __future__ import annotations

from pathlib import Path

from rotordrop.record.profile import Profile
from rotordrop.record.readers.delimited import recording_of_lines
from rotordrop.record.recording import Recording
from rotordrop.record.unpacking import unpack


def read_excel(path: Path, profile: Profile) -> Recording:
    """Read the sheet with the most rows of a workbook (.xlsx); numbers keep every digit that is stored."""
    sheet = unpack(path, "excel").attributes
    text = profile.text.model_copy(update={"separator": "\t", "decimal": "."})
    ruled = profile.model_copy(update={"text": text})
    lines = str(sheet["lines"]).split("\n")
    return recording_of_lines(lines, True, f"sheet {sheet['name']!r}", path, ruled)
