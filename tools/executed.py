"""What of the package runs: the lines under the commands, and the functions under each test.

Python's own tracing is enough: lines are asked for only until a function has shown them all, and the tests
are followed call by call. Compiled kernels cannot be followed. Under the commands a kernel counts as
executed, with all its lines and all kernels it names, when machine code of it was made or loaded; under a
test, when a function that ran names it. With ``NUMBA_DISABLE_JIT=1`` kernels are followed like all else.
"""

from __future__ import annotations

import contextlib
import dis
import inspect
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

Lines = dict[str, set[int]]


class Follower:
    """Remembers lines or functions of one package as they run."""

    def __init__(self, package: Path) -> None:
        self.root = f"{package}/"
        self.lines: Lines = {}
        self.calls: dict[CodeType, dict[str, Any]] = {}
        self._missing: dict[CodeType, set[int] | None] = {}
        self._named: dict[CodeType, list[CodeType]] = {}

    def file_of(self, code: CodeType) -> str | None:
        return code.co_filename[len(self.root) :] if code.co_filename.startswith(self.root) else None

    @contextlib.contextmanager
    def every_line(self) -> Iterator[None]:
        threading.settrace(self._line_by_line)
        sys.settrace(self._line_by_line)
        try:
            yield
        finally:
            sys.settrace(None)
            threading.settrace(None)  # type: ignore[arg-type]

    def _line_by_line(self, frame: FrameType, event: str, argument: Any) -> Callable[..., Any] | None:
        code = frame.f_code
        if code not in self._missing:
            own = self.file_of(code)
            self._missing[code] = None if own is None else {n for _, n in dis.findlinestarts(code) if n}
        missing = self._missing[code]
        if not missing:
            return None
        missing.discard(frame.f_lineno)
        self.lines.setdefault(code.co_filename[len(self.root) :], set()).add(frame.f_lineno)
        return self._line_by_line

    def follow_calls(self) -> None:
        threading.settrace(self._call)
        sys.settrace(self._call)

    def functions(self, calls: dict[CodeType, dict[str, Any]]) -> set[str]:
        """File and name of all that was called, and of the kernels that it names."""
        codes = list(calls)
        for code, names in calls.items():
            codes += self._kernels_of(code, names)
        return {f"{self.file_of(code)}:{code.co_qualname}" for code in codes}

    def _kernels_of(self, code: CodeType, names: dict[str, Any]) -> list[CodeType]:
        if code not in self._named:
            self._named[code] = [k.py_func.__code__ for k in with_named(kernels_named(code, names))]
        return self._named[code]

    def _call(self, frame: FrameType, event: str, argument: Any) -> None:
        code = frame.f_code
        if code not in self.calls and code.co_filename.startswith(self.root):
            self.calls[code] = frame.f_globals


def is_kernel(value: object) -> bool:
    return hasattr(value, "py_func") and hasattr(value, "overloads")


def kernels_named(code: CodeType, names: dict[str, Any]) -> Iterator[Any]:
    """Kernels that a function names, those of functions and comprehensions inside it included."""
    for name in code.co_names:
        if is_kernel(names.get(name)):
            yield names[name]
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from kernels_named(inner, names)


def with_named(kernels: Iterator[Any]) -> list[Any]:
    """Kernels and all that they name, and so on."""
    found: dict[int, Any] = {}
    waiting = list(kernels)
    while waiting:
        kernel = waiting.pop()
        if id(kernel) not in found:
            found[id(kernel)] = kernel
            waiting += kernels_named(kernel.py_func.__code__, kernel.py_func.__globals__)
    return list(found.values())


def loaded_kernels() -> Iterator[Any]:
    """All kernels of the imported modules."""
    for name, module in list(sys.modules.items()):
        if name.startswith("rotordrop"):
            yield from (value for value in vars(module).values() if is_kernel(value))


def commands(folder: Path) -> list[list[str]]:
    """Every way of `calibrate`, `estimate` and `waterfall`; what they read is written first."""
    from rotordrop.cli.app import run
    from rotordrop.machine import example_machine, example_path
    from rotordrop.machine.saving import save_machine
    from rotordrop.record.examples import example_record_path

    owner, drop = str(example_path("lp400")), str(example_record_path("lp400_drop_060"))
    tail = str(example_record_path("lp400_drop_060_tail"))
    coasting, simulated = str(folder / "coasting.toml"), str(folder / "coast.h5")
    save_machine(example_machine("lp400").with_values({"speed.aero_time_constant": 9.0}), Path(coasting))
    assert run(["coast-down", coasting, "--speed", "60 Hz", "--until", "8 s", "--output", simulated]) == 0
    recorded = str(folder / "coast.csv")
    write_coast_down(Path(recorded))

    def outputs(name: str) -> list[str]:
        return ["--json", str(folder / f"{name}.json"), "--report", str(folder / f"{name}.html")]

    calibrated = str(folder / "calibrated.toml")
    written = ["--output", calibrated, "--json", str(folder / "calibrated.json")]
    return [
        ["calibrate", owner, drop, "--tail", tail, *written],
        ["estimate", calibrated, drop, "--tail", tail, "--quick", *outputs("quick")],
        ["estimate", owner, drop, *outputs("lone")],
        ["waterfall", coasting, simulated, "--output", str(folder / "w.h5"), *outputs("simulated")],
        ["waterfall", owner, recorded, "--points", "4096", *outputs("recorded")],
        ["estimate", owner, drop, "--tail", tail, "--method", "replay", *outputs("replay")],
    ]


