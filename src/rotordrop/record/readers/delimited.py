"""Delimited text: CSV and TXT as recorders, spreadsheets and data loggers write them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.readers.text import (
    BLANKS,
    Header,
    Layout,
    fields_of,
    find_layout,
    is_number,
    name_and_unit_rows,
    plain_number,
    read_header,
    read_lines,
    stamp_parts,
)
from rotordrop.record.recording import Array, Channel, Recording, known_unit, spelled, split_unit
from rotordrop.units import parse_quantity

_LONGEST_HEADER_LINE = 500
"""Characters of a header line that are looked at (chosen)."""

_TIME_NAMES = re.compile(r"(time|zeit|t|temps|tempo|tiempo|timestamp|x_value)\b", re.IGNORECASE)
_COUNTERS = re.compile(
    r"(sample|index|idx|channel|point|punkt|scan|count|row|zeile|nr|no|n|i|#)\b", re.IGNORECASE
)
_ONLY_NUMBERS = re.compile(r"[0-9.eE+-]*")
"""Python reads ``1_000`` and digits of any script as numbers; no recorder writes them."""

_SIGNS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "blank"}
_DAY = 86_400


def read_delimited(path: Path, profile: Profile) -> Recording:
    """Read a text file of columns, whatever its separator, decimal sign, header and time column."""
    lines, complete, encoding = read_lines(path, profile.text)
    return recording_of_lines(lines, complete, f"text in {encoding}", path, profile)


def recording_of_lines(
    lines: list[str], complete: bool, origin: str, path: Path, profile: Profile
) -> Recording:
    """Make a recording of lines of text, whose `origin` is a word for the report."""
    layout = find_layout(lines, path, profile.text)
    labels, unused = _column_labels(lines[: layout.first], layout, profile, path)
    header = read_header([line[:_LONGEST_HEADER_LINE] for line in unused], layout.separator)
    rows, notes, warnings = _intact_rows(lines, complete, layout, path)
    columns = [split_unit(label) for label in labels]
    table = {
        i: _numbers([row[i] for row in rows], label, layout, path)
        for i, (label, kind) in enumerate(zip(labels, layout.kinds, strict=True))
        if kind == "number"
    }
    stamped = _stamped_seconds(rows, layout, path)
    time, used, words = _clock(table, columns, stamped, header, profile, path)
    channels = tuple(
        Channel(
            name=name, label=label, unit=spelled(profile.units.get(label, unit)), values=table[i], time=time
        )
        for i, (name, label, unit) in enumerate(columns)
        if i in table and i != used
    )
    texts = [label for label, kind in zip(labels, layout.kinds, strict=True) if kind == "text"]
    notes += [f"left out, no numbers: {', '.join(texts)}"] if texts else []
    if header.count is not None and len(rows) < header.count:
        warnings.append(
            f"the header declares {header.count} samples and {len(rows)} are present: the file is truncated"
        )
    sign = _SIGNS.get(layout.separator, repr(layout.separator))
    decimal = "decimal comma" if layout.decimal == "," else "decimal point"
    return Recording(
        channels=channels,
        metadata=header.entries,
        notes=(f"{origin}, {sign} between {layout.columns} columns, {decimal}", *notes, *words),
        warnings=tuple(warnings),
        sensitivity=header.sensitivity,
        voltage_offset=header.voltage_offset,
    )


def _column_labels(
    header: list[str], layout: Layout, profile: Profile, path: Path
) -> tuple[list[str], list[str]]:
    """Name the columns, with the unit of a units row in brackets; give the other header lines too."""
    given = profile.text.names
    if given is not None and len(given) != layout.columns:
        raise RecordError(f"{path} has {layout.columns} columns and the profile names {len(given)}")
    rows = [fields_of(line if given else line.lstrip("# "), layout.separator) for line in header]
    names, units = (None, None) if given else name_and_unit_rows(rows, layout.columns)
    # rows that stand where the samples begin and are none: left out, the record would start later
    last = max((i for i, row in enumerate(rows) if row in (names, units) and row), default=-1)
    damaged = [i for i in range(last + 1, len(rows)) if _was_a_row(header[i], rows[i], layout, last >= 0)]
    if damaged:
        raise RecordError(
            f"{path}, line {damaged[0] + 1} is damaged ({header[damaged[0]][:60]!r}; {len(damaged)} such "
            "lines before the first intact row); repair the line or export again"
        )
    if given:
        return list(given), header
    if names is None:
        line = f"the line above the numbers reads {header[-1][:60]!r}" if header else "there is no header"
        raise RecordError(
            f"{path}: no row names the {layout.columns} columns ({line}); name them in the profile, "
            f'text.names = ["Time [s]", ...]'
        )
    unused = [line for line, row in zip(header, rows, strict=True) if row not in (names, units)]
    pairs = zip(names, units or names, strict=True)
    return [f"{name} [{unit}]" if units and known_unit(unit) else name for name, unit in pairs], unused


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
    """Take the data rows, refuse a wrong column count, leave out a last row that was cut; notes, warnings."""
    body = [fields_of(line, layout.separator) for line in lines[layout.first :]]
    wrong = [i for i, row in enumerate(body) if len(row) != layout.columns]
    last = layout.first + len(body)
    if wrong and wrong != [len(body) - 1]:
        line = layout.first + wrong[0] + 1
        raise RecordError(
            f"{path}, line {line}: {len(body[wrong[0]])} columns where {layout.columns} are expected "
            f"({lines[line - 1][:60]!r}; {len(wrong)} such lines); repair the line or export again"
        )
    if wrong:
        words = (
            f"the file ends within line {last}, after {len(body[-1])} of {layout.columns} columns: the file "
            f"is truncated, {len(body) - 1} complete rows are used"
        )
        return body[:-1], [], [words]
    if complete or len(body) < 3:
        return body, [], []

    def decimals(field: str) -> int | str:
        """Digits behind the decimal sign, or the field itself where it has none."""
        return len(field.rpartition(layout.decimal)[2]) if layout.decimal in field else field

    same = {decimals(row[-1]) for row in body[-50:-1]}
    if same == {decimals(body[-1][-1])}:
        return body, [], []  # a recorder that writes no last line end
    words = f"the last line ({last}) has no line end and may be truncated: it is left out, "
    words += f"{len(body) - 1} complete rows are used"
    # only where all rows end alike does another end mean a cut; else it is worth a note, no warning
    return (body[:-1], [], [words]) if len(same) == 1 else (body[:-1], [words], [])


def _numbers(fields: list[str], label: str, layout: Layout, path: Path) -> Array:
    """The fields of a column as numbers, missing samples as NaN."""
    if layout.decimal == "." and _ONLY_NUMBERS.fullmatch("".join(fields)):
        try:
            return np.array(fields, dtype=np.float64)
        except ValueError:
            pass  # looked at one by one
    values = np.full(len(fields), np.nan)
    for i, field in enumerate(fields):
        if is_number(field, layout.decimal):
            values[i] = float(plain_number(field, layout.decimal))
        elif field.lower() not in BLANKS:
            raise RecordError(
                f"{path}, line {layout.first + i + 1}, column {label!r}: {field[:40]!r} is not a number; "
                "repair the line or export again"
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


def _clock(
    table: dict[int, Array],
    columns: list[tuple[str, str, str]],
    stamped: Array | None,
    header: Header,
    profile: Profile,
    path: Path,
) -> tuple[Array, int | None, list[str]]:
    """The time of every row [s] by a time column, or start and step; the column it took, and notes."""
    at = _time_column(columns, table, stamped is not None, profile, path)
    if at is not None:
        unit = profile.time.unit or columns[at][2]
        notes = [] if unit else ["time column taken in seconds"]
        return table[at] * parse_quantity(f"1 {unit or 's'}", "time"), at, notes
    step = parse_quantity(profile.time.step, "time") if profile.time.step else header.step
    # stamps of whole seconds say less than a sampling interval
    if stamped is not None and not (step and stamped[-1] - stamped[0] < 0.5 * step * len(stamped)):
        return stamped, None, []
    if step is None or step <= 0:
        raise RecordError(
            f"{path} has no time column among {', '.join(label for _, label, _ in columns)} and no sampling "
            'interval; name it in the profile, time.channel = "..." or time.step = "50 us"'
        )
    start, notes = 0.0, []
    if profile.time.start is not None:
        start = parse_quantity(profile.time.start, "time")
    elif header.trigger_sample is not None:
        start = -header.trigger_sample * step
    elif header.start is not None:
        start = header.start
    else:
        notes = ["no trigger in the file: record time counts from the first sample"]
    counter = next(iter(table))
    if _is_counter(table[counter], columns[counter][0]):
        return start + step * table[counter], counter, notes
    return start + step * np.arange(len(table[counter]), dtype=np.float64), None, notes


def _is_counter(values: Array, name: str) -> bool:
    """Whether a column counts the samples; where samples are missing it steps by more, and so tells it."""
    if len(values) < 2 or not np.all(values == np.round(values)):
        return False
    ones = float(np.mean(np.diff(values) == 1.0))
    return ones == 1.0 or ones > (0.5 if _COUNTERS.match(name) else 0.9)


def _time_column(
    columns: list[tuple[str, str, str]], table: dict[int, Array], stamped: bool, profile: Profile, path: Path
) -> int | None:
    """The column of the time: the one that the profile names, else by its name where no stamps are."""
    wanted = profile.time.channel
    for i, (name, label, unit) in enumerate(columns):
        if wanted is None and not stamped:
            fits = bool(_TIME_NAMES.match(name)) and unit in ("", "s", "ms", "us", "min")
        else:
            fits = wanted in (name, label)
        if fits and i in table:
            return i
    if wanted is not None:
        labels = ", ".join(label for _, label, _ in columns)
        raise RecordError(f"{path} has no time column {wanted!r}; its columns are {labels}")
    return None
