"""Many drops of one machine on threads: one drop per thread, the interpreter lock released in the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count

from rotordrop.machine import Machine
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult


def simulate_drops(
    models: Sequence[Machine | DropModel], cases: Sequence[DropCase], *, threads: int | None = None
) -> list[DropResult]:
    """Simulate several drops at once, in the order given and with the same results as one by one.

    Parameters
    ----------
    models : sequence of Machine or DropModel, length N
        One machine or model for each drop; repeat it for equal machines.
    cases : sequence of DropCase, length N
        One case for each drop.
    threads : int, optional
        Number of threads; all cores by default.
    """
    with ThreadPoolExecutor(max_workers=threads or cpu_count() or 1) as pool:
        return list(pool.map(simulate_drop, models, cases, chunksize=1))
