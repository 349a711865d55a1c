"""The report on one simulated drop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop._version import __version__
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement
from rotordrop.report.from_simulation import (
    drop_motions,
    first_contacts,
    force_histories,
    force_peaks,
    peak_stress,
    stress_boxes,
    stress_histories,
    stress_peaks,
)
from rotordrop.report.history import History
from rotordrop.report.impacts import impacts_of
from rotordrop.report.machine_sections import machine_sections, weight_shares
from rotordrop.report.quantity import Quantity
from rotordrop.report.sections import (
    first_contact_section,
    force_section,
    impact_section,
    motion_section,
    orbit_section,
    static_limit_statement,
    stress_section,
)
from rotordrop.report.speed import speed_figure
from rotordrop.simulation.result import DropResult

if TYPE_CHECKING:
    from rotordrop.machine import Machine

SETTLED_FROM, SETTLED_TO = 0.15, 0.2
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
    return ReportContent(
        title=f"Simulated drop of {result.machine_name}",
        subtitle=f"from {speed.text}, {duration.text} after power-off",
        simulated="Everything on this page is computed from the machine description; nothing was measured.",
        verdict=_verdict(result, machine),
        cards=tuple(_card(result, index) for index in range(len(result.bearing_names))),
        facts=_facts(result, machine),
        sections=_sections(result, machine),
    )


def _card(result: DropResult, index: int) -> Card:
    force, force_time = result.peak_force(index)
    stress, stress_time = peak_stress(result, index)
    deepest = float(np.max(result.indentation[:, index]))
    figures = [
        KeyFigure(
            label="Peak bearing force", value=Quantity(value=force, kind="force"), note=_at(force_time)
        ),
        KeyFigure(
            label="Peak Hertz stress", value=Quantity(value=stress, kind="pressure"), note=_at(stress_time)
        ),
    ]
    pressed = result.peak_contact_pressure(index)
    if pressed is not None:
        width = Quantity(value=2.0 * pressed[1], kind="length", digits=3).text
        figures.append(
            KeyFigure(
                label="Peak pressure, rotor on race",
                value=Quantity(value=pressed[0], kind="pressure"),
                note=f"{_at(pressed[2])}, {width} wide",
            )
        )
    settled = (result.time >= SETTLED_FROM) & (result.time <= SETTLED_TO)
    if result.time[-1] >= SETTLED_TO:
        mean = float(np.mean(result.bearing_force_magnitude[settled, index]))
        figures.append(KeyFigure(label="Mean force, 150 to 200 ms", value=Quantity(value=mean, kind="force")))
    if deepest > 0.0:
        value = Quantity(value=deepest, kind="length", digits=3)
        figures.append(KeyFigure(label="Largest indentation", value=value))
    log = result.contacts.of_bearing(index)
    figures.append(KeyFigure(label="Contacts", value=Quantity(value=len(log), kind="count")))
    lost = Quantity(value=float(np.sum(log.dissipated_energy)), kind="energy", digits=3)
    figures.append(KeyFigure(label="Energy lost in contact", value=lost))
    return Card(title=f"{result.bearing_names[index]} touchdown bearing", figures=tuple(figures))


def _at(time: float) -> str:
    return f"at {Quantity(value=time, kind='time', digits=4).text}"


def _verdict(result: DropResult, machine: Machine | None) -> tuple[Statement, ...]:
    statements = [Statement(text=result.outcome, level="good" if result.finished else "bad")]
    statements.append(_certificate(result))
    statements.append(
        Statement(
            text="The numbers have no interval: one simulation with given parameters cannot state one. After "
            "about 50 ms a drop is chaotic, and only its statistics can be compared with another one."
        )
    )
    for index, name in enumerate(result.bearing_names):
        statements.append(static_limit_statement(name, peak_stress(result, index)[0]))
    if machine is not None and machine.defaults_in_use:
        text = f"{len(machine.defaults_in_use)} values of the machine are defaults; they are listed below."
        statements.append(Statement(text=text, level="notice"))
    return tuple(statements)


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


def _sections(result: DropResult, machine: Machine | None) -> tuple[Section, ...]:
    motions = drop_motions(result)
    sections = [
        motion_section(motions, "simulated"),
        first_contact_section(motions, first_contacts(result)),
        orbit_section(motions),
        force_section(force_histories(result), force_peaks(result), weight_shares(machine)),
        stress_section(stress_histories(result), stress_peaks(result), stress_boxes(result)),
        impact_section(impacts_of(result.contacts, result.bearing_names)),
        _speed_section(result),
    ]
    return tuple(sections) if machine is None else (*sections, *machine_sections(machine))


def _speed_section(result: DropResult) -> Section:
    rotor = (History(label="rotor", time=result.time, values=result.speed),)
    races = tuple(
        History(label=f"{name} race", time=result.time, values=result.race_speed[:, index])
        for index, name in enumerate(result.bearing_names)
    )
    caption = "Speed of the rotor and of the inner races, which friction spins up."
    return Section(heading="Speed", figures=(Figure(chart=speed_figure(rotor, races), caption=caption),))
