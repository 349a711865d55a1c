"""One drop of a comparison, from an estimate document."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.report.quantity import Quantity

NUMBERS = (
    ("peak_force_N", "peak bearing force", "force"),
    ("mean_force_0p15_0p2_N", "mean force, 150 to 200 ms", "force"),
    ("peak_stress_Pa", "peak Hertz stress", "pressure"),
    ("mean_stress_Pa", "mean Hertz stress", "pressure"),
)
"""Numbers of an estimate document that are compared: key, name, kind."""


@dataclass(frozen=True, kw_only=True)
class ComparedDrop:
    """One drop of a comparison.

    Attributes
    ----------
    name : str
        Name of the drop.
    speed : float
        Speed at power-off [rad/s].
    numbers : mapping
        By bearing and name of the number in an estimate file (``"peak_force_N"``, …), with intervals.
    warnings : tuple of str
        What the estimate warns of.
    consistent : bool
        Whether the estimate's own checks found the model consistent with the record.
    method : str
        How it was estimated.
    record : str
        SHA-256 of the recording, to know a drop that is given twice.
    simulated : bool
        Whether the record is known to be simulated.
    """

    name: str
    speed: float
    numbers: Mapping[str, Mapping[str, Quantity]]
    warnings: tuple[str, ...] = ()
    consistent: bool = True
    method: str = ""
    record: str = ""
    simulated: bool = False

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
        if key in values:
            entry = values[key]
            interval = entry.get("interval_90")
            found[key] = Quantity(
                value=float(entry["value"]),
                kind=kind,
                interval_90=None if interval is None else (float(interval[0]), float(interval[1])),
                standard_error=entry.get("standard_error"),
                status=str(entry.get("status", "")),
            )
    return found
