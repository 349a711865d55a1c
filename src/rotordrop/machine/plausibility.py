"""What looks odd in a description by itself, each doubt with the two numbers it compares."""

from __future__ import annotations

from collections.abc import Iterator

from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine.machine import Machine
from rotordrop.machine.usual_values import Doubt, unusual_values
from rotordrop.units import format_quantity

USUAL_GAP = (30e-6, 1.5e-3)
"""Air gaps of touchdown bearings [m], from small spindles to the largest machines."""

RADIUS_DISTANCE = 2e-3
"""Difference of the rotor's radius at a bearing and the shaft's outer radius there [m] that needs a word."""

LEAST_SMOOTHING_SPEED = 5e-3
"""Smoothing speed of the friction [m/s] below which a drop takes many times as many steps."""

USUAL_DAMPING_TIME = (0.25e-5, 2.5e-5)
"""Bearing damping over stiffness [s], Neisi 2020."""


def doubts(machine: Machine) -> tuple[Doubt, ...]:
    """List what looks odd in a machine file although it can be used."""
    found = list(unusual_values(machine))
    for bearing in machine.touchdown_bearings:
        found += [*_air_gap(bearing), *_rotor_radius(machine, bearing), *_friction(bearing)]
        found += [*_damping(bearing), *_oddities(bearing)]
    return tuple(found)


def _air_gap(bearing: TouchdownBearing) -> Iterator[Doubt]:
    gap = bearing.air_gap.value
    least, most = USUAL_GAP
    if least <= gap <= most:
        return
    limit = least if gap < least else most
    text = (
        f"the radial air gap of {_length(gap)} is unusual; most lie between {_length(least)} and "
        f"{_length(most)}: check the unit, and that it is not the diametral clearance"
    )
    yield _doubt("air gap", bearing, gap, limit, text)


def _rotor_radius(machine: Machine, bearing: TouchdownBearing) -> Iterator[Doubt]:
    radius = bearing.bore_radius.value - bearing.air_gap.value
    elements = machine.rotor.elements
    beside = elements[max(0, bearing.node - 2) : bearing.node]
    outer = [0.5 * (e.layer_diameter or e.outer_diameter) for e in beside]
    nearest = min(outer, key=lambda value: abs(value - radius))
    if abs(nearest - radius) <= RADIUS_DISTANCE:
        return
    text = (
        f"bore radius less air gap make a rotor radius of {_length(radius)}, but the shaft there has "
        f"{_length(nearest)}; a sleeve may explain it, else check 'bore_radius' and the node"
    )
    yield _doubt("rotor radius", bearing, radius, nearest, text)


def _friction(bearing: TouchdownBearing) -> Iterator[Doubt]:
    static, dynamic = bearing.friction.static.value, bearing.friction.dynamic.value
    if static < dynamic:
        text = f"static friction {static:g} is smaller than dynamic friction {dynamic:g}; interchanged?"
        yield _doubt("friction", bearing, static, dynamic, text)
    smoothing = bearing.friction.smoothing_speed.value
    if smoothing < LEAST_SMOOTHING_SPEED:
        shown = format_quantity(smoothing, "velocity")
        text = (
            f"friction smoothed below {shown} only makes a drop slow to compute; "
            f"{format_quantity(LEAST_SMOOTHING_SPEED, 'velocity')} or more does for drops"
        )
        yield _doubt("smoothing speed", bearing, smoothing, LEAST_SMOOTHING_SPEED, text)


def _damping(bearing: TouchdownBearing) -> Iterator[Doubt]:
    time = bearing.damping_time.value
    least, most = USUAL_DAMPING_TIME
    if least <= time <= most:
        return
    text = (
        f"bearing damping over stiffness is {format_quantity(time, 'time')}, outside "
        f"{1e6 * least:g} to {1e6 * most:g} µs of Neisi 2020"
    )
    yield _doubt("bearing damping", bearing, time, least if time < least else most, text)


def _oddities(bearing: TouchdownBearing) -> Iterator[Doubt]:
    for kind, value, limit, text in bearing.bearing.oddities(bearing.bore_radius.value):
        yield _doubt(kind, bearing, value, limit, text)


def _length(value: float) -> str:
    return format_quantity(value, "length")


def _doubt(kind: str, bearing: TouchdownBearing, value: float, limit: float, text: str) -> Doubt:
    return Doubt(kind=kind, bearing=bearing.name, value=value, limit=limit, message=f"{bearing.name}: {text}")
