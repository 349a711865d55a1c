"""What a line in a coast-down could be: orders, mains hum, pendulum, modes, bearing defects.

A line is named by comparing every candidate with the chance that it is none of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.physics.contact import depth_at
from rotordrop.physics.pendulum import effective_length, period_ratio, small_frequency, spin_participation
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import (
    EquivalentStiffness,
    equivalent_stiffness,
    in_series,
    touchdown_supports,
)
from rotordrop.rotor.whirl import matrices_of, whirl_modes
from rotordrop.units import percent

Kind = Literal["order", "steady"]

EQUAL_ORDER = 0.002
"""Relative tolerance of a rotor order [1] (chosen)."""

MAINS_TOLERANCE = 0.003
"""How far the mains frequency may be off [1]."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One possible source of a line, with where it would be and why."""

    name: str
    """What the line would be called."""
    family: str
    """Sources of one family are not told apart when both fit ("pendulum" of either end)."""
    kind: Kind
    """Whether it follows the rotor speed or stands still."""
    value: float
    """Order [1] or frequency [Hz]."""
    tolerance: float
    """How far the true place may be from ``value`` [same unit]."""
    reason: str
    """Where the value comes from."""
    flat: bool = False
    """Whether the source would make a flat orbit."""
    weight: float = 1.0
    """How likely the source is before the line is looked at, against other candidates [1]."""
    planes: tuple[str, ...] = ()
    """Planes in which it would be strongest; empty when it may be in any."""
    narrow: bool = False
    """Whether the source holds its frequency, as a power grid does: a broad line is then something else."""
    of_swing: bool = False
    """Whether value and tolerance are shares of the frequency of a swing that was found [1]."""


def order_candidates() -> tuple[Candidate, ...]:
    """Whole orders up to the sixth, and the half orders between them as the sign of rub.

    Source: Neisi 2020, section 5.4: 1X, 2X, 3X in all tests; 1.5X, 2.5X, 3.5X, 4.5X as rub impact.
    """
    reasons = {1.0: "unbalance and runout", 0.5: "odd multiple of half the rotor speed: sign of rub"}
    usual = "harmonic of the rotor speed: runout, misalignment, contact"
    return tuple(
        Candidate(
            name=f"{k:g}X",
            family=f"{k:g}X",
            kind="order",
            value=k,
            tolerance=EQUAL_ORDER * k,
            reason=reasons.get(k, reasons.get(k % 1.0, usual)),
        )
        for k in (0.5 * half for half in range(1, 13))
    )


def mains_candidates() -> tuple[Candidate, ...]:
    """Hum of the electrical supply [Hz] and its multiples."""
    return tuple(
        Candidate(
            name=f"mains hum {k * f:g} Hz",
            family=f"mains {f:g} Hz",
            kind="steady",
            value=k * f,
            tolerance=MAINS_TOLERANCE * k * f,
            reason=f"{'' if k == 1 else f'{k} times '}mains frequency {f:g} Hz",
            weight=1.0 if k == 1 else 0.3,
            narrow=True,
        )
        for f in (50.0, 60.0)
        for k in range(1, 7)
    )


def pendulum_candidate(
    name: str, lowest: float, highest: float, *, planes: Sequence[str] = (), reason: str = ""
) -> Candidate:
    """Swing of the settled rotor in a race, between its frequencies [Hz] at large and small amplitude."""
    return Candidate(
        name=name,
        family=PENDULUM,
        kind="steady",
        value=0.5 * (lowest + highest),
        tolerance=0.5 * (highest - lowest),
        reason=reason or f"swing in the race, {lowest:.2f} to {highest:.2f} Hz by amplitude",
        flat=True,
        planes=tuple(planes),
    )


def mode_candidate(name: str, frequency: float, tolerance: float, *, reason: str = "") -> Candidate:
    """A mode of the rotor on its touchdown bearings or of a support, at a frequency ± tolerance [Hz]."""
    return Candidate(
        name=name,
        family=name,
        kind="steady",
        value=frequency,
        tolerance=tolerance,
        reason=reason or f"model: {frequency:.1f} ± {tolerance:.1f} Hz",
    )


