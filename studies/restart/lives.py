"""Lives of machines whose bearings are damaged by drops: what the restart card makes of them.

Usage: python studies/restart/lives.py LIVES SEED FILE [SECONDS]

The lives know nothing of the card's equations: their damages have other sizes (gamma in place of log-normal),
other chances (those assumed times a factor of each machine), dents by a logistic law of the true stress,
and risks of their own. Estimates are published values with errors, as `rotordrop estimate` states them. After
every drop the card is asked, its best check is made while one pays, and its answer is carried out. Costs are
expectations under the true state. Each life is a line of FILE (JSON) and is lived once: a run that was
stopped, or that has used its SECONDS of processor time, goes on where it was. Prints the table.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from scipy.stats import gamma

from rotordrop.estimate.published import Bearing, Drop, Parameter, Unbalance, Value
from rotordrop.known import NINETY
from rotordrop.restart import restart_card
from rotordrop.restart.assumptions import assumptions_of
from rotordrop.restart.order import earlier_drop
from rotordrop.severity.statistics import Statistics

MACHINES, MOST_DROPS, ENDS = 20, 8, ("NDE", "DE")
KINDS = ("worn", "brinelled", "dragging", "loose", "unbalance")
SEEN = {"worn": "air_gap", "dragging": "friction.dynamic", "loose": "support.stiffness"}
MEAN = {"worn": 18e-6, "dragging": math.log(1.5), "loose": math.log(0.55), "unbalance": math.log(2.8)}
SHAPE = 3.0  # of the gamma law of the size of an effect
HEALTHY = {"worn": 2e-6, "dragging": 0.05, "loose": 0.02, "unbalance": 0.1}
ERROR = {"worn": 1.5e-6, "dragging": 0.04, "loose": 0.012, "unbalance": 0.15}
TRUTH = {"worn": 275e-6, "dragging": math.log(0.12), "loose": math.log(1e8), "unbalance": math.log(2e-5)}
ANSWERS = ("restart", "restart with limits", "inspect first", "replace")
ZERO = dict.fromkeys((name for name, one in Statistics.model_fields.items() if one.is_required()), 0)
STATISTICS = Statistics(**{**ZERO, "rule": "hazen", "weighted_by_time": False})


@dataclass
class Machine:
    """A machine with its own chances, risks, stress and costs."""

    chance: dict[str, float]
    risk: dict[str, float]
    stress: float
    costs: dict[str, float]


@dataclass
class Score:
    """What is counted of one life."""

    stated: list[tuple[float, bool]] = field(default_factory=list)
    regret: float = 0.0
    stake: float = 0.0
    answers: list[str] = field(default_factory=list)
    restarts: int = 0
    damaged_restarts: int = 0
    stated_restarts: float = 0.0
    named: int = 0
    best: int = 0


def drawn(random: np.random.Generator, base) -> Machine:
    """One of the machines."""
    return Machine(
        chance={k: min(base.damages[k].prior * random.lognormal(0.0, 0.4), 0.3) for k in KINDS},
        risk={k: min(base.damages[k].risk * random.lognormal(0.0, 0.25), 0.95) for k in KINDS},
        stress=random.uniform(1.3e9, 4.2e9),
        costs={
            "bearing_set_cost": random.uniform(1.0, 8.0),
            "machine_cost": random.uniform(25.0, 150.0),
            "inspection_days": random.uniform(0.5, 2.0),
        },
    )


def effect(kind: str, random: np.random.Generator) -> float:
    """Size of a damage in the measure of its parameter."""
    return MEAN[kind] * random.gamma(SHAPE) / SHAPE


def stated(mean: float, error: float, positive: bool) -> Value:
    """A number as an estimate publishes it."""
    low, mid, high = (mean + k * NINETY * error for k in (-1, 0, 1))
    if positive:
        low, mid, high = math.exp(low), math.exp(mid), math.exp(high)
    return Value(value=mid, interval_90=[low, high])


def published(state, random: np.random.Generator, stress: float) -> Drop:
    """The estimate of a drop of bearings in a state."""
    parameters, bearings = [], {}
    for end in ENDS:
        for kind, path in SEEN.items():
            true = TRUTH[kind] + state[kind, end] + HEALTHY[kind] * random.standard_normal()
            found = true + ERROR[kind] * random.standard_normal()
            wide = 50.0 * ERROR[kind]
            parameters.append(
                Parameter(
                    path=f"{end}.{path}",
                    scope="machine",
                    prior=stated(TRUTH[kind], wide, kind != "worn"),
                    estimate=stated(found, ERROR[kind], kind != "worn"),
                )
            )
        read = stress * math.exp(0.006 * random.standard_normal())
        numbers = {
            "peak_force_N": Value(value=3e3, interval_90=[2.9e3, 3.1e3]),
            "peak_stress_Pa": Value(value=read, interval_90=[0.99 * read, 1.01 * read]),
        }
        bearings[end] = Bearing.model_construct(
            origin="", numbers=numbers, stress_statistics_Pa=STATISTICS, impacts=[]
        )
    size = TRUTH["unbalance"] + state["unbalance", ""] + HEALTHY["unbalance"] * random.standard_normal()
    size += ERROR["unbalance"] * random.standard_normal()
    return Drop.model_construct(
        bearings=bearings,
        parameters=parameters,
        joint=None,
        consistent=True,
        machine="m",
        record="r",
        recorded="",
        record_sha256="",
        unbalance=[
            Unbalance(node=1, amount_kg_m=stated(size, ERROR["unbalance"], True), phase_rad=None, sentence="")
        ],
    )


def places(kind: str) -> tuple[str, ...]:
    """Where a kind may be."""
    return ("",) if kind == "unbalance" else ENDS


def costs_of(machine: Machine, present: set[str], assumed) -> dict[str, float]:
    """What each answer costs in expectation with damages that are there."""
    c, a = machine.costs, assumed

    def harm(kinds, share=1.0):
        return c["machine_cost"] * (1 - 0.998 * math.prod(1 - share * machine.risk[k] for k in kinds))

    new, mend = present & {"worn", "brinelled", "dragging"}, present & {"loose", "unbalance"}
    return {
        "restart": harm(present),
        "restart with limits": harm(present, a.limited_risk) + a.limited_days,
        "inspect first": c["inspection_days"]
        + bool(new) * (c["bearing_set_cost"] + a.exchange_days)
        + bool(mend) * a.exchange_days
        + harm(()),
        "replace": a.replace_days
        + c["bearing_set_cost"]
        + ("loose" in present) * a.exchange_days
        + harm(present & {"unbalance"}),
    }


SIZES = gamma.ppf((np.arange(100) + 0.5) / 100, SHAPE, scale=1.0 / SHAPE)


def read(drop: Drop, kind: str, end: str) -> float:
    """What an estimate says of the measure of a kind."""
    if kind == "unbalance":
        return math.log(drop.unbalance[0].amount_kg_m.value)
    found = next(one.estimate.value for one in drop.parameters if one.path == f"{end}.{SEEN[kind]}")
    return found if kind == "worn" else math.log(found)


def first_done(machine: Machine, kind: str, drops: list[Drop], stresses: list[float]) -> np.ndarray:
    """Weights of each drop to be the first that did a kind of damage, and of none."""
    later = np.ones(len(stresses) + 1)
    for end in places(kind):
        each = np.full(len(stresses), machine.chance[kind])
        if kind == "brinelled":
            each = 1.0 - (1.0 - each) * (1.0 - np.array([dent(one) for one in stresses]))
        left = np.cumprod(1.0 - each)
        odds = -np.diff(left, prepend=1.0) / left[-1]
        if kind in MEAN:
            y = np.array([read(one, kind, end) for one in drops])
            wide = math.hypot(ERROR[kind], HEALTHY[kind])
            for j in range(1, len(drops)):
                shifted = y - MEAN[kind] * SIZES[:, None] * (np.arange(len(drops)) >= j)
                beyond = shifted.var(axis=1) - y.var()
                odds[j - 1] *= np.mean(np.exp(np.clip(-0.5 * len(drops) * beyond / wide**2, -200, 200)))
        later *= [1.0 + odds[j:].sum() for j in range(len(odds) + 1)]
    return np.append(-np.diff(later), 1.0)


def true_states(
    machine: Machine, drops: list[Drop], stresses: list[float], checks: list[dict[str, str]], assumed
) -> dict[tuple[bool, ...], float]:
    """Chance of every set of kinds, summed over the drops that may have done each."""
    after = len(stresses)
    weights = [first_done(machine, kind, drops, stresses) for kind in KINDS]
    when = np.meshgrid(*[np.arange(after + 1)] * len(KINDS), indexing="ij")
    weight = math.prod(np.meshgrid(*weights, indexing="ij"))
    for drop, made in enumerate(checks):
        for name, outcome in made.items():
            check = assumed.checks[name]
            unseen = (1.0 - check.false_alarm) * math.prod(
                np.where(at <= drop, 1.0 - check.shows.get(kind, 0.0), 1.0)
                for kind, at in zip(KINDS, when, strict=True)
            )
            weight = weight * (unseen if outcome == "good" else 1.0 - unseen)
    weight = weight / weight.sum()
    return {
        flags: float(weight[np.ix_(*(range(after) if yes else [after] for yes in flags))].sum())
        for flags in product((False, True), repeat=len(KINDS))
    }


def dent(stress: float) -> float:
    """Chance that a stress dents a race so that it matters."""
    return 1.0 / (1.0 + math.exp(-(stress - 5.25e9) / 0.33e9))


def shows(check, present: set[str]) -> float:
    """Chance of a bad outcome."""
    return 1.0 - (1.0 - check.false_alarm) * math.prod(1.0 - check.shows.get(k, 0.0) for k in present)


def least(states, assumed) -> float:
    """Expected cost of the cheapest answer that is allowed, weights not normalised."""
    total = sum(w for w, _, _ in states)
    doubt = sum(w for w, present, _ in states if present) / total
    allowed = [a for a in ANSWERS if a != "restart" or doubt <= assumed.most_doubt]
    return min(sum(w * c[a] for w, _, c in states) for a in allowed)


def best_checks(machine: Machine, chance: dict[tuple[bool, ...], float], assumed) -> dict[str, float]:
    """What each check is worth by the laws of the lives, with the chance of every set of kinds."""
    states = []
    for flags, weight in chance.items():
        present = {k for k, yes in zip(KINDS, flags, strict=True) if yes}
        states.append((weight, present, costs_of(machine, present, assumed)))

    def after(states, check):
        bad = [(shows(check, p), w, p, c) for w, p, c in states]
        yield [(w * s, p, c) for s, w, p, c in bad]
        yield [(w * (1.0 - s), p, c) for s, w, p, c in bad]

    def ahead(states, name):
        ways = [least(states, assumed)]
        for other, check in assumed.checks.items():
            if other != name:
                ways.append(
                    check.days * sum(w for w, _, _ in states)
                    + sum(least(of, assumed) for of in after(states, check))
                )
        return min(ways)

    worth = {}
    now = least(states, assumed)
    for name, check in assumed.checks.items():
        worth[name] = now - sum(ahead(of, name) for of in after(states, check)) - check.days
    return worth


def live(machine: Machine, random: np.random.Generator, base, score: Score) -> None:
    """One set of bearings from its first drop until it is opened or replaced."""
    assumed = base.model_copy(update=machine.costs)
    state = {(k, end): 0.0 for k in KINDS for end in places(k)}
    there: set[str] = set()
    # a drop test of new bearings, after which everything was found sound
    known = [published(state, random, 0.5 * machine.stress)]
    earlier = [replace(earlier_drop(known[0]), checks={"inspection": "good"})]
    true_stresses: list[float] = []
    for _ in range(MOST_DROPS):
        stress = machine.stress * random.lognormal(0.0, 0.15)
        true_stresses.append(stress)
        for kind in KINDS:
            for end in places(kind):
                chance = machine.chance[kind]
                if kind == "brinelled":
                    chance = 1.0 - (1.0 - chance) * (1.0 - dent(stress))
                if random.random() < chance and state[kind, end] == 0.0:
                    there.add(kind)
                    state[kind, end] = effect(kind, random) if kind in MEAN else 1.0
        drop = published(state, random, stress)
        checks: dict[str, str] = {}
        card = restart_card(drop, assumed, earlier=earlier)
        spent = 0.0
        if (named := card.best_check) is not None:
            before = [one.checks for one in earlier[1:]]
            chance = true_states(machine, [*known, drop], true_stresses, before, assumed)
            worth = best_checks(machine, chance, assumed)
            score.named += 1
            # two checks within a hundredth of a day are one
            score.best += worth[named.name] >= max(worth.values()) - 0.01
        while (check := card.best_check) is not None:
            bad = random.random() < shows(assumed.checks[check.name], there)
            checks[check.name] = "bad" if bad else "good"
            spent += assumed.checks[check.name].days
            card = restart_card(drop, assumed, earlier=earlier, checks=checks)
        score.stated.append((1.0 - card.sound, bool(there)))
        score.answers.append(card.answer)
        true = costs_of(machine, there, assumed)
        score.regret += spent + true[card.answer] - min(true.values())
        score.stake += max(true.values()) - min(true.values())
        if card.answer == "restart":
            score.restarts += 1
            score.damaged_restarts += bool(there - {"unbalance"})
            score.stated_restarts += 1.0 - card.sound
        if card.answer in ("inspect first", "replace"):
            return
        known.append(drop)
        earlier.append(replace(earlier_drop(drop), checks=checks))


def main() -> None:
    """Live and print."""
    lives, seed, file = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else math.inf
    base = assumptions_of({}, "the package")
    random = np.random.default_rng(seed)
    machines = [drawn(random, base) for _ in range(MACHINES)]
    lived = file.read_text().splitlines() if file.exists() else []
    with file.open("a") as out:
        for k in range(len(lived), lives):
            if time.process_time() > seconds:
                break
            score = Score()
            live(machines[k % MACHINES], np.random.default_rng([seed, k]), base, score)
            lived.append(json.dumps(asdict(score)))
            print(lived[-1], file=out, flush=True)
    print(f"{len(lived)} lives of {MACHINES} machines, seed {seed}")
    told([Score(**json.loads(line)) for line in lived])


def told(scores: list[Score]) -> None:
    """Print the reliability diagram, with the standard error of whole lives, and the rest."""
    print("\n| stated chance of a damage | cards | lives | stated | damaged |")
    print("| --- | --- | --- | --- | --- |")
    for low, high in pairwise((0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0001)):
        of_life = [[(p, d) for p, d in one.stated if low <= p < high] for one in scores]
        of_life = [np.array(cards, dtype=float) for cards in of_life if cards]
        if of_life:
            cards = np.concatenate(of_life)
            mean, share = 100.0 * cards.mean(axis=0)
            # cards of one life share its damage: the sum of each life is one draw
            error = 100.0 * math.sqrt(sum((of[:, 1] - of[:, 0]).sum() ** 2 for of in of_life)) / len(cards)
            print(
                f"| {low:.0%} to {min(high, 1):.0%} | {len(cards)} | {len(of_life)} | {mean:.1f} % | "
                f"{share:.1f} ± {error:.1f} % |"
            )

    def total(name: str) -> float:
        return sum(getattr(one, name) for one in scores)

    print(f"\nanswers: {dict(Counter(answer for one in scores for answer in one.answers))}")
    print(
        f"regret over an oracle: {total('regret'):.1f} of {total('stake'):.1f} at stake = "
        f"{total('regret') / total('stake'):.1%}"
    )
    print(
        f"restart with a damaged bearing: {total('damaged_restarts')} of {total('restarts')}; "
        f"by the chances stated {total('stated_restarts'):.1f}"
    )
    print(f"named check the best: {total('best')} of {total('named')}")


if __name__ == "__main__":
    main()
