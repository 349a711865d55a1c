"""Numbers as the page shows them: in both systems of units, written once, by the functions of the reports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from rotordrop.report.content import Table
from rotordrop.report.quantity import Quantity, System, display_unit

SYSTEMS: tuple[System, ...] = ("SI", "US")
SHOWN_KINDS = ("length", "force", "pressure", "speed")


def quantity_json(quantity: Quantity) -> dict[str, Any]:
    """A number as it is [SI] and as it is written, with its interval."""
    finite = math.isfinite(quantity.value) and not quantity.range_only
    told: dict[str, Any] = {"value": quantity.value if finite else None, "kind": quantity.kind}
    for system in SYSTEMS:
        shown = replace(quantity, system=system)
        told[system] = [shown.levelled, shown.interval_text]
    return told


def columns_json(
    heads: Sequence[str], rows: Sequence[Sequence[Quantity]]
) -> tuple[list[dict[str, str]], list[list[dict[str, Any]]]]:
    """Columns of numbers: headings with the unit that a column shares, and rows of numbers without it."""
    told = [[quantity_json(cell) for cell in row] for row in rows]
    above: dict[str, Sequence[str]] = {}
    for system in SYSTEMS:
        cells = (tuple(replace(cell, system=system) for cell in row) for row in rows)
        shown = Table(tuple(heads), tuple(cells)).with_units_above()
        above[system] = shown.columns
        for one, row in zip(told, shown.rows, strict=True):
            for cell, number in zip(one, row, strict=True):
                assert isinstance(number, Quantity)
                cell[system] = [number.levelled, number.interval_text]
    return [{system: above[system][k] for system in SYSTEMS} for k in range(len(heads))], told


def shown_units() -> dict[str, Any]:
    """What the page divides by [SI] and writes behind a number, by kind and system of units."""
    return {kind: {system: display_unit(kind, system) for system in SYSTEMS} for kind in SHOWN_KINDS}
