"""Where compiled kernels are kept."""

import importlib.util
import os
import subprocess
import sys

import numba
import pytest

from rotordrop.physics import _compile, _numba
from rotordrop.simulate._tableau import tsit5

KERNEL = """from rotordrop.physics import _compile


@_compile.kernel
def doubled(x):
    return 2.0 * x
"""


PARTED = """from rotordrop.physics import _compile
from rotordrop.physics._compile import OPTIONAL_PARTS


@_compile.lean_kernel
def inner(x):
    if OPTIONAL_PARTS and x > 0.0:
        return 1.0
    return 0.0


@_compile.kernel
def doubled(x, further=1.0):
    return 2.0 * x * (further if further == 1.0 else 3.0) + inner(x)
"""


@pytest.fixture
def kernel_of(tmp_path, monkeypatch):
    """A kernel of another package, loaded anew at each call, its compiled code under `tmp_path`."""
    source = tmp_path / "other" / "doubled_kernel.py"
    source.parent.mkdir()
    source.write_text(KERNEL)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))

    def loaded():
        spec = importlib.util.spec_from_file_location("doubled_kernel", source)
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "doubled_kernel", module)
        spec.loader.exec_module(module)
        return module.doubled

    return loaded


def kept(folder):
    return sorted(folder.rglob("*.object"))


def hits(doubled):
    return sum(doubled.outer.stats.cache_hits.values())


def test_a_kernel_is_compiled_once(kernel_of, tmp_path):
    assert kernel_of()(2.0) == 4.0
    (object_file,) = kept(tmp_path / "kernels")
    again = kernel_of()
    assert again(3.0) == 6.0
    assert hits(again) == 1
    assert again(3) == 6  # of another type
    assert len(kept(tmp_path / "kernels")) == 2
    assert object_file in kept(tmp_path / "kernels")


def test_a_damaged_object_is_compiled_again(kernel_of, tmp_path):
    assert kernel_of()(2.0) == 4.0
    (object_file,) = kept(tmp_path / "kernels")
    object_file.write_bytes(object_file.read_bytes()[:100])
    again = kernel_of()
    assert again(3.0) == 6.0
    assert hits(again) == 0


def test_a_folder_that_cannot_be_written_costs_no_answer(kernel_of, tmp_path):
    (tmp_path / "kernels").write_text("a file where the folder should be")
    assert kernel_of()(2.0) == 4.0


def test_shipped_objects_are_found_by_digest(kernel_of, tmp_path, monkeypatch):
    """Whatever the place of the sources and the dates of the files."""
    if not _numba._is_portable_here():
        pytest.skip("this processor does not run the shipped objects")
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'other')!r}); import doubled_kernel; "
        "doubled_kernel.doubled(2.0)"
    )
    portable = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
    subprocess.run([sys.executable, "-c", code], env={**os.environ, **portable}, check=True, timeout=600)
    (tmp_path / "kernels").rename(tmp_path / "shipped")
    monkeypatch.setattr(_compile, "_SHIPPED", tmp_path / "shipped")
    doubled = kernel_of()
    assert doubled(3.0) == 6.0
    assert hits(doubled) == 1
    assert not kept(tmp_path / "kernels")


def test_parts_are_compiled_where_they_are_called_and_tuples_by_address(tmp_path):
    """Rests on private pieces of the compiler; where they change, this tells."""
    inner = _numba.part(lambda x: x + 1.0)
    middle = _numba.part(lambda x: 2.0 * inner(x))
    outer = _numba.entry(lambda x: middle(x) + inner(x), tmp_path / "own", tmp_path / "shipped")
    assert outer(3.0) == 12.0
    assert len(kept(tmp_path)) == 1
    for one in (inner, middle):
        (compiled,) = one.overloads.values()
        assert isinstance(compiled.library, _numba._Part)
        assert compiled.library._compiled_object is None
    assert isinstance(numba.typeof(tsit5()), _numba.Reference)


def test_the_plain_form_leaves_optional_parts_out_of_all_kernels_behind_it(kernel_of, tmp_path):
    source = tmp_path / "other" / "doubled_kernel.py"
    source.write_text(PARTED)
    doubled = kernel_of()
    plain = _compile.PLAIN.of(doubled)
    assert (doubled(2.0), plain(2.0)) == (5.0, 4.0)
    assert doubled(2.0, 3.0) == 13.0  # what stands for an argument that is left out is kept in both
    assert plain(2.0, 3.0) == 12.0
    assert _compile.PLAIN.of(plain) is plain
