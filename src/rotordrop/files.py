"""Files appear complete or not at all: written beside their place, synced, then renamed.

A device, a pipe or a link that stands at the place is kept: what was written goes through it.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shutil
import stat
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from rotordrop.errors import DamagedFileError, OutputError

_LONGEST_STEM = 40
"""Characters of a file name that its temporary name keeps: file systems end names at 255 bytes."""

_PART = re.compile(r"\.(?P<stem>.*)\.(?P<system>[0-9a-f]{8})-(?P<process>\d+)-[0-9a-f]{8}\.part(\..*)?")


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path to write to; it takes the place of `path` when the block ends well.

    When the block is left by an exception, Ctrl-C included, the temporary file is removed and whatever stood
    at `path` before stands there still. A symbolic link stays one and its target is replaced; what is written
    for a device or a pipe is copied into it; a file that is replaced hands on its permissions. What killed
    runs of this computer left behind for the same place is removed.

    Parameters
    ----------
    path : path-like
        Where the finished file shall stand. Its folder must exist.

    Yields
    ------
    Path
        Temporary path in the same folder, with the same suffix (elsewhere for a device or a pipe).
    """
    require_place(path)
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        with _through(target) as temporary:
            yield temporary
        return
    clear_after_killed_runs(target.parent, target.stem[:_LONGEST_STEM])
    temporary = _temporary_beside(target)
    try:
        yield temporary
        if not temporary.exists():
            raise OutputError(f"nothing was written for {target}")
        _sync(temporary)
        _keep_permissions(target, temporary)
        temporary.replace(target)
    except OSError as error:
        if error.filename not in (None, str(temporary), temporary):
            raise
        raise _cannot_write(target, error) from error
    finally:
        with suppress(OSError):  # a disk that has become read-only must not hide what went wrong
            temporary.unlink(missing_ok=True)
    if os.name == "posix":  # the rename itself is durable where the system allows to sync a folder
        _sync(target.parent)


@contextmanager
def _through(target: Path) -> Iterator[Path]:
    """Write for a device or a pipe: collected in a temporary file first, then copied into it."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / target.name
        yield temporary
        try:
            with temporary.open("rb") as content, target.open("wb") as stream:
                shutil.copyfileobj(content, stream)
        except OSError as error:
            raise _cannot_write(target, error) from error


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """Give a new folder to fill; it stands at `path` when the block ends well, and nowhere otherwise."""
    temporary = _temporary_beside(path)
    temporary.mkdir()
    try:
        yield temporary
        temporary.rename(path)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _temporary_beside(target: Path) -> Path:
    stem = target.stem[:_LONGEST_STEM]
    mark = f"{_system()}-{os.getpid()}-{os.urandom(4).hex()}"
    return target.with_name(f".{stem}.{mark}.part{target.suffix[:_LONGEST_STEM]}")


@lru_cache(maxsize=1)
def _system() -> str:
    """Mark of the computer and of the process numbers that count on it (a container has its own)."""
    import platform

    marks = [platform.node()]
    with suppress(OSError):
        marks.append(Path("/etc/machine-id").read_text(encoding="ascii").strip())
    with suppress(OSError):
        marks.append(str(os.stat("/proc/self/ns/pid").st_ino))  # noqa: PTH116 - pathlib follows no such link
    return f"{zlib.crc32('/'.join(marks).encode()):08x}"


def clear_after_killed_runs(folder: Path, stem: str | None = None) -> None:
    """Remove what processes of this computer that no longer run left half written, of one stem or all."""
    if os.name != "posix":
        return  # elsewhere there is no harmless way to ask whether a process runs
    with suppress(OSError):
        for name in os.listdir(folder):  # noqa: PTH208 - names are matched before paths are made
            left = _PART.fullmatch(name)
            if left and left["system"] == _system() and not process_runs(int(left["process"])):
                if stem is None and (folder / name).is_dir():
                    shutil.rmtree(folder / name, ignore_errors=True)
                elif stem in (None, left["stem"]):
                    (folder / name).unlink(missing_ok=True)


def process_runs(process: int) -> bool:
    """Whether a process of this computer runs; on POSIX systems only."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def _keep_permissions(target: Path, temporary: Path) -> None:
    """Give the new file mode, and where allowed owner and group, of the one it replaces."""
    with suppress(OSError):
        old = target.stat()
        if (old.st_uid, old.st_gid) != (temporary.stat().st_uid, temporary.stat().st_gid):
            with suppress(OSError):
                os.chown(temporary, old.st_uid, old.st_gid)
        temporary.chmod(stat.S_IMODE(old.st_mode))


