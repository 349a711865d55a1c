"""One drop as a row of a list: what a log keeps of it, written as a page shows it."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass, replace
from typing import Any

from rotordrop.ends import far_end_first
from rotordrop.ledger.book import LoggedDrop
from rotordrop.report.content import Figure, Statement, Table
from rotordrop.report.quantity import Quantity, System, display_unit
from rotordrop.severity.numbers import LOADS

SYSTEMS: tuple[System, ...] = ("SI", "US")
SHOWN_KINDS = ("length", "force", "pressure", "speed", "velocity", "stiffness", "mass", "energy", "impulse")
_LOADS = {load.field: load for load in LOADS}


def content_json(part: Any) -> Any:
    """A report or a part of it without its pictures, its numbers written in both systems of units."""
    if isinstance(part, Quantity):
        return quantity_json(part)
    if isinstance(part, Table):
        return table_json(part)
    if isinstance(part, Statement):
        return {"text": part.sentence, "level": part.level}
    if isinstance(part, tuple):
        return [content_json(one) for one in part if not isinstance(one, Figure)]
    if not is_dataclass(part):
        return part
    return {item.name: content_json(getattr(part, item.name)) for item in fields(part)}


def table_json(shown: Table) -> dict[str, Any]:
    """A table in both systems of units, the unit of a column in its heading."""
    in_units = {
        system: Table(
            shown.columns,
            tuple(
                tuple(replace(cell, system=system) if isinstance(cell, Quantity) else cell for cell in row)
                for row in shown.rows
            ),
        ).with_units_above()
        for system in SYSTEMS
    }
    heads = zip(*(in_units[system].columns for system in SYSTEMS), strict=True)
    rows = [[content_json(cell) for cell in row] for row in shown.rows]
    for system in SYSTEMS:
        for told, row in zip(rows, in_units[system].rows, strict=True):
            for cell, written in zip(told, row, strict=True):
                if isinstance(written, Quantity):
                    cell[system] = [written.levelled, written.interval_text]
    columns = [dict(zip(SYSTEMS, head, strict=True)) for head in heads]
    return {"columns": columns, "rows": rows, "caption": shown.caption, "note": shown.note}


def quantity_json(quantity: Quantity) -> dict[str, Any]:
    """A number as it is [SI] and as it is written, with its interval."""
    finite = math.isfinite(quantity.value) and not quantity.range_only
    told: dict[str, Any] = {"value": quantity.value if finite else None, "kind": quantity.kind}
    for system in SYSTEMS:
        shown = replace(quantity, system=system)
        told[system] = [shown.levelled, shown.interval_text]
    return told


def shown_units() -> dict[str, Any]:
    """What the page divides by [SI] and writes behind a number, by kind and system of units."""
    return {kind: {system: display_unit(kind, system) for system in SYSTEMS} for kind in SHOWN_KINDS}


def row_of(drop: LoggedDrop) -> dict[str, Any]:
    """A drop whose force is estimated; a number without an interval is no evidence, and none is here."""
    return {
        "machine": drop.machine,
        "recorded": drop.recorded,
        "sha256": drop.sha256,
        "simulated": drop.simulated,
        "method": drop.method,
        "verdict": drop.verdict,
        "speed": quantity_json(Quantity(value=drop.speed, kind="speed")),
        "numbers": [
            {
                "bearing": one.bearing,
                "field": one.quantity,
                "quantity": _LOADS[one.quantity].label,
                "lower": one.lower,
                "upper": one.upper,
                **quantity_json(
                    Quantity(
                        value=math.nan if one.value is None else one.value,
                        kind=_LOADS[one.quantity].kind,
                        interval_90=(one.lower, one.upper),
                    )
                ),
            }
            for one in far_end_first(drop.severity, lambda one: one.bearing)
            if one.quantity in _LOADS  # earlier versions let other ones into a log
        ],
    }
