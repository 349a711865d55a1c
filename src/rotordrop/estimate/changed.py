"""What changed between two drops: parameters that one value cannot explain in both."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Parameter
from rotordrop.elements.table import fitted_row, row_of
from rotordrop.errors import UsageError
from rotordrop.estimate import published
from rotordrop.estimate.published import Drop, Joint
from rotordrop.known import NINETY, deviation_of
from rotordrop.physics.linear_algebra import solve, symmetric_eigen
from rotordrop.require import each
from rotordrop.units import format_chance

ByPath = Mapping[str, published.Parameter]
"""Parameters of one estimate by path."""

FALSE_ALARM = 0.01
"""Probability that anything is named of two drops between which nothing changed [1]."""
FOUND = float(ndtri(0.95))
"""Standard errors beyond the level of chance from which a change is found in 19 of 20 pairs [1]."""
BY_PRIOR = 0.95
"""Standard deviation over that of the prior from which a record says nothing of its own [1]."""
SURE, LITTLE = 1e-8, 1e-6
"""Smallest variance of a record's estimate and smallest information on a change, over the prior's [1]: the
filter keeps seven digits, and a record may say nothing."""
UNKNOWN_CHANGE = math.sqrt(2.0 / (BY_PRIOR**-2 - 1.0))
"""Standard error of a change, over the prior's deviation, from which the records say nothing of it [1]."""
NO_CHANGE = 0.5 / math.sqrt(LITTLE)
"""Standard error of a change, over the prior's deviation, from which no size of it is worth a number [1]."""
STAYS = "support.mass"
"""Parameter by which another machine shows: nothing that wears moves it."""
ANOTHER = 12.0
"""Standard errors of its change from which two drops are not of one machine [1].

Source: at most 7.5 in eighteen pairs of drops of one hidden machine, 23.6 and more in four pairs of two that
one machine file describes.
"""
WATCHED: Mapping[str, float] = {
    "air_gap": 10e-6,
    "support.stiffness": math.log(1.1),
    "support.damping": math.log(1.1),
    "friction.dynamic": math.log(1.2),
    "race.drag_coefficient": math.log(2.0),
}
"""Parameters that wear, loosen or seize, with the change that is asked for: [m], or of the logarithm."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """One parameter in two drops."""

    path: str
    """Path in the machine."""
    before: float
    after: float
    """Its values [SI]."""
    change: float
    """Difference [SI], or factor where the parameter is positive by nature [1]."""
    interval_90: tuple[float, float]
    """Of the change."""
    factor: bool
    """Whether the change is a factor."""
    probability: float
    """Probability that it changed by more than what is asked for [1]."""
    named: bool
    """Whether the change is beyond chance, of all parameters looked at together."""
    smallest: float
    """Smallest change that these two records show in 19 of 20 cases: difference [SI], or factor where the
    parameter is positive by nature [1]; infinite where they show none."""
    determined: bool = True
    """Whether both records say something of it; else nothing is said."""

    @property
    def may_hide(self) -> bool:
        """Whether a change of the size that is asked for could have stayed unseen."""
        least = _watched(self.path)
        assert least is not None
        asked = math.exp(least) if self.factor else least
        return not self.named and (not self.determined or self.smallest > asked)

    @property
    def smallest_text(self) -> str:
        """Smallest change that would have been found, in words."""
        if math.isinf(self.smallest):
            return "of any size"
        return f"× {self.smallest:.3g}" if self.factor else f"{1e6 * self.smallest:.2g} µm"


def asked_for() -> str:
    """The sizes of `WATCHED` in words."""
    percent = {path: f"{100.0 * (math.exp(size) - 1.0):.0f} %" for path, size in WATCHED.items()}
    return (
        f"Asked for: {1e6 * WATCHED['air_gap']:g} µm of a gap, {percent['support.stiffness']} of a stiffness "
        f"and {percent['support.damping']} of damping, {percent['friction.dynamic']} of friction, "
        f"a factor of {math.exp(WATCHED['race.drag_coefficient']):g} of the drag"
    )


@dataclass(frozen=True, kw_only=True)
class Changes:
    """What changed between two drops."""

    first: str
    second: str
    """The drops."""
    found: tuple[Change, ...]
    """Every parameter looked at, the surest change first."""

    @property
    def named(self) -> tuple[Change, ...]:
        """Parameters that changed beyond chance."""
        return tuple(one for one in self.found if one.named)

    def __repr__(self) -> str:
        """The outcome in words."""
        return f"<Changes: {self.sentence()}>"

    def sentence(self, name_of: Callable[[str], str] = str) -> str:
        """The outcome in words, with parameters by their paths or by other names."""
        hidden = ", ".join(f"{name_of(one.path)} {one.smallest_text}" for one in self.found if one.may_hide)
        unseen = f" Smaller changes than these may hide: {hidden}." if hidden else ""
        if not self.named:
            return f"Between {self.first} and {self.second} no parameter changed beyond chance.{unseen}"
        parts = []
        for one in self.named:
            low, high = one.interval_90
            moved = f"{1e6 * one.change:+.3g} µm, 90 %: {1e6 * low:+.3g} to {1e6 * high:+.3g} µm"
            if one.factor:
                moved = f"× {one.change:.3g}, 90 %: {low:.3g} to {high:.3g}"
            parts.append(f"{name_of(one.path)} ({moved}, {format_chance(one.probability)})")
        return f"Between {self.first} and {self.second} changed: {', '.join(parts)}.{unseen}"


def changes(first: Drop, second: Drop) -> Changes:
    """Compare the parameters of two published estimates that were made with one machine file.

    What was known before stands in both estimates; it is taken out of each (the quotient of posterior and
    prior), so that two records of an unchanged machine differ by their own errors alone, and a tight prior
    does not hide a change. Of m parameters the level of each is `FALSE_ALARM` over m (Bonferroni).

    It is one fit to both records: everything is shared but what changed, sensors too, so that what confounds
    a parameter in both records alike does not blur its change. Parameters are let change one after the other,
    the surest first, while one is beyond chance.

    Raises
    ------
    UsageError
        If the drops are not of one machine (see `unlike`), or a model does not fit its record.
    """
    joints: list[Joint] = []
    for drop in each((first, second), "drops", Drop):
        joints.append(drop.joint)
        if not drop.consistent or drop.joint is None:
            raise UsageError(
                f"{drop.record}: the model is not consistent with this record, so its parameters say "
                "nothing of a change; expected two estimates that fit"
            )
    if first.machine != second.machine:
        raise UsageError(
            f"the drops are of {first.machine!r} and {second.machine!r}; only drops of one machine can "
            "show what changed"
        )
    if apart := unlike(first, second):
        raise UsageError(apart)
    both = [{one.path: one for one in drop.parameters} for drop in (first, second)]
    paths = [path for path in both[0] if path in both[1] and _watched(path) is not None]
    # a parameter that hardly leaves its prior is one that the linearised fit knows least of
    seen = [path for path in paths if all(_leaves_prior(one[path], row_of(path)) for one in both)]
    found = _jointly(joints, both, seen, paths)
    return Changes(
        first=first.record,
        second=second.record,
        found=tuple(sorted(found, key=lambda one: (-one.named, -one.probability))),
    )


def unlike(first: Drop, second: Drop) -> str:
    """Why two drops that one machine file describes are not of one machine; nothing where they may be.

    The mass of a support is compared while all may change that wears, loosens or seizes.
    """
    if first.joint is None or second.joint is None or not (first.consistent and second.consistent):
        return ""
    common = [path for path in first.joint.paths if path in second.joint.paths]
    free = [place for place, path in enumerate(common) if _watched(path) is not None]
    fit = _CommonFit([_own(one, common) for one in (first.joint, second.joint)], [])
    for place, path in enumerate(common):
        row = fitted_row(path)
        if row is None or row.path != STAYS:
            continue
        moved, sigma = fit.change([*free, place])
        if abs(moved) > ANOTHER * sigma:
            of = [next(p.estimate.value for p in d.parameters if p.path == path) for d in (first, second)]
            return (
                f"{first.record} and {second.record} are not of one machine, or its mounts were exchanged: "
                f"{path} is {of[0]:.3g} kg in one and {of[1]:.3g} kg in the other, {abs(moved) / sigma:.0f} "
                "standard errors apart, which no wear does; compare drops of one machine"
            )
    return ""


def _watched(path: str) -> float | None:
    row = fitted_row(path)
    return None if row is None else WATCHED.get(row.path)


def _leaves_prior(entry: published.Parameter, row: Parameter) -> bool:
    """Whether the record says something of a parameter beside what was known before.

    While a race slides, its spin-up tells (friction less drag) over inertia and none of the two alone: an
    estimate of the drag is one of the inertia's error, however sure it looks.
    """
    if row.spin_up_only or entry.prior is None:
        return not row.spin_up_only
    after, before = (
        deviation_of(known.value, known.interval, logarithmic=row.logarithmic)
        for known in (entry.estimate, entry.prior)
    )
    return after < BY_PRIOR * before


def _level(count: int) -> float:
    """Standard deviations beyond which one of so many changes is no chance."""
    return float(-ndtri(0.5 * FALSE_ALARM / max(count, 1)))


def _change(
    path: str,
    both: Sequence[ByPath],
    moved: float,
    sigma: float,
    *,
    smallest: float,
    named: bool,
) -> Change:
    """A change, its standard error and the smallest one that shows, in the measure of the parameter.

    The standard error is infinite where nothing is said. Forces go with the coefficient itself, not with its
    logarithm: where only a large one shows, it is 1 plus the smallest change, not its exponential.
    """
    factor, least = row_of(path).logarithmic, _watched(path)
    assert least is not None
    before, after = (one[path].estimate.value for one in both)
    smallest = 1.0 + smallest if factor else smallest
    determined = math.isfinite(sigma)
    moved = moved if determined else 0.0
    ends = (moved - NINETY * sigma, moved, moved + NINETY * sigma)
    low, middle, high = (math.exp(end) for end in ends) if factor else ends
    beyond = float(ndtr((moved - least) / sigma) + ndtr((-moved - least) / sigma))
    return Change(
        path=path,
        before=before,
        after=after,
        change=middle,
        interval_90=(low, high),
        factor=factor,
        probability=beyond if determined else 0.0,
        named=named,
        smallest=smallest,
        determined=determined,
    )


def _jointly(
    joints: Sequence[Joint],
    both: Sequence[ByPath],
    seen: Sequence[str],
    paths: Sequence[str],
) -> list[Change]:
    """Changes by one fit to both records that shares everything else; named only what both have seen.

    What one of them has not seen may still have changed, within its prior, and must not look like a change of
    something else.
    """
    first, second = joints
    common = [path for path in first.paths if path in second.paths]
    unseen = [common.index(path) for path in paths if path in common and path not in seen]
    fit = _CommonFit([_own(one, common) for one in (first, second)], unseen)
    scale = dict(zip(first.paths, first.prior_standard_deviation, strict=True))
    watched = [path for path in seen if path in common]
    chosen: list[str] = []
    level = _level(len(watched))
    while rest := [path for path in watched if path not in chosen]:
        sure = {path: fit.change([common.index(one) for one in (*chosen, path)]) for path in rest}
        best = max(rest, key=lambda path: abs(sure[path][0]) / sure[path][1])
        if abs(sure[best][0]) <= level * sure[best][1]:
            break
        chosen.append(best)
    found = []
    for path in paths:
        if path not in common:
            found.append(_change(path, both, 0.0, math.inf, smallest=math.inf, named=False))
            continue
        others = [one for one in chosen if one != path]
        moved, sigma = fit.change([common.index(one) for one in (*others, path)])
        known = path in watched and sigma < UNKNOWN_CHANGE
        shows = sigma < NO_CHANGE and not row_of(path).spin_up_only
        found.append(
            _change(
                path,
                both,
                moved * scale[path],
                sigma * scale[path] if known else math.inf,
                smallest=(level + FOUND) * sigma * scale[path] if shows else math.inf,
                named=path in chosen and known,
            )
        )
    return found


def _own(joint: Joint, common: Sequence[str]) -> tuple[Array, Array]:
    """What a record alone says, in standard deviations of the prior about its middle.

    Information matrix and information vector: posterior less prior.
    """
    n, at = len(joint.paths), [joint.paths.index(path) for path in common]
    lower = np.zeros((n, n))
    lower[np.tril_indices(n)] = joint.covariance
    sigma = np.array(joint.prior_standard_deviation)
    whole = (lower + np.tril(lower, -1).T) / np.outer(sigma, sigma)
    mean = (np.array(joint.mean) - np.array(joint.prior_mean)) / sigma
    size, turn = symmetric_eigen(whole[np.ix_(at, at)])
    size = np.maximum(size, SURE)
    gained = np.maximum(1.0 / size - 1.0, 0.0)
    # the record's own middle is the posterior's, moved away from the prior as far as the prior drew it
    vector = np.where(gained > 0.0, (turn.T @ mean[at]) / size, 0.0)
    return (turn * gained) @ turn.T, turn @ vector


class _CommonFit:
    """One fit to two records; every parameter is shared but those that are let change.

    ``unseen`` may differ always, by as much as two draws from the prior do.
    """

    def __init__(self, own: Sequence[tuple[Array, Array]], unseen: Sequence[int]) -> None:
        (one, seen), (self._other, self._read) = own
        self._unseen = list(unseen)
        self._shared = one + self._other + np.eye(len(one))
        self._sum = seen + self._read

    def change(self, places: Sequence[int]) -> tuple[float, float]:
        """Change of the last of some places while all of them may change, and its standard error."""
        unseen = [place for place in self._unseen if place not in places]
        held = np.array([0.5] * len(unseen) + [LITTLE] * len(places))
        places = [*unseen, *places]
        inside = self._other[:, places]
        carried = solve(self._shared, np.column_stack([inside, self._sum]))
        known = self._other[np.ix_(places, places)] - inside.T @ carried[:, :-1]
        known += np.diag(held)
        spread = solve(known, np.eye(len(places)))
        moved = spread @ (self._read[places] - inside.T @ carried[:, -1])
        return float(moved[-1]), math.sqrt(float(spread[-1, -1]))
