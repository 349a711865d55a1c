"""What lines a machine could make in a coast-down: swing in the races, modes in contact, balls, mains."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.elements.race_bearing import numbers_of
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.physics.contact import depth_at
from rotordrop.physics.pendulum import effective_length, period_ratio, small_frequency, spin_participation
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import EquivalentStiffness, equivalent_stiffness, touchdown_supports
from rotordrop.rotor.whirl import matrices_of, whirl_modes
from rotordrop.spectrum.candidates import (
    Candidate,
    bearing_defect_candidates,
    mains_candidates,
    mode_candidate,
    order_candidates,
    pendulum_candidate,
)

HIGHEST_MODE = 1000.0
"""Highest frequency of a mode that is offered as a name [Hz] (chosen)."""
MODE_TOLERANCE = 0.06
"""How far a mode may be off [1] because supports and contacts are known roughly."""
LARGEST_SWING = 1.2
"""Amplitude [rad] up to which a swing is called a pendulum; beyond it the rotor bounces or whirls."""
_REDUCTION = Reduction(modes=12, attachment=True)
_SAME = 0.02
"""Relative distance of two modes below which one name stands for both [1] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class SwingRange:
    """Frequencies at which the settled rotor may swing in one touchdown bearing."""

    bearing: str
    """Name of the touchdown bearing."""
    length: float
    """Pendulum length: air gap, indentation, sag of race and support [m]."""
    small: float
    """Frequency of a small sliding swing [Hz]."""
    lowest: float
    highest: float
    """Frequencies possible at all: large swings with race and rotor spinning along, small sliding ones [Hz].
    """


def machine_candidates(machine: Machine, planes: dict[str, str] | None = None) -> tuple[Candidate, ...]:
    """Everything a machine is expected to show, for `rotordrop.spectrum.lines.find_lines`.

    ``planes`` names the plane in which each touchdown bearing is seen best.
    """
    swings = [
        pendulum_candidate(
            f"pendulum {swing.bearing}",
            swing.lowest,
            swing.highest,
            planes=() if planes is None or swing.bearing not in planes else (planes[swing.bearing],),
            reason=(
                f"swing in the {swing.bearing} race: length {1e6 * swing.length:.0f} µm of air gap, "
                f"indentation and sag gives {swing.small:.2f} Hz small, {swing.lowest:.2f} Hz at the largest "
                "amplitude with the race turning along"
            ),
        )
        for swing in swing_ranges(machine)
    ]
    defects = [
        candidate
        for bearing in machine.touchdown_bearings
        if (elements := numbers_of(bearing).rolling_elements()) is not None
        for candidate in bearing_defect_candidates(bearing.name, **vars(elements))
    ]
    return (*order_candidates(), *swings, *settled_modes(machine), *mains_candidates(), *defects)


def swing_ranges(machine: Machine) -> tuple[SwingRange, ...]:
    """Pendulum frequencies of every touchdown bearing, from gap, indentation, sag and race inertia."""
    inertia = build_rotor_fe(machine).polar_inertia
    parts = equivalent_stiffness(machine)
    g = float(machine.gravity)
    return tuple(
        _swing(bearing, part, inertia, g)
        for bearing, part in zip(machine.touchdown_bearings, parts, strict=True)
    )


def _swing(bearing: TouchdownBearing, part: EquivalentStiffness, inertia: float, g: float) -> SwingRange:
    indentation = depth_at(bearing.contact.law, part.load)
    race_sag = numbers_of(bearing).deflection(part.load)[0]
    sags = (indentation, race_sag, part.load / float(bearing.support.stiffness))
    gap = bearing.air_gap
    lower, upper = gap.range or (gap.lower or float(gap), gap.upper or float(gap))
    lengths = [effective_length(value, *sags) for value in (float(gap), lower, upper)]
    bore, rotor = float(bearing.bore_radius), float(bearing.bore_radius) - float(gap)
    spun = float(bearing.race.inertia) or math.inf  # without a race nothing turns
    turning = spin_participation(rotor, bore, inertia, spun)
    ratio = 1.0 + turning * g / part.load
    slowest = float(small_frequency(lengths[2], g, ratio)) / float(period_ratio(LARGEST_SWING))
    return SwingRange(
        bearing=bearing.name,
        length=lengths[0],
        small=float(small_frequency(lengths[0], g)),
        lowest=slowest,
        highest=float(small_frequency(lengths[1], g)),
    )


def settled_modes(machine: Machine) -> tuple[Candidate, ...]:
    """Modes of the rotor lying in its touchdown bearings, told by where most of the energy moves."""
    supports = touchdown_supports(machine)
    fe = build_rotor_fe(machine)
    basis = reduce_rotor(fe, _REDUCTION, [support.node for support in supports])
    modes = whirl_modes(basis, 0.0, supports)
    system = matrices_of(basis, supports)
    m, n = system.rotor_size, system.plane_size
    rotor = np.sum(np.abs(modes.vectors[:m]) ** 2 + np.abs(modes.vectors[n : n + m]) ** 2, axis=0)
    found: list[Candidate] = []
    counted = {"bending mode": 0, "support resonance": 0}
    for frequency, share, damping in zip(modes.frequency, rotor, modes.damping_ratio, strict=True):
        if frequency > HIGHEST_MODE or damping > 0.5:
            continue
        if found and abs(frequency - found[-1].value) < _SAME * frequency:
            continue
        kind = "bending mode" if share >= 0.5 else "support resonance"
        counted[kind] += 1
        found.append(
            mode_candidate(
                f"{kind} {counted[kind]} in contact",
                float(frequency),
                MODE_TOLERANCE * float(frequency),
                reason=(
                    f"model: {frequency:.1f} Hz with contact, balls and supports, {100 * share:.0f} % of the "
                    f"moving energy in the rotor, damping ratio {100 * damping:.1f} %"
                ),
            )
        )
    return tuple(found)
