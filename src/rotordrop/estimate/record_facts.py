"""What a record itself gives every estimate of it: findings of the gate, warnings, is it simulated."""

from __future__ import annotations

from dataclasses import dataclass

from rotordrop.errors import RecordError
from rotordrop.evidence.evidence import Evidence, Missing
from rotordrop.evidence.quality import Finding, found, gate, refuse_unusable, sentences

NO_TAIL = (
    "no settled tail: the air gap rests on its prior and on the contacts; give the readings at standstill"
)
COUNTED_TWICE = (
    "the machine was calibrated on a drop named {}: if it is this one, its readings count twice and the "
    "intervals are too narrow; use the machine file from before the calibration for it"
)


INCONSISTENT_CALIBRATION = (
    "the machine file was calibrated on drops that its model is not consistent with, so its air gaps and "
    "supports may be far off; use the file from before that calibration"
)


@dataclass(frozen=True, kw_only=True)
class RecordFacts:
    """Findings of the gate, what to warn of before anything is estimated, and whether it is simulated."""

    findings: tuple[Finding, ...]
    warnings: tuple[str, ...]
    simulated: bool

    def warnings_with(self, *further: str) -> tuple[str, ...]:
        """All warnings, each said once."""
        return tuple(dict.fromkeys(filter(None, (*self.warnings, *further))))


def facts_of(evidence: Evidence) -> RecordFacts:
    """What a record of a machine, with its settled tail, gives every estimate.

    Raises
    ------
    RecordError
        If the gate finds that results would be wrong.
    """
    record, name = evidence.record, evidence.name
    try:
        findings = gate(evidence).findings
    except RecordError as error:  # a lost sensor keeps the gate from looking, but not the twin from following
        findings = (found("not-looked-at", why=error),)
    refuse_unusable(findings, name)
    warnings = [text for text, severity in sentences(findings) if severity == "warning"]
    if evidence.tail is None and isinstance(evidence.still, Missing) and not evidence.held:
        warnings.append(NO_TAIL)
    origin = evidence.machine.calibration
    if origin is not None:
        same = [d.name for d in origin.drops if d.name == name or (d.sha256 and d.sha256 == record.sha256)]
        warnings += [COUNTED_TWICE.format(one) for one in same]
        warnings += [] if origin.consistent else [INCONSISTENT_CALIBRATION]
    return RecordFacts(findings=findings, warnings=tuple(warnings), simulated=record.is_simulated)
