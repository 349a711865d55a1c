"""One drop of a comparison: a published estimate under a name of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop
from rotordrop.report.quantity import Quantity, shown
from rotordrop.severity.numbers import Number
from rotordrop.units import format_minute, percent


@dataclass(frozen=True)
class ComparedDrop:
    """One drop of a comparison."""

    name: str
    drop: Drop
    """Its estimate."""

    @property
    def label(self) -> str:
        """Record, date and speed, for a table."""
        return ", ".join(
            part for part in (self.name, self.minute, shown(self.drop.speed_Hz, "frequency", 3)) if part
        )

    @property
    def minute(self) -> str:
        """When the recorder says the drop was, without seconds."""
        return format_minute(self.drop.recorded)

    def number(self, bearing: str, number: Number) -> Quantity:
        """A number at a bearing with its interval; a dash where the estimate does not state it.

        Of an estimate that is not consistent with its record the interval alone is shown.
        """
        found = self.drop.bearings[bearing].numbers.get(number.field)
        if found is None:
            return Quantity(value=math.nan, kind=number.shown_as)
        return Quantity(
            value=found.value,
            kind=number.shown_as,
            places=number.places,
            interval_90=found.interval,
            standard_error=found.standard_error,
            status=found.status or "",
            range_only=not self.drop.consistent,
        )

    def hardest(self, bearing: str) -> str:
        """Which impact gave the peak at a bearing, and which part of impulse and energy it made."""
        impacts = self.drop.bearings[bearing].impacts
        if not impacts:
            return "–"
        first = max(range(len(impacts)), key=lambda k: impacts[k].peak_force_N.value)
        hit, parts = impacts[first], []
        for part, all_of_it, name in (
            (hit.impulse_N_s, [one.impulse_N_s for one in impacts], "impulse"),
            (hit.dissipated_energy_J, [one.dissipated_energy_J for one in impacts], "energy"),
        ):
            whole = math.fsum(one.value for one in all_of_it)
            if whole > 0.0:
                parts.append(f"{percent(part.value / whole)} of the {name}")
        moment = shown(hit.peak_time_s, "time", 3)
        return f"impact {first + 1} of {len(impacts)} at {moment}: {' and '.join(parts)}"


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
    for one in sorted(drops, key=lambda one: not one.drop.consistent):
        record, method = one.drop.record_sha256, one.drop.method
        twin = counted.setdefault(record, one) if record else one
        same = seen.setdefault((record, method), one) if record else one
        if same is not one:
            raise UsageError(
                f"{same.name} and {one.name} are estimates of the same recording; expected another drop in "
                "each. Leave one of them out."
            )
        if not one.drop.consistent:
            reasons[one.name] = "its model is not consistent with its record"
        elif twin is not one:
            reasons[one.name] = f"the same recording as {twin.name}, estimated by {method}"
    return reasons
