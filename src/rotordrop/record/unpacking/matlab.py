"""MATLAB files: version 5 to 7 by scipy, version 7.3 as the HDF5 it is."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.unpacking import Content, Item, plain, refuse_bomb

_HEADER = 128
_COMPRESSED = 15


def unpacked(path: Path) -> Content:
    """Read all variables, structures taken apart to dotted names; texts and single numbers as attributes."""
    content = path.read_bytes()
    if b"MATLAB 7.3" in content[:_HEADER] or content[:8] == b"\x89HDF\r\n\x1a\n":
        return _of_version_73(path)
    _check_lengths(content, path)
    from scipy.io.matlab import loadmat

    try:
        found = loadmat(path, struct_as_record=False, squeeze_me=True, chars_as_strings=True)
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a MAT file: {error}; export it again") from error
    variables = _flatten({key: value for key, value in found.items() if not key.startswith("__")})
    items = {key: value for key, value in variables.items() if _is_samples(value)}
    refuse_bomb(sum(value.size for value in items.values()), len(content), path)
    return Content(
        items=tuple(Item(name=key, values=value, attributes={}) for key, value in items.items()),
        attributes={key: _plain(value) for key, value in variables.items() if key not in items},
    )


def _of_version_73(path: Path) -> Content:
    from rotordrop.record.unpacking import hdf5

    content = hdf5.unpacked(path)
    return Content(
        items=tuple(
            Item(name=item.name.replace("/", "."), values=item.values, attributes=item.attributes)
            for item in content.items
        ),
        attributes={name.replace("/", "."): value for name, value in content.attributes.items()},
    )


def _is_samples(value: Any) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype.kind in "iuf"
        and value.ndim in (1, 2)
        and value.size > 1
    )


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.dtype.kind in "OU" and value.ndim == 1:
        return [str(entry).strip() for entry in value if isinstance(entry, str)]
    return plain(value)


def _flatten(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Give every variable by its dotted path, structures and lists of them taken apart."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        if hasattr(value, "_fieldnames"):
            fields = {name: getattr(value, name) for name in value._fieldnames}
            flat |= _flatten(fields, f"{prefix}{key}.")
        elif (
            isinstance(value, np.ndarray)
            and value.ndim == 1
            and value.dtype.kind == "O"
            and _structures(value)
        ):
            for number, entry in enumerate(value, start=1):
                flat |= _flatten({f"{key}({number})": entry}, prefix)
        else:
            flat[f"{prefix}{key}"] = (
                value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
            )
    return flat


def _structures(values: Any) -> bool:
    return len(values) > 0 and all(hasattr(value, "_fieldnames") for value in values)


def _check_lengths(content: bytes, path: Path) -> None:
    """Compare the declared length of every variable with what is present."""
    if content[:6] != b"MATLAB" and content[:4] != b"MATL":
        raise RecordError(f"{path} does not begin with 'MATLAB'; it is no MAT file")
    order = "<" if content[126:128] == b"IM" else ">"
    at = _HEADER
    while at < len(content):
        if at + 8 > len(content):
            raise RecordError(f"{path} is truncated: it ends within a header at byte {at} of {len(content)}")
        kind, length = struct.unpack_from(f"{order}II", content, at)
        if at + 8 + length > len(content):
            raise RecordError(
                f"{path} is truncated: a variable at byte {at} declares {length} bytes and "
                f"{len(content) - at - 8} are present; copy the file again"
            )
        if kind == _COMPRESSED:
            _check_packed(content[at + 8 : at + 8 + length], order, at, path)
        at += 8 + length
        at += 0 if kind == _COMPRESSED else -at % 8


def _check_packed(packed: bytes, order: str, at: int, path: Path) -> None:
    """Unpack a variable within bounds; zlib compares its checksum on the way."""
    unpacker = zlib.decompressobj()
    try:
        head = unpacker.decompress(packed, 8)
        declared = struct.unpack(f"{order}II", head)[1]
        refuse_bomb(declared // 8, path.stat().st_size, path)
        present = 0
        while not unpacker.eof and present <= declared:
            block = unpacker.decompress(unpacker.unconsumed_tail, 2**22)
            present += len(block)
            if not block:
                break
    except (zlib.error, struct.error) as error:
        raise RecordError(
            f"{path}: the variable at byte {at} cannot be unpacked ({error}); copy it again"
        ) from error
    if present != declared or not unpacker.eof:
        raise RecordError(
            f"{path}: the variable at byte {at} declares {declared} bytes and unpacks to {present}; copy it "
            "again"
        )
