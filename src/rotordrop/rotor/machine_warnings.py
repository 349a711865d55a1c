"""Where a machine leaves what the drop model was made for: each warning with the two numbers it compares."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.table import rows
from rotordrop.machine.plausibility import doubts
from rotordrop.physics.thermal import friction_heat, growth_of_race
from rotordrop.rotor.machine_summary import BearingSummary, MachineSummary
from rotordrop.rotor.unknowns import prior
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.machine import Machine, TouchdownBearing

FREQUENCY_DISTANCE = 0.15
"""Relative distance of a support frequency and a rotor mode below which they shift each other."""

HEAT_WINDOW = 0.2
"""Time [s] over which frictional heat is added up: the part of a drop the force is estimated for."""

GROWTH_SHARE = 0.1
"""Thermal growth of the race over the room it has from which heat counts."""

ASIDE = 0.5
"""Distance of a guess from the middle of its range from which it is mentioned, in standard deviations [1]."""


@dataclass(frozen=True, kw_only=True)
class MachineWarning:
    """One thing to know before trusting a result of this machine."""

    kind: str
    """"limiting speed", "ball centrifugal force", "support resonance", "frictional heat", "load direction",
    "guess", or one of the doubts about the description itself."""
    bearing: str
    """Name of the touchdown bearing, or of the part of the machine."""
    value: float
    limit: float
    """The two numbers compared, SI units."""
    message: str
    """What it means."""
    doubtful: bool = False
    """Whether the description itself looks wrong; else it is the drop model that ends there."""


def machine_warnings(
    machine: Machine, summary: MachineSummary, speed: float | None = None
) -> tuple[MachineWarning, ...]:
    """List where a machine leaves the range of the drop model.

    Parameters
    ----------
    machine : Machine
        The machine.
    summary : MachineSummary
        What `summarise_machine` gave for it.
    speed : float, optional
        Speed at the drop [rad/s]; the nominal speed by default.
    """
    omega = float(machine.speed.nominal) if speed is None else speed
    found = [MachineWarning(**vars(doubt), doubtful=True) for doubt in doubts(machine)]
    for bearing, rest in zip(machine.touchdown_bearings, summary.bearings, strict=True):
        found += _excesses(bearing, rest, omega)
        found += [*_resonance(rest, summary), *_heat(bearing, rest, omega), *_lifted(rest)]
        found += _guesses_aside(bearing)
    return tuple(found)


def _excesses(bearing: TouchdownBearing, rest: BearingSummary, omega: float) -> Iterator[MachineWarning]:
    for excess in numbers_of(bearing).excesses(omega, abs(rest.load)):
        told = _warning(excess.kind, bearing.name, excess.value, excess.limit, excess.text)
        yield replace(told, doubtful=excess.doubtful)


def _resonance(rest: BearingSummary, summary: MachineSummary) -> Iterator[MachineWarning]:
    own = rest.support_frequency
    for frequency in (float(value) for value in summary.settled):
        if abs(own - frequency) > FREQUENCY_DISTANCE * frequency:
            continue
        support, rotor = format_quantity(own, "frequency"), format_quantity(frequency, "frequency")
        text = (
            f"the support by itself resonates at {support}, near the rotor's mode at {rotor} on massless "
            "supports; the mass of the support splits that mode, and maps with massless supports mislead"
        )
        yield _warning("support resonance", rest.name, own, frequency, text)


def _heat(bearing: TouchdownBearing, rest: BearingSummary, omega: float) -> Iterator[MachineWarning]:
    race, radius, numbers = bearing.race, float(bearing.bore_radius), numbers_of(bearing)
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
    room, against = numbers.room_to_grow()
    if growth <= GROWTH_SHARE * room:
        return
    speed, grown, small = (
        format_quantity(omega, "speed"),
        format_quantity(growth, "length", 2),
        format_quantity(room, "length", 2),
    )
    text = (
        f"after a drop at {speed} friction heats the race by about {warming:.2g} K in {HEAT_WINDOW:g} s; "
        f"it grows by {grown}, not small against {against.format(room=small)}; the drop model has no heat in "
        "it"
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
        yield _warning("guess", bearing.name, float(quantity), middle, text)


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
