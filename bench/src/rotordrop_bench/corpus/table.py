"""Rows, one a case, with what was said against the truth, rounded; quantities over them; tables as files."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.table import published
from rotordrop.errors import UsageError
from rotordrop.files import write_text
from rotordrop.known import NINETY
from rotordrop.severity.numbers import LOADS
from rotordrop_bench.score import Truth, score_estimate

PARTS = 1e4
"""Values of the table are in units of 1e-4 of the truth, times in 0.01 ms from it."""
ESTIMATED = {
    "force": "peak_force_N",
    "stress": "peak_stress_Pa",
    "gap": "air_gap_m",
    "friction": "friction.dynamic",
}
"""What is scored of an estimate at each bearing, by its path in the document and in the truth."""
SHORT = {path: name for name, path in ESTIMATED.items()} | {"mean_force_0p15_0p2_N": "mean_force"}
"""Names in keys and tables of what an estimate and a truth have by these paths."""
LOOKED = {
    "gap": ("air_gap_m", "air_gap_interval_90_m"),
    "touch": ("first_touch_s", "first_touch_interval_90_s"),
    "largest": ("largest_displacement_m", "largest_displacement_interval_90_m"),
}
"""Facts that are scored of a look at each plane, by the fields of value and interval."""
ALWAYS = (*(load.field for load in LOADS), "air_gap_m")
"""What an estimate of a drop of DropBench must have of each bearing, or else misses."""
LOST = 0.1
"""A value wrong by more than this share is lost [1]; chosen, not measured."""
SILENT = 0.05
"""Error from which a value outside its interval counts as a silent one [1]."""
SHOWN = (*SHORT.values(), "parameters", "structure", "absent")
"""Quantities that stand on the screen; parameters one by one stand in the JSON."""

Said = tuple[int, ...]
"""Value and, where there is one, lower and upper end of the 90 % interval, each less the truth, in units of
the table; empty where a value is missing."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """What a version said of one case."""

    case: str
    digest: str
    """Of record and tail."""
    look_code: int = 0
    code: int | None = None
    """Exit codes of look and estimate."""
    look_seconds: float = 0.0
    seconds: float | None = None
    """Processor time of both [s]."""
    findings: tuple[str, ...] = ()
    """Severity and kind of what the gate found, as ``warning:late channel``."""
    facts: Mapping[str, Said] = field(default_factory=dict)
    estimates: Mapping[str, Said] = field(default_factory=dict)
    """By quantity and bearing, such as ``force NDE``; of the corpus what was not found is not there."""
    named: tuple[str, ...] = ()
    violated: tuple[str, ...] = ()
    """Departures that an estimate names, and those that are there."""

    @property
    def group(self) -> str:
        """Group of the case."""
        return self.case.rpartition("-")[0]


def scored(
    case: str, digest: str, truth: Truth, looked: Mapping[str, Any], estimated: Mapping[str, Any]
) -> Row:
    """The row of a case of the corpus, from what look and estimate said (`rotordrop_bench.corpus.run`)."""
    values, off = truth.values, float(truth.values["t_off_in_record_s"])
    look, facts = looked.get("document", {}), {}
    for drop in look.get("drops", [])[:1]:
        facts["release"] = _said(drop["release_s"], drop["release_interval_90_s"], off, 1e-5)
    for plane in look.get("planes", []):
        name = plane["plane"]
        touch, gap = off + values["first_contact_time_s"][name], values["air_gap_m"][name]
        largest = values["max_radial_displacement_m"][name]
        at = {"gap": (gap, gap / PARTS), "touch": (touch, 1e-5), "largest": (largest, largest / PARTS)}
        for what, (value, interval) in LOOKED.items():
            facts[f"{what} {name}"] = _said(plane.get(value), plane.get(interval), *at[what])
    scores = judged(estimated.get("document", {}), truth)
    told = {} if isinstance(scores, str) else scores
    return Row(
        case=case,
        digest=digest,
        look_code=looked["code"],
        code=estimated.get("code"),
        look_seconds=looked["seconds"],
        seconds=estimated.get("seconds"),
        findings=tuple(sorted({f"{one['severity']}:{one['kind']}" for one in look.get("findings", [])})),
        facts={key: said for key, said in facts.items() if said},
        estimates={
            key: one for key, one in said_of(told).items() if name_of(key) in ESTIMATED and len(one) == 3
        },
        named=tuple(told.get("named", ())),
        violated=truth.violated if estimated else (),
    )


def judged(estimate: Mapping[str, Any] | Path, truth: Truth) -> dict[str, Any] | str:
    """Scores of an estimate, or why there are none."""
    try:
        return score_estimate(estimate, truth, drop=truth.name)
    except UsageError as error:
        return str(error)


def said_of(scores: Mapping[str, Any]) -> dict[str, Said]:
    """What was said of every quantity that was scored, by quantity and place.

    A structure that is absent, whose true value is zero, has half its interval as its measure.
    """
    every = {
        f"{SHORT.get(path, path)} {bearing}": score
        for bearing, own in scores.get("bearings", {}).items()
        for path, score in own.items()
    }
    every |= {
        f"{'structure' if s['truth'] else 'absent'} {at}": s for at, s in scores.get("structure", {}).items()
    }
    found = {}
    for key, score in every.items():
        ends = score.get("interval_90", ())
        unit = abs(score["truth"]) or (0.5 * (ends[1] - ends[0]) if ends else 0.0)
        if unit > 0.0:
            value = (score["estimate"], *ends)
            found[key] = tuple(round((one - score["truth"]) / (unit / PARTS)) for one in value)
    return found


def name_of(key: str) -> str:
    """The quantity of a key of estimates."""
    return key.partition(" ")[0]


def _said(value: float | None, interval: Any, truth: float, unit: float) -> Said:
    """A value and its interval in units of the table; empty where there is none of them."""
    if interval is None or None in interval:
        return ()
    ends = (0.5 * sum(interval) if value is None else value, *interval)
    return tuple(round((one - truth) / unit) for one in ends)


def rank(said: Said) -> float:
    """Rank of the truth in what is known of it [1]: uniform over cases where intervals are right.

    Normal to either side of the value, by the end of the interval there.
    """
    value, low, high = said
    width = high - value if value < 0 else value - low
    if width <= 0:
        return 0.5 if value == 0 else float(value < 0)
    return 0.5 * (1.0 + math.erf(-value / width * NINETY / math.sqrt(2.0)))


def holds(said: Said, share: float = 0.9) -> bool:
    """Whether the interval that holds this share holds the truth; without an interval nothing does."""
    if len(said) < 3:
        return False
    return said[1] <= 0 <= said[2] if share == 0.9 else abs(rank(said) - 0.5) <= 0.5 * share


def answered(row: Row) -> bool:
    """Whether an estimate gave numbers."""
    return any(row.estimates.values())


def silent(row: Row) -> bool:
    """Whether a peak force or stress is far off, outside its interval, and the estimate does not say so."""
    loads = [said for key, said in row.estimates.items() if key.startswith(("force", "stress")) and said]
    return row.code == 0 and any(not holds(one) and abs(one[0]) > SILENT * PARTS for one in loads)


def flagged(row: Row) -> bool:
    """Whether an estimate says that it is not consistent with its record."""
    return row.code == 7


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One quantity over the cases of a group; errors and widths are relative to the truth [1]."""

    group: str
    name: str
    values: int
    missing: int
    """Values scored, and values that the estimates do not have."""
    median_error: float | None
    ninetieth: float | None
    worst: float | None
    lost: float
    """Share of values that are wrong by more than 10 % or missing."""
    covered: dict[float, float | None]
    """Share of the intervals that hold the truth, by their probability."""
    half_width: float | None
    """Median of half the 90 % interval."""
    ranks: tuple[int, ...]
    """Values by the decile of the truth's rank; even where intervals are right."""
    unevenness: float | None
    """Kolmogorov's distance of the ranks from uniform, times the root of their number: 1.36 in one of 20."""


