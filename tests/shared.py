"""Values that are made once a run by whoever asks first, and shared by all workers."""

from __future__ import annotations

import importlib
import io
import marshal
import mmap
import pickle
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from types import CellType, FunctionType
from typing import Any

from filelock import FileLock

ALIGNED = 64
"""What numpy allots an array at [bytes]; kernels have machine code of their own for others."""


class Shared:
    """Values by name, in a folder. Who asks gets a copy of his own, down to the last array."""

    def __init__(self, folder: Path, makers: dict[str, Callable[[Shared], object]]) -> None:
        folder.mkdir(exist_ok=True)
        self._folder, self._makers = folder, makers

    def __call__(self, name: str) -> Any:
        """Make the value of a name, or wait for who is making it, and give a copy."""
        file = self._folder / name
        with FileLock(f"{file}.lock"):
            if not file.exists():
                _keep(self._makers[name](self), file)
        return _copy(file)


def _keep(value: object, file: Path) -> None:
    """Arrays go as they are into a file beside."""
    places: list[tuple[int, int]] = []
    rest = io.BytesIO()
    with open(f"{file}.arrays", "wb") as arrays:
        arrays.write(bytes(ALIGNED))  # nothing cannot be mapped

        def put(buffer: pickle.PickleBuffer) -> None:
            arrays.write(bytes(-arrays.tell() % ALIGNED))
            places.append((arrays.tell(), buffer.raw().nbytes))
            arrays.write(buffer.raw())

        _Pickler(rest, 5, buffer_callback=put).dump(value)
    file.write_bytes(pickle.dumps((places, rest.getvalue())))


def _copy(file: Path) -> Any:
    """Arrays lie in memory of the file that belongs to the copy as soon as it writes there."""
    with open(f"{file}.arrays", "rb") as arrays:
        memory = memoryview(mmap.mmap(arrays.fileno(), 0, access=mmap.ACCESS_COPY))
    places, rest = pickle.loads(file.read_bytes())
    return pickle.loads(rest, buffers=[memory[first : first + size] for first, size in places])


class _Pickler(pickle.Pickler):
    """Takes functions within functions too, by code, module and cells, and futures by their result."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, Future):
            return _done, (value.result(),)
        if not isinstance(value, FunctionType) or "<locals>" not in value.__qualname__:
            return NotImplemented
        held = tuple(cell.cell_contents for cell in value.__closure__ or ())
        return _function, (marshal.dumps(value.__code__), value.__module__, held, value.__defaults__)


def _done(result: object) -> Future[Any]:
    done: Future[Any] = Future()
    done.set_result(result)
    return done


def _function(code: bytes, module: str, held: tuple[Any, ...], defaults: tuple[Any, ...] | None) -> Any:
    names = vars(importlib.import_module(module))
    return FunctionType(marshal.loads(code), names, None, defaults, tuple(map(CellType, held)))
