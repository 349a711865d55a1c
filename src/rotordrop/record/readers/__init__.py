"""Readers of recordings: one file per format, one function each, found by the suffix of the recording.

A reader is a function ``(path, profile) -> Recording``. A package adds one by an entry point of the group
``rotordrop.readers`` whose name is the suffix (or the ``format`` of a profile), without the point; it takes
precedence over the one supplied here.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import cast

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Recording

Reader = Callable[[Path, Profile], Recording]

GROUP = "rotordrop.readers"

LARGEST = 2**30
"""Largest file that is read [byte]: it is held in memory, as text several times over."""

_DELIMITED = "rotordrop.record.readers.delimited:read_delimited"
_HDF5 = "rotordrop.record.readers.hdf5:read_hdf5"
_COMTRADE = "rotordrop.record.readers.comtrade:read_comtrade"
_UFF = "rotordrop.record.readers.uff:read_uff"
_SUPPLIED = {
    "csv": _DELIMITED,
    "txt": _DELIMITED,
    "tsv": _DELIMITED,
    "asc": _DELIMITED,
    "dat": _DELIMITED,
    "log": _DELIMITED,
    "prn": _DELIMITED,
    "h5": _HDF5,
    "hdf5": _HDF5,
    "mat": "rotordrop.record.readers.matlab:read_matlab",
    "tdms": "rotordrop.record.readers.tdms:read_tdms",
    "uff": _UFF,
    "unv": _UFF,
    "wav": "rotordrop.record.readers.wav:read_wav",
    "npy": "rotordrop.record.readers.numpy_files:read_npy",
    "npz": "rotordrop.record.readers.numpy_files:read_npz",
    "cfg": _COMTRADE,
    "comtrade": _COMTRADE,
    "xlsx": "rotordrop.record.readers.excel:read_excel",
    "xlsm": "rotordrop.record.readers.excel:read_excel",
    "gz": "rotordrop.record.readers.packed:read_gzip",
}


def read_recording(path: Path, profile: Profile) -> Recording:
    """Read a file with the reader its suffix or the profile names.

    Raises
    ------
    RecordError
        When there is no such file or no reader for it.
    """
    try:
        there = path.is_file()
    except OSError as error:
        raise RecordError(f"cannot read the recording {path}: {error.strerror}; check the path") from error
    if not there:
        what = "is a folder" if path.is_dir() else "is no file" if path.exists() else "does not exist"
        raise RecordError(f"the recording {path} {what}; check the path")
    refuse_large(path)
    name = profile.format if profile.format and path.suffix != ".gz" else path.suffix.lstrip(".").lower()
    if name == "dat" and any(path.with_suffix(suffix).is_file() for suffix in (".cfg", ".CFG")):
        name = "comtrade"
    return find_reader(name, path)(path, profile)


def refuse_large(path: Path) -> None:
    """Refuse a file that is too large to be held in memory."""
    size = path.stat().st_size
    if size > LARGEST:
        raise RecordError(
            f"the recording {path} has {size / 1e9:.3g} GB, at most {LARGEST / 1e9:.3g} GB are read; export "
            "the seconds around the drop, or fewer channels"
        )


def find_reader(name: str, path: Path) -> Reader:
    """Find the reader of a format by its name, those of other packages first."""
    added = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name in added:
        return cast(Reader, added[name].load())
    if name in _SUPPLIED:
        module, function = _SUPPLIED[name].split(":")
        return cast(Reader, getattr(import_module(module), function))
    raise RecordError(
        f"{path}: no reader for {name or 'a file without suffix'!r}; known are {', '.join(known_formats())}; "
        "name one as 'format' in the profile"
    )


def known_formats() -> tuple[str, ...]:
    """Name every format that can be read, those of other packages included."""
    return tuple(sorted({*_SUPPLIED, *(entry.name for entry in entry_points(group=GROUP))}))


__all__ = ["GROUP", "Reader", "find_reader", "known_formats", "read_recording", "refuse_large"]
