"""A Python process of its own for one function, under limits on memory and time."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from typing import Any

_PROGRAM = (
    "import importlib, json, sys; order = json.loads(sys.argv[1]); sys.path[:] = order['paths']; "
    "getattr(importlib.import_module(order['module']), order['function'])(*order['arguments'])"
)


def child_command(module: str, function: str, *arguments: Any) -> list[str]:
    """Command line of a process that calls a function with arguments that JSON holds.

    It finds what this process finds, from any folder; the launcher of a bundled program takes this form too.
    """
    paths = [os.path.abspath(entry) for entry in sys.path if entry]  # noqa: PTH100 - entries stay texts
    order = {"paths": paths, "module": module, "function": function, "arguments": arguments}
    return [sys.executable, "-I", "-c", _PROGRAM, json.dumps(order)]


def limit(memory: int, seconds: int) -> None:
    """Limit memory [byte] and processor time [s] of this process, on POSIX systems."""
    if os.name != "posix":
        return
    import resource

    # RLIMIT_AS would count what libraries map and never touch; only Linux bounds RLIMIT_DATA as needed
    of_memory = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    for which, limits in (
        (resource.RLIMIT_CPU, (seconds, seconds + 1)),
        (of_memory, (memory, memory)),
        (resource.RLIMIT_CORE, (0, 0)),
    ):
        with suppress(ValueError, OSError):
            resource.setrlimit(which, limits)