def quantities(groups: Mapping[str, Sequence[Row]]) -> list[Quantity]:
    """The quantities of every group of rows."""
    pooled = set(published()) - set(ESTIMATED.values())
    found = []
    for group, rows in groups.items():
        said: dict[str, list[Said]] = {}
        for key, one in (entry for row in rows for entry in row.estimates.items()):
            name = name_of(key)
            for into in (name, "parameters") if name in pooled else (name,):
                said.setdefault(into, []).append(one)
        found += [_quantity(group, name, own) for name, own in said.items()]
    return found


def _quantity(group: str, name: str, said: Sequence[Said]) -> Quantity:
    there = [one for one in said if one]
    within = [one for one in there if len(one) == 3]
    errors, ranks = np.abs([one[0] for one in there]), np.sort([rank(one) for one in within])
    steps = np.arange(len(ranks) + 1) / max(len(ranks), 1)

    def over(measure: Callable[[Any], Any], numbers: Array | list[Any], unit: float = 1.0) -> float | None:
        return float(measure(numbers)) / unit if len(numbers) else None

    apart = over(lambda r: max(np.max(r - steps[:-1]), np.max(steps[1:] - r)), ranks)
    return Quantity(
        group=group,
        name=name,
        values=len(there),
        missing=len(said) - len(there),
        median_error=over(np.median, errors, PARTS),
        ninetieth=over(lambda sizes: np.quantile(sizes, 0.9), errors, PARTS),
        worst=over(np.max, errors, PARTS),
        lost=float(np.sum(errors > LOST * PARTS) + len(said) - len(there)) / len(said),
        covered={part: over(np.mean, [holds(one, part) for one in within]) for part in (0.5, 0.8, 0.9)},
        half_width=over(np.median, [one[2] - one[1] for one in within], 2.0 * PARTS),
        ranks=tuple(int(n) for n in np.histogram(ranks, 10, (0.0, 1.0))[0]),
        unevenness=None if apart is None else apart * math.sqrt(len(ranks)),
    )


