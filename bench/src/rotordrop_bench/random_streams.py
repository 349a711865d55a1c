"""Random numbers of a synthesis: one reproducible stream for every purpose."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Generator (Philox) for one purpose; adding a purpose never shifts the numbers of another."""
    sequence = np.random.SeedSequence([seed, zlib.crc32(purpose.encode())])
    return np.random.Generator(np.random.Philox(sequence))
