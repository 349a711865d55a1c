"""``python -m rotordrop_bench`` and the command ``rotordrop-bench``."""

from __future__ import annotations

from rotordrop.__main__ import main as guarded


def main() -> None:
    """Entry point of the command ``rotordrop-bench``."""
    guarded("rotordrop_bench.cli.app", "rotordrop-bench")


if __name__ == "__main__":
    main()
