"""Whether a version keeps within the limits against another one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rotordrop.errors import UsageError
from rotordrop_bench.corpus.cases import listed
from rotordrop_bench.corpus.table import ESTIMATED, Row, answered, flagged, holds, name_of, quantities, silent

CUT = ("short record", "record ends before standstill")
"""What is true of every record of the corpus and is no alarm."""
RIGHT, WRONG, CLEAN = ("prior",), ("prior", "departures"), ("prior", "facts")
FAULTY = ("faults",)
"""Groups whose machines have nothing beyond their files; all that are estimated; all clean ones; spoiled."""

Pairs = Sequence[tuple[Row, Row]]
Test = Callable[[Row], bool]


@dataclass(frozen=True, kw_only=True)
class Limit:
    """One limit: a number before and after, and what it may be at most, however the version before was."""

    name: str
    before: float
    after: float
    most: float

    @property
    def kept(self) -> bool:
        """Whether it holds; what has no value keeps no limit."""
        return self.after <= self.most


def alarmed(row: Row) -> bool:
    """Whether the gate warns of a record or refuses it."""
    kinds = [one.split(":", 1) for one in row.findings]
    return row.look_code != 0 or any(level != "note" and kind not in CUT for level, kind in kinds)


def missed_faults(rows: Iterable[Row]) -> list[bool]:
    """Whether the gate says no more of a spoiled record than of the clean one, fault by fault."""
    by_name = {row.case: row for row in rows}
    pairs = [(by_name.get(one.name), by_name.get(one.clean)) for one in listed() if one.fault]
    return [
        spoiled.look_code == 0 and not set(spoiled.findings) - set(clean.findings if clean else ())
        for spoiled, clean in pairs
        if spoiled is not None
    ]


def share(rows: Iterable[Row], groups: Sequence[str], test: Test) -> float:
    """Share of the rows of some groups for which something is so; NaN of none."""
    found = [test(row) for row in rows if row.group in groups]
    return float(np.mean(found)) if found else math.nan


def paired(first: tuple[str, list[Row]], second: tuple[str, list[Row]]) -> Pairs:
    """Rows of two tables about the same records."""
    if first[0] != second[0]:
        raise UsageError("the tables are of different plans of the corpus; make both with one bench")
    mine = {(row.case, row.digest): row for row in second[1]}
    return [(row, mine[key]) for row in first[1] if (key := (row.case, row.digest)) in mine]


def limits(pairs: Pairs) -> list[Limit]:
    """Every limit of a version against the one before, on the cases that both were given."""
    before, after = ([pair[side] for pair in pairs] for side in (0, 1))
    estimated = [pair for pair in pairs if pair[0].group in WRONG]
    found: list[Limit] = []

    def limit(name: str, was: float, now: float, most: float) -> None:
        found.append(Limit(name=name, before=was, after=now, most=most))

    both = [pair for pair in estimated if all(map(answered, pair))]
    sides = {side: [pair[at] for pair in both] for at, side in enumerate(("before", "after"))}
    numbers = {(one.group, one.name): one for one in quantities(sides)}
    for name in ESTIMATED:
        limit(f"not covered at 90 %, {name}", *_missed(name, [p for p in estimated if any(map(answered, p))]))
        for words, field in (("median error", "median_error"), ("median half width", "half_width")):
            if both:
                was, now = (getattr(numbers.get((side, name)), field, math.nan) for side in sides)
                limit(f"{words}, {name}", was, now, 1.1 * was)
    counted: dict[str, tuple[Test, float]] = {
        "silent": (silent, len(estimated) / 150),
        "not answered": (lambda row: row.group in WRONG and not answered(row), len(estimated) / 75),
        "records refused": (lambda row: row.group not in FAULTY and row.look_code != 0, 0),
    }
    for name, (test, more) in counted.items():
        limit(name, was := sum(map(test, before)), sum(map(test, after)), was + math.floor(more))
    for name, groups, test, most in (
        ("flagged of the right structure", RIGHT, flagged, 0.03),
        ("alarms on clean records", CLEAN, alarmed, 0.01),
    ):
        limit(name, share(before, groups, test), share(after, groups, test), most)
    if missed := missed_faults(before):
        limit("faults not caught", float(np.mean(missed)), float(np.mean(missed_faults(after))), 0.11)
    facts = [
        (a.facts[key], said)
        for a, b in pairs
        for key, said in b.facts.items()
        if key in a.facts and a.group not in FAULTY
    ]
    apart = float(np.mean([not was[1] <= now[0] <= was[2] for was, now in facts])) if facts else math.nan
    limit("facts outside their old interval", 0.0, apart, 0.05)
    return found


def _missed(name: str, pairs: Pairs) -> tuple[float, float, float]:
    """Share of 90 % intervals that miss, before and after, and its limit: two standard errors more.

    The errors are those of the paired difference; what only one version answers is a miss of the other.
    """
    said = [
        [[one for key, one in row.estimates.items() if name_of(key) == name] for row in pair]
        for pair in pairs
    ]
    missed = np.array(
        [[np.mean([not holds(one) for one in side]) if side else 1.0 for side in pair] for pair in said]
    ).reshape(-1, 2)
    if not len(missed):
        return (math.nan,) * 3
    was, now = (float(number) for number in np.mean(missed, axis=0))
    return was, now, was + 2.0 * float(np.std(missed[:, 1] - missed[:, 0])) / math.sqrt(len(missed))
