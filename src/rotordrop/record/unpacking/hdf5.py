"""HDF5, and MAT files of version 7.3 inside it; refuses whatever points outside the file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.unpacking import Content, Item, plain, refuse_bomb

_MOST = 2000


def unpacked(path: Path) -> Content:
    """Read every numeric dataset of one dimension, and those of two as MATLAB writes them."""
    try:
        with h5py.File(path, "r") as file:
            found = _safe_datasets(file, path)
            attributes = _attributes(file)
            items = tuple(_item(name, found[name], file, attributes, path) for name in found)
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
                raise RecordError(
                    f"{path}: {name!r} is a {type(link).__name__} (to {_target(link)!r}), not data of this "
                    "file; store the data itself"
                )
            item = group[key]
            if isinstance(item, h5py.Group):
                address = h5py.h5o.get_info(item.id).addr
                if address not in seen:
                    seen.add(address)
                    waiting.append((item, f"{name}/"))
            elif isinstance(item, h5py.Dataset) and _wanted(item):
                _refuse_unsafe(name, item, path)
                found[name] = item
            if len(found) + len(seen) > _MOST:
                raise RecordError(f"{path} holds more than {_MOST} datasets and groups; it is no recording")
    refuse_bomb(sum(int(item.size) for item in found.values()), path.stat().st_size, path)
    return found


def _wanted(item: Any) -> bool:
    if item.dtype.kind not in "iuf" and not (item.dtype.kind == "O" and "MATLAB_class" in item.attrs):
        return False
    return item.ndim == 1 or (item.ndim == 2 and "MATLAB_class" in item.attrs)


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
            words = [_text(file[reference]) for reference in np.ravel(dataset[()], order="F")]
            attributes[name] = [word for word in words if word is not None]
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


def _text(dataset: Any) -> str | None:
    if dataset.attrs.get("MATLAB_class") != b"char" or dataset.size > 1000:
        return None
    return "".join(map(chr, np.ravel(dataset[()])))
