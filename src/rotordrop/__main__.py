"""``python -m rotordrop`` and the command ``rotordrop``: also Ctrl-C while the verbs are being loaded."""

from __future__ import annotations

import os
import sys
from importlib import import_module

from rotordrop.cli import INTERRUPTED, STOPPED


def main(module: str = "rotordrop.cli.app", name: str = "rotordrop") -> None:
    """Entry point of the command ``rotordrop``, or of another program whose module has a ``main``."""
    try:
        command = import_module(module).main
    except KeyboardInterrupt:
        sys.stderr.write(f"{name}: {STOPPED}\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)  # an interrupted import of generated code would make Python kill itself
    command()


if __name__ == "__main__":
    main()
