"""``python -m rotordrop`` and the command ``rotordrop``: also Ctrl-C while the verbs are being loaded."""

from __future__ import annotations

import os
import sys

from rotordrop.cli import INTERRUPTED, STOPPED


def main() -> None:
    """Entry point of the command ``rotordrop``."""
    try:
        from rotordrop.cli.app import main as command
    except KeyboardInterrupt:
        sys.stderr.write(f"rotordrop: {STOPPED}\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)  # an interrupted import of generated code would make Python kill itself
    command()


if __name__ == "__main__":
    main()
