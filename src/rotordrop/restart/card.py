"""The restart card: which answer the chance of a damage allows, and which check would change it most.

Kinds of damage are present or not, each by itself; every answer has a cost in every such state. Up to which
chance of a damage the machine restarts, and up to which it runs with limits, follows from the costs and
the priors alone. Evidence moves that chance and not these bounds: worse evidence, which never lowers it,
never has a milder answer. A check is worth what it takes off the expected cost.
Source: Bayesian decision with the expected value of sample information, Raiffa and Schlaifer, Applied
Statistical Decision Theory, 1961.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np

from rotordrop.arrays import Array
from rotordrop.estimate.changed import unlike
from rotordrop.estimate.published import Drop
from rotordrop.known import Known
from rotordrop.restart.assumptions import Assumptions
from rotordrop.restart.evidence import (
    INSPECTED,
    Indicator,
    Suspicion,
    contradictions,
    in_words,
    indicators,
    require_check,
    suspicions,
)
from rotordrop.restart.foreseen import Foreseen, LiftNow, SpeedLimit
from rotordrop.restart.order import EarlierDrop
from rotordrop.units import format_amount, format_chance, format_quantity

Answer = Literal["restart", "restart with limits", "inspect first", "replace"]
ANSWERS: tuple[Answer, ...] = ("restart", "restart with limits", "inspect first", "replace")

SAYS_SOMETHING = math.log(1.5)
"""Logarithm of a likelihood ratio from which it counts as evidence; chosen, not measured."""
FLIPS_WITHIN = 10.0
"""Largest factor on a cost or a chance at which a flip of the answer is looked for; chosen, not measured."""
RARE = 0.005
"""Probability below which an answer is not named in the sentence [1]; chosen, not measured."""
COSTS = {
    "day_cost": "a day of standstill",
    "bearing_set_cost": "a set of bearings",
    "machine_cost": "a damaged machine",
    "inspection_days": "the standstill of an inspection",
    "exchange_days": "the standstill of an exchange",
    "replace_days": "the standstill of a replacement unseen",
    "limited_days": "what running with limits costs",
    "another_drop": "the chance of another drop",
    "most_doubt": "the chance of a damage that is allowed",
}
SHARES = ("another_drop", "most_doubt")
NOTHING_FORESEEN = Foreseen()


@dataclass(frozen=True, kw_only=True)
class CheckValue:
    """What a check that has not been made would be worth."""

    name: str
    label: str
    cost: float
    """[unit of the assumptions]."""
    value: float
    """What it takes off the expected cost, its own cost taken off [unit of the assumptions]."""
    settles: float
    """Chance that its outcome changes the answer [1]."""


@dataclass(frozen=True, kw_only=True)
class Flip:
    """How far an assumption may be wrong before the answer is another one."""

    of: str
    """In words."""
    factor: float
    """Smallest factor on it, above or below one, at which the answer changes [1]."""
    answer: Answer
    """What the answer is then."""


@dataclass(frozen=True, kw_only=True)
class RestartCard:
    """Whether a machine may run again."""

    answer: Answer
    """What may be done; of opening and replacing what costs less in expectation."""
    bounds: tuple[float, float]
    """Up to which chance of a damage it restarts, and up to which it runs with limits [1]."""
    right: dict[Answer, float]
    """Probability that each answer is the one that is right if the state was known [1]."""
    costs: dict[Answer, float]
    """Expected cost of each answer [unit of the assumptions]."""
    at_stake: float
    """Expected cost of the dearest answer less that of the cheapest one [unit of the assumptions]."""
    suspicions: tuple[Suspicion, ...]
    """Every kind of damage at every bearing, the likeliest first, checks included."""
    sound: float
    """Probability that nothing of them is there, checks included [1]."""
    indicators: tuple[Indicator, ...]
    """What the parameters of the estimate say."""
    checks: tuple[CheckValue, ...]
    """Checks that have not been made, the most valuable first."""
    made: dict[str, str]
    """Checks that were made after this drop, with their outcome."""
    carried: tuple[tuple[str, dict[str, str]], ...]
    """Checks that were made after earlier drops, by their record, in order."""
    flips: tuple[Flip, ...]
    """Assumptions on which the answer hangs, the nearest first."""
    foreseen: Foreseen
    """What the next drop would be, by speed, and the speed limit."""
    prior_alone: bool
    """Whether nothing but the assumptions decided."""
    assumptions: Assumptions
    statements: tuple[str, ...]
    """What the card says, the answer first."""

    @property
    def best_check(self) -> CheckValue | None:
        """The check that pays most; None where none pays."""
        return self.checks[0] if self.checks and self.checks[0].value > 0.0 else None


def restart_card(
    drop: Drop,
    assumed: Assumptions,
    *,
    earlier: Sequence[EarlierDrop] = (),
    checks: Mapping[str, str] | None = None,
    foreseen: Foreseen = NOTHING_FORESEEN,
    remarks: Sequence[str] = (),
) -> RestartCard:
    """Judge whether a machine may run again after a drop.

    Parameters
    ----------
    drop : Drop
        Published estimate of the drop.
    assumed : Assumptions
        Costs, kinds of damage and checks.
    earlier : sequence of EarlierDrop
        Drops that this set of bearings took before, in their order, with what is known of each: its estimate,
        its peak stresses, the checks made after it. All of it counts until the set is another one.
    checks : mapping of str to "good" or "bad"
        Checks that were made after this drop, with their outcome.
    foreseen : Foreseen
        What the next drop would be, and the speed limit.
    remarks : sequence of str
        What else is to be said, of dates that are missing for example.

    Raises
    ------
    UsageError
        For a check or an outcome that nobody knows, or estimates of two machines.
    """
    made = dict(checks or {})
    carried = tuple((one.record, dict(one.checks)) for one in earlier if one.checks)
    for name, outcome in [pair for of in (made, *(of for _, of in carried)) for pair in of.items()]:
        require_check(name, outcome, assumed)
    # an estimate of another machine says nothing of this one
    said = [unlike(one.estimate, drop) if one.estimate is not None else "" for one in earlier]
    earlier = [
        replace(one, estimate=None) if words else one for one, words in zip(earlier, said, strict=True)
    ]
    apart = [f"{words}. Nothing is concluded from that drop." for words in said if words]
    found = indicators(drop, earlier, assumed)
    suspected = suspicions(drop, found, earlier, assumed, inspected=made.get(INSPECTED) == "good")
    history = _History(suspected, [*(one.checks for one in earlier), made], assumed)
    case = _Case.of(history, foreseen)
    shown = [replace(one, probability=history.chance(k)) for k, one in enumerate(suspected)]
    costs = case.expected()
    answer = case.answer
    right = case.right()
    left = sorted(
        (case.value_of(name, made) for name in assumed.checks if name not in made), key=lambda one: -one.value
    )
    alone = not made and not carried and all(abs(math.log(one.ratio)) < SAYS_SOMETHING for one in found)
    card = RestartCard(
        answer=answer,
        bounds=case.bounds,
        right=right,
        costs=costs,
        at_stake=max(costs.values()) - min(costs.values()),
        suspicions=tuple(sorted(shown, key=lambda one: -one.probability)),
        sound=float(case.weights[0]),
        indicators=found,
        checks=tuple(left),
        made=made,
        carried=carried,
        flips=_flips(history, foreseen, answer),
        foreseen=foreseen,
        prior_alone=alone,
        assumptions=assumed,
        statements=(),
    )
    compared = any(one.estimate is not None for one in earlier)
    statements = (*_said(card, drop, compared), *apart, *contradictions(found), *remarks)
    return replace(card, statements=statements)


@dataclass(frozen=True)
class _History:
    """What the drops may have done and what the checks after each of them showed, the present one last."""

    suspected: Sequence[Suspicion]
    checks: Sequence[Mapping[str, str]]
    assumed: Assumptions

    @property
    def states(self) -> Array:
        """Kinds present (1) or not (0) in each state, the sound one first, shape (states, kinds)."""
        return np.array(list(product((0.0, 1.0), repeat=len(self.assumed.damages))))

    def weights(self) -> Array:
        """Probability of each state now, times that of what all checks showed, shape (states,).

        A kind is there from the first drop on that did it at any bearing, until the set is another one; each
        check sees what was there then. Source: forward recursion of a hidden Markov chain.
        """
        kinds, drops = list(self.assumed.damages), len(self.checks)
        later = np.ones((len(kinds), drops + 1))  # relative weight of "not before this drop"
        for one in self.suspected:
            after = np.append(np.cumsum(one.odds[::-1])[::-1], 0.0)
            later[kinds.index(one.kind)] *= 1.0 + after
        states = self.states
        weights, begun = np.zeros(len(states)), 0
        weights[0] = 1.0
        for k, made in enumerate(self.checks):
            made = {name: outcome for name, outcome in made.items() if name != INSPECTED}
            if not made and k + 1 < drops:
                continue
            grid = weights.reshape((2,) * len(kinds))
            for axis, share in enumerate(later[:, k + 1] / later[:, begun]):
                sound, damaged = np.take(grid, 0, axis), np.take(grid, 1, axis)
                grid = np.stack([share * sound, damaged + (1.0 - share) * sound], axis)
            weights, begun = grid.ravel(), k + 1
            for name, outcome in made.items():
                bad = chance_of_bad(self.assumed, name, states)
                weights = weights * (bad if outcome == "bad" else 1.0 - bad)
        return np.asarray(weights)

    def chance(self, k: int) -> float:
        """Chance of one suspicion, all checks counted [1]."""
        one = self.suspected[k]
        without = replace(one, odds=(0.0,) * len(one.odds))
        others = replace(self, suspected=[*self.suspected[:k], without, *self.suspected[k + 1 :]])
        return float(1.0 - (1.0 - one.probability) * others.weights().sum() / self.weights().sum())

    def scaled(self, kind: str, factor: float) -> _History:
        """The same with other odds of a kind of damage."""
        moved = [
            replace(one, odds=tuple(factor * odds for odds in one.odds)) if one.kind == kind else one
            for one in self.suspected
        ]
        return replace(self, suspected=moved)


def chance_of_bad(assumed: Assumptions, name: str, states: Array) -> Array:
    """Chance that a check is bad in each state, shape (states,); each damage shows by itself."""
    check = assumed.checks[name]
    shown = np.array([check.shows.get(kind, 0.0) for kind in assumed.damages])
    unseen = np.prod(1.0 - states * shown, axis=1)
    return np.asarray(1.0 - (1.0 - check.false_alarm) * unseen)


@dataclass(frozen=True)
class _Case:
    """All states of damage with their probabilities, and what each answer costs in each."""

    assumed: Assumptions
    states: Array
    """Kinds present (1) or not (0) in each state, the sound one first, shape (states, kinds)."""
    costs: Array
    """Cost of each answer in each state, shape (answers, states)."""
    weights: Array
    """Probability of each state, shape (states,)."""
    bounds: tuple[float, float]
    """Up to which chance of a damage it restarts, and up to which it runs with limits [1]."""

    @classmethod
    def of(cls, history: _History, foreseen: Foreseen) -> _Case:
        assumed, states, weights = history.assumed, history.states, history.weights()
        costs = _costs(assumed, states, _beyond(foreseen, assumed))
        sound = np.ones(len(assumed.damages))
        for one in history.suspected:
            kind = list(assumed.damages).index(one.kind)
            sound[kind] *= 1.0 - assumed.damages[one.kind].prior
        usual = np.prod(np.where(states > 0.0, 1.0 - sound, sound), axis=1)[1:]
        ends = np.column_stack([costs[:, 0], costs[:, 1:] @ usual / usual.sum()])
        restart = min(_cheapest_up_to(ends[0], ends[1:]), assumed.most_doubt)
        bounds = restart, max(restart, _cheapest_up_to(ends[1], ends[2:]))
        return cls(assumed, states, costs, weights / weights.sum(), bounds)

    def after(self, name: str, outcome: str) -> _Case:
        """The same once one more check was made."""
        bad = chance_of_bad(self.assumed, name, self.states)
        weights = self.weights * (bad if outcome == "bad" else 1.0 - bad)
        return replace(self, weights=weights / weights.sum())

    def expected(self) -> dict[Answer, float]:
        """Expected cost of each answer."""
        return dict(zip(ANSWERS, (self.costs @ self.weights).tolist(), strict=True))

    @property
    def answer(self) -> Answer:
        """The mildest answer that the chance of a damage allows; of opening and replacing the cheaper one.

        No bad check and no greater suspicion lowers that chance: the sound state is the one in which a check
        is bad least often. Opening and replacing both stop the machine.
        """
        doubt, costs = 1.0 - float(self.weights[0]), self.expected()
        if doubt <= self.bounds[0]:
            return "restart"
        if doubt <= self.bounds[1]:
            return "restart with limits"
        return "replace" if costs["replace"] < costs["inspect first"] else "inspect first"

    def right(self) -> dict[Answer, float]:
        """Probability of the states in which each answer costs least."""
        best = np.argmin(self.costs, axis=0)
        return {name: float(self.weights[best == k].sum()) for k, name in enumerate(ANSWERS)}

    def outcomes(self, name: str) -> list[tuple[float, _Case]]:
        """What a check may say: the chance of each outcome [1], and what is known then."""
        bad = chance_of_bad(self.assumed, name, self.states)
        shares = (("bad", float(bad @ self.weights)), ("good", float((1.0 - bad) @ self.weights)))
        return [(share, self.after(name, outcome)) for outcome, share in shares]

    def cost_of(self, name: str) -> float:
        """What a check costs [unit of the assumptions]."""
        return self.assumed.checks[name].days * self.assumed.day_cost

    def least(self, checks: Sequence[str]) -> float:
        """Expected cost of the answer, or of one more of these checks and the answer after it."""
        ways = [
            self.cost_of(name)
            + sum(share * then.expected()[then.answer] for share, then in self.outcomes(name))
            for name in checks
        ]
        return min([self.expected()[self.answer], *ways])

    def value_of(self, name: str, made: Mapping[str, str]) -> CheckValue:
        """What a check is worth, alone or with the one that pays best after it."""
        check, now = self.assumed.checks[name], self.answer
        others = [one for one in self.assumed.checks if one != name and one not in made]
        outcomes = self.outcomes(name)
        left = sum(share * then.least(others) for share, then in outcomes)
        settles = sum(share for share, then in outcomes if then.answer != now)
        cost = self.cost_of(name)
        value = self.expected()[now] - left - cost
        return CheckValue(name=name, label=check.label, cost=cost, value=value, settles=settles)


def _cheapest_up_to(one: Array, others: Array) -> float:
    """Chance of a damage up to which an answer is the cheapest [1], by its cost without and with one.

    Each cost is linear in that chance; an answer that is not the cheapest one at zero never is: below zero.
    """
    if one[0] > others[:, 0].min():
        return -1.0
    excess, lead = (one[1] - others[:, 1]) - (one[0] - others[:, 0]), others[:, 0] - one[0]
    return float(min([1.0, *(lead[excess > 0.0] / excess[excess > 0.0])]))


def _beyond(foreseen: Foreseen, assumed: Assumptions) -> tuple[float, float]:
    """Chance that the next drop passes a limit, at full speed and with a speed limit [1]."""
    if not foreseen.drops:
        return 0.0, 0.0
    limit, full = foreseen.speed_limit, foreseen.drops[0].beyond
    if limit is not None and limit.speed is not None:
        return full, min(full, assumed.most_beyond)
    return full, min(one.beyond for one in foreseen.drops)


def _costs(a: Assumptions, present: Array, beyond: tuple[float, float]) -> Array:
    """Cost of each answer in each state, shape (answers, states).

    ``beyond`` is the chance that the next drop passes a limit, at full speed and with limits [1].
    """
    risk = np.array([one.risk for one in a.damages.values()])
    renewed = np.array([one.remedy == "new bearings" for one in a.damages.values()])
    repaired = ~renewed
    unseen = np.array([one.of_machine for one in a.damages.values()])
    day, bearings, machine = a.day_cost, a.bearing_set_cost, a.machine_cost

    def harm(left: Array, share: float = 1.0) -> Array:
        kept = (1.0 - a.sound_risk) * np.prod(1.0 - share * left * risk, axis=1)
        return np.asarray(machine * (1.0 - kept))

    exchange = bearings + a.exchange_days * day
    drops = [a.another_drop * chance * exchange for chance in beyond]
    any_renewed = (present @ renewed > 0).astype(float)
    any_repaired = (present @ repaired > 0).astype(float)
    seen = (present @ (repaired & ~unseen) > 0).astype(float)
    sound = harm(np.zeros_like(present))
    return np.array(
        [
            harm(present) + drops[0],
            harm(present, a.limited_risk) + a.limited_days * day + drops[1],
            a.inspection_days * day
            + exchange * any_renewed
            + a.exchange_days * day * any_repaired
            + sound
            + drops[0],
            # what sits on the rotor is not seen while bearings are exchanged
            a.replace_days * day
            + bearings
            + a.exchange_days * day * seen
            + harm(present * unseen)
            + drops[0],
        ]
    )


def _flips(history: _History, foreseen: Foreseen, answer: Answer) -> tuple[Flip, ...]:
    """The smallest factor on each cost and each prior that changes the answer."""
    assumed = history.assumed

    def scaled_cost(name: str, factor: float) -> _Case:
        value = getattr(assumed, name) * factor
        changed = assumed.model_copy(update={name: min(value, 1.0) if name in SHARES else value})
        return _Case.of(replace(history, assumed=changed), foreseen)

    def scaled_prior(kind: str, factor: float) -> _Case:
        return _Case.of(history.scaled(kind, factor), foreseen)

    tried: list[tuple[str, Callable[[float], _Case]]] = [
        *((label, partial(scaled_cost, name)) for name, label in COSTS.items()),
        *(
            (f"the prior of a {damage.label}", partial(scaled_prior, kind))
            for kind, damage in assumed.damages.items()
        ),
    ]
    found = []
    for label, case_at in tried:
        for ends in ((1.0, FLIPS_WITHIN), (1.0, 1.0 / FLIPS_WITHIN)):
            steps = np.geomspace(*ends, 9).tolist()
            last = next((k for k, factor in enumerate(steps) if case_at(factor).answer != answer), None)
            if last is None:
                continue
            inside, other = steps[last - 1], steps[last]
            for _ in range(6):  # to a percent of the factor
                middle = math.sqrt(inside * other)
                inside, other = (middle, other) if case_at(middle).answer == answer else (inside, middle)
            found.append(Flip(of=label, factor=other, answer=case_at(other).answer))
    return tuple(sorted(found, key=lambda one: abs(math.log(one.factor))))


def answer_in(card: RestartCard, one: Flip) -> str:
    """The answer of a flip in words, which names no speed limit that was sought and not found."""
    limit = card.foreseen.speed_limit
    sought = limit is not None and limit.speed is None and one.answer == "restart with limits"
    return f"{one.answer} (no speed limit was found)" if sought else one.answer


def _said(card: RestartCard, drop: Drop, compared: bool) -> list[str]:
    """The card in sentences, the answer first."""
    assumed, likeliest = card.assumptions, card.suspicions[0]
    said = []
    if card.prior_alone:
        missing = "no parameter moved clearly" if compared else "there is no earlier estimate to compare with"
        said.append(
            f"The assumptions alone decide this: {missing}, and no check was made. "
            + (
                "Make one before you rely on the answer."
                if card.best_check
                else "None of them pays by these costs: state your own before you rely on the answer."
            )
        )
    known = ", ".join(
        f"{name} ({format_chance(card.right[name])})"
        for name in sorted(card.right, key=lambda name: -card.right[name])
        if card.right[name] > RARE
    )
    restart, limited = (format_chance(max(bound, 0.0)) for bound in card.bounds)
    by = (
        "the doubt that is allowed, whatever it costs"
        if card.bounds[0] == assumed.most_doubt
        else "by the costs"
    )
    ranges = f"up to {restart} it may restart ({by})" if card.bounds[0] > 0.0 else "it may not restart at all"
    if card.bounds[1] > max(card.bounds[0], 0.0):
        ranges += f", up to {limited} with limits (by the costs)"
    doubt = 1.0 - card.sound
    chance = f"{100.0 * doubt:.2g} %" if 0.005 < doubt < 0.095 else format_chance(doubt)
    said.append(
        f"{card.answer.capitalize()}: something is damaged with {chance}; {ranges}. "
        f"It costs {assumed.cost(card.costs[card.answer])} in "
        f"expectation{_beside(card)}. The largest doubt is a {in_words(likeliest, assumed)}. Who knew the "
        f"state of the bearings would answer {known}."
    )
    said += _of_earlier_checks(card)
    said += [*_of_next_drop(card.foreseen), *_of_lift(card.foreseen.lift)]
    best = card.best_check
    if best is not None:
        hours = 24.0 * best.cost / assumed.day_cost
        said.append(
            f"The check that pays most: {best.label} ({format_amount(hours)} h). Its outcome changes the "
            f"answer in {format_chance(best.settles)} of the cases and saves {assumed.cost(best.value)} in "
            "expectation."
        )
    else:
        said.append("None of the checks pays: none can change the answer at its cost.")
    for one in card.flips[:3]:
        said.append(f"The answer becomes “{answer_in(card, one)}” where {one.of} is {_times(one.factor)}.")
    if not card.flips:
        said.append(f"No cost and no prior within a factor of {FLIPS_WITHIN:g} changes the answer.")
    if not drop.consistent:
        said.append("The model is not consistent with this record: its parameters are no evidence here.")
    said.append(
        f"Costs, priors and risks are those of: {assumed.source}. They are no limits; state your own before "
        "you rely on them."
    )
    return said


def _of_earlier_checks(card: RestartCard) -> Iterator[str]:
    """Checks that count though they followed an earlier drop."""
    if card.carried:
        each = (
            f"{', '.join(f'{name} {outcome}' for name, outcome in made.items())} after {record}"
            for record, made in card.carried
        )
        yield f"Checks of earlier drops of these bearings count too: {'; '.join(each)}."


def _of_next_drop(foreseen: Foreseen) -> Iterator[str]:
    """What the next drop would be at full speed, and up to which speed it keeps to the limits."""
    if not foreseen.drops:
        return
    full = foreseen.drops[0]
    of = "as this estimate found the machine" if foreseen.of_estimate else "by the machine file alone"
    beyond = ""
    if full.beyond_limit is not None:
        low, high = (format_chance(end) for end in full.beyond_limit.interval_90 or (full.beyond,) * 2)
        beyond = (
            f"; it passes the limit, {foreseen.limits_in_words}, with {format_chance(full.beyond)} "
            f"(90 %: {low} to {high})"
        )
    count = full.peak_force[next(iter(full.peak_force))][0].drops
    yield (
        f"The next drop from {format_quantity(full.speed, 'speed')}, {of}, by {count} simulated ones"
        f"{beyond}. Its peaks by bearing, with 90 % intervals:"
    )
    for name, force in full.peak_force.items():
        parts = [
            f"{label} below {_shown(known[0], kind)} in half of the cases, {_shown(known[1], kind)} in 95 %"
            for label, kind, known in (
                ("force", "force", force),
                ("stress", "pressure", full.peak_stress[name]),
            )
        ]
        yield f"{name}: {'; '.join(parts)}."
    if foreseen.speed_limit is not None:
        yield _of_speed_limit(foreseen.speed_limit, full.beyond_limit)


def _of_lift(lift: LiftNow | None) -> Iterator[str]:
    """Whether it may be lifted now."""
    if lift is None:
        return
    low, high = (format_chance(end) for end in lift.probability.interval_90 or (lift.probability.value,) * 2)
    count = lift.probability.drops or 0
    succeeded = round(count * lift.probability.value)
    within = ""
    if lift.took is not None:
        within = " within " + " to ".join(format_quantity(one, "time", 3) for one in lift.took)
    needs = [
        f"{'more than the' if amount is None else f'{amount:.3g} A of'} {lift.limit[name]:.3g} A of {name}"
        for name, amount in lift.current.items()
    ]
    yield (
        f"May it be lifted now? From where it rests, {succeeded} of {count} simulated lifts succeed{within} "
        f"(chance, 90 %: {low} to {high}); no damage is simulated. The control current that carries the "
        f"weight there is {', '.join(needs)}."
    )


def _shown(known: Known, kind: str) -> str:
    low, high = known.interval_90 or (known.value,) * 2
    value, least = (format_quantity(number, kind) for number in (known.value, low))
    # of few drops even the largest may lie below the quantile
    return f"{value} ({least} {f'to {format_quantity(high, kind)}' if math.isfinite(high) else 'or more'})"


def _of_speed_limit(limit: SpeedLimit, beyond: Known | None) -> str:
    allowed = format_chance(limit.chance)
    if limit.speed is None or limit.interval_90 is None:
        lowest = format_quantity(limit.tried[0], "speed")
        return f"No speed limit down to {lowest} brings the chance to pass the limit down to {allowed}."
    speed, low, high = (format_quantity(one, "speed") for one in (limit.speed, *limit.interval_90))
    if not limit.needed:
        ends = None if beyond is None else beyond.interval_90
        most = 1.0 if ends is None else ends[1]
        chance = f"{allowed} at most"
        if most > limit.chance:
            chance = f"about {allowed} at most, and these drops cannot rule out {format_chance(most)}"
        return (
            f"No speed limit was found necessary: by {limit.drops} simulated drops up to {speed} the limit "
            f"is passed with {chance}."
        )
    return (
        f"A speed limit of {speed} (90 %: {low} to {high}, {limit.drops} simulated drops) brings that chance "
        f"to about {allowed}; take the lower end to be sure."
    )


def _times(factor: float) -> str:
    more, size = factor > 1.0, max(factor, 1.0 / factor)
    if size < 1.1:  # the factor is found to a percent
        return f"{'larger' if more else 'smaller'} by {max(100.0 * (size - 1.0), 1.0):.0f} %"
    return f"{size:.2g} times {'as large' if more else 'smaller'}"


def _beside(card: RestartCard) -> str:
    others = ", ".join(
        f"{name} {format_amount(cost)}" for name, cost in card.costs.items() if name != card.answer
    )
    return f" ({others})"
