"""HDF5: datasets with what is said of them in attributes; refuses whatever points outside the file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import DamagedFileError, RecordError
from rotordrop.files import HDF5_SEALED, hdf5_is_sealed
from rotordrop.record.recording import Recording, damaged
from rotordrop.record.sandbox import MOST_SERIES, Content, Item, plain, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_SIMULATED = "rotordrop drop "
"""Begin of the attribute ``format`` of a simulated drop."""
_OBJECTS = ("table", "timetable", "datetime", "duration", "string", "categorical")
"""Classes of MATLAB whose values lie where no program but MATLAB finds them."""


def read_hdf5(path: Path, profile: Profile) -> Recording:
    """Read every numeric dataset of an HDF5 file that is a vector, a table or a matrix with names.

    A value is stored × ``scale_factor`` + ``add_offset``. The clock of a dataset is in its attributes
    (``fs_hz`` or ``dt_s``, and ``t0_s``) or in a dataset ``time`` beside it; the unit is in ``unit``.
    """
    from rotordrop.record.readers.variables import recording_of

    try:
        hdf5_is_sealed(path, "copy it again, or make it again")
    except DamagedFileError as error:
        raise RecordError(str(error)) from error
    content = unpack(path, "hdf5")
    if str(content.attributes.get("format", "")).startswith(_SIMULATED):
        words = f"{path} is a result of 'rotordrop simulate -o', no recording of sensors"
        ask = "name the file of a recorder, or make simulated recordings with 'rotordrop-bench make'"
        raise RecordError(f"{words}; {ask}")
    said = {key: value for key, value in content.attributes.items() if key != HDF5_SEALED}
    lacks = "{} has neither an attribute 'fs_hz' or 'dt_s' nor a dataset 'time' of as many samples beside it"
    return recording_of(Content(items=content.items, attributes=said), path, profile, "/", lacks=lacks)


def unpacked(path: Path) -> Content:
    """In the child: every numeric dataset of one or two dimensions, tables and texts."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            attributes = _attributes(file)
            found = _safe_datasets(file, attributes, path)
            items = [item for name in found for item in _items(name, found[name], file, attributes, path)]
    except (OSError, KeyError, RuntimeError, ValueError, TypeError, AttributeError) as error:
        reason = str(error).splitlines() or [type(error).__name__]
        words = f" is no intact HDF5 file ({reason[0]}; it has {path.stat().st_size} bytes)"
        raise damaged(path, words) from error
    return Content(items=tuple(items), attributes=attributes)


def _attributes(thing: Any) -> dict[str, Any]:
    return {str(key): plain(value) for key, value in thing.attrs.items()}


def _safe_datasets(file: Any, attributes: dict[str, Any], path: Path) -> dict[str, Any]:
    """Collect the datasets, having refused everything that is dangerous or not really there.

    What is said of a group joins the attributes of the file.
    """
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
                raise damaged(path, f": {name!r} leads nowhere")
            if not isinstance(link, h5py.HardLink):
                target = ":".join(str(part) for part in (getattr(link, "filename", None), link.path) if part)
                words = f"{name!r} is a {type(link).__name__} (to {target!r}), not data of this file"
                raise RecordError(f"{path}: {words}; store the data itself")
            item = group[key]
            if isinstance(item, h5py.Group):
                # a group may be linked into itself: it is known by its address, not by its name
                address = h5py.h5o.get_info(item.id).addr
                if address not in seen:
                    seen.add(address)
                    attributes |= {f"{name}/{key}": value for key, value in _attributes(item).items()}
                    waiting.append((item, f"{name}/"))
            elif isinstance(item, h5py.Dataset) and _wanted(item):
                _refuse_unsafe(name, item, path)
                found[name] = item
            if len(found) + len(seen) > MOST_SERIES:
                raise damaged(path, f" holds more than {MOST_SERIES} datasets and groups")
    refuse_bomb(sum(int(item.size) for item in found.values()), path.stat().st_size, path)
    return found


def _wanted(item: Any) -> bool:
    import h5py

    of_texts = item.dtype.kind == "S" or h5py.check_string_dtype(item.dtype) is not None
    table = item.dtype.names is not None
    numbers = item.dtype.kind in "iuf" or table or (item.dtype.kind == "O" and "MATLAB_class" in item.attrs)
    return item.ndim in (1, 2) and (numbers or (of_texts and item.size <= MOST_SERIES))


def _refuse_unsafe(name: str, item: Any, path: Path) -> None:
    """Refuse data that lie in other files, or shapes that the stored bytes cannot fill."""
    if item.is_virtual:
        raise RecordError(f"{path}: {name!r} is a virtual dataset over other files; store the data itself")
    if item.external:
        words = f"the data of {name!r} lie in the file {item.external[0][0]!r}"
        raise RecordError(f"{path}: {words}; store the data itself")
    refuse_bomb(int(item.size), path.stat().st_size, f"{path}: {name!r}")
    size, stored, lacks = item.size * item.dtype.itemsize, item.id.get_storage_size(), ""
    if item.chunks:
        expected = math.prod(math.ceil(n / chunk) for n, chunk in zip(item.shape, item.chunks, strict=True))
        present = item.id.get_num_chunks()
        words = f": of {name!r} only {present} of {expected} blocks were written"
        lacks = words if present < expected else ""
    elif stored < size or (item.id.get_offset() or 0) + stored > path.stat().st_size:
        lacks = f": {name!r} claims {size} bytes but {stored} are stored"
    if lacks:
        raise damaged(path, f"{lacks}, the recording was cut off")


def _items(name: str, dataset: Any, file: Any, attributes: dict[str, Any], path: Path) -> list[Item]:
    """A dataset, or the columns of a table; what MATLAB has of texts and numbers goes to the attributes."""
    own = _attributes(dataset)
    kind = own.get("MATLAB_class")
    if kind in _OBJECTS:
        attributes[name] = f"MATLAB {kind}"
        return []
    try:
        if dataset.dtype.kind == "O" and kind is not None:
            cells = [file[reference] for reference in np.ravel(dataset[()], order="F")]
            texts = [c for c in cells if c.attrs.get("MATLAB_class") == b"char" and c.size <= 1000]
            attributes[name] = ["".join(map(chr, np.ravel(cell[()]))) for cell in texts]
            return []
        values = dataset[()]
    except OSError as error:
        raise damaged(path, f": {name!r} cannot be unpacked ({str(error).splitlines()[0]})") from error
    if values.dtype.names:
        attributes |= {f"{name}/{key}": value for key, value in own.items()}
        columns = ((key, np.ascontiguousarray(values[key])) for key in values.dtype.names)
        return [
            Item(name=f"{name}/{key}", values=column, attributes={})
            for key, column in columns
            if column.dtype.kind in "iuf"
        ]
    if kind is None and dataset.dtype.kind in "iuf":
        return [Item(name=name, values=values, attributes=own)]
    if kind == "char":
        attributes[name] = "".join(map(chr, np.ravel(values)))
    elif kind is None:
        attributes[name] = [plain(text) for text in np.ravel(values)[:MOST_SERIES].tolist()]
    elif values.size == 1:
        attributes[name] = plain(values)
    else:
        return [Item(name=name, values=np.squeeze(values.T), attributes=own)]
    return []
