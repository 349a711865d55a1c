"""Unbalance of one plane as a drop shows it: how large, and where against the mark of the shaft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rotordrop.known import Known


@dataclass(frozen=True, kw_only=True)
class PlaneUnbalance:
    """Unbalance of one plane as a drop shows it."""

    node: int
    """Where it sits, counted from 1."""
    amount: Known
    """Mass times radius [kg m]."""
    phase: Known | None
    """Direction of the heavy spot when the mark passes, from +y, positive with the spin [rad]; None where the
    record has no mark, or does not tell a direction."""
    reason: str = ""
    """Why there is no phase; empty where there is one."""

    def sentence(self) -> str:
        """Amount and phase with their 90 % intervals, or why there is no phase."""
        low, high = self.amount.interval_90 or (self.amount.value,) * 2
        size = f"{1e6 * self.amount.value:.3g} g mm (90 %: {1e6 * low:.3g} to {1e6 * high:.3g})"
        begin = f"unbalance at node {self.node}: {size}, its phase "
        if self.phase is None:
            return begin + self.reason
        at, (first, last) = math.degrees(self.phase.value), self.phase.interval_90 or (self.phase.value,) * 2
        spread = f"{math.degrees(first):.0f} to {math.degrees(last):.0f}°"
        return f"{begin}{at:.0f}° ({spread}) from +y with the spin when the mark of the shaft passes"


def unbalance_notes(planes: Sequence[PlaneUnbalance]) -> tuple[str, ...]:
    """What the planes say, or in one line why none of them has a phase."""
    if any(one.phase is not None for one in planes):
        return tuple(one.sentence() for one in planes)
    return tuple(
        f"the phase of the unbalance is {reason}" for reason in dict.fromkeys(p.reason for p in planes)
    )
