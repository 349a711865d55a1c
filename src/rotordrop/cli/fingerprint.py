"""Print a hash of a short drop: equal on two computers where every drop has the same bits on both.

Result files carry the same hash; compare them before comparing two results point by point.
"""

from __future__ import annotations

import typer


def fingerprint() -> None:
    """Print the hash of a short probe drop, which tells whether two computers compute the same bits."""
    from rotordrop.simulation.fingerprint import fingerprint as of_this_computer

    typer.echo(of_this_computer())
