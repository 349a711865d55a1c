"""HDF5: scaled datasets, each with its own clock in attributes; refuses whatever points outside the file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.measurement.profile import Profile
from rotordrop.measurement.recording import Array, Channel, Recording, known_unit

LARGEST = 4 * 2**30
"""Largest size of one dataset when unpacked [byte]."""

_STEEPEST_PACKING = 1100
"""More bytes per stored byte than gzip can reach mean a made-up shape."""

_TIME_NAMES = ("time", "t")


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
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return _recording(file, profile, path)
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        raise RecordError(
            f"{path} is no intact HDF5 file ({_first_line(error)}; it has {path.stat().st_size} bytes); "
            "copy or export it again"
        ) from error


def _recording(file: Any, profile: Profile, path: Path) -> Recording:
    datasets = _safe_datasets(file, path)
    entries = {str(key): _text(value) for key, value in file.attrs.items()}
    times = {name: item for name, item in datasets.items() if _is_time(name)}
    channels = tuple(
        _channel(name, item, times, profile, path) for name, item in datasets.items() if name not in times
    )
    if not channels:
        raise RecordError(f"{path} holds no one-dimensional numeric dataset; export the channels one by one")
    notes, warnings = (_texts(file, key) for key in ("notes", "warnings"))
    return Recording(channels=channels, metadata=entries, notes=notes, warnings=warnings)


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0]


def _safe_datasets(file: Any, path: Path) -> dict[str, Any]:
    """Collect the datasets, having refused everything that is dangerous or not really there."""
    found: dict[str, Any] = {}
    seen: set[Any] = set()

    def visit(group: Any, prefix: str) -> None:
        import h5py

        for key in group:
            name = f"{prefix}{key}"
            link = group.get(key, getlink=True)
            if not isinstance(link, h5py.HardLink):
                raise RecordError(
                    f"{path}: {name!r} is a {type(link).__name__} (to {_target(link)!r}), not data of this "
                    "file; "
                    "store the data itself"
                )
            item = group[key]
            if isinstance(item, h5py.Group):
                address = h5py.h5o.get_info(item.id).addr
                if address not in seen:
                    seen.add(address)
                    visit(item, f"{name}/")
            elif isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf" and item.ndim == 1:
                _refuse_unsafe(name, item, path)
                found[name] = item

    visit(file, "")
    return found


def _target(link: Any) -> str:
    return ":".join(str(part) for part in (getattr(link, "filename", None), link.path) if part)


def _refuse_unsafe(name: str, item: Any, path: Path) -> None:
    """Refuse data that lie in other files, or shapes that the stored bytes cannot fill."""
    if item.is_virtual:
        raise RecordError(f"{path}: {name!r} is a virtual dataset over other files; store the data itself")
    if item.external:
        raise RecordError(
            f"{path}: the data of {name!r} lie in the file {item.external[0][0]!r}; store the data itself"
        )
    size, stored = item.size * item.dtype.itemsize, item.id.get_storage_size()
    if size > LARGEST or (item.chunks and size > _STEEPEST_PACKING * max(stored, 1)):
        raise RecordError(
            f"{path}: {name!r} claims {item.size} samples ({size} bytes) but {stored} bytes are stored; "
            "the file is damaged or made to exhaust memory"
        )
    if item.chunks:
        expected, present = math.ceil(item.size / item.chunks[0]), item.id.get_num_chunks()
        if present < expected:
            raise RecordError(
                f"{path}: of {name!r} only {present} of {expected} blocks were written; the recording was "
                "cut off"
            )
    elif stored < size or (item.id.get_offset() or 0) + stored > path.stat().st_size:
        raise RecordError(
            f"{path}: {name!r} claims {size} bytes but {stored} are stored; the recording was cut off"
        )


def _is_time(name: str) -> bool:
    last = name.rsplit("/", 1)[-1].lower()
    return last in _TIME_NAMES or last.endswith("_time")


def _channel(name: str, item: Any, times: dict[str, Any], profile: Profile, path: Path) -> Channel:
    attributes = {str(key).lower(): value for key, value in item.attrs.items()}
    try:
        raw = np.asarray(item[()], dtype=np.float64)
    except OSError as error:
        raise RecordError(
            f"{path}: {name!r} cannot be unpacked ({_first_line(error)}); copy the file again"
        ) from error
    values = raw * float(attributes.get("scale", 1.0)) + float(attributes.get("offset", 0.0))
    unit = profile.units.get(name, _text(attributes.get("unit", attributes.get("units", ""))))
    return Channel(
        name=name.rsplit("/", 1)[-1],
        label=name,
        unit=known_unit(unit) or unit,
        values=values,
        time=_time(name, attributes, len(raw), times, path),
    )


def _time(name: str, attributes: dict[str, Any], count: int, times: dict[str, Any], path: Path) -> Array:
    step = attributes.get("dt_s", attributes.get("dt"))
    rate = attributes.get("fs_hz", attributes.get("fs"))
    start = float(attributes.get("t0_s", attributes.get("t0", 0.0)))
    index = np.arange(count, dtype=np.float64)
    if rate is not None and float(rate) > 0:
        return start + index / float(rate)
    if step is not None and float(step) > 0:
        return start + index * float(step)
    folder = name.rpartition("/")[0]
    if "time" in attributes:
        named = f"{folder}/{_text(attributes['time'])}".lstrip("/")
        if named in times and times[named].size == count:
            return np.asarray(times[named][()], dtype=np.float64)
    for candidate, item in times.items():
        if candidate.rpartition("/")[0] in (folder, "") and item.size == count:
            return np.asarray(item[()], dtype=np.float64)
    raise RecordError(
        f"{path}: {name!r} has neither an attribute 'fs_hz' or 'dt_s' nor a dataset 'time' of {count} "
        "samples "
        "beside it; add one"
    )


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value)


def _texts(file: Any, key: str) -> tuple[str, ...]:
    value = file.attrs.get(key)
    return () if value is None else tuple(line for line in _text(value).split("\n") if line)
