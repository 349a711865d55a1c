"""The numbers of an estimate: headline per bearing, identified values with verdict."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.elements.parameter import Parameter, Role
from rotordrop.elements.table import published
from rotordrop.estimate.bearing_drop import BearingDrop, Origin, Peak
from rotordrop.known import Known
from rotordrop.report.content import Card, Column, KeyFigure, Statement, Table, table, verdict_column
from rotordrop.report.quantity import Quantity, shown, with_interval
from rotordrop.severity.numbers import LOADS

MEANS = (
    "A mean force is the mean of the magnitude; the magnitude of the mean force would be smaller where its "
    "direction changes. The mean Hertz stress covers 0 to 200 ms, or what the record has of them."
)
"""What the mean numbers of an estimate are means of."""


def headline_card(bearing: BearingDrop, *, certain: bool = True) -> Card:
    """Headline numbers of one bearing, peaks first, each with its time, or the reason why it is missing.

    Single numbers are shown where they are certain, else ranges.
    """
    known: dict[str, Known] = {
        **bearing.values,
        "peak_force_N": bearing.peak_force.known,
        "peak_stress_Pa": bearing.peak_stress.known,
    }
    peaks = {"peak_force_N": bearing.peak_force, "peak_stress_Pa": bearing.peak_stress}
    figures = []
    for load in LOADS:
        field, label = load.field, f"{load.label[0].upper()}{load.label[1:]}"
        reason = bearing.missing.get(field, "")
        if field not in known and not reason:
            continue
        value = Quantity.of(known.get(field), load.kind, range_only=not certain)
        at = moment_of(peaks[field]) if field in peaks and certain else ""
        note = "; ".join(filter(None, (at, reason)))
        figures.append(KeyFigure(label if certain else f"{label}, range", value, note))
    source = f"by the {bearing.peak_force.origin.value}"
    return Card(f"{bearing.name} touchdown bearing, {source}", tuple(figures))


def moment_of(peak: Peak) -> str:
    """When a peak was, in words; nothing where it was estimated and its error is not known."""
    if peak.origin is Origin.SIMULATION:
        return f"at {shown(peak.time, 'time', 3)}"
    if peak.time_interval_90 is None:
        return ""
    return f"at {with_interval(peak.time, 'time', peak.time_interval_90)}"


def static_limit_statement(bearing: BearingDrop, *, certain: bool = True) -> Statement:
    """Set a peak stress beside the stress of the static load rating, as information."""
    peak = Quantity.of(bearing.peak_stress.known, "pressure", range_only=not certain)
    stress, high = peak.value, peak.ends[1]
    share = " to ".join(dict.fromkeys(f"{100.0 * end / STATIC_STRESS:.0f}" for end in peak.ends))
    between = f" ({peak.interval_text})" if peak.interval_text else ""
    text = (
        f"{bearing.name}: the peak stress of {peak.text}{between} is {share} % of the "
        f"{shown(STATIC_STRESS, 'pressure')} at which ISO 76 defines the static load rating of ball "
        "bearings (information, not an acceptance limit)."
    )
    return Statement(text, "notice" if (stress if certain else high) < STATIC_STRESS else "warning")


def identified_table(bearings: Sequence[BearingDrop], *, taken_over: str = "", certain: bool = True) -> Table:
    """Identified values of every bearing side by side, with interval, and verdict unless determined.

    Supports and friction may be taken over from a file; single numbers are shown where they are certain.
    """

    def of(bearing: BearingDrop) -> tuple[Column, Column]:
        def value(row: Parameter) -> Quantity:
            found = bearing.values.get(row.field)
            return Quantity.of(found, row.display_kind, range_only=not certain)

        def verdict(row: Parameter) -> str:
            known = bearing.values.get(row.field)
            if known is None:
                return "not estimated"
            if taken_over and known.status == "taken over":
                return f"taken over from {Path(taken_over).name}"
            return known.status

        return Column(bearing.name, value), verdict_column(verdict, f"{bearing.name}: verdict")

    rows = [
        row
        for row in published().values()
        if row.role in (Role.SOUGHT, Role.DERIVED) and any(row.field in b.values for b in bearings)
    ]
    columns = (Column("identified", "label"), *(column for bearing in bearings for column in of(bearing)))
    note = f"Below a value: its 90 % interval, or the limits the record itself sets. {MEANS}"
    return table(rows, columns, "Identified values", note)
