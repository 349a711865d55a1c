"""A narrow place beside the touchdown bearings, such as a seal or a lamination, that a drop may come to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotordrop.elements.description import Misfit, Name, Placed
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.values import PositiveLength
from rotordrop.units import format_quantity


class Clearance(Placed):
    """A radial gap between rotor and housing that no force acts in: a drop is judged by how much it uses."""

    name: Name
    """Name of the place, such as "seal"."""
    gap: PositiveLength
    """Radial gap [m]."""


def check_clearances(
    clearances: Sequence[Clearance], bearings: Sequence[TouchdownBearing], nodes: Sequence[float]
) -> None:
    """Refuse a clearance that the rotor uses up before it reaches its touchdown bearings.

    ``nodes`` are the positions of the nodes [m]; between two bearings the air gap goes in a straight line.
    """
    ordered = sorted(bearings, key=lambda bearing: bearing.node)
    places = [nodes[bearing.node - 1] for bearing in ordered]
    gaps = [float(bearing.air_gap) for bearing in ordered]
    for index, clearance in enumerate(clearances):
        allowed = float(np.interp(nodes[clearance.node - 1], places, gaps))
        if float(clearance.gap) <= allowed:
            stated, reach = (format_quantity(gap, "length") for gap in (float(clearance.gap), allowed))
            raise Misfit(
                f"the clearance {clearance.name!r} of {stated} at node {clearance.node} is used up before "
                f"the rotor reaches its touchdown bearings, whose air gap is {reach} there; widen it",
                ("clearances", index, "gap"),
            )
