"""A Python process of its own for one function, under limits on memory and time."""

from __future__ import annotations

import gc
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from rotordrop.one_thread import ENVIRONMENT

FORKS = sys.platform == "linux"
"""Whether children are copies of a process that has imported what they need. Windows has no such copies, and
libraries of macOS do not survive them."""
_MOST = 2**16
"""Bytes of an order."""

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


@dataclass
class Starter:
    """Starts functions in processes of their own, which go on when this one ends.

    Where there are forks, one process takes orders, imports what they need and copies itself for each; it
    computes nothing and ends with this one. Elsewhere every function has a process that is begun anew.
    """

    _orders: socket.socket | None = None
    _server: subprocess.Popen[bytes] | None = field(default=None, repr=False)

    def start(
        self, module: str, function: str, *arguments: Any, imports: Sequence[str], held: int
    ) -> subprocess.Popen[bytes] | None:
        """Call a function in a process that holds a descriptor open as long as it lives.

        Its process is given where it is begun anew; of a copy nothing is known but what it holds.
        """
        if not FORKS:
            return _begun(child_command(module, function, *arguments), held)
        order = {"module": module, "function": function, "arguments": arguments, "imports": [*imports]}
        text = json.dumps(order).encode()
        if self._orders is not None:
            with suppress(OSError):  # it was killed: there is another one
                socket.send_fds(self._orders, [text], [held])
                return None
        self._orders, taken = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with taken:
            self._server = _begun(child_command(__name__, "serve", taken.fileno()), taken.fileno())
        socket.send_fds(self._orders, [text], [held])
        return None


def _begun(command: list[str], held: int) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | ENVIRONMENT,
        start_new_session=True,
        pass_fds=(held,) if os.name == "posix" else (),
    )


def serve(descriptor: int) -> None:
    """Copy this process for every order that comes, until nobody is left who could give one."""

    def bury(*_: Any) -> None:
        with suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass

    signal.signal(signal.SIGCHLD, bury)
    orders = socket.socket(fileno=descriptor)
    while True:
        text, held, _, _ = socket.recv_fds(orders, _MOST, 1)
        if not text:
            return
        order = json.loads(text)
        for module in order["imports"]:
            with suppress(Exception):  # the copy meets it again, and says so
                import_module(module)
        gc.freeze()
        try:
            is_copy = os.fork() == 0
        except OSError:  # no room for a process: it counts as one that was killed
            is_copy = False
        if is_copy:
            try:
                orders.close()
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                os.setsid()
                getattr(import_module(order["module"]), order["function"])(*order["arguments"])
            finally:
                os._exit(0)
        for one in held:
            os.close(one)
