"""Severity of a drop in one table: safety, impulse, energy, indices, fatigue, and what each rests on."""

from __future__ import annotations

from rotordrop.elements.race_bearing import numbers_of
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.severity_numbers import severity_values
from rotordrop.report.content import Cell, Section, Table
from rotordrop.report.quantity import Quantity
from rotordrop.severity.numbers import NOTE, SEVERITY


def severity_section(estimate: Estimate) -> Section:
    """Table of all severity numbers of a drop, bearing by bearing."""
    found = [severity_values(estimate, bearing) for bearing in estimate.bearings]
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            one.label,
            *(
                Quantity.of(values.get(one.field), one.kind, range_only=not estimate.consistent)
                for values in found
            ),
        )
        for one in SEVERITY
        if any(one.field in values for values in found)
    )
    return Section(
        heading="Severity",
        text=tuple(_rating(estimate, bearing.name) for bearing in estimate.bearings),
        tables=(
            Table(
                columns=("severity", *(bearing.name for bearing in estimate.bearings)),
                rows=rows,
                caption="Severity of the drop",
                note=NOTE,
            ),
        ),
    )


def _rating(estimate: Estimate, name: str) -> str:
    ratings = numbers_of(estimate.machine.bearing(name)).ratings()
    if ratings is None:
        return f"{name}: no load ratings."
    static, dynamic = (
        Quantity(value=value, kind="force", digits=3).text for value in (ratings.static, ratings.dynamic)
    )
    return f"{name}: C0 = {static} of all rows ({ratings.rows}), C = {dynamic} of one, {ratings.source}."
