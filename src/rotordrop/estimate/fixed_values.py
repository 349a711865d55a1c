"""Supports and friction of an earlier estimate, applied to another drop (Neisi 2020, section 5.1)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotordrop.elements.parameter import Role, Step
from rotordrop.elements.table import rows
from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop, drop_of, read_drop
from rotordrop.known import Known
from rotordrop.machine import Machine


def read_fixed(fixed: str | Path | Mapping[str, Any]) -> tuple[Drop, str]:
    """An earlier estimate, from its file or its document, and where it comes from.

    Raises
    ------
    UsageError
        If it cannot be read, is no estimate, or holds several drops.
    """
    if isinstance(fixed, Mapping):
        return drop_of(fixed, "an earlier estimate"), "an earlier estimate"
    return read_drop(Path(fixed)), str(fixed)


def machine_with_fixed(machine: Machine, drop: Drop, place: str) -> Machine:
    """The machine with supports, friction and what was found beside them in an earlier estimate.

    Raises
    ------
    UsageError
        If the estimate lacks a bearing of the machine, or its support or friction.
    """
    values: dict[str, Known] = {}
    for bearing in machine.touchdown_bearings:
        entry = drop.bearings.get(bearing.name)
        if entry is None:
            raise UsageError(
                f"{place} has no touchdown bearing {bearing.name!r}; it has "
                f"{', '.join(drop.bearings)}. Use an estimate of the same machine."
            )
        for row in (row for row in rows("bearing") if row.step in (Step.IMPACTS, Step.SWEEP)):
            found = entry.numbers.get(row.field)
            if found is not None:
                values[row.path_of(bearing.name)] = Known(
                    value=found.value,
                    status="estimated",
                    interval_90=found.interval,
                    standard_error=found.standard_error,
                    source=f"estimate {place}",
                )
            elif row.role is Role.SOUGHT:
                raise UsageError(
                    f"{place} has no {row.field!r} for {bearing.name!r}; it has {', '.join(entry.numbers)}. "
                    "Give an estimate that identified supports and friction."
                )
    return machine.with_values(values)
