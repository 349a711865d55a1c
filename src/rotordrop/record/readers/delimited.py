"""Delimited text: CSV and TXT as recorders, spreadsheets and data loggers write them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.readers.head import TIME_NAMES, Head, read_head
from rotordrop.record.readers.text import (
    BLANKS,
    Layout,
    fields_of,
    find_layout,
    is_number,
    plain_number,
    read_lines,
    stamp_parts,
)
from rotordrop.record.recording import Recording, listed, split_unit
from rotordrop.units import parse_quantity

_UNEVEN = 0.1
"""Share of a step by which the steps of a column without a name may differ for a time (chosen): rounding."""

_COUNTERS = re.compile(
    r"(sample|index|idx|channel|point|punkt|scan|count|row|zeile|nr|no|n|i|#)\b", re.IGNORECASE
)
_ONLY_NUMBERS = {".": re.compile(r"[0-9.eE+-]*"), ",": re.compile(r"[0-9,eE+-]*")}
"""By decimal sign. Python reads ``1_000`` and digits of any script as numbers; no recorder writes them."""

_SIGNS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "blank"}
_DAY = 86_400


def read_delimited(path: Path, profile: Profile) -> Recording:
    """Read a text file of columns, whatever its separator, decimal sign, header and time column."""
    lines, complete, encoding = read_lines(path, profile.text)
    lines = _without_head_beside(lines, path)
    return recording_of_lines(lines, complete, f"text in {encoding}", path, profile)


def _without_head_beside(lines: list[str], path: Path) -> list[str]:
    """Put a head that stands beside the readings above them, as oscilloscopes of Tektronix write it.

    Each channel has five columns: key, value, a third for a unit, time, reading.
    """
    first = fields_of(lines[0], ",")
    beside = [i for i, field in enumerate(first) if field == "Record Length" and len(first) > i + 4]
    if not beside or not is_number(first[beside[0] + 3], ".") or not is_number(first[beside[0] + 4], "."):
        return lines
    rows = [fields_of(line, ",") for line in lines]
    if beside != list(range(0, 5 * (len(first) // 5), 5)):
        raise RecordError(
            f"{path}, line 1: {len(first)} fields with {len(beside)} times 'Record Length' are no heads of "
            "five columns each; export it again"
        )
    labels = []
    for i in beside:
        head = {row[i]: row[i + 1] for row in rows if len(row) > i + 1 and row[i]}
        labels.append(f"Time [{head.get('Horizontal Units', 's')}]")
        labels.append(f"{head.get('Source', f'CH{i // 5 + 1}')} [{head.get('Vertical Units', '')}]")
    kept = [i + offset for i in beside for offset in (3, 4)]
    return [
        f"Record Length,{rows[0][1]}",
        ",".join(labels),
        *(",".join(row[i] for i in kept if i < len(row)) for row in rows),
    ]


def recording_of_lines(
    lines: list[str], complete: bool, origin: str, path: Path, profile: Profile
) -> Recording:
    """Make a recording of lines of text, whose `origin` is a word for the report."""
    layout = find_layout(lines, path, profile.text)
    head = read_head(lines[: layout.first], layout, profile, path)
    rows, notes, warnings = _intact_rows(lines, complete, layout, path)
    columns = [split_unit(label) for label in head.labels]
    table = {
        i: _numbers([row[i] for row in rows], label, layout, path)
        for i, (label, kind) in enumerate(zip(head.labels, layout.kinds, strict=True))
        if kind == "number" or (kind == "blank" and any(row[i] for row in rows))
    }
    stamped = _stamped_seconds(rows, layout, path)
    if stamped is not None:
        first = (field for field, kind in zip(rows[0], layout.kinds, strict=True) if kind == "time")
        head.entries.setdefault("start", " ".join(first))
    times, used, words = _clock(table, columns, stamped, head, profile, path)
    channels = []
    for i in sorted(set(table) - set(used)):
        name, label, unit = columns[i]
        time = times[max(k for k in times if k <= i)]
        # side by side, captures may differ in length: the shorter ends in blanks
        there = slice(
            int(np.max(np.flatnonzero(np.isfinite(time)), initial=-1)) + 1 if len(used) > 1 else None
        )
        unnamed = f"column {i + 1}"
        channels.append(
            profile.channel(name or unnamed, unit, table[i][there], time[there], label=label or unnamed)
        )
    texts = [label for label, kind in zip(head.labels, layout.kinds, strict=True) if kind == "text"]
    notes += [f"left out, no numbers: {', '.join(texts)}"] if texts else []
    if head.count is not None and len(rows) < head.count:
        warnings.append(
            f"the header declares {head.count} samples and {len(rows)} are present: the file is truncated"
        )
    sign = _SIGNS.get(layout.separator, repr(layout.separator))
    decimal = "decimal comma" if layout.decimal == "," else "decimal point"
    return Recording(
        channels=tuple(channels),
        metadata=head.entries,
        notes=(f"{origin}, {sign} between {layout.columns} columns, {decimal}", *notes, *words),
        warnings=tuple(warnings),
        sensitivity=head.sensitivity,
        voltage_offset=head.voltage_offset,
    )


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
    if _ONLY_NUMBERS[layout.decimal].fullmatch("".join(fields)):
        try:
            return np.array("\n".join(fields).replace(",", ".").split("\n"), dtype=np.float64)
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
    head: Head,
    profile: Profile,
    path: Path,
) -> tuple[dict[int, Array], list[int], list[str]]:
    """The time of every row [s] by the column from which on it holds, the columns it took, and notes.

    Several columns of one name give the time of the columns behind each.
    """
    step = parse_quantity(profile.time.step, "time") if profile.time.step else head.step
    if stamped is not None and not np.ptp(stamped) > 0.0:
        stamped = None  # the date of a column of its own is no clock
    at = _time_columns(columns, table, stamped is not None, step, profile, path)
    if at:
        units = [profile.time.unit or columns[i][2] or head.time_unit for i in at]
        notes = [] if all(units) else ["time column taken in seconds"]
        times = {
            i: table[i] * parse_quantity(f"1 {unit or 's'}", "time")
            for i, unit in zip(at, units, strict=True)
        }
        return {0: times[at[0]], **times}, at, notes
    # stamps of whole seconds say less than a sampling interval
    if stamped is not None and not (step and stamped[-1] - stamped[0] < 0.5 * step * len(stamped)):
        return {0: stamped}, [], []
    if step is None or step <= 0:
        raise RecordError(
            f"{path} has no time column among {listed(label for _, label, _ in columns)} and no sampling "
            'interval; name it in the profile, time.channel = "..." or time.step = "50 us"'
        )
    start, notes = 0.0, []
    if profile.time.start is not None:
        start = parse_quantity(profile.time.start, "time")
    elif head.trigger_sample is not None:
        start = -head.trigger_sample * step
    elif head.start is not None:
        start = head.start
    else:
        notes = ["no trigger in the file: record time counts from the first sample"]
    counter = next(iter(table))
    values = table[counter]
    # where samples are missing a counter steps by more, and so tells it
    if len(values) > 1 and np.all(values == np.round(values)):
        ones = float(np.mean(np.diff(values) == 1.0))
        counts = ones == 1.0 or ones > (0.5 if _COUNTERS.match(columns[counter][0]) else 0.9)
    else:
        counts = False
    if counts:
        return {0: start + step * table[counter]}, [counter], notes
    return {0: start + step * np.arange(len(table[counter]), dtype=np.float64)}, [], notes


def _time_columns(
    columns: list[tuple[str, str, str]],
    table: dict[int, Array],
    stamped: bool,
    step: float | None,
    profile: Profile,
    path: Path,
) -> list[int]:
    """The columns of the time: the one that the profile names, else by name, unit or even steps."""
    wanted = profile.time.channel
    if wanted is not None:
        for i, (name, label, _) in enumerate(columns):
            if wanted in (name, label) and i in table:
                return [i]
        labels = listed(label for _, label, _ in columns)
        raise RecordError(f"{path} has no time column {wanted!r}; its columns are {labels}")
    if stamped:
        return []
    named = [
        i for i in table if TIME_NAMES.match(columns[i][0]) and columns[i][2] in ("", "s", "ms", "us", "min")
    ] or [i for i in table if columns[i][2] in ("s", "ms", "us")]
    if named:
        return [i for i in named if columns[i][0] == columns[named[0]][0]]
    first = next(iter(table))
    # a scope that names its channels only: the first column has no name and grows evenly
    steps = np.diff(table[first])
    even = len(steps) > 1 and np.min(steps) > 0.0 and np.ptp(steps) <= _UNEVEN * np.median(steps)
    return [first] if not columns[first][0] and even and not (step and np.all(steps == 1.0)) else []
