"""The report on one simulated drop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop._version import __version__
from rotordrop.estimate.bearing_drop import BearingDrop, History, simulated_bearings
from rotordrop.machine.plausibility import doubts_of_speed
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement
from rotordrop.report.drop_sections import drop_sections, speed_figure, static_limit_statement
from rotordrop.report.estimate_numbers import headline_card
from rotordrop.report.machine_sections import machine_sections, weight_shares
from rotordrop.report.quantity import Quantity
from rotordrop.simulate.result import DropResult

if TYPE_CHECKING:
    from rotordrop.machine import Machine

TRUSTED_CHANGE = 5e-3


def simulate_page(result: DropResult, machine: Machine | None = None) -> ReportContent:
    """Build the report on one simulated drop.

    Parameters
    ----------
    result : DropResult
        The simulated drop.
    machine : Machine, optional
        The machine that was simulated; gives air gaps, weight shares, friction law and the defaults in use.

    Returns
    -------
    ReportContent
        For `rotordrop.report.page.write_page` and `rotordrop.report.terminal.print_summary`.
    """
    speed = Quantity(value=result.initial_speed, kind="speed", digits=4)
    duration = Quantity(value=float(result.time[-1]), kind="time", digits=4)
    bearings = simulated_bearings(result)
    return ReportContent(
        title=f"Simulated drop of {result.machine_name}",
        subtitle=f"from {speed.text}, {duration.text} after power-off",
        simulated="Everything on this page is computed from the machine description; nothing was measured.",
        verdict=_verdict(result, bearings, machine),
        cards=tuple(_card(result, b, bearing) for b, bearing in enumerate(bearings)),
        facts=_facts(result, machine),
        sections=_sections(result, bearings, machine),
    )


def _card(result: DropResult, index: int, bearing: BearingDrop) -> Card:
    card = headline_card(bearing)
    figures = list(card.figures)
    pressure, half_width, pressed_at = result.peak_contact_pressure(index)
    note = (
        f"at {Quantity(value=pressed_at, kind='time', digits=3).text}, "
        f"{Quantity(value=2.0 * half_width, kind='length', digits=3).text} wide"
    )
    pressed = Quantity(value=pressure, kind="pressure")
    figures.insert(2, KeyFigure(label="Peak pressure, rotor on race", value=pressed, note=note))
    if bearing.first_contact is not None and bearing.air_gap is not None:
        deepest = float(bearing.motions[0].radial.values.max()) - bearing.air_gap.upper
        value = Quantity(value=deepest, kind="length", digits=3)
        figures.append(KeyFigure(label="Furthest beyond the air gap", value=value))
    figures.append(KeyFigure(label="Contacts", value=Quantity(value=len(bearing.impacts), kind="count")))
    lost = sum(impact.dissipated_energy.value for impact in bearing.impacts)
    energy = Quantity(value=lost, kind="energy", digits=3)
    figures.append(KeyFigure(label="Energy lost in contact", value=energy))
    return Card(title=card.title, figures=tuple(figures))


def _verdict(
    result: DropResult, bearings: tuple[BearingDrop, ...], machine: Machine | None
) -> tuple[Statement, ...]:
    statements = [Statement(text=result.outcome, level="good" if result.finished else "bad")]
    statements += _doubts(result, machine)
    statements.append(_certificate(result))
    statements.append(
        Statement(
            text="The numbers have no interval: one simulation with given parameters cannot state one. After "
            "about 50 ms a drop is chaotic, and only its statistics can be compared with another one."
        )
    )
    statements += [static_limit_statement(bearing) for bearing in bearings]
    if machine is not None and machine.defaults_in_use:
        text = (
            f"{len(machine.defaults_in_use)} values of the machine are defaults; the report and "
            "'rotordrop check --all' list them."
        )
        statements.append(Statement(text=text, level="notice"))
    return tuple(statements)


def _doubts(result: DropResult, machine: Machine | None) -> list[Statement]:
    """What is unusual about the speed that was asked for."""
    found = []
    if result.initial_speed < 0.0:
        text = "The speed is negative: the shaft turns from y towards x, clockwise seen from the DE."
        found.append(Statement(text=text, level="notice"))
    if machine is not None:
        doubts = doubts_of_speed(machine, result.initial_speed)
        found += [Statement(text=f"{doubt.message}.", level="warning") for doubt in doubts]
    return found


def _certificate(result: DropResult) -> Statement:
    certificate = result.certificate
    changes = [certificate.peak_change_tolerance, certificate.peak_change_truncation]
    worst = max((float(np.max(change)) for change in changes if change is not None), default=0.0)
    text = f"Numerical error: {certificate.sentence()}"
    if certificate.peak_change_tolerance is None:
        return Statement(text=f"{text}; tolerance and truncation were not checked in this run.")
    return Statement(text=f"{text}.", level="warning" if worst > TRUSTED_CHANGE else "good")


def _facts(result: DropResult, machine: Machine | None) -> tuple[tuple[str, str], ...]:
    path = getattr(machine, "source_path", None)
    return (
        ("machine", result.machine_name if path is None else f"{result.machine_name} ({path.name})"),
        ("rotor basis", result.reduction),
        ("tolerance", f"{result.tolerance:g}"),
        ("steps", f"{result.steps} taken, {result.rejected_steps} rejected"),
        ("rotordrop", __version__),
    )


def _sections(
    result: DropResult, bearings: tuple[BearingDrop, ...], machine: Machine | None
) -> tuple[Section, ...]:
    drop = drop_sections(bearings, "simulated", result.initial_speed, weight_shares(machine))
    further = () if machine is None else machine_sections(machine)
    return (*drop, _speed_section(result), *further)


def _speed_section(result: DropResult) -> Section:
    rotor = (History(label="rotor", time=result.time, values=result.speed),)
    races = tuple(
        History(label=f"{name} race", time=result.time, values=result.race_speed[:, index])
        for index, name in enumerate(result.bearing_names)
    )
    caption = "Speed of the rotor and of the inner races, which friction spins up."
    return Section(heading="Speed", figures=(Figure(chart=speed_figure(rotor, races), caption=caption),))
