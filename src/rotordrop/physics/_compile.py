"""The one place that knows the compiler: every compiled function takes its decorator from here.

Kernels are compiled under strict floating point (no ``fastmath``: it gives other trajectories cold and
cached) and cached on disk. Numba's own cache looks only at the file of a function and not at the files of the
functions it calls, so the cache folder is named after a digest of all kernel sources: after an update or an
edit a stale machine code can never be loaded.

The compiler itself is loaded when a kernel is called first, so that whoever needs of a law only where its
numbers stand, such as the description of a machine, loads no compiler.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from functools import lru_cache, update_wrapper
from pathlib import Path
from threading import RLock
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).resolve().parent.parent
_MARK = "rotordrop.physics._compile import"
_CONSTANTS = tuple(_PACKAGE / "physics" / name for name in ("columns.py", "elementary_tables.py"))
"""Compiled into the kernels as numbers though they have no kernel themselves."""


_FOLDERS = tuple(_PACKAGE / name for name in ("physics", "rotor", "simulate", "track"))
"""Where the kernels of this package stand."""

_MAKING = RLock()
"""Held while a kernel is handed to the compiler: two threads that call it first must get one."""


def _kernel_sources(folders: Iterable[Path]) -> list[Path]:
    files = (file for folder in folders for file in sorted(folder.glob("*.py")))
    return [file for file in files if file in _CONSTANTS or _MARK in file.read_text(encoding="utf-8")]


@lru_cache
def cache_folder(beside: Path | None = None) -> str:
    """Folder of the compiled kernels, named after a digest of their sources and of the compiler's version.

    Kernels of another package, in the folder `beside`, call those of this one: the sources of both count.
    """
    import numba

    digest = hashlib.sha256(numba.__version__.encode())
    for file in _kernel_sources((*_FOLDERS, *([] if beside is None else [beside]))):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    root = Path(os.environ.get("NUMBA_CACHE_DIR") or caches / "rotordrop")
    return str(root / digest.hexdigest()[:16])


def is_writable(folder: Path) -> bool:
    """Whether compiled kernels can be kept in a folder, there or yet to be made."""
    return os.access(next(parent for parent in (folder, *folder.parents) if parent.exists()), os.W_OK)


@lru_cache
def _open_folder(folder: str) -> str:
    """The folder of compiled kernels; where it cannot be written, a copy of it for this process.

    The compiler refuses to read from a folder that it cannot write, and a program in a container, or one
    installed for all users of a computer, often has its kernels in such a one.
    """
    if is_writable(Path(folder)):
        return folder
    copy = tempfile.mkdtemp(prefix="rotordrop-kernels-")
    atexit.register(shutil.rmtree, copy, ignore_errors=True)
    if Path(folder).is_dir():
        shutil.copytree(folder, copy, dirs_exist_ok=True)
    return copy


def kernel(function: Function) -> Function:
    """Compile a function with strict floating point, without the interpreter lock, cached on disk."""
    return _lazy(function)


def lean_kernel(function: Function) -> Function:
    """Compile a kernel that makes no arrays: without reference counts, which cost half of a right-hand side.

    Views of arrays are allowed; new arrays and the assignment of an array to a slice of another are not.
    """
    return _lazy(function, is_part=True, _nrt=False)


def inner_kernel(function: Function) -> Function:
    """Compile a lean kernel into its callers: for what is called millions of times and does little."""
    return _lazy(function, is_part=True, _nrt=False, forceinline=True)


def compile_for(function: Callable[..., Any], *examples: Any) -> None:
    """Compile a kernel for arguments of the types of these, and put it into the cache."""
    import numba

    compiled: Any = function
    type_of: Any = numba.typeof
    compiled.outer.compile(tuple(type_of(one) for one in examples))


def _lazy(function: Function, *, is_part: bool = False, **options: Any) -> Function:
    interpreted = os.environ.get("NUMBA_DISABLE_JIT", "0") != "0"
    return function if interpreted else cast(Function, _Kernel(function, is_part, options))


class _Kernel:
    """A kernel, handed to the compiler when it is called first.

    Some are parts, which other kernels call, and Python seldom: the code by which Python calls a kernel takes
    a third of its time to compile, and nobody needs it of a part. Kernels call `inner`, which has none; the
    first call from Python compiles `outer`, which has it.
    """

    def __init__(self, function: Callable[..., Any], is_part: bool, options: dict[str, Any]) -> None:
        self.py_func = function
        self._is_part, self._options = is_part, options
        self._made: dict[str, Any] = {}
        update_wrapper(self, function)

    @property
    def inner(self) -> Any:
        """What kernels call."""
        if not self._is_part:
            return self.outer
        # A folder apart: the compiler's index of a cache does not tell the two forms of a function apart.
        return self._compiled("parts", no_cpython_wrapper=True)

    @property
    def outer(self) -> Any:
        """What Python calls."""
        return self._compiled("")

    @property
    def _numba_type_(self) -> Any:
        return self.inner._numba_type_

    @property
    def overloads(self) -> Any:
        return self.inner.overloads

    def __call__(self, *args: Any) -> Any:
        return self.outer(*args)

    def _compiled(self, place: str, **further: Any) -> Any:
        if place not in self._made:  # looked at again under the lock, which later calls need not take
            with _MAKING:
                if place not in self._made:
                    self._made[place] = _compiled(self.py_func, place, **self._options, **further)
        return self._made[place]


def _compiled(function: Callable[..., Any], place: str, **options: Any) -> Any:
    import numba
    from numba.core import config

    settings: Any = config
    # no_cfunc_wrapper: no kernel is handed to another as a value.
    options |= {
        "cache": True,
        "nogil": True,
        "error_model": "numpy",
        "fastmath": False,
        "no_cfunc_wrapper": True,
    }
    previous = settings.CACHE_DIR
    home = Path(function.__code__.co_filename).resolve().parent
    folder = _open_folder(cache_folder(None if home in _FOLDERS else home))
    settings.CACHE_DIR = str(Path(folder) / place)
    try:
        return numba.njit(**options)(function)
    finally:
        settings.CACHE_DIR = previous