def write_table(rows: Iterable[Row], plan: str, path: Path) -> None:
    """Write a table with the digest of the plan its cases are of."""
    text, names = io.StringIO(), [one.name for one in fields(Row)]
    text.write(f"# plan {plan}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_cell(getattr(row, name)) for name in names] for row in rows)
    write_text(path, text.getvalue())


def _cell(value: Any) -> str:
    if isinstance(value, Mapping):
        return "|".join(f"{key}={':'.join(map(str, said))}" for key, said in value.items())
    return "|".join(value) if isinstance(value, tuple) else "" if value is None else str(value)


def read_table(place: str) -> tuple[str, list[Row]]:
    """Digest of the plan and rows of a table: a file, or the version of one that the bench keeps."""
    kept = resources.files(__package__).joinpath("tables", f"{place}.csv")
    file = kept if kept.is_file() else Path(place)
    if not file.is_file():
        raise UsageError(f"there is no table {place}; make one with 'rotordrop-bench corpus run'")
    head, _, body = file.read_text(encoding="utf-8").partition("\n")
    return head.removeprefix("# plan "), [_read(entry) for entry in csv.DictReader(io.StringIO(body))]


def _read(entry: Mapping[str, str]) -> Row:
    return Row(**{one.name: _value(str(one.type), entry.get(one.name, "")) for one in fields(Row)})


def _value(kind: str, cell: str) -> Any:
    if kind.startswith("Mapping"):
        pairs = (part.split("=") for part in cell.split("|") if part)
        return {key: tuple(map(int, said.split(":"))) for key, said in pairs}
    if kind.startswith("tuple"):
        return tuple(filter(None, cell.split("|")))
    if kind != "str" and not cell:
        return None
    return {"str": str, "int": int}.get(kind.partition(" ")[0], float)(cell)
