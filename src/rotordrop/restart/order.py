"""Which drops came before a drop, by the dates of their records, and in which order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop, Value


@dataclass(frozen=True, kw_only=True)
class EarlierDrop:
    """A drop as a log keeps it."""

    record: str
    recorded: str
    """When it was (ISO 8601); empty where nobody knows."""
    stresses: Mapping[str, Value]
    """Peak Hertz stress by bearing [Pa]."""


def in_order(
    drop: Drop, since: Sequence[Drop], logged: Sequence[EarlierDrop]
) -> tuple[list[Drop], list[Mapping[str, Value]], list[str]]:
    """Earlier estimates and stresses of earlier drops in the order of their dates, and what is to be said.

    A drop of the log that was later is left out. Where a date is missing the drop counts as earlier, and the
    order is the one given.

    Raises
    ------
    UsageError
        If an estimate that is said to be earlier was later.
    """
    now, remarks = _day(drop.recorded), []
    for one in since:
        if now is not None and (day := _day(one.recorded)) is not None and day > now:
            raise UsageError(
                f"--since {one.record} is of {one.recorded}, later than {drop.record} of {drop.recorded}; "
                "name estimates of earlier drops"
            )
    dated = all(_day(one.recorded) is not None for one in since)
    ordered = sorted(since, key=_moment) if dated else list(since)
    if not dated and len(since) > 1:
        remarks.append("Not all earlier estimates have a date: they count in the order they are given.")
    later = [
        one for one in logged if now is not None and (day := _day(one.recorded)) is not None and day > now
    ]
    if later:
        names = ", ".join(f"{one.record} ({one.recorded})" for one in later[:3])
        remarks.append(f"Later than this drop and left out: {len(later)} of the log, {names}.")
    before = [one for one in logged if one not in later]
    open_ = sum(_day(one.recorded) is None for one in before)
    if before and now is None:
        remarks.append(f"This drop has no date: all {len(before)} others of the log count as earlier.")
    elif open_:
        remarks.append(f"{open_} of {len(before)} drops of the log have no date, and count as earlier.")
    if not open_:
        before.sort(key=_moment)
    return ordered, [one.stresses for one in before], remarks


def _moment(one: Drop | EarlierDrop) -> datetime:
    return _day(one.recorded) or datetime.min


def _day(text: str) -> datetime | None:
    """A moment by the clock of the place, to compare; zones differ by less than two drops do."""
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        return None
