"""One drop of a comparison, from a published estimate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop, Impact
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
    def of_drop(cls, name: str, drop: Drop) -> ComparedDrop:
        """Take it from a published estimate."""
        return cls(
            name=name,
            speed=2 * math.pi * drop.speed_Hz,
            numbers={
                bearing: {
                    key: Quantity(
                        value=found.value,
                        kind=kind,
                        interval_90=found.interval,
                        standard_error=found.standard_error,
                        status=found.status or "",
                    )
                    for key, _, kind in NUMBERS
                    if (found := entry.numbers.get(key)) is not None
                }
                for bearing, entry in drop.bearings.items()
            },
            warnings=tuple(drop.warnings),
            consistent=drop.consistent,
            method=drop.method,
            record=drop.record_sha256,
            simulated=drop.simulated_record,
            machine=drop.machine,
            recorded=drop.recorded,
            statistics={
                bearing: entry.stress_statistics_Pa.as_json() for bearing, entry in drop.bearings.items()
            },
            hardest={
                bearing: text for bearing, entry in drop.bearings.items() if (text := _hardest(entry.impacts))
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


def _hardest(impacts: Sequence[Impact]) -> str:
    """Which impact gave the peak, and which part of impulse and energy it made."""
    if not impacts:
        return ""
    first = max(range(len(impacts)), key=lambda k: impacts[k].peak_force_N.value)
    hit = impacts[first]
    parts = []
    for key, name in (("impulse_N_s", "impulse"), ("dissipated_energy_J", "energy")):
        whole = math.fsum(getattr(one, key).value for one in impacts)
        if whole > 0.0:
            parts.append(f"{getattr(hit, key).value / whole:.0%} of the {name}")
    moment = Quantity(value=hit.peak_time_s, kind="time", digits=3).text
    return f"impact {first + 1} of {len(impacts)} at {moment}: {' and '.join(parts)}"
