"""Delimited text: CSV and TXT as recorders, spreadsheets and data loggers write them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.measurement.profile import Profile
from rotordrop.measurement.readers._text_header import Header, read_header
from rotordrop.measurement.readers._text_layout import (
    BLANKS,
    Layout,
    fields_of,
    find_layout,
    is_timestamp,
    name_and_unit_rows,
    read_lines,
)
from rotordrop.measurement.recording import Array, Channel, Recording, known_unit, split_unit
from rotordrop.units import parse_quantity

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
    layout = find_layout(lines, path, profile.text)
    header_lines = lines[: layout.first]
    labels, unused = _column_labels(header_lines, layout, profile, path)
    header = read_header(unused, layout.separator)
    body, warnings = _intact_rows(lines, complete, layout, path)
    table, absolute = _numbers(body, layout, labels, path)
    columns = [split_unit(label) for label in labels]
    time, used, notes = _clock(table, columns, absolute, header, profile, path)
    channels = tuple(
        Channel(name=name, label=label, unit=profile.units.get(label, unit), values=table[:, i], time=time)
        for i, (name, label, unit) in enumerate(columns)
        if i != used
    )
    return Recording(
        channels=channels,
        metadata=header.entries,
        notes=(f"text in {encoding}, {_spoken(layout)}", *notes),
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
        return list(profile.text.names), header
    rows = [fields_of(line.lstrip("# "), layout.separator) for line in header]
    names, units = name_and_unit_rows(rows, layout.columns)
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


def _intact_rows(lines: list[str], complete: bool, layout: Layout, path: Path) -> tuple[list[str], list[str]]:
    """Take the data lines, refuse a wrong column count, leave out a last line that was cut."""
    body = lines[layout.first :]
    warnings: list[str] = []
    wrong = [i for i, line in enumerate(body) if _count(line, layout) != layout.columns]
    if wrong and wrong != [len(body) - 1]:
        line = layout.first + wrong[0] + 1
        raise RecordError(
            f"{path}, line {line}: {_count(body[wrong[0]], layout)} columns where {layout.columns} are "
            "expected "
            f"({body[wrong[0]][:60]!r}; {len(wrong)} such lines); repair the line or export again"
        )
    if wrong:
        warnings.append(
            f"the file ends within line {layout.first + len(body)}, after {_count(body[-1], layout)} of "
            f"{layout.columns} columns: the file is truncated, {len(body) - 1} complete rows are used"
        )
        body = body[:-1]
    elif not complete and len(body) > 1:
        warnings.append(
            f"the last line ({layout.first + len(body)}) has no line end and may be truncated: it is left "
            "out, "
            f"{len(body) - 1} complete rows are used"
        )
        body = body[:-1]
    return body, warnings


def _count(line: str, layout: Layout) -> int:
    return len(line.split()) if layout.separator == " " else line.count(layout.separator) + 1


def _numbers(body: list[str], layout: Layout, labels: list[str], path: Path) -> tuple[Array, bool]:
    """Turn the rows into numbers; a date in the first column becomes seconds from the first row."""
    absolute = is_timestamp(fields_of(body[0], layout.separator)[0])
    tokens = layout.separator.join(body)
    if layout.decimal == ",":
        tokens = tokens.replace(",", ".")
    flat = tokens.replace('"', "").split(None if layout.separator == " " else layout.separator)
    if absolute:
        seconds = _seconds(flat[:: layout.columns], layout, path)
        flat[:: layout.columns] = ["0"] * len(body)
    try:
        table = np.array(flat, dtype=np.float64).reshape(len(body), layout.columns)
    except ValueError:
        table = _with_missing(flat, layout, labels, path).reshape(len(body), layout.columns)
    if absolute:
        table[:, 0] = seconds
    return table, absolute


def _seconds(stamps: list[str], layout: Layout, path: Path) -> Array:
    texts = [stamp.strip().removesuffix("Z").replace(" ", "T") for stamp in stamps]
    try:
        instants = np.array(texts, dtype="datetime64[ns]")
    except ValueError as error:
        wrong = next((i for i, text in enumerate(texts) if not is_timestamp(text)), 0)
        raise RecordError(
            f"{path}, line {layout.first + wrong + 1}: {stamps[wrong]!r} is not a date and time"
        ) from error
    return np.asarray((instants - instants[0]) / np.timedelta64(1, "s"), dtype=np.float64)


def _with_missing(flat: list[str], layout: Layout, labels: list[str], path: Path) -> Array:
    """Convert number by number, missing samples to NaN; refuse the first thing that is no number."""
    values = np.empty(len(flat))
    for i, token in enumerate(flat):
        try:
            values[i] = float(token)
        except ValueError:
            if token.strip().lower() not in BLANKS:
                row, column = divmod(i, layout.columns)
                raise RecordError(
                    f"{path}, line {layout.first + row + 1}, column {labels[column]!r}: {token.strip()!r} is "
                    "not a number; repair the line or export again"
                ) from None
            values[i] = np.nan
    return values


def _clock(
    table: Array,
    columns: list[tuple[str, str, str]],
    absolute: bool,
    header: Header,
    profile: Profile,
    path: Path,
) -> tuple[Array, int | None, list[str]]:
    """Find the time of every row: a time column, or start and step, with the column that is no channel."""
    at = _time_column(columns, absolute, profile, path)
    if at is not None:
        unit = "s" if absolute else profile.time.unit or columns[at][2] or "s"
        seconds = table[:, at] * parse_quantity(f"1 {unit}", "time")
        notes = [] if absolute or columns[at][2] or profile.time.unit else ["time column taken in seconds"]
        return seconds, at, notes
    step = parse_quantity(profile.time.step, "time") if profile.time.step else header.step
    if step is None or step <= 0:
        raise RecordError(
            f"{path} has no time column among {', '.join(label for _, label, _ in columns)} and no sampling "
            'interval; name it in the profile, time.channel = "..." or time.step = "50 us"'
        )
    counted = len(table) > 1 and bool(np.all(np.diff(table[:, 0]) == 1.0))
    index = table[:, 0] if counted else np.arange(len(table), dtype=np.float64)
    start, notes = _first_time(step, header, profile)
    return start + step * index, 0 if counted else None, notes


def _time_column(
    columns: list[tuple[str, str, str]], absolute: bool, profile: Profile, path: Path
) -> int | None:
    if absolute:
        return 0
    if profile.time.channel is not None:
        for i, column in enumerate(columns):
            if profile.time.channel in column[:2]:
                return i
        raise RecordError(
            f"{path} has no time column {profile.time.channel!r}; its columns are "
            f"{', '.join(label for _, label, _ in columns)}"
        )
    for i, (name, _, unit) in enumerate(columns):
        if _TIME_NAMES.match(name) and unit in ("", "s", "ms", "us", "min"):
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
