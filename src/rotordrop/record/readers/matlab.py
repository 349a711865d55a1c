"""MATLAB files: version 5 to 7 by scipy, version 7.3 as the HDF5 it is."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.keys import kind_of
from rotordrop.record.recording import Channel, Recording, damaged, known_unit
from rotordrop.record.sandbox import Content, Item, plain, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_TESTLAB = ".y_values.values"
"""Where a structure of Simcenter Testlab holds its samples."""

_HEADER = 128
_COMPRESSED = 15
"""Bytes before the first variable, and the type of a packed one, by the definition of version 5."""


def read_matlab(path: Path, profile: Profile) -> Recording:
    """Read a MAT file: channels as vectors, or as the columns of a matrix beside a list of names.

    The clock comes from ``t`` or ``time`` beside the samples, or from ``fs`` or ``dt`` and ``t0``; the ending
    of a name gives the unit, ``disp_um``. A structure for every channel may hold its ``name`` and ``unit``.
    """
    from rotordrop.record.readers.variables import recording_of

    content = unpack(path, "matlab")
    found = [
        channel
        for item in content.items
        if item.name.endswith(_TESTLAB)
        for channel in _testlab_channels(
            item.name.removesuffix(_TESTLAB), item.values, profile, content.attributes, path
        )
    ]
    counted = {  # from 1, as MATLAB does
        key: value - 1
        for key, value in content.attributes.items()
        if isinstance(value, float | int)
        and kind_of(key.rpartition(".")[2]) == "trigger"
        and "pre" not in key.lower()
    }
    rest = tuple(item for item in content.items if not item.name.endswith(_TESTLAB))
    content = Content(items=rest, attributes={**content.attributes, **counted})
    return recording_of(content, path, profile, ".", found=found)


def _testlab_channels(
    signal: str, value: Any, profile: Profile, variables: Mapping[str, Any], path: Path
) -> list[Channel]:
    """Channels of a structure of Simcenter Testlab: samples (N,) or (N, C) of one rate, in SI units.

    They are stored in SI units; times its factor they are in the unit of the label that users see.
    """

    def found(name: str, default: Any = None) -> Any:
        return variables.get(f"{signal}.{name}", default)

    step, start = found("x_values.increment"), found("x_values.start_value", 0.0)
    declared = found("x_values.number_of_values")
    if not isinstance(step, int | float) or not step > 0 or not isinstance(start, int | float):
        raise RecordError(f"{path}: {signal} has the increment {step!r}; a time signal has a positive one")
    abscissa = str(found("x_values.quantity.label", "s"))
    if known_unit(abscissa) != "s":
        return []  # a spectrum
    table = np.asarray(value, dtype=np.float64).reshape(len(value), -1)
    if isinstance(declared, int | float) and len(table) != declared:
        raise damaged(path, f": {signal} declares {declared:.0f} samples and {len(table)} are present")
    unit = str(found("y_values.quantity.label", "")).strip()
    factor = found("y_values.quantity.unit_transformation.factor", 1.0)
    offset = found("y_values.quantity.unit_transformation.offset", 0.0)
    names = found("function_record.name", signal)
    names = [str(name).strip() for name in (names if isinstance(names, list) else [names])]
    if len(names) != table.shape[1]:
        names = [f"{names[0] if len(names) == 1 else signal} ({k + 1})" for k in range(table.shape[1])]
    time = start + step * np.arange(len(table), dtype=np.float64)
    return [
        profile.channel(name, unit, table[:, i] * float(factor) + float(offset), time)
        for i, name in enumerate(names)
    ]


def unpacked(path: Path) -> Content:
    """In the child: all variables, structures taken apart to dotted names; texts, numbers as attributes."""
    content = path.read_bytes()
    if b"MATLAB 7.3" in content[:_HEADER] or content[:8] == b"\x89HDF\r\n\x1a\n":
        from rotordrop.record.readers import hdf5

        inside = hdf5.unpacked(path)
        return Content(
            items=tuple(
                Item(name=item.name.replace("/", "."), values=item.values, attributes=item.attributes)
                for item in inside.items
            ),
            attributes={name.replace("/", "."): value for name, value in inside.attributes.items()},
        )
    _check_lengths(content, path)
    from scipy.io.matlab import loadmat

    from rotordrop.record.readers.variables import is_samples

    try:
        found = loadmat(path, struct_as_record=False, squeeze_me=True, chars_as_strings=True)
    except Exception as error:
        raise damaged(path, f" cannot be read as a MAT file: {error}") from error
    variables = _flatten({key: value for key, value in found.items() if not key.startswith("__")})
    items = {key: value for key, value in variables.items() if is_samples(value)}
    refuse_bomb(sum(value.size for value in items.values()), len(content), path)
    return Content(
        items=tuple(Item(name=key, values=value, attributes={}) for key, value in items.items()),
        attributes={str(key): _told(value) for key, value in variables.items() if key not in items},
    )


def _told(value: Any) -> Any:
    """What a variable says that holds no samples."""
    if isinstance(value, np.void) or (isinstance(value, np.ndarray) and value.dtype.names):
        opaque = np.ravel(value)[0]  # scipy leaves tables and dates as their parts: name, kind, class
        return f"MATLAB {opaque['s2'].decode() if 's2' in (value.dtype.names or ()) else 'object'}"
    if isinstance(value, np.ndarray) and value.dtype.kind in "OU" and value.ndim == 1:
        return [str(entry).strip() for entry in value if isinstance(entry, str)]
    return plain(value)


def _flatten(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Give every variable by its dotted path, structures and lists of them taken apart."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        listed = isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind == "O" and len(value)
        if hasattr(value, "_fieldnames"):
            fields = {name: getattr(value, name) for name in value._fieldnames}
            flat |= _flatten(fields, f"{prefix}{key}.")
        elif listed and all(hasattr(entry, "_fieldnames") for entry in value):
            for number, entry in enumerate(value, start=1):
                flat |= _flatten({f"{key}({number})": entry}, prefix)
        else:
            single = isinstance(value, np.ndarray) and value.ndim == 0
            flat[f"{prefix}{key}"] = value.item() if single else value
    return flat


def _check_lengths(content: bytes, path: Path) -> None:
    """Compare the declared length of every variable with what is present."""
    if content[:6] != b"MATLAB" and content[:4] != b"MATL":
        raise RecordError(f"{path} does not begin with 'MATLAB'; it is no MAT file")
    order = "<" if content[126:128] == b"IM" else ">"
    at = _HEADER
    while at < len(content):
        if at + 8 > len(content):
            raise damaged(path, f" is truncated: it ends within a header at byte {at} of {len(content)}")
        kind, length = struct.unpack_from(f"{order}II", content, at)
        present = len(content) - at - 8
        if length > present:
            declared = f"a variable at byte {at} declares {length} bytes and {present} are present"
            raise damaged(path, f" is truncated: {declared}")
        if kind == _COMPRESSED:
            _check_packed(content[at + 8 : at + 8 + length], order, at, path)
        at += 8 + length
        at += 0 if kind == _COMPRESSED else -at % 8


def _check_packed(packed: bytes, order: str, at: int, path: Path) -> None:
    """Unpack a variable within bounds; zlib compares its checksum on the way."""
    unpacker, place = zlib.decompressobj(), f"{path}: the variable at byte {at}"
    try:
        declared = struct.unpack(f"{order}II", unpacker.decompress(packed, 8))[1]
        refuse_bomb(declared // 8, path.stat().st_size, path)
        present = 0
        while not unpacker.eof and present <= declared:
            block = unpacker.decompress(unpacker.unconsumed_tail, 2**22)
            present += len(block)
            if not block:
                break
    except (zlib.error, struct.error) as error:
        raise damaged(place, f" cannot be unpacked ({error})") from error
    if present != declared or not unpacker.eof:
        raise damaged(place, f" declares {declared} bytes and unpacks to {present}")
