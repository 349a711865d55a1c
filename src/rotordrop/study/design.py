"""Choose supports, damping, gap, preload or bearing: the designs that no other one beats in every aim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter

from rotordrop.arrays import Array
from rotordrop.errors import UsageError, unknown_key
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.machine import value_of_path
from rotordrop.study.distributions import AS_DESCRIBED
from rotordrop.study.plan import WHOLE, Study, read_file, read_study, required
from rotordrop.study.quantities import columns_of
from rotordrop.study.run import Report, run_study
from rotordrop.study.summary import StudyResults, exceedance, quantile
from rotordrop.units import parse_quantity

_ROUNDS = (TypeAdapter(Annotated[int, Field(strict=True, ge=0)]), "a whole number from 0 on")
FRESH = 0x5EED
"""What is added to the seed for the drops that draw a front again."""
STEP = 0.12
"""Width of the steps around a front, as a share of each range [1]; chosen, not measured."""
OTHER = 0.25
"""Share of the candidates around a front that try any bearing of the list [1]: bearings have no order, so
that none lies beside another; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class Aim:
    """Something that shall be small: a quantile of a quantity, or the probability to exceed a limit."""

    column: str
    """Column of a study; with ``*`` for the bearing, the worst bearing counts in every drop."""
    quantile: float | None = None
    """Which quantile [1]."""
    above: float | None = None
    """Limit [SI], whose probability to be exceeded counts."""

    def __post_init__(self) -> None:
        if (self.quantile is None) == (self.above is None):
            raise UsageError(f"{self.column}: an aim has either a 'quantile' or a limit 'above', not both")

    def of(self, values: Array) -> Known:
        """What the drops of one candidate say, with its 90 % interval."""
        if self.above is not None:
            return exceedance(values, self.above)
        assert self.quantile is not None
        return quantile(values, self.quantile)

    @property
    def name(self) -> str:
        """The aim in words."""
        owner, _, quantity = self.column.rpartition(".")
        where = {"": "", "*": " at the worst bearing"}.get(owner, f" at {owner}")
        words = f"{quantity.replace('_', ' ')}{where}"
        if self.above is not None:
            return f"P({words} > {self.above:g}{' SI' if self.above else ''})"
        return f"{100 * (self.quantile or 0.0):g} % quantile of {words}"


USUAL = (Aim(column="*.peak_stress", quantile=0.9), Aim(column="*.backward_whirl", above=0.0))
"""Aims when none are given: a stress that nine drops of ten stay below, and seldom backward whirl."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One choice of values [SI] with what it gives, and whether any other is better in every aim.

    A bearing is the number of its designation in the list, `AS_DESCRIBED` for that of the machine file.
    """

    values: Mapping[str, float]
    aims: tuple[Known, ...]
    on_front: bool

    def chosen(self, study: Study) -> dict[str, float | str]:
        """The values, bearings by their designation."""
        found: dict[str, float | str] = {}
        for name, value in self.values.items():
            names = ("as described", *study.choose[name].names)  # -1 stands for the first of them
            found[name] = names[int(value) + 1] if len(names) > 1 else value
        return found


@dataclass(frozen=True, kw_only=True)
class DesignResult:
    """Outcome of a design study."""

    aims: tuple[Aim, ...]
    """What was made small."""
    candidates: tuple[Candidate, ...]
    """All that were tried, with the chances that all of them met."""
    front: tuple[Candidate, ...]
    """The best of them, drawn again with other chances: what was luck shows here."""
    described: Candidate
    """The machine as it is described, drawn with those other chances too."""


@dataclass(frozen=True, kw_only=True)
class DesignPlan:
    """What to choose from, what is left to chance, and what shall be small."""

    study: Study
    """Of the design ``"candidates"``."""
    aims: tuple[Aim, ...] = USUAL
    """What shall be small."""
    rounds: int = 1
    """Rounds around the front after the first, each with half as many candidates."""
    again: int = 100
    """Drops of each candidate of the front when it is drawn again."""


def front_of(numbers: Array) -> NDArray[np.bool_]:
    """Which rows (n, k) are on the front: no other row is at least as small in all and smaller in one."""
    found = np.ones(len(numbers), dtype=bool)
    for i, row in enumerate(numbers):
        found[i] = not np.any(np.all(numbers <= row, axis=1) & np.any(numbers < row, axis=1))
    return found


def best_designs(
    plan: DesignPlan, folder: str | Path, *, threads: int | None = None, report: Report | None = None
) -> DesignResult:
    """Find the front, and draw it again with other chances; the folder holds one study a round."""
    place = Path(folder)
    tried: list[Candidate] = []
    study = plan.study
    for number in range(plan.rounds + 1):
        if number:
            study = _with_candidates(plan.study, _around(plan.study, tried, number))
        results = run_study(study, place / f"round {number}", threads=threads, report=report)
        tried = _marked([*tried, *_read(results, plan.aims)])
    best = [one for one in tried if one.on_front]
    first = study.machine.touchdown_bearings[0].name
    described = tuple(
        AS_DESCRIBED if spread.names else value_of_path(study.machine, name.replace("*", first, 1))
        for name, spread in study.choose.items()
    )
    values = [*(tuple(one.values.values()) for one in best), described]
    fresh = replace(
        _with_candidates(plan.study, values, repeats=plan.again),
        seed=(plan.study.seed + FRESH) % 2**64,
        name=f"{plan.study.name}, again",
    )
    again = _read(run_study(fresh, place / "again", threads=threads, report=report), plan.aims)
    return DesignResult(
        aims=plan.aims, candidates=tuple(tried), front=tuple(_marked(again[:-1])), described=again[-1]
    )


