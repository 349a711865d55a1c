"""Readers of recordings: one file per format, one function each, found by the suffix of the recording.

A reader is a function ``(path, profile) -> Recording``; it raises `RecordError` where a file is damaged, cut
off or not of its format. A package adds one by an entry point of the group ``rotordrop.readers`` whose name
is the suffix (or the ``format`` of a profile), without the point; it takes precedence over the one supplied
here.
"""

from __future__ import annotations

import gzip
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

from rotordrop.errors import RecordError
from rotordrop.record.recording import Recording, of_polar
from rotordrop.record.sandbox import refuse_bomb

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile

Reader: TypeAlias = "Callable[[Path, Profile], Recording]"

GROUP = "rotordrop.readers"

LARGEST = 2**30
"""Largest file that is read [byte] (chosen): it is held in memory, as text several times over."""

_TEXT = "delimited:read_delimited"
_FORMATS = {
    "csv txt tsv asc dat log prn tab xls": _TEXT,
    "lvm": "lvm:read_lvm",
    "h5 hdf5": "hdf5:read_hdf5",
    "mat": "matlab:read_matlab",
    "tdms": "tdms:read_tdms",
    "uff unv": "uff:read_uff",
    "wav": "wav:read_wav",
    "npy": "numpy_files:read_npy",
    "npz": "numpy_files:read_npz",
    "cfg cff comtrade": "comtrade:read_comtrade",
    "xlsx xlsm": "excel:read_excel",
}
"""Names of a format and where its reader is: a module is loaded when a file asks for it."""

_SUPPLIED = {name: place for names, place in _FORMATS.items() for name in names.split()}

_BEGINS = {
    b"\x89HDF": "h5", b"MATLAB": "mat", b"TDSm": "tdms", b"RIFF": "wav", b"\x93NUMPY": "npy",
    b"|CF,": "imc FAMOS", b"DIAEXT": "DIAdem", b"DIADEM": "DIAdem", b"MDF ": "ASAM MDF", b"PAR1": "Parquet",
    b"ARROW1": "Feather", b"FEA1": "Feather", b"PK\x03\x04": "ZIP", b"\xd0\xcf\x11\xe0": "old Excel (.xls)",
    b"%PDF": "PDF", b"<?xml": "XML (TDM)", b"DATASET ": "DADiSP", b"IGOR": "Igor text", b"SQLite": "SQLite",
}  # fmt: skip
"""How files begin whose suffix does not tell what they are: formats that are read, and others by name."""

_UNPACKED, _UNPACKED_PER_BYTE = 32 * 2**20, 16
"""Bytes that any file packed by gzip may hold, or so many times its own (chosen): noisy readings pack three
to six times, and a text takes eight times its bytes to be read."""


def read_recording(path: Path, profile: Profile) -> Recording:
    """Read a file with the reader its suffix or the profile names."""
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
    return of_polar(find_reader(name, path)(path, profile), path)


def refuse_large(path: Path) -> None:
    """Refuse a file that is too large to be held in memory."""
    size = path.stat().st_size
    if size > LARGEST:
        words = f"the recording {path} has {size / 1e9:.3g} GB, at most {LARGEST / 1e9:.3g} GB are read"
        raise RecordError(f"{words}; export the seconds around the drop, or fewer channels")


def find_reader(name: str, path: Path) -> Reader:
    """Find the reader of a format by its name, those of other packages first."""
    added = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name in added:
        return cast("Reader", added[name].load())
    if name == "gz":
        return read_gzip
    if _SUPPLIED.get(name, _TEXT) == _TEXT:
        with path.open("rb") as stream:
            begin = stream.read(8)
        inside = next((kind for sign, kind in _BEGINS.items() if begin.startswith(sign)), name)
        if inside == "ZIP":  # a workbook by another name
            with suppress(zipfile.BadZipFile), zipfile.ZipFile(path) as archive:
                inside = "xlsx" if "xl/workbook.xml" in archive.namelist() else inside
        if inside != name and inside not in _SUPPLIED:
            ask = (
                "unpack it and give the file inside"
                if inside == "ZIP"
                else "export it as text, MAT, TDMS, HDF5"
            )
            words = f"which is not read; {ask}" + " or universal file" * (inside != "ZIP")
            raise RecordError(f"{path} is a file of the format {inside}, {words}")
        name = inside
    if name in _SUPPLIED:
        module, function = _SUPPLIED[name].split(":")
        return cast("Reader", getattr(import_module(f"rotordrop.record.readers.{module}"), function))
    words = f"no reader for {name or 'a file without suffix'!r}; known are {', '.join(known_formats())}"
    raise RecordError(f"{path}: {words}; name one as 'format' in the profile")


def known_formats() -> tuple[str, ...]:
    """Name every format that can be read, those of other packages included."""
    return tuple(sorted({*_SUPPLIED, "gz", *(entry.name for entry in entry_points(group=GROUP))}))


def read_gzip(path: Path, profile: Profile) -> Recording:
    """Read ``drop.csv.gz`` and the like: unpacked within bounds, then by the reader of what is inside."""
    size, written = path.stat().st_size, 0
    with tempfile.TemporaryDirectory() as folder:
        inside = Path(folder) / path.stem
        try:
            with gzip.open(path, "rb") as packed, inside.open("wb") as stream:
                while block := packed.read(2**20):
                    written += len(block)
                    refuse_bomb(written // 8, size, path, most=_UNPACKED, most_per_byte=_UNPACKED_PER_BYTE)
                    stream.write(block)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise RecordError(f"{path} cannot be unpacked: {error}; copy it again") from error
        try:
            return read_recording(inside, profile)
        except RecordError as error:
            raise RecordError(str(error).replace(str(inside), str(path))) from error
