"""What is foreseen of the next drop: its loads at each speed, and the speed limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rotordrop.known import Known


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


@dataclass(frozen=True, kw_only=True)
class LiftNow:
    """Whether the magnets lift the rotor from where it rests, by simulated lifts at standstill."""

    probability: Known
    """Share of the lifts that succeed [1]."""
    took: tuple[float, float] | None
    """Shortest and longest time of those until the rotor touches nothing any more [s]; None without one."""
    current: dict[str, float | None]
    """Control current of each AMB that carries its share of the weight there [A]; None beyond its limit."""
    limit: dict[str, float]
    """Limit of the current of each AMB [A]."""


@dataclass(frozen=True, kw_only=True)
class Foreseen:
    """Next drops by speed, the full one first, the speed limit where limits were given, and the lift where
    the magnets are described.
    """

    drops: tuple[NextDrop, ...] = ()
    duration: float = 0.0
    """How much of each drop was simulated [s]."""
    speed_limit: float | None = None
    """Highest speed of ``drops`` at and below which no more than the allowed share of them passes a limit
    [rad/s]; None where even the lowest passes it more often, or no limit was given."""
    chance: float = 0.0
    """Share of the drops that is allowed to pass a limit [1]."""
    lift: LiftNow | None = None
    limits: Mapping[str, float] = field(default_factory=dict)
    """Limits that were given [SI], by the field of an estimate document."""
    of_estimate: bool = False
    """Whether the machine is the one that the estimate found, with its intervals; else that of its file."""