def _with_candidates(study: Study, values: Sequence[tuple[float, ...]], repeats: int | None = None) -> Study:
    count = repeats or study.repeats
    return replace(study, candidates=tuple(values), repeats=count, drops=count * len(values))


def _around(study: Study, tried: Sequence[Candidate], number: int) -> list[tuple[float, ...]]:
    """New candidates beside those of the front, within the bounds."""
    random = np.random.Generator(np.random.Philox(np.random.SeedSequence((study.seed, number))))
    best = [one for one in tried if one.on_front]
    found = []
    for k in range(max(len(tried) // (2 * number), 1)):
        values = best[k % len(best)].values
        moved = []
        for name, spread in study.choose.items():
            share = _share(spread, values[name])
            if not spread.names:
                share += STEP * float(random.standard_normal())
            elif random.random() < OTHER:
                share = float(random.random())
            moved.append(float(spread(np.array([min(max(share, 0.0), 1.0 - 1e-12)]))[0]))
        found.append(tuple(moved))
    return found


def _share(spread: Any, value: float) -> float:
    """Where a value lies in the range of its spread [1], by halving: spreads only rise."""
    if spread.shape in ("choices", "grid"):
        return (list(spread.numbers).index(value) + 0.5) / len(spread.numbers)
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(spread(np.array([middle]))[0]) < value else (low, middle)
    return 0.5 * (low + high)


def _read(results: StudyResults, aims: Sequence[Aim]) -> list[Candidate]:
    """Candidates of a study with their aims; a drop that failed counts as the worst there is."""
    study = results.study
    bearings = [bearing.name for bearing in study.machine.touchdown_bearings]
    columns = []
    for aim in aims:
        of_bearings = [results.column(aim.column.replace("*", name, 1)) for name in bearings]
        columns.append(np.max(of_bearings, axis=0) if "*" in aim.column else of_bearings[0])
    found = []
    for c in range(len(results) // study.repeats):
        drops = slice(c * study.repeats, (c + 1) * study.repeats)
        found.append(
            Candidate(
                values={name: float(results.varied[name][drops.start]) for name in study.choose},
                aims=tuple(aim.of(values[drops]) for aim, values in zip(aims, columns, strict=True)),
                on_front=False,
            )
        )
    return found


def _marked(candidates: Sequence[Candidate]) -> list[Candidate]:
    numbers = np.array([[known.value for known in one.aims] for one in candidates])
    best = front_of(np.nan_to_num(numbers, nan=np.inf))
    return [replace(one, on_front=bool(good)) for one, good in zip(candidates, best, strict=True)]


def read_design(table: Mapping[str, Any], machine: Machine) -> DesignPlan:
    """Make a plan of what a design file holds; ``machine`` is already read."""
    content = dict(table)
    aims = content.pop("aims", None)
    usual = {"candidates": 64, "rounds": 1, "again": 100}
    candidates, rounds, again = (
        required(key, content.pop(key, number), _ROUNDS if key == "rounds" else WHOLE)
        for key, number in usual.items()
    )
    repeats = content.setdefault("repeats", 40)
    if "drops" in content or "design" in content:
        raise UsageError("a design file says how many 'candidates' and 'repeats'; leave out drops and design")
    if not content.get("choose"):
        raise UsageError('nothing to choose; write [choose] with bounds, such as "*.support.damping"')
    content |= {"drops": candidates * repeats if isinstance(repeats, int) else 1, "design": "candidates"}
    return DesignPlan(
        study=read_study(content, machine),
        aims=USUAL if aims is None else tuple(_aim(machine, one) for one in aims),
        rounds=rounds,
        again=again,
    )


def _aim(machine: Machine, raw: Any) -> Aim:
    if not isinstance(raw, Mapping) or "column" not in raw or set(raw) - {"column", "quantile", "above"}:
        raise UsageError(f'aims: {raw!r}; expected {{column = "*.peak_stress", quantile = 0.9}} or "above"')
    bearings = [bearing.name for bearing in machine.touchdown_bearings]
    columns = {q.name: q for q in columns_of(machine)}
    column = str(raw["column"])
    kind = columns.get(column.replace("*", bearings[0], 1))
    if kind is None:
        raise UsageError(
            unknown_key(column, (*columns, *(f"*.{n.split('.', 1)[1]}" for n in columns if "." in n)))
        )
    above = None if "above" not in raw else parse_quantity(raw["above"], kind.kind)
    share = raw.get("quantile")
    if share is not None and not (isinstance(share, float) and 0.0 < share < 1.0):
        raise UsageError(f"aims: quantile = {share!r}; expected a number between 0 and 1, such as 0.9")
    return Aim(column=column, quantile=share, above=above)


def load_design(path: str | Path) -> DesignPlan:
    """Read a design file (TOML); its machine file counts from its folder."""
    return read_file(path, "design", read_design)
