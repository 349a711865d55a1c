"""The rotor in characters: its outline to scale, and where bearings, AMBs and sensors sit."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotordrop.elements.rotor import Element
    from rotordrop.machine import Machine

WIDTH = 96
HALF_ROWS = 3
SHAFT, LAYER, DISC = "█", "░", "┃"


def rotor_lines(machine: Machine, width: int = WIDTH) -> list[str]:
    """Draw the rotor as lines of text, NDE at the left.

    Full blocks are the shaft, light ones layers without stiffness, bars discs. Below stand the marks:
    ``▲`` touchdown bearing, ``M`` AMB, ``s`` sensor plane.
    """
    columns = [_column(machine, (i + 0.5) / width) for i in range(width)]
    for disc in machine.rotor.discs:
        columns[_place(machine, disc.node, width)] = DISC * (2 * HALF_ROWS + 1)
    picture = ["".join(column[row] for column in columns).rstrip() for row in range(2 * HALF_ROWS + 1)]
    marks = [
        _mark_line(machine, [bearing.node for bearing in machine.touchdown_bearings], "▲", width),
        _mark_line(machine, [amb.node for amb in machine.ambs], "M", width),
        _mark_line(machine, [sensor.node for sensor in machine.sensors], "s", width),
    ]
    legend = "█ shaft  ░ layer  ┃ disc  ▲ touchdown bearing  M AMB  s sensor plane"
    return [*picture, *(line for line in marks if line), legend]


def _column(machine: Machine, fraction: float) -> str:
    element = _element_at(machine, fraction)
    reach = max(max(e.outer_diameter, e.layer_diameter or 0.0) for e in machine.rotor.elements)
    rows = []
    for row in range(-HALF_ROWS, HALF_ROWS + 1):
        diameter = reach * abs(row) / HALF_ROWS * 0.95
        layer = diameter < (element.layer_diameter or 0.0)
        rows.append(SHAFT if diameter < element.outer_diameter else LAYER if layer else " ")
    return "".join(rows)


def _element_at(machine: Machine, fraction: float) -> Element:
    nodes = machine.rotor.node_positions
    z = nodes[0] + fraction * (nodes[-1] - nodes[0])
    index = next(i for i in range(len(nodes) - 1) if z <= nodes[i + 1])
    return machine.rotor.elements[index]


def _place(machine: Machine, node: int, width: int) -> int:
    nodes = machine.rotor.node_positions
    fraction = (nodes[node - 1] - nodes[0]) / (nodes[-1] - nodes[0])
    return min(width - 1, int(fraction * width))


def _mark_line(machine: Machine, nodes: list[int], mark: str, width: int) -> str:
    line = [" "] * width
    for node in nodes:
        line[_place(machine, node, width)] = mark
    return "".join(line).rstrip()
