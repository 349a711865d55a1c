"""LabVIEW measurement files (.lvm): text with a head for the file and one for every segment."""

from __future__ import annotations

import re
from pathlib import Path

from rotordrop.record.profile import Profile
from rotordrop.record.readers.delimited import recording_of_lines
from rotordrop.record.readers.text import fields_of, read_lines
from rotordrop.record.recording import Recording

_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


def read_lvm(path: Path, profile: Profile) -> Recording:
    """Read the segments of a file, with one time column, one for each channel or none.

    Segments that follow each other are joined. Of others the first is read with a warning, or the one that
    begins at `text.first_data_line` of the profile.
    """
    lines, complete, encoding = read_lines(path, profile.text)
    head = "\n".join(lines[:40])
    named = re.search(r"^Separator[\t,;](\w+)", head, re.MULTILINE)
    comma = re.search(r"^Decimal_Separator[\t,;],", head, re.MULTILINE)
    separator = profile.text.separator or _SEPARATORS.get(named[1].lower() if named else "", "\t")
    decimal = profile.text.decimal or ("," if comma else ".")

    def first(begin: str) -> int | None:
        """Index of the first line that begins so."""
        return next((i for i, line in enumerate(lines) if line.startswith(begin)), None)

    end, names, top = first("***End_of_Header***"), first("X_Value"), first(f"Channels{separator}")
    top = top if top is not None else 0 if end is None else end + 1
    data = profile.text.first_data_line or (top if names is None else names + 1) + 1
    # blank lines in place of the head of the file keep the numbers of lines in messages
    lines = [""] * top + _without_comments(lines[top:], separator)
    text = profile.text.model_copy(
        update={"separator": separator, "decimal": decimal, "first_data_line": data}
    )
    ruled, origin = profile.model_copy(update={"text": text}), f"LabVIEW measurement in {encoding}"
    return recording_of_lines(lines, complete, origin, path, ruled, segments=True)


def _without_comments(lines: list[str], separator: str) -> list[str]:
    """Cut off the column of comments, which many rows lack."""
    names = next((fields_of(line, separator) for line in lines if line.startswith("X_Value")), [])
    if not names or names[-1] != "Comment":
        return lines
    return [separator.join(line.split(separator)[: len(names) - 1]) for line in lines]
