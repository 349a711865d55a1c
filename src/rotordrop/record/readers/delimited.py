"""Delimited text: CSV and TXT as recorders, spreadsheets and data loggers write them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.readers._text_header import Header, read_header
from rotordrop.record.readers._text_layout import (
    BLANKS,
    Layout,
    fields_of,
    find_layout,
    is_number,
    name_and_unit_rows,
    plain_number,
    read_lines,
    stamp_parts,
)
from rotordrop.record.recording import Array, Channel, Recording, known_unit, split_unit
from rotordrop.units import parse_quantity

_LONGEST_HEADER_LINE = 500
_TIME_NAMES = re.compile(r"(time|zeit|t|temps|tempo|tiempo|timestamp|x_value)\b", re.IGNORECASE)


def read_delimited(path: Path, profile: Profile) -> Recording:
    """Read a text file of columns, whatever its separator, decimal sign, header and time column.

    Parameters
    ----------
    path : Path
        The file.
    profile : Profile
        Rules that replace guesses.

    Raises
    ------
    RecordError
        With the line, when a line has another number of columns or something that is no number.
    """
    lines, complete, encoding = read_lines(path, profile.text)
    return recording_of_lines(lines, complete, f"text in {encoding}", path, profile)


def recording_of_lines(
    lines: list[str], complete: bool, origin: str, path: Path, profile: Profile
) -> Recording:
    """Make a recording of lines of text, whose `origin` is a word for the report."""
    layout = find_layout(lines, path, profile.text)
    header_lines = lines[: layout.first]
    labels, unused = _column_labels(header_lines, layout, profile, path)
    header = read_header([line[:_LONGEST_HEADER_LINE] for line in unused], layout.separator)
    rows, notes, warnings = _intact_rows(lines, complete, layout, path)
    columns = [split_unit(label) for label in labels]
    table = _numbers(rows, layout, labels, path)
    stamped = _stamped_seconds(rows, layout, path)
    time, used, words = _clock(table, columns, stamped, layout, header, profile, path)
    channels = tuple(
        Channel(name=name, label=label, unit=profile.units.get(label, unit), values=table[i], time=time)
        for i, (name, label, unit) in enumerate(columns)
        if i in table and i not in used
    )
    texts = [labels[i] for i, kind in enumerate(layout.kinds) if kind == "text"]
    notes += [f"left out, no numbers: {', '.join(texts)}"] if texts else []
    if header.count is not None and len(rows) < header.count:
        warnings.append(
            f"the header declares {header.count} samples and {len(rows)} are present: the file is truncated"
        )
    return Recording(
        channels=channels,
        metadata=header.entries,
        notes=(f"{origin}, {_spoken(layout)}", *notes, *words),
        warnings=tuple(warnings),
        sensitivity=header.sensitivity,
        voltage_offset=header.voltage_offset,
    )


def _spoken(layout: Layout) -> str:
    signs = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "blank"}
    decimal = "decimal comma" if layout.decimal == "," else "decimal point"
    separator = signs.get(layout.separator, repr(layout.separator))
    return f"{separator} between {layout.columns} columns, {decimal}"


def _column_labels(
    header: list[str], layout: Layout, profile: Profile, path: Path
) -> tuple[list[str], list[str]]:
    """Name the columns, with the unit of a units row in brackets; give the other header lines too."""
    if profile.text.names is not None:
        if len(profile.text.names) != layout.columns:
            raise RecordError(
                f"{path} has {layout.columns} columns and the profile names {len(profile.text.names)}"
            )
        rows = [fields_of(line, layout.separator) for line in header]
        _refuse_damaged_start(header, rows, (None, None), layout, path)
        return list(profile.text.names), header
    rows = [fields_of(line.lstrip("# "), layout.separator) for line in header]
    names, units = name_and_unit_rows(rows, layout.columns)
    _refuse_damaged_start(header, rows, (names, units), layout, path)
    if names is None:
        last = f"the line above the numbers reads {header[-1][:60]!r}" if header else "there is no header"
        raise RecordError(
            f"{path}: no row names the {layout.columns} columns ({last}); name them in the profile, "
            f'text.names = ["Time [s]", ...]'
        )
    unused = [line for line, row in zip(header, rows, strict=True) if row not in (names, units)]
    if units is None:
        return names, unused
    pairs = zip(names, units, strict=True)
    return [f"{name} [{unit}]" if known_unit(unit) else name for name, unit in pairs], unused


def _refuse_damaged_start(
    header: list[str],
    rows: list[list[str]],
    named: tuple[list[str] | None, list[str] | None],
    layout: Layout,
    path: Path,
) -> None:
    """Refuse rows that stand where the samples begin and are none: left out, the record would start later."""
    last = max((i for i, row in enumerate(rows) if row in named and row), default=-1)
    damaged = [i for i in range(last + 1, len(rows)) if _was_a_row(header[i], rows[i], layout, last >= 0)]
    if damaged:
        raise RecordError(
            f"{path}, line {damaged[0] + 1} is damaged ({header[damaged[0]][:60]!r}; {len(damaged)} such "
            "lines before the first intact row); repair the line or export again"
        )


def _was_a_row(line: str, fields: list[str], layout: Layout, below_names: bool) -> bool:
    """Whether a line that is no row begins like one: no comment, no word in front, numbers among the rest."""
    if not line.strip() or line.lstrip()[0] in "#%!*" or re.match(r'\s*"?[^\W\d_]{2}', line):
        return False
    numbers = sum(is_number(field, layout.decimal) for field in fields)
    whole = 2 * abs(len(fields) - layout.columns) <= layout.columns
    return numbers > 0 and (below_names or whole)


def _intact_rows(
    lines: list[str], complete: bool, layout: Layout, path: Path
) -> tuple[list[list[str]], list[str], list[str]]:
    """Take the data rows, refuse a wrong column count, leave out a last row that was cut."""
    body = [fields_of(line, layout.separator) for line in lines[layout.first :]]
    wrong = [i for i, row in enumerate(body) if len(row) != layout.columns]
    if wrong and wrong != [len(body) - 1]:
        line = layout.first + wrong[0] + 1
        raise RecordError(
            f"{path}, line {line}: {len(body[wrong[0]])} columns where {layout.columns} are expected "
            f"({lines[line - 1][:60]!r}; {len(wrong)} such lines); repair the line or export again"
        )
    last = layout.first + len(body)
    if wrong:
        words = (
            f"the file ends within line {last}, after {len(body[-1])} of {layout.columns} columns: the file "
            f"is truncated, {len(body) - 1} complete rows are used"
        )
        return body[:-1], [], [words]
    if complete or len(body) < 3:
        return body, [], []
    same = {_decimals(row[-1], layout.decimal) for row in body[-50:-1]}
    if same == {_decimals(body[-1][-1], layout.decimal)}:
        return body, [], []  # a recorder that writes no last line end
    words = f"the last line ({last}) has no line end and may be truncated: it is left out, "
    words += f"{len(body) - 1} complete rows are used"
    return (body[:-1], [], [words]) if len(same) == 1 else (body[:-1], [words], [])


def _decimals(field: str, decimal: str) -> int | str:
    """Digits behind the decimal sign, or the field itself where it has none."""
    return len(field.rpartition(decimal)[2]) if decimal in field else field


def _numbers(rows: list[list[str]], layout: Layout, labels: list[str], path: Path) -> dict[int, Array]:
    """Turn the columns of numbers into arrays, missing samples into NaN."""
    found: dict[int, Array] = {}
    for i, kind in enumerate(layout.kinds):
        if kind == "number":
            fields = [row[i] for row in rows]
            if _ONLY_NUMBERS.fullmatch("".join(fields)) and layout.decimal == ".":
                try:
                    found[i] = np.array(fields, dtype=np.float64)
                    continue
                except ValueError:
                    pass  # looked at one by one
            found[i] = _one_by_one(fields, i, layout, labels, path)
    return found


_ONLY_NUMBERS = re.compile(r"[0-9.eE+-]*")
"""Python reads ``1_000`` and digits of any script as numbers; no recorder writes them."""


def _one_by_one(fields: list[str], column: int, layout: Layout, labels: list[str], path: Path) -> Array:
    values = np.full(len(fields), np.nan)
    for i, field in enumerate(fields):
        if is_number(field, layout.decimal):
            values[i] = float(plain_number(field, layout.decimal))
        elif field.lower() not in BLANKS:
            raise RecordError(
                f"{path}, line {layout.first + i + 1}, column {labels[column]!r}: {field[:40]!r} is not a "
                "number; repair the line or export again"
            )
    return values


def _stamped_seconds(rows: list[list[str]], layout: Layout, path: Path) -> Array | None:
    """Seconds from the first row by the columns of dates and times, None where there is none."""
    stamped = [i for i, kind in enumerate(layout.kinds) if kind == "time"]
    if not stamped:
        return None
    seconds, nanoseconds = np.zeros((2, len(rows)), dtype=np.int64)
    dated = False
    for k, row in enumerate(rows):
        for i in stamped:
            parts = stamp_parts(row[i])
            if parts is None:
                raise RecordError(
                    f"{path}, line {layout.first + k + 1}: {row[i][:40]!r} is not a date or time; repair it"
                )
            dated = dated or parts[0] >= 10 * _DAY
            seconds[k] += parts[0]
            nanoseconds[k] += parts[1]
    if not dated:  # the time of day begins again at midnight
        seconds[1:] += _DAY * np.cumsum(np.diff(seconds) < -_DAY // 2)
    return np.asarray((seconds - seconds[0]) + 1e-9 * (nanoseconds - nanoseconds[0]), dtype=np.float64)


_DAY = 86_400


def _clock(
    table: dict[int, Array],
    columns: list[tuple[str, str, str]],
    stamped: Array | None,
    layout: Layout,
    header: Header,
    profile: Profile,
    path: Path,
) -> tuple[Array, tuple[int, ...], list[str]]:
    """Find the time of every row: a time column, or start and step, with the columns that are no channels."""
    at = _time_column(columns, table, stamped is not None, profile, path)
    if at is not None:
        unit = profile.time.unit or columns[at][2] or "s"
        notes = [] if columns[at][2] or profile.time.unit else ["time column taken in seconds"]
        return table[at] * parse_quantity(f"1 {unit}", "time"), (at,), notes
    step = parse_quantity(profile.time.step, "time") if profile.time.step else header.step
    if stamped is not None and not (step and stamped[-1] - stamped[0] < 0.5 * step * len(stamped)):
        return stamped, (), []
    if step is None or step <= 0:
        raise RecordError(
            f"{path} has no time column among {', '.join(label for _, label, _ in columns)} and no sampling "
            'interval; name it in the profile, time.channel = "..." or time.step = "50 us"'
        )
    counter = next(iter(table))
    counted = _is_counter(table[counter], columns[counter][0])
    index = table[counter] if counted else np.arange(len(table[counter]), dtype=np.float64)
    start, notes = _first_time(step, header, profile)
    return start + step * index, (counter,) if counted else (), notes


_COUNTERS = re.compile(
    r"(sample|index|idx|channel|point|punkt|scan|count|row|zeile|nr|no|n|i|#)\b", re.IGNORECASE
)


def _is_counter(values: Array, name: str) -> bool:
    """Whether a column counts the samples; where samples are missing it steps by more, and so tells it."""
    if len(values) < 2 or not np.all(values == np.round(values)):
        return False
    ones = float(np.mean(np.diff(values) == 1.0))
    return ones == 1.0 or ones > (0.5 if _COUNTERS.match(name) else 0.9)


def _time_column(
    columns: list[tuple[str, str, str]], table: dict[int, Array], stamped: bool, profile: Profile, path: Path
) -> int | None:
    if profile.time.channel is not None:
        for i, column in enumerate(columns):
            if profile.time.channel in column[:2] and i in table:
                return i
        raise RecordError(
            f"{path} has no time column {profile.time.channel!r}; its columns are "
            f"{', '.join(label for _, label, _ in columns)}"
        )
    if stamped:
        return None
    for i, (name, _, unit) in enumerate(columns):
        if i in table and _TIME_NAMES.match(name) and unit in ("", "s", "ms", "us", "min"):
            return i
    return None


def _first_time(step: float, header: Header, profile: Profile) -> tuple[float, list[str]]:
    """Time of the sample counted 0 [s]."""
    if profile.time.start is not None:
        return parse_quantity(profile.time.start, "time"), []
    if header.trigger_sample is not None:
        return -header.trigger_sample * step, []
    if header.start is not None:
        return header.start, []
    return 0.0, ["no trigger in the file: record time counts from the first sample"]
