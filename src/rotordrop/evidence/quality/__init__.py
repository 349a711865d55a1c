"""The gate every record passes before anything is computed from it.

It looks at the clock, at every channel, and at what a drop must show. What it cannot decide it says (severity
"note"). The checks stand in a table of stages that ask the evidence: a later stage runs only when the earlier
ones found nothing that forbids it. One place says which finding overrules which.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import NoDropError, NothingFallsError, RecordError
from rotordrop.evidence.ends import held_planes
from rotordrop.evidence.evidence import Evidence, Missing, known
from rotordrop.evidence.levitated import LevitatedModel, fit_levitated
from rotordrop.evidence.one_end import as_dropped, one_end
from rotordrop.evidence.quality.arrangement import check_ends_named, check_planes, fall_of
from rotordrop.evidence.quality.channels import check_channels, check_rail
from rotordrop.evidence.quality.continuity import check_orbit
from rotordrop.evidence.quality.fall import (
    check_ends,
    check_exchanged,
    fell_as_described,
    read_otherwise,
    undecided,
)
from rotordrop.evidence.quality.finding import (
    Finding,
    Kind,
    Severity,
    ranked,
    refuse_unusable,
    stops,
)
from rotordrop.evidence.quality.flight import check_flights, gains_hold
from rotordrop.evidence.quality.motion import (
    check_gaps,
    check_length,
    check_levitated,
    check_rotation_line,
    check_speed,
    check_units,
    first_motion,
    hum_instead_of_a_drop,
    no_drop,
    nothing_falls,
)
from rotordrop.evidence.quality.recorder import (
    check_again,
    check_blocks,
    check_clock,
    check_filters,
    check_speed_signal,
)
from rotordrop.evidence.quality.tail import check_rest_in_record, check_tail
from rotordrop.units import GRAVITY

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

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
    dropped = as_dropped(record, machine)
    return checked(Evidence(record=record, machine=dropped, tail=tail, name=record.name))


@dataclass(frozen=True, kw_only=True)
class Gate:
    """What the checks say of a record, and which of them were asked before one forbade to go on."""

    findings: tuple[Finding, ...]
    """The worst first."""
    asked: frozenset[str]
    """Names of checks in `STAGES`."""


def checked(evidence: Evidence) -> tuple[Finding, ...]:
    """Pass a record through the gate; the facts it asks for are there for an estimate afterwards."""
    return gate(evidence).findings


def gate(evidence: Evidence) -> Gate:
    """Pass a record through the gate, and say how far it got."""
    said: dict[str, list[Finding]] = {}
    stand: list[Finding] = []
    for stage in STAGES:
        for name, ask in stage.items():
            said[name] = ask(evidence)
        flown = evidence.flights if "fall" in said else None
        stand = standing(said, gains_right=flown is not None and gains_hold(flown))
        if stops(stand):
            break
    return Gate(findings=ranked(stand), asked=frozenset(said))


def _damage(evidence: Evidence) -> list[Finding]:
    return [
        Finding(
            kind=Kind.DAMAGE,
            message=words,
            remedy="copy or export the file again to be sure",
            severity="warning",
        )
        for words in evidence.record.warnings
    ]


def _tail_as_read(evidence: Evidence) -> list[Finding]:
    tail = evidence.tail
    found = [] if tail is None else check_clock(tail, drop=False) + check_channels(tail)
    return [replace(one, message=f"tail: {one.message}") for one in found]


def _units(evidence: Evidence) -> list[Finding]:
    return check_units(evidence.falling, evidence.machine, _gaps(evidence))


def _gaps(evidence: Evidence) -> list[Finding]:
    motion = evidence.motion
    return [] if isinstance(motion, Missing) else check_gaps(motion, evidence.falling, evidence.machine)


def _speed(evidence: Evidence) -> list[Finding]:
    found = check_speed_signal(evidence.record) or check_speed(evidence.record, evidence.machine)
    motion = evidence.motion if evidence.record.speed_readings is None else None
    if isinstance(motion, Missing) and isinstance(motion.error, NothingFallsError):
        return [nothing_falls(motion.error)]  # a tail, say, needs no speed but a drop
    return found


def _line(evidence: Evidence) -> list[Finding]:
    whole = evidence.record.whole
    assert whole.speed_readings is not None
    before = _before_motion(evidence.falling)
    return check_rotation_line(whole, before, float(whole.speed_readings[0]))


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
    found = check_planes(planes, sunk, floating.amplitudes[0])
    fall = evidence.free_fall if stops(found) else Missing(reason="not asked")
    if isinstance(fall, Missing):
        return found
    straight = fell_as_described(whole, evidence.machine, fall)
    return check_planes(planes, sunk, floating.amplitudes[0], fell_straight=straight)


def _levitated(evidence: Evidence) -> LevitatedModel | None:
    """The levitated motion; where wiring hides the drop, what the sensors read before any of them moved."""
    if not isinstance(evidence.beginning, Missing):
        return evidence.floating
    whole = evidence.record.whole
    assert whole.speed_readings is not None
    try:
        return fit_levitated(
            whole, _before_motion(evidence.falling), speed=float(np.median(whole.speed_readings[:3]))
        )
    except RecordError:
        return None


def _begins(evidence: Evidence) -> list[Finding]:
    begun = evidence.beginning
    if not isinstance(begun, Missing):
        return []
    if isinstance(begun.error, NoDropError):
        whole = evidence.record.whole
        return hum_instead_of_a_drop(whole, float(np.min(evidence.gaps))) or [no_drop(begun.error)]
    raise begun.error or RecordError(begun.reason)


def _recorder(evidence: Evidence) -> list[Finding]:
    # a high-pass bends a rest into what looks like a rail; what a filter explains is none
    fell = evidence.falling
    instant = known(evidence.beginning).coarse.instant
    bounces = _bounces(evidence) / (2.0 * np.pi)
    found = check_filters(fell, evidence.falling_floats, instant, bounces)
    if not isinstance(evidence.motion, Missing):
        found += check_again(evidence.motion)
    return found or check_rail(fell, first_motion(fell)[0])


def _bounces(evidence: Evidence) -> float:
    """Angular frequency at which the rigid rotor bounces on the supports of the machine file [rad/s]."""
    stiffness = sum(float(bearing.support.stiffness) for bearing in evidence.machine.touchdown_bearings)
    return float(np.sqrt(stiffness / evidence.rotor.mass))


def _length(evidence: Evidence) -> list[Finding]:
    rests = evidence.tail is not None or not isinstance(evidence.still, Missing)
    return check_length(evidence.record.whole, known(evidence.beginning).coarse.instant, rests)


def _one_end(evidence: Evidence) -> list[Finding]:
    """Say which end stayed held by its magnets."""
    if not evidence.held:
        return []
    whole = evidence.record.whole
    found = one_end(whole, evidence.gaps)
    words = f"{', '.join(evidence.held)} stayed held by its magnets" if found is None else found.words(whole)
    return [
        Finding(
            kind=Kind.ONE_END,
            message=f"a drop of one end: {words}",
            remedy="if both ends fell, check the channels of that end; a machine file can say it with "
            "stays_on = true of the magnet",
            severity="warning",
        )
    ]


def _fall(evidence: Evidence) -> list[Finding]:
    coarse = known(evidence.beginning).coarse
    near = evidence.record.whole.window(-np.inf, coarse.instant + _NEAR)
    fall = evidence.free_fall
    own = None if isinstance(fall, Missing) else fall
    machine, floating = evidence.machine, evidence.floating
    if evidence.held:
        return [undecided("only one of them fell"), *([] if own is None else read_otherwise(own))]
    found = check_ends(near, machine, evidence.rotor, floating, coarse, own)
    if own is None or stops(found):
        return found
    return check_exchanged(near, machine, floating, coarse, own) or found


def _flights(evidence: Evidence) -> list[Finding]:
    seen = evidence.flights
    return [] if seen is None else check_flights(seen, evidence.record.whole)


def _tail_at_rest(evidence: Evidence) -> list[Finding]:
    still, record, floating = evidence.still, evidence.record.whole, evidence.floating
    if evidence.held:
        return []  # a tail with one end held shows no air gap, and is not looked at
    if isinstance(still, Missing):
        return [] if evidence.tail is None else check_tail(still, evidence.machine, floating, record)
    found = check_tail(still.whole, evidence.machine, floating, record)
    if found or evidence.tail is None:
        return found
    sag = GRAVITY / _bounces(evidence) ** 2
    return check_rest_in_record(still.whole, record, evidence.machine, floating.mean, sag)


STAGES: tuple[Mapping[str, Callable[[Evidence], list[Finding]]], ...] = (
    {
        "machine": lambda e: check_ends_named(e.machine),
        "damage": _damage,
        "clock": lambda e: check_clock(e.record),
        "channels": lambda e: check_channels(e.record),
        "tail as read": _tail_as_read,
    },
    {
        "blocks": lambda e: check_blocks(e.record),
        "units": _units,
        "speed": _speed,
    },
    {"line": _line},
    {"wiring": _wiring},
    {"beginning": _begins},
    {"recorder": _recorder},
    {
        "orbit": lambda e: check_orbit(e.floating, e.record.whole),
        "levitated": lambda e: check_levitated(e.floating, e.record.whole),
        "length": _length,
        "one end": _one_end,
        "fall": _fall,
        "flights": _flights,
        "gaps": _gaps,
    },
    {"rest": _tail_at_rest},
)
"""The checks of the gate by name, stage by stage."""


def _passes(evidence: Evidence, change: Callable[[Array, Record], Array]) -> bool:
    """Whether readings at rest that are changed so would pass too; false where there is no tail to judge."""
    still = evidence.still
    if evidence.tail is None or isinstance(still, Missing) or isinstance(evidence.beginning, Missing):
        return False
    if len(still.whole.sensors) < len(still.sensors):
        return True  # a plane of one sensor: what its readings could be exchanged with is not asked
    other = replace(still, signals=change(still.signals, still))
    return not _tail_at_rest(evidence.with_facts(still=other))


def _exchanged(signals: Array, order: list[tuple[int, ...]]) -> Array:
    """Readings of the columns listed one list after the other in place of those in rising order."""
    return signals[:, [column for columns in order for column in columns]]


def _ends(signals: Array, still: Record) -> Array:
    first, *middle, last = (plane.columns for plane in still.planes)
    return _exchanged(signals, [last, *middle, first])


def _axes(signals: Array, still: Record) -> Array:
    return _exchanged(signals, [plane.columns[::-1] for plane in still.planes])


def _zeros(evidence: Evidence) -> bool:
    """Whether a zero that moved by 40 µm between record and tail would pass in some channel."""
    still = evidence.still
    moved: list[Array] = [] if isinstance(still, Missing) else [*(4e-5 * np.eye(still.signals.shape[1]))]
    return any(
        _passes(evidence, lambda signals, _, off=off: signals + off)  # type: ignore[misc]
        for off in [*moved, *(-one for one in moved)]
    )


UNSEEN_ANYWHERE = ("blocks exchanged within 20 µm", "up to 6 lost samples")
UNSEEN: Mapping[str, Callable[[Evidence], bool]] = {
    "gaps or all gains off by 20 %": lambda e: True,
    "the rotor's mass": lambda e: True,
    "ends exchanged": lambda e: len(e.record.whole.planes) > 2,
}
UNSEEN_IN_TAIL: Mapping[str, Callable[[Evidence], bool]] = {
    "ends exchanged": lambda e: _passes(e, _ends),
    "axes exchanged": lambda e: _passes(e, _axes),
    "zeros off by 40 µm": _zeros,
}
"""What passes these checks in `studies/gate`, and in which records it does; of the tail they are asked."""

SEEN_BY: Mapping[str, str] = {
    "wiring": "axes exchanged or reversed",
    "fall": "ends exchanged",
    "flights": "gains",
    "gaps": "air gaps",
}
"""What passes where these checks are not asked, because one before them forbids to go on."""

NO_CHECK_SEES = "No check sees: "


def not_seen(
    evidence: Evidence | None, *, fell: bool = True, passed: Gate | None = None, stated: bool = False
) -> str:
    """What no check can see of this record, in a sentence; without evidence no machine is known.

    Where the angles of the sensors are stated, the fall shows how they are wired, but not at which end.

    A gate that it did not pass whole says which checks were not asked.
    """
    said = f"{NO_CHECK_SEES}{', '.join(UNSEEN_ANYWHERE)}"
    if evidence is None or not fell:
        lacking = "a machine file" if evidence is None else "a fall"
        wiring = "exchanged ends" if stated and fell else "wiring, polarity, exchanged ends"
        return f"{said}; without {lacking} none looks at {wiring}, gains and gaps"
    if passed is not None and (unasked := SEEN_BY.keys() - passed.asked):
        passes = ", ".join(words for name, words in SEEN_BY.items() if name in unasked)
        ended = ", ".join(dict.fromkeys(one.kind for one in passed.findings if one.severity == "stop"))
        return f"{said}; nor, as the checks end with '{ended}', {passes}"
    record, tail = (
        ", ".join(words for words, passes in table.items() if passes(evidence))
        for table in (UNSEEN, UNSEEN_IN_TAIL)
    )
    return f"{said}, {record}" + (f"; in the tail {tail}" if tail else "")


def standing(said: Mapping[str, list[Finding]], *, gains_right: bool) -> list[Finding]:
    """The findings that stand: the one place that says which of them overrules which.

    They come by the name of their check; `gains_right` says whether flights exclude a gain that is off.
    """
    every = {name: list(found) for name, found in said.items()}
    # A unit that is wrong makes the steps of a converter look coarse.
    if any(one.kind in (Kind.WRONG_UNIT, Kind.WRONG_AIR_GAP) for one in every.get("units", ())):
        for name in ("channels", "tail as read"):
            every[name] = [one for one in every[name] if one.kind != Kind.COARSE]
    if "fall" in every:
        fall, flights = every["fall"], every["flights"]
        # Flights weigh the sensors far sharper than the first fall: they refute gains and angles it suspects,
        # and a delay or a bend of the channels that they find to have a gain.
        if gains_right:
            fall = [one for one in fall if one.kind not in (Kind.WRONG_GAIN, Kind.TURNED)]
        named = {one.channel for one in flights if one.severity == "warning"}
        lagging = (Kind.LATE_CHANNEL, Kind.SATURATION)
        fall = [one for one in fall if one.kind not in lagging or one.channel not in named]
        flights = [one for one in flights if one.kind not in {other.kind for other in fall}]
        # A gain that is off moves the gap that is seen with it.
        off = any(one.kind == Kind.WRONG_GAIN and one.severity != "note" for one in fall + flights)
        every |= {"fall": fall, "flights": flights, "gaps": [] if off else every.get("gaps", [])}
        # Readings of the drop that are doubted themselves say nothing against the tail.
        if any(one.severity != "note" for one in (*every.get("levitated", ()), *fall, *flights)):
            every["rest"] = [one for one in every.get("rest", ()) if one.kind != Kind.TAIL_OFFSET]
        # A record that shows another gap than the file speaks for the tail that does so too.
        if every["gaps"]:
            every["rest"] = [
                replace(one, kind=Kind.WRONG_AIR_GAP) if one.kind == Kind.WRONG_UNIT else one
                for one in every.get("rest", ())
            ]
        # A fall that leans stops only when the sensors look in other directions before the first contact too.
        # That it deviates there from a free rotor is not enough: two of eight drops of small rotors at 500 Hz
        # did, and leant because of friction. Where the fall before the first contact is that of the rotor as
        # described, gravity has shown which way every sensor looks, and what leans later is the rotor.
        turned = any(one.kind == Kind.TURNED for one in fall + flights)
        severity: Severity | None = "stop" if turned else None if fall + flights else "note"
        if severity is not None:
            every["wiring"] = [
                replace(one, severity=severity) if one.kind == Kind.LEANING else one
                for one in every["wiring"]
            ]
    return [one for found in every.values() for one in found]


__all__ = [
    "NO_CHECK_SEES",
    "Finding",
    "Gate",
    "Kind",
    "Severity",
    "check_record",
    "checked",
    "gate",
    "not_seen",
    "ranked",
    "refuse_unusable",
    "standing",
    "stops",
]
