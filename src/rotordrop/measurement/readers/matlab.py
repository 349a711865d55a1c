"""MATLAB files up to version 7 (MAT v5)."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.measurement.profile import Profile
from rotordrop.measurement.recording import Array, Channel, Recording, known_unit, split_unit

_HEADER = 128
_COMPRESSED = 15
_LARGEST = 4 * 2**30
_RATES = ("fs", "fs_hz", "samplerate", "sampling_rate")
_STEPS = ("dt", "dt_s", "step")
_STARTS = ("t0", "t0_s", "start")
_TIMES = ("t", "time", "time_s")


def read_matlab(path: Path, profile: Profile) -> Recording:
    """Read a MAT v5 file: channels as vectors, or as the columns of a matrix beside a list of names.

    The clock comes from a vector ``t`` or ``time`` beside the samples (in the same structure), or from ``fs``
    or ``dt`` and ``t0``. The ending of a variable name gives the unit: ``disp_um``.

    Parameters
    ----------
    path : Path
        The file.
    profile : Profile
        Rules that replace guesses.

    Raises
    ------
    RecordError
        When the declared length of a variable is not present in the file, or no channels are found.
    """
    import scipy.io

    _check_lengths(path)
    try:
        content = scipy.io.loadmat(path, struct_as_record=False, squeeze_me=True, chars_as_strings=True)
    except Exception as error:
        raise RecordError(f"{path} cannot be read as a MAT v5 file: {error}; export it again") from error
    variables = _flatten({key: value for key, value in content.items() if not key.startswith("__")})
    names = next((_names(value) for value in variables.values() if _names(value)), [])
    channels: list[Channel] = []
    for key, value in variables.items():
        folder, _, last = key.rpartition(".")
        if _is_samples(value) and last.lower() not in _TIMES:
            channels += _channels_of(key, value, names, lambda n, f=folder: _clock(variables, f, n), profile)
    if not channels:
        raise RecordError(
            f"{path}: found no samples with a clock among {', '.join(variables) or 'no variables'}; a vector "
            "'t', or 'fs' and 't0', must stand beside the channels"
        )
    entries = {key: str(value) for key, value in variables.items() if isinstance(value, str | int | float)}
    return Recording(channels=tuple(channels), metadata=entries)


def _check_lengths(path: Path) -> None:
    """Compare the declared length of every variable with what is present."""
    content = path.read_bytes()
    if content[:6] != b"MATLAB" and content[:4] != b"MATL":
        raise RecordError(f"{path} does not begin with 'MATLAB'; it is no MAT file")
    if b"MATLAB 7.3" in content[:_HEADER]:
        raise RecordError(f"{path} is a MAT file of version 7.3; save it with save(..., '-v7') or as HDF5")
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
        present = 0
        while not unpacker.eof and present <= min(declared, _LARGEST):
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


def _flatten(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Give every variable by its dotted path, structures taken apart."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        if hasattr(value, "_fieldnames"):
            fields = {name: getattr(value, name) for name in value._fieldnames}
            flat |= _flatten(fields, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = (
                value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
            )
    return flat


def _names(value: Any) -> list[str]:
    """Read a cell array or character matrix of names."""
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.size and value.dtype.kind in "OU":
        return [str(item).strip() for item in value if isinstance(item, str)]
    return []


def _is_samples(value: Any) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype.kind in "iuf"
        and value.ndim in (1, 2)
        and value.size > 1
    )


def _channels_of(key: str, value: Any, names: list[str], clock: Any, profile: Profile) -> list[Channel]:
    """Make channels of a vector, or of a matrix whose columns (or rows) are named."""
    last = key.rpartition(".")[2]
    name, _label, unit = split_unit(last)
    unit = unit or known_unit(last) or ""
    matrix = np.asarray(value, dtype=np.float64)
    if matrix.ndim == 1:
        labels, matrix = [key], matrix[:, None]
        shown = [name if not known_unit(last) else key.partition(".")[0]]
    else:
        if matrix.shape[1] != len(names) and matrix.shape[0] == len(names):
            matrix = matrix.T
        if matrix.shape[1] != len(names):
            return []
        labels = shown = names
    time = clock(len(matrix))
    if time is None:
        return []
    return [
        Channel(name=n, label=t, unit=profile.units.get(t, unit), values=matrix[:, i].copy(), time=time)
        for i, (n, t) in enumerate(zip(shown, labels, strict=True))
    ]


def _clock(variables: dict[str, Any], folder: str, count: int) -> Array | None:
    """Find the clock of samples in the same structure, then at the top of the file."""
    for prefix in dict.fromkeys((f"{folder}." if folder else "", "")):
        for name in _TIMES:
            value = _get(variables, prefix, name)
            if isinstance(value, np.ndarray) and value.shape == (count,):
                return np.asarray(value, dtype=np.float64)
        rate = _scalar(variables, prefix, _RATES)
        step = _scalar(variables, prefix, _STEPS) or (1.0 / rate if rate else None)
        if step:
            start = _scalar(variables, prefix, _STARTS) or 0.0
            return start + step * np.arange(count, dtype=np.float64)
    return None


def _get(variables: dict[str, Any], prefix: str, name: str) -> Any:
    pattern = re.compile(re.escape(prefix + name), re.IGNORECASE)
    return next((value for key, value in variables.items() if pattern.fullmatch(key)), None)


def _scalar(variables: dict[str, Any], prefix: str, names: tuple[str, ...]) -> float | None:
    for name in names:
        value = _get(variables, prefix, name)
        if isinstance(value, int | float | np.number):
            return float(value)
    return None
