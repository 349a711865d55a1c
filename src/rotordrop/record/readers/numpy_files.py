"""NPY and NPZ, the files of numpy; nothing in them is ever unpickled."""

from __future__ import annotations

import zipfile
from pathlib import Path
from tokenize import TokenError
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.readers.variables import is_samples, recording_of
from rotordrop.record.recording import Recording, damaged
from rotordrop.record.sandbox import Content, Item, plain, refuse_bomb

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile


def read_npy(path: Path, profile: Profile) -> Recording:
    """Read one array: with named fields, or a matrix whose columns the profile names (``text.names``).

    The clock is a field ``t`` or ``time``, or in the profile (``time.step``).
    """
    with path.open("rb") as stream:
        array = _array(stream, path.stat().st_size, path.name, path)
    names = array.dtype.names or ()
    if not names and (array.ndim != 2 or profile.text.names is None):
        ways = 'in the profile, text.names = ["t", …], or save with numpy.savez(path, t=t, S_NDE_A=…)'
        words = f"an array {array.shape} whose columns have no names"
        raise RecordError(f"{path} holds {words}; name them {ways}")
    return recording_of_arrays({name: array[name] for name in names} or {"array": array}, path, profile)


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
                variables[entry.filename.removesuffix(".npy")] = array
    except (zipfile.BadZipFile, EOFError, NotImplementedError, OSError, RuntimeError) as error:
        raise damaged(path, f" is no intact NPZ file ({error})") from error
    return recording_of_arrays(variables, path, profile)


def recording_of_arrays(arrays: dict[str, Any], path: Path, profile: Profile) -> Recording:
    """Make a recording of named arrays and numbers."""
    series = {name: np.ascontiguousarray(one) for name, one in arrays.items() if is_samples(one)}
    content = Content(
        items=tuple(Item(name=name, values=one, attributes={}) for name, one in series.items()),
        attributes={name: plain(one) for name, one in arrays.items() if name not in series},
    )
    return recording_of(content, path, profile, ".")


def _array(stream: IO[bytes], size: int, name: str, path: Path) -> np.ndarray[Any, Any]:
    """Read an array after comparing the size its head declares with what is there."""
    try:
        version = np.lib.format.read_magic(stream)
        form = np.lib.format
        read = form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0
        shape, columns_first, kind = read(stream)
        count = int(np.prod(shape, dtype=object))
        declared, present = count * kind.itemsize, size - stream.tell()
        if kind.hasobject or kind.itemsize == 0:
            raise RecordError(f"{path}: {name} holds Python objects, which are not unpacked; save numbers")
        if declared != present:
            words = f"{name} declares {declared} bytes and {present} are present"
            raise damaged(path, f": {words}, the file is truncated or damaged")
        values = np.frombuffer(stream.read(declared), dtype=kind)
        return values.reshape(shape, order="F" if columns_first else "C")
    except (ValueError, TypeError, SyntaxError, TokenError, OverflowError, EOFError) as error:
        raise damaged(path, f": {name} is no intact NPY array ({error})") from error
