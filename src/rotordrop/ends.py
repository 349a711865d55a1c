"""The order in which the ends of a machine are shown: the one away from its drive first."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TypeVar

_FAR = re.compile(r"NDE|NAS", re.IGNORECASE)
"""The end away from the drive in names of planes and bearings, English and German."""

One = TypeVar("One")


def far_end_first(things: Iterable[One], name: Callable[[One], str]) -> list[One]:
    """The things with those first whose name is of the end away from the drive, else in their order."""
    return sorted(things, key=lambda one: not _FAR.search(name(one)))
