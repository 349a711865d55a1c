"""The loop compiled ahead is the loop a drop calls, and nobody waits for it longer than for the drop."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from rotordrop.simulate import _histories, _loop, ahead
from rotordrop.simulate.result import DropResult

KERNELS: tuple[Any, ...] = (
    _loop.integrate,
    _loop.start_running,
    _histories.bearing_histories,
    _histories.stored_energies,
)


def test_what_is_compiled_ahead_is_what_a_drop_calls(drop: DropResult) -> None:
    assert drop.finished
    called = [set(kernel.overloads) for kernel in KERNELS]
    ahead.compile_loop()
    ahead.compile_histories()
    assert [set(kernel.overloads) for kernel in KERNELS] == called


def as_second_process(monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    monkeypatch.setattr(ahead, "child_command", lambda *_: [sys.executable, "-c", code])


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A cache without kernels on a computer of two cores; notes what the first process compiles."""
    compiled: list[str] = []
    monkeypatch.setattr(ahead, "cache_folder", lambda: str(tmp_path / "cache"))
    monkeypatch.setattr(ahead, "compile_histories", lambda: compiled.append("histories"))
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    return compiled


def test_the_wait_is_told_and_ends_with_the_second_process(
    tmp_path: Path, empty_cache: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    as_second_process(monkeypatch, f"open({str(tmp_path / 'made')!r}, 'w').close()")
    with ahead.loop_compiled_ahead(told.append) as compiled:
        compiled()
        assert (tmp_path / "made").exists()
    assert empty_cache == ["histories"]
    assert len(told) == 1
    assert "compiles its kernels, once" in told[0]


def test_the_second_process_ends_with_the_block(
    empty_cache: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    as_second_process(monkeypatch, "import time; time.sleep(60)")
    begun: list[subprocess.Popen[bytes]] = []
    real = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: begun.append(real(*a, **k)) or begun[0])
    with pytest.raises(KeyboardInterrupt), ahead.loop_compiled_ahead(lambda _text: None):
        raise KeyboardInterrupt
    assert begun[0].returncode != 0  # it did not come to its end
    assert empty_cache == []


def test_nothing_is_told_where_the_cache_holds_the_loop(
    tmp_path: Path, empty_cache: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache" / "_loop.integrate-1.py311.1.nbc").touch()
    as_second_process(monkeypatch, "raise SystemExit(1)")
    told: list[str] = []
    with ahead.loop_compiled_ahead(told.append) as compiled:
        compiled()
    assert (told, empty_cache) == ([], [])
