"""What is known when a machine is to run again after a drop: evidence of damage, next drop, lift, checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rotordrop.estimate.changed import unlike
from rotordrop.estimate.published import Drop
from rotordrop.known import Known
from rotordrop.require import each, require
from rotordrop.restart.damages import AIR_GAP, CHECKS, Check, require_check
from rotordrop.restart.evidence import Indicator, in_order, indicators

POSITIVE = 3.0
"""Likelihood ratio from which evidence is called positive. Source: Kass and Raftery, Bayes factors, J. Am.
Stat. Assoc. 90, 1995, table of section 3.2."""


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


@dataclass(frozen=True, kw_only=True)
class RestartCard:
    """What is known when a machine is to run again. It says of no damage how probable it is."""

    since: tuple[str, ...]
    """Records of the earlier drops compared with, in their order."""
    indicators: tuple[Indicator, ...]
    """What changed since then, the likeliest damage first."""
    apart: tuple[str, ...]
    """Why an earlier drop is not of this machine: nothing is concluded from it."""
    checks: Mapping[str, Check]
    """Checks that were not made, by name, and which kinds of damage each would show."""
    made: Mapping[str, str]
    """Checks that were made after this drop, with their outcome."""
    gaps: Mapping[str, tuple[float, float]]
    """90 % interval of the air gap by bearing, which a lift check would confirm [m]."""
    foreseen: Foreseen
    """What the next drop would be, by speed, the speed limit, and the lift."""

    @property
    def positive(self) -> tuple[Indicator, ...]:
        """Changes that speak of a damage."""
        return tuple(one for one in self.indicators if one.ratio >= POSITIVE)


def restart_card(
    drop: Drop,
    *,
    earlier: Sequence[Drop] = (),
    checks: Mapping[str, str] | None = None,
    foreseen: Foreseen | None = None,
) -> RestartCard:
    """Collect what is known when a machine is to run again after a drop.

    Parameters
    ----------
    drop : Drop
        Published estimate of the drop.
    earlier : sequence of Drop
        Published estimates of earlier drops of the same bearings; best from the first one on.
    checks : mapping of str to "good" or "bad"
        Checks that were made after this drop, with their outcome.
    foreseen : Foreseen, optional
        What the next drop would be, the speed limit, and the lift.

    Raises
    ------
    UsageError
        For a check or an outcome that nobody knows, or an earlier drop that was later.
    """
    require(drop, "drop", Drop, hint="read_drop(Path('drop.json')) gives one")
    each(earlier, "earlier", Drop)
    require(foreseen, "foreseen", Foreseen, none=True, hint="next_drops(machine, speed, {}) gives one")
    made = dict(require(checks or {}, "checks", Mapping, hint="Write {'lift': 'good'}"))
    for name, outcome in made.items():
        require_check(name, outcome)
    ordered = in_order(drop, earlier)
    apart = {one.record: words for one in ordered if (words := unlike(one, drop))}
    ordered = [one for one in ordered if one.record not in apart]
    found = indicators(drop, ordered)
    gaps = {
        one.path.removesuffix(f".{AIR_GAP}"): ends
        for one in drop.parameters
        if one.path.endswith(f".{AIR_GAP}") and (ends := one.estimate.interval) is not None
    }
    return RestartCard(
        since=tuple(one.record for one in ordered),
        indicators=tuple(sorted(found, key=lambda one: -one.ratio)),
        apart=tuple(apart.values()),
        checks={name: one for name, one in CHECKS.items() if name not in made},
        made=made,
        gaps=gaps,
        foreseen=foreseen or Foreseen(),
    )
