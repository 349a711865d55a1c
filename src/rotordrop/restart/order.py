"""The drops of a set of bearings before a drop: what is known of each, in the order of their dates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, time

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop, Value


@dataclass(frozen=True, kw_only=True)
class EarlierDrop:
    """What is known of an earlier drop of the same bearings."""

    record: str
    recorded: str = ""
    """When it was (ISO 8601); empty where nobody knows."""
    sha256: str = ""
    """Digest of its recording; empty where it is not known."""
    estimate: Drop | None = None
    stresses: Mapping[str, Value] = field(default_factory=dict)
    """Peak Hertz stress by bearing [Pa]."""
    checks: Mapping[str, str] = field(default_factory=dict)
    """Checks that were made after it, with their outcome."""


def earlier_drop(drop: Drop) -> EarlierDrop:
    """An earlier drop by its estimate alone."""
    peaks = {name: one.numbers.get("peak_stress_Pa") for name, one in drop.bearings.items()}
    return EarlierDrop(
        record=drop.record,
        recorded=drop.recorded,
        sha256=drop.record_sha256,
        estimate=drop,
        stresses={name: peak for name, peak in peaks.items() if peak is not None},
    )


@dataclass(frozen=True, kw_only=True)
class MadeCheck:
    """A check that was made, with its outcome."""

    name: str
    outcome: str
    day: str = ""
    """When (ISO 8601); empty where it followed the present drop."""

    def __str__(self) -> str:
        return f"{self.day} {self.name}={self.outcome}".strip()


def in_order(
    drop: Drop, since: Sequence[Drop], logged: Sequence[EarlierDrop]
) -> tuple[list[EarlierDrop], list[str]]:
    """Earlier drops in the order of their dates, each once, and what is to be said.

    An estimate belongs to the drop of the log with its recording. A drop of the log that was later is left
    out. Where a date is missing, drops count in the order they are given, those of the log first.

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
    if len(since) > 1 and not all(_day(one.recorded) for one in since):
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
        others = "the other one" if len(before) == 1 else f"all {len(before)} others"
        verb = "counts" if len(before) == 1 else "count"
        remarks.append(f"This drop has no date: {others} of the log {verb} as earlier.")
    elif open_:
        has, counts = ("has", "counts") if open_ == 1 else ("have", "count")
        remarks.append(
            f"Of {len(before)} earlier drops of the log {open_} {has} no date and {counts} as earlier."
        )
    for estimate in since:
        found = earlier_drop(estimate)
        same = [k for k, one in enumerate(before) if one.sha256 and one.sha256 == found.sha256]
        if same:
            before[same[0]] = replace(before[same[0]], estimate=estimate)
        else:
            before.append(found)
    if all(_day(one.recorded) for one in before):
        before.sort(key=_moment)
    return before, remarks


def with_checks(
    drop: Drop, earlier: Sequence[EarlierDrop], made: Sequence[MadeCheck]
) -> tuple[list[EarlierDrop], dict[str, str]]:
    """Earlier drops with the checks that followed each, and the checks that followed the present drop.

    A check with a date belongs to the last drop before it; a day without a time ends at midnight.

    Raises
    ------
    UsageError
        If a check was before every drop with a date, or is stated twice of one drop.
    """
    found = [dict(one.checks) for one in earlier]
    now: dict[str, str] = {}
    dated = [(_day(one.recorded), of) for one, of in zip(earlier, found, strict=True)]
    for one in made:
        of = now
        if one.day:
            of = _followed(one, [*dated, (_day(drop.recorded), now)], drop)
        if of.get(one.name, one.outcome) != one.outcome or (of is now and one.name in of):
            raise UsageError(f"--check {one.name} is given twice of one drop; give the outcome that counts")
        of[one.name] = one.outcome
    return [replace(one, checks=of) for one, of in zip(earlier, found, strict=True)], now


def _followed(
    check: MadeCheck, dated: Sequence[tuple[datetime | None, dict[str, str]]], drop: Drop
) -> dict[str, str]:
    """The checks of the last drop before a check with a date."""
    when = _day(check.day)
    if when is None:
        raise UsageError(f"--check {str(check)!r}: {check.day!r} is no date; expected one such as 2026-03-14")
    if dated[-1][0] is None:
        raise UsageError(f"--check {str(check)!r} has a date, and the record {drop.record} has none")
    if "T" not in check.day:
        when = datetime.combine(when, time.max)
    before = [(day, k) for k, (day, _) in enumerate(dated) if day is not None and day <= when]
    if not before:
        raise UsageError(
            f"--check {str(check)!r} was before every drop that has a date; name its drop with --since "
            "or --log"
        )
    return dated[max(before)[1]][1]


def _moment(one: EarlierDrop) -> datetime:
    return _day(one.recorded) or datetime.min


def _day(text: str) -> datetime | None:
    """A moment by the clock of the place, to compare; zones differ by less than two drops do."""
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        return None
