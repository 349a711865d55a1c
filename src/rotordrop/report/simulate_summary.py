"""The verdict and the headline numbers of a simulated drop, which a terminal shows without any figure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop._version import __version__
from rotordrop.elements.face import UNPRESSED
from rotordrop.elements.race_bearing import THROWN, numbers_of
from rotordrop.estimate.bearing_drop import BearingDrop, simulated_bearings
from rotordrop.machine.plausibility import doubts_of_speed
from rotordrop.record.impacts import after_flights
from rotordrop.report.content import SIMULATED_MACHINE, Card, Level, ReportContent, Statement, fact
from rotordrop.report.estimate_numbers import headline_card, static_limit_statement
from rotordrop.report.quantity import shown
from rotordrop.simulate.clearances import ClearanceUse, clearance_uses
from rotordrop.simulate.landing import Landing, landings
from rotordrop.simulate.result import DropResult, stop_of
from rotordrop.simulate.ribbons import RibbonUse, ribbon_uses

if TYPE_CHECKING:
    from rotordrop.machine import Machine

TRUSTED_CHANGE = 5e-3
"""Change of a peak at a tighter tolerance beyond which it is a warning [1]; chosen, not measured."""
NO_INTERVAL = (
    "The numbers have no interval: one simulation with given parameters cannot state one. After about 50 ms "
    "a drop is chaotic, and only its statistics can be compared with another one."
)
BACKWARDS = "The speed is negative: the shaft turns from y towards x, clockwise seen from the DE."


def simulate_summary(result: DropResult, machine: Machine | None = None) -> ReportContent:
    """Give what is said of one simulated drop before any figure; the machine gives the defaults in use."""
    bearings = simulated_bearings(result)
    speed, duration = shown(result.initial_speed, "speed"), shown(result.time[-1], "time")
    path = getattr(machine, "source_path", None)
    uses = () if machine is None else clearance_uses(machine, result)
    return ReportContent(
        title=f"Simulated drop of {result.machine_name}",
        subtitle=f"from {speed}, {duration} after power-off",
        simulated=SIMULATED_MACHINE,
        verdict=_verdict(result, bearings, machine, uses),
        cards=tuple(_card(result, b, bearing) for b, bearing in enumerate(bearings)),
        facts=(
            ("machine", result.machine_name if path is None else f"{result.machine_name} ({path.name})"),
            ("rotor basis", result.reduction),
            ("tolerance", f"{result.tolerance:g}"),
            ("steps", f"{result.steps} taken, {result.rejected_steps} rejected"),
            ("rotordrop", __version__),
        ),
    )


def _card(result: DropResult, index: int, bearing: BearingDrop) -> Card:
    card = headline_card(bearing)
    pressure, half_width, pressed_at = result.peak_contact_pressure(index)
    note = f"at {shown(pressed_at, 'time', 3)}, {shown(2.0 * half_width, 'length', 3)} wide"
    figures = list(card.figures)
    figures.insert(2, fact("Peak pressure, rotor on race", pressure, "pressure", note=note))
    if bearing.first_contact is not None and bearing.air_gap is not None:
        deepest = float(bearing.motions[0].radial.values.max()) - bearing.air_gap.upper
        figures.append(fact("Furthest beyond the air gap", deepest, "length", 3))
    places = ((f"{bearing.name}.face", "Peak axial force"), (stop_of(bearing.name), "Peak force on the stop"))
    for place, label in places:
        there = result.contacts_at(place)
        if there is not None and len(there):
            force, moment = there.peak
            figures.append(fact(label, force, "force", note=f"at {shown(moment, 'time', 3)}"))
    lost = sum(impact.dissipated_energy.value for impact in bearing.impacts)
    figures.append(
        fact("Contacts", len(bearing.impacts), "count", note=f"{len(bearing.touched)} of them impacts")
    )
    figures.append(fact("Energy lost in contact", lost, "energy", 3))
    return Card(card.title, tuple(figures))


def _verdict(
    result: DropResult,
    bearings: tuple[BearingDrop, ...],
    machine: Machine | None,
    uses: tuple[ClearanceUse, ...],
) -> tuple[Statement, ...]:
    said = [Statement(result.outcome, "good" if result.finished else "bad")]
    if machine is not None:
        said += [*map(_used, uses), *map(_ribbon, ribbon_uses(machine, result))]
    if result.initial_speed < 0.0:
        said.append(Statement(BACKWARDS))
    if machine is not None:
        doubts = doubts_of_speed(machine, result.initial_speed)
        said += [Statement(f"{doubt.message}.", "warning") for doubt in doubts]
        said += [*_springs(result, machine), *_thrown(result, machine), *_landed(result, machine)]
    if (lift := result.lift) is not None:
        said.append(Statement(f"{lift.sentence()}.", "good" if lift.succeeded else "bad"))
    if result.heat is not None:
        said += [Statement(*one) for one in result.heat.sentences(result.bearing_names)]
    said += [_certificate(result), Statement(NO_INTERVAL)]
    known = () if machine is None else machine.touchdown_bearings
    unrated = [one.name for one in known if numbers_of(one).rolling_elements() is None]
    said += [static_limit_statement(bearing) for bearing in bearings if bearing.name not in unrated]
    if machine is not None and machine.defaults_in_use:
        count = len(machine.defaults_in_use)
        text = (
            f"{count} values of the machine are defaults; the report and 'rotordrop check --all' list them."
        )
        said.append(Statement(text))
    # of a drop that broke off nothing is good
    good: Level = "good" if result.finished else "notice"
    return tuple(replace(one, level=good) if one.level == "good" else one for one in said)


def _used(use: ClearanceUse) -> Statement:
    """What a drop used of a clearance or of the way up to a stop, and the force there."""
    gap, touches = shown(use.gap, "length", 3), use.share >= 1.0 if use.contacts is None else bool(use.count)
    share = f"{shown(use.travel, 'length', 3)} of {gap} ({100.0 * use.share:.3g} %)"
    if not touches:
        if use.contacts is None:
            return Statement(f"{use.name}: the rotor travels {share}.", "good")
        never = "never reaches its stop" if use.stop else "never touches the housing"
        moves = "the mount moves" if use.stop else "the rotor travels"
        return Statement(f"{use.name}: {moves} {share} and {never}.", "good")
    if use.contacts is None:
        text = "so it touches there; no force acts in a clearance without stiffness."
        return Statement(f"{use.name}: the rotor travels {share}, {text}", "bad")
    times = "once" if use.count == 1 else f"{use.count} times"
    first, force = shown(use.contacts.start[0], "time", 3), shown(use.peak_force, "force", 4)
    hit = f"{times}, first at {first}, with {force} at most"
    if not use.stop:
        return Statement(f"{use.name}: the rotor travels {share} and touches the housing {hit}.", "bad")
    pressed = shown(max(use.travel - use.gap, 0.0), "length", 3)
    text = f"{use.name}: the mount reached its stop at {gap} {hit}; it pressed it by {pressed}."
    return Statement(text, "warning")


def _ribbon(use: RibbonUse) -> Statement:
    """What a ribbon bore, whether it slipped and what that took."""
    most, limit = shown(use.peak_force, "force", 3), shown(use.slip_force, "force", 3)
    text = f"{use.name}: the ribbon of the mount bore at most {most} of its slip force of {limit}"
    if use.slipped == 0.0:
        return Statement(f"{text} ({100.0 * use.share:.3g} %) and never slipped.")
    slipped, first = shown(use.slipped, "time", 3), shown(use.first_slip, "time", 3)
    taken = shown(use.dissipated, "energy", 3)
    return Statement(f"{text} and slipped for {slipped} in all, first at {first}, which took {taken}.")


def _springs(result: DropResult, machine: Machine) -> Iterator[Statement]:
    """How far rings that springs press on gave way."""
    for bearing in machine.touchdown_bearings:
        if bearing.bearing.ring_travel is None:
            continue
        most, room = float(np.max(result.ring_travel(bearing.name))), float(bearing.bearing.ring_travel)
        moved, free = shown(most, "length"), shown(room, "length")
        text = f"{bearing.name}: the outer rings gave way on their springs by {moved} of {free}"
        yield Statement(f"{text}, up to their stop." if most > room else f"{text}.")


def _thrown(result: DropResult, machine: Machine) -> Iterator[Statement]:
    """What the inertia of balls made of the races, or would make of them at the speeds that they reached."""
    if result.race_stress is not None:
        highest = np.max(result.race_stress, axis=0)
        for name, (inner, outer) in zip(result.bearing_names, highest, strict=True):
            if outer > 0.0:
                one, other = shown(inner, "pressure"), shown(outer, "pressure")
                text = f"{name}: the largest stress is {one} on the inner and {other} on the outer race."
                yield Statement(text)
    share = machine.rotor.mass * float(machine.gravity) / len(machine.touchdown_bearings)
    for b, bearing in enumerate(machine.touchdown_bearings):
        fastest = float(np.max(np.abs(result.race_speed[:, b])))
        for excess in numbers_of(bearing).excesses(fastest, share):
            if excess.kind == THROWN:
                yield Statement(f"{bearing.name}: {excess.text}.", "warning")


def landing_count(one: Landing) -> int:
    """Number of landings on a face: contacts that no flight parts are one, by the rule of radial impacts."""
    return int(np.sum(after_flights(one.contacts.start, one.contacts.end, one.gap, one.acceleration[1:])))


def _landed(result: DropResult, machine: Machine) -> Iterator[Statement]:
    """How far the rotor moved along its axis, with what force it landed, whether balls climbed too far."""
    for one in landings(machine, result):
        travel, gap = shown(one.travel, "length", 3), shown(one.gap, "length", 3)
        force, moment = one.contacts.peak
        if not any(load.along for load in machine.loads):
            yield Statement(f"{one.name}: the rotor never lands on the face: {UNPRESSED}.")
            continue
        if not len(one.contacts):
            text = f"{one.name}: the rotor travels {travel} of {gap} along its axis"
            yield Statement(f"{text} and never lands on the face.", "good")
            continue
        count, moved = landing_count(one), shown(one.rotor_travel, "length", 3)
        times = "once" if count == 1 else f"{count} times"
        first = shown(one.contacts.start[0], "time", 3)
        yield Statement(
            f"{one.name}: the rotor moves {moved} along its axis (gap {gap}) and lands on the face of the "
            f"race {times}, first at {first}, "
            f"with {shown(force, 'force', 4)} along its axis at most, at {shown(moment, 'time', 3)}; contact "
            f"angle up to {shown(one.contact_angle, 'angle', 3)}."
        )
        if one.climb.excess is not None:
            yield Statement(f"{one.name}: {one.climb.excess.text}.", "bad")


def _certificate(result: DropResult) -> Statement:
    certificate = result.certificate
    changes = [certificate.peak_change_tolerance, certificate.peak_change_truncation]
    worst = max((float(np.max(change)) for change in changes if change is not None), default=0.0)
    text = f"Numerical error: {certificate.sentence()}"
    if certificate.peak_change_tolerance is None:
        return Statement(f"{text}; tolerance and truncation were not checked in this run.")
    return Statement(f"{text}.", "warning" if worst > TRUSTED_CHANGE else "good")
