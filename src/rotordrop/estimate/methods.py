"""The two ways to find force and stress in a record, each with its options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias


@dataclass(frozen=True, kw_only=True)
class Tracked:
    """Follow the record with the drop model, by a filter and a smoother.

    Attributes
    ----------
    quick : bool
        One pass instead of three; for a calibrated machine only.
    """

    quick: bool = False


@dataclass(frozen=True, kw_only=True)
class Replay:
    """Identify step by step, then replay the drop open loop (Neisi 2020, Fig. 4).

    Attributes
    ----------
    fixed : path or mapping, optional
        An earlier estimate whose supports and friction are used as they are (Neisi 2020, section 5.1).
    draws : int
        Draws behind the intervals of force and stress; fewer than 64 give no interval.
    starts : int
        Starts of the search for the supports.
    threads : int, optional
        Threads; all cores by default.
    """

    fixed: str | Path | Mapping[str, Any] | None = None
    draws: int = 64
    starts: int = 8
    threads: int | None = None


Method: TypeAlias = Tracked | Replay