def write_coast_down(path: Path) -> None:
    """A recording of 60 s: levitated, fallen, swinging at 8 Hz, hum at 50 Hz, 1X at a falling speed."""
    import numpy as np

    from rotordrop.machine import example_machine

    time_ = np.arange(-0.3, 60.0, 1.0 / 2000.0)
    dice = np.random.default_rng(4)
    speed = 60.0 * np.exp(-0.05 * np.clip(time_, 0.0, None))
    angle = 2.0 * np.pi * np.cumsum(speed) / 2000.0
    fallen = np.clip(time_ / 8e-3, 0.0, 1.0) ** 2
    swing = 6.0 * fallen * np.sin(2.0 * np.pi * 8.0 * time_)
    columns = {"time [s]": time_}
    for sensor in example_machine("lp400").sensors:
        across, up = np.cos(float(sensor.angle)), np.sin(float(sensor.angle))
        motion = (swing + 2.0 * np.cos(angle)) * across + (2.0 * np.sin(angle) - 270.0 * fallen) * up
        hum = np.sin(2.0 * np.pi * 50.0 * time_)
        columns[f"{sensor.name} [um]"] = motion + hum + 0.3 * dice.standard_normal(time_.size)
    columns["speed [Hz]"] = speed
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        delimiter=",",
        header=",".join(columns),
        comments="",
        fmt="%.6f",
    )


def lines_of_the_commands(package: Path, folder: Path, tell: Callable[[str], None]) -> dict[str, list[int]]:
    """Lines of each file that the commands execute, kernels as a whole."""
    from rotordrop.cli.app import run

    follower = Follower(package)
    for arguments in commands(folder):
        began = time.process_time()
        with follower.every_line():
            code = run(arguments)
        tell(f"exit code {code} after {time.process_time() - began:.0f} s: {' '.join(arguments)}")
    lines = follower.lines
    for kernel in with_named(k for k in loaded_kernels() if k.overloads):
        source, first = inspect.getsourcelines(kernel.py_func)
        own = follower.file_of(kernel.py_func.__code__)
        if own is not None:
            lines.setdefault(own, set()).update(range(first, first + len(source)))
    return {name: sorted(found) for name, found in sorted(lines.items())}


class TestMap:
    """A pytest plugin: what each test runs, what its fixtures ran included, and how long it takes."""

    __test__ = False

    def __init__(self, package: Path, longest: float) -> None:
        self.follower = Follower(package)
        self.longest = longest
        self.of_fixture: dict[int, tuple[set[str], float]] = {}
        self.tests: dict[str, dict[str, Any]] = {}
        self.failed: set[str] = set()

    @contextlib.contextmanager
    def _followed(self) -> Iterator[dict[CodeType, dict[str, Any]]]:
        """Calls made inside; those of a fixture made during another count for the inner one."""
        outer, self.follower.calls = self.follower.calls, {}
        self.follower.follow_calls()
        try:
            yield self.follower.calls
        finally:
            self.follower.calls = outer

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Any:
        began = time.process_time()
        with self._followed() as calls:
            try:
                return (yield)
            finally:
                took = time.process_time() - began
                self.of_fixture[id(fixturedef)] = self.follower.functions(calls), took

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any, nextitem: Any) -> Any:
        if self.longest:
            signal.signal(signal.SIGPROF, too_long)
            signal.setitimer(signal.ITIMER_PROF, self.longest)
        try:
            return (yield)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            sys.settrace(None)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: Any) -> Any:
        began = time.process_time()
        with self._followed() as calls:
            result = yield
        took = time.process_time() - began
        if function := getattr(item, "function", None):
            calls = {function.__code__: function.__globals__, **calls}
        ran = self.follower.functions(calls)
        whole = took
        for definitions in item._fixtureinfo.name2fixturedefs.values():
            for one in definitions:
                functions, seconds = self.of_fixture.get(id(one), (set(), 0.0))
                ran = ran | functions
                whole += seconds
        ran = {name for name in ran if not name.startswith("None:")}
        self.tests[item.nodeid] = {"seconds": round(took, 2), "whole": round(whole, 2), "ran": ran}
        return result

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed or report.skipped:
            self.failed.add(report.nodeid)

    def passed(self) -> dict[str, dict[str, Any]]:
        return {name: test for name, test in self.tests.items() if name not in self.failed}


def too_long(number: int, frame: FrameType | None) -> None:
    raise TimeoutError("this test takes too long to be run against faults")
