"""The numbers of an estimate: headline per bearing, identified values with verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from rotordrop.estimated import IdentifiedValue
from rotordrop.model.parameter import Parameter, Role
from rotordrop.model.parameter_table import LOADS, published
from rotordrop.report.content import Card, Cell, KeyFigure, Table
from rotordrop.report.quantity import Quantity

Values = Mapping[str, IdentifiedValue]

MEANS = (
    "A mean force is the mean of the magnitude; the magnitude of the mean force would be smaller where its "
    "direction changes. The mean Hertz stress covers 0 to 200 ms, or what the record has of them."
)
"""What the mean numbers of an estimate are means of."""


def headline_card(bearing: str, values: Values, peak_times: Mapping[str, float]) -> Card:
    """Headline numbers of one bearing, peaks first, with the time of a peak where it is known.

    Parameters
    ----------
    bearing : str
        Name of the bearing.
    values : mapping
        Identified values by the field names of the estimate's JSON.
    peak_times : mapping
        Time [s] of the peaks by field name.
    """
    figures = []
    for load in LOADS:
        if load.field not in values:
            continue
        value = Quantity.of(values[load.field], load.kind)
        note = "" if value.interval_90 or not value.status else f"no interval: {value.status}"
        if load.field in peak_times:
            moment = Quantity(value=peak_times[load.field], kind="time", digits=3).text
            note = f"at {moment}{f'; {note}' if note else ''}"
        figures.append(KeyFigure(label=f"{load.label[0].upper()}{load.label[1:]}", value=value, note=note))
    return Card(title=f"{bearing} touchdown bearing", figures=tuple(figures))


def identified_table(bearings: Mapping[str, Values], *, taken_over: str = "") -> Table:
    """Identified values of every bearing side by side, each with its interval and verdict.

    Parameters
    ----------
    bearings : mapping
        Identified values of every bearing.
    taken_over : str
        File from which supports and friction were taken over; empty when they were identified.
    """
    rows: list[tuple[Cell, ...]] = []
    for row in published().values():
        sought = row.role in (Role.SOUGHT, Role.DERIVED)
        if sought and any(row.field in values for values in bearings.values()):
            cells: list[Cell] = []
            for values in bearings.values():
                value = values.get(row.field)
                cells += [Quantity.of(value, row.display_kind), _status(row, value, taken_over)]
            rows.append((row.label, *cells))
    columns = [text for bearing in bearings for text in (bearing, f"{bearing}: verdict")]
    return Table(
        columns=("identified", *columns),
        rows=tuple(rows),
        caption="Identified values",
        note=f"Below a value: its 90 % interval, or the limits the record itself sets. {MEANS}",
    )


def _status(row: Parameter, value: IdentifiedValue | None, taken_over: str) -> str:
    if value is None:
        return "not estimated"
    if taken_over and value.status == "prior" and row.taken_over != "no":
        return f"taken over from {Path(taken_over).name}"
    return value.status


def half_width(value: IdentifiedValue) -> float:
    """Half width of the 90 % interval relative to the value [1]; NaN without an interval."""
    if value.interval_90 is None or not value.value:
        return math.nan
    return 0.5 * (value.interval_90[1] - value.interval_90[0]) / abs(value.value)
