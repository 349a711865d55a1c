"""MATLAB files: version 5 to 7 by scipy, version 7.3 as the HDF5 it is."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.recording import Channel, Recording, known_unit, listed, spelled, split_unit
from rotordrop.record.sandbox import Content, Item, plain, refuse_bomb, unpack

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

_RATES = ("fs", "fs_hz", "samplerate", "sampling_rate")
_STEPS = ("dt", "dt_s", "step")
_STARTS = ("t0", "t0_s", "start")
_TIMES = ("t", "time", "time_s")
_NAMES = ("name", "label", "channel")
_UNITS = ("unit", "units")

_TESTLAB = ".y_values.values"
"""Where a structure of Simcenter Testlab holds its samples."""

_HEADER = 128
_COMPRESSED = 15
"""Bytes before the first variable, and the type of a packed one, by the definition of version 5."""


def read_matlab(path: Path, profile: Profile) -> Recording:
    """Read a MAT file: channels as vectors, or as the columns of a matrix beside a list of names.

    The clock comes from a vector ``t`` or ``time`` beside the samples (in the same structure), or from ``fs``
    or ``dt`` and ``t0``. The ending of a variable name gives the unit: ``disp_um``. A structure of its own
    for every channel may hold its ``name`` and ``unit``; those of Simcenter Testlab hold several channels.
    """
    content = unpack(path, "matlab")
    found = {item.name: item.values for item in content.items}
    return recording_of_variables({**content.attributes, **found}, path, profile)


def recording_of_variables(variables: dict[str, Any], path: Path, profile: Profile) -> Recording:
    """Make a recording of named arrays, numbers, texts and lists of texts."""
    lists = (value for value in variables.values() if isinstance(value, list) and value)
    texts = next((value for value in lists if all(isinstance(entry, str) for entry in value)), [])
    names = [entry.strip() for entry in texts]
    channels: list[Channel] = []
    for key, value in variables.items():
        last = key.rpartition(".")[2]
        if key.endswith(_TESTLAB):
            channels += _testlab_channels(key.removesuffix(_TESTLAB), value, profile, variables, path)
        elif _is_samples(value) and last.lower() not in _TIMES and last != profile.time.channel:
            channels += _channels_of(key, value, names, profile, variables)
    if not channels:
        raise RecordError(
            f"{path}: found no samples with a clock among {listed(variables) or 'no variables'}; a vector "
            "'t', or 'fs' and 't0', must stand beside the channels, or time.step in the profile"
        )
    entries = {key: str(value) for key, value in variables.items() if isinstance(value, str | int | float)}
    return Recording(channels=tuple(channels), metadata=entries)


def _testlab_channels(
    signal: str, value: Any, profile: Profile, variables: dict[str, Any], path: Path
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
        raise RecordError(
            f"{path}: {signal} declares {declared:.0f} samples and {len(table)} are present; export it again"
        )
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


def _is_samples(value: Any) -> bool:
    array = isinstance(value, np.ndarray) and value.dtype.kind in "iuf"
    return array and value.ndim in (1, 2) and value.size > 1


def _channels_of(
    key: str, value: Any, names: list[str], profile: Profile, variables: dict[str, Any]
) -> list[Channel]:
    """Make channels of a vector, or of a matrix whose columns (or rows) are named."""
    folder, _, last = key.rpartition(".")
    name, _, unit = split_unit(last)
    unit = unit or known_unit(last) or ""
    matrix = np.asarray(value, dtype=np.float64)
    if matrix.ndim == 1:

        def beside(entries: tuple[str, ...]) -> str:
            """The first text of these names in the structure of the channel."""
            values = [variables.get(f"{folder}.{entry}") for entry in entries] if folder else []
            return next((text for text in values if isinstance(text, str) and text), "")

        labels, matrix = [key], matrix[:, None]
        shown = [beside(_NAMES) or (name if not known_unit(last) else key.partition(".")[0])]
        unit = unit or spelled(beside(_UNITS))
    else:
        if matrix.shape[1] != len(names) and matrix.shape[0] == len(names):
            matrix = matrix.T
        if matrix.shape[1] != len(names):
            return []
        labels = shown = names
    time = _clock(variables, folder, len(matrix), profile)
    if time is None:
        return []
    return [
        profile.channel(n, unit, matrix[:, i].copy(), time, label=t)
        for i, (n, t) in enumerate(zip(shown, labels, strict=True))
    ]


def _clock(variables: dict[str, Any], folder: str, count: int, profile: Profile) -> Array | None:
    """Find the clock of samples: in the profile, in the same structure, then at the top of the file."""
    from rotordrop.units import parse_quantity

    def stored(name: str) -> Any:
        """The variable of a name, in any case."""
        pattern = re.compile(re.escape(name), re.IGNORECASE)
        return next((value for key, value in variables.items() if pattern.fullmatch(key)), None)

    index = np.arange(count, dtype=np.float64)
    if profile.time.step is not None:
        first = parse_quantity(profile.time.start or "0 s", "time")
        return first + parse_quantity(profile.time.step, "time") * index
    times = _TIMES if profile.time.channel is None else (profile.time.channel,)
    for prefix in dict.fromkeys((f"{folder}." if folder else "", "")):
        for name in times:
            value = stored(prefix + name)
            if isinstance(value, np.ndarray) and value.shape == (count,):
                return np.asarray(value, dtype=np.float64)
        rate, step, start = (
            next(
                (float(v) for n in names if isinstance(v := stored(prefix + n), int | float | np.number)),
                None,
            )
            for names in (_RATES, _STEPS, _STARTS)
        )
        step = step or (1.0 / rate if rate else None)
        if step:
            return (start or 0.0) + step * index
    return None


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

    try:
        found = loadmat(path, struct_as_record=False, squeeze_me=True, chars_as_strings=True)
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a MAT file: {error}; export it again") from error
    variables = _flatten({key: value for key, value in found.items() if not key.startswith("__")})
    items = {key: value for key, value in variables.items() if _is_samples(value)}
    refuse_bomb(sum(value.size for value in items.values()), len(content), path)
    return Content(
        items=tuple(Item(name=key, values=value, attributes={}) for key, value in items.items()),
        attributes={
            key: [str(entry).strip() for entry in value if isinstance(entry, str)]
            if isinstance(value, np.ndarray) and value.dtype.kind in "OU" and value.ndim == 1
            else plain(value)
            for key, value in variables.items()
            if key not in items
        },
    )


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
        declared = struct.unpack(f"{order}II", unpacker.decompress(packed, 8))[1]
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
