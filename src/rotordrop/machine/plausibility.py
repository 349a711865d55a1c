"""What looks odd in a description by itself, each doubt with the two numbers it compares.

Mistyped units, swapped entries, a decimal point lost. Where a value has a scale of its own in the machine
(its weight, its gap, its size), it is compared with that, so that a 1 kg spindle and a 10 t compressor are
judged alike. Limits are wide, chosen and not measured: a doubt should be a mistake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from rotordrop.elements.description import Description
from rotordrop.elements.mount import SLIP_TRAVEL
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.values import LEFT_OUT
from rotordrop.known import Known
from rotordrop.machine.machine import Machine
from rotordrop.units import GRAVITY, format_quantity

USUAL_GAP = (30e-6, 1.5e-3)
"""Air gaps of touchdown bearings [m], from small spindles to the largest machines."""

RADIUS_DISTANCE = 2e-3
"""Difference of the rotor's radius at a bearing and the shaft's outer radius there [m], and of a face and its
ring, that needs a word (chosen)."""

LEAST_SMOOTHING_SPEED = 5e-3
"""Smoothing speed of the friction [m/s] below which a drop takes many times as many steps."""

USUAL_DAMPING_TIME = (0.25e-5, 2.5e-5)
"""Bearing damping over stiffness [s], Neisi 2020."""

SURFACE_SPEED = 700.0
"""Speed of the surface [m/s] no rotor of steel or titanium withstands: its hoop stress ρ v² is 3.8 GPa."""

SLENDERNESS = 120.0
"""Length of a rotor over the diameter of one of its sections from which that section is no shaft."""


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


def doubts(machine: Machine) -> tuple[Doubt, ...]:
    """List what looks odd in a machine file although it can be used."""
    found = list(unusual_values(machine))
    for bearing in machine.touchdown_bearings:
        found += _of_the_bearing(machine, bearing)
    return tuple(found)


def _of_the_bearing(machine: Machine, bearing: TouchdownBearing) -> Iterator[Doubt]:
    name, gap, friction = bearing.name, bearing.air_gap.value, bearing.friction
    text = (
        f"the radial air gap of {_length(gap)} is unusual; most lie between {_length(USUAL_GAP[0])} and "
        f"{_length(USUAL_GAP[1])}: check the unit, and that it is not the diametral clearance"
    )
    yield from _beyond("air gap", name, gap, *USUAL_GAP, text)
    radius = bearing.bore_radius.value - gap
    nearest = min(machine.rotor.radii_at(bearing.node), key=lambda value: abs(value - radius))
    # a beam that stands for a rotor has one diameter, and none of the rotor's seats
    if abs(nearest - radius) > RADIUS_DISTANCE and not machine.rotor.is_beam:
        text = (
            f"bore radius less air gap make a rotor radius of {_length(radius)}, but the shaft there has "
            f"{_length(nearest)}; a sleeve may explain it, else check 'bore_radius' and the node"
        )
        yield _doubt("rotor radius", name, radius, nearest, text)
    static, dynamic = friction.static.value, friction.dynamic.value
    text = f"static friction {static:g} is smaller than dynamic friction {dynamic:g}; interchanged?"
    yield from _beyond("friction", name, static, dynamic, math.inf, text)
    smoothing = friction.smoothing_speed.value
    text = (
        f"friction smoothed below {format_quantity(smoothing, 'velocity')} only makes a drop slow to "
        f"compute; {format_quantity(LEAST_SMOOTHING_SPEED, 'velocity')} or more does for drops"
    )
    yield from _beyond("smoothing speed", name, smoothing, LEAST_SMOOTHING_SPEED, math.inf, text)
    time, (least, most) = bearing.damping_time.value, USUAL_DAMPING_TIME
    text = (
        f"bearing damping over stiffness is {format_quantity(time, 'time')}, outside "
        f"{1e6 * least:g} to {1e6 * most:g} µs of Neisi 2020"
    )
    yield from _beyond("bearing damping", name, time, least, most, text)
    yield from _of_the_face(bearing)
    for kind, value, limit, text in bearing.bearing.oddities(bearing.bore_radius.value):
        yield _doubt(kind, name, value, limit, text)


def _of_the_face(bearing: TouchdownBearing) -> Iterator[Doubt]:
    """Radii of a face against those of the inner ring that has it."""
    face, bore, rim = bearing.face, bearing.bore_radius.value, bearing.bearing.rim_radius
    if face is None:
        return
    inner, outer = face.inner_radius.value, face.outer_radius.value
    text = (
        f"rotor and face touch between radii of {_length(inner)} and {_length(outer)}, and the inner ring "
        f"reaches from {_length(bore)} (its bore) to about {_length(rim)}; give 'inner_radius' and "
        "'outer_radius' of what touches there, radii and not diameters"
    )
    least, most = bore - bearing.air_gap.value - RADIUS_DISTANCE, rim + RADIUS_DISTANCE
    beyond = inner if inner < least else outer
    yield from _beyond("face radii", bearing.name, beyond, least, most, text)


def unusual_values(machine: Machine) -> Iterator[Doubt]:
    """List values far outside of what machines of the field have."""
    yield from _out_of_bounds(machine, "machine")
    yield from _of_the_rotor(machine)
    gap = max(bearing.air_gap.value for bearing in machine.touchdown_bearings)
    for sensor in machine.sensors:
        offset = abs(sensor.offset.value)
        yield from _outside("offset", sensor.name, offset, 0.0, 4.0 * gap, "length", "four air gaps")
    for one, other in combinations(machine.sensors, 2):
        apart = abs(math.remainder(one.angle.value - other.angle.value, math.pi))
        if one.node == other.node and 1e-9 < apart < math.radians(20.0):
            text = (
                f"sensors {one.name} and {other.name} of one plane stand {math.degrees(apart):.3g}° apart; "
                "90° is usual: check their angles"
            )
            yield _doubt("angle", one.name, apart, math.radians(20.0), text)
    share = machine.rotor.mass / max(1, len(machine.ambs))
    for amb in machine.ambs:
        if amb.stiffness is LEFT_OUT or amb.stiffness.value <= 0.0:
            continue
        swing = math.sqrt(amb.stiffness.value / share) / (2.0 * math.pi)
        text = (
            f"a stiffness of {format_quantity(amb.stiffness.value, 'stiffness')} makes its share of the "
            f"rotor swing at {swing:.3g} Hz; levitated rotors swing at 10 to 200 Hz"
        )
        yield from _beyond("stiffness", amb.name, swing, 1.0, 2e3, text)
    for bearing in machine.touchdown_bearings:
        yield from _against_the_weight(machine, bearing)


def _out_of_bounds(part: Description, name: str) -> Iterator[Doubt]:
    """Compare every entry of a description, and of what it is made of, with its bounds."""
    called = getattr(part, "name", None)
    name = called if isinstance(called, str) and called and not isinstance(part, Machine) else name
    for field in type(part).model_fields:
        value, usual, physical = getattr(part, field), part.usual.get(field), part.physical(field)
        if isinstance(value, Known) and usual and physical and value is not LEFT_OUT:
            label, bounds = usual.label or field.replace("_", " "), (usual.least, usual.most)
            yield from _outside(label, name, value.value, *bounds, physical.kind, usual.look)
        inside = f"{name} {field}" if name == "machine" else name
        held = value.items() if isinstance(value, dict) else [(inside, value)]
        for key, item in held:
            for one in item if isinstance(item, tuple) else (item,):
                if isinstance(one, Description):
                    yield from _out_of_bounds(one, str(key))


def doubts_of_speed(machine: Machine, speed: float, label: str = "speed") -> Iterator[Doubt]:
    """A doubt about a speed [rad/s] at which no rotor of this diameter holds together."""
    widest = max(e.layer_diameter or e.outer_diameter for e in machine.rotor.elements)
    surface = 0.5 * widest * abs(speed)
    text = (
        f"a {label} of {format_quantity(speed, 'speed')} gives the diameter of {_length(widest)} "
        f"a surface speed of {surface:.4g} m/s, and no rotor withstands "
        f"more than about {SURFACE_SPEED:g} m/s; check the unit (Hz or rpm)"
    )
    yield from _beyond(label, "machine", surface, 0.0, SURFACE_SPEED, text)


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
        name, look = disc.name or f"disc at node {disc.node}", f"the shaft weighs {shaft:.3g} kg"
        yield from _outside("mass", name, disc.mass.value, 0.0, 20.0 * shaft, "mass", look)
    gravity = machine.gravity.value
    if not 9.7 <= gravity <= 9.9:
        text = (
            f"gravity is {gravity:.4g} m/s²; it is {GRAVITY:g} m/s² everywhere on earth, along the vertical"
        )
        yield _doubt("gravity", "machine", gravity, GRAVITY, text)
    if machine.balance_grade is not None:
        grade = machine.balance_grade.grade_mm_s
        look = "turbomachines have G 0.4 to G 6.3; ISO 21940-11 ends at G 4000"
        yield from _outside("balance grade", "machine", grade, 0.02, 4000.0, "dimensionless", look)


def _against_the_weight(machine: Machine, bearing: TouchdownBearing) -> Iterator[Doubt]:
    """Race, support and contact of a bearing against the weight of the rotor and the size of the bearing."""
    name, mass, gap = bearing.name, machine.rotor.mass, bearing.air_gap.value
    support, contact = bearing.support, bearing.contact
    if "race" in bearing.masses:
        yield from _of_the_race(bearing, mass)
    look = f"the rotor weighs {mass:.3g} kg"
    weight = mass * GRAVITY / len(machine.touchdown_bearings)
    springs = {"support": ("its support", support.stiffness.value, 2.0 * gap)}
    for what, stiffness in bearing.mount.stiffnesses.items():
        springs[what] = (f"the {what} of its mount", stiffness, math.inf)
    for what, (called, stiffness, most) in springs.items():
        sag = weight / stiffness
        text = (
            f"{called}, {format_quantity(stiffness, 'stiffness')}, gives way by {_length(sag)} under its "
            f"share of the weight, in an air gap of {_length(gap)}; check the unit"
        )
        yield from _beyond(f"{what} stiffness", name, sag, 1e-5 * gap, most, text)
    yield from _of_the_ribbon(bearing)
    look += "; a tiny mass also makes a drop slow to compute"
    yield from _outside("support mass", name, support.mass.value, 1e-4 * mass, 1e3 * mass, "mass", look)
    damping = support.damping.value / (2.0 * math.sqrt(support.stiffness.value * support.mass.value))
    look = "damping over critical damping of the support by itself; elastomers reach 0.3"
    yield from _outside("support damping ratio", name, damping, 0.0, 3.0, "dimensionless", look)
    pressed = (weight / contact.stiffness.value) ** (1.0 / contact.exponent.value)
    text = (
        f"with its contact stiffness the rotor lies {_length(pressed)} deep in the race under its share "
        f"of the weight, in an air gap of {_length(gap)}; check the unit N/m^n and the exponent"
    )
    yield from _beyond("contact stiffness", name, pressed, 1e-6 * gap, 0.5 * gap, text)


def _of_the_ribbon(bearing: TouchdownBearing) -> Iterator[Doubt]:
    """The travel at which a ribbon slips, over the air gap."""
    ribbon, gap = bearing.mount.ribbon, bearing.air_gap.value
    if ribbon is None:
        return
    stiffness, force = ribbon.friction_stiffness.value, ribbon.slip_force.value
    usual, low, high = (_length(one) for one in SLIP_TRAVEL)
    text = (
        f"its ribbon of {format_quantity(stiffness, 'stiffness')} slips at "
        f"{format_quantity(force, 'force')}, after a travel of {_length(force / stiffness)}; {usual} ({low} "
        f"to {high}) are usual, and a tiny one makes a drop slow or impossible to compute: check the units "
        "of 'friction_stiffness' and 'slip_force'"
    )
    yield from _beyond("slip of the ribbon", bearing.name, force / stiffness, 1e-3 * gap, math.inf, text)


def _of_the_race(bearing: TouchdownBearing, mass: float) -> Iterator[Doubt]:
    """Inertia and mass of a race against its bore and the mass of the rotor [kg]."""
    name, radius, race = bearing.name, bearing.bore_radius.value, bearing.race
    reach = math.sqrt(race.inertia.value / race.mass.value)
    if not 0.5 * radius <= reach <= 4.0 * radius:
        text = (
            f"inertia over mass of the race puts its mass at a radius of {_length(reach)}, and its bore has "
            f"{_length(radius)}; check both"
        )
        yield _doubt("race inertia", name, reach, radius, text)
    look = f"the rotor weighs {mass:.3g} kg"
    yield from _outside("race mass", name, race.mass.value, 1e-5 * mass, mass, "mass", look)


def _outside(
    label: str, place: str, value: float, least: float, most: float, kind: str, look: str
) -> Iterator[Doubt]:
    """A doubt about a value of a kind of quantity that does not lie between two others."""
    shown, low, high = (format_quantity(number, kind) for number in (value, least, most))
    side = f"above {high}" if value > most else f"below {low}"
    text = f"{label} {shown} lies {side}, where no machine is known; {look}"
    yield from _beyond(label, place, value, least, most, text)


def _beyond(kind: str, place: str, value: float, least: float, most: float, text: str) -> Iterator[Doubt]:
    """A doubt about a value that does not lie between two others."""
    if not least <= value <= most:
        yield _doubt(kind, place, value, least if value < least else most, text)


def _doubt(kind: str, place: str, value: float, limit: float, text: str) -> Doubt:
    return Doubt(kind=kind, bearing=place, value=value, limit=limit, message=f"{place}: {text}")


def _length(value: float) -> str:
    return format_quantity(value, "length")
