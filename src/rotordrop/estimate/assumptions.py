"""What stands in for facts that a record or a machine file does not give: each said, with number and unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rotordrop.elements.race import RACE_MASS
from rotordrop.elements.table import parameter
from rotordrop.evidence.evidence import Evidence, Missing, strongest_slowing
from rotordrop.evidence.one_end import LEVITATED
from rotordrop.evidence.quality import not_seen
from rotordrop.known import NINETY
from rotordrop.physics import columns as L
from rotordrop.rotor.reduction import contact_frequency
from rotordrop.rotor.unknowns import sensor_prior, smallest_gap
from rotordrop.track.problem import DropProblem, rough_noise
from rotordrop.units import format_quantity, percent


def evidence_assumptions(evidence: Evidence) -> Iterator[str]:
    """What every method takes where the record does not say."""
    yield not_seen(evidence)
    machine = evidence.base.machine
    if evidence.record.measured_speed is None:
        most = format_quantity(strongest_slowing(evidence.base), "speed")
        yield (
            "the speed was not measured after power-off: the rotor angle, and with it the 2X runout, is that "
            f"of a rotor that loses anything from nothing to {most} a second"
        )
    if len({amb.node for amb in machine.ambs}) < 2:
        yield (
            "the AMB planes are not given: the gravity sag of the levitated rotor, which moves first peaks "
            "by several percent, is taken as 0 µm"
        )


def twin_assumptions(evidence: Evidence, problem: DropProblem) -> tuple[str, ...]:
    """What the tracked twin takes beside that: noise, settled level, first air gaps."""
    return (
        *evidence_assumptions(evidence),
        *_noise(evidence, problem),
        *_level(evidence),
        *_gaps(evidence, problem),
        *_taken_along(problem),
    )


def left_to_assumption(problem: DropProblem) -> dict[str, str]:
    """What most machine files do not state, in a few words, by the note that says more."""
    return {
        note: words
        for part in (_zeros, _plays, _gains, _lag, _races, _thrust, _air)
        for note, words in part(problem)
    }


def _taken_along(problem: DropProblem) -> Iterator[str]:
    """What the model has by the machine file alone: no sensor shows it, and no interval knows its error."""
    model = problem.model
    beyond = "it is simulated by the machine file, and the intervals do not hold an error of it"
    if model.machine.axial:
        yield f"no sensor shows the axial motion of the rotor: {beyond}"
    rows = zip(model.bearing_names, model.parameters.bearing, strict=True)
    fast = ", ".join(name for name, row in rows if row[L.FAST_SPEED_STEP] > 0.0)
    if fast:
        yield f"{fast}: the table of balls with inertia knows no other preload or grooves: {beyond}"


def _noise(evidence: Evidence, problem: DropProblem) -> Iterator[str]:
    """Channels whose noise the levitated part does not tell."""
    until = float(problem.time[-1])
    known, rough = evidence.noise(until), rough_noise(problem.readings)
    for c, sensor in enumerate(problem.model.machine.sensors):
        if np.isfinite(known[c]):
            continue
        size = format_quantity(math.sqrt(float(problem.variances[c])), "length")
        origin = "the roughness of its readings" if np.isfinite(rough[c]) else "what is usual"
        yield f"{sensor.name}: no levitated readings tell its noise; {size} (rms) is taken from {origin}"


def _gains(problem: DropProblem) -> Iterator[tuple[str, str]]:
    """Gains nobody stated: what holds them keeps an error that all sensors share from being found."""
    machine = problem.model.machine
    taken = [sensor for sensor in machine.sensors if sensor.gain.status == "default"]
    if not taken:
        return
    within = NINETY * sensor_prior(parameter("gain", "sensor"), taken[0].gain, smallest_gap(machine)).sigma
    yield (
        f"no gain given of {', '.join(sensor.name for sensor in taken)}: ±{percent(within, 1)} assumed "
        "(90 %); a larger error of all would be in forces and gaps. A range of the gain in the machine file, "
        "such as 0.8 to 1.2, has it estimated",
        f"gains ±{percent(within, 1)}",
    )


def _zeros(problem: DropProblem) -> Iterator[tuple[str, str]]:
    """Zeros of sensors on their DC gap voltage, which nobody stated."""
    known = problem.model.machine.sensors[0].offset
    if known.source == LEVITATED:
        words = f"zero where it levitates ±{format_quantity(0.5 * (known.high - known.low), 'length')}"
        yield (
            f"{words} (90 %); an offset of every sensor in the machine file, by a lift check, is better",
            words,
        )


SMALL_LOSS = 0.01
"""Loss of a peak by the lag of a sensor that is mentioned [1] (chosen)."""


def _lag(problem: DropProblem) -> Iterator[tuple[str, str]]:
    """Time constants nobody stated: a lag rounds an impact off, and stiffness and mass take that up.

    A first-order lag lowers the amplitude at an angular frequency w by half the square of w times the lag.
    """
    machine = problem.model.machine
    if all(sensor.time_constant is not None for sensor in machine.sensors):
        return
    contact = contact_frequency(machine, problem.model.fe)
    lag = math.sqrt(2.0 * SMALL_LOSS) / (2.0 * math.pi * contact)
    cut_off = 1.0 / (2.0 * math.pi * lag)
    yield (
        f"no bandwidth of the sensors given: more than {1e-3 * cut_off:.2g} kHz assumed, else peaks of these "
        f"contacts of {contact:.0f} Hz are more than {percent(SMALL_LOSS)} low; a time constant in the "
        "machine file takes it into account",
        f"sensors > {1e-3 * cut_off:.2g} kHz",
    )


def _races(problem: DropProblem) -> Iterator[tuple[str, str]]:
    """Races whose mass follows from the size of the bearing: what else spins along adds to it."""
    bearings = problem.model.machine.touchdown_bearings
    inferred = [one for one in bearings if one.race.mass.status == "inferred"]
    if not inferred:
        return
    masses = ", ".join(f"{one.name} {format_quantity(float(one.race.mass), 'mass')}" for one in inferred)
    yield (
        f"the mass of the race is inferred from the size of the bearing: {masses}, within a factor of "
        f"{RACE_MASS:g}. A carrier or sleeve that spins along is not in it, and moves the peaks of a light "
        "rotor; race.mass and race.inertia in the machine file take it into account",
        "races by bearing size",
    )


def _plays(problem: DropProblem) -> Iterator[tuple[str, str]]:
    """Play of loose races: a record shows it and the air gap together."""
    plays = problem.model.play
    if plays is None:
        return
    for b, name in enumerate(problem.model.bearing_names):
        if problem.model.play_sigma(b) > 0.0:
            taken = format_quantity(float(plays[0, b]), "length")
            yield (
                f"no drop tells the play at {name}, half the clearance and what balls give way, from the air "
                f"gap: {taken} is taken, and what is wrong with it is in the gap",
                f"{name} play under load {taken}",
            )


def _thrust(problem: DropProblem) -> Iterator[tuple[str, str]]:
    """A load along the axis that nobody stated: no sensor across the axis shows it."""
    if not problem.model.machine.axial:
        yield (
            "no axial load given; one would raise the stress, not the force. Describe it, and the face it "
            "lands on, in the machine file",
            "no axial load",
        )


def _level(evidence: Evidence) -> Iterator[str]:
    if isinstance(evidence.rest, Missing) and not isinstance(evidence.settled_level, Missing):
        yield (
            "the settled level is the mean over the tail and not the lowest point of the sway, which could "
            f"not be told: {evidence.rest.reason}"
        )


def _gaps(evidence: Evidence, problem: DropProblem) -> Iterator[str]:
    """Where the search for the air gaps begins where no tail tells them, and why there."""
    level = evidence.settled_level
    if not isinstance(level, Missing):
        return
    reach, names = evidence.reach, problem.model.bearing_names
    for b, (name, entry) in enumerate(zip(names, problem.gap_entries, strict=True)):
        begin = format_quantity(float(problem.start[entry]), "length")
        within = format_quantity(NINETY * math.sqrt(float(problem.covariance[entry, entry])), "length")
        moved = not isinstance(reach, Missing) and problem.start[entry] == reach[b]
        origin = "the reach of the first force" if moved else "the machine file"
        why = f" ({reach.reason})" if isinstance(reach, Missing) else ""
        tail = "without a tail" if evidence.tail is None else f"as the tail is not used ({level.reason}),"
        yield f"{name}: {tail} the air gap begins at {begin} ± {within} (90 %), by {origin}{why}"


def _air(problem: DropProblem) -> Iterator[tuple[str, str]]:
    if problem.model.machine.speed.aero_time_constant is not None:
        return
    unknown = next(u for u in problem.unknowns if u.sets("spin", L.AERO_TIME_CONSTANT))
    low, value, high = (math.exp(unknown.mean + k * NINETY * unknown.sigma) for k in (-1.0, 0.0, 1.0))
    yield (
        "the machine file gives no time constant of the drag of the air: it begins at "
        f"{value:.3g} s (90 %: {low:.2g} to {high:.2g} s)",
        f"air drag {value:.2g} s",
    )
