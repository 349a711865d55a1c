"""What the compiler is taught: named tuples by reference, kernels optimised as a whole, objects by digest.

The compiler hands a named tuple over member by member, an array as seven numbers: `KernelParameters` would be
two hundred arguments of every call. It also makes machine code of every function, and optimises it again in
each function that calls it. Here named tuples go by their address, and only what Python calls is optimised
and emitted, with all kernels behind it.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import pickle
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding, ir
from numba.core import cgutils, types
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic
from numba.core.serialize import dumps
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, models, register_model, typeof_impl, unbox

from rotordrop.errors import OutputError
from rotordrop.files import atomic_path

PORTABLE = ("x86-64-v3", "")
"""Processor and features that shipped objects are compiled for; see `make wheel`."""

_PORTABLE_NEEDS = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")


class Reference(types.Type):
    """Address of a named tuple."""

    def __init__(self, pointee: types.NamedTuple) -> None:
        self.pointee = pointee
        digest = hashlib.sha256(str(pointee.types).encode()).hexdigest()[:8]  # names of kernels stay short
        super().__init__(name=f"Reference({pointee.instance_class.__name__}, {digest})")

    @property
    def key(self) -> Any:
        """What makes two references the same type."""
        return self.pointee


@register_model(Reference)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, reference: Reference) -> None:
        pointee = manager.lookup(reference.pointee).get_value_type()
        super().__init__(manager, reference, pointee.as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):
    key = Reference

    def generic_resolve(self, typ: Any, attr: Any) -> Any:
        fields = typ.pointee.fields
        return typ.pointee.types[fields.index(attr)] if attr in fields else None


def _load(builder: Any, pointer: Any) -> Any:
    """Load a value member by member; the machine code is told that nothing writes there meanwhile."""
    kind = pointer.type.pointee
    if isinstance(kind, ir.LiteralStructType | ir.ArrayType):
        count = len(kind.elements) if isinstance(kind, ir.LiteralStructType) else kind.count
        value = ir.Constant(kind, ir.Undefined)
        for k in range(count):
            member = _load(builder, cgutils.gep_inbounds(builder, pointer, 0, k))
            value = builder.insert_value(value, member, k)
        return value
    value = builder.load(pointer)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@lower_getattr_generic(Reference)
def _member(context: Any, builder: Any, reference: Reference, value: Any, name: str) -> Any:
    index = reference.pointee.fields.index(name)
    member = _load(builder, cgutils.gep_inbounds(builder, value, 0, index))
    return impl_ret_borrowed(context, builder, reference.pointee.types[index], member)


@unbox(Reference)
def _unbox(reference: Reference, given: Any, c: Any) -> NativeValue:
    native = c.unbox(reference.pointee, given)
    place = cgutils.alloca_once_value(c.builder, native.value)

    def cleanup() -> None:
        if native.cleanup is not None:
            native.cleanup()
        if c.context.enable_nrt:
            c.context.nrt.decref(c.builder, reference.pointee, native.value)

    return NativeValue(place, is_error=native.is_error, cleanup=cleanup)


def pass_by_reference(named: type) -> None:
    """Hand the named tuples of a class to kernels by their address."""

    @typeof_impl.register(named)
    def _type_of(value: Any, context: Any) -> Any:
        return Reference(types.NamedTuple([typeof_impl(member, context) for member in value], named))


class _Part(JITCodeLibrary):
    """A function that other kernels take in; neither linked nor optimised nor emitted by itself."""

    def finalize(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        return _NoEnvironment


class _NoEnvironment:
    """A part has no place for the environment that the compiler would hand it."""

    @staticmethod
    def set_env(name: str, environment: Any) -> None:
        pass


class _Whole(JITCodeLibrary):
    """A kernel that Python calls, with all parts behind it."""

    def finalize(self) -> None:
        self._linking_libraries = _callers_first(self)[1:]
        super().finalize()
        functions = self._final_module.functions
        missing = [one.name for one in functions if one.is_declaration and one.name.startswith("_ZN")]
        if missing:
            raise AssertionError(f"{self.name} lacks {', '.join(missing)}")


def _callers_first(whole: JITCodeLibrary) -> list[JITCodeLibrary]:
    """A library and all behind it: the linker leaves out what nothing refers to at its turn."""
    done: dict[JITCodeLibrary, None] = {}

    def visit(library: JITCodeLibrary) -> None:
        if library not in done:
            for callee in library._linking_libraries if isinstance(library, _Part | _Whole) else ():
                visit(callee)
            done[library] = None

    visit(whole)
    return list(done)[::-1]


class _KernelCompiler(Compiler):
    library: type[JITCodeLibrary]

    def define_pipelines(self) -> Any:
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super().define_pipelines()


class _PartCompiler(_KernelCompiler):
    library = _Part


class _WholeCompiler(_KernelCompiler):
    library = _Whole


_UNREADABLE = (OSError, pickle.UnpicklingError, EOFError, AttributeError, ImportError, IndexError, ValueError)
"""What a damaged or missing file of an object ends in; it is compiled again then."""


class _Objects(_Cache):
    """Machine code of one kernel on disk, a file for each signature and processor.

    A file is named by what it holds, so that processes that compile at once cannot mix up theirs. Shipped
    objects are only read; a folder that cannot be written is only read too.
    """

    def __init__(self, function: Callable[..., Any], own: Path, shipped: Path) -> None:
        self._name = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}"
        self._own, self._shipped = own, shipped

    @property
    def cache_path(self) -> str:
        return str(self._own)

    def _file(self, folder: Path, signature: Any, target: Sequence[str]) -> Path:
        digest = hashlib.sha256(repr((str(signature), tuple(target))).encode()).hexdigest()[:16]
        return folder / f"{self._name}-{digest}.object"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        target_context.refresh()
        target = target_context.codegen().magic_tuple()
        files = [self._file(self._own, sig, target)]
        if _is_portable_here():
            files.insert(0, self._file(self._shipped, sig, (target[0], *PORTABLE)))
        for file in files:
            with contextlib.suppress(*_UNREADABLE):
                return CompileResult._rebuild(target_context, *pickle.loads(file.read_bytes()))
        _say_once()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        file = self._file(self._own, sig, data.codegen.magic_tuple())
        with contextlib.suppress(OSError, OutputError):
            file.parent.mkdir(parents=True, exist_ok=True)
            with atomic_path(file) as unfinished:
                unfinished.write_bytes(dumps(data._reduce()))

    def enable(self) -> None:
        """Part of the compiler's interface of a cache, as the next two are."""

    disable = flush = enable


@lru_cache
def _say_once() -> None:
    logging.getLogger("rotordrop").info(
        "Compiling, once after an installation: half a minute for a simulation, a minute for an estimate ..."
    )


@lru_cache
def _is_portable_here() -> bool:
    """Whether this processor runs the shipped objects."""
    features = binding.get_host_cpu_features()
    return all(features.get(name, False) for name in _PORTABLE_NEEDS)


_njit: Any = numba.njit
_COMMON: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": False,
    "no_cfunc_wrapper": True,  # no kernel is handed to another as a value
}


def part(function: Callable[..., Any], **options: Any) -> Any:
    """What kernels call: taken into them, never machine code by itself."""
    return _njit(pipeline_class=_PartCompiler, no_cpython_wrapper=True, **_COMMON, **options)(function)


def entry(function: Callable[..., Any], own: Path, shipped: Path, **options: Any) -> Any:
    """What Python calls: compiled with all parts behind it, kept in the folder `own`."""
    dispatcher: Any = _njit(pipeline_class=_WholeCompiler, **_COMMON, **options)(function)
    dispatcher._cache = _Objects(function, own, shipped)
    return dispatcher
