"""What the gate has to say about a record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from rotordrop.errors import RecordError

Severity = Literal["stop", "warning", "note"]

_ORDER: tuple[Severity, ...] = ("stop", "warning", "note")


class Kind(StrEnum):
    """What the gate can find, by the names that documents carry."""

    DAMAGE = "damage on reading"
    MISSING_SAMPLES = "missing samples"
    DEAD_CHANNEL = "dead channel"
    STUCK_CHANNEL = "stuck channel"
    ZEROED = "zeroed block"
    BRIDGED = "bridged gap"
    TORN = "damaged block"
    CLIPPING = "clipping"
    SPIKES = "spikes"
    COARSE = "coarse quantisation"
    BACKWARD_TIME = "non-monotonic time"
    JITTERED_CLOCK = "jittered clock"
    SLOW_SAMPLING = "slow sampling"
    WRONG_RATE = "wrong sampling rate"
    DROPPED_BLOCK = "dropped block"
    DUPLICATE_BLOCK = "duplicate block"
    WRONG_UNIT = "wrong unit factor"
    WRONG_AIR_GAP = "wrong air gap"
    NO_SPEED = "speed missing"
    SPEED_READINGS = "speed readings"
    DEAD_SPEED = "dead speed"
    NEGATIVE_SPEED = "negative speed"
    WRONG_SPEED_UNIT = "wrong speed unit"
    WRONG_SPEED = "wrong speed"
    SWAPPED_AXES = "swapped axes"
    SWAPPED_ENDS = "swapped ends"
    SWAPPED_CHANNELS = "swapped channels"
    INVERTED = "inverted polarity"
    SENSE_OF_ORBIT = "sense of the orbit"
    LEANING = "leaning fall"
    LEANING_REST = "leaning rest"
    TURNED = "turned sensors"
    UNDECIDED_ENDS = "ends"
    LATE_CHANNEL = "late channel"
    WRONG_GAIN = "wrong gain"
    SATURATION = "soft saturation"
    LOW_PASS = "recorder low-pass"
    AC_COUPLING = "AC coupling"
    SECOND_DROP = "second drop"
    HUM = "hum"
    NOISE = "noise"
    DRIFT = "drift"
    SHORT = "short record"
    ENDS_TURNING = "record ends before standstill"
    NO_PRETRIGGER = "missing pre-trigger"
    NO_DROP = "no drop in the record"
    ONE_END = "one end held"
    NOT_SETTLED = "not settled"
    TAIL_OFFSET = "tail offset"
    MACHINE_FILE = "machine file"
    NOT_LOOKED_AT = "not looked at"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A fault of a record, or a fault that cannot be ruled out."""

    kind: Kind
    """Name of the fault."""
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
