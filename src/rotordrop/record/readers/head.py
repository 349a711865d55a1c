"""What the lines above the columns of a text say: names, units, clock, trigger and sensitivity."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile
from pathlib import Path

from rotordrop.errors import RecordError
from rotordrop.record.event_date import dated_line
from rotordrop.record.keys import Told, clock_told, kind_of
from rotordrop.record.profile import Profile
from rotordrop.record.readers.text import Layout, fields_of, is_number
from rotordrop.record.recording import TIME_NAMES, known_unit, sensitivities_in, split_unit
from rotordrop.units import parse_quantity

_LONGEST_LINE = 500
"""Characters of a line that are looked at (chosen)."""

_OF_CLOCK = 2
"""Fields of a clock that may stand beyond the columns: its start and its step."""

_VOLTAGE_OFFSET = re.compile(r"offset\s*[:=]?\s*([+-]?\d+(?:[.,]\d+)?)\s*(m?V)\b", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Head:
    """What the head says; None and empty where it does not."""

    labels: list[str]
    """Name of every column with its unit in brackets."""
    entries: dict[str, str]
    """Keys and values as written."""
    told: Told
    clocks: list[Told]
    """The clock of all channels, and that of every column."""
    count: int | None
    """Number of samples."""
    by_column: dict[str, list[str]]
    """Rows with a value for every column, by what they tell."""
    sensitivities: tuple[float, ...]
    voltage_offset: float
    """Volts per metre [V/m], and at zero displacement [V]."""


def read_head(lines: list[str], layout: Layout, profile: Profile, path: Path, *, timed: bool) -> Head:
    """Read the comment and header lines above the columns, whose first may be a clock (`timed`)."""
    if layout.separator != ";":
        lines = [re.sub(r"^\s*;", "#", line) for line in lines]
    given = profile.text.names
    if given is not None and len(given) != layout.columns:
        raise RecordError(f"{path} has {layout.columns} columns and the profile names {len(given)}")
    as_read = [fields_of(line if given else line.lstrip("#% "), layout.separator) or [""] for line in lines]
    as_read = [  # "Point Name: NDE X"
        re.split(r"\s*:\s*", row[0], maxsplit=1)
        if len(row) == 1 and kind_of(row[0].partition(":")[0]) == "names"
        else row
        for row in as_read
    ]
    keyed = [_behind_one_key(row) for row in as_read]  # a single such row may name two clocks alike
    rows = keyed if sum(row is not own for row, own in zip(keyed, as_read, strict=True)) > 1 else as_read
    names, units, used, of_list = _exampleand_units(rows, layout)
    names = list(given or names)
    # rows that stand where the samples begin and are none: left out, the record would start later
    last = max(used, default=-1)
    damaged = [i for i in range(last + 1, len(rows)) if _was_a_row(lines[i], rows[i], layout, last >= 0)]
    if damaged:
        what = f"{lines[damaged[0]][:60]!r}; {len(damaged)} such lines before the first intact row"
        words = f"line {damaged[0] + 1} is damaged ({what}); repair the line or export again"
        raise RecordError(f"{path}, {words}")
    if not given and not any(names):
        line = f"the line above the numbers reads {lines[-1][:60]!r}" if lines else "there is no header"
        timed = timed or clock_told(_entries(lines, rows, layout)).step is not None
        example = '"Time [s]", ...]' if timed else '"X1 [um]", ...], with [time] step = "50 us"'
        ask = f"name them in the profile, text.names = [{example}, or export each channel as a column"
        raise RecordError(f"{path}: no row names the {layout.columns} columns ({line}); {ask}")
    unused = [line[:_LONGEST_LINE] for i, line in enumerate(lines) if i not in used]
    entries = _entries(unused, rows, layout)
    labels = [
        f"{name} [{unit}]" if unit and not known_unit(split_unit(name)[2]) else name
        for name, unit in zip(names, units, strict=True)
    ]
    labels = _told_apart(labels, rows, used)
    wide = [(row[0], _by_column(row, layout.columns) or []) for row in rows]
    wide += of_list.items()
    return _head(labels, entries, "\n".join(unused), wide, layout)


def _behind_one_key(row: list[str]) -> list[str]:
    """Fields behind one key where it stands again before others, "Unit, um, Unit, um": it counts as blank."""
    again = len(row) > 3 and len(row[0]) > 1 and row[0] in row[1:] and {*row} != {row[0]}
    again = again and not TIME_NAMES.match(row[0]) and not known_unit(row[0])
    return [row[0], *("" if field == row[0] else field for field in row)] if again else row


def _told_apart(labels: list[str], rows: list[list[str]], used: set[int]) -> list[str]:
    """Names that stand for one column each: with the group above them, else counted.

    A group stands above its first column, as merged cells are exported. Tables of Python count columns of one
    name themselves, "X [um].1".
    """
    named = [re.sub(r"([\])])\.\d{1,3}$", r"\1", label) for label in labels]

    def several(label: str) -> bool:
        return label != "" and named.count(label) > 1 and not TIME_NAMES.match(label)

    for i in range(max(used, default=0)):
        if i in used or kind_of(rows[i][0]) or not any(map(several, named)):
            continue
        groups = [""]
        for group in [*rows[i], *[""] * len(named)][: len(named)]:
            groups.append(group or groups[-1])
        pairs = zip(groups[1:], named, strict=True)
        grouped = [f"{group} {label}" if several(label) else label or group for group, label in pairs]
        named = grouped if len(set(grouped)) > len(set(named)) else named
    for i, label in [(i, label) for i, label in enumerate(named) if several(label)][::-1]:
        named[i] = re.sub(r"( ?[\[(].*)?$", rf" {named[: i + 1].count(label)}\1", label, count=1)
    return named


def _head(
    labels: list[str], entries: dict[str, str], text: str, wide: list[tuple[str, list[str]]], layout: Layout
) -> Head:
    """What entries by their keys, rows with a value for every column, and the text as a whole say."""
    several = {key: row for key, row in wide if len(set(filter(None, row))) > 1}
    told = clock_told({key: value for key, value in entries.items() if key not in several})
    clocks = [
        clock_told({key: row[i] for key, row in several.items() if row[i]}, told.time_unit)
        for i in range(layout.columns)
    ]
    steps = [one.step for one in clocks if one.step]
    count = next((value.strip() for key, value in entries.items() if kind_of(key) == "count"), "")
    offset = _VOLTAGE_OFFSET.search(text)
    return Head(
        labels=labels,
        entries=entries,
        told=replace(told, step=min(steps)) if steps and told.step is None else told,
        clocks=clocks,
        # a whole number and nothing else: "Samples: 5 per channel" declares no length
        count=round(float(count)) if re.fullmatch(r"[1-9]\d{0,9}|\d\.\d*[eE]\+?\d{1,2}", count) else None,
        by_column={kind_of(key): row for key, row in wide},
        sensitivities=sensitivities_in(text),
        voltage_offset=parse_quantity(f"{offset[1].replace(',', '.')} {offset[2]}", "voltage")
        if offset
        else 0.0,
    )


def _exampleand_units(
    rows: list[list[str]], layout: Layout
) -> tuple[list[str], list[str], set[int], dict[str, list[str]]]:
    """Name and unit of every column, empty where none is said, the rows that say it, and what a list says.

    Names stand in the last row as wide as the table that is no row of units, or behind a key such as
    ``Label``; units in a row of their own, whose first field may be a word, or behind a key as ``VUnit``.
    A list has a line for each channel below a row of keys.
    """
    columns = layout.columns
    lists = {i: lines for i in range(len(rows)) if (lines := _listed(rows[i:]))}
    used = {k for i, lines in lists.items() for k in range(i, i + len(lines) + 1)}
    kinds = [_kind_of_row(row, layout) for row in rows]
    units = _units(rows, kinds, columns, used)
    names = [""] * columns
    free = [(i, _cut(row, columns)) for i, row in enumerate(rows) if i not in used and not kinds[i]]
    may = [[i for i, row in free if row and _may_name(row, layout, alike)] for alike in (False, True)]
    if last := [i for found in may for i in found[-1:]][:1]:
        names = _cut(rows[last[0]], columns) or names
        used.add(last[0])
    alone = columns - layout.kinds.count("blank") < 3  # one channel beside its time
    for i in sorted(used):
        if kinds[i] in ("names", "comment"):
            said = _by_column(rows[i], columns) or []
            said = said if len(set(filter(None, said))) > 1 or alone else names
            units = [unit or split_unit(name)[2] for unit, name in zip(units, names, strict=True)]
            names = [new or old for new, old in zip(said, names, strict=True)]
    names = [f"CH{name}" if name.isdigit() else name for name in names]
    told = _of_lists([(rows[i], lines) for i, lines in lists.items()], names)
    for key, said in told.items():
        if kind_of(key) == "names":
            units = [unit or split_unit(name)[2] for unit, name in zip(units, names, strict=True)]
            names = [new or old for new, old in zip(said, names, strict=True)]
        elif kind_of(key) == "units":
            units = [old or new for new, old in zip(said, units, strict=True)]
    return names, [unit.strip("[]()") for unit in units], used, told


def _kind_of_row(row: list[str], layout: Layout) -> str:
    """What a key before the values of a row tells; where the first column holds words it may be its name."""
    alone = len(row) < 2 or (len(row) == layout.columns and layout.kinds[0] == "text")
    kind = "" if alone else kind_of(row[0])
    return kind if kind != "speed" else ""


def _units(rows: list[list[str]], kinds: list[str], columns: int, used: set[int]) -> list[str]:
    """Units of the columns; adds the rows that say them, or names behind a key, to those used."""
    units = [""] * columns
    for i, (row, kind) in enumerate(zip(rows, kinds, strict=True)):
        if i in used:
            continue
        wide = _cut(row, columns)
        if kind in ("names", "comment", "units"):
            if (values := _by_column(row, columns, alone=kind == "units")) is not None:
                used.add(i)
                units = values if kind == "units" else units
        elif not kind and wide is not None and _are_units(wide):
            units = ["" if field in ("-", "1") else field for field in wide]
            used.add(i)
    return units


def _listed(rows: list[list[str]]) -> list[list[str]]:
    """Lines below a row of keys, one for each channel, which their first fields count."""
    if "names" not in map(kind_of, rows[0][1:]):
        return []
    counted = re.compile(r"\D*\d{1,3}")
    found = takewhile(lambda row: len(row) >= len(rows[0]) and counted.fullmatch(row[0]), rows[1:])
    return lines if len(lines := list(found)) > 1 else []


def _of_lists(lists: list[tuple[list[str], list[list[str]]]], names: list[str]) -> dict[str, list[str]]:
    """What lists say of the columns, by their keys; of columns without names one line says each."""
    told: dict[str, list[str]] = {}
    for keys, lines in lists:
        called = [split_unit(one)[0] for one in names] if any(names) else [line[0] for line in lines]
        at = {line[0]: line for line in lines} if len(called) == len(names) else {}
        for place, key in enumerate(keys[1:], start=1):
            told[key] = [at[name][place] if name in at else "" for name in called[: len(names)]]
    return {key: row for key, row in told.items() if len(row) == len(names)}


def _trimmed(row: list[str]) -> list[str]:
    """A row without the blank fields at its end."""
    filled = [i for i, field in enumerate(row) if field]
    return row[: filled[-1] + 1] if filled else []


def _filled(fields: list[str]) -> list[str]:
    """The fields that say something; numbers below them are those of a clock."""
    return [field for field in fields if field not in ("", "-", "1") and not is_number(field, ".")]


def _are_units(row: list[str]) -> bool:
    """Whether a row below the names gives units: most are known, none is long; its first may be a word."""
    said = _filled(row[1:])
    known = sum(known_unit(field) is not None for field in said)
    return known > 0.5 * len(said)


def _cut(row: list[str], columns: int) -> list[str] | None:
    """A row as wide as the table; what stands beyond may be blank, a comment, or of the clock."""
    if len(row) < columns:
        return None
    beyond = [field for field in row[columns:] if field and field.lower() != "comment"]
    clock = all(kind_of(field) in ("step", "start") or is_number(field, ".") for field in beyond)
    return row[:columns] if clock and len(beyond) <= _OF_CLOCK else None


def _may_name(row: list[str], layout: Layout, alike: bool = False) -> bool:
    """Whether a row can name columns: most fields filled, no numbers, one word for all only where it may."""
    one = len(row) > 2 and len(set(filter(None, row[1:]))) == 1
    settings = any(re.match(r"[\w -]+=", field) for field in row)
    if settings or sum(map(bool, row)) <= len(row) // 2 or (one and not alike):
        return False
    if TIME_NAMES.match(row[0]) and all(field.isdigit() for field in row[1:]):
        return True  # channels that have numbers for names
    return not any(is_number(field, sign) for field in row for sign in {".", layout.decimal})


def _by_column(row: list[str], columns: int, *, alone: bool = False) -> list[str] | None:
    """Values behind a key, one for every column or for all but the first; None where they are others."""
    values = row[1:] if len(row) <= columns + 1 else _trimmed(row[1:])
    if len(values) == columns:
        return values if values[-1] or columns == 1 else ["", *values[:-1]]
    if len(values) == columns - 1:
        return ["", *values]
    return ["", *values[:1] * (columns - 1)] if alone and len(_filled(values)) == 1 else None


def _was_a_row(line: str, fields: list[str], layout: Layout, below_names: bool) -> bool:
    """Whether a line that is no row begins like one: no comment, no word in front, numbers among the rest."""
    if not line.strip() or line.lstrip()[0] in "#%!*" or re.match(r'\s*"?[^\W\d_][_-]?[^\W\d_]', line):
        return False
    numbers = sum(is_number(field, layout.decimal) for field in fields)
    whole = 2 * abs(len(fields) - layout.columns) <= layout.columns
    return numbers > 0 and (below_names or whole)


def _entries(lines: list[str], rows: list[list[str]], layout: Layout) -> dict[str, str]:
    """Keys and values of all lines, and those of a clock that stand below their keys."""
    entries: dict[str, str] = {}
    for line in lines:
        _collect(line, layout.separator, entries)
    for above, below in pairwise([_trimmed(row) for row in rows]):
        same = len(above) == len(below)
        for key, value in zip(above[1:], below[1:], strict=True) if same else ():
            if kind_of(key) in ("step", "start") and is_number(value, layout.decimal):
                entries.setdefault(key, value)
    return entries


def _collect(line: str, separator: str, entries: dict[str, str]) -> None:
    """Add the entries of a line: ``key: value;key: value`` or ``key;value;unit``."""
    plain = line.strip().lstrip("#%/!* ").strip()
    if separator == ",":  # "Sample Rate: 20,000 Hz"
        plain = re.sub(r"(?<=[:=] )([1-9]\d{0,2}),(\d{3})(?= *[^\W\d_]|$)", r"\1\2", plain)
    parts = [plain] if separator == " " and line.lstrip()[:1] in "#%" else plain.split(separator)
    fields = [field.strip().strip('"').strip() for field in parts]
    pairs = [
        re.split("[:=]", field, maxsplit=1) for field in fields if re.match(r"[^:=]{2,40}[:=]\s*\S", field)
    ]
    if plain and pairs and not re.fullmatch(r"[\d:.\-T ]+", fields[0]):
        entries.update(
            (key.strip(), value.strip()) for key, value in pairs if not re.search(r"\d$", key) or kind_of(key)
        )
    said = re.fullmatch(r"([^\d:=]+?)\s+([+-]?\d.*)", plain)  # "# Speed 6600 rpm"
    if line.lstrip().startswith(("#", "%")):
        if said and kind_of(said[1]):
            entries.setdefault(said[1], said[2])
        elif plain and not pairs:
            entries.setdefault(f"comment {len(entries) + 1}", plain)
    elif len(fields) > 1 and (key := fields[0].rstrip(": ")) and ":" not in key:
        # one value for all channels, or one and the same for each
        values = [field for field in fields[1:] if field]
        entries.setdefault(key, values[0] if len(set(values)) == 1 else " ".join(fields[1:3]).strip())
    if (dated := dated_line(plain)) is not None:
        entries[dated[0]] = dated[1]
