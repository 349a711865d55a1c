"""The gate every record passes before anything is computed from it.

It looks at the clock, at every channel, and at what a drop must show. What it cannot decide it says (severity
"note"). The checks stand in a table of stages that ask the evidence: a later stage runs only when the earlier
ones found nothing that forbids it. Their sentences, and which finding yields to which, stand in
``findings.toml``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.errors import NoDropError, NothingFallsError, RecordError
from rotordrop.evidence.ends import held_planes
from rotordrop.evidence.events import nominal_gaps
from rotordrop.evidence.evidence import Evidence, Missing, known
from rotordrop.evidence.given import require_drop, require_tail
from rotordrop.evidence.levitated import LevitatedModel, fit_levitated
from rotordrop.evidence.one_end import LEVITATED, OFF_ZERO, as_dropped, off_zero, one_end
from rotordrop.evidence.paths import Motion
from rotordrop.evidence.quality.arrangement import check_ends_named, check_planes, fall_of
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.fall import (
    check_ends,
    check_exchanged,
    fell_as_described,
    read_otherwise,
)
from rotordrop.evidence.quality.finding import (
    Finding,
    Severity,
    found,
    ranked,
    refuse_unusable,
    sentences,
    standing,
    stops,
)
from rotordrop.evidence.quality.flight import check_flights, gains_hold
from rotordrop.evidence.quality.motion import (
    check_gaps,
    check_length,
    check_levitated,
    check_rotation_line,
    check_units,
    first_motion,
    hum_instead_of_a_drop,
)
from rotordrop.evidence.quality.recorder import (
    check_again,
    check_blocks,
    check_clock,
    check_coupling,
    check_low_pass,
    check_speed,
)
from rotordrop.evidence.quality.tail import check_rest_in_record, check_tail
from rotordrop.machine import Machine
from rotordrop.one_thread import one_thread
from rotordrop.record.record import Record
from rotordrop.units import GRAVITY

_NEAR = 0.5
"""Time after the drop that the comparison with a free fall is given [s]."""

_FALL_TIME = 8e-3
"""Longest plausible time from power-off to visible sinking [s]."""


def check_record(record: Record, machine: Machine, tail: Record | None = None) -> tuple[Finding, ...]:
    """Pass a record through the gate.

    Parameters
    ----------
    record : Record
        The recording of a drop.
    machine : Machine
        The machine it was made on.
    tail : Record, optional
        The readings at standstill, when they are a recording of their own.

    Returns
    -------
    tuple of Finding
        The worst first; empty when there is nothing to say.
    """
    require_drop(record, machine)
    require_tail(tail, record, machine)
    dropped = as_dropped(record, machine)
    return gate(Evidence(record=record, machine=dropped, tail=tail, name=record.name)).findings


@dataclass(frozen=True, kw_only=True)
class Gate:
    """What the checks say of a record, and which of them were asked before one forbade to go on."""

    findings: tuple[Finding, ...]
    """The worst first."""
    asked: frozenset[str]
    """Names of checks in `STAGES`."""


@one_thread()
def gate(evidence: Evidence) -> Gate:
    """Pass a record through the gate, and say how far it got."""
    asked: list[str] = []
    said: list[Finding] = []
    for stage in STAGES:
        for name, ask in stage.items():
            asked.append(name)
            said += ask(evidence)
        said = standing(said)
        if stops(said):
            break
    return Gate(findings=ranked(said), asked=frozenset(asked))


def _damage(evidence: Evidence) -> list[Finding]:
    return [found("damage", words=words) for words in evidence.record.warnings]


def _tail_as_read(evidence: Evidence) -> list[Finding]:
    tail = evidence.tail
    seen = [] if tail is None else check_clock(tail, drop=False) + check_channels(tail)
    return [replace(one, message=f"tail: {one.message}") for one in seen]


def _units(evidence: Evidence) -> list[Finding]:
    return check_units(evidence.falling, evidence.machine, lambda: _motion(evidence))


def _gaps(evidence: Evidence) -> list[Finding]:
    motion = _motion(evidence)
    return [] if motion is None else check_gaps(motion, evidence.falling, evidence.machine)


def _motion(evidence: Evidence) -> Motion | None:
    return None if isinstance(evidence.motion, Missing) else evidence.motion


def _speed(evidence: Evidence) -> list[Finding]:
    seen = check_speed(evidence.record)
    motion = evidence.motion if stops(seen) else None
    if isinstance(motion, Missing) and isinstance(motion.error, NothingFallsError):
        # a tail, say, needs no speed but a drop
        return [found("no-drop", seen=motion.error.seen, way_out=motion.error.remedy)]
    return seen


def _line(evidence: Evidence) -> list[Finding]:
    whole = evidence.record.whole
    assert whole.speed_readings is not None
    return check_rotation_line(whole, _before_motion(evidence.falling), float(whole.speed_readings[0]))


def _before_motion(fell: Record) -> float:
    return float(fell.time[first_motion(fell)[0]]) - _FALL_TIME


def _wiring(evidence: Evidence) -> list[Finding]:
    """Check the planes; none is refused for a lean that friction gave the rotor after a fall as described."""
    whole, floating = evidence.record.whole, _levitated(evidence)
    if floating is None:
        return []
    sunk = fall_of(whole, floating.mean, first_motion(evidence.falling)[0])
    held = held_planes(whole, evidence.machine)
    planes = tuple(plane for plane, stays in zip(whole.planes, held, strict=True) if not stays)
    seen = check_planes(planes, sunk, floating.amplitudes[0])
    fall = evidence.free_fall if stops(seen) else Missing(reason="not asked")
    if isinstance(fall, Missing):
        return seen
    straight = fell_as_described(whole, evidence.machine, fall)
    return check_planes(planes, sunk, floating.amplitudes[0], fell_straight=straight)


def _levitated(evidence: Evidence) -> LevitatedModel | None:
    """The levitated motion; where wiring hides the drop, what the sensors read before any of them moved."""
    if not isinstance(evidence.beginning, Missing):
        return evidence.floating
    whole = evidence.record.whole
    assert whole.speed_readings is not None
    speed = float(np.median(whole.speed_readings[:3]))
    try:
        return fit_levitated(whole, _before_motion(evidence.falling), speed=speed)
    except RecordError:
        return None


def _begins(evidence: Evidence) -> list[Finding]:
    begun = evidence.beginning
    if not isinstance(begun, Missing):
        return []
    if not isinstance(begun.error, NoDropError):
        raise begun.error or RecordError(begun.reason)
    kind = "missing pre-trigger" if begun.error.begins_late else None
    humming = hum_instead_of_a_drop(evidence.record.whole, float(np.min(evidence.gaps)))
    return humming or [found("no-drop", kind=kind, seen=begun.error.seen, way_out=begun.error.remedy)]


def _filters(evidence: Evidence) -> list[Finding]:
    record, start = evidence.falling, known(evidence.beginning)
    seen = check_coupling(record, nominal_gaps(evidence.machine, record), start.coarse.instant)
    if seen or evidence.held or evidence.machine.rotor.sought():  # a guessed rotor says nothing of a spectrum
        return seen
    turning = 2.0 * np.pi * start.levitated.frequency
    return check_low_pass(record, evidence.base, turning, start.coarse.instant)


def _zero(evidence: Evidence) -> list[Finding]:
    """Say what counts as zero where the rotor levitates too far from that of the readings."""
    if isinstance(evidence.beginning, Missing):
        return []
    mean, read = evidence.beginning.levitated.mean, evidence.record
    away, share = off_zero(read, evidence.machine, mean)
    if share >= OFF_ZERO:
        names = ", ".join(one.name for one in evidence.machine.sensors if one.offset.status == "default")
        return [found("zero-open" if names else "zero-given", away=away, ratio=share, names=names)]
    known = read.sensors[0].offset
    if known.source != LEVITATED:
        return []
    away, share = off_zero(read, evidence.machine, mean, offsets=0.0)
    return [found("zero", away=away, ratio=share, half=0.5 * (known.high - known.low))]


def _again(evidence: Evidence) -> list[Finding]:
    motion = _motion(evidence)
    return [] if motion is None else check_again(motion)


def _length(evidence: Evidence) -> list[Finding]:
    rests = evidence.tail is not None or not isinstance(evidence.still, Missing)
    return check_length(evidence.record.whole, known(evidence.beginning).coarse.instant, rests)


def _one_end(evidence: Evidence) -> list[Finding]:
    """Say which end stayed held by its magnets."""
    if not evidence.held:
        return []
    whole = evidence.record.whole
    ends, held = one_end(whole, evidence.gaps), ", ".join(evidence.held)
    return [
        found("one-end", words=f"{held} stayed held by its magnets" if ends is None else ends.words(whole))
    ]


def _fall(evidence: Evidence) -> list[Finding]:
    """What the fall says; flights weigh the sensors far sharper, and refute gains and angles it suspects."""
    coarse, flights = known(evidence.beginning).coarse, evidence.flights
    near = evidence.record.whole.window(-np.inf, coarse.instant + _NEAR)
    own = None if isinstance(evidence.free_fall, Missing) else evidence.free_fall
    machine, floating = evidence.machine, evidence.floating
    if evidence.held:
        return [
            found("undecided", why="only one of them fell"),
            *([] if own is None else read_otherwise(own)),
        ]
    seen = check_ends(near, machine, evidence.rotor, floating, coarse, own)
    if own is not None and not stops(seen):
        seen = check_exchanged(near, machine, floating, coarse, own) or seen
    refuted = ("wrong gain", "turned sensors") if flights is not None and gains_hold(flights) else ()
    seen = [one for one in seen if one.kind not in refuted]
    weighed = [] if flights is None else check_flights(flights, evidence.record.whole)
    return seen + [one for one in weighed if one.kind not in {other.kind for other in seen}]


def _tail_at_rest(evidence: Evidence) -> list[Finding]:
    still, record = evidence.still, evidence.record.whole
    if evidence.held or (isinstance(still, Missing) and evidence.tail is None):
        return []  # a tail with one end held shows no air gap, and is not looked at
    whole = still if isinstance(still, Missing) else still.whole
    seen = check_tail(whole, evidence.machine, evidence.floating, record)
    if evidence.tail is not None and not seen and not isinstance(whole, Missing):
        stiffness = sum(float(bearing.support.stiffness) for bearing in evidence.machine.touchdown_bearings)
        sag = GRAVITY * evidence.rotor.mass / stiffness  # of the rigid rotor
        drop = known(evidence.beginning).coarse.instant
        return check_rest_in_record(whole, record, evidence.machine, evidence.floating.mean, sag, drop)
    # a record that shows another gap than the file speaks for the tail that does so too
    if any(one.kind == "wrong unit factor" for one in seen) and _gaps(evidence):
        return [
            replace(one, kind="wrong air gap") if one.kind == "wrong unit factor" else one for one in seen
        ]
    return seen


STAGES: tuple[Mapping[str, Callable[[Evidence], list[Finding]]], ...] = (
    {
        "machine": lambda e: check_ends_named(e.machine),
        "damage": _damage,
        "clock": lambda e: check_clock(e.record),
        "channels": lambda e: check_channels(e.record),
        "tail as read": _tail_as_read,
    },
    {"blocks": lambda e: check_blocks(e.record), "units": _units, "speed": _speed},
    {"line": _line},
    {"wiring": _wiring},
    {"beginning": _begins, "zero": _zero},
    {"filters": _filters, "again": _again},
    {
        "levitated": lambda e: check_levitated(e.floating, e.record.whole),
        "length": _length,
        "one end": _one_end,
        "fall": _fall,
        "gaps": _gaps,
    },
    {"rest": _tail_at_rest},
)
"""The checks of the gate by name, stage by stage."""

NO_CHECK_SEES = "No check sees: "
UNSEEN_ANYWHERE = "exchanged blocks, jitter, limits with noise on them, up to 6 lost samples"
UNSEEN = (
    "gaps or gains off by 20 %, the rotor's mass, ends or axes exchanged in the tail, channels exchanged "
    "between ends that fall alike"
)
"""What passes these checks by the faults of the bench, in any record and in one of a machine."""

SEEN_BY: Mapping[str, str] = {
    "wiring": "axes exchanged or reversed",
    "fall": "ends exchanged, gains",
    "gaps": "air gaps",
}
"""What passes where these checks are not asked, because one before them forbids to go on."""


def not_seen(
    evidence: Evidence | None, *, fell: bool = True, passed: Gate | None = None, stated: bool = False
) -> str:
    """What no check can see of this record, in a sentence; without evidence no machine is known.

    Where the angles of the sensors are stated, the fall shows how they are wired, but not at which end.

    A gate that it did not pass whole says which checks were not asked.
    """
    said = f"{NO_CHECK_SEES}{UNSEEN_ANYWHERE}"
    if evidence is None or not fell:
        lacking = "a machine file" if evidence is None else "a fall"
        wiring = "exchanged ends" if stated and fell else "wiring, polarity, exchanged ends"
        return f"{said}; without {lacking} none looks at {wiring}, gains and gaps"
    if passed is not None and (unasked := SEEN_BY.keys() - passed.asked):
        passes = ", ".join(words for name, words in SEEN_BY.items() if name in unasked)
        ended = ", ".join(dict.fromkeys(one.kind for one in passed.findings if one.severity == "stop"))
        return f"{said}; nor, as the checks end with '{ended}', {passes}"
    return f"{said}, {UNSEEN}"


__all__ = [
    "NO_CHECK_SEES",
    "Finding",
    "Gate",
    "Severity",
    "check_record",
    "found",
    "gate",
    "not_seen",
    "ranked",
    "refuse_unusable",
    "sentences",
    "standing",
    "stops",
]
