"""Starts rotordrop where there is no Python: the command line, and the children that it starts of itself.

Files are read and drops are computed in processes of their own, begun as ``sys.executable -I -c PROGRAM …``.
In a bundle that is this program, which then does as Python would.
"""

from __future__ import annotations

import multiprocessing
import sys

if __name__ == "__main__":
    multiprocessing.freeze_support()
    if sys.argv[1:3] == ["-I", "-c"]:
        program = sys.argv[3]
        sys.argv[:] = ["-c", *sys.argv[4:]]
        exec(program)
    else:
        from rotordrop.__main__ import main

        main()
