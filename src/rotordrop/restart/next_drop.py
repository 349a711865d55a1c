"""What the next drop would be if the machine was restarted: at its speed, and at lower ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.study.repeat import COMPARED, repeat_study
from rotordrop.study.run import run_study
from rotordrop.study.summary import StudyResults, exceedance

DROPS = 40
"""Drops behind the prediction at each speed; chosen, not measured: an interval says what they tell."""
SLOWER = (0.7,)
"""Speeds that are tried as limits, over the full one [1]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class NextDrop:
    """The next drop at one speed."""

    speed: float
    """[rad/s]."""
    peak_force: dict[str, tuple[Known, Known]]
    peak_stress: dict[str, tuple[Known, Known]]
    """Half and 95 % of the drops stay below, by bearing [N, Pa]."""
    beyond_limit: Known | None = None
    """Share of the drops that pass a limit at any bearing [1]; None where no limit was given."""

    @property
    def beyond(self) -> float:
        """Chance that a limit is passed [1]; zero where none was given."""
        return 0.0 if self.beyond_limit is None else self.beyond_limit.value


def next_drops(
    machine: Machine,
    speed: float,
    limits: Mapping[str, float],
    *,
    shares: Sequence[float] = (1.0, *SLOWER),
    drops: int = DROPS,
    duration: float = 0.2,
    seed: int = 1,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[NextDrop, ...]:
    """Simulate the drops that could happen next, at a speed [rad/s] and at shares of it.

    ``limits`` are known by the field of an estimate document (``"peak_stress_Pa"``) [SI]. What the machine
    file leaves open varies as in `repeat_study`; damage is not simulated.
    """
    names = [bearing.name for bearing in machine.touchdown_bearings]
    found = []
    for k, share in enumerate(shares):
        study = repeat_study(machine, share * speed, duration=duration, drops=drops, seed=seed)
        with TemporaryDirectory() as folder:
            results = run_study(study, Path(folder) / "drops")
        beyond = [
            results.column(f"{name}.{COMPARED[field]}") / limit
            for field, limit in limits.items()
            for name in names
        ]
        found.append(
            NextDrop(
                speed=share * speed,
                peak_force={name: _middle_and_high(results, f"{name}.peak_force") for name in names},
                peak_stress={name: _middle_and_high(results, f"{name}.peak_stress") for name in names},
                beyond_limit=exceedance(np.max(beyond, axis=0), 1.0) if beyond else None,
            )
        )
        if progress is not None:
            progress("the next drop", (k + 1) / len(shares))
    return tuple(found)


def _middle_and_high(results: StudyResults, column: str) -> tuple[Known, Known]:
    """What half and 95 % of the drops stay below."""
    return results.quantile(column, 0.5), results.quantile(column, 0.95)
