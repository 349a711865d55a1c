"""What the lines above the columns of a text say: names, units, clock, trigger and sensitivity."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from rotordrop.errors import RecordError, UsageError
from rotordrop.record.event_date import dated_line
from rotordrop.record.profile import Profile
from rotordrop.record.readers.text import Layout, fields_of, is_number
from rotordrop.record.recording import known_unit, split_unit
from rotordrop.units import parse_quantity

TIME_NAMES = re.compile(
    r"(time|zeit|t|temps|tempo|tiempo|timestamp|x_value|x[- _]?axis([- _]value)?)\b", re.IGNORECASE
)

_LONGEST_LINE = 500
"""Characters of a line that are looked at (chosen)."""

_KEYS = {
    "step": "dt step increment sampleinterval samplinginterval samplingperiod sampleperiod abtastintervall "
    "schrittweite deltax xinc xincrement hresolution",
    "rate": "fs samplerate samplingrate samplingfrequency samplefrequency abtastrate abtastfrequenz rate",
    "trigger": "triggersample triggerindex triggerposition pretriggersamples",
    "before": "pretrigger pretriggertime vorlauf",
    "count": "samples samplecount numberofsamples numsamples nsamples points numberofpoints recordlength "
    "blocksize anzahlwerte anzahlmesswerte anzahlabtastwerte messwerte",
    "start": "t0 start starttime firstsample startoffset x0 xorg xorigin hoffset",
    "time unit": "xunit xunits xaxisunit hunit horizontalunit horizontalunits",
    "names": "label name names tracename channelname signalname pointname kanalname messstelle tag tagname "
    "bezeichnung",
    "units": "unit units einheit einheiten yunit yunits yunitlabel yaxisunit vunit verticalunit "
    "verticalunits",
}
"""Keys of lines in letters and digits only, as recorders write them in English and German."""

_OF_CLOCK = 2
"""Fields of a clock that may stand beyond the columns: its start and its step."""

_KIND = {key: kind for kind, keys in _KEYS.items() for key in keys.split()}

_SENSITIVITY = re.compile(r"(\d+(?:[.,]\d+)?)\s*(m?V)\s*/\s*([uµμm]?m|mil)\b")
_VOLTAGE_OFFSET = re.compile(r"offset\s*[:=]?\s*([+-]?\d+(?:[.,]\d+)?)\s*(m?V)\b", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Head:
    """What the head says."""

    labels: list[str]
    """Name of every column with its unit in brackets, empty where none is said."""
    entries: dict[str, str]
    """Keys and values as written."""
    step: float | None
    """Time between samples [s]."""
    start: float | None
    """Time of the first sample [s]."""
    time_unit: str
    """Unit of the time axis, empty where none is said."""
    trigger_sample: int | None
    """Sample at which the record time is zero."""
    count: int | None
    """Number of samples."""
    sensitivity: float | None
    """Volts per metre [V/m]."""
    voltage_offset: float
    """Voltage at zero displacement [V]."""


def read_head(lines: list[str], layout: Layout, profile: Profile, path: Path) -> Head:
    """Read the comment and header lines above the columns."""
    given = profile.text.names
    if given is not None and len(given) != layout.columns:
        raise RecordError(f"{path} has {layout.columns} columns and the profile names {len(given)}")
    rows = [fields_of(line if given else line.lstrip("# "), layout.separator) or [""] for line in lines]
    names, units, used = ([], [], set()) if given else _names_and_units(rows, layout)
    # rows that stand where the samples begin and are none: left out, the record would start later
    last = max(used, default=-1)
    damaged = [i for i in range(last + 1, len(rows)) if _was_a_row(lines[i], rows[i], layout, last >= 0)]
    if damaged:
        raise RecordError(
            f"{path}, line {damaged[0] + 1} is damaged ({lines[damaged[0]][:60]!r}; {len(damaged)} such "
            "lines before the first intact row); repair the line or export again"
        )
    if not given and not any(names):
        line = f"the line above the numbers reads {lines[-1][:60]!r}" if lines else "there is no header"
        raise RecordError(
            f"{path}: no row names the {layout.columns} columns ({line}); name them in the profile, "
            f'text.names = ["Time [s]", ...]'
        )
    unused = [line[:_LONGEST_LINE] for i, line in enumerate(lines) if i not in used]
    entries = _entries(unused, rows, used, layout)
    labels = [
        f"{name} [{unit}]" if unit and not known_unit(split_unit(name)[2]) else name
        for name, unit in zip(names, units, strict=True)
    ]
    return _head(list(given) if given else labels, entries, "\n".join(unused))


def _head(labels: list[str], entries: dict[str, str], text: str) -> Head:
    """What entries by their keys and the text as a whole say."""

    def found(kind: str) -> tuple[str, str]:
        """Text and unit of the first entry of a kind, empty where there is none."""
        for key, value in entries.items():
            if _kind(key) == kind:
                return value, split_unit(key)[2]
        return "", ""

    time_unit = known_unit(found("time unit")[0].partition(" ")[0]) or ""
    step, rate = _number(*found("step"), "time", time_unit or "s"), _number(*found("rate"), "frequency", "Hz")
    start, before = (_number(*found(kind), "time", time_unit or "s") for kind in ("start", "before"))
    trigger, count = re.match(r"\d{1,15}(?!\d)", found("trigger")[0]), found("count")[0].strip()
    sensitivity, offset = _SENSITIVITY.search(text), _VOLTAGE_OFFSET.search(text)
    return Head(
        labels=labels,
        entries=entries,
        step=1.0 / rate if step is None and rate else step,
        start=-abs(before) if start is None and before is not None else start,
        time_unit=time_unit,
        trigger_sample=int(trigger.group()) if trigger else None,
        # a whole number and nothing else: "Samples: 5 per channel" declares no length
        count=round(float(count)) if re.fullmatch(r"[1-9]\d{0,9}|\d\.\d*[eE]\+?\d{1,2}", count) else None,
        sensitivity=parse_quantity(
            f"{_point(sensitivity[1])} {sensitivity[2]}/{known_unit(sensitivity[3])}", "voltage_sensitivity"
        )
        if sensitivity
        else None,
        voltage_offset=parse_quantity(f"{_point(offset[1])} {offset[2]}", "voltage") if offset else 0.0,
    )


def _kind(field: str) -> str:
    """What a key tells, by its letters and digits; empty for one that is not known."""
    return _KIND.get(re.sub(r"[^a-z0-9]", "", split_unit(field.rstrip(" :"))[0].lower()), "")


def _names_and_units(rows: list[list[str]], layout: Layout) -> tuple[list[str], list[str], set[int]]:
    """Name and unit of every column, empty where none is said, and the rows that say it.

    Names stand in the last row as wide as the table that is no row of units, or behind a key such as
    ``Label``; units in a row of their own, whose first field may be a word, or behind a key as ``VUnit``.
    """
    columns = layout.columns
    names, units, used = [""] * columns, [""] * columns, set()
    for i, row in enumerate(rows):
        wide = _cut(row, columns)
        kind = _kind(row[0]) if len(row) > 1 else ""
        if kind in ("names", "units"):
            if (values := _by_column(row, columns, alone=kind == "units")) is not None:
                used.add(i)
                units = values if kind == "units" else units
        elif not kind and wide is not None and (said := _filled(wide[1:])) and all(map(known_unit, said)):
            units = [field if known_unit(field) else "" for field in wide]
            used.add(i)
    full = [
        i
        for i, row in enumerate(rows)
        if i not in used and not _kind(row[0]) and (wide := _cut(row, columns)) and _may_name(wide, layout)
    ]
    if full:
        names = _cut(rows[full[-1]], columns) or names
        used.add(full[-1])
    for i in sorted(used):
        if _kind(rows[i][0]) == "names" and len(rows[i]) > 1:
            said = _by_column(rows[i], columns, alone=False) or []
            names = [new or old for new, old in zip(said, names, strict=True)]
    names = [f"CH{name}" if name.isdigit() else name for name in names]
    return names, [unit.strip("[]()") for unit in units], used


def _trimmed(row: list[str]) -> list[str]:
    """A row without the blank fields at its end."""
    filled = [i for i, field in enumerate(row) if field]
    return row[: filled[-1] + 1] if filled else []


def _filled(fields: list[str]) -> list[str]:
    """The fields that say something; numbers below them are those of a clock."""
    return [field for field in fields if field not in ("", "-", "1") and not is_number(field, ".")]


def _cut(row: list[str], columns: int) -> list[str] | None:
    """A row as wide as the table; what stands beyond may be blank, a comment, or of the clock."""
    if len(row) < columns:
        return None
    beyond = [field for field in row[columns:] if field and field.lower() != "comment"]
    clock = all(_kind(field) in ("step", "start") or is_number(field, ".") for field in beyond)
    return row[:columns] if clock and len(beyond) <= _OF_CLOCK else None


def _may_name(row: list[str], layout: Layout) -> bool:
    """Whether a row can name columns: most fields filled, no numbers, not one word for all."""
    if sum(map(bool, row)) <= len(row) // 2 or (len(row) > 2 and len(set(row[1:])) == 1):
        return False
    if TIME_NAMES.match(row[0]) and all(field.isdigit() for field in row[1:]):
        return True  # channels that have numbers for names
    return not any(is_number(field, sign) for field in row for sign in {".", layout.decimal})


def _by_column(row: list[str], columns: int, *, alone: bool) -> list[str] | None:
    """Values behind a key, one for every column or for all but the first; None where they are others."""
    values = row[1:] if len(row) <= columns + 1 else _trimmed(row[1:])
    if len(values) == columns:
        return values if values[-1] or columns == 1 else ["", *values[:-1]]
    if len(values) == columns - 1:
        return ["", *values]
    return ["", *values[:1] * (columns - 1)] if alone and len(_filled(values)) == 1 else None


def _was_a_row(line: str, fields: list[str], layout: Layout, below_names: bool) -> bool:
    """Whether a line that is no row begins like one: no comment, no word in front, numbers among the rest."""
    if not line.strip() or line.lstrip()[0] in "#%!*" or re.match(r'\s*"?[^\W\d_]{2}', line):
        return False
    numbers = sum(is_number(field, layout.decimal) for field in fields)
    whole = 2 * abs(len(fields) - layout.columns) <= layout.columns
    return numbers > 0 and (below_names or whole)


def _entries(lines: list[str], rows: list[list[str]], used: set[int], layout: Layout) -> dict[str, str]:
    """Keys and values of all lines, and those of a clock that stand below their keys."""
    entries: dict[str, str] = {}
    for line in lines:
        _collect(line, layout.separator, entries)
    for above, below in pairwise([_trimmed(row) for row in rows]):
        same = len(above) == len(below)
        for key, value in zip(above[1:], below[1:], strict=True) if same else ():
            if _kind(key) in ("step", "start") and is_number(value, layout.decimal):
                entries.setdefault(key, value)
    return entries


def _collect(line: str, separator: str, entries: dict[str, str]) -> None:
    """Add the entries of a line: ``key: value;key: value`` or ``key;value;unit``."""
    plain = line.strip().lstrip("#%/!* ").strip()
    fields = [field.strip().strip('"').strip() for field in plain.split(separator)]
    pairs = [
        re.split("[:=]", field, maxsplit=1) for field in fields if re.match(r"[^:=]{2,40}[:=]\s*\S", field)
    ]
    if plain and pairs and not re.fullmatch(r"[\d:.\-T ]+", fields[0]):
        entries.update((key.strip(), value.strip()) for key, value in pairs if not re.search(r"\d$", key))
    if line.lstrip().startswith("#"):
        if plain and not pairs:
            entries.setdefault(f"comment {len(entries) + 1}", plain)
    elif len(fields) > 1 and (key := fields[0].rstrip(": ")) and ":" not in key:
        # one value for all channels, or one and the same for each
        values = [field for field in fields[1:] if field]
        entries.setdefault(key, values[0] if len(set(values)) == 1 else " ".join(fields[1:3]).strip())
    if (dated := dated_line(plain)) is not None:
        entries[dated[0]] = dated[1]


def _number(value: str, unit: str, kind: str, default_unit: str) -> float | None:
    """A header entry in SI units, None where it is no quantity of this kind."""
    match = re.match(r"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*(\S*)", value)
    if not match:
        return None
    unit = unit or known_unit(match[2]) or match[2] or default_unit
    try:
        return parse_quantity(f"{_point(match[1])} {unit}", kind)
    except UsageError:
        return None


def _point(number: str) -> str:
    return number.replace(",", ".")
