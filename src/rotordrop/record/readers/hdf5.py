"""HDF5: scaled datasets, each with its own clock in attributes; refuses whatever points outside the file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import DamagedFileError, RecordError
from rotordrop.files import HDF5_SEALED, hdf5_is_sealed
from rotordrop.record.recording import Recording
from rotordrop.record.sandbox import MOST_SERIES, Content, Item, plain, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_SIMULATED = "rotordrop drop "
"""Begin of the attribute ``format`` of a simulated drop."""
_TIME_NAMES = ("time", "t")

_Clocks: TypeAlias = dict[tuple[float, float, float, int], Array]
"""Even clocks by start, rate, step and number of samples: channels of one clock share its array."""


def read_hdf5(path: Path, profile: Profile) -> Recording:
    """Read every one-dimensional numeric dataset of an HDF5 file: value = stored × ``scale`` + ``offset``.

    The clock of a dataset is in its attributes (``fs_hz`` or ``dt_s``, and ``t0_s``) or in a dataset ``time``
    beside it; the unit is in ``unit`` or ``units``.
    """
    try:
        hdf5_is_sealed(path, "copy it again, or make it again")
    except DamagedFileError as error:
        raise RecordError(str(error)) from error
    content = unpack(path, "hdf5")
    if str(content.attributes.get("format", "")).startswith(_SIMULATED):
        raise RecordError(
            f"{path} is a result of 'rotordrop simulate -o' (histories of the simulation), no recording of "
            "sensors; name the file of a recorder, or make simulated recordings with 'rotordrop-bench make'"
        )
    last = {item.name: item.name.rsplit("/", 1)[-1] for item in content.items}
    times = {
        item.name: item
        for item in content.items
        if last[item.name].lower() in _TIME_NAMES or last[item.name].lower().endswith("_time")
    }
    clocks: _Clocks = {}
    channels = []
    for item in content.items:
        if item.name in times:
            continue
        attributes = {key.lower(): value for key, value in item.attributes.items()}
        scale = _number(attributes, ("scale",), item.name, path)
        offset = _number(attributes, ("offset",), item.name, path)
        values = item.values.astype(np.float64)
        values *= 1.0 if scale is None else scale
        values += 0.0 if offset is None else offset
        unit = str(attributes.get("unit", attributes.get("units", "")))
        time = _time(item, attributes, times, path, clocks)
        channels.append(profile.channel(last[item.name], unit, values, time, label=item.name))
    if not channels:
        raise RecordError(f"{path} holds no one-dimensional numeric dataset; export the channels one by one")
    entries = {key: str(value) for key, value in content.attributes.items() if key != HDF5_SEALED}
    notes, warnings = (
        tuple(line for line in entries.get(key, "").split("\n") if line) for key in ("notes", "warnings")
    )
    return Recording(channels=tuple(channels), metadata=entries, notes=notes, warnings=warnings)


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
    item: Item, attributes: Mapping[str, Any], times: dict[str, Item], path: Path, clocks: _Clocks
) -> Array:
    """Time of the samples [s], shape (N,): by rate or step, by the clock it names, or by one beside it."""
    name, count = item.name, len(item.values)
    step = _number(attributes, ("dt_s", "dt"), name, path) or 0.0
    rate = _number(attributes, ("fs_hz", "fs"), name, path) or 0.0
    start = _number(attributes, ("t0_s", "t0"), name, path) or 0.0
    if rate > 0 or step > 0:
        key = (start, rate, step, count)
        if key not in clocks:
            index = np.arange(count, dtype=np.float64)
            clocks[key] = start + (index / rate if rate > 0 else index * step)
        return clocks[key]
    folder = name.rpartition("/")[0]
    named = f"{folder}/{attributes.get('time', '')}".lstrip("/")
    beside = [candidate for candidate in times if candidate.rpartition("/")[0] in (folder, "")]
    for candidate in (named, *beside):
        if candidate in times and len(times[candidate].values) == count:
            return times[candidate].values.astype(np.float64)
    raise RecordError(
        f"{path}: {name!r} has neither an attribute 'fs_hz' or 'dt_s' nor a dataset 'time' of {count} "
        "samples beside it; add one"
    )


def unpacked(path: Path) -> Content:
    """In the child: every numeric dataset of one dimension, and those of two as MATLAB writes them."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            found = _safe_datasets(file, path)
            attributes = _attributes(file)
            items = [_item(name, found[name], file, attributes, path) for name in found]
    except (OSError, KeyError, RuntimeError, ValueError, TypeError, AttributeError) as error:
        reason = str(error).splitlines() or [type(error).__name__]
        raise RecordError(
            f"{path} is no intact HDF5 file ({reason[0]}; it has {path.stat().st_size} bytes); "
            "copy or export it again"
        ) from error
    return Content(items=tuple(item for item in items if item is not None), attributes=attributes)


