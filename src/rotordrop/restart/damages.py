"""Kinds of damage, how each moves what an estimate finds, and the checks that would show it.

Sizes and scatter are assumed where no source stands beside them; none was measured here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rotordrop.errors import UsageError

AIR_GAP = "air_gap"
"""What wear only makes larger."""
UNBALANCE = "unbalance"
"""What belongs to the rotor."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """How a damage moves a parameter: its change is log-normal about a median."""

    median: float
    """Median change with its sign: of the logarithm [1], or [m] of a gap."""
    spread: float
    """Standard deviation of the logarithm of its size [1]."""
    healthy: float
    """Standard deviation of the parameter at one drop of a sound machine, in the unit of the median."""


@dataclass(frozen=True, kw_only=True)
class Damage:
    """One kind of damage."""

    label: str
    """For people, after "a" or "an"."""
    moves: Mapping[str, Effect]
    """Parameters that it moves, by their path at a bearing; empty where no parameter shows it."""
    of_machine: bool = False
    """Whether it belongs to the rotor and not to one bearing."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """Something that can be done before a restart."""

    label: str
    shows: tuple[str, ...]
    """Kinds of damage that it shows."""


DAMAGES: Mapping[str, Damage] = {
    "worn": Damage(
        label="worn landing surface",
        moves={AIR_GAP: Effect(median=15e-6, spread=0.6, healthy=2e-6)},
    ),
    "brinelled": Damage(label="brinelled race", moves={}),
    "dragging": Damage(
        label="dry or dragging ring",
        moves={
            "race.drag_coefficient": Effect(median=math.log(5.0), spread=0.5, healthy=0.3),
            "friction.dynamic": Effect(median=math.log(1.4), spread=0.6, healthy=0.05),
        },
    ),
    "loose": Damage(
        label="loose support or mount",
        moves={"support.stiffness": Effect(median=math.log(0.6), spread=0.6, healthy=0.02)},
    ),
    "unbalance": Damage(
        label="changed unbalance",
        moves={UNBALANCE: Effect(median=math.log(2.5), spread=0.5, healthy=0.1)},
        of_machine=True,
    ),
}

CHECKS: Mapping[str, Check] = {
    "lift": Check(label="lift check of the air gap", shows=("worn", "loose")),
    "tail": Check(label="record of the rotor at rest in its bearings", shows=("worn", "loose")),
    "turning": Check(label="turning the rings by hand", shows=("brinelled", "dragging")),
    "borescope": Check(label="borescope", shows=("worn", "brinelled", "loose")),
    "coast-down": Check(label="coast-down time against the baseline", shows=("dragging", "unbalance")),
}


def require_check(name: str, outcome: str) -> None:
    """Refuse a check that nobody knows, or an outcome that is neither good nor bad.

    Raises
    ------
    UsageError
        Names what was given and what is known.
    """
    if name not in CHECKS:
        raise UsageError(f"there is no check {name!r}; there are {', '.join(CHECKS)}")
    if outcome not in ("good", "bad"):
        raise UsageError(f"check {name} = {outcome!r}; expected good or bad")
