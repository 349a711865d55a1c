"""What changed since earlier drops of a set of bearings, as evidence for or against each kind of damage."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.estimate.changed import changes
from rotordrop.estimate.published import Drop, Value
from rotordrop.known import NINETY
from rotordrop.restart.damages import AIR_GAP, DAMAGES, UNBALANCE, Effect
from rotordrop.units import format_amount

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
"""Gauss's rule for an expectation over a standard normal number."""

IMPOSSIBLE = 3.0
"""Standard errors from which a change that cannot be is named, one in 740 sound ones; chosen."""
SAME_SPEED = 0.05
"""Difference of the speeds of two drops up to which unbalances are compared [1]; chosen."""


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """One change, and what it says of one kind of damage at one bearing."""

    kind: str
    bearing: str
    """Empty where it belongs to the rotor."""
    what: str
    """The change in words."""
    since: str
    """Record of the drop since which it is."""
    ratios: tuple[float, ...]
    """Likelihood with the damage over that of a sound machine, for damage done by each drop in their order,
    the present one last; one up to the first estimate, which no change goes back beyond [1]."""
    ratio: float
    """The same on average over the drops after the first estimate [1]."""
    smaller: float | None = None
    """Standard errors by which a gap became smaller, where that is beyond chance [1]."""


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


def indicators(drop: Drop, earlier: Sequence[Drop]) -> tuple[Indicator, ...]:
    """What changed since the earlier estimates, in their order, by likelihood ratio for each kind of damage.

    A change that the records do not determine says nothing, and neither does an estimate that is not
    consistent with its record.
    """
    if not drop.consistent:
        return ()
    moved = {
        k: (*_parameters(one, drop), *_unbalances(one, drop))
        for k, one in enumerate(earlier)
        if one.consistent
    }
    found = []
    places = [
        (kind, bearing, path, effect)
        for kind, damage in DAMAGES.items()
        for bearing in (("",) if damage.of_machine else drop.bearings)
        for path, effect in damage.moves.items()
    ]
    for kind, bearing, path, effect in places:
        seen = {k: one for k, of in moved.items() for one in of if (one.place, one.path) == (bearing, path)}
        if not seen:
            continue
        ratios = _ratios(seen, len(earlier), effect)
        smaller = _shrunk(seen, effect) if path == AIR_GAP else None
        if smaller is not None:  # what cannot be says nothing, neither for nor against
            ratios = np.ones_like(ratios)
        found.append(
            Indicator(
                kind=kind,
                bearing=bearing,
                what=seen[min(seen)].what,
                since=earlier[min(seen)].record,
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
    """The unbalance of each plane that both drops know, of one speed: planes stand for what is spread along
    the shaft, and how much each takes of it goes with the speed.
    """
    if abs(drop.speed_Hz - since.speed_Hz) > SAME_SPEED * drop.speed_Hz:
        return
    before = {one.node: _logarithm(one.amount_kg_m) for one in since.unbalance}
    for one in drop.unbalance:
        was, now = before.get(one.node), _logarithm(one.amount_kg_m)
        if was is not None and now is not None:
            change = now[0] - was[0]
            what = f"unbalance at node {one.node} × {format_amount(math.exp(change))}"
            error = math.hypot(was[1], now[1])
            yield _Moved(place="", path=UNBALANCE, what=what, change=change, error=error)


def _logarithm(value: Value) -> tuple[float, float] | None:
    """Middle and standard error of the logarithm of a number; None where its interval reaches zero."""
    ends = value.interval
    if ends is None or ends[0] <= 0.0:
        return None
    return math.log(value.value), math.log(ends[1] / ends[0]) / (2.0 * NINETY)


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


def in_order(drop: Drop, since: Sequence[Drop]) -> list[Drop]:
    """Earlier estimates by the dates of their records, or as they are given where one has no date.

    Raises
    ------
    UsageError
        If one is later than the present drop, or of the same recording.
    """
    now = _day(drop.recorded)
    for one in since:
        if one.record_sha256 and one.record_sha256 == drop.record_sha256:
            raise UsageError(
                f"{one.record} and {drop.record} are of one recording; name the estimate of an earlier drop"
            )
        if now is not None and (day := _day(one.recorded)) is not None and day > now:
            raise UsageError(
                f"{one.record} is of {one.recorded}, later than {drop.record} of {drop.recorded}; "
                "name estimates of earlier drops"
            )
    days = {id(one): _day(one.recorded) for one in since}
    if None in days.values():
        return list(since)
    return sorted(since, key=lambda one: days[id(one)] or datetime.min)


def _day(text: str) -> datetime | None:
    """A moment by the clock of the place, to compare; zones differ by less than two drops do."""
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        return None
