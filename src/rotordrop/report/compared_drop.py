"""One drop of a comparison, from an estimate document."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.report.quantity import Quantity
from rotordrop.severity.numbers import SEVERITY
from rotordrop.units import format_minute

NUMBERS = (
    ("peak_force_N", "peak bearing force", "force"),
    ("mean_force_0p15_0p2_N", "mean force, 150 to 200 ms", "force"),
    ("peak_stress_Pa", "peak Hertz stress", "pressure"),
    ("mean_stress_Pa", "mean Hertz stress", "pressure"),
    *((one.field, one.label, one.kind) for one in SEVERITY),
)
"""Numbers of an estimate document that are compared: key, name, kind."""
LESS_IS_WORSE = frozenset(one.field for one in SEVERITY if not one.more_is_worse)


@dataclass(frozen=True, kw_only=True)
class ComparedDrop:
    """One drop of a comparison."""

    name: str
    """Name of the drop."""
    speed: float
    """Speed at power-off [rad/s]."""
    numbers: Mapping[str, Mapping[str, Quantity]]
    """By bearing and name of the number in an estimate file (``"peak_force_N"``, …), with intervals."""
    warnings: tuple[str, ...] = ()
    """What the estimate warns of."""
    consistent: bool = True
    """Whether the estimate's own checks found the model consistent with the record."""
    method: str = ""
    """How it was estimated."""
    record: str = ""
    """SHA-256 of the recording, to know a drop that is given twice."""
    simulated: bool = False
    """Whether the record is known to be simulated."""
    machine: str = ""
    recorded: str = ""
    """Name of the machine, and when the recorder says the drop was."""
    statistics: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """By bearing, the statistics of the stress as the document has them."""
    hardest: Mapping[str, str] = field(default_factory=dict)
    """By bearing, what its worst impact was and how much of the whole it made, in words."""

    @property
    def label(self) -> str:
        """Record, date and speed, for a table."""
        speed = Quantity(value=self.speed / (2.0 * math.pi), kind="frequency", digits=3).text
        return ", ".join(part for part in (self.name, self.minute, speed) if part)

    @property
    def minute(self) -> str:
        """When the recorder says the drop was, without seconds."""
        return format_minute(self.recorded)

    @classmethod
    def of_document(cls, name: str, document: Mapping[str, Any], *, simulated: bool = False) -> ComparedDrop:
        """Take one drop from an estimate document as the command line writes it.

        Raises
        ------
        UsageError
            If the document has no bearings or no speed.
        """
        if "bearings" not in document or "speed_Hz" not in document:
            raise UsageError(
                f"{name}: the document has the entries {', '.join(document) or 'none'}; expected 'speed_Hz' "
                "and 'bearings'. Give a file written by 'rotordrop estimate --json'."
            )
        turns = document["speed_Hz"]
        consistency = document.get("consistency") or {}
        consistent = consistency.get("consistent", True) if isinstance(consistency, Mapping) else consistency
        if not isinstance(consistent, bool):
            raise UsageError(
                f"{name}: 'consistency.consistent' is {consistent!r}; expected true or false. Give a file as "
                "'rotordrop estimate --json' wrote it."
            )
        return cls(
            name=name,
            speed=2 * math.pi * float(turns["value"] if isinstance(turns, Mapping) else turns),
            numbers={bearing: _numbers(values) for bearing, values in document["bearings"].items()},
            warnings=tuple(str(warning) for warning in document.get("warnings") or ()),
            consistent=consistent,
            method=str(document.get("method", "")),
            record=str(document.get("record_sha256") or ""),
            simulated=simulated,
            machine=str(document.get("machine", "")),
            recorded=str(document.get("recorded", "")),
            statistics={
                bearing: values["stress_statistics_Pa"]
                for bearing, values in document["bearings"].items()
                if "stress_statistics_Pa" in values
            },
            hardest={
                bearing: text
                for bearing, values in document["bearings"].items()
                if (text := _hardest(values))
            },
        )


def left_out(drops: Sequence[ComparedDrop]) -> dict[str, str]:
    """Drops that a ranking must leave out, by name, and why.

    Raises
    ------
    UsageError
        If one recording was estimated twice in the same way.
    """
    reasons: dict[str, str] = {}
    counted: dict[str, ComparedDrop] = {}
    seen: dict[tuple[str, str], ComparedDrop] = {}
    for drop in sorted(drops, key=lambda one: not one.consistent):
        twin = counted.setdefault(drop.record, drop) if drop.record else drop
        same = seen.setdefault((drop.record, drop.method), drop) if drop.record else drop
        if same is not drop:
            raise UsageError(
                f"{same.name} and {drop.name} are estimates of the same recording; expected another drop in "
                "each. Leave one of them out."
            )
        if not drop.consistent:
            reasons[drop.name] = "its model is not consistent with its record"
        elif twin is not drop:
            way = drop.method or "another way"
            reasons[drop.name] = f"the same recording as {twin.name}, estimated by {way}"
    return reasons


def _numbers(values: Mapping[str, Any]) -> dict[str, Quantity]:
    found = {}
    for key, _, kind in NUMBERS:
        entry: Any = values
        for part in key.split("."):
            entry = entry.get(part) if isinstance(entry, Mapping) else None
        if entry is not None:
            interval = entry.get("interval_90")
            found[key] = Quantity(
                value=float(entry["value"]),
                kind=kind,
                interval_90=None if interval is None else (float(interval[0]), float(interval[1])),
                standard_error=entry.get("standard_error"),
                status=str(entry.get("status", "")),
            )
    return found


def _hardest(values: Mapping[str, Any]) -> str:
    """Which impact gave the peak, and which part of impulse and energy it made."""
    impacts = values.get("impacts") or ()
    if not impacts:
        return ""
    first = max(range(len(impacts)), key=lambda k: impacts[k]["peak_force_N"]["value"])
    hit = impacts[first]
    parts = []
    for key, name in (("impulse_N_s", "impulse"), ("dissipated_energy_J", "energy")):
        whole = math.fsum(one[key]["value"] for one in impacts)
        if whole > 0.0:
            parts.append(f"{hit[key]['value'] / whole:.0%} of the {name}")
    moment = Quantity(value=hit["peak_time_s"], kind="time", digits=3).text
    return f"impact {first + 1} of {len(impacts)} at {moment}: {' and '.join(parts)}"
