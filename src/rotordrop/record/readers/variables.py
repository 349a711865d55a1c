"""Channels out of named arrays with what is said of them: HDF5, MAT, NPY, NPZ and TDMS.

What is said of an array stands in its attributes, beside it in its group or structure, or further up: its
clock, its unit, what one count is worth, and the names of its columns where it has several.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.clock import TIME_UNITS, in_seconds
from rotordrop.record.keys import Told, clock_told, kind_of
from rotordrop.record.recording import (
    TIME_NAMES,
    Channel,
    Recording,
    damaged,
    known_unit,
    listed,
    split_unit,
    whose_time,
)
from rotordrop.record.sandbox import Content, Item

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile


def is_samples(value: Any) -> bool:
    """Whether a variable can hold readings: numbers, more than one, in one or two dimensions."""
    array = isinstance(value, np.ndarray) and value.dtype.kind in "iufMm"
    return array and value.ndim in (1, 2) and value.size > 1


_SHARED = ("units", "factor", "per count", "offset", "step", "rate", "start")
"""What lists say of every column of a matrix."""
_PANDAS = {"datetime": "ns", "timedelta": "ns"}
"""Unit of the index of a table of pandas."""


class _Stamps(NamedTuple):
    """A clock of the file [s], its group, and the one channel whose clock it is, empty for all."""

    time: Array
    folder: str
    channel: str


@dataclass(frozen=True, kw_only=True)
class Variables:
    """The arrays of a file and what stands beside them."""

    content: Content
    profile: Profile
    path: Path
    sign: str
    """What stands between the names of group and array."""
    notes: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    """Arrays of numbers that have no clock or no names."""
    _even: dict[tuple[float, float, int], Array] = field(default_factory=dict)
    _clock_of: dict[int, Told] = field(default_factory=dict)

    def channels(self) -> list[Channel]:
        """A channel for each vector and each named column that is no clock; its label is its whole name."""
        found = []
        for item in self._series:
            time, last = self._time(item), self._split(item.name)[1]
            if item.name in self._clocks or (time is None and kind_of(last) in _SHARED):
                continue
            if time is None and self.profile.time.step is None:
                self.left_out.append(item.name)
                continue
            label = last if "column of" in item.attributes else item.name
            name, unit = self._name_and_unit(item, last, label)
            found.append(self.profile.channel(name, unit, self._values(item), time, label=label))
        return found

    def _split(self, name: str) -> tuple[str, str]:
        """Group and last part of a name; in brackets nothing separates, "speed [rad/s]"."""
        folder, _, last = name.rpartition(self.sign)
        while folder and any(last.count(a) < last.count(b) for a, b in ("[]", "()")):
            folder, _, before = folder.rpartition(self.sign)
            last = f"{before}{self.sign}{last}"
        return folder, last

    @cached_property
    def _series(self) -> list[Item]:
        """Vectors: those of the file and the named columns of its matrices."""
        found: list[Item] = []
        for item in self.content.items:
            array = np.squeeze(item.values)
            names, (title, unit) = self._names_of(item, array.shape), self._title(item)
            if array.ndim == 1:
                found.append(replace(item, values=array))
            elif not names and title and array.shape[1] < len(array):
                names = [f"{title} {k}" for k in range(1, array.shape[1] + 1)]
            elif not names:
                self.left_out.append(f"{item.name} ({array.shape}, whose columns have no names)")
            shared = self._shared(item, len(names)) if array.ndim == 2 else {}
            for i, name in enumerate(names):
                column = array[:, i] if array.shape[1] == len(names) else array[i]
                said = {**item.attributes, **{k: v[i] for k, v in shared.items()}, "column of": item.name}
                said |= {"unit": unit} if unit and "units" not in map(kind_of, said) else {}
                values = np.ascontiguousarray(column)
                found.append(Item(name=f"{item.name}{self.sign}{name}", values=values, attributes=said))
        return found

    def _names_of(self, item: Item, shape: tuple[int, ...]) -> list[str]:
        """Names of the columns of a matrix: of the profile, else a list of as many texts, its own first."""
        stem = self._split(item.name)[1].partition("_")[0]  # pandas has block1_items for block1_values
        lists = [(k, v) for scope in self._scopes(item) for k, v in scope.items() if kind_of(k) != "units"]
        lists.sort(key=lambda one: not one[0].startswith(f"{stem}_"))
        for texts in (self.profile.text.names, *(texts for _, texts in lists)):
            if isinstance(texts, list | tuple) and len(shape) == 2 and len(texts) in shape[::-1]:
                names = [text.strip() for text in texts if isinstance(text, str)]
                if len(set(names)) == len(texts):
                    return names
        return []

    def _shared(self, item: Item, count: int) -> dict[str, Any]:
        """What lists of as many entries as a matrix has columns say of each: units, factors, clocks."""
        folder, items = self._split(item.name)[0], self.content.items
        vectors = {self._split(one.name): np.ravel(one.values) for one in items if one.values.size == count}
        beside = {last: values.tolist() for (place, last), values in vectors.items() if place == folder}
        own, *above = self._scopes(item)
        said = [one for scope in (*above[::-1], beside, own) for one in scope.items()]
        return {k: v for k, v in said if isinstance(v, list) and len(v) == count and kind_of(k) in _SHARED}

    def _title(self, item: Item) -> tuple[str, str]:
        """Name and unit that stand beside an array in its structure; of a path its last part."""
        beside = self._scopes(item)[1].items() if self._folders(item)[0] else ()
        titles = [v for k, v in beside if kind_of(k) == "names" or k == "channel"]
        title = next((one for one in titles if one and isinstance(one, str)), "")
        name, _, unit = split_unit(title.rpartition("/")[2] if title.count("/") > 1 else title)
        return name, unit

    @cached_property
    def _clocks(self) -> dict[str, _Stamps]:
        """The arrays that are clocks."""
        wanted, found, units = self.profile.time.channel, [], []
        names = {split_unit(self._split(item.name)[1])[0] for item in self._series}
        for item in self._series:
            folder, last = self._split(item.name)
            index = str(item.attributes.get("name", "")) if last == "axis1" else ""  # of pandas
            name, label, unit = split_unit(index or last)
            counts = index and item.values.dtype.kind in "iu" and np.all(np.diff(item.values) == 1)
            channel = None if counts else "" if index else whose_time(name, names)
            unit = unit or _PANDAS.get(str(item.attributes.get("kind", "")).partition("64")[0], "")
            title = self._title(item)[0] if re.fullmatch("data|values?", last, re.IGNORECASE) else ""
            if TIME_NAMES.fullmatch(title):
                channel, folder = "", folder.rpartition(self.sign)[0]  # a structure of name and samples
            said = unit if unit in TIME_UNITS else next((v for _, v in self._said(item, "units")), unit)
            said = str(said).partition(" since ")[0]
            told = self.profile.time.unit or known_unit(said) or ""
            if told not in TIME_UNITS and (channel in names or not (channel or unit)):
                told = ""  # the unit of the other columns of a table
            if (wanted in (name, label, item.name) if wanted else channel is not None) and (
                told in ("", *TIME_UNITS)
            ):
                found.append((item, folder, channel or ""))
                units.append(told)
        stamps = [one.values if self._factor(one) == (1.0, 0.0) else self._values(one) for one, *_ in found]
        return {
            item.name: _Stamps(time, folder, channel)
            for time, (item, folder, channel) in zip(in_seconds(stamps, units), found, strict=True)
        }

    def _time(self, item: Item) -> Array | None:
        """The clock of an array [s]: in its attributes, named there, of its own, in its group, further up."""
        own, *above = self._scopes(item)
        folder, last = self._split(item.name)
        named = f"{folder}{self.sign if folder else ''}{own.get('time', '')}"
        clocks = {name: one for name, one in self._clocks.items() if len(one.time) == len(item.values)}
        if (even := self._even_clock(item, own)) is not None:
            return even
        for name, one in clocks.items():
            if name == named or (one.channel and one.channel in (last, split_unit(last)[0])):
                return one.time
        for group, scope in zip(self._folders(item), above, strict=True):
            for one in clocks.values():
                if one.folder == group and not one.channel:
                    return one.time
            if (even := self._even_clock(item, scope)) is not None:
                return even
        return None

    def _even_clock(self, item: Item, scope: Mapping[str, Any]) -> Array | None:
        step, count = self._told(scope).step, len(item.values)
        if not step:
            wrong = [(k, v) for k, v in scope.items() if kind_of(k) in ("step", "rate") and v not in ("", 0)]
            if wrong and scope is item.attributes:
                raise self._no_number(item, *wrong[0])
            return None
        told = [self._told(one) for one in self._scopes(item)]
        begun = next((begin for one in told if (begin := one.begin(count, step)) is not None), None)
        unused = listed(dict.fromkeys(words for one in told for words in one.unused))
        self.notes.extend([f"not used: {unused}"] if unused else [])
        if begun is None and "began_s" not in item.attributes:
            self.notes.append("no trigger in the file: record time counts from the first sample")
        start = (begun or 0.0) + float(item.attributes.get("began_s", 0.0))
        key = (start, step, count)
        if key not in self._even:  # channels of one clock share its array
            self._even[key] = start + step * np.arange(count, dtype=np.float64)
        return self._even[key]

    def _told(self, scope: Mapping[str, Any]) -> Told:
        if id(scope) not in self._clock_of:
            self._clock_of[id(scope)] = clock_told(scope)
        return self._clock_of[id(scope)]

    def _values(self, item: Item) -> Array:
        """Readings: stored × factor + offset, NaN where the file has its value for none."""
        factor, offset = self._factor(item)
        values = item.values.astype(np.float64, copy=False)
        for _, none in self._said(item, "none"):
            values = np.where(item.values == none, np.nan, values)
        return values if (factor, offset) == (1.0, 0.0) else values * factor + offset

    def _factor(self, item: Item) -> tuple[float, float]:
        """What one count is worth and where it is zero, by the attributes of the array or its structure."""
        scopes = self._scopes(item)[: 2 if self._folders(item)[0] else 1]
        told, per_count = (
            {
                f"{key} = {value:g}": value
                for scope in scopes
                for key, value in self._numbers(item, scope, kind)
                if value not in (0.0, 1.0)
            }
            for kind in ("factor", "per count")
        )
        if item.values.dtype.kind in "iu":
            told |= per_count
        else:
            self.notes.extend(f"not used, {item.name} holds no counts: {one}" for one in per_count)
        if len(set(told.values())) > 1:
            words = f"{item.name!r} has several factors, {', '.join(told)}"
            raise RecordError(f"{self.path}: {words}; keep the one that makes readings of its counts")
        offset = sum(value for scope in scopes for _, value in [*self._numbers(item, scope, "offset")][:1])
        return next(iter(told.values()), 1.0), offset

    def _name_and_unit(self, item: Item, last: str, label: str) -> tuple[str, str]:
        """Name without its unit, and the unit: of its attributes, in its name, beside it or further up."""
        own, folder = item.attributes, self._folders(item)[0]
        name, _, unit = split_unit(last)
        units = [v for k, v in own.items() if kind_of(k) == "units" and v and not isinstance(v, list)]
        if units:
            name, unit = last, str(units[0])
        title, of_title = self._title(item)
        if title:
            name, unit = title, unit or of_title
        elif folder and re.fullmatch(r"(.* )?(data|values?|samples)", last, re.IGNORECASE):
            name = folder.rpartition(self.sign)[2]
        elif folder and known_unit(last):  # a structure X1 with a vector um
            name, unit = folder.partition(self.sign)[0], last
        matrix = str(own.get("column of", "")).rpartition(self.sign)[2]
        unit = unit or split_unit(matrix)[2] or str(next((v for _, v in self._said(item, "units")), ""))
        if item.values.dtype.kind in "iu" and known_unit(unit) and self._factor(item)[0] == 1.0:
            words = f"holds whole numbers, taken as {unit} each; is one worth less, its unit in a profile"
            self.notes.append(f'{name} {words} says it: [units] "{label}" = "0.02 {unit}"')
        return name, unit

    def _said(self, item: Item, kind: str) -> Iterator[tuple[str, Any]]:
        """Single entries of a kind, those of the array first."""
        for scope in self._scopes(item):
            said = ((k, v) for k, v in scope.items() if kind_of(k) == kind and v != "")
            yield from ((k, v) for k, v in said if not isinstance(v, list))

    def _numbers(self, item: Item, scope: Mapping[str, Any], kind: str) -> Iterator[tuple[str, float]]:
        """Entries of a kind that are numbers."""
        for key, value in scope.items():
            if kind_of(key) == kind and not isinstance(value, list) and value != "":
                try:
                    yield key, float(value)
                except ValueError as error:
                    if scope is item.attributes:
                        raise self._no_number(item, key, value) from error

    def _no_number(self, item: Item, key: str, value: Any) -> RecordError:
        return damaged(self.path, f": attribute {key!r} of {item.name!r} is {value!r:.60}, not a number")

    def _folders(self, item: Item) -> list[str]:
        """The groups around an array, the innermost first, the file as the last."""
        folders = [self._split(item.name)[0]]
        while folders[-1]:
            folders.append(self._split(folders[-1])[0])
        return folders

    def _scopes(self, item: Item) -> list[Mapping[str, Any]]:
        """What is said of an array, then what stands in these groups, by the last part of its name."""
        return [item.attributes, *(self._entries.get(folder, {}) for folder in self._folders(item))]

    @cached_property
    def _entries(self) -> dict[str, dict[str, Any]]:
        found: dict[str, dict[str, Any]] = {}
        for name, value in self.content.attributes.items():
            folder, _, last = name.rpartition(self.sign)
            found.setdefault(folder, {})[last] = value
        return found


def recording_of(
    content: Content,
    path: Path,
    profile: Profile,
    sign: str,
    *,
    lacks: str = "",
    found: Sequence[Channel] = (),
) -> Recording:
    """A recording of named arrays beside channels found already.

    An array without a clock is left out with a note, or refused with what it `lacks`, its name as {}.
    """
    variables = Variables(content=content, profile=profile, path=path, sign=sign)
    channels, names = [*found, *variables.channels()], variables.left_out
    if lacks and (unclocked := [name for name in names if not name.endswith(")")]):
        ask = 'add it, or give the time between samples in a profile: [time] step = "50 us"'
        raise RecordError(f"{path}: {lacks.format(repr(unclocked[0]))}; {ask}")
    called = [channel.name for channel in channels]  # "X" of one group and "X" of the next
    named = [one.label.replace(sign, " ") if called.count(one.name) > 1 else one.name for one in channels]
    channels = [replace(one, name=name) for one, name in zip(channels, named, strict=True)]
    said = {k: str(v) for k, v in content.attributes.items() if isinstance(v, str | int | float)}
    if not channels:
        if objects := sorted({text for text in said.values() if text.startswith("MATLAB ")}):
            what = f"objects ({listed(objects)}) that only MATLAB reads"
            raise RecordError(f"{path} holds {what}; save arrays, or by writetable")
        have = f"found no samples with a clock among {listed([*names, *content.attributes]) or 'nothing'}"
        ask = "a vector 't', or 'fs' and 't0', must stand beside the channels, or time.step in the profile"
        raise RecordError(f"{path}: {have}; {ask}, and names of columns in text.names")
    notes, warnings = ([line for line in said.get(k, "").split("\n") if line] for k in ("notes", "warnings"))
    notes += [
        *dict.fromkeys(variables.notes),
        *([f"left out, without a clock: {listed(names)}"] if names else []),
    ]
    return Recording(channels=tuple(channels), metadata=said, notes=tuple(notes), warnings=tuple(warnings))
