"""What an estimate says of the damage a drop may have done: a prior and a likelihood ratio of every kind."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rotordrop.errors import UsageError
from rotordrop.estimate.changed import changes
from rotordrop.estimate.published import Drop, Value
from rotordrop.known import NINETY
from rotordrop.restart.assumptions import BRINELLED, Assumptions, Damage, Effect
from rotordrop.units import format_chance

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
"""Gauss's rule for an expectation over a standard normal number."""


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """One thing that is known of one kind of damage at one bearing."""

    kind: str
    bearing: str
    """Empty where it belongs to the rotor."""
    what: str
    """In words."""
    ratio: float
    """Likelihood with the damage over that without it [1]."""


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """One kind of damage at one bearing."""

    kind: str
    bearing: str
    prior: float
    """Chance before the parameters of the estimate are looked at, its peak stress counted [1]."""
    probability: float
    """Chance after that [1]."""


@dataclass(frozen=True, kw_only=True)
class _Moved:
    """One number that both estimates state."""

    place: str
    """Bearing, or empty for the rotor."""
    path: str
    """Of a damage's ``moves``."""
    what: str
    """In words."""
    change: float
    error: float
    """Change and its standard error: of the logarithm, or [m] of a number that is no factor."""


def indicators(drop: Drop, since: Drop | None, assumed: Assumptions) -> tuple[Indicator, ...]:
    """What changed since then, as evidence for or against each kind of damage.

    Without an earlier estimate nothing is known of a change. A change that the records do not determine says
    nothing, and neither does an estimate that is not consistent with its record.
    """
    if since is None or not (drop.consistent and since.consistent):
        return ()
    moved = (*_parameters(since, drop), *_unbalances(since, drop))
    return tuple(
        Indicator(kind=kind, bearing=bearing, what=f"{one.what} since then", ratio=_ratio(one, effect))
        for kind, damage, bearing in places(drop, assumed)
        for path, effect in damage.moves.items()
        for one in moved
        if (one.place, one.path) == (bearing, path)
    )


def places(drop: Drop, assumed: Assumptions) -> Iterator[tuple[str, Damage, str]]:
    """Every kind of damage at every place where it may be."""
    for kind, damage in assumed.damages.items():
        for bearing in ("",) if damage.of_machine else drop.bearings:
            yield kind, damage, bearing


def _parameters(since: Drop, drop: Drop) -> Iterator[_Moved]:
    """Parameters of the bearings that both records determine."""
    for one in changes(since, drop).found:
        if not one.determined:
            continue
        place, _, path = one.path.partition(".")
        low, high = (math.log(end) for end in one.interval_90) if one.factor else one.interval_90
        yield _Moved(
            place=place,
            path=path,
            what=f"{one.path} " + (f"× {one.change:.3g}" if one.factor else f"{1e6 * one.change:+.3g} µm"),
            change=math.log(one.change) if one.factor else one.change,
            error=(high - low) / (2.0 * NINETY),
        )


def _unbalances(since: Drop, drop: Drop) -> Iterator[_Moved]:
    """The unbalance of each plane that both drops know."""
    before = {one.node: _logarithm(one.amount_kg_m) for one in since.unbalance}
    for one in drop.unbalance:
        was, now = before.get(one.node), _logarithm(one.amount_kg_m)
        if was is not None and now is not None:
            change = now[0] - was[0]
            what = f"unbalance at node {one.node} × {math.exp(change):.3g}"
            error = math.hypot(was[1], now[1])
            yield _Moved(place="", path="unbalance", what=what, change=change, error=error)


def _logarithm(value: Value) -> tuple[float, float] | None:
    """Middle and standard error of the logarithm of a number; None where its interval reaches zero."""
    ends = value.interval
    if ends is None or ends[0] <= 0.0:
        return None
    return math.log(value.value), math.log(ends[1] / ends[0]) / (2.0 * NINETY)


def _ratio(moved: _Moved, effect: Effect) -> float:
    """Likelihood of a change, with the damage over that of a sound machine [1].

    The size of the effect is log-normal about its median; a sound machine scatters too.
    """
    width = math.hypot(moved.error, effect.healthy)
    sizes = effect.median * np.exp(effect.spread * _NODES)
    sound = -0.5 * (moved.change / width) ** 2
    damaged = -0.5 * ((moved.change - sizes) / width) ** 2
    most = float(damaged.max())
    # held within e^30: beyond that the shape of the tails decides, which nobody knows
    ratio = most + math.log(float(_WEIGHTS @ np.exp(damaged - most))) - sound
    return math.exp(min(max(ratio, -30.0), 30.0))


def suspicions(
    drop: Drop, found: tuple[Indicator, ...], earlier: int, assumed: Assumptions
) -> tuple[Suspicion, ...]:
    """Probability of every kind of damage at every bearing, by prior, peak stress and what changed.

    Source: Bayes' rule; the indicators of one kind at one place count as independent.
    """
    made = []
    for kind, damage, bearing in places(drop, assumed):
        prior = 1.0 - (1.0 - damage.prior) ** (earlier + 1)
        if kind == BRINELLED:
            prior = 1.0 - (1.0 - prior) * (1.0 - _dented(drop.bearings[bearing].numbers, assumed))
        odds = prior / (1.0 - prior)
        for one in found:
            odds *= one.ratio if (one.kind, one.bearing) == (kind, bearing) else 1.0
        made.append(Suspicion(kind=kind, bearing=bearing, prior=prior, probability=odds / (1.0 + odds)))
    return tuple(made)


def _dented(numbers: dict[str, Value], assumed: Assumptions) -> float:
    """Chance that the peak stress dented a race so that it matters [1].

    Normal in the logarithm of the stress, whose own interval counts.
    """
    stress = numbers["peak_stress_Pa"]
    low, high = stress.interval or (stress.value, stress.value)
    error = math.log(high / low) / (2.0 * NINETY) if low > 0.0 else math.inf
    middle = stress.value if stress.interval is None else math.sqrt(low * high)
    spread = math.hypot(error, assumed.brinelling_spread)
    score = math.log(middle / assumed.brinelling_stress) / spread
    return min(0.5 * math.erfc(-score / math.sqrt(2.0)), 1.0 - 1e-9)


def require_check(name: str, outcome: str, assumed: Assumptions) -> None:
    """Refuse a check that nobody knows, or an outcome that is neither good nor bad."""
    if name not in assumed.checks:
        raise UsageError(f"there is no check {name!r}; there are {', '.join(assumed.checks)}")
    if outcome not in ("good", "bad"):
        raise UsageError(f"check {name} = {outcome!r}; expected good or bad")


def in_words(one: Suspicion, assumed: Assumptions) -> str:
    """A suspicion as it stands in a sentence."""
    where = f" at {one.bearing}" if one.bearing else ""
    return f"{assumed.damages[one.kind].label}{where} ({format_chance(one.probability)})"
