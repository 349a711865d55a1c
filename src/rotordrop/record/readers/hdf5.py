"""HDF5: scaled datasets, each with its own clock in attributes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Array, Channel, Recording, known_unit
from rotordrop.record.unpacking import Item, unpack

_TIME_NAMES = ("time", "t")

Clocks: TypeAlias = dict[tuple[float, float, float, int], Array]
"""Even clocks by start, rate, step and number of samples: channels of one clock share its array."""


def read_hdf5(path: Path, profile: Profile) -> Recording:
    """Read every one-dimensional numeric dataset of an HDF5 file: value = stored × ``scale`` + ``offset``.

    The clock of a dataset is in its attributes (``fs_hz`` or ``dt_s``, and ``t0_s``) or in a dataset ``time``
    beside it; the unit is in ``unit`` or ``units``.

    Parameters
    ----------
    path : Path
        The file.
    profile : Profile
        Rules that replace guesses.

    Raises
    ------
    RecordError
        When the file is damaged or truncated, points to other files, holds virtual datasets, or claims shapes
        that its bytes cannot fill.
    """
    content = unpack(path, "hdf5")
    times = {item.name: item for item in content.items if _is_time(item.name)}
    clocks: Clocks = {}
    channels = tuple(
        _channel(item, times, profile, path, clocks) for item in content.items if item.name not in times
    )
    if not channels:
        raise RecordError(f"{path} holds no one-dimensional numeric dataset; export the channels one by one")
    entries = {key: str(value) for key, value in content.attributes.items()}
    notes, warnings = (_lines(entries.get(key)) for key in ("notes", "warnings"))
    return Recording(channels=channels, metadata=entries, notes=notes, warnings=warnings)


def _is_time(name: str) -> bool:
    last = name.rsplit("/", 1)[-1].lower()
    return last in _TIME_NAMES or last.endswith("_time")


def _channel(item: Item, times: dict[str, Item], profile: Profile, path: Path, clocks: Clocks) -> Channel:
    attributes = {key.lower(): value for key, value in item.attributes.items()}
    scale, offset = (_number(attributes, names, item.name, path) for names in (("scale",), ("offset",)))
    values = item.values.astype(np.float64)
    values *= 1.0 if scale is None else scale
    values += 0.0 if offset is None else offset
    unit = profile.units.get(item.name, str(attributes.get("unit", attributes.get("units", ""))))
    return Channel(
        name=item.name.rsplit("/", 1)[-1],
        label=item.name,
        unit=known_unit(unit) or unit,
        values=values,
        time=_time(item, attributes, times, path, clocks),
    )


def _number(attributes: Mapping[str, Any], names: tuple[str, ...], dataset: str, path: Path) -> float | None:
    """Give the first of the named attributes as a number, or None where there is none of them."""
    value = next((attributes[name] for name in names if name in attributes), None)
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError):
        raise RecordError(
            f"{path}: attribute {names[0]!r} of {dataset!r} is {value!r:.60}, not a number; export it again"
        ) from None


def _time(
    item: Item, attributes: Mapping[str, Any], times: dict[str, Item], path: Path, clocks: Clocks
) -> Array:
    name, count = item.name, len(item.values)
    step = _number(attributes, ("dt_s", "dt"), name, path)
    rate = _number(attributes, ("fs_hz", "fs"), name, path)
    start = _number(attributes, ("t0_s", "t0"), name, path) or 0.0
    if (rate is not None and rate > 0) or (step is not None and step > 0):
        key = (start, rate or 0.0, step or 0.0, count)
        if key not in clocks:
            index = np.arange(count, dtype=np.float64)
            clocks[key] = start + (index / rate if rate is not None and rate > 0 else index * (step or 0.0))
        return clocks[key]
    folder = name.rpartition("/")[0]
    named = f"{folder}/{attributes.get('time', '')}".lstrip("/")
    if named in times and len(times[named].values) == count:
        return times[named].values.astype(np.float64)
    for candidate, found in times.items():
        if candidate.rpartition("/")[0] in (folder, "") and len(found.values) == count:
            return found.values.astype(np.float64)
    raise RecordError(
        f"{path}: {name!r} has neither an attribute 'fs_hz' or 'dt_s' nor a dataset 'time' of {count} "
        "samples beside it; add one"
    )


def _lines(text: str | None) -> tuple[str, ...]:
    return tuple(line for line in (text or "").split("\n") if line)
