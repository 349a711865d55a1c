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
from rotordrop.study.summary import quantile, share_of

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
    found = []
    for k, share in enumerate(shares):
        study = repeat_study(machine, share * speed, duration=duration, drops=drops, seed=seed)
        with TemporaryDirectory() as folder:
            results = run_study(study, Path(folder) / "drops")
            names = [bearing.name for bearing in machine.touchdown_bearings]
            values = {name: {c: results.column(f"{name}.{c}") for c in COMPARED.values()} for name in names}
        over = np.zeros(len(results), dtype=bool)
        for field, limit in limits.items():
            for name in names:
                over |= values[name][COMPARED[field]] > limit
        count = int(over.sum())

        def low_and_high(
            column: str, values: Mapping[str, Mapping[str, np.ndarray]] = values
        ) -> dict[str, tuple[Known, Known]]:
            return {
                name: (quantile(columns[column], 0.5), quantile(columns[column], 0.95))
                for name, columns in values.items()
            }

        found.append(
            NextDrop(
                speed=share * speed,
                peak_force=low_and_high("peak_force"),
                peak_stress=low_and_high("peak_stress"),
                beyond_limit=share_of(count / len(over), count, count, len(over)) if limits else None,
            )
        )
        if progress is not None:
            progress("the next drop", (k + 1) / len(shares))
    return tuple(found)