def bearing_defect_candidates(
    bearing: str,
    *,
    ball_count: int,
    ball_diameter: float,
    pitch_diameter: float,
    contact_angle: float,
    race_speed_ratio: tuple[float, float] = (0.98, 1.0),
    slip: float = 0.01,
    harmonics: int = 2,
) -> tuple[Candidate, ...]:
    """Ball-pass and cage frequencies of a touchdown bearing whose inner race turns, as orders of the rotor
    speed.

    Lengths are in [m], the contact angle in [rad]. The race speed ratio is its lowest and highest speed over
    that of the rotor once it rolls along, the slip how much the balls may lag behind pure rolling [1].

    Source: kinematics of rolling bearings, outer race at rest (ISO 15243 gives the same formulas).
    """
    gamma = ball_diameter / pitch_diameter * math.cos(contact_angle)
    z = ball_count
    factors: Iterable[tuple[str, float]] = (
        ("cage", 0.5 * (1.0 - gamma)),
        ("outer-race defect", 0.5 * z * (1.0 - gamma)),
        ("inner-race defect", 0.5 * z * (1.0 + gamma)),
        ("ball defect", pitch_diameter / ball_diameter * (1.0 - gamma**2)),
    )
    low, high = race_speed_ratio
    return tuple(
        Candidate(
            name=f"{bearing} {what}{'' if k == 1 else f', harmonic {k}'}",
            family=f"{bearing} {what}",
            kind="order",
            value=k * factor * 0.5 * (low + high),
            tolerance=k * factor * (0.5 * (high - low) + slip),
            reason=f"{k * factor:.3f} times the race speed, {low:.3f} to {high:.3f} of the rotor speed",
            weight=0.5,
        )
        for what, factor in factors
        for k in range(1, (1 if what == "cage" else harmonics) + 1)
    )


def harmonic_candidates(name: str, frequency: float, error: float, highest: int = 5) -> tuple[Candidate, ...]:
    """Multiples of a steady line that was found and named, e.g. of a large pendulum swing."""
    return tuple(
        Candidate(
            name=f"{name}, harmonic {k}",
            family=f"harmonic {k}",
            kind="steady",
            value=k * frequency,
            tolerance=k * error,
            reason=f"{k} times the {name} found at {frequency:.2f} Hz",
            weight=0.5 ** (k - 2),
        )
        for k in range(2, highest + 1)
    )


def mixed_candidates(names: tuple[str, str], frequencies: tuple[float, float]) -> tuple[Candidate, ...]:
    """Sums and differences of two swings that were found [Hz], to the third order: the gap is not linear."""
    found = []
    for times in ((1, 1), (1, -1), (2, -1), (-1, 2), (2, 1), (1, 2)):
        value = sum(k * frequency for k, frequency in zip(times, frequencies, strict=True))
        signed = [(k if value > 0.0 else -k, name) for k, name in zip(times, names, strict=True)]
        terms = [("" if abs(k) == 1 else f"{abs(k)} × ") + name for k, name in sorted(signed, reverse=True)]
        found.append(
            Candidate(
                name=(" + " if min(signed)[0] > 0 else " − ").join(terms),
                family=f"{times} of two swings",
                kind="steady",
                value=abs(value),
                tolerance=MIXED_TOLERANCE * float(np.dot(np.abs(times), frequencies)),
                reason=f"of the {names[0]} at {frequencies[0]:.2f} Hz and the {names[1]} at "
                f"{frequencies[1]:.2f} Hz",
                weight=0.5,
            )
        )
    return tuple(found)


