"""What the drops of a set of bearings may have damaged: odds of every kind by drop."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.estimate.changed import changes
from rotordrop.estimate.published import Drop, Value
from rotordrop.known import NINETY
from rotordrop.restart.assumptions import BRINELLED, Assumptions, Damage, Effect
from rotordrop.restart.order import EarlierDrop
from rotordrop.units import format_amount, format_chance

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
"""Gauss's rule for an expectation over a standard normal number."""


ONLY_WIDER = "air_gap"
"""What wear only makes larger."""
IMPOSSIBLE = 3.0
"""Standard errors from which a change that cannot be is named, one in 740 sound ones; chosen."""
INSPECTED = "inspection"
"""Good where the machine was inspected as the answer "inspect first" means it and left sound, its balance
included: no drop before that has left a damage."""


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """One thing that is known of one kind of damage at one bearing."""

    kind: str
    bearing: str
    """Empty where it belongs to the rotor."""
    what: str
    """In words."""
    ratios: tuple[float, ...]
    """Likelihood with the damage over that without it, for damage done by each drop in their order, the
    present one last; one up to the first estimate, which no change goes back beyond [1]."""
    ratio: float
    """The same on average over the drops after the first estimate [1]."""
    smaller: float | None = None
    """Standard errors by which a gap became smaller, where that is beyond chance [1]."""


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """One kind of damage at one bearing."""

    kind: str
    bearing: str
    prior: float
    """Chance before the parameters of the estimate are looked at, its peak stress counted [1]."""
    odds: tuple[float, ...]
    """Of each drop to have done it, over that none did, in their order, the present one last [1]."""
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


def indicators(drop: Drop, earlier: Sequence[EarlierDrop], assumed: Assumptions) -> tuple[Indicator, ...]:
    """What changed since the first of the earlier estimates, as evidence for or against each kind of damage.

    Without one nothing is known of a change. A change that the records do not determine says nothing, and
    neither does an estimate that is not consistent with its record.
    """
    if not drop.consistent:
        return ()
    estimates = {k: one.estimate for k, one in enumerate(earlier) if one.estimate is not None}
    moved = {
        k: (*_parameters(one, drop), *_unbalances(one, drop))
        for k, one in estimates.items()
        if one.consistent
    }
    found = []
    for kind, damage, bearing in places(drop, assumed):
        for path, effect in damage.moves.items():
            seen = {
                k: one for k, of in moved.items() for one in of if (one.place, one.path) == (bearing, path)
            }
            if not seen:
                continue
            ratios = _ratios(seen, len(earlier), effect)
            smaller = _shrunk(seen, effect) if path == ONLY_WIDER else None
            if smaller is not None:  # what cannot be says nothing, neither for nor against
                ratios = np.ones_like(ratios)
            found.append(
                Indicator(
                    kind=kind,
                    bearing=bearing,
                    what=f"{seen[min(seen)].what} since then",
                    ratios=tuple(ratios.tolist()),
                    ratio=float(ratios[min(seen) + 1 :].mean()),
                    smaller=smaller,
                )
            )
    return tuple(found)


def _shrunk(seen: Mapping[int, _Moved], effect: Effect) -> float | None:
    """Standard errors by which something became smaller since any estimate, where that is beyond chance."""
    below = [-one.change / math.hypot(one.error, math.sqrt(2.0) * effect.healthy) for one in seen.values()]
    return max(below) if max(below) > IMPOSSIBLE else None


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
            what=f"{one.path} "
            + (f"× {format_amount(one.change)}" if one.factor else f"{1e6 * one.change:+.3g} µm"),
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
            what = f"unbalance at node {one.node} × {format_amount(math.exp(change))}"
            error = math.hypot(was[1], now[1])
            yield _Moved(place="", path="unbalance", what=what, change=change, error=error)


def _logarithm(value: Value) -> tuple[float, float] | None:
    """Middle and standard error of the logarithm of a number; None where its interval reaches zero."""
    ends = value.interval
    if ends is None or ends[0] <= 0.0:
        return None
    return math.log(value.value), math.log(ends[1] / ends[0]) / (2.0 * NINETY)


def contradictions(found: Sequence[Indicator]) -> Iterator[str]:
    """What no bearing can have done: a gap became smaller, beyond errors and the scatter of a sound one."""
    for one in found:
        if one.smaller is not None:
            yield (
                f"A contradiction: {one.what}, where a bearing only wears wider: {one.smaller:.1f} standard "
                "errors below no change. One of the two estimates is wrong, a sensor moved, or the bearings "
                "are not the same set; this gap is no evidence against wear."
            )


