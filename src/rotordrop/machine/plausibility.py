"""What looks odd in a description by itself, each doubt with the two numbers it compares."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from rotordrop.elements.description import Description
from rotordrop.elements.magnet import ActiveMagneticBearing
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.values import LEFT_OUT
from rotordrop.known import Known
from rotordrop.machine.machine import Machine
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
    yield _doubt("air gap", bearing.name, gap, limit, text)


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
    yield _doubt("rotor radius", bearing.name, radius, nearest, text)


def _friction(bearing: TouchdownBearing) -> Iterator[Doubt]:
    static, dynamic = bearing.friction.static.value, bearing.friction.dynamic.value
    if static < dynamic:
        text = f"static friction {static:g} is smaller than dynamic friction {dynamic:g}; interchanged?"
        yield _doubt("friction", bearing.name, static, dynamic, text)
    smoothing = bearing.friction.smoothing_speed.value
    if smoothing < LEAST_SMOOTHING_SPEED:
        shown = format_quantity(smoothing, "velocity")
        text = (
            f"friction smoothed below {shown} only makes a drop slow to compute; "
            f"{format_quantity(LEAST_SMOOTHING_SPEED, 'velocity')} or more does for drops"
        )
        yield _doubt("smoothing speed", bearing.name, smoothing, LEAST_SMOOTHING_SPEED, text)


def _damping(bearing: TouchdownBearing) -> Iterator[Doubt]:
    time = bearing.damping_time.value
    least, most = USUAL_DAMPING_TIME
    if least <= time <= most:
        return
    text = (
        f"bearing damping over stiffness is {format_quantity(time, 'time')}, outside "
        f"{1e6 * least:g} to {1e6 * most:g} µs of Neisi 2020"
    )
    yield _doubt("bearing damping", bearing.name, time, least if time < least else most, text)


def _oddities(bearing: TouchdownBearing) -> Iterator[Doubt]:
    for kind, value, limit, text in bearing.bearing.oddities(bearing.bore_radius.value):
        yield _doubt(kind, bearing.name, value, limit, text)


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """Something that looks odd in a description."""

    kind: str
    """"air gap", "rotor radius", "friction", "smoothing speed", "bearing damping", "preload", or the name of
    the entry that no machine of the field has so."""
    bearing: str
    """Name of the touchdown bearing, or of the part of the machine."""
    value: float
    limit: float
    """The two numbers compared, SI units."""
    message: str
    """What it means and what to look at."""


SURFACE_SPEED = 700.0
"""Speed of the surface [m/s] no rotor of steel or titanium withstands: its hoop stress ρ v² is 3.8 GPa."""

SLENDERNESS = 120.0
"""Length of a rotor over the diameter of one of its sections from which that section is no shaft."""


def unusual_values(machine: Machine) -> Iterator[Doubt]:
    """List values far outside of what machines of the field have."""
    yield from _walk(machine, "machine")
    yield from _of_the_rotor(machine)
    yield from _of_the_sensors(machine)
    for amb in machine.ambs:
        yield from _of_the_amb(machine, amb)
    for bearing in machine.touchdown_bearings:
        yield from _of_the_ring(machine, bearing)
        yield from _of_the_support(machine, bearing)


def _walk(part: Description, name: str) -> Iterator[Doubt]:
    """Compare every entry of a description, and of what it is made of, with its bounds."""
    own = getattr(part, "name", None)
    name = own if isinstance(own, str) and own and not isinstance(part, Machine) else name
    for field in type(part).model_fields:
        value = getattr(part, field)
        if isinstance(value, Known):
            yield from _bounded(part, field, value, name)
        for item, called in _inside(value, f"{name} {field}" if name == "machine" else name):
            yield from _walk(item, called)


def _inside(value: Any, name: str) -> Iterator[tuple[Description, str]]:
    if isinstance(value, Description):
        yield value, name
    elif isinstance(value, tuple):
        yield from ((item, name) for item in value if isinstance(item, Description))
    elif isinstance(value, dict):
        yield from ((item, str(key)) for key, item in value.items() if isinstance(item, Description))


def _bounded(part: Description, field: str, value: Known, name: str) -> Iterator[Doubt]:
    usual = part.usual.get(field)
    if usual is None or value is LEFT_OUT:
        return
    label = usual.label or field.replace("_", " ")
    yield from _outside(label, name, value.value, usual.least, usual.most, usual.kind, usual.look)


def doubts_of_speed(machine: Machine, speed: float, label: str = "speed") -> Iterator[Doubt]:
    """A doubt about a speed [rad/s] at which no rotor of this diameter holds together."""
    widest = max(e.layer_diameter or e.outer_diameter for e in machine.rotor.elements)
    surface = 0.5 * widest * abs(speed)
    if surface > SURFACE_SPEED:
        text = (
            f"a {label} of {format_quantity(speed, 'speed')} gives the diameter of {_length(widest)} "
            f"a surface speed of {surface:.4g} m/s, and no rotor withstands "
            f"more than about {SURFACE_SPEED:g} m/s; check the unit (Hz or rpm)"
        )
        yield _doubt(label, "machine", surface, SURFACE_SPEED, text)


def _of_the_rotor(machine: Machine) -> Iterator[Doubt]:
    rotor, length = machine.rotor, machine.rotor.node_positions[-1]
    yield from doubts_of_speed(machine, machine.speed.nominal.value, "nominal speed")
    for number, element in enumerate(rotor.elements, start=1):
        if not length / SLENDERNESS <= element.outer_diameter <= 2.0 * length:
            text = (
                f"the shaft between nodes {number} and {number + 1} has a diameter of "
                f"{_length(element.outer_diameter)} on a rotor of {_length(length)} length; check the unit"
            )
            yield _doubt("outer diameter", "rotor", element.outer_diameter, length / SLENDERNESS, text)
            break
    shaft = rotor.mass - math.fsum(disc.mass.value for disc in rotor.discs)
    for disc in rotor.discs:
        name = disc.name or f"disc at node {disc.node}"
        yield from _outside(
            "mass", name, disc.mass.value, 0.0, 20.0 * shaft, "mass", f"the shaft weighs {shaft:.3g} kg"
        )
    gravity = machine.gravity.value
    if not 9.7 <= gravity <= 9.9:
        text = f"gravity is {gravity:.4g} m/s²; it is 9.81 m/s² everywhere on earth, along the vertical"
        yield _doubt("gravity", "machine", gravity, 9.81, text)
    grade = machine.balance_grade
    if grade is not None:
        look = "turbomachines have G 0.4 to G 6.3; ISO 21940-11 ends at G 4000"
        yield from _outside("balance grade", "machine", grade.grade_mm_s, 0.02, 4000.0, "dimensionless", look)


def _of_the_sensors(machine: Machine) -> Iterator[Doubt]:
    gap = max(bearing.air_gap.value for bearing in machine.touchdown_bearings)
    for sensor in machine.sensors:
        yield from _outside(
            "offset", sensor.name, abs(sensor.offset.value), 0.0, 4.0 * gap, "length", "four air gaps"
        )
    for one, other in combinations(machine.sensors, 2):
        apart = abs(math.remainder(one.angle.value - other.angle.value, math.pi))
        if one.node == other.node and 1e-9 < apart < math.radians(20.0):
            text = (
                f"sensors {one.name} and {other.name} of one plane stand {math.degrees(apart):.3g}° apart; "
                "90° is usual: check their angles"
            )
            yield _doubt("angle", one.name, apart, math.radians(20.0), text)


def _of_the_amb(machine: Machine, amb: ActiveMagneticBearing) -> Iterator[Doubt]:
    share = machine.rotor.mass / max(1, len(machine.ambs))
    if amb.stiffness is LEFT_OUT or amb.stiffness.value <= 0.0:
        return
    own = math.sqrt(amb.stiffness.value / share) / (2.0 * math.pi)
    if not 1.0 <= own <= 2e3:
        text = (
            f"a stiffness of {format_quantity(amb.stiffness.value, 'stiffness')} makes its share of the "
            f"rotor swing at {own:.3g} Hz; levitated rotors swing at 10 to 200 Hz"
        )
        yield _doubt("stiffness", amb.name, own, 2e3 if own > 2e3 else 1.0, text)


def _of_the_ring(machine: Machine, bearing: TouchdownBearing) -> Iterator[Doubt]:
    radius, race = bearing.bore_radius.value, bearing.race
    reach = math.sqrt(race.inertia.value / race.mass.value)
    text_of_ring = (
        f"inertia over mass of the race puts its mass at a radius of {_length(reach)}, and its bore has "
        f"{_length(radius)}; check both"
    )
    if not 0.5 * radius <= reach <= 4.0 * radius:
        yield _doubt("race inertia", bearing.name, reach, radius, text_of_ring)
    ratio = race.mass.value / machine.rotor.mass
    look = f"the rotor weighs {machine.rotor.mass:.3g} kg"
    least, most = 1e-5 * machine.rotor.mass, machine.rotor.mass
    if not 1e-5 <= ratio <= 1.0:
        yield from _outside("race mass", bearing.name, race.mass.value, least, most, "mass", look)


def _of_the_support(machine: Machine, bearing: TouchdownBearing) -> Iterator[Doubt]:
    gap, support = bearing.air_gap.value, bearing.support
    weight = machine.rotor.mass * 9.81 / len(machine.touchdown_bearings)
    sag = weight / support.stiffness.value
    if not 1e-5 * gap <= sag <= 2.0 * gap:
        text = (
            f"its support of {format_quantity(support.stiffness.value, 'stiffness')} gives way by "
            f"{_length(sag)} under its share of the weight, in an air gap of {_length(gap)}; check the unit"
        )
        limit = 1e-5 * gap if sag < gap else 2.0 * gap
        yield _doubt("support stiffness", bearing.name, sag, limit, text)
    least, most = 1e-4 * machine.rotor.mass, 1e3 * machine.rotor.mass
    look = f"the rotor weighs {machine.rotor.mass:.3g} kg; a tiny mass also makes a drop slow to compute"
    yield from _outside("support mass", bearing.name, support.mass.value, least, most, "mass", look)
    critical = 2.0 * math.sqrt(support.stiffness.value * support.mass.value)
    damping = support.damping.value / critical
    look = "damping over critical damping of the support by itself; elastomers reach 0.3"
    yield from _outside("support damping ratio", bearing.name, damping, 0.0, 3.0, "dimensionless", look)
    contact = bearing.contact
    pressed = (weight / contact.stiffness.value) ** (1.0 / contact.exponent.value)
    if not 1e-6 * gap <= pressed <= 0.5 * gap:
        text = (
            f"with its contact stiffness the rotor lies {_length(pressed)} deep in the race under its share "
            f"of the weight, in an air gap of {_length(gap)}; check the unit N/m^n and the exponent"
        )
        limit = 1e-6 * gap if pressed < gap else 0.5 * gap
        yield _doubt("contact stiffness", bearing.name, pressed, limit, text)


def _outside(
    label: str, place: str, value: float, least: float, most: float, kind: str, look: str
) -> Iterator[Doubt]:
    if least <= value <= most:
        return
    limit = least if value < least else most
    shown, low, high = (format_quantity(number, kind) for number in (value, least, most))
    side = f"above {high}" if value > most else f"below {low}"
    text = f"{label} {shown} lies {side}, where no machine is known; {look}"
    yield _doubt(label, place, value, limit, text)


def _length(value: float) -> str:
    return format_quantity(value, "length")


def _doubt(kind: str, place: str, value: float, limit: float, text: str) -> Doubt:
    return Doubt(kind=kind, bearing=place, value=value, limit=limit, message=f"{place}: {text}")