def _cannot_write(target: Path, error: OSError) -> OutputError:
    return OutputError(f"cannot write {target}: {error.strerror or error}; choose another place")


@contextmanager
def new_hdf5(path: str | os.PathLike[str], *, track_order: bool = False) -> Iterator[Any]:
    """Give an empty HDF5 file (``h5py.File``) that appears at `path`, complete or not at all.

    It is put together in memory: a disk that becomes full while the HDF5 library writes leaves it in a state
    that ends the interpreter. Behind the file, where the library does not look, stands the digest of all its
    bytes; ``sealed`` in its attributes says so.
    """
    import h5py

    with atomic_path(path) as temporary:
        memory = {"driver": "core", "backing_store": False}
        with h5py.File(temporary.name, "w", track_order=track_order, **memory) as file:
            file.attrs[HDF5_SEALED] = "the last 32 bytes are the SHA-256 of all but the last 48"
            yield file
            file.flush()
            image = file.id.get_file_image()
        with temporary.open("wb") as stream:
            stream.write(image)
            stream.write(_HDF5_MARK + hashlib.sha256(image).digest())


@contextmanager
def read_hdf5(path: Path, remedy: str) -> Iterator[Any]:
    """Open an HDF5 file (``h5py.File``) of `new_hdf5`; one that is not what was written is refused."""
    import h5py

    sealed = hdf5_is_sealed(path, remedy)
    with h5py.File(path, "r") as file:
        if not sealed:  # the library cuts off what stands behind a file that it opens for writing
            raise DamagedFileError(
                f"{path} is no file of rotordrop, or was changed after rotordrop wrote it; {remedy}"
            )
        yield file


def hdf5_is_sealed(path: Path, remedy: str) -> bool:
    """Whether a digest stands behind an HDF5 file; a file that it is not the digest of is refused."""
    require_file(path, remedy)
    if (holds := _hdf5_seal(path, *_state_of(path))) is False:
        raise DamagedFileError(f"{path} is damaged: it is not what rotordrop wrote; {remedy}")
    return bool(holds)


HDF5_SEALED = "sealed"
"""Attribute of an HDF5 file with a digest behind it."""
_HDF5_MARK = b"rotordrop sha256"


@lru_cache(maxsize=4096)
def _hdf5_seal(path: Path, *state: int) -> bool | None:
    """Whether the digest behind an HDF5 file is that of the file; None where there is none."""
    length = len(_HDF5_MARK) + hashlib.sha256().digest_size
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        left = stream.seek(0, os.SEEK_END) - length
        stream.seek(max(left, 0))
        if not (seal := stream.read()).startswith(_HDF5_MARK):
            return None
        stream.seek(0)
        while left > 0:
            part = stream.read(min(left, 2**20))
            digest.update(part)
            left -= len(part) or left
    return seal == _HDF5_MARK + digest.digest()


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, complete or not at all.

    What is no character, as in file names of another encoding, becomes a question mark.
    """
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="replace", newline="\n")


def write_json(path: str | os.PathLike[str], content: Any, *, sealed: bool = False) -> None:
    """Write a JSON file in UTF-8, complete or not at all.

    Numbers that JSON cannot hold (NaN, infinity) are refused before anything is written. A sealed table ends
    with the digest of its values, for `read_sealed`.
    """
    try:
        whole = with_digest(content) if sealed else content
        text = json.dumps(whole, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    except (TypeError, ValueError) as error:
        raise OutputError(f"cannot write {path} as JSON: {error}") from error
    write_text(path, text)


def finite(content: Any) -> Any:
    """The same content with nothing in place of what is not finite, which JSON cannot hold."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, tuple | list):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def with_digest(content: Mapping[str, Any]) -> dict[str, Any]:
    """A table for JSON with the digest of its values as its last member, in place of one that it has."""
    values = _values(content)
    return {**values, DIGEST: digest_of_values(values)}


