"""The numbers of an estimate: headline per bearing, identified values with verdict."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rotordrop.elements.parameter import Role
from rotordrop.elements.table import LOADS, published
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.known import Known
from rotordrop.report.content import Card, Cell, KeyFigure, Table
from rotordrop.report.quantity import Quantity

MEANS = (
    "A mean force is the mean of the magnitude; the magnitude of the mean force would be smaller where its "
    "direction changes. The mean Hertz stress covers 0 to 200 ms, or what the record has of them."
)
"""What the mean numbers of an estimate are means of."""


def headline_card(bearing: BearingDrop, *, certain: bool = True) -> Card:
    """Headline numbers of one bearing, peaks first, each with its time, or the reason why it is missing.

    Parameters
    ----------
    bearing : BearingDrop
        The bearing.
    certain : bool
        Whether single numbers hold; else only ranges are shown.
    """
    known: dict[str, Known] = {
        **bearing.values,
        "peak_force_N": bearing.peak_force.known,
        "peak_stress_Pa": bearing.peak_stress.known,
    }
    times = {"peak_force_N": bearing.peak_force.time, "peak_stress_Pa": bearing.peak_stress.time}
    figures = []
    for load in LOADS:
        field, label = load.field, f"{load.label[0].upper()}{load.label[1:]}"
        reason = bearing.missing.get(field, "")
        if field not in known and not reason:
            continue
        value = Quantity.of(known.get(field), load.kind, range_only=not certain)
        words = [reason]
        if field in times and certain:
            words.insert(0, f"at {Quantity(value=times[field], kind='time', digits=3).text}")
        note = "; ".join(word for word in words if word)
        figures.append(KeyFigure(label=label if certain else f"{label}, range", value=value, note=note))
    source = f"by the {bearing.peak_force.origin.value}"
    return Card(title=f"{bearing.name} touchdown bearing, {source}", figures=tuple(figures))


def identified_table(bearings: Sequence[BearingDrop], *, taken_over: str = "", certain: bool = True) -> Table:
    """Identified values of every bearing side by side, each with its interval and verdict.

    Parameters
    ----------
    bearings : sequence of BearingDrop
        The drop.
    taken_over : str
        File from which supports and friction were taken over; empty when they were identified.
    certain : bool
        Whether single numbers hold; else only ranges are shown.
    """
    rows: list[tuple[Cell, ...]] = []
    for row in published().values():
        sought = row.role in (Role.SOUGHT, Role.DERIVED)
        if sought and any(row.field in bearing.values for bearing in bearings):
            cells: list[Cell] = []
            for bearing in bearings:
                value = bearing.values.get(row.field)
                shown = Quantity.of(value, row.display_kind, range_only=not certain)
                cells += [shown, _status(value, taken_over)]
            rows.append((row.label, *cells))
    columns = [text for bearing in bearings for text in (bearing.name, f"{bearing.name}: verdict")]
    return Table(
        columns=("identified", *columns),
        rows=tuple(rows),
        caption="Identified values",
        note=f"Below a value: its 90 % interval, or the limits the record itself sets. {MEANS}",
    )


def _status(value: Known | None, taken_over: str) -> str:
    if value is None:
        return "not estimated"
    if taken_over and value.status == "taken over":
        return f"taken over from {Path(taken_over).name}"
    return value.status
