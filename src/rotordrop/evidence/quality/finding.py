"""What the gate has to say about a record: its sentences stand in ``findings.toml``."""

from __future__ import annotations

import string
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any, Literal

from rotordrop.errors import RecordError
from rotordrop.units import KINDS, format_quantity, percent

Severity = Literal["stop", "warning", "note"]

_ORDER: tuple[Severity, ...] = ("stop", "warning", "note")
WIRING = ("swapped ends", "swapped channels", "swapped axes", "inverted polarity", "machine file")
"""Kinds that say that sensors are not as they are described, on which every method rests."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A fault of a record, or a fault that cannot be ruled out."""

    kind: str
    """Name of the fault, one of those in ``findings.toml``."""
    message: str
    """What was seen, with the numbers."""
    remedy: str
    """What to do about it."""
    severity: Severity
    """Stop: results would be wrong; warning: they are less certain; note: cannot be decided."""
    channel: str | None = None
    """The channel, or several; None for all."""
    time: float | None = None
    """When, in record time [s]."""

    def __str__(self) -> str:
        where = f" {self.channel}" if self.channel and self.channel not in self.kind else ""
        when = f" at {self.time:.6g} s" if self.time is not None else ""
        return f"{self.kind}{where}{when}: {self.message}; {self.remedy}"


class _Words(string.Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        if format_spec == "percent":
            return percent(float(value))
        return (
            format_quantity(float(value), format_spec) if format_spec in KINDS else format(value, format_spec)
        )


@cache
def _table() -> dict[str, dict[str, Any]]:
    return tomllib.loads(resources.files(__package__).joinpath("findings.toml").read_text(encoding="utf-8"))


def found(
    row: str,
    said: Mapping[str, Any] | None = None,
    *,
    channel: str | Iterable[str] | None = None,
    time: float | None = None,
    kind: str | None = None,
    severity: Severity | None = None,
    **numbers: Any,
) -> Finding:
    """A finding by its row in ``findings.toml``, with what its sentence says [SI where a kind is named].

    Kind and severity are those of the row where none is given.
    """
    row_of, words, numbers = _table()[row], _Words(), {**(said or {}), **numbers, "time": time}
    return Finding(
        kind=kind or row_of["kind"],
        message=words.vformat(row_of["says"], (), numbers),
        remedy=words.vformat(row_of["remedy"], (), numbers),
        severity=severity or row_of["severity"],
        channel=channel if channel is None or isinstance(channel, str) else ", ".join(channel),
        time=time,
    )


_SAME_CHANNEL = ("late channel", "soft saturation")


def standing(findings: Iterable[Finding]) -> list[Finding]:
    """The findings that stand beside the graver kinds to which they yield by ``findings.toml``."""
    every = list(findings)
    graver = [one for one in every if one.severity != "note"]

    def explained(one: Finding) -> bool:
        yields_to = _table()["yields"].get(one.kind, ())
        same = one.kind in _SAME_CHANNEL
        return any(o.kind in yields_to and (not same or o.channel == one.channel) for o in graver)

    stand = [one for one in every if not explained(one)]
    # a fall that leans stops where the sensors look in other directions before the first contact too
    turned = any(one.kind == "turned sensors" for one in stand)
    return [replace(one, severity="stop") if turned and one.kind == "leaning fall" else one for one in stand]


def ranked(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Order findings by severity, the worst first, otherwise as found."""
    return tuple(sorted(findings, key=lambda finding: _ORDER.index(finding.severity)))


def sentences(findings: Iterable[Finding]) -> tuple[tuple[str, Severity], ...]:
    """What the findings say, the gravest first; what forbids to go on with its way out.

    A kind that several channels have is told of the first, and the others are named.
    """
    count = Counter[tuple[str, str | None]]()
    alike: dict[tuple[str, bool, int], list[Finding]] = {}
    for one in ranked(findings):
        count[one.kind, one.channel] += 1
        alike.setdefault((one.kind, bool(one.channel), count[one.kind, one.channel]), []).append(one)
    told: list[tuple[str, Severity]] = []
    for first, *others in alike.values():
        where = f"Channel {first.channel}: " if first.channel else ""
        also = f" (likewise {', '.join(str(one.channel) for one in others)})" if others else ""
        way_out = f"; {first.remedy}" if first.severity == "stop" else ""
        told.append((f"{where}{first.message}{also}{way_out}", first.severity))
    return tuple(told)


def stops(findings: Iterable[Finding]) -> bool:
    """Whether any finding forbids to go on."""
    return any(finding.severity == "stop" for finding in findings)


def refuse_unusable(findings: Iterable[Finding], name: str = "the record") -> None:
    """Raise an error that lists every finding that forbids to go on.

    Raises
    ------
    RecordError
        When there is at least one.
    """
    fatal = [str(finding) for finding in findings if finding.severity == "stop"]
    if fatal:
        count = "" if len(fatal) == 1 else f" ({len(fatal)} faults)"
        raise RecordError(f"{name} cannot be used{count}: " + "\n  also: ".join(fatal))
