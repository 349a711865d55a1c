"""The rotor drawn to scale with its discs, touchdown bearings, AMBs and sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import plotly.graph_objects as go

from rotordrop.report.style import COLOURS, MILLI, MUTED, SERIES, axis_title, curve, panels, plain

if TYPE_CHECKING:
    from rotordrop.elements.magnet import ActiveMagneticBearing
    from rotordrop.elements.sensor import Sensor
    from rotordrop.elements.touchdown_bearing import TouchdownBearing
    from rotordrop.machine import Machine

    Mounted: TypeAlias = ActiveMagneticBearing | Sensor | TouchdownBearing

SHAFT_COLOUR = "#9fb3c8"
LAYER_COLOUR = "#dbe4ec"
DRAWN_AT_LEAST = 0.02
"""Radius [m] at which bearings are drawn when the shaft is thinner."""
MARKS = {
    "touchdown bearing": ("triangle-up", COLOURS["measured"]),
    "AMB": ("square", COLOURS["simulated"]),
    "sensor": ("triangle-down", COLOURS["cross-check"]),
}


def rotor_figure(machine: Machine) -> go.Figure:
    """Draw the rotor to scale in mm from the side, NDE at the left, with everything that sits on it."""
    figure = panels([""], height=240)
    nodes, top = machine.rotor.node_positions, _top(machine)
    _add_pieces(figure, _layers(machine), "layer without stiffness", LAYER_COLOUR)
    _add_pieces(figure, _shaft(machine), "shaft", SHAFT_COLOUR)
    for index, disc in enumerate(machine.rotor.discs):
        z, reach = MILLI * nodes[disc.node - 1], 0.85 * MILLI * top
        label = plain(disc.name or f"disc {index + 1}")
        curve(
            figure,
            [z, z],
            [-reach, reach],
            "disc or point mass",
            colour=SERIES[3],
            width=5,
            legend=index == 0,
            hover=f"{label}: {float(disc.mass):.3g} kg at node {disc.node}",
        )
    for kind, parts, height in _mounted(machine):
        if parts:
            symbol, colour = MARKS[kind]
            curve(
                figure,
                [MILLI * nodes[part.node - 1] for part in parts],
                [MILLI * height] * len(parts),
                kind,
                mode="markers",
                marker={"symbol": symbol, "size": 13, "color": colour},
                customdata=[[plain(part.name), part.node] for part in parts],
                hover="%{customdata[0]}, node %{customdata[1]}, %{x:.1f} mm",
            )
    figure.update_xaxes(title_text=axis_title("position from node 1", "mm"))
    figure.update_yaxes(title_text=axis_title("radius", "mm"), scaleanchor="x", constrain="domain")
    return figure


def rotor_outline(machine: Machine) -> dict[str, Any]:
    """What the drawing consists of, ready for JSON: lengths [m] from node 1, parts with their names."""
    nodes = machine.rotor.node_positions
    return {
        "length": nodes[-1],
        "top": _top(machine),
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
            for kind, parts, height in _mounted(machine)
            for part in parts
        ],
    }


def _mounted(machine: Machine) -> tuple[tuple[str, Sequence[Mounted], float], ...]:
    """What is mounted on the rotor by kind, with the height of its marks [m]."""
    top = _top(machine)
    return (
        ("touchdown bearing", machine.touchdown_bearings, -top),
        ("AMB", machine.ambs, -1.25 * top),
        ("sensor", machine.sensors, top),
    )


def _top(machine: Machine) -> float:
    radii = [0.5 * max(e.outer_diameter, e.layer_diameter or 0.0) for e in machine.rotor.elements]
    return 1.5 * max(*radii, DRAWN_AT_LEAST)


Piece: TypeAlias = tuple[float, float, float, float]
"""Left and right end, inner and outer radius [m]."""


def _shaft(machine: Machine) -> Iterator[Piece]:
    spans = pairwise(machine.rotor.node_positions)
    for (left, right), element in zip(spans, machine.rotor.elements, strict=True):
        yield left, right, 0.5 * element.inner_diameter, 0.5 * element.outer_diameter


def _layers(machine: Machine) -> Iterator[Piece]:
    spans = pairwise(machine.rotor.node_positions)
    for (left, right), element in zip(spans, machine.rotor.elements, strict=True):
        if element.layer_diameter is not None:
            yield left, right, 0.5 * element.outer_diameter, 0.5 * element.layer_diameter


def _add_pieces(figure: go.Figure, pieces: Iterator[Piece], name: str, colour: str) -> None:
    """Draw rectangles above and below the axis, all in one trace."""
    x: list[float | None] = []
    y: list[float | None] = []
    for left, right, inner, outer in pieces:
        for side in (MILLI, -MILLI):
            x += [MILLI * left, MILLI * right, MILLI * right, MILLI * left, MILLI * left, None]
            y += [side * inner, side * inner, side * outer, side * outer, side * inner, None]
    if x:
        edge = {"color": MUTED, "width": 0.7}
        curve(figure, x, y, name, hover=None, line=edge, fill="toself", fillcolor=colour)
