"""Supports and friction of an earlier estimate, applied to another drop (Neisi 2020, section 5.1)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotordrop.elements.table import rows
from rotordrop.errors import UsageError
from rotordrop.known import Correlation, Known
from rotordrop.machine import Machine

Document = Mapping[str, Any]


def read_fixed(fixed: str | Path | Document) -> tuple[Document, str]:
    """Document of an earlier estimate, and where it comes from.

    Raises
    ------
    UsageError
        If it cannot be read, holds several drops, or correlations of another form.
    """
    if isinstance(fixed, Mapping):
        document, place = fixed, "an earlier estimate"
    else:
        place = str(fixed)
        try:
            document = json.loads(Path(fixed).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise UsageError(
                f"{place} cannot be read as an estimate ({error}); give a file written by 'rotordrop "
                "estimate --json'."
            ) from error
        if not isinstance(document, Mapping):
            raise UsageError(
                f"{place} holds a {type(document).__name__}; expected an object with 'bearings'. Give a file "
                "written by 'rotordrop estimate --json'."
            )
    if isinstance(document.get("drops"), Mapping):
        raise UsageError(
            f"{place} holds the drops {', '.join(document['drops'])}; expected one. Write the drop whose "
            "supports are to be used to a file of its own."
        )
    if not isinstance(document.get("bearings"), Mapping):
        raise UsageError(
            f"{place} holds {', '.join(document) or 'nothing'}; expected 'bearings' with their supports. "
            "Give a file written by 'rotordrop estimate --json'."
        )
    fixed_correlations(document, place)  # refused before the fall is computed, not after
    return document, place


def machine_with_fixed(machine: Machine, document: Document, place: str) -> Machine:
    """The machine with supports, friction and what was found beside them in an earlier estimate.

    Raises
    ------
    UsageError
        If the estimate lacks a bearing of the machine, or its support or friction.
    """
    values: dict[str, Known] = {}
    for bearing in machine.touchdown_bearings:
        entry = document["bearings"].get(bearing.name)
        if not isinstance(entry, Mapping):
            raise UsageError(
                f"{place} has no touchdown bearing {bearing.name!r}; it has "
                f"{', '.join(document['bearings'])}. Use an estimate of the same machine."
            )
        for row in (row for row in rows("bearing") if row.taken_over != "no"):
            found = _at(entry, row.field)
            if found is not None:
                values[row.path_of(bearing.name)] = _estimated(found, f"estimate {place}")
            elif row.taken_over == "needed":
                raise UsageError(
                    f"{place} has no {row.field!r} for {bearing.name!r}; it has {', '.join(entry)}. Give an "
                    "estimate that identified supports and friction."
                )
    return machine.with_values(values)


def _at(entry: Mapping[str, Any], field: str) -> Mapping[str, Any] | None:
    at: Any = entry
    for key in field.split("."):
        at = at.get(key) if isinstance(at, Mapping) else None
    return at if isinstance(at, Mapping) and "value" in at else None


def _estimated(found: Mapping[str, Any], source: str) -> Known:
    interval = found.get("interval_90")
    return Known(
        value=float(found["value"]),
        status="estimated",
        interval_90=None if interval is None else (float(interval[0]), float(interval[1])),
        standard_error=found.get("standard_error"),
        source=source,
    )


def fixed_correlations(document: Document, place: str = "an earlier estimate") -> tuple[Correlation, ...]:
    """Correlations of support values in an earlier estimate; may be empty.

    Raises
    ------
    UsageError
        If they are something else: without them the intervals would be others, and nobody would know.
    """
    at: Any = document.get("identification")
    for key in ("support", "correlations"):
        at = at.get(key) if isinstance(at, Mapping) else None
    try:
        return tuple(
            Correlation(first=str(pair["first"]), second=str(pair["second"]), value=float(pair["value"]))
            for pair in at or ()
        )
    except (TypeError, KeyError, ValueError) as error:
        raise UsageError(
            f"{place} holds the correlations {str(at)[:80]}; expected a list of "
            "'first', 'second' and 'value'. Estimate that drop anew with this version."
        ) from error
