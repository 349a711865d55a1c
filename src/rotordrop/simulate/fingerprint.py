"""A hash of a short probe drop: equal on two computers where a drop has the same bits on both.

Every result file carries it. Where it differs, drops differ in their last digits at first and visibly some
contacts later, so that comparing two files point by point means nothing; statistics still agree.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache

import numpy as np

from rotordrop.simulate.result import HISTORIES, DropResult

PROBE_SPEED = 2.0 * np.pi * 100.0
PROBE_DURATION = 12e-3
"""From levitation to some milliseconds after the first contacts [s]: every part of the model takes part."""


@lru_cache(maxsize=1)
def fingerprint() -> str:
    """SHA-256 (hexadecimal) of all histories of the probe drop on this computer, computed once a process."""
    return history_hash(probe_drop())


def probe_drop() -> DropResult:
    """The paper's machine dropped from its AMBs at 100 Hz, with few modes and for 12 ms."""
    from rotordrop.machine import example_machine
    from rotordrop.simulate.case import DropCase, LevitatedStart
    from rotordrop.simulate.drop import simulate_drop

    case = DropCase(
        speed=PROBE_SPEED, duration=PROBE_DURATION, reduction="quick", start=LevitatedStart(rotor_angle=1.0)
    )
    return simulate_drop(example_machine("paper"), case)


def history_hash(result: DropResult) -> str:
    """SHA-256 of every number of every history of a drop, in hexadecimal."""
    digest = hashlib.sha256()
    for values in (result.time, *(getattr(result, name) for name in HISTORIES)):
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
