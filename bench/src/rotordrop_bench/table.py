"""Score the estimates of a whole bench into one table: errors and coverage of every quantity by family."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.table import published
from rotordrop.errors import UsageError
from rotordrop.severity.numbers import LOADS
from rotordrop_bench.drops import VERSION
from rotordrop_bench.make import chosen_drops, truth_path
from rotordrop_bench.score import score_estimate
from rotordrop_bench.truth import Truth, read_truth

LOST = 0.1
"""A peak force wrong by more than this share is lost [1]; chosen, not measured."""

EVERY = "all drops"
STRUCTURE = "structure"
PARAMETERS = "parameters"


@dataclass(frozen=True, kw_only=True)
class BenchRow:
    """One quantity over the drops of one family; relative errors are those of absolute size [1]."""

    family: str
    quantity: str
    """What is pooled; the quantity is a field of an estimate, or ``parameters`` or ``structure`` for all of
    them together."""
    values: int
    missing: int
    """Values scored, and values that the estimates do not have."""
    median: float | None
    ninetieth: float | None
    worst: float | None
    """Of the relative error [1]."""
    covered: float | None
    """Share of the 90 % intervals that hold the truth [1]."""
    half_width: float | None
    """Median of half the interval over the truth [1]."""
    lost: float | None
    """Share of values that are wrong by more than 10 % or missing [1]."""


@dataclass(frozen=True, kw_only=True)
class BenchScores:
    """Scores of an estimator over the bench."""

    rows: tuple[BenchRow, ...]
    """All families and quantities."""
    drops: tuple[dict[str, Any], ...]
    """What was scored of each drop: name, family, rotor, whether the estimate called itself consistent, what
    it named and what was there, and the errors of its peaks."""
    unscored: dict[str, str]
    """Drops without a usable estimate, with the reason; they count as missing values."""
    departures: int
    named_rightly: int
    """Departures that were there, those of a drop without an estimate too, and those that were named."""
    named_wrongly: int
    """Drops whose estimate named a departure that was not there."""


def score_bench(folder: str | Path, estimates: str | Path, only: Iterable[str] = ()) -> BenchScores:
    """Compare estimates with the hidden truth of the drops that `make_bench` made in a folder.

    The estimates are ``NAME.json`` for each drop: the JSON of ``rotordrop estimate``, or at least
    ``{"bearings": {"NDE": {"peak_force_N": {"value": …, "interval_90": [low, high]}}}}``. ``only`` holds
    names of drops, families or rotors; all that were made when empty.
    """
    folder, estimates, wanted = Path(folder), Path(estimates), list(only)
    made = [drop for drop in chosen_drops(wanted) if truth_path(folder, drop.name).is_file()]
    if not made:
        raise UsageError(
            f"{folder} holds no drop of the bench; make some with 'rotordrop-bench make {folder}'"
        )
    if not estimates.is_dir():
        raise UsageError(f"{estimates} is no folder; give the one with the estimates, NAME.json each")
    truths = [read_truth(truth_path(folder, drop.name)) for drop in made]
    found = [
        _scored(estimates / f"{drop.name}.json", truth) for drop, truth in zip(made, truths, strict=True)
    ]
    unscored = {drop.name: why for drop, why in zip(made, found, strict=True) if isinstance(why, str)}
    scores: list[Mapping[str, Any]] = [{} if isinstance(one, str) else one for one in found]
    stated = {f for scored in scores for mine in scored.get("bearings", {}).values() for f in mine}
    entries, drops = [], []
    for drop, truth, scored in zip(made, truths, scores, strict=True):
        entries += [(drop.family, *entry) for entry in _entries(scored, truth, stated)]
        peaks = {bearing: own.get("peak_force_N") for bearing, own in scored.get("bearings", {}).items()}
        facts = {"name": drop.name, "family": drop.family, "rotor": drop.rotor}
        told = {"consistent": scored.get("consistent"), "named": scored.get("named", [])}
        errors = {bearing: peak["relative_error"] for bearing, peak in peaks.items() if peak}
        drops.append({**facts, **told, "peak_errors": errors, "violated": list(truth.violated)})
    rows = []
    for family in (EVERY, *dict.fromkeys(family for family, *_ in entries)):
        for quantity in dict.fromkeys(quantity for _, quantity, _ in entries):
            chosen = [score for of, q, score in entries if q == quantity and family in (EVERY, of)]
            if chosen:
                rows.append(_row(family, quantity, chosen))
    pairs = [(set(drop["named"]), set(drop["violated"])) for drop in drops]
    return BenchScores(
        rows=tuple(rows),
        drops=tuple(drops),
        unscored=unscored,
        departures=sum(len(drop["violated"]) for drop in drops),
        named_rightly=sum(len(named & there) for named, there in pairs),
        named_wrongly=sum(bool(named - there) for named, there in pairs),
    )


def _scored(file: Path, truth: Truth) -> dict[str, Any] | str:
    """Scores of one estimate, or why there are none."""
    version = truth.values.get("bench_version")
    if version != VERSION:
        raise UsageError(
            f"{truth.path} is of version {version!r} of the bench, this is version {VERSION!r}; make "
            "the bench again in another folder"
        )
    if not file.is_file():
        return f"there is no {file.name}"
    try:
        return score_estimate(file, truth, drop=truth.name)
    except UsageError as error:
        return str(error)


Entry = tuple[str, Mapping[str, Any] | None]


def _entries(scored: Mapping[str, Any], truth: Truth, stated: set[str]) -> list[Entry]:
    """Every value that an estimate of a drop should have, with its score or None.

    A drop without a usable estimate lacks every parameter that the estimator ``stated`` of any other one.
    """
    loads = [load.field for load in LOADS]
    listed: list[Entry] = []
    for name in truth.bearing_names:
        mine = scored.get("bearings", {}).get(name, {})
        listed += [(field, mine.get(field)) for field in [*loads, "air_gap_m"]]
        due = set(mine) if scored else stated & set(truth.of_bearing(name))
        for field in published():
            if field in due and field not in (*loads, "air_gap_m"):
                listed += [(field, mine.get(field)), (PARAMETERS, mine.get(field))]
    listed += [(STRUCTURE, score) for score in scored.get("structure", {}).values()]
    return listed


def _row(family: str, quantity: str, scores: list[Mapping[str, Any] | None]) -> BenchRow:
    there = [score for score in scores if score is not None]
    missing = len(scores) - len(there)

    def of(key: str) -> Array:
        return np.abs([float(score[key]) for score in there if score.get(key) is not None])

    def over(numbers: Array, measure: Callable[[Array], Any]) -> float | None:
        return float(measure(numbers)) if len(numbers) else None

    errors = of("relative_error")
    return BenchRow(
        family=family,
        quantity=quantity,
        values=len(there),
        missing=missing,
        median=over(errors, np.median),
        ninetieth=over(errors, lambda sizes: np.quantile(sizes, 0.9)),
        worst=over(errors, np.max),
        covered=over(of("covered"), np.mean),
        half_width=over(of("half_width"), np.median),
        lost=float((np.sum(errors > LOST) + missing) / len(scores)),
    )