def _ratios(seen: Mapping[int, _Moved], earlier: int, effect: Effect) -> Array:
    """Likelihood of a series of estimates with damage done by each drop, over that of a sound machine.

    ``seen`` is the change from an estimate to the present one, by the number of its drop. Every estimate
    has an error and the scatter of a sound machine of its own; the value of the sound machine is not known
    (flat prior); the size of the effect is log-normal about its median.
    """
    errors = np.array([one.error for one in seen.values()])
    values = np.array([*(-one.change for one in seen.values()), 0.0])
    which = np.array([*seen, earlier])
    # what two estimates differ by has the errors of both, taken as equal
    weights = 1.0 / (0.5 * np.append(errors, errors.min()) ** 2 + effect.healthy**2)

    def misfit(shift: Array) -> Array:
        left = values - shift
        return np.asarray((left**2) @ weights - (left @ weights) ** 2 / weights.sum())

    sizes = effect.median * np.exp(effect.spread * _NODES)
    sound = 0.5 * misfit(np.zeros((1, len(values))))[0]
    found = []
    for begun in range(earlier + 1):
        damaged = -0.5 * misfit(sizes[:, None] * (which >= begun))
        most = float(damaged.max())
        # held within e^30: beyond that the shape of the tails decides, which nobody knows
        ratio = most + math.log(float(_WEIGHTS @ np.exp(damaged - most))) + sound
        found.append(math.exp(min(max(ratio, -30.0), 30.0)))
    return np.array(found)


def suspicions(
    drop: Drop,
    found: Sequence[Indicator],
    earlier: Sequence[EarlierDrop],
    assumed: Assumptions,
    *,
    inspected: bool = False,
) -> tuple[Suspicion, ...]:
    """Odds of every kind of damage at every bearing by drop: prior, peak stresses and what changed.

    ``inspected`` says that the machine was inspected after the present drop and left sound.
    Source: Bayes' rule over which drop did the damage; indicators of one kind at one place count as
    independent.
    """
    cleared = [*(one.checks.get(INSPECTED) == "good" for one in earlier), inspected]
    last = max((k for k, yes in enumerate(cleared) if yes), default=-1)
    made = []
    for kind, damage, bearing in places(drop, assumed):
        kept = np.full(len(cleared), 1.0 - damage.prior)
        if kind == BRINELLED:
            now = {bearing: drop.bearings[bearing].numbers["peak_stress_Pa"]}
            stresses = [*(one.stresses for one in earlier), now]
            kept *= [1.0 - _dented(one[bearing], assumed) if bearing in one else 1.0 for one in stresses]
        kept[: last + 1] = 1.0
        left = np.cumprod(kept)
        likelihood = np.ones(len(kept))
        for one in found:
            if (one.kind, one.bearing) == (kind, bearing):
                likelihood = likelihood * one.ratios
        odds = -np.diff(left, prepend=1.0) / left[-1] * likelihood
        made.append(
            Suspicion(
                kind=kind,
                bearing=bearing,
                prior=float(1.0 - left[-1]),
                odds=tuple(odds.tolist()),
                probability=float(odds.sum() / (1.0 + odds.sum())),
            )
        )
    return tuple(made)


def _dented(stress: Value, assumed: Assumptions) -> float:
    """Chance that the peak stress dented a race so that it matters [1].

    Normal in the logarithm of the stress, whose own interval counts.
    """
    low, high = stress.interval or (stress.value, stress.value)
    error = math.log(high / low) / (2.0 * NINETY) if low > 0.0 else math.inf
    middle = stress.value if stress.interval is None else math.sqrt(low * high)
    spread = math.hypot(error, assumed.brinelling_spread)
    score = math.log(middle / assumed.brinelling_stress) / spread
    return min(0.5 * math.erfc(-score / math.sqrt(2.0)), 1.0 - 1e-9)


def require_check(name: str, outcome: str, assumed: Assumptions) -> None:
    """Refuse a check that nobody knows, or an outcome that is neither good nor bad."""
    if name == INSPECTED and outcome == "bad":
        raise UsageError(
            "check inspection = 'bad'; state inspection=good once what was found is mended, and count the "
            "drops of exchanged bearings under a name of their own (log add --bearings)"
        )
    if name not in (*assumed.checks, INSPECTED):
        raise UsageError(f"there is no check {name!r}; there are {', '.join((*assumed.checks, INSPECTED))}")
    if outcome not in ("good", "bad"):
        raise UsageError(f"check {name} = {outcome!r}; expected good or bad")


def in_words(one: Suspicion, assumed: Assumptions) -> str:
    """A suspicion as it stands in a sentence."""
    where = f" at {one.bearing}" if one.bearing else ""
    return f"{assumed.damages[one.kind].label}{where} ({format_chance(one.probability)})"
