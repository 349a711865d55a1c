"""``python -m rotordrop_bench`` and the command ``rotordrop-bench``."""

from __future__ import annotations

from rotordrop_bench.cli.app import main

if __name__ == "__main__":
    main()
