"""Impacts of a path in its clearance circle: one rule for all that tell of a drop, by displacement alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.units import GRAVITY

SMOOTHING = 1e-3
"""Window of velocities [s]."""

DOWN = np.array([0.0, -1.0])
"""Direction of gravity where y points up."""

_NEAR = 0.85
"""A contact turns the rotor back at this share of the gap or beyond [1]."""

HOP = 0.05
"""A rotor that left its race by less than this share of the gap has not left it [1] (chosen)."""

_FREE, _LEAST_FREE = 0.8, 0.3
"""Least mean acceleration in a flight over that of a free body, and least of that over gravity [1] (both from
the first half of DropBench)."""

_LONGEST_FALL = 20e-3
"""The first approach is looked for so long before the first reversal [s]."""

_SHARPEST_SWING = 0.7
"""Radial acceleration over gravity above which a reversal is an impact [1]: a swing along the race and the
wrong centre of a circle give less."""

_STRETCH = 256
"""Samples that are looked at together; chosen for time."""

LASTING = 0.05
"""Contact without an impact for this long lasts [s] (chosen)."""


def shortest_flight(gap: float) -> float:
    """Shortest flight that ends in an impact [s]: gravity moves the rotor by `HOP` of the gap in it."""
    return math.sqrt(8.0 * HOP * gap / GRAVITY)


@dataclass(frozen=True, kw_only=True)
class Impacts:
    """Where a bearing turned the rotor back; K impacts, as samples of the path."""

    deepest: NDArray[np.int64]
    """Deepest point, shape (K,)."""
    touched: NDArray[np.int64]
    """Kink of the radial velocity before it, to about 0.3 ms, shape (K,)."""
    approach: Array
    rebound: Array
    """Largest radial velocity before and after, by straight lines over `SMOOTHING` [m/s], shape (K,)."""


def find_impacts(
    path: Array, rate: float, gap: float, noise: float, down: Array = DOWN, *, falls: bool = True
) -> Impacts:
    """Find the impacts of a path (N, 2) from the centre: back on the race after a flight, and turned sharply.

    A flight lasts as long as gravity needs to take the rotor off the race by `HOP` of the gap, and is
    accelerated like that of a free body. Shorter hops belong to the impact before; a rotor that swings along
    its race, or shakes with it, makes none. The first reversal of a path that begins with the fall is one.
    """
    radius = np.hypot(*path.T)
    speed = slope(radius, rate)
    shortest = shortest_flight(gap)
    early = round(0.25 * SMOOTHING * rate)  # a velocity over a window turns up to half of it before the kink
    reach = max(int(max(2e-3, 1.5 * shortest) * rate), 1)
    found: list[tuple[int, int, float, float]] = []
    before: int | None = None
    for at in peaks(radius, _NEAR * gap, max(0.5 * HOP * gap, 6.0 * noise)):
        begin = max(at - round(_LONGEST_FALL * rate), 0) if before is None else before
        fastest = begin + int(np.argmax(speed[begin : at + 1]))
        left = begin if before is None else begin + int(np.argmin(speed[begin : fastest + 1]))
        leaves = at + int(np.argmin(speed[at : at + reach + 1]))
        approach, rebound = max(float(speed[fastest]), 0.0), max(float(-speed[leaves]), 0.0)
        turned = (approach + rebound) * rate / max(leaves - fastest, 1)
        flew = (fastest - left) / rate
        hopped = float(radius[at] - np.min(radius[left : at + 1])) > 0.5 * HOP * gap
        flight = flew > shortest and hopped and turned > _SHARPEST_SWING * GRAVITY
        if flight:
            gained = float(speed[fastest] - speed[left]) / flew
            free = _free_acceleration(path, rate, gap, down, slice(left, fastest + 1))
            flight = gained > _FREE * max(free, _LEAST_FREE * GRAVITY)
        if flight or (falls and before is None):
            found.append((at, min(fastest + early, at), approach, rebound))
        before = at
    columns = list(zip(*found, strict=True)) if found else [(), (), (), ()]
    return Impacts(
        deepest=np.array(columns[0], dtype=np.int64),
        touched=np.array(columns[1], dtype=np.int64),
        approach=np.array(columns[2], dtype=np.float64),
        rebound=np.array(columns[3], dtype=np.float64),
    )


def _free_acceleration(path: Array, rate: float, gap: float, down: Array, flight: slice) -> float:
    """Mean outward acceleration of a free body that moves as the path does in a flight [m/s²]."""
    begin = max(flight.start - round(SMOOTHING * rate), 0)
    near = slice(begin, flight.stop + round(SMOOTHING * rate))
    inside = slice(flight.start - begin, flight.stop - begin)
    place, velocity = path[flight], slope(path[near], rate)[inside]
    along = place / np.maximum(np.hypot(*place.T), 1e-12)[:, None]
    across = along[:, 0] * velocity[:, 1] - along[:, 1] * velocity[:, 0]
    return float(np.mean(GRAVITY * (along @ down) + across**2 / gap))


def slope(values: Array, rate: float) -> Array:
    """Velocity by a straight line through `SMOOTHING` around every sample [m/s], shape of the values."""
    half = max(int(0.5 * SMOOTHING * rate), 1)
    index = np.arange(-half, half + 1)
    weights = -index * rate / float(np.sum(index**2))  # numpy turns the kernel round
    columns = [
        np.convolve(np.pad(column, half, mode="edge"), weights, mode="valid")
        for column in np.atleast_2d(values.T)
    ]
    return np.stack(columns, axis=-1).reshape(values.shape)


def peaks(values: Array, floor: float, least: float) -> list[int]:
    """Maxima above a floor between which the values fall by at least `least`."""
    starts = np.arange(0, len(values), _STRETCH)
    spans = zip(
        starts.tolist(),
        np.maximum.reduceat(values, starts).tolist(),
        np.minimum.reduceat(values, starts).tolist(),
        strict=True,
    )
    found: list[int] = []
    sign, at, extreme = 1.0, 0, float(values[0])
    for begin, top, bottom in spans:
        stretch = values[begin : begin + _STRETCH]
        furthest, nearest = (top, bottom) if sign > 0.0 else (-bottom, -top)
        # a stretch in which nothing can turn is passed at once: a rotor lies on its race for most of a minute
        if max(extreme, furthest) - nearest <= least:
            if furthest > extreme:
                at, extreme = begin + int(np.argmax(sign * stretch)), furthest
            continue
        for i, value in enumerate(stretch.tolist(), begin):
            if sign * value > extreme:
                at, extreme = i, sign * value
            elif extreme - sign * value > least:
                if sign > 0.0 and extreme >= floor:
                    found.append(at)
                sign, at, extreme = -sign, i, -sign * value
    return found


def lasting_from(touched: Array, end: float) -> float | None:
    """When the last of all impacts began [s]; None where that is within `LASTING` of the end."""
    return float(touched[-1]) if len(touched) and end - touched[-1] >= LASTING else None