HIGHEST_MODE = 1000.0
"""Highest frequency of a mode that is offered as a name [Hz] (chosen)."""
MODE_TOLERANCE = 0.06
"""How far a mode may be off [1] because supports and contacts are known roughly."""
WIDEST_MODE = 0.2
"""How far a mode may be off by what the machine file leaves open [1]; one less known is no name (chosen)."""
LARGEST_SWING = 1.2
"""Amplitude [rad] up to which a swing is called a pendulum; beyond it the rotor bounces or whirls."""
_REDUCTION = Reduction(modes=12, attachment=True)
_SAME = 0.02
"""Relative distance of two modes below which one name stands for both [1] (chosen)."""
PENDULUM = "pendulum"
CONICAL = "conical swing"
CONICAL_TOLERANCE = 0.05
"""How far its share of the pendulum's frequency may be off [1]: a swing of 1 rad is slower by 6 %."""
MIXED_TOLERANCE = 0.01
"""How far each of two swings that mix may be off from where it is strongest [1] (chosen)."""


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
        if (balls := numbers_of(bearing).balls) is not None
        for candidate in bearing_defect_candidates(
            bearing.name,
            ball_count=balls.ball_count,
            ball_diameter=float(balls.ball_diameter),
            pitch_diameter=float(balls.pitch_diameter),
            contact_angle=float(balls.contact_angle),
        )
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
    """Modes of the rotor lying in its touchdown bearings, told by where most of the energy moves.

    Along the race only the weight holds it: the two lowest horizontal modes are its swings, of which the one
    with the ends against each other is a share of the other, which a record shows. Where the machine states
    ranges of stiffness and mass, a mode is anywhere between those of the softest and the stiffest machine,
    and names nothing where these are far apart.
    """
    modes = _modes_at_rest(machine)
    corners = [_modes_at_rest(corner) for corner in _softest_and_stiffest(machine)]
    along = [mode for mode in modes if mode.horizontal]
    found = list(_conical(along[:2]))
    counted = {"bending mode": 0, "support resonance": 0}
    named: list[float] = []
    for mode in modes:
        frequency = mode.frequency
        if mode in along[:2] or frequency > HIGHEST_MODE or mode.damping > 0.5:
            continue
        if named and frequency - named[-1] < _SAME * frequency:
            continue
        named.append(frequency)
        kind = "bending mode" if mode.share >= 0.5 else "support resonance"
        counted[kind] += 1
        places = [(1.0 - MODE_TOLERANCE) * frequency, (1.0 + MODE_TOLERANCE) * frequency]
        places += [one.frequency for corner in corners for one in corner if one[1:3] == mode[1:3]]
        low, high = min(places), max(places)
        if high - low > 2.0 * WIDEST_MODE * frequency:
            continue
        found.append(
            mode_candidate(
                f"{kind} {counted[kind]} in contact",
                0.5 * (low + high),
                0.5 * (high - low),
                reason=(
                    f"model: {frequency:.1f} Hz ({low:.1f} to {high:.1f} Hz), "
                    f"{'horizontal' if mode.horizontal else 'vertical'}, {100 * mode.share:.0f} % of "
                    f"the moving energy in the rotor, damping ratio {100 * mode.damping:.1f} %"
                ),
            )
        )
    return tuple(found)


class _Mode(NamedTuple):
    """Its number among those of its direction, share of the moving energy in the rotor, ends that oppose."""

    frequency: float
    horizontal: bool
    number: int
    share: float
    damping: float
    opposed: bool


def _modes_at_rest(machine: Machine) -> list[_Mode]:
    supports = []
    parts = zip(machine.touchdown_bearings, equivalent_stiffness(machine), strict=True)
    for (bearing, part), support in zip(parts, touchdown_supports(machine), strict=True):
        first, *rest = support.links
        stiffness = first.stiffness.copy()
        stiffness[0, 0] = in_series(float(stiffness[0, 0]), part.load / float(bearing.air_gap))
        supports.append(replace(support, links=(replace(first, stiffness=stiffness), *rest)))
    basis = reduce_rotor(build_rotor_fe(machine), _REDUCTION, [support.node for support in supports])
    modes = whirl_modes(basis, 0.0, supports)
    system = matrices_of(basis, supports)
    m, n = system.rotor_size, system.plane_size
    energy = np.abs(modes.vectors) ** 2
    rotor = np.sum(energy[:m] + energy[n : n + m], axis=0)
    across = np.sum(energy[:n], axis=0) >= np.sum(energy[n:], axis=0)
    ends = modes.shapes[:, [supports[0].node - 1, supports[-1].node - 1], 0]
    rows = (
        modes.frequency,
        across,
        np.where(across, np.cumsum(across), np.cumsum(~across)),
        rotor,
        modes.damping_ratio,
        (ends[:, 0] * ends[:, 1].conj()).real < 0.0,
    )
    return [_Mode(*row) for row in zip(*(one.tolist() for one in rows), strict=True)]


