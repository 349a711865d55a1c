"""The two ways to find force and stress in a record, each with its options."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

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
    """Replay the drop open loop with what the twin identified of it (Neisi 2020, Fig. 4)."""


Method: TypeAlias = Tracked | Replay
