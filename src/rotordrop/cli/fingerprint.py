"""Print a hash that tells whether drops have the same bits.

It is that of a short probe drop, equal on two computers where every drop has the same bits on both. Result
files carry it; compare it before comparing two results point by point.
"""

from __future__ import annotations

from rotordrop.cli._options import JsonOption
from rotordrop.cli._output import deliver


def fingerprint(json_file: JsonOption = None) -> None:
    """Print a hash that tells whether drops have the same bits on two computers."""
    from rotordrop.simulate.fingerprint import fingerprint as of_this_computer

    found = of_this_computer()
    deliver({"fingerprint": found}, json_file, lambda out: out.print(found, no_wrap=True, crop=True))