def _softest_and_stiffest(machine: Machine) -> list[Machine]:
    """The machine at both ends of the ranges it states of stiffness and mass; empty where it states none."""
    factor = machine.rotor.stiffness_factor
    stated = {"rotor.stiffness_factor": None if factor is None else factor.range}
    for bearing in machine.touchdown_bearings:
        stated[f"{bearing.name}.support.stiffness"] = bearing.support.stiffness.range
        mass = bearing.support.mass.range
        stated[f"{bearing.name}.support.mass"] = None if mass is None else mass[::-1]
    ranges = {path: ends for path, ends in stated.items() if ends is not None}
    return [machine.with_values({path: ends[k] for path, ends in ranges.items()}) for k in (0, 1) if ranges]


def _conical(swings: Sequence[_Mode]) -> tuple[Candidate, ...]:
    """The swing with the ends against each other, where it is not too near the other to be told from it."""
    if len(swings) < 2 or swings[0].opposed == swings[1].opposed:
        return ()
    one, other = sorted(swings, key=lambda mode: mode.opposed)
    share = other.frequency / one.frequency
    if abs(share - 1.0) < 2.0 * CONICAL_TOLERANCE:
        return ()
    return (
        Candidate(
            name=CONICAL,
            family=CONICAL,
            kind="steady",
            value=share,
            tolerance=CONICAL_TOLERANCE,
            reason=f"the ends swing against each other: model, {share:.3f} times the pendulum",
            flat=True,
            weight=3.0,  # once the pendulum is found, another line there is hardly a second one of it
            of_swing=True,
        ),
    )


LineKind = Literal["order", "steady", "combination", "undecided"]

SURE = 0.9
"""Probability from which a line is given a candidate's name [1] (chosen)."""

WORTH_LISTING = 0.05
"""Probability from which a candidate is listed [1] (chosen)."""
UNKNOWN_WEIGHT = 10.0
"""Weight of "something not on the list", anywhere in the band, against one candidate of weight 1: with 10 a
mode known to ± 20 Hz in a band of 1 kHz is only a question, one known to ± 3 Hz a name."""

NARROW = 0.3
"""Width [Hz] up to which a line can come from a source that holds its frequency: a power grid keeps within
± 0.05 Hz."""
STEADY_ERROR = 0.1
"""Error of its mean frequency [Hz] up to which it can."""

