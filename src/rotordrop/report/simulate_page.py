"""The reports on one simulated drop or coast-down: summary, page, numbers for JSON."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from rotordrop.elements.bearing_numbers import THROWN, numbers_of
from rotordrop.elements.face import UNPRESSED
from rotordrop.estimate.bearing_drop import BearingDrop, simulated_bearings
from rotordrop.estimate.simulated_drop import landing_count
from rotordrop.evidence.impacts import HOP
from rotordrop.machine.plausibility import doubts_of_speed
from rotordrop.report.content import (
    SIMULATED_MACHINE,
    Card,
    Figure,
    Level,
    ReportContent,
    Section,
    Statement,
    appendix,
    fact,
)
from rotordrop.report.drop_sections import (
    drop_sections,
    headline_card,
    static_limit_statement,
    turning_section,
)
from rotordrop.report.machine_content import machine_sections, weight_shares
from rotordrop.report.origin import machine_facts
from rotordrop.report.quantity import BEYOND_GAP, shown, written
from rotordrop.report.style import (
    BAND_FILL,
    COLOURS,
    FROM_POWER_OFF,
    LOG_LABELS,
    MICRO,
    SERIES,
    axis_title,
    curve,
    drawn_together,
    finished,
    panels,
    plain,
)
from rotordrop.report.waterfall_page import frequency_sections
from rotordrop.simulate.coast_down_result import (
    QUANTILES,
    QUANTITIES,
    CoastDownResult,
    first_window_sentence,
)
from rotordrop.simulate.heat import NODES, Heat
from rotordrop.simulate.magnets import MagnetHistory
from rotordrop.simulate.result import DropResult, stop_of
from rotordrop.simulate.used import ClearanceUse, Landing, RibbonUse, clearance_uses, landings, ribbon_uses
from rotordrop.units import percent

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.simulate.coast_down_certificate import CoastDownCertificate
    from rotordrop.spectrum.coast_down import CoastDownAnalysis


def simulate_page(result: DropResult, machine: Machine | None = None) -> ReportContent:
    """Build the report on one simulated drop.

    The machine gives weight shares, the friction law and the defaults in use.
    """
    bearings = simulated_bearings(result, machine)
    landed = () if machine is None else landings(machine, result)
    races = dict(zip(result.bearing_names, result.race_speed.T, strict=True))
    force, orbit, *rest = drop_sections(bearings, "simulated", weight_shares(machine))
    return replace(
        simulate_summary(result, machine),
        sections=(
            force,
            orbit,
            *appendix(rest),
            *((_landing(result, landed),) if landed else ()),
            *((_magnets(result, result.magnets),) if result.magnets is not None else ()),
            *heat_sections(result.heat, result.bearing_names),
            turning_section(result.time, result.speed, races),
            *(() if machine is None else machine_sections(machine)),
        ),
        lead=2,
        ends=(bearings[0].name, bearings[-1].name),
    )


def _magnets(result: DropResult, magnets: MagnetHistory) -> Section:
    """Force of every magnet and the currents of its coils against time, and what happened when."""
    names, coils = magnets.names, [f"{axis}{sign}" for axis in "xy" for sign in "+−"]
    force, current = np.moveaxis(magnets.force, 0, -1), np.moveaxis(magnets.current, 0, -1)
    forces = {name: dict(zip("xy", of, strict=True)) for name, of in zip(names, force, strict=True)}
    currents = {
        name: dict(zip(coils, of.reshape(len(coils), -1), strict=True))
        for name, of in zip(names, current, strict=True)
    }
    pulled = "Currents of the coils that pull towards + and − of each axis."
    figures = (
        Figure(
            drawn_together(result.time, forces, "magnet force", "N"), "Force of the magnets on the rotor."
        ),
        Figure(drawn_together(result.time, currents, "current", "A"), pulled),
    )
    happened = zip(magnets.events, magnets.event_time, strict=True)
    told = "; ".join(f"{what} at {shown(time, 'time', 3)}" for what, time in happened if np.isfinite(time))
    return Section("Magnets", (f"{told}.",) if told else (), figures=figures)


def _landing(result: DropResult, landed: tuple[Landing, ...]) -> Section:
    """Force on the faces against time."""
    assert result.face_force is not None
    forces = {one.name: {"simulated": result.face_force[:, result.index_of(one.name)]} for one in landed}
    caption = (
        "Axial force of the rotor on the face of the race, positive towards higher nodes. Contacts without a "
        f"hop of {percent(HOP)} of the gap between them are one landing."
    )
    return Section(
        "Axial landing", figures=(Figure(drawn_together(result.time, forces, "axial force", "N"), caption),)
    )


TRUSTED_CHANGE = 5e-3
"""Change of a peak at a tighter tolerance beyond which it is a warning [1]; chosen, not measured."""
NO_INTERVAL = "One run, no interval. A drop is chaotic: after about 40 ms compare statistics (study run)."
NUMERICAL = "Numerical error: "
EQUAL = 1e-6
"""Difference of forces over their peak that is rounding [1]; chosen, not measured."""
SYMMETRIC = "All ends do the same: a symmetric machine, which no real one is."
BACKWARDS = "The speed is negative: the shaft turns from y towards x, clockwise seen from the DE."


def simulate_summary(result: DropResult, machine: Machine | None = None) -> ReportContent:
    """Give what is said of one simulated drop before any figure; the machine gives the defaults in use."""
    bearings = simulated_bearings(result, machine)
    speed, duration = shown(result.initial_speed, "speed"), shown(result.time[-1], "time")
    uses = () if machine is None else clearance_uses(machine, result)
    return ReportContent(
        title=f"Simulated drop of {result.machine_name}",
        subtitle=f"from {speed}, {duration} after power-off",
        simulated=SIMULATED_MACHINE,
        verdict=_verdict(result, bearings, machine, uses),
        cards=tuple(_card(result, bearing) for bearing in bearings),
        facts=(
            *_facts(result, machine),
            ("numerical error", _certificate(result).text.removeprefix(NUMERICAL)),
        ),
    )


def _facts(result: DropResult | CoastDownResult, machine: Machine | None) -> tuple[tuple[str, str], ...]:
    """How a simulation was made, of which machine."""
    steps = f"{written(result.steps, 0)} taken, {written(result.rejected_steps, 0)} rejected"
    return (
        *((("machine", result.machine_name),) if machine is None else machine_facts(machine)),
        ("rotor basis", result.reduction),
        ("tolerance", f"{result.tolerance:g}"),
        ("steps", steps),
    )


def _card(result: DropResult, bearing: BearingDrop) -> Card:
    card = headline_card(bearing)
    figures = list(card.figures)
    if bearing.first_contact is not None and bearing.air_gap is not None:
        deepest = float(bearing.motions[0].radial.values.max()) - bearing.air_gap.upper
        figures.append(fact(BEYOND_GAP, deepest, "length", 3))
    places = ((f"{bearing.name}.face", "Peak axial force"), (stop_of(bearing.name), "Peak force on the stop"))
    for place, label in places:
        there = result.contacts_at(place)
        if there is not None and len(there):
            force, moment = there.peak
            figures.append(fact(label, force, "force", note=f"at {shown(moment, 'time', 3)}"))
    figures.append(
        fact("Contacts", len(bearing.impacts), "count", note=f"{len(bearing.touched)} of them impacts")
    )
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
    numerical = _certificate(result)
    said += [numerical] if numerical.level == "warning" else []
    said.append(Statement(NO_INTERVAL))
    first = bearings[0].force.values
    near = EQUAL * float(np.max(first))
    if len(bearings) > 1 and all(np.allclose(one.force.values, first, 0.0, near) for one in bearings):
        said.append(Statement(SYMMETRIC))
    known = () if machine is None else machine.touchdown_bearings
    unrated = [one.name for one in known if numbers_of(one).balls is None]
    if rated := [bearing for bearing in bearings if bearing.name not in unrated]:
        said.append(static_limit_statement(rated))
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
    fastest = np.max(np.abs(result.race_speed), axis=0)
    found = {
        bearing.name: excess
        for bearing, speed in zip(machine.touchdown_bearings, fastest, strict=True)
        for excess in numbers_of(bearing).excesses(float(speed), share)
        if excess.kind == THROWN
    }
    if found:
        worst = max(found, key=lambda name: found[name].value / found[name].limit)
        others = f" ({', '.join(name for name in found if name != worst)} likewise, less)"
        yield Statement(f"{worst}{others * (len(found) > 1)}: {found[worst].text}.", "warning")


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
    text = f"{NUMERICAL}{certificate.sentence()}"
    if certificate.peak_change_tolerance is None:
        return Statement(f"{text}; tolerance and truncation were not checked in this run.")
    return Statement(f"{text}.", "warning" if worst > TRUSTED_CHANGE else "good")


def heat_sections(heat: Heat | None, names: tuple[str, ...]) -> tuple[Section, ...]:
    """Temperatures and preload of a machine whose bearings warm."""
    if heat is None:
        return ()
    over = {names[b]: dict(zip(NODES, heat.temperature[:, b].T, strict=True)) for b in heat.warmed}
    preload = {names[b]: {"preload": heat.preload[:, b]} for b in heat.warmed}
    figures = (
        Figure(
            drawn_together(heat.time, over, "above the start", "K", from_zero=True),
            "Temperatures above the start. Capacities and conductances are values by size unless the machine "
            "file gives them.",
        ),
        Figure(
            drawn_together(heat.time, preload, "axial force", "N", from_zero=True),
            "Axial force of a row of balls with the race in the middle.",
        ),
    )
    return (Section("Heat", figures=figures),)


_MEDIAN, _LOW, _HIGH = (QUANTILES.index(share) for share in (0.5, 0.05, 0.95))
_DRAWN = ((0, "indentation", MICRO, "µm"), (1, "bearing force", 1.0, "N"), (2, "Hertz stress", 1e-6, "MPa"))


def coast_down_page(
    result: CoastDownResult,
    machine: Machine | None = None,
    analysis: CoastDownAnalysis | None = None,
    certificate: CoastDownCertificate | None = None,
) -> ReportContent:
    """Build the report on one simulated coast-down.

    The machine gives the friction law and the defaults in use, the analysis waterfalls, lines and resonances
    of the samples, the certificate how the statistics moved at a tighter tolerance.
    """
    speed, end = shown(result.initial_speed, "speed"), shown(result.end_time, "duration")
    missing, scale = shown(result.energy_residual, "energy", 3), shown(abs(result.energy_scale), "energy", 3)
    step = f"every {1e6 * result.output_step:g} µs"
    samples = () if result.path is None else (("samples", f"{result.path.name}, {step}"),)
    seconds = Figure(
        statistics_figure(result),
        "Indentation, force and stress second by second; the first point stands for the first 0.2 s. "
        "An indentation below zero is the distance to the race in flight.",
    )
    windows = result.windows
    spun = np.vstack([np.zeros(len(result.bearing_names)), windows.race_speed])
    turning = turning_section(
        np.append(0.0, windows.end),
        np.append(result.initial_speed, windows.speed),
        dict(zip(result.bearing_names, spun.T, strict=True)),
    )
    return ReportContent(
        title=f"Simulated coast-down of {result.machine_name}",
        subtitle=f"from {speed}, {end} after power-off",
        simulated=SIMULATED_MACHINE,
        verdict=_said_of_run(result, certificate),
        cards=tuple(_card_of_run(result, index) for index in range(len(result.bearing_names))),
        facts=(
            *_facts(result, machine),
            ("numerical error", f"energy balanced to {missing} of {scale}"),
            *samples,
        ),
        sections=(
            Section("Second by second", figures=(seconds,)),
            turning,
            *heat_sections(result.heat, result.bearing_names),
            *(() if analysis is None else frequency_sections(analysis)),
            *(() if machine is None else machine_sections(machine)),
        ),
        ends=(result.bearing_names[0], result.bearing_names[-1]),
    )


def _said_of_run(result: CoastDownResult, certificate: CoastDownCertificate | None) -> tuple[Statement, ...]:
    said = [Statement(result.outcome, "good" if result.finished else "bad")]
    maxima = result.maxima()
    held = all(maximum.in_first_window for maximum in maxima)
    if result.finished or not held:
        text = first_window_sentence(maximum.as_json() for maximum in maxima)
        said.append(Statement(text, "good" if held else "warning"))
    if result.heat is not None:
        said += [Statement(*one) for one in result.heat.sentences(result.bearing_names)]
    said.append(Statement(NO_INTERVAL))
    if certificate is not None:
        said.append(Statement(certificate.sentence(), "good" if certificate.agrees else "warning"))
    return tuple(said)


def _card_of_run(result: CoastDownResult, index: int) -> Card:
    name, (forward, backward) = result.bearing_names[index], result.whirl_time[index]
    largest = (
        fact(
            f"Largest {maximum.quantity}{' into the race' * (maximum.quantity == 'indentation')}",
            maximum.value,
            QUANTITIES[maximum.quantity][0],
            note=f"at {shown(maximum.time, 'time')}",
        )
        for maximum in result.maxima()
        if maximum.bearing == name
    )
    figures = (
        *largest,
        fact("Contacts", result.contacts[index], "count"),
        fact("Forward whirl", forward, "duration", 3),
        fact("Backward whirl", backward, "duration", 3),
    )
    return Card(f"{name} touchdown bearing", figures)


def statistics_figure(result: CoastDownResult) -> go.Figure:
    """Draw median, 5 to 95 % and largest indentation, force and stress of every second and bearing."""
    names = result.bearing_names
    titles = [f"{name}: {label}" for _, label, _, _ in _DRAWN for name in names]
    figure = panels(titles, rows=len(_DRAWN), columns=len(names), height=215, spacing=0.1)
    time = 0.5 * (result.windows.start + result.windows.end)
    hidden: dict[str, Any] = {"line": {"width": 0}}
    for row, (column, label, scale, unit) in enumerate(_DRAWN, start=1):
        for b in range(len(names)):
            levels = scale * result.windows.quantile[:, b, column]
            peak = scale * result.windows.peak[:, b, column]
            place: dict[str, Any] = {"row": row, "column": b + 1}
            named = place | {"legend": row == 1 and b == 0}
            share, filled = "5 to 95 % of the time", hidden | {"fill": "tonexty", "fillcolor": BAND_FILL}
            curve(figure, time, levels[:, _LOW], hover=None, **place, **hidden)
            curve(figure, time, levels[:, _HIGH], share, **named, **filled)
            curve(figure, time, levels[:, _MEDIAN], "median", **named, colour=COLOURS["simulated"])
            marker = {"color": SERIES[4], "size": 3.5}
            curve(figure, time, peak, "largest", **named, mode="markers", marker=marker)
        if column == 0:
            top = scale * float(np.max(result.windows.peak[..., 0]))
            figure.update_yaxes(range=[-0.15 * top, 1.1 * top], row=row)
        else:
            figure.update_yaxes(type="log", row=row, **LOG_LABELS)
        figure.update_yaxes(title_text=axis_title(plain(label), unit), row=row, col=1)
    return finished(figure, FROM_POWER_OFF, row=len(_DRAWN))
