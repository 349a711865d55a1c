"""The one place that knows the compiler: every compiled function takes its decorator from here.

Kernels are compiled under strict floating point (no ``fastmath``: it gives other trajectories cold and
cached) and kept on disk, in a folder named after a digest of all kernel sources and of the compiler: after an
update or an edit a stale machine code can never be loaded. A wheel may carry such a folder.

The compiler itself is loaded when a kernel is called first, so that whoever needs of a law only where its
numbers stand, such as the description of a machine, loads no compiler.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from dis import get_instructions
from functools import lru_cache, update_wrapper
from pathlib import Path
from threading import RLock
from types import FunctionType
from typing import Any, TypeVar, cast

OPTIONAL_PARTS = True
"""Stands in kernels before what few machines have; false in their plain forms, see `PLAIN`."""

Function = TypeVar("Function", bound=Callable[..., Any])
Named = TypeVar("Named", bound=type)

_PACKAGE = Path(__file__).resolve().parent.parent
_MARK = "rotordrop.physics._compile import"
_FURTHER = tuple(
    _PACKAGE / "physics" / name for name in ("columns.py", "elementary_tables.py", "_compile.py", "_numba.py")
)
"""Compiled into the kernels, or saying how they are compiled, though they have no kernel themselves."""

_FOLDERS = tuple(_PACKAGE / name for name in ("physics", "rotor", "simulate", "track"))
"""Where the kernels of this package stand."""

_SHIPPED = _PACKAGE / "compiled"
"""Where a wheel carries compiled kernels."""

_MAKING = RLock()
"""Held while a kernel is handed to the compiler: two threads that call it first must get one."""

_BY_REFERENCE: list[type] = []
"""Classes of named tuples that the compiler has not been told of."""


def _kernel_sources(folders: Iterable[Path]) -> list[Path]:
    files = (file for folder in folders for file in sorted(folder.glob("*.py")))
    return [file for file in files if file in _FURTHER or _MARK in file.read_text(encoding="utf-8")]


@lru_cache
def kernel_digest(beside: Path | None = None) -> str:
    """Digest of the kernel sources, of the compiler and of the Python version.

    Kernels of another package, in the folder `beside`, call those of this one: the sources of both count.
    """
    import llvmlite
    import numba

    versions = (numba.__version__, llvmlite.__version__, sys.implementation.cache_tag)
    digest = hashlib.sha256(repr(versions).encode())
    for file in _kernel_sources((*_FOLDERS, *([] if beside is None else [beside]))):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder(beside: Path | None = None) -> Path:
    """Folder of the kernels compiled on this computer; it may not be there yet, or not be writable."""
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return Path(os.environ.get("NUMBA_CACHE_DIR") or caches / "rotordrop") / kernel_digest(beside)


def kernel(function: Function) -> Function:
    """Compile a function with strict floating point, without the interpreter lock, cached on disk."""
    return _lazy(function)


def lean_kernel(function: Function) -> Function:
    """Compile a kernel that makes no arrays: without reference counts, which cost half of a right-hand side.

    Views of arrays are allowed; new arrays and the assignment of an array to a slice of another are not.
    """
    return _lazy(function, _nrt=False)


def inner_kernel(function: Function) -> Function:
    """Compile a lean kernel into its callers: for what is called millions of times and does little."""
    return _lazy(function, _nrt=False, forceinline=True)


def by_reference(named: Named) -> Named:
    """Hand the named tuples of a class to kernels by their address, not member by member."""
    _BY_REFERENCE.append(named)
    return named


@dataclass(frozen=True, kw_only=True)
class Form:
    """Another form of kernels: what stands there under some names, in them and in all behind them.

    A part is changed in the same way, so that what it calls under another name is what it takes the place of.
    What is called through its module stays as it stands.
    """

    name: str
    parts: Mapping[str, Any]
    beside: Path | None = None
    """Folder of the package whose parts these are, where it is not this one."""

    def of(self, function: Function) -> Function:
        """A kernel in this form; what is no kernel stays."""
        return cast(Function, function.form(self)) if isinstance(function, _Kernel) else function


FULL, PLAIN = Form(name="full", parts={}), Form(name="plain", parts={"OPTIONAL_PARTS": False})
"""Kernels as they stand, and for machines without optional parts, compiled without them."""


def _lazy(function: Function, **options: Any) -> Function:
    return cast(Function, _Kernel(function, options))


class _Kernel:
    """A kernel, handed to the compiler when it is called first.

    Kernels call `inner`, which is taken into them; the first call from Python compiles `outer`, with all
    kernels behind it, as a whole.
    """

    def __init__(
        self, function: Callable[..., Any], options: dict[str, Any], beside: Path | None = None
    ) -> None:
        self.py_func = function
        self._options = options
        self._beside = beside
        self._forms: dict[str, _Kernel] = {}
        self._inner: Any = None
        self._outer: Any = function if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" else None
        update_wrapper(self, function)

    def form(self, form: Form) -> _Kernel:
        """The kernel in another form; itself where that changes nothing."""
        if form.name not in self._forms:
            known, code = self.py_func.__globals__, self.py_func.__code__
            names = {one.argval for one in get_instructions(code) if one.opname == "LOAD_GLOBAL"} & set(known)
            parts = {name: form.of(form.parts.get(name, known[name])) for name in names}
            changed = {name: one for name, one in parts.items() if one is not known[name]}
            function = FunctionType(code, known | changed, argdefs=self.py_func.__defaults__)
            update_wrapper(function, self.py_func)
            function.__qualname__ = f"{form.name}_{self.py_func.__qualname__}"
            self._forms[form.name] = _Kernel(function, self._options, form.beside) if changed else self
        return self._forms[form.name]

    @property
    def inner(self) -> Any:
        """What kernels call."""
        if self._inner is None:  # looked at again under the lock, which later calls need not take
            with _MAKING:
                if self._inner is None:
                    self._inner = _compiler().part(self.py_func, **self._options)
        return self._inner

    @property
    def outer(self) -> Any:
        """What Python calls."""
        if self._outer is None:
            with _MAKING:
                if self._outer is None:
                    home = Path(self.py_func.__code__.co_filename).resolve().parent
                    beside = self._beside or (None if home in _FOLDERS else home)
                    shipped = _SHIPPED / kernel_digest(beside)
                    self._outer = _compiler().entry(
                        self.py_func, cache_folder(beside), shipped, **self._options
                    )
        return self._outer

    @property
    def _numba_type_(self) -> Any:
        return self.inner._numba_type_

    @property
    def overloads(self) -> Any:
        return self.inner.overloads

    def __call__(self, *args: Any) -> Any:
        return self.outer(*args)


def _compiler() -> Any:
    """The compiler, told of all named tuples that go by reference."""
    from rotordrop.physics import _numba

    while _BY_REFERENCE:
        _numba.pass_by_reference(_BY_REFERENCE.pop())
    return _numba
