"""What a machine description amounts to: mass, inertias, load shares, frequencies, sag, bearings at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.bearing_numbers import BearingFigure, numbers_of
from rotordrop.rotor.assembly import RotorFE, build_rotor_fe
from rotordrop.rotor.modes import N_RIGID, free_free_modes, modes_on_springs
from rotordrop.rotor.rotor_on_race import rotor_on_race
from rotordrop.rotor.statics import bearing_load_shares, levitated_sag

if TYPE_CHECKING:
    from rotordrop.machine import Machine, TouchdownBearing

Array = NDArray[np.float64]

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
    """Natural frequency of the support by itself, vertical [Hz]."""
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
    )


def _bearing(machine: Machine, bearing: TouchdownBearing, load: float) -> BearingSummary:
    numbers = numbers_of(bearing)
    deflection, tangent = numbers.deflection(abs(load))
    support = bearing.support
    return BearingSummary(
        name=bearing.name,
        load=load,
        figures=numbers.figures(abs(load)),
        contact_pressure=float(rotor_on_race(machine, bearing).maximum_pressure(abs(load))),
        deflection=deflection,
        tangent_stiffness=tangent,
        support_frequency=math.sqrt(float(support.stiffness) / float(support.mass)) / (2.0 * math.pi),
        equivalent_stiffness=1.0 / (1.0 / tangent + 1.0 / float(support.stiffness)),
    )
