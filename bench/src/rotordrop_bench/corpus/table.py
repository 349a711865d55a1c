"""The table of a version: one row a case, rounded, with what it said against the truth."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from rotordrop.document import read_json
from rotordrop.errors import UsageError
from rotordrop.files import write_text
from rotordrop.known import NINETY
from rotordrop_bench.truth import truth_of

PARTS = 1e4
"""Values of the table are in units of 1e-4 of the truth, times in 0.01 ms from it."""
ESTIMATED = {
    "force": "peak_force_N",
    "stress": "peak_stress_Pa",
    "gap": "air_gap_m",
    "friction": "friction.dynamic",
}
"""What is scored of an estimate at each bearing, by its path in the document and in the truth."""
LOOKED = {
    "gap": ("air_gap_m", "air_gap_interval_90_m"),
    "touch": ("first_touch_s", "first_touch_interval_90_s"),
    "largest": ("largest_displacement_m", "largest_displacement_interval_90_m"),
}
"""Facts that are scored of a look at each plane, by the fields of value and interval."""

Said = tuple[int, ...]
"""Value, lower and upper end of the 90 % interval, each less the truth, in units of the table."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """What a version said of one case."""

    case: str
    digest: str
    """Of record and tail."""
    look_code: int
    code: int | None = None
    """Exit codes of look and estimate."""
    look_seconds: float
    seconds: float | None = None
    """Processor time of both [s]."""
    findings: tuple[str, ...] = ()
    """Severity and kind of what the gate found, as ``warning:late channel``."""
    facts: Mapping[str, Said] = field(default_factory=dict)
    estimates: Mapping[str, Said] = field(default_factory=dict)
    """By quantity and bearing, such as ``force NDE``; what was not found is not there."""

    @property
    def group(self) -> str:
        """Group of the case."""
        return self.case.rpartition("-")[0]


def scored(
    case: str, digest: str, truth: Path, looked: Mapping[str, Any], estimated: Mapping[str, Any]
) -> Row:
    """The row of a case, from what look and estimate said (`rotordrop_bench.corpus.run`)."""
    true = truth_of(read_json(truth, "rotordrop-bench corpus run"))
    values, off = true.values, float(true.values["t_off_in_record_s"])
    look, facts, estimates = looked.get("document", {}), {}, {}
    for drop in look.get("drops", [])[:1]:
        facts["release"] = _said(drop["release_s"], drop["release_interval_90_s"], off, 1e-5)
    for plane in look.get("planes", []):
        name = plane["plane"]
        touch, gap = off + values["first_contact_time_s"][name], values["air_gap_m"][name]
        largest = values["max_radial_displacement_m"][name]
        at = {"gap": (gap, gap / PARTS), "touch": (touch, 1e-5), "largest": (largest, largest / PARTS)}
        for what, (value, interval) in LOOKED.items():
            facts[f"{what} {name}"] = _said(plane.get(value), plane.get(interval), *at[what])
    for name, own in estimated.get("document", {}).get("bearings", {}).items():
        for what, path in ESTIMATED.items():
            entry: Any = own
            for key in path.split("."):
                entry = entry.get(key, {})
            is_at, told = true.of_bearing(name)[path], (entry.get("value"), entry.get("interval_90"))
            estimates[f"{what} {name}"] = _said(*told, is_at, is_at / PARTS)
    return Row(
        case=case,
        digest=digest,
        look_code=looked["code"],
        code=estimated.get("code"),
        look_seconds=looked["seconds"],
        seconds=estimated.get("seconds"),
        findings=tuple(sorted({f"{one['severity']}:{one['kind']}" for one in look.get("findings", [])})),
        facts={key: said for key, said in facts.items() if said},
        estimates={key: said for key, said in estimates.items() if said},
    )


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
    """Whether the interval that holds this share holds the truth."""
    return said[1] <= 0 <= said[2] if share == 0.9 else abs(rank(said) - 0.5) <= 0.5 * share


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


def kept_table(version: str) -> Traversable:
    """Where the bench keeps the table of a version, or would."""
    return resources.files(__package__).joinpath("tables", f"{version}.csv")


def read_table(place: str) -> tuple[str, list[Row]]:
    """Digest of the plan and rows of a table: a file, or the version of one that the bench keeps."""
    kept = kept_table(place)
    file = kept if kept.is_file() else Path(place)
    if not file.is_file():
        raise UsageError(f"there is no table {place}; make one with 'rotordrop-bench corpus run'")
    head, _, body = file.read_text(encoding="utf-8").partition("\n")
    return head.removeprefix("# plan "), [_read(entry) for entry in csv.DictReader(io.StringIO(body))]


def _read(entry: Mapping[str, str]) -> Row:
    def many(cell: str) -> dict[str, Said]:
        pairs = (part.split("=") for part in cell.split("|") if part)
        return {key: tuple(map(int, said.split(":"))) for key, said in pairs}

    return Row(
        case=entry["case"],
        digest=entry["digest"],
        look_code=int(entry["look_code"]),
        code=int(entry["code"]) if entry["code"] else None,
        look_seconds=float(entry["look_seconds"]),
        seconds=float(entry["seconds"]) if entry["seconds"] else None,
        findings=tuple(filter(None, entry["findings"].split("|"))),
        facts=many(entry["facts"]),
        estimates=many(entry["estimates"]),
    )
