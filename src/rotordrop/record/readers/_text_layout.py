"""How a delimited text file is laid out: encoding, separator, decimal sign, header, first numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Literal

from rotordrop.errors import RecordError
from rotordrop.record.profile import TextLayout
from rotordrop.record.recording import known_unit

BLANKS = frozenset(("", "nan", "-", "--", "---", "n/a", "na", "null", "#n/a", "inf", "-inf", "+inf"))
"""What recorders write where a sample is missing."""

_EXPONENT = r"(?:[eE][+-]?[0-9]+)?"
_NUMBER = re.compile(rf"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+){_EXPONENT}")
_WITH_COMMA = re.compile(rf"[+-]?(?:[0-9]+,?[0-9]*|,[0-9]+){_EXPONENT}")
_THOUSANDS = {
    ".": re.compile(r"[+-]?[0-9]{1,3}(?:[,'’\u2009\u202f\u00a0 ][0-9]{3})+\.[0-9]+"),
    ",": re.compile(r"[+-]?[0-9]{1,3}(?:[.'’\u2009\u202f\u00a0 ][0-9]{3})+,[0-9]+"),
}
"""Numbers with thousands set apart; only with decimals is it clear which sign is which."""

_STAMP = re.compile(
    r"(?:(?:(?P<year>[0-9]{4})-(?P<month>[0-9]{1,2})-(?P<day>[0-9]{1,2})"
    r"|(?P<first>[0-9]{1,2})(?P<sign>[./])(?P<second>[0-9]{1,2})(?P=sign)(?P<last>[0-9]{4}))(?:[T ]+|$))?"
    r"(?:(?P<hour>[0-9]{1,2}):(?P<minute>[0-9]{2})(?::(?P<whole>[0-9]{2})(?:[.,](?P<part>[0-9]{1,12}))?)?"
    r"(?:Z|[+-][0-9]{2}:?[0-9]{2})?)?(?<=[0-9Z])"
)
_WIDE = (b"\xff\xfe", b"\xfe\xff")
"""Marks at the begin of a text of two bytes per character."""

_LONGEST_LINE = 1_000_000

ColumnKind = Literal["number", "time", "text"]
_SEPARATORS = (";", "\t", ",", "|", " ")
_SAMPLED_LINES = 60


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where things are in a delimited text file."""

    separator: str
    decimal: str
    """Signs between columns and in numbers."""
    first: int
    """Index of the first data line, counted from 0."""
    columns: int
    """Number of columns of the data lines."""
    kinds: tuple[ColumnKind, ...]
    """What every column holds: "number", "time" (a date, a time of day or both) or "text"."""


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
    with path.open("rb") as stream:
        content = stream.read(_LONGEST_LINE + 1)
        if not content.startswith(_WIDE) and not rules.encoding:
            _refuse_no_text(content, path)
        content += stream.read()
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
    long = next((i for i, line in enumerate(lines) if len(line) > _LONGEST_LINE), None)
    if long is not None:
        raise RecordError(
            f"{path}, line {long + 1} has {len(lines[long])} characters; no row of a recording is so long: "
            "export it again, one row per sample"
        )
    complete = lines[-1] == ""
    while lines and not lines[-1].strip():
        lines.pop()
    return lines, complete, encoding


def _refuse_no_text(begin: bytes, path: Path) -> None:
    """Refuse what its beginning shows to be no text before all of it is read."""
    if b"\x00" in begin:
        raise RecordError(
            f"{path} is not a text file: character {begin.index(0) + 1} is a zero byte; set 'format' in the "
            "profile"
        )
    if len(begin) > _LONGEST_LINE and not any(end in begin for end in (b"\n", b"\r")):
        raise RecordError(
            f"{path}, line 1 has more than {_LONGEST_LINE} characters; no row of a recording is so long: "
            "export it again, one row per sample"
        )


def _encoding(content: bytes) -> str:
    if content.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if content.startswith(_WIDE):
        return "utf-16"
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def fields_of(line: str, separator: str) -> list[str]:
    """Split a line into its fields, quotes and outer blanks removed; within quotes nothing separates."""
    if separator == " ":
        parts = line.split()
    elif '"' in line:
        parts = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    else:
        parts = line.split(separator)
    return [part.strip().strip('"').strip() for part in parts]


_A_NUMBER = re.compile(r"(^|[\s;,\"])[-+]?[.,]?\d")
"""Where a number begins, at the start of a field."""