ROUND_ORBIT = 0.8
"""Roundness of the orbit of a whirl at least [1] (chosen); 1 is a circle, 0 a line."""
FLAT_ORBIT = 0.6
"""Roundness of the path of a swing at most [1] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class LineEvidence:
    """What is known about a line when it is named."""

    kind: LineKind
    """Whether it follows the speed."""
    frequency: float
    frequency_error: float
    """[Hz]; at ``speed`` for an order."""
    order: float
    order_error: float
    """[1]."""
    roundness: float
    """(forward − backward) / (forward + backward) of its orbit [1]: 0 flat, +1 forward circle, −1 backward
    circle."""
    radius: float
    """Largest half axis of its orbit over its time [m]."""
    plane: str
    """Where it is largest."""
    band: float
    """Width of the frequency band searched [Hz]."""
    order_band: float
    """Width of the band of orders searched [1]."""
    width: float = 0.0
    """Of the line itself [Hz]."""


@dataclass(frozen=True, kw_only=True)
class Match:
    """How well a candidate explains a line."""

    candidate: Candidate
    probability: float
    """That this candidate made the line, among all candidates and none of them [1]."""
    deviation: float
    """Found minus expected [Hz], or order [1] for an order."""


@dataclass(frozen=True, kw_only=True)
class Name:
    """The name given to a line."""

    label: str
    """The name, "unnamed", or "unnamed (A or B?)"."""
    named: bool
    confidence: float
    """Probability of the name [1]; of the most likely candidate when unnamed."""
    reason: str
    matches: tuple[Match, ...]
    """Candidates worth considering, most likely first."""


def name_line(line: LineEvidence, candidates: Sequence[Candidate], *, air_gap: float | None = None) -> Name:
    """Name a line if one candidate (or one family of candidates) explains it far better than everything else.

    Every candidate's chance to put a line where this one was found is compared with that of a source not on
    the list, which could be anywhere in the band. A candidate known to ± 20 Hz therefore never names a line
    alone, one known to ± 0.2 Hz does.

    With an air gap [m] a round orbit of such size that does not follow the speed is called whirl.
    """
    whirl = _whirl(line, air_gap)
    if whirl is not None:
        return whirl
    weighed = [(c, density_of(line, c)) for c in candidates if _possible(line, c)]
    nothing = UNKNOWN_WEIGHT / (line.order_band if line.kind == "order" else line.band)
    total = nothing + sum(density for _, density in weighed)
    matches = sorted(
        (
            Match(candidate=c, probability=d / total, deviation=_found(line, c)[0] - c.value)
            for c, d in weighed
        ),
        key=lambda match: -match.probability,
    )
    listed = tuple(match for match in matches if match.probability >= WORTH_LISTING)
    if not listed:
        why = f"{_place(line)}: no candidate fits"
        if line.kind == "undecided":
            why += "; the speed changes too little to say if the line follows it"
        return Name(label="unnamed", named=False, confidence=0.0, reason=why, matches=())
    family = listed[0].candidate.family
    together = [match for match in listed if match.candidate.family == family]
    share = sum(match.probability for match in together)
    if share >= SURE:
        first, unit = together[0], "" if together[0].candidate.kind == "order" else " Hz"
        return Name(
            label=_label(together),
            named=True,
            confidence=share,
            reason=f"{_place(line)}, {first.deviation:+.3g}{unit} from expected: {first.candidate.reason}",
            matches=listed,
        )
    options = " or ".join(dict.fromkeys(match.candidate.name for match in listed))
    return Name(
        label=f"unnamed ({options}?)",
        named=False,
        confidence=share,
        reason=f"{_place(line)} fits {options}, but not surely ({percent(share)})",
        matches=listed,
    )


def _whirl(line: LineEvidence, air_gap: float | None) -> Name | None:
    if air_gap is None or line.kind == "order" or line.radius < 0.3 * air_gap:
        return None
    if abs(line.roundness) < ROUND_ORBIT:
        return None
    direction = "forward" if line.roundness > 0.0 else "backward"
    if direction == "forward" and line.kind == "undecided" and abs(line.order - 1.0) < 0.1:
        return None
    return Name(
        label=f"{direction} whirl",
        named=True,
        confidence=0.95,
        reason=(
            f"round {direction} orbit of {line.radius * 1e6:.0f} µm in an air gap of {air_gap * 1e6:.0f} µm "
            f"at {line.frequency:.2f} Hz, not locked to the rotor speed"
        ),
        matches=(),
    )


def _possible(line: LineEvidence, candidate: Candidate) -> bool:
    if candidate.of_swing or (line.kind != "undecided" and line.kind != candidate.kind):
        return False
    if candidate.narrow and (line.width > NARROW or line.frequency_error > STEADY_ERROR):
        return False
    if candidate.flat and abs(line.roundness) > FLAT_ORBIT:
        return False
    return not candidate.planes or line.plane in candidate.planes


def _found(line: LineEvidence, candidate: Candidate) -> tuple[float, float]:
    if candidate.kind == "order":
        return line.order, line.order_error
    return line.frequency, line.frequency_error


def density_of(line: LineEvidence, candidate: Candidate) -> float:
    """Weighted probability density that the candidate puts a line here [1/Hz or 1/order]."""
    value, error = _found(line, candidate)
    sigma = max(error, 1e-9)
    tolerance = max(candidate.tolerance, sigma)
    high = (value - candidate.value + tolerance) / (sigma * math.sqrt(2.0))
    low = (value - candidate.value - tolerance) / (sigma * math.sqrt(2.0))
    density = 0.5 * (math.erf(high) - math.erf(low)) / (2.0 * tolerance)
    if line.kind == "undecided" and candidate.kind == "order":
        density *= line.order / max(line.frequency, 1e-9)
    return candidate.weight * density


def _place(line: LineEvidence) -> str:
    return f"order {line.order:.4g}" if line.kind == "order" else f"{line.frequency:.2f} Hz"


def _label(together: Sequence[Match]) -> str:
    first = together[0]
    rivals = [m for m in together[1:] if m.probability > 0.2 * first.probability]
    return " or ".join(dict.fromkeys([first.candidate.name, *(m.candidate.name for m in rivals)]))
