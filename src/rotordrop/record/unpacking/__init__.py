"""Samples out of binary files, read by foreign libraries in a process of their own.

Libraries that read HDF5, MAT, TDMS, UFF and Excel files end the interpreter, loop for ever or ask for all
memory when a file is damaged in the wrong place. So one child process per file reads it, under limits on time
and memory that grow with the size of the file, and hands the stored samples back over a pipe. The child
imports numpy, the one library and nothing else that is heavy.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import RecordError

CPU_S = 4.0
"""Time on the processor that any file may take [s]."""

CPU_S_PER_BYTE = 5e-7
"""What a byte of the file adds to it [s]: two megabytes per second are slow for every format."""

PATIENCE = 5.0
"""Wall time over processor time that a busy computer may need."""

MEMORY = 320 * 2**20
"""Memory that any file may take [byte]: with the program that waits for it less than 500 MB."""

MEMORY_PER_BYTE = 16

UNPACKED = 64 * 2**20
"""Samples of a file may fill this much [byte] whatever the size of the file, and …"""

UNPACKED_PER_BYTE = 200
"""… this many times the file when it is larger: recordings are not packed more tightly."""


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
    """Read a file in a child process.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Module of this package that reads it: ``"hdf5"``, ``"matlab"``, ``"tdms"``, ``"uff"``, ``"excel"``.

    Raises
    ------
    RecordError
        When the child refuses the file, needs too much time or memory, or is ended by the file.
    """
    import subprocess

    size = path.stat().st_size
    cpu = CPU_S + CPU_S_PER_BYTE * size
    order = {
        "path": str(path),
        "kind": kind,
        "cpu_s": cpu,
        "memory": MEMORY + MEMORY_PER_BYTE * size,
        "sys_path": [entry for entry in sys.path if entry],
    }
    program = (
        "import json, sys; order = json.loads(sys.argv[1]); sys.path[:] = order['sys_path']; "
        "from rotordrop.record.unpacking._child import main; main(order)"
    )
    environment = os.environ | {
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "HDF5_USE_FILE_LOCKING": "FALSE",
    }
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-c", program, json.dumps(order)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=PATIENCE * cpu,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _too_long(path, PATIENCE * cpu) from None
    if done.returncode != 0:
        raise _ended(path, done.returncode, cpu)
    return _content(done.stdout, path)


def _too_long(path: Path, limit: float) -> RecordError:
    return RecordError(
        f"{path} cannot be read within {limit:.0f} s, a sound file of its size is read in less than one; it "
        "is damaged: copy or export it again"
    )


def _ended(path: Path, code: int, cpu: float) -> RecordError:
    if os.name == "posix" and code in (-signal.SIGXCPU, -signal.SIGKILL):
        return _too_long(path, cpu)
    what = f"signal {-code}" if code < 0 else f"code {code}"
    return RecordError(
        f"{path} cannot be read: the library for this format was ended by {what}; the file is damaged, copy "
        "or export it again"
    )


def _content(answer: bytes, path: Path) -> Content:
    head, _, _ = answer.partition(b"\n")
    told = json.loads(head)
    if "refused" in told:
        raise RecordError(told["refused"])
    if "missing" in told:
        raise RecordError(
            f"{path}: reading {path.suffix} files needs the package {told['missing']}; install it with "
            "pip install 'rotordrop[io]'"
        )
    items, at = [], len(head) + 1
    for entry in told["items"]:
        kind, shape = np.dtype(entry["dtype"]), tuple(entry["shape"])
        count = int(np.prod(shape, dtype=np.int64))
        values = np.frombuffer(answer, dtype=kind, count=count, offset=at).reshape(shape)
        items.append(Item(name=entry["name"], values=values, attributes=entry["attributes"]))
        at += count * kind.itemsize
    return Content(items=tuple(items), attributes=told["attributes"])


def refuse_bomb(
    samples: int, size: int, what: object, *, most: int = UNPACKED, most_per_byte: int = UNPACKED_PER_BYTE
) -> None:
    """Refuse a file whose samples would fill far more memory than a recording of its size.

    Parameters
    ----------
    samples : int
        Samples that the file claims [1].
    size : int
        Size of the file [byte].
    what : object
        What to call it.
    most, most_per_byte : int
        What any file may hold [byte], and what it may hold per byte when that is more [1].
    """
    limit = max(most, most_per_byte * size)
    if 8 * samples > limit:
        raise RecordError(
            f"{what} claims {samples} samples in {size} bytes; it is damaged or made to exhaust memory "
            f"({8 * samples / 1e6:.0f} MB, at most {limit / 1e6:.0f} MB are unpacked from it)"
        )


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


__all__ = ["Content", "Item", "plain", "refuse_bomb", "unpack"]
