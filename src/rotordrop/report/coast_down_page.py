"""The report on one simulated coast-down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop._version import __version__
from rotordrop.report.coast_down_figures import coast_down_speed_figure, statistics_figure
from rotordrop.report.content import Card, Figure, KeyFigure, ReportContent, Section, Statement, Table
from rotordrop.report.machine_sections import machine_sections
from rotordrop.report.quantity import Quantity, written
from rotordrop.report.waterfall_page import frequency_sections
from rotordrop.simulate.coast_down_result import QUANTITIES, CoastDownResult

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.simulate.coast_down_certificate import CoastDownCertificate
    from rotordrop.spectrum.coast_down import CoastDownAnalysis


def coast_down_page(
    result: CoastDownResult,
    machine: Machine | None = None,
    analysis: CoastDownAnalysis | None = None,
    certificate: CoastDownCertificate | None = None,
) -> ReportContent:
    """Build the report on one simulated coast-down.

    Parameters
    ----------
    result : CoastDownResult
        The simulated coast-down.
    machine : Machine, optional
        Gives the friction law and the defaults in use.
    analysis : CoastDownAnalysis, optional
        Waterfalls, lines and resonances of its samples.
    certificate : CoastDownCertificate, optional
        How its statistics moved at a tighter tolerance.
    """
    speed = Quantity(value=result.initial_speed, kind="speed", digits=4)
    end = Quantity(value=result.end_time, kind="duration", digits=4)
    return ReportContent(
        title=f"Simulated coast-down of {result.machine_name}",
        subtitle=f"from {speed.text}, {end.text} after power-off",
        simulated="Everything on this page is computed from the machine description; nothing was measured.",
        verdict=(*_verdict(result), *_settled(analysis), *_certified(certificate)),
        cards=tuple(_card(result, index) for index in range(len(result.bearing_names))),
        facts=_facts(result),
        summary=(maxima_table(result),),
        sections=(
            _seconds_section(result),
            _speed_section(result),
            *(() if analysis is None else frequency_sections(analysis)),
            *(() if machine is None else machine_sections(machine)),
        ),
    )


def _verdict(result: CoastDownResult) -> tuple[Statement, ...]:
    statements = [Statement(text=result.outcome, level="good" if result.finished else "warning")]
    found = result.maxima()
    later = [maximum for maximum in found if not maximum.in_first_window]
    if later:
        statements += [Statement(text=maximum.sentence(), level="warning") for maximum in later]
    else:
        statements.append(
            Statement(
                text="The first 0.2 s held the largest indentation, force and stress of every bearing.",
                level="good",
            )
        )
    missing, scale = _joules(result.energy_residual), _joules(abs(result.energy_scale))
    statements.append(
        Statement(
            text=f"Energy balanced to {missing} of {scale} "
            "over the whole coast-down. After about 50 ms a drop is chaotic: compare "
            "statistics, not histories.",
        )
    )
    settled = result.windows.settled
    if np.any(settled[:, 0] > 0.0):
        statements.append(
            Statement(
                text=f"{100 * float(np.mean(settled[:, 0] > 0.0)):.0f} % of the seconds were done with the "
                "scheme for settled rotors; over the first 2 ms of each it stayed within "
                f"{1e9 * float(np.max(settled[:, 1])):.2g} nm and {float(np.max(settled[:, 2])):.2g} N of "
                "the Runge–Kutta pair.",
            )
        )
    return tuple(statements)


def _settled(analysis: CoastDownAnalysis | None) -> tuple[Statement, ...]:
    """When each plane came to lie in its bearing for good."""
    planes = {} if analysis is None else analysis.planes
    return tuple(
        Statement(
            text=f"{name} plane: {plane.settling.statement}",
            level="good" if plane.settling.settled else "notice",
        )
        for name, plane in planes.items()
    )


def _certified(certificate: CoastDownCertificate | None) -> tuple[Statement, ...]:
    if certificate is None:
        return ()
    return (Statement(text=certificate.sentence(), level="good" if certificate.agrees else "warning"),)


def _card(result: CoastDownResult, index: int) -> Card:
    kinds = {name: kind for name, (kind, _) in QUANTITIES.items()}
    figures = [
        KeyFigure(
            label=f"Largest {maximum.quantity}",
            value=Quantity(value=maximum.value, kind=kinds[maximum.quantity]),
            note=f"at {Quantity(value=maximum.time, kind='time', digits=4).text}",
        )
        for maximum in result.maxima()
        if maximum.bearing == result.bearing_names[index]
    ]
    forward, backward = result.whirl_time[index]
    figures += [
        KeyFigure(label="Contacts", value=Quantity(value=float(result.contacts[index]), kind="count")),
        KeyFigure(
            label="Energy lost in contact",
            value=Quantity(value=float(result.contact_energy[index]), kind="energy", digits=3),
        ),
        KeyFigure(label="Forward whirl", value=Quantity(value=float(forward), kind="duration", digits=3)),
        KeyFigure(label="Backward whirl", value=Quantity(value=float(backward), kind="duration", digits=3)),
    ]
    return Card(title=f"{result.bearing_names[index]} touchdown bearing", figures=tuple(figures))


def maxima_table(result: CoastDownResult) -> Table:
    """Does 0.2 s hold the maximum? When the largest value of each quantity came, and what came after."""
    rows = []
    for maximum in result.maxima():
        kind = QUANTITIES[maximum.quantity][0]
        rows.append(
            (
                maximum.bearing,
                maximum.quantity,
                Quantity(value=maximum.value, kind=kind),
                Quantity(value=maximum.time, kind="time", digits=4),
                "yes" if maximum.in_first_window else "no",
                Quantity(value=maximum.later, kind=kind, digits=3),
                Quantity(value=maximum.later_time, kind="duration", digits=3),
            )
        )
    return Table(
        columns=("bearing", "quantity", "largest", "when", "in 0.2 s", "largest later", "then"),
        rows=tuple(rows),
        caption="Does 0.2 s hold the maximum? (Neisi 2020, section 5.4)",
        note="The largest value is taken at the integrator's own steps, later ones on the output grid; their "
        "time is the middle of the second in which they came.",
    )


def _facts(result: CoastDownResult) -> tuple[tuple[str, str], ...]:
    facts = [
        ("machine", result.machine_name),
        ("rotor basis", result.reduction),
        ("tolerance", f"{result.tolerance:g}"),
        (
            "Runge–Kutta steps",
            f"{written(result.steps, 0)} taken, {written(result.rejected_steps, 0)} rejected",
        ),
        ("rotordrop", __version__),
    ]
    if result.path is not None:
        facts.append(("samples", f"{result.path.name}, every {1e6 * result.output_step:g} µs"))
    return tuple(facts)


def _seconds_section(result: CoastDownResult) -> Section:
    figure = Figure(
        chart=statistics_figure(result),
        caption="Indentation, force and stress second by second; the first point stands for the first 0.2 s. "
        "An indentation below zero is the distance to the race in flight.",
    )
    return Section(heading="Second by second", figures=(figure,))


def _speed_section(result: CoastDownResult) -> Section:
    figure = Figure(
        chart=coast_down_speed_figure(result),
        caption="Speed of rotor and races at the end of every second; dashed: standstill.",
    )
    return Section(heading="Speed", figures=(figure,))


def _joules(energy: float) -> str:
    return Quantity(value=energy, kind="energy", digits=3).text
