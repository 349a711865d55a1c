"""Is a record simulated? What ships with rotordrop is, and every document and page must say so."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from importlib import resources

from rotordrop.record.record import Record


def is_simulated(record: Record) -> bool:
    """Whether a record is known to be simulated.

    It is when it is one of those that ship with rotordrop, or when its header or its notes say so.
    """
    words = " ".join((*record.metadata, *record.metadata.values(), *record.notes)).lower()
    return record.sha256 in _bundled() or "simulat" in words or "synthe" in words


@lru_cache(maxsize=1)
def _bundled() -> frozenset[str]:
    """Hashes of the recordings that ship with rotordrop."""
    found = set()
    for folder in resources.files("rotordrop").joinpath("examples").iterdir():
        if folder.is_dir():
            found |= {
                hashlib.sha256(file.read_bytes()).hexdigest() for file in folder.iterdir() if file.is_file()
            }
    return frozenset(found)
