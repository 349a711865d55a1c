"""The gate every record passes before anything is computed from it.

It looks at the clock, at every channel, and at what a drop must show. What it cannot decide it says (severity
"note"). Stages build on one another: a later one runs only when the earlier ones found nothing that
forbids it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import NoDropError, RecordError
from rotordrop.evidence.events import drop_and_levitated, with_whole_planes
from rotordrop.evidence.levitated import LevitatedModel, fit_levitated
from rotordrop.evidence.quality.arrangement import LEANING, check_planes, fall_of
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.clock import check_blocks, check_clock
from rotordrop.evidence.quality.ends import check_ends, fell_as_described
from rotordrop.evidence.quality.finding import Finding, Severity, ranked, refuse_unusable, stops
from rotordrop.evidence.quality.flight import weighed, with_flights
from rotordrop.evidence.quality.motion import (
    check_length,
    check_levitated,
    check_rotation_line,
    check_speed,
    check_units,
    first_motion,
    no_drop,
)
from rotordrop.evidence.quality.rail import check_rail
from rotordrop.evidence.quality.recorder import check_again, check_filters, check_speed_signal
from rotordrop.evidence.quality.sensing import TURNED
from rotordrop.evidence.quality.tail import check_tail
from rotordrop.record.axes import sensor_planes
from rotordrop.record.recording import Array

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
    findings = [_damage(words) for words in record.warnings]
    findings += check_clock(record) + check_channels(record)
    if tail is not None:
        findings += [_of_tail(found) for found in check_clock(tail, drop=False) + check_channels(tail)]
    if stops(findings):
        return ranked(findings)
    whole, planes = with_whole_planes(record)
    findings += check_blocks(record) + check_units(whole, machine, planes)
    findings += check_speed_signal(record) or check_speed(record, machine)
    if stops(findings):
        misread = any(found.kind in ("wrong unit factor", "wrong air gap") for found in findings)
        return ranked(found for found in findings if not (misread and found.kind == "coarse quantisation"))
    still = None if tail is None else with_whole_planes(tail)[0]
    return ranked(findings + _check_motion(whole, machine, still))


def _damage(words: str) -> Finding:
    return Finding(
        kind="damage on reading",
        message=words,
        remedy="copy or export the file again to be sure",
        severity="warning",
    )


def _of_tail(finding: Finding) -> Finding:
    return replace(finding, message=f"tail: {finding.message}")


def _check_motion(record: Record, machine: Machine, tail: Record | None) -> list[Finding]:
    """Stages that need the fall: speed line, arrangement of the sensors, drop, length, tail."""
    planes = sensor_planes(record.sensors)
    sunk_at, level = first_motion(record)
    before = float(record.time[sunk_at]) - _FALL_TIME
    levitated = _levitated(record, before)
    findings: list[Finding] = []
    assert record.speed_readings is not None
    findings += check_rotation_line(record, before, float(record.speed_readings[0]))
    if levitated is not None:
        level = levitated.mean
    if levitated is not None and not stops(findings):
        findings += _arrangement(record, machine, fall_of(record, level, sunk_at), levitated)
    if stops(findings):
        return findings
    try:
        coarse, levitated = drop_and_levitated(record, machine, record, planes)
    except NoDropError as error:
        return [no_drop(error)]
    # a high-pass bends a rest into what looks like a rail; what a filter explains is none
    findings += [*check_filters(record, coarse.instant), *check_again(record)] or check_rail(record, sunk_at)
    if stops(findings):
        return findings
    findings += check_levitated(levitated, record)
    findings += check_length(record, coarse.instant, tail is not None)
    near = record.window(-np.inf, coarse.instant + _NEAR)
    of_fall = check_ends(near, machine, planes, levitated, coarse)
    of_fall = with_flights(
        of_fall, weighed(record, machine, planes, levitated, coarse.instant), record, planes
    )
    findings = _not_both(findings, of_fall)
    if tail is not None and not stops(findings):
        findings += check_tail(tail, machine, planes, levitated)
    return findings


def _arrangement(record: Record, machine: Machine, sunk: Array, levitated: LevitatedModel) -> list[Finding]:
    """Check the planes; none is refused for a lean that friction gave the rotor after a fall as described."""
    planes = sensor_planes(record.sensors)
    found = check_planes(planes, sunk, levitated.amplitudes[0])
    if not stops(found):
        return found
    try:
        coarse, levitated = drop_and_levitated(record, machine, record, planes)
    except RecordError:
        return found
    near = record.window(-np.inf, coarse.instant + _NEAR)
    straight = fell_as_described(near, machine, planes, levitated, coarse)
    return check_planes(planes, sunk, levitated.amplitudes[0], fell_straight=straight)


def _not_both(findings: list[Finding], of_ends: list[Finding]) -> list[Finding]:
    """A fall that leans stops only when the sensors look in other directions before the first contact too.

    That it deviates there from a free rotor is not enough: two of eight drops of small rotors at 500 Hz did,
    and leant because of friction. Where the fall before the first contact is that of the rotor as described,
    gravity has shown which way every sensor looks, and what leans later is the rotor: that is worth a note.
    """
    turned = any(found.kind == TURNED for found in of_ends)
    severity: Severity | None = "stop" if turned else None if of_ends else "note"
    if severity is not None:
        findings = [replace(f, severity=severity) if f.kind == LEANING else f for f in findings]
    return findings + of_ends


def _levitated(record: Record, end: float) -> LevitatedModel | None:
    assert record.speed_readings is not None
    before = record.speed_readings[:3]
    try:
        return fit_levitated(record, end, speed=float(np.median(before)))
    except RecordError:
        return None


__all__ = ["Finding", "Severity", "check_record", "ranked", "refuse_unusable", "stops"]