def _attributes(thing: Any) -> dict[str, Any]:
    return {str(key): plain(value) for key, value in thing.attrs.items()}


def _safe_datasets(file: Any, path: Path) -> dict[str, Any]:
    """Collect the datasets, having refused everything that is dangerous or not really there."""
    import h5py

    found: dict[str, Any] = {}
    seen: set[Any] = set()
    waiting = [(file, "")]
    while waiting:
        group, prefix = waiting.pop(0)
        for key in group:
            name = f"{prefix}{key}"
            if name.startswith("#"):
                continue  # MATLAB keeps what its cells refer to there
            link = group.get(key, getlink=True)
            if link is None:
                raise RecordError(f"{path}: {name!r} leads nowhere; the file is damaged, copy it again")
            if not isinstance(link, h5py.HardLink):
                target = ":".join(str(part) for part in (getattr(link, "filename", None), link.path) if part)
                raise RecordError(
                    f"{path}: {name!r} is a {type(link).__name__} (to {target!r}), not data of this file; "
                    "store the data itself"
                )
            item = group[key]
            if isinstance(item, h5py.Group):
                # a group may be linked into itself: it is known by its address, not by its name
                address = h5py.h5o.get_info(item.id).addr
                if address not in seen:
                    seen.add(address)
                    waiting.append((item, f"{name}/"))
            elif isinstance(item, h5py.Dataset) and _wanted(item):
                _refuse_unsafe(name, item, path)
                found[name] = item
            if len(found) + len(seen) > MOST_SERIES:
                raise RecordError(
                    f"{path} holds more than {MOST_SERIES} datasets and groups; it is no recording"
                )
    refuse_bomb(sum(int(item.size) for item in found.values()), path.stat().st_size, path)
    return found


def _wanted(item: Any) -> bool:
    of_matlab = "MATLAB_class" in item.attrs
    if item.dtype.kind not in "iuf" and not (item.dtype.kind == "O" and of_matlab):
        return False
    return item.ndim == 1 or (item.ndim == 2 and of_matlab)


def _refuse_unsafe(name: str, item: Any, path: Path) -> None:
    """Refuse data that lie in other files, or shapes that the stored bytes cannot fill."""
    if item.is_virtual:
        raise RecordError(f"{path}: {name!r} is a virtual dataset over other files; store the data itself")
    if item.external:
        raise RecordError(
            f"{path}: the data of {name!r} lie in the file {item.external[0][0]!r}; store the data itself"
        )
    refuse_bomb(int(item.size), path.stat().st_size, f"{path}: {name!r}")
    size, stored = item.size * item.dtype.itemsize, item.id.get_storage_size()
    if item.chunks:
        expected = math.prod(math.ceil(n / chunk) for n, chunk in zip(item.shape, item.chunks, strict=True))
        present = item.id.get_num_chunks()
        if present < expected:
            raise RecordError(
                f"{path}: of {name!r} only {present} of {expected} blocks were written; the recording was "
                "cut off"
            )
    elif stored < size or (item.id.get_offset() or 0) + stored > path.stat().st_size:
        raise RecordError(
            f"{path}: {name!r} claims {size} bytes but {stored} are stored; the recording was cut off"
        )


def _item(name: str, dataset: Any, file: Any, attributes: dict[str, Any], path: Path) -> Item | None:
    """Give a dataset; texts, cells of texts and single numbers of MATLAB become attributes of the file."""
    own = _attributes(dataset)
    kind = own.get("MATLAB_class")
    try:
        if dataset.dtype.kind == "O":
            cells = [file[reference] for reference in np.ravel(dataset[()], order="F")]
            texts = [c for c in cells if c.attrs.get("MATLAB_class") == b"char" and c.size <= 1000]
            attributes[name] = ["".join(map(chr, np.ravel(cell[()]))) for cell in texts]
            return None
        values = dataset[()]
    except OSError as error:
        raise RecordError(
            f"{path}: {name!r} cannot be unpacked ({str(error).splitlines()[0]}); copy the file again"
        ) from error
    if kind == "char":
        attributes[name] = "".join(map(chr, np.ravel(values)))
        return None
    if kind is not None and values.size == 1:
        attributes[name] = plain(values)
        return None
    return Item(name=name, values=np.squeeze(values.T) if kind is not None else values, attributes=own)
