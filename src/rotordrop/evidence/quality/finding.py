"""What the gate has to say about a record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from rotordrop.errors import RecordError

Severity = Literal["stop", "warning", "note"]

_ORDER: tuple[Severity, ...] = ("stop", "warning", "note")


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A fault of a record, or a fault that cannot be ruled out.

    Attributes
    ----------
    kind : str
        Name of the fault.
    message : str
        What was seen, with the numbers.
    remedy : str
        What to do about it.
    severity : {"stop", "warning", "note"}
        "stop": results would be wrong. "warning": results are less certain. "
        ""note": cannot be decided from the record.
    channel : str, optional
        The channel, or several; None for all.
    time : float, optional
        When, in record time [s].
    """

    kind: str
    message: str
    remedy: str
    severity: Severity
    channel: str | None = None
    time: float | None = None

    def __str__(self) -> str:
        where = f" {self.channel}" if self.channel else ""
        when = f" at {self.time:.6g} s" if self.time is not None else ""
        return f"{self.kind}{where}{when}: {self.message}; {self.remedy}"


def ranked(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Order findings by severity, the worst first, otherwise as found."""
    return tuple(sorted(findings, key=lambda finding: _ORDER.index(finding.severity)))


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