def without_digest(content: Mapping[str, Any], place: str, remedy: str) -> dict[str, Any]:
    """A table as it was before `with_digest`; one that holds other values is refused with the way out."""
    values = _values(content)
    if content.get(DIGEST) != digest_of_values(values):
        raise DamagedFileError(f"{place} is damaged or was changed: it is not what rotordrop wrote; {remedy}")
    return values


def _values(content: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in content.items() if name != DIGEST}


DIGEST = "document_sha256"
"""Member of a table that holds the digest of the others."""


def require_file(path: str | os.PathLike[str], remedy: str) -> None:
    """Refuse what is no file where the program keeps one: a pipe would keep who opens it waiting for ever.

    What stands there may be a folder, a pipe, a socket, a device or a link that leads nowhere; a place where
    nothing stands is none of these.
    """
    if os.path.lexists(path) and not Path(path).is_file():
        raise DamagedFileError(f"{path} is damaged: it is no file; {remedy}")


def clear_of_no_file(path: Path) -> None:
    """Remove what is no file in the place of one that is written anew: a folder, a pipe, a link."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    elif path.is_symlink() or not path.is_file():
        path.unlink(missing_ok=True)


def digest_of_values(content: Mapping[str, Any]) -> str:
    """SHA-256 of what a JSON table says; layout, order and the spelling of numbers do not count."""

    def shortest(number: str) -> float:
        """A whole number as one: other programs write 1 for 1.0."""
        return int(value) if (value := float(number)).is_integer() else value

    text = json.dumps(content, ensure_ascii=False).encode("utf-8", errors="replace")  # as `write_text` does
    plain = json.dumps(json.loads(text, parse_float=shortest), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(plain.encode()).hexdigest()


def read_sealed(path: str | os.PathLike[str], remedy: str) -> dict[str, Any]:
    """Read a sealed JSON table; one that holds other values than were written is refused with the way out."""
    require_file(path, remedy)
    try:
        content = json.loads(Path(path).read_bytes())
    except (ValueError, RecursionError):
        content = None
    return without_digest(content if isinstance(content, dict) else {}, str(path), remedy)


def digest_of_file(path: str | os.PathLike[str]) -> str:
    """SHA-256 of a file."""
    with Path(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest_at(file: Path) -> str:
    """Digest of a file, computed again when the file has changed; empty where there is none."""
    try:
        return _digest(file, *_state_of(file)) if file.is_file() else ""
    except OSError:
        return ""


def _state_of(file: Path) -> tuple[int, ...]:
    """What is another for a file that has changed."""
    now = file.stat()
    return now.st_ino, now.st_size, now.st_mtime_ns, now.st_ctime_ns


@lru_cache(maxsize=4096)
def _digest(file: Path, *state: int) -> str:
    return digest_of_file(file)


def require_place(path: str | os.PathLike[str]) -> None:
    """Refuse a place where no file can be written, before a long computation rather than after it."""
    try:
        target = Path(os.path.realpath(path))
    except (TypeError, ValueError):  # no path, or one with a NUL
        from rotordrop.require import require  # loads numpy, which the first page does without

        require(path, "path", str, os.PathLike)
        raise
    except FileNotFoundError:
        raise OutputError(
            f"cannot write {path}: the folder you are in has been deleted; go to another one"
        ) from None
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        mode = None
    except OSError as error:
        raise _cannot_write(Path(path), error) from error
    if mode is not None and stat.S_ISDIR(mode):
        raise OutputError(f"cannot write {path}: it is a folder; name a file in it")
    if mode is not None and not stat.S_ISREG(mode):
        return
    if not target.parent.is_dir():
        raise OutputError(
            f"cannot write {path}: the folder {Path(path).parent} does not exist; create it first"
        )
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write {path}: the folder {target.parent} is read-only; choose another")


def make_folder(folder: Path) -> None:
    """Make a folder for results, with those above it; one that is there is taken.

    Raises
    ------
    OutputError
        When there can be none.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {error.strerror}; name another one") from error


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)  # Windows syncs what it may write
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