def find_layout(lines: list[str], path: Path, rules: TextLayout) -> Layout:
    """Find separator, decimal sign, what each column holds and the first data line from the lines themselves.

    Raises
    ------
    RecordError
        When no separator turns the lines into rows that hold numbers.
    """
    separators = (rules.separator,) if rules.separator else _SEPARATORS
    decimals = (rules.decimal,) if rules.decimal else (".", ",")
    sample = _sampled(lines)
    tried = [
        found
        for separator in separators
        for decimal in decimals
        if separator != decimal and (found := _layout(sample, separator, decimal)) is not None
    ]
    best = max(tried, key=lambda found: found[0], default=None)
    if best is None or best[0][0] < 0.5 * len(sample):
        if re.search(r"[;,\t]", lines[-1]) and not any(_A_NUMBER.search(line) for line in lines):
            raise RecordError(
                f"{path}: no line holds a number, the last one (line {len(lines)}) reads "
                f"{lines[-1][:60]!r}: a header without readings? Export the readings too"
            )
        raise RecordError(
            f"{path}: found no columns of numbers with semicolon, tab, comma or blank between them (line "
            f"{len(lines)} reads {lines[-1][:60]!r}); export it as a table of numbers, or name "
            "'separator' and 'decimal' in the profile"
        )
    layout = best[1]
    first = _first_data_line(lines, layout) if rules.first_data_line is None else rules.first_data_line - 1
    return replace(layout, first=first)


def _sampled(lines: list[str]) -> list[str]:
    """Lines spread over the file, leaving out the header and a last line that may be cut."""
    body = [line for line in lines[len(lines) // 4 : -1] if line.strip()] or lines
    step = max(1, len(body) // _SAMPLED_LINES)
    return body[::step]


def _layout(sample: list[str], separator: str, decimal: str) -> tuple[tuple[int, int, int], Layout] | None:
    """How well a pair of signs fits: rows of one length, columns of numbers less those of words, columns."""
    rows = [fields_of(line, separator) for line in sample]
    lengths = Counter(len(row) for row in rows if len(row) > 1)
    if not lengths:
        return None
    columns = lengths.most_common(1)[0][0]
    fitting = [row for row in rows if len(row) == columns]
    kinds = tuple(_kind([row[i] for row in fitting], decimal) for i in range(columns))
    numbers = kinds.count("number")
    if not numbers:
        return None
    layout = Layout(separator=separator, decimal=decimal, first=0, columns=columns, kinds=kinds)
    intact = sum(is_row(row, layout) for row in fitting)
    return (intact, numbers - kinds.count("text"), columns), layout


def _kind(fields: list[str], decimal: str) -> ColumnKind:
    """What the fields of a column are for the most part; a column of blanks counts as numbers."""
    told = [field for field in fields if field.lower() not in BLANKS]
    most = 0.6 * len(told)
    if sum(is_number(field, decimal) for field in told) >= most:
        return "number"
    if sum(is_timestamp(field) for field in told) >= most:
        return "time"
    return "text"


def is_row(fields: list[str], layout: Layout) -> bool:
    """Whether a line is a data row: numbers and times where they belong, samples possibly missing."""
    if len(fields) != layout.columns:
        return False
    some = False
    for field, kind in zip(fields, layout.kinds, strict=True):
        if kind == "text" or field.lower() in BLANKS:
            continue
        if not (is_number(field, layout.decimal) if kind == "number" else is_timestamp(field)):
            return False
        some = True
    return some


def is_number(field: str, decimal: str) -> bool:
    """Whether a field is a number with the given decimal sign, thousands possibly set apart."""
    pattern = _WITH_COMMA if decimal == "," else _NUMBER
    return pattern.fullmatch(field) is not None or _THOUSANDS[decimal].fullmatch(field) is not None


def plain_number(field: str, decimal: str) -> str:
    """A number as Python writes it."""
    if _THOUSANDS[decimal].fullmatch(field):
        whole, sign, part = field.rpartition(decimal)
        field = re.sub(r"[^0-9+-]", "", whole) + sign + part
    return field.replace(decimal, ".")


def is_timestamp(field: str) -> bool:
    """Whether a field is a date, a time of day, or both."""
    return _STAMP.fullmatch(field) is not None


def stamp_parts(field: str) -> tuple[int, int] | None:
    """Whole seconds and nanoseconds of a date, a time of day or both, from one origin; None for no such."""
    match = _STAMP.fullmatch(field)
    if match is None:
        return None
    seconds = nanoseconds = 0
    try:
        if match["year"] or match["last"]:
            day, month = int(match["day"] or match["first"]), int(match["month"] or match["second"])
            if match["last"] and month > 12:
                day, month = month, day
            seconds = date(int(match["year"] or match["last"]), month, day).toordinal() * 86_400
    except ValueError:
        return None
    if match["hour"]:
        seconds += 3600 * int(match["hour"]) + 60 * int(match["minute"]) + int(match["whole"] or 0)
        nanoseconds = int((match["part"] or "").ljust(9, "0")[:9])
    return seconds, nanoseconds


def _first_data_line(lines: list[str], layout: Layout) -> int:
    for index, line in enumerate(lines):
        if is_row(fields_of(line, layout.separator), layout):
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
