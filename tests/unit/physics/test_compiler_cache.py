"""Where compiled kernels are kept."""

import importlib.util
import sys
from pathlib import Path

import pytest

from rotordrop.physics import _compile

KERNEL = """from rotordrop.physics import _compile


@_compile.kernel
def doubled(x):
    return 2.0 * x
"""


@pytest.fixture
def kernel_of(tmp_path, monkeypatch):
    """A kernel of another package, loaded anew at each call, its compiled code under `tmp_path`."""
    source = tmp_path / "other" / "doubled_kernel.py"
    source.parent.mkdir()
    source.write_text(KERNEL)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    _compile._open_folder.cache_clear()
    _compile.cache_folder.cache_clear()

    def loaded():
        spec = importlib.util.spec_from_file_location("doubled_kernel", source)
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "doubled_kernel", module)
        spec.loader.exec_module(module)
        return module.doubled

    yield loaded
    _compile._open_folder.cache_clear()
    _compile.cache_folder.cache_clear()


def kept(folder: Path) -> set[Path]:
    return {file.relative_to(folder) for file in folder.rglob("*.nb?")}


def test_kernels_are_read_where_they_cannot_be_written(kernel_of, tmp_path, monkeypatch):
    assert kernel_of()(2.0) == 4.0
    before = kept(tmp_path / "kernels")
    assert len(before) == 2

    monkeypatch.setattr(_compile, "is_writable", lambda folder: False)
    _compile._open_folder.cache_clear()
    again = kernel_of()
    assert again(3.0) == 6.0
    assert sum(again.outer.stats.cache_hits.values()) == 1, "compiled a second time"
    assert again(3) == 6.0  # of another type: compiled now, and kept in the copy alone
    assert kept(tmp_path / "kernels") == before


def test_a_folder_yet_to_be_made_is_as_its_nearest_parent(tmp_path, monkeypatch):
    monkeypatch.setattr(_compile.os, "access", lambda path, mode: path != tmp_path)
    assert not _compile.is_writable(tmp_path / "not" / "yet")
    (tmp_path / "not").mkdir()
    assert _compile.is_writable(tmp_path / "not" / "yet")
