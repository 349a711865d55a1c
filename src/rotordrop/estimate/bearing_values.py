"""Values of one bearing that follow from its identified parameters, whichever method identified them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.table import following, parameter, published
from rotordrop.estimate.estimate import FittedParameter
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine


def bearing_values(
    machine: Machine, b: int, load: float, found: Sequence[FittedParameter]
) -> dict[str, Known]:
    """Values of one bearing under its static load [N], by the field names of the published document."""
    bearing = machine.touchdown_bearings[b]
    own = {one.row.field: one.estimate for one in found if one.owner == bearing.name}
    values = {field: own[field] for field in published() if field in own}
    for row, path, by in following():  # a bearing described without friction has none to find
        if (of := parameter(path).field) in values:
            values[row.field] = by(bearing, values[of])
    support, preload = values["support.stiffness_N_per_m"], values.get("preload_N")
    values["equivalent_stiffness_N_per_m"] = equivalent_stiffness(machine, b, load, support, preload)
    return values


def equivalent_stiffness(
    machine: Machine, b: int, load: float, support: Known, preload: Known | None
) -> Known:
    """Support and bearing in series [N/m], the bearing by its tangent at its static load [N].

    What holds the balls is not well known, the preload from the record or a clearance from the machine file,
    and the interval holds it beside that of the support.
    """
    bearing = machine.touchdown_bearings[b]
    path = "preload" if preload is not None else "clearance"
    held = preload if preload is not None else getattr(bearing.bearing, path, None)

    def races(value: float) -> float:
        changed = machine.with_values({f"{bearing.name}.bearing.{path}": value})
        return numbers_of(changed.touchdown_bearings[b]).tangent_stiffness(load)

    within = (held.interval_90 or getattr(held, "range", None)) if held is not None else None
    own = numbers_of(bearing).tangent_stiffness(load) if held is None else races(float(held))
    softer, stiffer = (own, own) if within is None else sorted(map(races, within))
    value = _series(support.value, own)
    low, high = support.interval_90 or (support.value, support.value)
    # two springs in series: their errors count as independent, each by the ends of its own interval
    down = math.hypot(value - _series(low, own), value - _series(support.value, softer))
    up = math.hypot(_series(high, own) - value, _series(support.value, stiffer) - value)
    return replace(
        support,
        value=value,
        interval_90=(value - down, value + up),
        standard_error=(down + up) / (2.0 * NINETY),
        start=None,
    )


def _series(one: float, other: float) -> float:
    return one * other / (one + other)
