"""Delimited text: CSV and TXT as recorders, spreadsheets and data loggers write them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, takewhile
from pathlib import Path

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.clock import FEWEST_STAMPS, TIME_UNITS, in_seconds
from rotordrop.record.keys import Told, kind_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers.head import Head, read_head
from rotordrop.record.readers.text import (
    BLANKS,
    Layout,
    fields_of,
    find_layout,
    is_number,
    is_row,
    is_span,
    plain_number,
    read_lines,
    stamp_parts,
)
from rotordrop.record.recording import (
    Recording,
    damaged,
    known_unit,
    listed,
    plain_name,
    split_unit,
    whose_time,
)
from rotordrop.record.sandbox import MOST_SERIES
from rotordrop.units import parse_quantity

_UNEVEN = 0.1
"""Share of a step by which the steps of a column without a name may differ for a time (chosen): rounding."""

_SAME_SPAN, _ENDED = 0.2, 0.9
"""Share of a record by which a second clock may begin or end elsewhere, and share of the rows before which a
column that ends has a clock of its own [1] (chosen)."""

_FEWEST_ROWS = 3
"""Rows of one width that show that the channels beyond have ended (chosen)."""

_COUNTERS = re.compile(
    r"(sample|ticks?|cycle|index|idx|number|channel|point|punkt|scan|count|row|zeile|nr|no|n|i|#)\b",
    re.IGNORECASE,
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
        words = f"{len(first)} fields with {len(beside)} times 'Record Length' are no heads of five columns"
        raise damaged(path, f", line 1: {words}")
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


def _grows_evenly(values: Array, step: float | None) -> bool:
    """Whether values (N,) grow evenly, and are no counter of samples of a known step."""
    steps = np.diff(values)
    even = len(steps) > 1 and np.min(steps) > 0.0 and np.ptp(steps) <= _UNEVEN * np.median(steps)
    return bool(even and not (step and np.all(steps == 1.0)))


def recording_of_lines(
    lines: list[str], complete: bool, origin: str, path: Path, profile: Profile, *, segments: bool = False
) -> Recording:
    """Make a recording of lines of text, whose `origin` is a word for the report.

    Tables below each other, with the head repeated, are joined where one goes on from the other or has other
    channels. Of others the first is read with a warning where they are `segments`, which a recorder writes.
    """
    layout, parts, firsts = find_layout(lines, path, profile.text), list[Recording](), list[int]()
    _refuse_commas(lines, layout, path)
    lines, layout = _padded(lines, layout, path, profile)

    def head_of(first: int) -> int:
        """Where the lines begin that stand between the rows above and the first row."""
        while first > 0 and not is_row(fields_of(lines[first - 1], layout.separator), layout):
            first -= 1
        return first

    key = next((line for line in lines[: layout.first][::-1] if re.search(r"[^\W\d_]", line)), None)
    tops = [layout.first, *(i + 1 for i in range(layout.first, len(lines)) if lines[i] == key)]
    for first, below in pairwise([*tops, len(lines) + 1]):
        end = head_of(below - 1) if below <= len(lines) else len(lines)
        if end > first:
            begin = head_of(first) if segments or first != layout.first else 0
            table, whole = lines[:end], complete or end < len(lines)
            parts.append(_of_table(table, begin, whole, replace(layout, first=first), origin, path, profile))
            firsts.append(first)
    return _joined(parts, firsts, segments, path) if len(parts) > 1 else parts[0]


def _refuse_commas(lines: list[str], layout: Layout, path: Path) -> None:
    """Refuse numbers whose decimal commas are commas between columns too, which their names do not fill."""
    above = next((fields_of(one, ",") for one in lines[: layout.first][::-1] if one.strip()), [])
    twice = len(above) > 2 and layout.columns in (2 * len(above) - 1, 2 * len(above))
    if layout.separator == "," and twice and not any(is_number(field, ".") for field in above):
        words = (
            f"has {layout.columns} fields under {len(above)} names: decimals are commas, as separators are"
        )
        ask = "export it with semicolons or tabs between columns, or decimal points"
        raise RecordError(f"{path} {words}; {ask}")


def _padded(lines: list[str], layout: Layout, path: Path, profile: Profile) -> tuple[list[str], Layout]:
    """Lines as wide as the first row, where rows end early because slower channels have ended."""

    def width(line: str) -> int:
        """Number of fields of a row of numbers and blanks; none of others."""
        fields = fields_of(line, layout.separator)
        plain = all(field.lower() in BLANKS or is_number(field, layout.decimal) for field in fields)
        return len(fields) if plain and any(fields) else 0

    first, rows = layout.first, lines[layout.first :]
    counts = {line.count(layout.separator) for line in rows[:-1]}
    if layout.separator == " " or (len(counts) == 1 and not (first and width(lines[first - 1]))):
        return lines, layout
    while first and width(lines[first - 1]) >= width(lines[first]) > 0:
        first -= 1
    widths = list(takewhile(bool, map(width, lines[first:])))
    levels = Counter(widths)
    if len(levels) < 2 or min(levels.values()) < _FEWEST_ROWS or widths != sorted(widths, reverse=True):
        return lines, layout
    signs = {"separator": layout.separator, "decimal": layout.decimal, "first_data_line": None}
    whole = find_layout(lines[first : first + levels[widths[0]]], path, profile.text.model_copy(update=signs))
    rows = [
        line + layout.separator * (widths[0] - own) for line, own in zip(lines[first:], widths, strict=False)
    ]
    return [*lines[:first], *rows, *lines[first + len(rows) :]], replace(whole, first=first)


def _joined(parts: list[Recording], firsts: Sequence[int], segments: bool, path: Path) -> Recording:
    """One recording of tables that follow each other or have other channels."""
    first, warnings = parts[0], tuple(word for part in parts for word in part.warnings)
    pieces, labels = [first], [[channel.label for channel in part.channels] for part in parts]
    if len({label for named in labels for label in named}) == sum(map(len, labels)):
        beside = tuple(channel for part in parts for channel in part.channels)
        return replace(first, channels=beside, warnings=warnings)
    longest = max((part.channels[0].time for part in parts), key=len)
    step = (longest[-1] - longest[0]) / max(len(longest) - 1, 1)
    for part, named in zip(parts[1:], labels[1:], strict=True):
        last, after = pieces[-1].channels[0].time, part.channels[0].time
        # the time of each segment may count from its own start
        shifts = (
            one
            for one in (0.0, _began(part) - _began(first))
            if abs(after[0] + one - last[-1] - step) <= 0.5 * step
        )
        shift = next(shifts, None)
        if named != labels[0] or shift is None:
            words = f"the file holds {len(parts)} segments that do not follow each other"
            if not segments:
                together = len(after) == len(last) and after[0] == last[0]
                words = f"the file holds {len(parts)} tables of one time" if together else words
                ask = "export again as one table" if together else "keep one, or export again as one table"
                raise RecordError(f"{path}: the head stands again in line {firsts[1]}: {words}; {ask}")
            ask = f"(first_data_line = {firsts[1] + 1} under [text] of a profile reads the second)"
            return replace(first, warnings=(*first.warnings, f"{words}; the first is read {ask}"))
        pieces.append(replace(part, channels=tuple(replace(c, time=c.time + shift) for c in part.channels)))
    channels = tuple(
        replace(
            channel,
            time=np.concatenate([piece.channels[i].time for piece in pieces]),
            values=np.concatenate([piece.channels[i].values for piece in pieces]),
        )
        for i, channel in enumerate(first.channels)
    )
    return replace(first, channels=channels, warnings=warnings)


def _began(part: Recording) -> float:
    """When a segment began by its date and time of day [s]; 0 where it says none."""
    date = part.metadata.get("Date", "").split(" ")[0].replace("/", "-")
    clock = re.sub(r"([.,]\d{1,9})\d*.*", r"\1", part.metadata.get("Time", "").split(" ")[0])
    seconds, nanoseconds = stamp_parts(f"{date} {clock}") or (0, 0)
    return seconds % 86_400_000 + 1e-9 * nanoseconds


def _of_table(
    lines: list[str], begin: int, complete: bool, layout: Layout, origin: str, path: Path, profile: Profile
) -> Recording:
    """The recording of one table, whose head begins at a line."""
    rows, notes, warnings = _intact_rows(lines, complete, layout, path)
    first = [plain_number(row[0], layout.decimal) for row in rows if is_number(row[0], layout.decimal)]
    timed = bool(profile.time.step) or _grows_evenly(np.array(first, dtype=np.float64), None)
    head = read_head(lines[begin : layout.first], layout, profile, path, timed=timed)
    table = _Table(rows=rows, layout=layout, head=head, profile=profile, path=path)
    clock = table.clock()
    channels, scaled = [], list[str]()
    for i in sorted(set(table.numbers) - set(clock.used)):
        (name, label, unit), time = table.columns[i], clock.of(i)
        if _COUNTERS.match(name) and np.all(np.diff(table.numbers[i]) == 1.0):
            continue
        # side by side, captures may differ in length: the shorter ends in blanks
        several, held = len(clock.times) > 1 or i in clock.own, np.isfinite(time)
        held = held & np.isfinite(table.numbers[i]) if i in clock.own else held
        there = slice(int(np.max(np.flatnonzero(held), initial=-1)) + 1 if several else None)
        name, label, values = name or f"column {i + 1}", label or f"column {i + 1}", table.numbers[i][there]
        known = np.isfinite(values)
        ends = int(np.sum(known))
        if 0 < ends < _ENDED * len(values) and known[:ends].all():
            words = f"left out, {label!r} ends in row {ends} of {len(values)}: it has a clock of its own"
            warnings.append(f"{words}, which the file does not hold; export it with its times")
            continue
        if np.array_equal(values, np.round(values)) and label not in profile.units:
            factor, offset = table.told(i, 1.0, "factor", "per count"), table.told(i, 0.0, "offset")
            if factor != 1.0:  # counts
                values, scaled = values * factor + offset, [*scaled, label]
        channels.append(profile.channel(name, unit, values, time[there], label=label, clocked=True))
    notes += [f"whole numbers, taken times the factors of the head: {listed(scaled)}"] if scaled else []
    texts = [head.labels[i].rstrip(":") or f"column {i + 1}" for i in table.texts]
    notes += [f"left out, no numbers: {', '.join(texts)}"] if texts else []
    if head.count is not None and len(rows) < head.count:
        words = f"declares {head.count} samples and {len(rows)} are present"
        warnings.append(f"the header {words}: the file is truncated")
    sign = _SIGNS.get(layout.separator, repr(layout.separator))
    decimal = "decimal comma" if layout.decimal == "," else "decimal point"
    return Recording(
        channels=tuple(channels),
        metadata={k: v for k, v in head.entries.items() if not profile.time.step or kind_of(k) != "rate"},
        notes=(f"{origin}, {sign} between {layout.columns} columns, {decimal}", *notes, *clock.notes),
        warnings=tuple(warnings),
        sensitivities=head.sensitivities,
        voltage_offset=head.voltage_offset,
    )


def _intact_rows(
    lines: list[str], complete: bool, layout: Layout, path: Path
) -> tuple[list[list[str]], list[str], list[str]]:
    """Take the data rows, refuse a wrong column count, leave out a last row that was cut; notes, warnings."""
    body = [fields_of(line, layout.separator) for line in lines[layout.first :]]
    wrong = [i for i, row in enumerate(body) if len(row) != layout.columns]
    rows = len(body) - next((k for k, row in enumerate(reversed(body)) if is_row(row, layout)), len(body))
    below = next((row for row in body[rows:] if any(row)), [])
    spoken = re.match(r"[*#%! ]*[^\W\d_]{2}", " ".join(below)) and layout.kinds[0] != "text"
    spoken = spoken or not any(is_number(field, layout.decimal) for field in below)
    apart = below and (any(body[rows]) or below[0].startswith("*") or len(body) > rows + 3)
    if rows and apart and complete and spoken:
        words = f"left out, from line {layout.first + rows + 1} on, below the rows: {' '.join(below)[:40]!r}"
        return body[:rows], [words], []
    last = layout.first + len(body)
    if wrong and wrong != [len(body) - 1]:
        at = layout.first + wrong[0]
        words = f"line {at + 1}: {len(body[wrong[0]])} columns where {layout.columns} are expected"
        ask = f"({lines[at][:60]!r}; {len(wrong)} such lines); repair the line or export again as one table"
        raise RecordError(f"{path}, {words} {ask}")
    if wrong:
        words = f"the file ends within line {last}, after {len(body[-1])} of {layout.columns} columns"
        return body[:-1], [], [f"{words}: the file is truncated, {len(body) - 1} complete rows are used"]
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


@dataclass(frozen=True, kw_only=True)
class _Clock:
    """The times of the rows."""

    times: Mapping[int, Array]
    """Times [s] by the column from which on they hold, shape (N,)."""
    own: Mapping[int, Array] = field(default_factory=dict)
    """Those of single columns."""
    used: Sequence[int] = ()
    """Columns that are no channels."""
    notes: tuple[str, ...] = ()

    def of(self, column: int) -> Array:
        """Times of a column [s], shape (N,)."""
        return self.own.get(column, self.times[max((k for k in self.times if k <= column), default=0)])


@dataclass(frozen=True, kw_only=True)
class _Table:
    """Rows of fields, and what is known of their columns."""

    rows: list[list[str]]
    layout: Layout
    head: Head
    profile: Profile
    path: Path

    def of_kind(self, kind: str) -> list[int]:
        """Columns that hold such things."""
        return [i for i, own in enumerate(self.layout.kinds) if own == kind]

    def told(self, column: int, none: float, *kinds: str) -> float:
        """A number that the head gives for a column."""
        fields = [row[column] for kind in kinds if (row := self.head.by_column.get(kind))]
        number = fields and is_number(fields[0], self.layout.decimal)
        return float(plain_number(fields[0], self.layout.decimal)) if number else none

    @cached_property
    def columns(self) -> list[tuple[str, str, str]]:
        """Name, label and unit of each."""
        return [split_unit(label) for label in self.head.labels]

    @cached_property
    def numbers(self) -> dict[int, Array]:
        """Columns of numbers, missing samples as NaN."""
        rare = [i for i in self.of_kind("blank") if any(row[i] for row in self.rows) and i not in self.texts]
        return {i: self._numbers(i) for i in sorted((*self.of_kind("number"), *rare))}

    @cached_property
    def texts(self) -> list[int]:
        """Columns that hold words, be it in a few rows."""
        decimal, rare = self.layout.decimal, self.of_kind("blank")
        said = {i: (row[i] for row in self.rows if row[i].lower() not in BLANKS) for i in rare}
        spoken = [i for i, fields in said.items() if not all(is_number(field, decimal) for field in fields)]
        return sorted([*self.of_kind("text"), *spoken])

    def _numbers(self, column: int) -> Array:
        fields, decimal = [row[column] for row in self.rows], self.layout.decimal
        if _ONLY_NUMBERS[decimal].fullmatch("".join(fields)):
            try:
                return np.array("\n".join(fields).replace(",", ".").split("\n"), dtype=np.float64)
            except ValueError:
                pass  # looked at one by one
        values = np.full(len(fields), np.nan)
        for i, text in enumerate(fields):
            if is_number(text, decimal):
                values[i] = float(plain_number(text, decimal))
            elif text.lower() not in BLANKS:
                at = f"line {self.layout.first + i + 1}, column {self.head.labels[column]!r}"
                words = f"{text[:40]!r} is not a number; repair the line or export again"
                raise RecordError(f"{self.path}, {at}: {words}")
        return values

    def _stamped(self) -> Array | None:
        """Seconds from the first row by the columns of dates and times, None where there is none."""
        stamped = self.of_kind("time")
        if not stamped:
            return None
        spans = all(is_span(self.rows[0][i]) for i in stamped)
        if not spans:
            self.head.entries.setdefault("start", " ".join(self.rows[0][i] for i in stamped))
        seconds, nanoseconds = np.zeros((2, len(self.rows)), dtype=np.int64)
        for i in self.parts_of_second:
            factor = 1e9 * TIME_UNITS[known_unit(self.columns[i][0]) or "s"]
            nanoseconds += np.rint(np.nan_to_num(self.numbers[i]) * factor).astype(np.int64)
        dated = False
        for k, row in enumerate(self.rows):
            for i in stamped:
                parts = stamp_parts(row[i])
                if parts is None:
                    line = self.layout.first + k + 1
                    raise damaged(self.path, f", line {line}: {row[i][:40]!r} is not a date or time")
                dated = dated or parts[0] >= 10 * _DAY
                seconds[k] += parts[0]
                nanoseconds[k] += parts[1]
        if spans:
            return np.asarray(seconds + 1e-9 * nanoseconds, dtype=np.float64)
        if not dated:  # the time of day begins again at midnight
            seconds[1:] += _DAY * np.cumsum(np.diff(seconds) < -_DAY // 2)
        return np.asarray((seconds - seconds[0]) + 1e-9 * (nanoseconds - nanoseconds[0]), dtype=np.float64)

    @cached_property
    def parts_of_second(self) -> list[int]:
        """The column behind that of stamps that goes on with them, called "ms", "us" or "ns"."""
        behind = [i + 1 for i in self.of_kind("time")[-1:] if i + 1 in self.numbers]
        return [i for i in behind if known_unit(self.columns[i][0]) in ("ms", "us", "ns")]

    def clock(self) -> _Clock:
        """The clock of the rows: by hand, by columns of time or of dates, or even by what the head says."""
        by_hand, stamped = self.profile.time.step, self._stamped()
        step = parse_quantity(by_hand, "time") if by_hand else self.head.told.step
        still = stamped is not None and not np.ptp(stamped) > 0.0
        stamped = None if still else stamped  # the date of a column of its own is no clock
        at = self._time_columns(stamped is not None, step)
        found = self._by_columns(at) if at else None
        if found is not None and not by_hand:
            return self._of_wide_table(self._with_unused(found))
        # stamps of whole seconds say less than a sampling interval
        coarse = stamped is not None and step and stamped[-1] - stamped[0] < 0.5 * step * len(stamped)
        coarse = coarse or (step and stamped is not None and len(np.unique(stamped)) < FEWEST_STAMPS)
        if stamped is not None and not coarse and not by_hand:
            return self._of_wide_table(_Clock(times={0: stamped}, used=self.parts_of_second))
        # a column of a lower rate ends early
        slow = [i for i, one in enumerate(self.head.clocks) if step and one.step and one.step > step]
        full = [i for i in slow if i in self.numbers and np.isfinite(self.numbers[i][-1])]
        if step is None or step <= 0 or (full and not by_hand):
            why = " (its stamps stand still, they are coarser than the samples)" if still else ""
            have = f"no time column among {listed(one[1] for one in self.columns)}{why}"
            ask = 'name it in the profile, time.channel = "..." or time.step = "50 us"'
            raise RecordError(f"{self.path} has {have} and no sampling interval; {ask}")
        return self._counted(step, () if found is None else found.used, found)

    def _counted(self, step: float, used: Sequence[int], found: _Clock | None) -> _Clock:
        """An even clock of a step [s], or one by a counter where samples are missing."""
        told, by_hand = self.head.told, self.profile.time.start
        counter = next((i for i in self.numbers if i not in used), next(iter(self.numbers)))
        values = self.numbers[counter]
        even = np.arange(len(values), dtype=np.float64)
        index, counters, of_trigger = even, [], False
        whole = len(values) > 1 and bool(np.all(values == np.round(values)))
        ones = float(np.mean(np.diff(values) == 1.0)) if whole else 0.0
        # where samples are missing a counter steps by more, and so tells it
        if ones == 1.0 or ones > (0.5 if _COUNTERS.match(self.columns[counter][0]) else 0.9):
            of_trigger = by_hand is None and bool(values[0] < 0.0 <= values[-1])
            index = values - (0.0 if of_trigger or told.sample is not None else values[0])
            turn = float(np.max(values)) + 1.0  # of 8, 16 or 32 bits
            index = np.unwrap(index, period=turn) if turn in (2.0**8, 2.0**16, 2.0**32) else index
            # beside every channel may stand its counter, which has no name
            alike = [i for i, own in self.numbers.items() if np.array_equal(own, values)]
            counters = [counter, *(i for i in alike if not self.columns[i][0] and i != counter)]
        offered = (
            parse_quantity(by_hand, "time") if by_hand else None,
            0.0 if of_trigger else None,
            told.begin(len(values), step),
            None if found is None else float(found.times[0][0]),
        )
        start = next((one for one in offered if one is not None), None)
        notes = ("no trigger in the file: record time counts from the first sample",) if start is None else ()
        own = dict[int, Array]()
        for i, one in enumerate(self.head.clocks) if not self.profile.time.step else ():
            own_step = one.step or step
            begun = one.begin(len(values), own_step)
            if own_step != step or begun not in (None, start):
                own[i] = (start or 0.0 if begun is None else begun) + own_step * even
        return _Clock(
            times={0: (start or 0.0) + step * index},
            own=own,
            used=(*used, *counters),
            notes=(*notes, *self._unused(told)),
        )

    def _unused(self, told: Told) -> list[str]:
        return [f"not used, the head of the file has: {listed(told.unused)}"] if told.unused else []

    def _with_unused(self, clock: _Clock) -> _Clock:
        """The clock of a column of times, with a note on what the head says otherwise."""
        told, first = self.head.told, clock.of(0)
        begun = told.begin(len(first), told.step or 0.0)
        other = begun is not None and told.step and abs(begun - first[0]) > told.step
        words = (
            [f"the head has the first sample at {begun:.6g} s, its column of times is used"] if other else []
        )
        return replace(clock, notes=(*clock.notes, *self._unused(told), *words))

    def _by_columns(self, at: Sequence[int]) -> _Clock:
        """Times by columns: one for all, or one for each channel by its name or its place before it."""
        step, first = self.head.told.step, self.numbers[at[0]]
        usual = float(np.median(np.diff(first[np.isfinite(first)]))) if step and len(first) > 1 else 0.0
        told = [unit for unit, s in TIME_UNITS.items() if step and abs(usual * s / step - 1.0) < _UNEVEN]
        units = [known_unit(self.columns[i][2] or self.head.told.time_unit) or "" for i in at]
        units = [self.profile.time.unit or unit or units[0] or "".join(told) for unit in units]
        # dates in numbers lose digits when they become floating-point numbers
        decimal = self.layout.decimal
        stamps = [
            [plain_number(row[i], decimal) if is_number(row[i], decimal) else "" for row in self.rows]
            if abs(self.numbers[i][0]) > 1e4
            else self.numbers[i]
            for i in at
        ]
        times = dict(zip(at, in_seconds(stamps, units), strict=True))
        bare = not all(units) and isinstance(stamps[0], np.ndarray)
        notes = ["time column taken in seconds"] if bare else []
        names = {plain_name(self.columns[i][0]): i for i in self.numbers if i not in at}
        whose = {i: plain_name(self._whose_time(i) or "") for i in at}
        own = {names[plain]: times[i] for i, plain in whose.items() if plain in names}
        rest = [i for i in at if whose[i] not in names] or list(at)
        # each holds for the channels to its right; of clocks side by side the first does
        last = max((i for i in self.numbers if i not in at and i not in own), default=0)
        spare = [i for i in rest[1:] if i > last or i - 1 in rest]
        notes += [f"left out, other times: {listed(self.columns[i][1] for i in spare)}"] if spare else []
        return _Clock(
            times={0: times[rest[0]], **{i: times[i] for i in rest if i not in spare}},
            own=own,
            used=at,
            notes=tuple(notes),
        )

    def _time_columns(self, stamped: bool, step: float | None) -> list[int]:
        """The columns of times: the one that the profile names, else by name, unit or even steps."""
        wanted, columns = self.profile.time.channel, self.columns
        if wanted is not None:
            at = [i for i in self.numbers if wanted in columns[i][:2]][:1]
            if not at:
                have = listed(label for _, label, _ in columns)
                raise RecordError(f"{self.path} has no time column {wanted!r}; its columns are {have}")
            return at
        if stamped:
            return []
        timed = [i for i in self.numbers if columns[i][2] in ("", *TIME_UNITS)]
        known = {i: own[np.isfinite(own)] for i in timed if np.isfinite(own := self.numbers[i]).any()}
        in_s = [i for i in known if columns[i][2] in ("s", "ms", "us", "ns")]
        grow = [i for i in in_s if np.all(np.diff(known[i]) > 0.0)]
        found = [i for i in timed if self._whose_time(i) is not None or i in grow] or in_s[:1]
        # a scope that names its channels only: the first column has no name and grows evenly
        even = [i for i, own in known.items() if _grows_evenly(own, step)]
        found = found or [i for i in even[:1] if i == next(iter(self.numbers)) and not columns[i][0]]
        even = [
            i for i, own in known.items() if i in even or (not columns[i][0] and _grows_evenly(own, None))
        ]
        for i in even if found and found[0] in known else ():
            # what grows evenly over the time of the first is a clock too, whatever its name
            first, own = known[found[0]][[0, -1]], known[i][[0, -1]]
            found += [i] if np.all(np.abs(own - first) < _SAME_SPAN * np.ptp(first)) else []
        return sorted(set(found))

    def _whose_time(self, column: int) -> str | None:
        return whose_time(self.columns[column][0], [name for name, *_ in self.columns])

    def _of_wide_table(self, clock: _Clock) -> _Clock:
        """The clock, unless the rows of one instant name a channel each."""
        for i in [] if np.all(np.diff(clock.of(0)) > 0.0) else self.of_kind("text"):
            counts = {word: n for word, n in Counter(row[i] for row in self.rows).items() if n > 1}
            if 1 < len(counts) <= MOST_SERIES and len(set(counts.values())) == 1:
                words = f"its column {self.head.labels[i]!r} names {len(counts)} channels ({listed(counts)})"
                raise RecordError(f"{self.path} has one value a row: {words}; export a column for each")
        return clock
