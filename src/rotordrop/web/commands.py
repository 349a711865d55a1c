"""What the page has from the commands of rotordrop themselves, each in a process of its own with limits."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from rotordrop.errors import UsageError

_PROGRAM = (
    "import json, sys; order = json.loads(sys.argv[1]); sys.path[:] = order['sys_path']; "
    "from rotordrop.web.child import limit; limit(order['memory'], order['seconds']); "
    "sys.argv[:] = ['rotordrop', *order['arguments']]; from rotordrop.__main__ import main; main()"
)


def said_by_command(arguments: list[str], *, memory: int, seconds: int, folder: Path | None = None) -> str:
    """What a command prints, run in a folder with that much memory [byte] and time [s].

    Raises
    ------
    UsageError
        With its own words where it fails.
    """
    order = {"arguments": arguments, "memory": memory, "seconds": seconds}
    paths = [os.path.abspath(entry) for entry in sys.path if entry]  # noqa: PTH100 - entries stay texts
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-c", _PROGRAM, json.dumps({**order, "sys_path": paths})],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=seconds,
            cwd=folder,
            env=os.environ | {"NO_COLOR": "1", "COLUMNS": "1000", "PYTHONIOENCODING": "utf-8"},
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise UsageError(f"rotordrop {arguments[0]} came to no end within {seconds} s") from None
    if done.returncode != 0:
        words = done.stderr.decode("utf-8", "replace").strip()
        raise UsageError(words or f"rotordrop {arguments[0]} failed without a word")
    return done.stdout.decode("utf-8")
