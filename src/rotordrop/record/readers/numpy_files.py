"""NPY and NPZ, the files of numpy; nothing in them is ever unpickled."""

from __future__ import annotations

import zipfile
from pathlib import Path
from tokenize import TokenError
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.readers.matlab import recording_of_variables
from rotordrop.record.recording import Recording
from rotordrop.record.sandbox import plain, refuse_bomb

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile


def read_npy(path: Path, profile: Profile) -> Recording:
    """Read one array: with named fields, or a matrix whose columns the profile names (``text.names``).

    The clock is a field ``t`` or ``time``, or in the profile (``time.step``).
    """
    with path.open("rb") as stream:
        array = _array(stream, path.stat().st_size, path.name, path)
    if array.dtype.names:
        variables = {name: np.ascontiguousarray(array[name]) for name in array.dtype.names}
    elif array.ndim == 2 and profile.text.names is not None:
        array = array if array.shape[1] == len(profile.text.names) else array.T
        if array.shape[1] != len(profile.text.names):
            raise RecordError(
                f"{path} holds {array.shape} and the profile names {len(profile.text.names)} columns"
            )
        variables = {name: array[:, i] for i, name in enumerate(profile.text.names)}
    else:
        raise RecordError(
            f"{path} holds an array {array.shape} whose columns have no names; name them in the profile, "
            'text.names = ["t", …], or save with numpy.savez(path, t=t, S_NDE_A=…)'
        )
    return recording_of_variables(variables, path, profile)


def read_npz(path: Path, profile: Profile) -> Recording:
    """Read named arrays: a clock ``t`` or ``fs`` and ``t0``, and the channels under their names."""
    variables: dict[str, Any] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            refuse_bomb(sum(entry.file_size for entry in entries) // 8, path.stat().st_size, path)
            for entry in entries:
                with archive.open(entry) as stream:
                    array = _array(stream, entry.file_size, entry.filename, path)
                variables[entry.filename.removesuffix(".npy")] = array if array.size > 1 else plain(array)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, OSError, RuntimeError) as error:
        raise RecordError(f"{path} is no intact NPZ file ({error}); copy or save it again") from error
    return recording_of_variables(variables, path, profile)


def _array(stream: IO[bytes], size: int, name: str, path: Path) -> np.ndarray[Any, Any]:
    """Read an array after comparing the size its head declares with what is there."""
    try:
        version = np.lib.format.read_magic(stream)
        read = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, columns_first, kind = read(stream)
        count = int(np.prod(shape, dtype=object))
        declared, present = count * kind.itemsize, size - stream.tell()
        if kind.hasobject or kind.itemsize == 0:
            raise RecordError(f"{path}: {name} holds Python objects, which are not unpacked; save numbers")
        if declared != present:
            raise RecordError(
                f"{path}: {name} declares {declared} bytes and {present} are present; the file is truncated "
                "or damaged, copy it again"
            )
        values = np.frombuffer(stream.read(declared), dtype=kind)
        return values.reshape(shape, order="F" if columns_first else "C")
    except (ValueError, TypeError, SyntaxError, TokenError, OverflowError, EOFError) as error:
        raise RecordError(f"{path}: {name} is no intact NPY array ({error}); save it again") from error
