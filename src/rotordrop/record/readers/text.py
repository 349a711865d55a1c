"""How a delimited text file is laid out: its lines, signs, columns and numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass, replace
from datetime import date
from decimal import Decimal
from itertools import takewhile
from pathlib import Path
from typing import Literal

from rotordrop.errors import RecordError
from rotordrop.record.profile import TextLayout
from rotordrop.record.recording import damaged, known_unit

BLANKS = frozenset(
    "|nan|-|--|---|*|**|***|****|*****|n/a|na|null|#n/a|invalid|#value!|#num!|#div/0!|over|overflow|overload|"
    "overrange|ol|+++++++|-------|inf|-inf|+inf|∞|-∞|infinity|1.#inf|-1.#inf|1.#qnan|-1.#ind".split("|")
)
"""What recorders write where a sample is missing or beyond the range."""

_EXPONENT = r"(?:[eEdD][+-]?[0-9]+)?"
_PLAIN = {
    ".": re.compile(rf"(?:[+-] *)?(?:[0-9]+\.?[0-9]*|\.[0-9]+){_EXPONENT}"),
    ",": re.compile(rf"(?:[+-] *)?(?:[0-9]+,?[0-9]*|,[0-9]+){_EXPONENT}"),
}
_THOUSANDS = {
    ".": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[,'’\u2009\u202f\u00a0 ][0-9]{3})+(?:\.[0-9]+)?"),
    ",": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.'’\u2009\u202f\u00a0 ][0-9]{3})+(?:,[0-9]+)?"),
}
"""Numbers by their decimal sign, and those with thousands set apart."""

_STAMP = re.compile(
    r"(?:(?:(?P<year>[0-9]{4})(?P<dash>[-/.])(?P<month>[0-9]{1,2})(?P=dash)(?P<day>[0-9]{1,2})"
    r"|(?P<first>[0-9]{1,2})(?P<sign>[./])(?P<second>[0-9]{1,2})(?P=sign)(?P<last>[0-9]{4}))(?:[T ]+|$))?"
    r"(?:(?P<hour>[0-9]{1,2}):(?P<minute>[0-9]{2})(?::(?P<whole>[0-9]{2})"
    r"(?:(?:[.,]|[:;](?=[0-9]{3}))(?P<part>[0-9]{1,12}))?)?"
    r"(?: ?(?P<half>[AP])M|Z|[+-][0-9]{2}:?[0-9]{2})?)?(?<=[0-9ZM])"
)
_SPAN = re.compile(
    r"(?P<days>[+-]?[0-9]+) days?,? *(?P<of_day>[+-]?[0-9:.]+)?|(?P<sign>[+-])(?P<clock>[0-9]{1,2}:[0-9:.,]+)"
    r"|(?P<number>[+-]?[0-9]+(?:[.,][0-9]+)?(?:[eE][+-]?[0-9]+)?) ?(?P<unit>s|sec|ms|us|µs|min)"
)
"""Durations, as MATLAB and pandas write them: "-1 days +23:59:59.75", "-00:00:00.25", "0.05 sec"."""

_A_NUMBER = re.compile(r"(^|[\s;,\"])[-+]?[.,]?\d")
"""Where a number begins, at the start of a field."""

_WIDE = (b"\xff\xfe", b"\xfe\xff")
"""Marks at the begin of a text of two bytes per character."""

_LONGEST_LINE = 1_000_000
"""Characters of a row (chosen): two thousand channels of twenty digits are a twentieth of it."""

_SHORTEST_ROW, _MANY_LINES = 4, 100_000
"""Characters of two numbers, the sign between them and the line end; and lines from which their mean is asked
(chosen): a line takes some sixty bytes however short it is."""

_SEPARATORS = (";", "\t", ",", "|", " ")

_SAMPLED_LINES, _LEAST_FITTING, _MOSTLY = 60, 0.5, 0.6
"""Lines by which the layout is judged, share of them that must be rows for two signs to be believed, share of
fields that make a column one of numbers or of times [1] (chosen)."""

ColumnKind = Literal["number", "time", "text", "blank"]


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
    """What every column holds: "number", "time" (a date, a time of day or both), "text", or nothing."""


def read_lines(path: Path, rules: TextLayout) -> tuple[list[str], bool, str]:
    """Lines of a text of unknown encoding without line ends, whether the last is whole, and the encoding."""
    with path.open("rb") as stream:
        content = stream.read(_LONGEST_LINE + 1)
        if not content.startswith(_WIDE) and not rules.encoding:
            # what its beginning shows to be no text is refused before all of it is read
            if b"\x00" in content:
                raise _no_text(path, content.index(0))
            if len(content) > _LONGEST_LINE and not any(end in content for end in (b"\n", b"\r")):
                raise _too_long(path, 1, f"more than {_LONGEST_LINE}")
        content += stream.read()
    if not content:
        raise RecordError(f"{path} is empty (0 bytes); export the recording again")
    encoding = rules.encoding or _encoding(content)
    try:
        text = content.decode(encoding)
    except (UnicodeDecodeError, LookupError) as error:
        raise RecordError(f"{path} cannot be read as {encoding}: {error}; name another encoding") from error
    if "\x00" in text:
        raise _no_text(path, text.index("\x00"))
    lines = _lines_of(text, path)
    complete = lines[-1] == ""
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise RecordError(f"{path} is blank ({len(content)} bytes); export the recording again")
    return lines, complete, encoding


def _lines_of(text: str, path: Path) -> list[str]:
    text = text.replace("\r\r\n", "\n").replace("\r\n", "\n").replace("\r", "\n")
    ends = text.count("\n")
    if ends > _MANY_LINES and len(text) < _SHORTEST_ROW * ends:
        words = f" has {ends} lines of {len(text) / ends:.1f} characters in the mean; a row of two numbers"
        raise damaged(path, f"{words} has {_SHORTEST_ROW} at least")
    lines = text.split("\n")
    long = next((i for i, line in enumerate(lines) if len(line) > _LONGEST_LINE), None)
    if long is not None:
        raise _too_long(path, long + 1, str(len(lines[long])))
    return lines


def _no_text(path: Path, at: int) -> RecordError:
    words = f"{path} is not a text file: character {at + 1} is a zero byte"
    return RecordError(f"{words}; set 'format' in the profile, or [text] encoding = \"utf-16-le\"")


def _too_long(path: Path, line: int, characters: str) -> RecordError:
    return damaged(path, f", line {line} has {characters} characters; no row of a recording is so long")


def _encoding(content: bytes) -> str:
    if content.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if content.startswith(_WIDE):
        return "utf-16"
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        # so many accented letters in a row stand in no text of western Europe; 0x98 is no letter of cp1251
        return "cp1251" if re.search(rb"[\xc0-\xff]{5}", content) and b"\x98" not in content else "latin-1"
    return "utf-8"


def fields_of(line: str, separator: str) -> list[str]:
    """Split a line into its fields, quotes and outer blanks removed; within quotes nothing separates."""
    if separator == " ":
        parts = [part for part in line.replace("\t", " ").split(" ") if part]
    elif '"' in line:
        parts = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    else:
        parts = line.split(separator)
    return [part.strip().strip('"').strip() for part in parts]


def find_layout(lines: list[str], path: Path, rules: TextLayout) -> Layout:
    """Separator, decimal sign, what each column holds and the first data line, from the lines themselves."""
    # spread over the file, without the header and a last line that may be cut
    begin = len(lines) // 4 if rules.first_data_line is None else rules.first_data_line - 1
    body = [line for line in lines[begin:-1] if line.strip()]
    body = (body if rules.first_data_line is None else [*takewhile(str.strip, lines[begin:])]) or lines[
        begin:
    ]
    sample = body[:: max(1, len(body) // _SAMPLED_LINES)]
    fits = [
        fit
        for separator in ((rules.separator,) if rules.separator else _SEPARATORS)
        for decimal in ((rules.decimal,) if rules.decimal else (".", ","))
        if (separator != decimal or '"' in sample[0])
        and (fit := _fit(sample, separator, decimal)) is not None
    ]
    # a blank in a table with tabs or semicolons sets thousands or words apart
    sure = [fit for fit in fits if fit[1].separator in ";\t" and fit[0][2] == len(sample)]
    fits = [fit for fit in fits if not sure or fit[1].separator != " "]
    best = max(fits, key=lambda fit: fit[0], default=None)
    if best is None or best[0][2] < _LEAST_FITTING * len(sample):
        last = f"{lines[-1][:60]!r}"
        if re.search(r"[;,\t]", lines[-1]) and not any(_A_NUMBER.search(line) for line in lines):
            words = f"no line holds a number, the last one (line {len(lines)}) reads {last}"
            raise RecordError(f"{path}: {words}: a header without readings? Export the readings too")
        words = "found no columns of numbers with semicolon, tab, comma or blank between them"
        ask = "export it as a table of numbers, or name 'separator' and 'decimal' in the profile"
        raise RecordError(f"{path}: {words} (line {len(lines)} reads {last}); {ask}")
    layout = best[1]
    if rules.first_data_line is not None:
        return replace(layout, first=rules.first_data_line - 1)
    rows = (index for index, line in enumerate(lines) if is_row(fields_of(line, layout.separator), layout))
    return replace(layout, first=next(rows))


def _fit(sample: list[str], separator: str, decimal: str) -> tuple[tuple[int, int, int], Layout] | None:
    """How well a pair of signs fits: rows times columns of numbers less those of words, columns, rows.

    A row that is damaged counts less than a column: one that holds words would take every row.
    """
    rows = [fields_of(line, separator) for line in sample]
    lengths = Counter(len(row) for row in rows if len(row) > 1)
    if not lengths:
        return None
    columns = lengths.most_common(1)[0][0]
    fitting = [row for row in rows if len(row) == columns]
    kinds = tuple(_kind([row[i] for row in fitting], decimal) for i in range(columns))
    numbers = kinds.count("number")
    # what may set thousands apart does so where another number has the decimal sign
    apart = [field for row in fitting for field in row if _THOUSANDS[decimal].fullmatch(field)]
    plain = (decimal in field for row in fitting for field in row if is_number(field, decimal))
    if not numbers or (apart and not any(plain)):
        return None
    layout = Layout(separator=separator, decimal=decimal, first=0, columns=columns, kinds=kinds)
    intact = sum(is_row(row, layout) for row in fitting)
    return (intact * max(numbers - kinds.count("text"), 0), columns, intact), layout


def _kind(fields: list[str], decimal: str) -> ColumnKind:
    """What the fields of a column are for the most part."""
    filled = [field for field in fields if field.lower() not in BLANKS]
    if not filled:
        return "blank"
    most = _MOSTLY * len(filled)
    if sum(is_number(field, decimal) for field in filled) >= most:
        return "number"
    return "time" if sum(_is_stamp(field) for field in filled) >= most else "text"


def _is_stamp(field: str) -> bool:
    return _STAMP.fullmatch(field) is not None or _SPAN.fullmatch(field) is not None


def is_row(fields: list[str], layout: Layout) -> bool:
    """Whether a line is a data row: numbers and times where they belong, samples possibly missing."""
    if len(fields) != layout.columns:
        return False
    some = False
    for field, kind in zip(fields, layout.kinds, strict=True):
        if kind == "text" or field.lower() in BLANKS:
            continue
        if not (_is_stamp(field) if kind == "time" else is_number(field, layout.decimal)):
            return False
        some = True
    return some


def is_number(field: str, decimal: str) -> bool:
    """Whether a field is a number with the given decimal sign, thousands possibly set apart."""
    return _PLAIN[decimal].fullmatch(field) is not None or _THOUSANDS[decimal].fullmatch(field) is not None


def plain_number(field: str, decimal: str) -> str:
    """A number as Python writes it; Fortran has a D before its exponent."""
    if _THOUSANDS[decimal].fullmatch(field):
        whole, sign, part = field.partition(decimal)
        field = re.sub(r"[^0-9+-]", "", whole) + sign + part
    return re.sub("[Dd]", "e", field.replace(decimal, ".").replace(" ", ""))


def stamp_parts(field: str) -> tuple[int, int] | None:
    """Whole seconds and nanoseconds of a date, a time of day or both, from one origin; None for no such."""
    if (span := _SPAN.fullmatch(field)) is not None:
        return _of_span(span)
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
        hour = int(match["hour"]) % (12 if match["half"] else 24) + 12 * (match["half"] == "P")
        seconds += 3600 * hour + 60 * int(match["minute"]) + int(match["whole"] or 0)
        nanoseconds = int((match["part"] or "").ljust(9, "0")[:9])
    return seconds, nanoseconds


def is_span(field: str) -> bool:
    """Whether a field is a duration, whose zero is that of the record."""
    return _SPAN.fullmatch(field) is not None


def _of_span(span: re.Match[str]) -> tuple[int, int]:
    """Whole seconds and nanoseconds of a duration."""
    if span["number"]:
        unit = known_unit(span["unit"]) or "s"
        factor = {"s": 10**9, "ms": 10**6, "us": 10**3, "min": 60 * 10**9}[unit]
        return divmod(round(Decimal(span["number"].replace(",", ".")) * factor), 10**9)
    sign, clock = span["sign"] or "+", span["clock"] or (span["of_day"] or "0:00").lstrip("+")
    seconds, nanoseconds = stamp_parts(clock.lstrip("-")) or (0, 0)
    count = (-1 if "-" in sign + clock[:1] else 1) * (10**9 * seconds + nanoseconds)
    return divmod(count + 86_400 * 10**9 * int(span["days"] or 0), 10**9)
