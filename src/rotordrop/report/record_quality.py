"""Data quality: what the plausibility gate found in a record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotordrop.evidence.quality import NO_CHECK_SEES
from rotordrop.report.content import Column, Level, Section, Statement, table
from rotordrop.report.quantity import shown

if TYPE_CHECKING:
    from rotordrop.evidence.quality.finding import Finding

LEVELS: dict[str, Level] = {"stop": "bad", "warning": "warning", "note": "notice"}
"""Levels by severity of a finding, the gravest first."""
SOUND = "The plausibility checks found nothing wrong with the record."


def record_quality_section(findings: Sequence[Finding], *unseen: str) -> Section:
    """Tell what the gate found, with channel, time and remedy, or that it found nothing; what it cannot."""
    limits = tuple(map(Statement, unseen))
    if not findings:
        return Section("Data quality", statements=(Statement(SOUND, "good"), *limits))
    columns = (
        Column("finding", "kind"),
        Column("channel", lambda found: found.channel or "all"),
        Column("time in the record", lambda f: "whole record" if f.time is None else shown(f.time, "time")),
        Column("what was seen", "message"),
        Column("remedy", "remedy"),
    )
    return Section(
        "Data quality",
        statements=(*quality_statements(findings), *limits),
        tables=(table(findings, columns),),
    )


def unseen_in(notes: Sequence[str]) -> tuple[str, ...]:
    """What the gate cannot see, among the notes of an estimate."""
    return tuple(note for note in notes if note.startswith(NO_CHECK_SEES))


def quality_statements(findings: Sequence[Finding]) -> tuple[Statement, ...]:
    """The findings as sentences, the serious ones first; what would stop an estimate with its way out."""
    order = list(LEVELS)
    return tuple(
        Statement(
            (f"Channel {found.channel}: " if found.channel else "")
            + (f"{found.message}; {found.remedy}" if found.severity == "stop" else found.message),
            LEVELS[found.severity],
        )
        for found in sorted(findings, key=lambda found: order.index(found.severity))
    )
