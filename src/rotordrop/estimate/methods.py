"""The two ways to find force and stress in a record, each with its options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

from rotordrop.require import require


@dataclass(frozen=True, kw_only=True)
class Tracked:
    """Follow the record with the drop model, by a filter and a smoother."""

    quick: bool = False
    """One pass instead of three; for a calibrated machine only."""

    def __post_init__(self) -> None:
        require(self.quick, "quick", bool)


@dataclass(frozen=True, kw_only=True)
class Replay:
    """Identify step by step, then replay the drop open loop (Neisi 2020, Fig. 4)."""

    fixed: str | Path | Mapping[str, Any] | None = None
    """An earlier estimate whose supports and friction are used as they are (Neisi 2020, section 5.1)."""
    starts: int = 8
    """Starts of the search for the supports."""
    threads: int | None = None
    """Threads; all cores by default."""

    def __post_init__(self) -> None:
        require(self.fixed, "fixed", str, PathLike, Mapping, none=True)
        require(self.starts, "starts", int, least=1, most=1_000)
        require(self.threads, "threads", int, least=1, none=True)


Method: TypeAlias = Tracked | Replay
