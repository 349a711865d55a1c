"""Samples out of binary files, read by foreign libraries in a process of their own.

Libraries that read HDF5, MAT, TDMS and Excel files end the interpreter, loop for ever or ask for all memory
when a file is damaged in the wrong place. So one child process per file reads it, under limits on time and
memory that grow with the size of the file, and hands the stored samples back in a file without a name. It
imports numpy, the one library and nothing else that is heavy.
"""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.child import child_command, limit
from rotordrop.errors import RecordError
from rotordrop.one_thread import ENVIRONMENT
from rotordrop.record.recording import damaged

CPU_S, CPU_S_PER_BYTE, PATIENCE = 4.0, 5e-7, 5.0
"""Processor time that any file may take [s], what a byte of it adds, and wall time over processor time that a
busy computer may need (chosen): two megabytes per second are slow for every format."""

MEMORY, MEMORY_PER_BYTE = 320 * 2**20, 16
"""Memory that any file may take [byte], and what a byte of it adds (chosen): packed ones unpack 6-fold."""

UNPACKED, UNPACKED_PER_BYTE = 64 * 2**20, 200
"""Samples of a file may fill this much [byte], or so many times the file (chosen)."""

MOST_SERIES = 2000
"""Series that a recording may hold (chosen): no recorder has as many channels."""


@dataclass(frozen=True, kw_only=True)
class Item:
    """An array of a file with what the file says about it."""

    name: str
    """Path or name in the file."""
    values: NDArray[Any]
    """Samples as stored."""
    attributes: Mapping[str, Any]
    """Texts, numbers and lists of them."""


@dataclass(frozen=True, kw_only=True)
class Content:
    """What a file holds: its arrays in their order, and its own attributes."""

    items: tuple[Item, ...]
    attributes: Mapping[str, Any]


def unpack(path: Path, kind: str) -> Content:
    """Read a file in a child process by `unpacked` of the module `kind` of `rotordrop.record.readers`."""
    import subprocess
    from tempfile import TemporaryFile

    size = path.stat().st_size
    cpu = CPU_S + CPU_S_PER_BYTE * size
    order = {"path": str(path), "kind": kind, "cpu_s": cpu, "memory": MEMORY + MEMORY_PER_BYTE * size}
    with TemporaryFile() as answer:  # of a pipe all would be in memory twice, and lie there in pieces
        try:
            done = subprocess.run(
                child_command(__name__, "child", order),
                stdin=subprocess.DEVNULL,
                stdout=answer,
                stderr=subprocess.DEVNULL,
                timeout=PATIENCE * cpu,
                env=os.environ | ENVIRONMENT | {"HDF5_USE_FILE_LOCKING": "FALSE"},
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise _too_long(path, PATIENCE * cpu) from None
        code = done.returncode
        if os.name == "posix" and code in (-signal.SIGXCPU, -signal.SIGKILL):
            raise _too_long(path, cpu)
        if code != 0:
            what = f"signal {-code}" if code < 0 else f"code {code}"
            raise damaged(path, f" cannot be read: the library for this format was ended by {what}")
        answer.seek(0)
        return _content(answer, path)


def _too_long(path: Path, limit: float) -> RecordError:
    words = f" cannot be read within {limit:.0f} s, a sound file of its size is read in less than one"
    return damaged(path, words)


def _content(answer: IO[bytes], path: Path) -> Content:
    """What the child wrote: a head in JSON on one line, then the samples of every array."""
    head = json.loads(answer.readline())
    if "refused" in head:
        raise RecordError(head["refused"])
    if "missing" in head:
        lacks = f"{path}: reading {path.suffix} files needs the package {head['missing']}"
        raise RecordError(f"{lacks}; install it with pip install 'rotordrop[io]'")
    items = []
    for entry in head["items"]:
        kind, shape = np.dtype(entry["dtype"]), tuple(entry["shape"])
        samples = answer.read(int(np.prod(shape, dtype=np.int64)) * kind.itemsize)
        values = np.frombuffer(samples, dtype=kind).reshape(shape)
        items.append(Item(name=entry["name"], values=values, attributes=entry["attributes"]))
    return Content(items=tuple(items), attributes=head["attributes"])


def child(order: dict[str, Any]) -> None:
    """In the child: set its limits, read one file, write what it holds, or why not, to standard output."""
    answer = os.dup(1)
    os.dup2(2, 1)  # what a library prints must not land among the samples
    limit(order["memory"], round(order["cpu_s"]))
    path, arrays = Path(order["path"]), []
    try:
        content = import_module(f"rotordrop.record.readers.{order['kind']}").unpacked(path)
        if len(content.items) > MOST_SERIES:
            words = f"{path} holds {len(content.items)} series, a recording at most {MOST_SERIES}"
            raise RecordError(f"{words}; export the channels that are needed")
        arrays = [np.ascontiguousarray(item.values) for item in content.items]
        head: dict[str, Any] = {
            "attributes": dict(content.attributes),
            "items": [
                {"name": i.name, "attributes": dict(i.attributes), "dtype": a.dtype.str, "shape": a.shape}
                for i, a in zip(content.items, arrays, strict=True)
            ],
        }
    except RecordError as error:
        head = {"refused": str(error)}
    except ModuleNotFoundError as error:
        head = {"missing": error.name}
    except MemoryError:
        most = order["memory"] / 1e6
        head, arrays = {"refused": f"{path} needs more than {most:.0f} MB to be read; it is damaged"}, []
    with os.fdopen(answer, "wb") as stream:
        stream.write(json.dumps(head).encode() + b"\n")
        for array in arrays:
            stream.write(array.reshape(-1).data)
        stream.flush()
    os._exit(0)  # libraries that met a damaged file may crash while they clean up


def refuse_bomb(
    samples: int, size: int, what: object, *, most: int = UNPACKED, most_per_byte: int = UNPACKED_PER_BYTE
) -> None:
    """Refuse a file of `size` bytes whose samples of 8 bytes would fill far more memory than a recording's.

    `most` is what any file may hold [byte], `most_per_byte` what it may hold per byte when that is more.
    """
    limit = max(most, most_per_byte * size)
    if 8 * samples > limit:
        words = f"{8 * samples / 1e6:.0f} MB, at most {limit / 1e6:.0f} MB are unpacked from it"
        claims = f"{what} claims {samples} samples in {size} bytes"
        raise RecordError(f"{claims}; it is damaged or made to exhaust memory ({words})")


def plain(value: Any) -> Any:
    """Give an attribute as text, number or list of them, whatever type the library has for it."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        if value.size > 4096:
            return f"{value.size} values"
        return plain(value.item()) if value.size == 1 else [plain(entry) for entry in value.ravel().tolist()]
    if isinstance(value, np.generic):
        return plain(value.item())
    return value if isinstance(value, str | int | float) else str(value)
