"""The report on the response to unbalance: Bode and polar plots, deflected shapes, margins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.report.content import Figure, ReportContent, Section, Statement, Table
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import LIMIT, MICRO, MUTED, SERIES, axis_title, fit_legend, panels, plain, single
from rotordrop.rotor.campbell import LEAST_FACTOR, ResponsePeak, required_margin, response_peaks
from rotordrop.rotor.unbalanced import MachineResponse, orbit_axis

if TYPE_CHECKING:
    from rotordrop.machine import Machine

TURN = 2.0 * math.pi
LEAST_PEAK = 0.02
"""Peaks below this share of the largest amplitude of the response are not listed [1]."""
MOST_SHAPES = 5
SHARED_LABEL = 0.06
"""Distance of two planes along the rotor below which they share a label, over its length [1]."""


def unbalance_page(machine: Machine, response: MachineResponse) -> ReportContent:
    """Build the report on the response of a machine to its unbalance."""
    nominal = float(machine.speed.nominal)
    found = [(name, node, _peaks(response, node)) for name, node in response.places]
    return ReportContent(
        title=f"Unbalance response of {machine.name}",
        subtitle=f"in its {response.suspension}, nominal speed {Quantity(value=nominal, kind='speed').text}",
        verdict=_verdict(machine, response, found, nominal),
        facts=(("machine", machine.name), ("rotordrop", __version__)),
        summary=(peak_table(found, nominal), _unbalance_table(response)),
        sections=(
            Section(
                heading="Bode and polar plots",
                figures=(
                    Figure(
                        chart=bode_figure(response, nominal),
                        caption="Half the major axis of the orbit (0 to peak) and phase lag of its forward "
                        "part behind the rotor angle, in every plane; dashed: nominal speed.",
                        name="bode",
                    ),
                    Figure(
                        chart=polar_figure(response),
                        caption="Forward part of the orbit at rotor angle zero, x to the right and y up; the "
                        "curve runs with the speed, a loop is a resonance.",
                        name="polar",
                    ),
                ),
            ),
            Section(
                heading="Deflected shapes",
                figures=(
                    Figure(
                        chart=shape_figure(response, nominal, found),
                        caption="Half the major axis of the orbits along the rotor, at the nominal speed and "
                        "at the peaks.",
                        name="deflected shapes",
                    ),
                ),
            ),
        ),
    )


def unbalance_json(machine: Machine, response: MachineResponse) -> dict[str, Any]:
    """Everything the page shows, ready for JSON, SI units."""
    return {
        "machine": machine.name,
        "suspension": response.suspension,
        "nominal_Hz": float(machine.speed.nominal) / TURN,
        "speed_Hz": (response.speed / TURN).tolist(),
        "unbalances": [
            {"node": node, "amount_kg_m": amount, "phase_rad": phase}
            for node, amount, phase in response.unbalance
        ],
        "planes": [
            {
                "name": name,
                "node": node,
                "major_axis_m": response.major_axis(node).tolist(),
                "x_m": _complex(response.at(node)[:, 0]),
                "y_m": _complex(response.at(node)[:, 1]),
                "peaks": [
                    {
                        "speed_Hz": peak.speed / TURN,
                        "amplitude_m": peak.amplitude,
                        "amplification_factor": None if math.isnan(peak.factor) else peak.factor,
                    }
                    for peak in _peaks(response, node)
                ],
            }
            for name, node in response.places
        ],
    }


def _complex(values: Any) -> dict[str, list[float]]:
    return {"real": values.real.tolist(), "imaginary": values.imag.tolist()}


def _peaks(response: MachineResponse, node: int) -> tuple[ResponsePeak, ...]:
    amplitude = response.major_axis(node)
    least = LEAST_PEAK * float(np.max(amplitude))
    return tuple(peak for peak in response_peaks(response.speed, amplitude) if peak.amplitude >= least)


def _margin(peak: ResponsePeak, nominal: float) -> tuple[float, float]:
    """Distance from the nominal speed and the distance required, as shares of it [1]."""
    needed = 0.0 if math.isnan(peak.factor) else required_margin(peak.factor, above=peak.speed > nominal)
    return abs(peak.speed / nominal - 1.0), needed


def _verdict(
    machine: Machine,
    response: MachineResponse,
    found: Sequence[tuple[str, int, tuple[ResponsePeak, ...]]],
    nominal: float,
) -> tuple[Statement, ...]:
    statements = []
    for name, _, peaks in found:
        for peak in peaks:
            apart, needed = _margin(peak, nominal)
            if peak.factor >= LEAST_FACTOR and apart < needed:
                speed = Quantity(value=peak.speed, kind="speed").text
                text = (
                    f"{name}: the peak at {speed} with an amplification factor of {peak.factor:.1f} is "
                    f"{100.0 * apart:.1f} % from the nominal speed; API 617 asks for {100.0 * needed:.1f} %"
                )
                statements.append(Statement(text=text, level="bad"))
    if not statements:
        text = "No peak of the response lies nearer to the nominal speed than API 617 asks for."
        statements.append(Statement(text=text, level="good"))
    if machine.balance_grade is not None:
        text = "the unbalance is that of the balance grade, its phases are not known: all at zero here"
        statements.append(Statement(text=text))
    if response.suspension == "AMBs":
        text = "an AMB stands as one spring and one damper; a controller changes both with the frequency"
        statements.append(Statement(text=text))
    return tuple(statements)


def _judged(factor: float, apart: float, needed: float) -> tuple[str, str]:
    """Margin required and verdict; a peak whose half power is not reached has no factor to ask one by."""
    if math.isnan(factor):
        return "–", "factor not known"
    if factor < LEAST_FACTOR:
        return "none", "critically damped"
    return f"{100.0 * needed:.1f} %", "met" if apart >= needed else "not met"


def peak_table(found: Sequence[tuple[str, int, tuple[ResponsePeak, ...]]], nominal: float) -> Table:
    """Peaks of every plane with amplification factor and margin from the nominal speed."""
    rows = []
    for name, node, peaks in found:
        for peak in peaks:
            apart, needed = _margin(peak, nominal)
            rows.append(
                (
                    f"{name}, node {node}",
                    Quantity(value=peak.speed, kind="speed", digits=4),
                    Quantity(value=peak.amplitude, kind="length", digits=3),
                    "–" if math.isnan(peak.factor) else f"{peak.factor:.2f}",
                    f"{100.0 * apart:.1f} %",
                    *_judged(peak.factor, apart, needed),
                )
            )
    return Table(
        columns=("plane", "peak at", "0 to peak", "amplification", "margin", "required", "API 617"),
        rows=tuple(rows),
        caption="Peaks of the response",
        note="Amplification by the half-power width of the peak; margin from the nominal speed.",
    )


def _unbalance_table(response: MachineResponse) -> Table:
    return Table(
        columns=("node", "unbalance", "phase from +y"),
        rows=tuple(
            (f"{node}", Quantity(value=amount, kind="unbalance"), Quantity(value=phase, kind="angle"))
            for node, amount, phase in response.unbalance
        ),
        caption="Unbalance",
    )


def _forward(response: MachineResponse, node: int) -> Any:
    x, y = response.at(node)[:, 0], response.at(node)[:, 1]
    return 0.5 * (x + 1j * y)


def bode_figure(response: MachineResponse, nominal: float) -> go.Figure:
    """Draw amplitude and phase lag over the speed, in Hz with rpm in the hover text."""
    figure = panels(("amplitude, 0 to peak", "phase lag"), rows=2, columns=1, height=260)
    speed = response.speed / TURN
    for k, (name, node) in enumerate(response.places):
        lag = -np.degrees(np.unwrap(np.angle(_forward(response, node))))
        for row, values, unit in ((1, MICRO * response.major_axis(node), "µm"), (2, lag, "°")):
            figure.add_trace(
                go.Scatter(
                    x=single(speed),
                    y=single(values),
                    customdata=single(60.0 * speed),
                    mode="lines",
                    name=plain(name),
                    legendgroup=name,
                    showlegend=row == 1,
                    line={"color": SERIES[k % len(SERIES)], "width": 1.6},
                    hovertemplate="%{x:.2f} Hz (%{customdata:.0f} rpm): %{y:.4g} "
                    + unit
                    + "<extra>"
                    + plain(name)
                    + "</extra>",
                ),
                row=row,
                col=1,
            )
    for row in (1, 2):
        figure.add_vline(
            x=nominal / TURN, line={"color": LIMIT, "width": 1.2, "dash": "dash"}, row=row, col=1
        )
    figure.update_xaxes(title_text=axis_title("rotor speed, × 60 in rpm", "Hz"), row=2)
    figure.update_yaxes(title_text=axis_title("amplitude", "µm"), rangemode="tozero", row=1)
    figure.update_yaxes(title_text=axis_title("phase lag", "°"), row=2)
    return fit_legend(figure)


def polar_figure(response: MachineResponse) -> go.Figure:
    """Draw the forward part of the orbits at rotor angle zero, one curve per plane."""
    figure = panels(("",), height=430)
    for k, (name, node) in enumerate(response.places):
        forward = MICRO * _forward(response, node)
        figure.add_trace(
            go.Scatter(
                x=single(forward.real),
                y=single(forward.imag),
                customdata=single(response.speed / TURN),
                mode="lines",
                name=plain(name),
                line={"color": SERIES[k % len(SERIES)], "width": 1.6},
                hovertemplate="%{customdata:.2f} Hz: %{x:.3g}, %{y:.3g} µm<extra>" + plain(name) + "</extra>",
            )
        )
    figure.update_xaxes(title_text=axis_title("x", "µm"))
    figure.update_yaxes(title_text=axis_title("y", "µm"), scaleanchor="x")
    return fit_legend(figure)


def shape_figure(
    response: MachineResponse,
    nominal: float,
    found: Sequence[tuple[str, int, tuple[ResponsePeak, ...]]],
) -> go.Figure:
    """Draw the deflection along the rotor at the nominal speed and at the largest peaks."""
    figure = panels(("",), height=320)
    largest = sorted((p for _, _, peaks in found for p in peaks), key=lambda p: -p.amplitude)
    speeds = [nominal]
    for peak in largest:
        if all(abs(peak.speed / speed - 1.0) > 0.02 for speed in speeds) and len(speeds) < MOST_SHAPES:
            speeds.append(peak.speed)
    for k, speed in enumerate(speeds):
        at = int(np.argmin(np.abs(response.speed - speed)))
        label = f"{response.speed[at] / TURN:.1f} Hz{' (nominal)' if k == 0 else ''}"
        figure.add_trace(
            go.Scatter(
                x=single(1e3 * response.node_positions),
                y=single(MICRO * orbit_axis(response.displacement[at])),
                mode="lines",
                name=label,
                line={"color": SERIES[k % len(SERIES)], "width": 1.6},
                hovertemplate="%{x:.0f} mm: %{y:.4g} µm<extra>" + label + "</extra>",
            )
        )
    _mark_places(figure, response)
    figure.update_xaxes(title_text=axis_title("position from node 1", "mm"))
    figure.update_yaxes(title_text=axis_title("deflection, 0 to peak", "µm"), rangemode="tozero")
    return fit_legend(figure)


def _mark_places(figure: go.Figure, response: MachineResponse) -> None:
    """Draw an upright line at every plane; planes beside each other share a label, which stays inside."""
    length = 1e3 * float(response.node_positions[-1])
    groups: list[tuple[float, list[str]]] = []
    at = {name: 1e3 * float(response.node_positions[node - 1]) for name, node in response.places}
    for name, position in sorted(at.items(), key=lambda pair: pair[1]):
        figure.add_vline(x=position, line={"color": MUTED, "width": 1, "dash": "dot"})
        if groups and position - groups[-1][0] < SHARED_LABEL * length:
            groups[-1][1].append(name)
        else:
            groups.append((position, [name]))
    for position, names in groups:
        figure.add_annotation(
            x=position,
            y=1.0,
            yref="paper",
            text=plain(", ".join(names)),
            showarrow=False,
            xanchor="left" if position < 0.5 * length else "right",
            yanchor="bottom",
        )
