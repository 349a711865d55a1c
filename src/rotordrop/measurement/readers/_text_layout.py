"""How a delimited text file is laid out: encoding, separator, decimal sign, header, first numbers."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from rotordrop.errors import RecordError
from rotordrop.measurement.profile import TextLayout
from rotordrop.measurement.recording import known_unit

BLANKS = frozenset(("", "nan", "-", "--", "---", "n/a", "na", "null", "#n/a", "inf", "-inf", "+inf"))
"""What recorders write where a sample is missing."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_SEPARATORS = (";", "\t", ",", "|", " ")
_SAMPLED_LINES = 60


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where things are in a delimited text file.

    Attributes
    ----------
    separator, decimal : str
        Signs between columns and in numbers.
    first : int
        Index of the first data line, counted from 0.
    columns : int
        Number of columns of the data lines.
    """

    separator: str
    decimal: str
    first: int
    columns: int


def read_lines(path: Path, rules: TextLayout) -> tuple[list[str], bool, str]:
    """Read a text file of unknown encoding.

    Returns
    -------
    lines : list of str
        Without line ends.
    complete : bool
        Whether the last line has its line end.
    encoding : str
        The encoding used.
    """
    content = path.read_bytes()
    if not content:
        raise RecordError(f"{path} is empty (0 bytes); export the recording again")
    encoding = rules.encoding or _encoding(content)
    try:
        text = content.decode(encoding)
    except (UnicodeDecodeError, LookupError) as error:
        raise RecordError(f"{path} cannot be read as {encoding}: {error}; name another encoding") from error
    if "\x00" in text:
        at = text.index("\x00")
        raise RecordError(
            f"{path} is not a text file: character {at + 1} is a zero byte; set 'format' in the profile"
        )
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    complete = lines[-1] == ""
    while lines and not lines[-1].strip():
        lines.pop()
    return lines, complete, encoding


def _encoding(content: bytes) -> str:
    for mark, name in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if content.startswith(mark):
            return name
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def fields_of(line: str, separator: str) -> list[str]:
    """Split a line into its fields, quotes and outer blanks removed."""
    parts = line.split() if separator == " " else line.split(separator)
    return [part.strip().strip('"').strip() for part in parts]


def find_layout(lines: list[str], path: Path, rules: TextLayout) -> Layout:
    """Find separator, decimal sign and the first data line from the numbers in the file.

    Raises
    ------
    RecordError
        When no separator turns the lines into rows of numbers.
    """
    separators = (rules.separator,) if rules.separator else _SEPARATORS
    decimals = (rules.decimal,) if rules.decimal else (".", ",")
    sample = _sampled(lines)
    best: tuple[int, int, str, str] | None = None
    for separator in separators:
        for decimal in decimals:
            count, columns = _rows_that_fit(sample, separator, decimal)
            if separator != decimal and columns > 1 and (best is None or (count, columns) > best[:2]):
                best = (count, columns, separator, decimal)
    if best is None or best[0] < 0.5 * len(sample):
        raise RecordError(
            f"{path}: found no columns of numbers with semicolon, tab, comma or blank between them (line "
            f"{len(lines)} reads {lines[-1][:60]!r}); name 'separator' and 'decimal' in the profile"
        )
    _, columns, separator, decimal = best
    first = _first_data_line(lines, separator, decimal, columns)
    if rules.first_data_line is not None:
        first = rules.first_data_line - 1
    return Layout(separator=separator, decimal=decimal, first=first, columns=columns)


def _sampled(lines: list[str]) -> list[str]:
    """Lines spread over the file, leaving out the header and a last line that may be cut."""
    body = [line for line in lines[len(lines) // 4 : -1] if line.strip()] or lines
    step = max(1, len(body) // _SAMPLED_LINES)
    return body[::step]


def _rows_that_fit(sample: list[str], separator: str, decimal: str) -> tuple[int, int]:
    """How many lines are rows of numbers, and of how many columns the most frequent kind is."""
    counts = Counter(
        len(fields)
        for line in sample
        if is_row(fields := fields_of(line, separator), decimal) and len(fields) > 1
    )
    if not counts:
        return 0, 0
    columns, count = counts.most_common(1)[0]
    return count, columns


def is_row(fields: list[str], decimal: str) -> bool:
    """Whether a line is a row of numbers, possibly led by a date and with samples missing."""
    numbers = sum(is_number(field, decimal) for field in fields)
    others = [(i, field) for i, field in enumerate(fields) if not is_number(field, decimal)]
    return numbers > 0 and all(
        field.lower() in BLANKS or (i == 0 and is_timestamp(field)) for i, field in others
    )


def is_number(field: str, decimal: str) -> bool:
    """Whether a field is a number with the given decimal sign."""
    if decimal == ",":
        if "." in field:
            return False
        field = field.replace(",", ".")
    return _NUMBER.fullmatch(field) is not None


def is_timestamp(field: str) -> bool:
    """Whether a field is a date and time in ISO 8601."""
    if len(field) < 16 or field[4:5] != "-":
        return False
    try:
        datetime.fromisoformat(field)
    except ValueError:
        return False
    return True


def _first_data_line(lines: list[str], separator: str, decimal: str, columns: int) -> int:
    for index, line in enumerate(lines):
        fields = fields_of(line, separator)
        if len(fields) == columns and is_row(fields, decimal):
            return index
    raise AssertionError("a layout was found, so there is a data line")


def name_and_unit_rows(header: list[list[str]], columns: int) -> tuple[list[str] | None, list[str] | None]:
    """Find the row of column names and the row of units among the split header lines."""
    full = [row for row in header if len(row) == columns and sum(map(bool, row)) > columns // 2]
    units = next((row for row in full if _is_units(row)), None)
    named = [row for row in full if row is not units and not any(_NUMBER.fullmatch(field) for field in row)]
    return (named[-1] if named else None), units


def _is_units(row: list[str]) -> bool:
    """Whether a row holds units; its first field may be a word such as ``Unit``."""
    rest = [field for field in row[1:] if field not in ("", "-", "1")]
    return bool(rest) and all(known_unit(field) for field in rest)
