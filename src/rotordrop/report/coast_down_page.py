"""The report on one simulated coast-down, second by second."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.report.content import (
    SIMULATED_MACHINE,
    Card,
    Column,
    Figure,
    ReportContent,
    Section,
    Statement,
    Table,
    fact,
    table,
)
from rotordrop.report.machine_content import machine_sections
from rotordrop.report.quantity import Quantity, shown, written
from rotordrop.report.simulate_page import heat_sections
from rotordrop.report.style import (
    BAND_FILL,
    COLOURS,
    FROM_POWER_OFF,
    LOG_LABELS,
    MICRO,
    SERIES,
    TURN,
    axis_title,
    curve,
    fit_legend,
    panels,
    plain,
    upright,
)
from rotordrop.report.waterfall_page import frequency_sections
from rotordrop.simulate.coast_down_result import (
    QUANTILES,
    QUANTITIES,
    CoastDownResult,
    first_window_sentence,
)

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.simulate.coast_down_certificate import CoastDownCertificate
    from rotordrop.spectrum.coast_down import CoastDownAnalysis

LARGEST_NOTE = (
    "The largest value is taken at the integrator's own steps, later ones on the output grid; their time is "
    "the middle of the second in which they came."
)
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
    steps = f"{written(result.steps, 0)} taken, {written(result.rejected_steps, 0)} rejected"
    step = f"every {1e6 * result.output_step:g} µs"
    samples = () if result.path is None else (("samples", f"{result.path.name}, {step}"),)
    seconds = Figure(
        statistics_figure(result),
        "Indentation, force and stress second by second; the first point stands for the first 0.2 s. "
        "An indentation below zero is the distance to the race in flight.",
    )
    turning = Figure(
        coast_down_speed_figure(result),
        "Speed of rotor and races at the end of every second; dashed: standstill.",
    )
    return ReportContent(
        title=f"Simulated coast-down of {result.machine_name}",
        subtitle=f"from {speed}, {end} after power-off",
        simulated=SIMULATED_MACHINE,
        verdict=_verdict(result, analysis, certificate),
        cards=tuple(_card(result, index) for index in range(len(result.bearing_names))),
        facts=(
            ("machine", result.machine_name),
            ("rotor basis", result.reduction),
            ("tolerance", f"{result.tolerance:g}"),
            ("Runge–Kutta steps", steps),
            ("rotordrop", __version__),
            *samples,
        ),
        sections=(
            Section("Second by second", figures=(seconds,), tables=(maxima_table(result),)),
            Section("Speed", figures=(turning,)),
            *heat_sections(result.heat, result.bearing_names),
            *(() if analysis is None else frequency_sections(analysis)),
            *(() if machine is None else machine_sections(machine)),
        ),
        ends=(result.bearing_names[0], result.bearing_names[-1]),
    )


def _verdict(
    result: CoastDownResult, analysis: CoastDownAnalysis | None, certificate: CoastDownCertificate | None
) -> tuple[Statement, ...]:
    said = [Statement(result.outcome, "good" if result.finished else "bad")]
    maxima = result.maxima()
    held = all(maximum.in_first_window for maximum in maxima)
    if result.finished or not held:
        text = first_window_sentence(maximum.as_json() for maximum in maxima)
        said.append(Statement(text, "good" if held else "warning"))
    if result.heat is not None:
        said += [Statement(*one) for one in result.heat.sentences(result.bearing_names)]
    missing, scale = shown(result.energy_residual, "energy", 3), shown(abs(result.energy_scale), "energy", 3)
    text = (
        f"Energy balanced to {missing} of {scale} over the whole coast-down. After about 50 ms a drop is "
        "chaotic: compare statistics, not histories."
    )
    said.append(Statement(text))
    settled = result.windows.settled
    if np.any(settled[:, 0] > 0.0):
        text = (
            f"{100 * float(np.mean(settled[:, 0] > 0.0)):.0f} % of the seconds were done with the scheme for "
            f"settled rotors; over the first 2 ms of each it stayed within "
            f"{1e9 * float(np.max(settled[:, 1])):.2g} nm and {float(np.max(settled[:, 2])):.2g} N of the "
            "Runge–Kutta pair."
        )
        said.append(Statement(text))
    if certificate is not None:
        said.append(Statement(certificate.sentence(), "good" if certificate.agrees else "warning"))
    return tuple(said)


def _card(result: CoastDownResult, index: int) -> Card:
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
        fact("Energy lost in contact", result.contact_energy[index], "energy", 3),
        fact("Forward whirl", forward, "duration", 3),
        fact("Backward whirl", backward, "duration", 3),
    )
    return Card(f"{name} touchdown bearing", figures)


def maxima_table(result: CoastDownResult) -> Table:
    """Does 0.2 s hold the maximum? When the largest value of each quantity came, and what came after."""
    columns = (
        Column("bearing", lambda row: row[1].bearing),
        Column("quantity", lambda row: row[1].quantity),
        Column("largest", lambda row: Quantity.of(row[1].value, row[0])),
        Column("when", lambda row: row[1].time, "time"),
        Column("in 0.2 s", lambda row: "yes" if row[1].in_first_window else "no"),
        Column("largest later", lambda row: Quantity.of(row[1].later, row[0], 3)),
        Column("then", lambda row: row[1].later_time, "duration", 3),
    )
    rows = [(QUANTITIES[maximum.quantity][0], maximum) for maximum in result.maxima()]
    return table(rows, columns, "Does 0.2 s hold the maximum? (Neisi 2020, section 5.4)", LARGEST_NOTE)


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
    figure.update_xaxes(title_text=FROM_POWER_OFF, row=len(_DRAWN))
    return fit_legend(figure)


def coast_down_speed_figure(result: CoastDownResult) -> go.Figure:
    """Draw the speed of rotor and races at the end of every second.

    The axis is logarithmic: the dry drag that stops the rotor bends the curve down at the end.
    """
    figure = panels(("rotor and races",), height=280)
    time = np.concatenate([[0.0], result.windows.end])
    speeds = [("rotor", np.concatenate([[result.initial_speed], result.windows.speed]), COLOURS["simulated"])]
    for b, name in enumerate(result.bearing_names):
        race = np.concatenate([[0.0], result.windows.race_speed[:, b]])
        speeds.append((f"{name} race", race, SERIES[2 + b]))
    for label, speed, colour in speeds:
        turning = np.where(np.abs(speed) > 1e-3, np.abs(speed) / TURN, np.nan)
        curve(figure, time, turning, label, colour=colour)
    if result.standstill_time is not None:
        upright(figure, result.standstill_time, SERIES[4])
    figure.update_yaxes(title_text=axis_title("speed", "Hz"), type="log", **LOG_LABELS)
    figure.update_xaxes(title_text=FROM_POWER_OFF)
    return fit_legend(figure)
