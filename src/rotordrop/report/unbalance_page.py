"""The report on the response to unbalance: Bode and polar plots, deflected shapes, margins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from rotordrop._version import __version__
from rotordrop.report.content import Column, Figure, ReportContent, Section, Statement, Table, table
from rotordrop.report.quantity import shown
from rotordrop.report.style import (
    MICRO,
    MILLI,
    MUTED,
    SERIES,
    TURN,
    axis_title,
    curve,
    fit_legend,
    panels,
    plain,
    upright,
)
from rotordrop.rotor.campbell import ResponsePeak, Separation, response_peaks
from rotordrop.rotor.unbalanced import MachineResponse, orbit_axis

if TYPE_CHECKING:
    from rotordrop.machine import Machine

LEAST_PEAK = 0.02
"""Peaks below this share of the largest amplitude of the response are not listed [1]."""
MOST_SHAPES = 5
SHARED_LABEL = 0.06
"""Distance of two planes along the rotor below which they share a label, over its length [1]."""
CLEAR = "No peak of the response lies nearer to the nominal speed than API 617 asks for."
GRADE = "the unbalance is that of the balance grade, its phases are not known: all at zero here"
SPRINGS = "an AMB stands as one spring and one damper; a controller changes both with the frequency"


class PlanePeak(NamedTuple):
    """A peak of the response in one plane, set against the nominal speed."""

    plane: str
    node: int
    peak: ResponsePeak
    separation: Separation


def plane_peaks(response: MachineResponse, nominal: float) -> list[PlanePeak]:
    """Peaks of every plane, set against the nominal speed [rad/s]."""
    return [
        PlanePeak(name, node, peak, Separation.of(peak.speed, peak.factor, nominal, nominal))
        for name, node in response.places
        for peak in _peaks(response, node)
    ]


def _peaks(response: MachineResponse, node: int) -> tuple[ResponsePeak, ...]:
    amplitude = response.major_axis(node)
    least = LEAST_PEAK * float(np.max(amplitude))
    return tuple(peak for peak in response_peaks(response.speed, amplitude) if peak.amplitude >= least)


def unbalance_page(
    machine: Machine, response: MachineResponse, rising: MachineResponse | None = None
) -> ReportContent:
    """Build the report on the steady response of a machine to its unbalance, and on a run-up if asked for."""
    nominal = float(machine.speed.nominal)
    peaks = plane_peaks(response, nominal)
    unbalance = (
        Column("node", lambda row: row[0]),
        Column("unbalance", lambda row: row[1], "unbalance"),
        Column("phase from +y", lambda row: row[2], "angle"),
    )
    bode = Figure(
        bode_figure(response, nominal),
        "Half the major axis of the orbit (0 to peak) and phase lag of its forward part behind the rotor "
        "angle, in every plane; dashed: nominal speed.",
        "bode",
    )
    polar = Figure(
        polar_figure(response),
        "Forward part of the orbit at rotor angle zero, x to the right and y up; the curve runs with the "
        "speed, a loop is a resonance.",
        "polar",
    )
    shapes = Figure(
        shape_figure(response, nominal, peaks),
        "Half the major axis of the orbits along the rotor, at the nominal speed and at the peaks.",
        "deflected shapes",
    )
    run_up: tuple[Section, ...] = ()
    if rising is not None:
        caption = (
            f"The same in a run-up of {shown(rising.run_up, 'time')}: the largest amplitude comes late, and "
            "behind it the vibration that dies away beats with the unbalance."
        )
        run_up = (Section("Run-up", figures=(Figure(bode_figure(rising, nominal), caption, "run-up"),)),)
    return ReportContent(
        title=f"Unbalance response of {machine.name}",
        subtitle=f"in its {response.suspension}, nominal speed {shown(nominal, 'speed')}",
        verdict=(*_verdict(machine, response, peaks), *_rise(response, rising)),
        facts=(("machine", machine.name), ("rotordrop", __version__)),
        summary=(peak_table(peaks), table(response.unbalance, unbalance, "Unbalance")),
        sections=(
            Section("Bode and polar plots", figures=(bode, polar)),
            Section("Deflected shapes", figures=(shapes,)),
            *run_up,
        ),
    )


def _verdict(
    machine: Machine, response: MachineResponse, peaks: Sequence[PlanePeak]
) -> tuple[Statement, ...]:
    said = [
        Statement(
            f"{', '.join(one.plane for one in seen)}: the peak of {nearest.plane}, the nearest of them, at "
            f"{shown(nearest.peak.speed, 'speed')} with an amplification factor of {nearest.peak.factor:.1f} "
            f"is {100.0 * nearest.separation.margin:.1f} % from the nominal speed; API 617 asks for "
            f"{nearest.separation.asked}",
            "bad",
        )
        for seen in _modes([one for one in peaks if not one.separation.met])
        for nearest in [min(seen, key=lambda one: one.separation.margin)]
    ]
    said = said or [Statement(CLEAR, "good")]
    if machine.balance_grade is not None:
        said.append(Statement(GRADE))
    if response.suspension == "AMBs":
        said.append(Statement(SPRINGS))
    return tuple(said)


def _modes(peaks: Sequence[PlanePeak]) -> list[list[PlanePeak]]:
    """Peaks that lie within half a half-power width of each other are one mode, seen in several planes."""
    modes: list[list[PlanePeak]] = []
    for one in sorted(peaks, key=lambda one: one.peak.speed):
        last = modes[-1][-1].peak if modes else None
        if last is not None and one.peak.speed - last.speed < 0.5 * last.speed / last.factor:
            modes[-1].append(one)
        else:
            modes.append([one])
    return modes


def _rise(steady: MachineResponse, rising: MachineResponse | None) -> tuple[Statement, ...]:
    """What a run-up makes of the largest amplitude of every plane."""
    if rising is None:
        return ()
    said = []
    for name, node in rising.places:
        risen, held = rising.major_axis(node), steady.major_axis(node)
        said.append(
            Statement(
                f"{name}: in a run-up of {shown(rising.run_up, 'time')} at most "
                f"{shown(risen.max(), 'length')} at {shown(rising.speed[risen.argmax()], 'speed')}; "
                f"steady {shown(held.max(), 'length')} at "
                f"{shown(steady.speed[held.argmax()], 'speed')}"
            )
        )
    return tuple(said)


def peak_table(peaks: Sequence[PlanePeak]) -> Table:
    """Peaks of every plane with amplification factor and margin from the nominal speed."""
    columns = (
        Column("plane", lambda one: f"{one.plane}, node {one.node}"),
        Column("peak at", "peak.speed", "speed"),
        Column("0 to peak", "peak.amplitude", "length", 3),
        Column("amplification", lambda o: "–" if math.isnan(o.peak.factor) else f"{o.peak.factor:.2f}"),
        Column("margin", lambda one: f"{100.0 * one.separation.margin:.1f} %"),
        Column("required", "separation.asked"),
        Column("API 617", "separation.verdict"),
    )
    note = "Amplification by the half-power width of the peak; margin from the nominal speed."
    return table(peaks, columns, "Peaks of the response", note)


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
            curve(
                figure,
                speed,
                values,
                name,
                row=row,
                colour=SERIES[k % len(SERIES)],
                width=1.6,
                legend=row == 1,
                customdata=(60.0 * speed).astype(np.float32),
                hover=f"%{{x:.2f}} Hz (%{{customdata:.0f}} rpm): %{{y:.4g}} {unit}",
            )
    for row in (1, 2):
        upright(figure, nominal / TURN, row=row, col=1)
    figure.update_xaxes(title_text=axis_title("rotor speed", "Hz"), row=2)
    figure.update_yaxes(title_text=axis_title("amplitude", "µm"), rangemode="tozero", row=1)
    figure.update_yaxes(title_text=axis_title("phase lag", "°"), row=2)
    return fit_legend(figure)


def polar_figure(response: MachineResponse) -> go.Figure:
    """Draw the forward part of the orbits at rotor angle zero, one curve per plane."""
    figure = panels(("",), height=430)
    for k, (name, node) in enumerate(response.places):
        forward = MICRO * _forward(response, node)
        curve(
            figure,
            forward.real,
            forward.imag,
            name,
            colour=SERIES[k % len(SERIES)],
            width=1.6,
            customdata=(response.speed / TURN).astype(np.float32),
            hover="%{customdata:.2f} Hz: %{x:.3g}, %{y:.3g} µm",
        )
    figure.update_xaxes(title_text=axis_title("x", "µm"))
    figure.update_yaxes(title_text=axis_title("y", "µm"), scaleanchor="x")
    return fit_legend(figure)


def shape_figure(response: MachineResponse, nominal: float, peaks: Sequence[PlanePeak]) -> go.Figure:
    """Draw the deflection along the rotor at the nominal speed and at the largest peaks."""
    figure = panels(("",), height=320)
    speeds = [nominal]
    for one in sorted(peaks, key=lambda one: -one.peak.amplitude):
        speed = one.peak.speed
        if all(abs(speed / other - 1.0) > 0.02 for other in speeds) and len(speeds) < MOST_SHAPES:
            speeds.append(speed)
    for k, speed in enumerate(speeds):
        at = int(np.argmin(np.abs(response.speed - speed)))
        curve(
            figure,
            MILLI * response.node_positions,
            MICRO * orbit_axis(response.displacement[at]),
            f"{response.speed[at] / TURN:.1f} Hz{' (nominal)' if k == 0 else ''}",
            colour=SERIES[k % len(SERIES)],
            width=1.6,
            hover="%{x:.0f} mm: %{y:.4g} µm",
        )
    _mark_places(figure, response)
    figure.update_xaxes(title_text=axis_title("position from node 1", "mm"))
    figure.update_yaxes(title_text=axis_title("deflection, 0 to peak", "µm"), rangemode="tozero")
    return fit_legend(figure)


def _mark_places(figure: go.Figure, response: MachineResponse) -> None:
    """Draw an upright line at every plane; planes beside each other share a label, which stays inside."""
    length = MILLI * float(response.node_positions[-1])
    groups: list[tuple[float, list[str]]] = []
    at = {name: MILLI * float(response.node_positions[node - 1]) for name, node in response.places}
    for name, position in sorted(at.items(), key=lambda pair: pair[1]):
        upright(figure, position, MUTED, "dot")
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


def unbalance_json(
    machine: Machine, response: MachineResponse, rising: MachineResponse | None = None
) -> dict[str, Any]:
    """Everything the page shows, ready for JSON, SI units."""

    def complex_json(values: Any) -> dict[str, list[float]]:
        return {"real": values.real.tolist(), "imaginary": values.imag.tolist()}

    def peak_json(peak: ResponsePeak) -> dict[str, float | None]:
        factor = None if math.isnan(peak.factor) else peak.factor
        return {
            "speed_Hz": peak.speed / TURN,
            "amplitude_m": peak.amplitude,
            "amplification_factor": factor,
        }

    content: dict[str, Any] = {
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
                "x_m": complex_json(response.at(node)[:, 0]),
                "y_m": complex_json(response.at(node)[:, 1]),
                "peaks": [peak_json(peak) for peak in _peaks(response, node)],
            }
            for name, node in response.places
        ],
    }
    if rising is not None:
        risen = unbalance_json(machine, rising)
        planes = [{key: value for key, value in one.items() if key != "peaks"} for one in risen["planes"]]
        content["run_up"] = {"duration_s": rising.run_up, "speed_Hz": risen["speed_Hz"], "planes": planes}
    return content
