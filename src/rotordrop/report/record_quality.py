"""Data quality: what the plausibility gate found in a record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from rotordrop.report.content import Level, Section, Statement, Table
from rotordrop.report.quantity import Quantity

LEVELS: dict[str, Level] = {
    "stop": "bad",
    "warning": "warning",
    "note": "notice",
}


COLUMNS = ("finding", "channel", "time in the record", "what was seen", "remedy")


class FindingLike(Protocol):
    """What a finding of the gate has to say: kind, channel, time [s], message, remedy, severity."""

    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def channel(self) -> str | None: ...  # noqa: D102
    @property
    def time(self) -> float | None: ...  # noqa: D102
    @property
    def message(self) -> str: ...  # noqa: D102
    @property
    def remedy(self) -> str: ...  # noqa: D102
    @property
    def severity(self) -> str: ...  # noqa: D102


def record_quality_section(findings: Sequence[FindingLike]) -> Section:
    """Tell what the gate found, each with channel, time and remedy; or that it found nothing."""
    if not findings:
        sound = Statement(text="The plausibility checks found nothing wrong with the record.", level="good")
        return Section(heading="Data quality", statements=(sound,))
    rows = tuple(
        (
            finding.kind,
            finding.channel or "all",
            "whole record" if finding.time is None else Quantity(value=finding.time, kind="time").text,
            finding.message,
            finding.remedy,
        )
        for finding in findings
    )
    return Section(
        heading="Data quality",
        statements=quality_statements(findings),
        tables=(
            Table(columns=("finding", "channel", "time in the record", "what was seen", "remedy"), rows=rows),
        ),
    )


def quality_statements(findings: Sequence[FindingLike]) -> tuple[Statement, ...]:
    """The findings as sentences, the serious ones first."""
    statements = [
        Statement(
            text=f"{f'Channel {finding.channel}: ' if finding.channel else ''}{finding.message}",
            level=LEVELS.get(str(finding.severity), "warning"),
        )
        for finding in findings
    ]
    order: dict[Level, int] = {"bad": 0, "warning": 1, "notice": 2, "good": 3}
    return tuple(sorted(statements, key=lambda statement: order[statement.level]))
