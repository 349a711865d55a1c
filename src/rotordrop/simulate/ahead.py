"""The time loop compiled in a second process while the first one reads the machine and finds its modes.

After an installation the loop is the longest wait of a first drop, and it needs nothing of the machine.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from rotordrop.child import child_command
from rotordrop.physics._compile import cache_folder, compile_for, is_writable
from rotordrop.physics.columns import KernelParameters
from rotordrop.simulate import _histories, _loop
from rotordrop.simulate._tableau import tsit5

_DIMENSIONS = {
    "bearing_shape": 2,
    "bearing": 2,
    "balls": 3,
    "ball_table": 5,
    "polar": 2,
    "magnet_shape": 2,
    "magnet": 2,
}
_DIMENSIONS |= dict.fromkeys(("bearing_at", "contact_at", "magnet_at", "departure", "load"), 2)
_DIMENSIONS |= dict.fromkeys(("load_shape", "load_points", "rub"), 2)


def _parameters() -> KernelParameters:
    """Parameters of no machine, of the types that every machine has."""
    return KernelParameters(
        **{
            name: np.zeros((0,) * _DIMENSIONS.get(name, 1), np.int64 if "Integers" in str(kind) else float)
            for name, kind in KernelParameters.__annotations__.items()
        }
    )


def compile_loop() -> None:
    """Compile the time loop and put it into the cache."""
    line, table = np.zeros(0), np.zeros((0, 0))
    control = _loop.Control(line, 1e-6, 1.0, 1, -1.0, 1.0, 0.0, True)
    arguments = (line, line, _parameters(), tsit5(), control, table, table, table, table, table, line)
    compile_for(_loop.integrate, *arguments)


def compile_histories() -> None:
    """Compile what reads a simulated drop."""
    line, table, p = np.zeros(0), np.zeros((0, 0)), _parameters()
    compile_for(_loop.start_running, line, 0.0, p, table, table)
    compile_for(_histories.bearing_histories, line, table, p, np.zeros((0, 0, 0)))
    compile_for(_histories.stored_energies, line, table, p, True, line)


@contextmanager
def loop_compiled_ahead(say: Callable[[str], None]) -> Iterator[Callable[[], None]]:
    """Compile the loop beside the block if the cache lacks it; the block calls what it is given to wait."""
    folder = Path(cache_folder())
    alone = (os.cpu_count() or 1) < 2 or os.environ.get("NUMBA_DISABLE_JIT", "0") != "0"
    if alone or not is_writable(folder) or any(folder.rglob("_loop.integrate-*.nbc")):
        yield lambda: None
        return
    say("The first drop after an installation compiles its kernels, once, for some ten seconds ...")
    beside = subprocess.Popen(child_command(__name__, "compile_loop"), stdin=subprocess.DEVNULL)

    def wait() -> None:
        compile_histories()
        beside.wait()

    try:
        yield wait
    finally:
        beside.terminate()
        beside.wait()
