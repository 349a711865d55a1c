"""What a machine description amounts to: mass, inertias, load shares, frequencies, sag, bearings at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.elements.bearing_numbers import BearingFigure, numbers_of
from rotordrop.elements.face import UNPRESSED, Face
from rotordrop.elements.table import rows
from rotordrop.elements.thermal import heat_figures, runaway
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.machine.plausibility import Doubt, doubts
from rotordrop.physics.thermal import friction_heat, growth_of_race
from rotordrop.rotor.assembly import N_RIGID, RotorFE, build_rotor_fe, free_free_modes, modes_on_springs
from rotordrop.rotor.campbell import LEAST_FACTOR, campbell_diagram, separations
from rotordrop.rotor.magnet_loop import LoopStability, MagnetSummary, loop_of, magnet_summaries
from rotordrop.rotor.statics import bearing_load_shares, levitated_sag, rotor_on_race
from rotordrop.rotor.suspension import stiffness_of
from rotordrop.rotor.unknowns import prior
from rotordrop.units import format_quantity

SHOWN_MODES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class BearingSummary:
    """One touchdown bearing with the rotor at rest in it."""

    name: str
    """Name of the bearing."""
    load: float
    """Share of the rotor's weight [N]."""
    figures: tuple[BearingFigure, ...]
    """What the bearing states of itself: what holds it without a load, how it lies under this one."""
    contact_pressure: float
    """Hertz pressure of the rotor at rest on the race, over its whole width [Pa]."""
    deflection: float
    """Deflection of the race against the outer ring under the load [m]."""
    tangent_stiffness: float
    """Radial stiffness of the bearing at that deflection [N/m]."""
    support_frequency: float
    """Natural frequency of the support by itself, vertical [Hz], with what its mount holds beside it."""
    beside_support: tuple[str, ...]
    """What of its mount counts with the support, in small motion about the load."""
    equivalent_stiffness: float
    """Bearing and support in series [N/m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MachineSummary:
    """What a machine description amounts to."""

    fe: RotorFE
    """Finite elements of the rotor, which know mass, centre of gravity and inertias."""
    bearings: tuple[BearingSummary, ...]
    """The touchdown bearings."""
    free_free: Array
    """Lowest bending frequencies of the free rotor [Hz], shape (up to 4,)."""
    settled: Array
    """Lowest frequencies of the rotor resting in its bearings, supports without mass [Hz], shape (up to 4,).
    """
    levitated_sag: Array | None
    """Vertical displacement of the levitated rotor at the nodes [m]; None with fewer than two AMB planes,
    shape (N,)."""
    magnets: tuple[MagnetSummary, ...] = ()
    """The magnets that are described."""
    loop: LoopStability | None = None
    """Their control loop; None where an AMB has no magnet or no controller."""


def summarise_machine(machine: Machine) -> MachineSummary:
    """Compute what a machine description amounts to, to be read before any drop is trusted to it."""
    fe = build_rotor_fe(machine)
    loads = bearing_load_shares(machine, fe)
    bearings = tuple(
        _bearing(machine, bearing, float(load))
        for bearing, load in zip(machine.touchdown_bearings, loads, strict=True)
    )
    springs = {
        bearing.node: summary.equivalent_stiffness
        for bearing, summary in zip(machine.touchdown_bearings, bearings, strict=True)
    }
    levitated = len({amb.node for amb in machine.ambs}) >= 2
    return MachineSummary(
        fe=fe,
        bearings=bearings,
        free_free=free_free_modes(fe, min(fe.size, N_RIGID + SHOWN_MODES)).frequency[N_RIGID:],
        settled=modes_on_springs(fe, springs, min(fe.size, SHOWN_MODES)).frequency,
        levitated_sag=levitated_sag(fe, machine)[0::2] if levitated else None,
        magnets=magnet_summaries(machine, fe),
        loop=loop_of(machine),
    )


def _bearing(machine: Machine, bearing: TouchdownBearing, load: float) -> BearingSummary:
    numbers, face = numbers_of(bearing), bearing.face
    parts, support = stiffness_of(bearing, abs(load)), bearing.support
    figures = numbers.figures(abs(load))
    if face is not None:
        figures += tuple(numbers.axial_figures(face.law, float(face.gap), _push(machine, face)))
    figures += heat_figures(bearing, float(machine.speed.nominal))
    return BearingSummary(
        name=bearing.name,
        load=load,
        figures=figures,
        contact_pressure=float(rotor_on_race(machine, bearing).maximum_pressure(abs(load))),
        deflection=numbers.deflection(abs(load))[0],
        tangent_stiffness=parts.tangent,
        support_frequency=math.sqrt(parts.support / float(support.mass)) / (2.0 * math.pi),
        beside_support=parts.beside,
        equivalent_stiffness=parts.equivalent(),
    )


def _push(machine: Machine, face: Face) -> float:
    """Constant axial loads together [N], where they push towards a face; else zero."""
    loads = [load for load in machine.loads if load.along and load.force is not None]
    push = math.fsum(load.sense * float(load.force or 0.0) for load in loads)
    return abs(push) if push and face.stops(math.copysign(1.0, push)) else 0.0


FREQUENCY_DISTANCE = 0.15
"""Relative distance of a support frequency and a rotor mode below which they shift each other (chosen)."""

HEAT_WINDOW = 0.2
"""Time [s] over which frictional heat is added up: the part of a drop the force is estimated for."""

CRITICAL, NEAR_CRITICAL = "critical speed", 0.1
"""Kind of a warning of a critical speed, and how near to the speed one is told [1] (chosen)."""

GROWTH_SHARE = 0.1
"""Thermal growth of the race over the room it has from which heat counts (chosen)."""

ASIDE = 0.5
"""Distance of a guess from the middle of its range from which it is mentioned, in standard deviations [1]."""


@dataclass(frozen=True, kw_only=True)
class MachineWarning(Doubt):
    """One thing to know before trusting a result of this machine.

    Its kind is "limiting speed", "ball centrifugal force", "support resonance", "frictional heat", "load
    direction", "shoulder of the race", "thermal runaway", "face", "control loop", "lift", "guess off the
    middle of its range", "critical speed", or one of the doubts.
    """

    doubtful: bool = False
    """Whether the description itself looks wrong; else it is the drop model that ends there."""


def machine_warnings(
    machine: Machine, summary: MachineSummary, speed: float | None = None
) -> tuple[MachineWarning, ...]:
    """List where a machine with its summary leaves the range of the drop model at a speed [rad/s], else the
    nominal one.
    """
    omega = float(machine.speed.nominal) if speed is None else speed
    found = [MachineWarning(**vars(doubt), doubtful=True) for doubt in doubts(machine)]
    for bearing, rest in zip(machine.touchdown_bearings, summary.bearings, strict=True):
        for one in numbers_of(bearing).excesses(omega, abs(rest.load)):
            told = _warning(one.kind, bearing.name, one.value, one.limit, one.text)
            found.append(replace(told, doubtful=one.doubtful))
        found += _landing(machine, bearing)
        found += [*_resonance(rest, summary), *_heat(bearing, rest, omega), *_lifted(rest)]
        found += _guesses_aside(bearing)
    return (*_near_critical(machine, omega), *found, *_loop(summary))


def _near_critical(machine: Machine, omega: float) -> Iterator[MachineWarning]:
    """Critical speeds near a speed [rad/s] in AMBs whose stiffness was given: none by a default of ours."""
    if not machine.ambs or not all(amb.loop_is_given for amb in machine.ambs):
        return
    around = np.linspace((1.0 - NEAR_CRITICAL) * omega, (1.0 + NEAR_CRITICAL) * omega, 5)
    for one, apart in separations(campbell_diagram(machine, around, "AMBs"), omega, omega).items():
        if apart.factor >= LEAST_FACTOR:
            speed, at = (f"{one_of / (2.0 * math.pi):.4g} Hz" for one_of in (one.speed, omega))
            text = (
                f"{one.direction} critical speed {speed}, {100.0 * apart.margin:.1f} % from {at}, amplified "
                f"{apart.factor:.1f} ×"
            )
            yield _warning(CRITICAL, "AMBs", one.speed, omega, text)


def _loop(summary: MachineSummary) -> Iterator[MachineWarning]:
    loop = summary.loop
    if loop is not None and not loop.stable:
        told = _warning("control loop", summary.magnets[0].name, loop.growth, 0.0, loop.sentence())
        yield replace(told, doubtful=True)
    for one in summary.magnets:
        if one.spare_at_rest <= 0.0:
            short = format_quantity(-one.spare_at_rest, "force")
            text = (
                f"at full current it lacks {short} to lift its share of the rotor at rest in the touchdown "
                "bearings; whether all magnets together lift it, 'simulate --magnets' shows"
            )
            yield _warning("lift", one.name, one.spare_at_rest, 0.0, text)


def _landing(machine: Machine, bearing: TouchdownBearing) -> Iterator[MachineWarning]:
    if bearing.face is None:
        return
    if not any(load.along for load in machine.loads):
        yield _warning("face", bearing.name, 0.0, 0.0, f"it has a face, and {UNPRESSED}")
    if (push := _push(machine, bearing.face)) == 0.0:
        return
    excess = numbers_of(bearing).landing_excess(bearing.face.law, float(bearing.face.gap), push)
    if excess is not None:
        yield _warning(excess.kind, bearing.name, excess.value, excess.limit, excess.text)


def _resonance(rest: BearingSummary, summary: MachineSummary) -> Iterator[MachineWarning]:
    own = rest.support_frequency
    for frequency in (float(value) for value in summary.settled):
        if abs(own - frequency) > FREQUENCY_DISTANCE * frequency:
            continue
        support, rotor = format_quantity(own, "frequency"), format_quantity(frequency, "frequency")
        beside = f" with {' and '.join(rest.beside_support)}" if rest.beside_support else ""
        text = (
            f"the support by itself{beside} resonates at {support}, near the rotor's mode at {rotor} on "
            "massless supports; the mass of the support splits that mode, and maps with massless supports "
            "mislead"
        )
        yield _warning("support resonance", rest.name, own, frequency, text)


def _heat(bearing: TouchdownBearing, rest: BearingSummary, omega: float) -> Iterator[MachineWarning]:
    if (hot := runaway(bearing, omega)) is not None:
        yield _warning(hot.kind, bearing.name, hot.value, hot.limit, hot.text)
    race, radius, numbers = bearing.race, float(bearing.bore_radius), numbers_of(bearing)
    if bearing.bearing.no_race or bearing.thermal is not None:
        return
    room, against = numbers.room_to_grow()
    sliding, rolling = friction_heat(
        F_r=max(rest.load, 0.0),
        mu=float(bearing.friction.dynamic),
        omega_r=omega,
        R_i=radius,
        race_inertia=float(race.inertia),
        drag_coefficient=float(race.drag_coefficient),
        D_pw=numbers.drag_diameter,
        duration=HEAT_WINDOW,
    )
    warming, growth = growth_of_race(0.5 * sliding + rolling, float(race.mass), radius)
    if growth <= GROWTH_SHARE * room:
        return
    speed, grown, small = (
        format_quantity(omega, "speed"),
        format_quantity(growth, "length", 2),
        format_quantity(room, "length", 2),
    )
    text = (
        f"after a drop at {speed} friction heats the race by about {warming:.2g} K in {HEAT_WINDOW:g} s; "
        f"it grows by {grown}, not small against {against.format(room=small)}; a table 'thermal' "
        "puts its heat into the drop model"
    )
    yield _warning("frictional heat", bearing.name, growth, room, text)


def _guesses_aside(bearing: TouchdownBearing) -> Iterator[MachineWarning]:
    """Guesses that do not lie in the middle of their range, which an estimate takes for its centre."""
    for row in rows("bearing"):
        if not row.entries or row.ratio is not None:
            continue
        quantity = row.described(bearing)
        if quantity.status != "guess" or quantity.range is None:
            continue
        known = prior(row, quantity)
        if abs(known.start - known.mean) < ASIDE * known.sigma:
            continue
        middle = math.exp(known.mean) if row.logarithmic else known.mean
        guess, centre, low, high = (
            format_quantity(value, row.kind) for value in (float(quantity), middle, *quantity.range)
        )
        text = (
            f"{row.label}: the guess {guess} is not the middle of its range, {low} to {high}; an estimate "
            f"takes the range for the 90 % interval about {centre}, and the guess for where to begin"
        )
        yield _warning("guess off the middle of its range", bearing.name, float(quantity), middle, text)


def _lifted(rest: BearingSummary) -> Iterator[MachineWarning]:
    if rest.load >= 0.0:
        return
    text = (
        f"the rotor at rest would lift out of this bearing ({format_quantity(rest.load, 'force')}), because "
        "its centre of gravity does not lie between the bearings; check their nodes"
    )
    yield _warning("load direction", rest.name, rest.load, 0.0, text)


def _warning(kind: str, bearing: str, value: float, limit: float, text: str) -> MachineWarning:
    return MachineWarning(kind=kind, bearing=bearing, value=value, limit=limit, message=f"{bearing}: {text}")


def machine_json(
    machine: Machine, summary: MachineSummary, warnings: tuple[MachineWarning, ...]
) -> dict[str, object]:
    """Give what ``rotordrop check`` found, ready for JSON, in SI units."""
    parts = "machine free_free_Hz settled_Hz levitated_sag_m bearings"
    parts += " magnets" if summary.magnets else ""
    parts += " control_loop=loop" if summary.loop is not None else ""
    made = stated(
        summary,
        f"{parts} warnings defaults inferred",
        machine=machine.name,
        bearings={
            rest.name: {
                "load_N": rest.load,
                **{figure.field: figure.value for figure in rest.figures},
                **stated(
                    rest,
                    "contact_pressure_at_rest_Pa=contact_pressure tangent_stiffness_N_per_m "
                    "equivalent_stiffness_N_per_m support_frequency_Hz",
                ),
            }
            for rest in summary.bearings
        },
        magnets={one.name: one.as_json() for one in summary.magnets},
        warnings=[warning.message for warning in warnings],
        defaults=machine.defaults_in_use,
        inferred=machine.inferred,
    )
    return {"machine": made.pop("machine"), **summary.fe.as_json(), **made}
