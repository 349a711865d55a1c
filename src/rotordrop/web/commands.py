"""What the page has from the commands of rotordrop themselves, each in a process of its own with limits."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

from rotordrop.child import child_command, limit
from rotordrop.errors import UsageError


def run(arguments: list[str], memory: int, seconds: int) -> None:
    """In the child: set its limits and run a command."""
    limit(memory, seconds)
    sys.argv[:] = ["rotordrop", *arguments]
    import_module("rotordrop.__main__").main()  # the page asks for commands, and knows none of them


def said_by_command(arguments: list[str], *, memory: int, seconds: int, folder: Path | None = None) -> str:
    """What a command prints, run in a folder with that much memory [byte] and time [s].

    Raises
    ------
    UsageError
        With its own words where it fails.
    """
    try:
        done = subprocess.run(
            child_command(__name__, "run", arguments, memory, seconds),
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
