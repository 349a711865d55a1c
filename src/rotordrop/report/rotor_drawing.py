"""The rotor drawn to scale with its discs, touchdown bearings, AMBs and sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import plotly.graph_objects as go

from rotordrop.report.style import COLOURS, MUTED, SERIES, axis_title, panels, plain

if TYPE_CHECKING:
    from rotordrop.machine import ActiveMagneticBearing, Machine, Sensor, TouchdownBearing

    Mounted: TypeAlias = ActiveMagneticBearing | Sensor | TouchdownBearing

MM = 1e3
SHAFT_COLOUR = "#9fb3c8"
LAYER_COLOUR = "#dbe4ec"
DRAWN_AT_LEAST = 0.02
"""Radius [m] at which bearings are drawn when the shaft is thinner."""


def rotor_figure(machine: Machine) -> go.Figure:
    """Draw the rotor in mm from the side, NDE at the left, with everything that sits on it.

    Parameters
    ----------
    machine : Machine
        The machine.

    Returns
    -------
    Figure
        One panel; shaft and layers to scale, discs as bars, all that is mounted as marks at the nodes.
    """
    figure = panels([""], height=240)
    top = _top(machine)
    _add_shape(figure, list(_layers(machine)), "layer without stiffness", LAYER_COLOUR)
    _add_shape(figure, list(_shaft(machine)), "shaft", SHAFT_COLOUR)
    _add_discs(figure, machine, top)
    _add_marks(figure, machine.touchdown_bearings, machine, "touchdown bearing", "triangle-up", -top)
    _add_marks(figure, machine.ambs, machine, "AMB", "square", -1.25 * top)
    _add_marks(figure, machine.sensors, machine, "sensor", "triangle-down", top)
    figure.update_xaxes(title_text=axis_title("position from node 1", "mm"))
    figure.update_yaxes(title_text=axis_title("radius", "mm"), scaleanchor="x", constrain="domain")
    return figure


def rotor_outline(machine: Machine) -> dict[str, Any]:
    """What the drawing consists of, ready for JSON: lengths [m] from node 1, parts with their names.

    Parameters
    ----------
    machine : Machine
        The machine.
    """
    nodes, top = machine.rotor.node_positions, _top(machine)
    mounted = (
        ("touchdown bearing", machine.touchdown_bearings, -top),
        ("AMB", machine.ambs, -1.25 * top),
        ("sensor", machine.sensors, top),
    )
    return {
        "length": nodes[-1],
        "top": top,
        "shaft": [list(piece) for piece in _shaft(machine)],
        "layers": [list(piece) for piece in _layers(machine)],
        "discs": [
            {"name": disc.name or f"disc {number}", "node": disc.node, "position": nodes[disc.node - 1]}
            for number, disc in enumerate(machine.rotor.discs, start=1)
        ],
        "marks": [
            {
                "kind": kind,
                "name": part.name,
                "node": part.node,
                "position": nodes[part.node - 1],
                "height": height,
            }
            for kind, parts, height in mounted
            for part in parts
        ],
    }


def _top(machine: Machine) -> float:
    radii = [0.5 * max(e.outer_diameter, e.layer_diameter or 0.0) for e in machine.rotor.elements]
    return 1.5 * max(*radii, DRAWN_AT_LEAST)


def _shaft(machine: Machine) -> Iterator[tuple[float, float, float, float]]:
    for (left, right), element in zip(_spans(machine), machine.rotor.elements, strict=True):
        yield left, right, 0.5 * element.inner_diameter, 0.5 * element.outer_diameter


def _layers(machine: Machine) -> Iterator[tuple[float, float, float, float]]:
    for (left, right), element in zip(_spans(machine), machine.rotor.elements, strict=True):
        if element.layer_diameter is not None:
            yield left, right, 0.5 * element.outer_diameter, 0.5 * element.layer_diameter


def _spans(machine: Machine) -> list[tuple[float, float]]:
    nodes = machine.rotor.node_positions
    return list(pairwise(nodes))


def _add_shape(
    figure: go.Figure, pieces: Sequence[tuple[float, float, float, float]], name: str, colour: str
) -> None:
    """Draw rectangles above and below the axis, all in one trace."""
    if not pieces:
        return
    x: list[float | None] = []
    y: list[float | None] = []
    for left, right, inner, outer in pieces:
        for side in (1.0, -1.0):
            x += [MM * left, MM * right, MM * right, MM * left, MM * left, None]
            y += [side * MM * r if r is not None else None for r in (inner, inner, outer, outer, inner, None)]
    figure.add_trace(
        go.Scatter(
            x=x,
            y=y,
            fill="toself",
            fillcolor=colour,
            line={"color": MUTED, "width": 0.7},
            mode="lines",
            name=name,
            hoverinfo="skip",
        )
    )


def _add_discs(figure: go.Figure, machine: Machine, top: float) -> None:
    for index, disc in enumerate(machine.rotor.discs):
        z = MM * machine.rotor.node_positions[disc.node - 1]
        label = plain(disc.name or f"disc {index + 1}")
        figure.add_trace(
            go.Scatter(
                x=[z, z],
                y=[-0.85 * MM * top, 0.85 * MM * top],
                mode="lines",
                line={"color": SERIES[3], "width": 5},
                name="disc or point mass",
                legendgroup="disc",
                showlegend=index == 0,
                hovertemplate=f"{label}: {float(disc.mass):.3g} kg at node {disc.node}<extra></extra>",
            )
        )


def _add_marks(
    figure: go.Figure, parts: Sequence[Mounted], machine: Machine, name: str, symbol: str, height: float
) -> None:
    if not parts:
        return
    nodes = [part.node for part in parts]
    names = [plain(part.name) for part in parts]
    colours = {
        "touchdown bearing": COLOURS["measured"],
        "AMB": COLOURS["simulated"],
        "sensor": COLOURS["cross-check"],
    }
    figure.add_trace(
        go.Scatter(
            x=[MM * machine.rotor.node_positions[node - 1] for node in nodes],
            y=[MM * height] * len(nodes),
            mode="markers",
            marker={"symbol": symbol, "size": 13, "color": colours[name]},
            name=name,
            customdata=[[label, node] for label, node in zip(names, nodes, strict=True)],
            hovertemplate=f"{name} %{{customdata[0]}}, node %{{customdata[1]}}, %{{x:.1f}} mm<extra></extra>",
        )
    )
