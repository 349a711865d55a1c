"""What a record shows if units, clock and speed are right: a levitated rotor, and a fall one gap deep."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.events import expected_gap, fall_accelerations, nominal_gaps, planes_at_bearings
from rotordrop.evidence.levitated import MAINS, OTHER_SUPPLIES, SLOW, LevitatedModel
from rotordrop.evidence.paths import SLOWEST_FALL, drops_of, whirls_of
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.known import NINETY
from rotordrop.machine.plausibility import USUAL_GAP
from rotordrop.series import stride_of
from rotordrop.units import GRAVITY

if TYPE_CHECKING:
    from rotordrop.evidence.paths import Motion
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

PLAUSIBLE_MOTION = (0.4, 4.0)
"""Range of a channel over a drop, in air gaps; outside it a unit or gain must be wrong (chosen)."""

_FACTORS = {
    1e6: "µm taken for m, or the like",
    1e3: "µm taken for mm, or nm for µm",
    1 / 0.0254: "mil taken for mm, or the like",
    25.4: "mil and µm mixed up",
    1 / 25.4: "mil and µm mixed up",
    1e-3: "mm taken for µm, or µm for nm",
    1e-6: "m taken for µm, or the like",
}
_ORBITS = 4.0
"""Range of the second half of a record over that of its beginning from which a rotor whirls [1] (chosen)."""

_NO_FALL = 7.0
"""Acceleration of all planes over gravity from which on what is seen is no fall in the unit as read [1]:
orbits made it 0.4 to 4.2 in 29 drops, and 25.4 times that where mil and µm are mixed up."""

_FASTEST_FALL = 2.0
"""Acceleration of a plane over gravity up to which a unit makes a likely fall of a motion [1] (chosen)."""

_FEWEST_TURNS = 4.0
"""Turns of a line before the drop from which it is a speed [1]."""

_LAST_TURNS = 20.0
"""Turns before the drop by which its orbit is taken on [1] (chosen)."""

_MERGED = 0.75
"""Distance over the resolution by which the peak of a line and of another beside it may lie off the line [1]:
half of it where both merge, and what the grid of frequencies leaves open."""

_NO_HALF = 1e-3
"""Power at half the strongest line over that at it, below which the half is no line [1]."""

_USUAL_FALL = 0.7
"""Acceleration of a channel in a fall over gravity [1]: remanence holds back, sensors stand at 45 degrees."""

_POSSIBLE_FALL = (5e-3, 200.0)
"""Acceleration over gravity outside of which what is seen is no fall by any clock [1]."""

_CLEAR = 0.5
"""Logarithm by which a fall is nearer to that of a wrong clock, or of a wrong speed, where it tells the two
apart [1]: it is known to about a third."""

_UNITS_OF_SPEED = {
    60.0: "rpm taken for Hz",
    1 / 60.0: "Hz taken for rpm",
    2 * np.pi: "rad/s and Hz mixed up",
    1 / (2 * np.pi): "rad/s and Hz mixed up",
}

_LONG_ENOUGH = 0.2
"""Part of a drop that an estimate covers [s]."""
LOUD = 3e-6
"""Hum, drift and noise from which on they are worth a word [m] (chosen): 1 % of a usual air gap."""

_SLOW = 0.75
"""Share of what is left of levitated readings that a parabola in time explains, from which it drifts [1]."""

_AT_BORDER = 0.95
"""Share of the range searched for the orbit at whose end none was found near the speed [1]."""

_HUMMED, _DROWNED, _TOGETHER = 0.1, 0.15, 0.9
"""Time from the beginning that is looked at for hum [s]; its amplitude over the air gap, and the sum over the
channels over the sum of their amplitudes, from which hum hides a drop [1]: an orbit has 0.7 at sensors
that are 90° apart."""


def check_units(
    record: Record, machine: Machine, moved: Callable[[], Motion | None] = lambda: None
) -> list[Finding]:
    """Compare how far every channel moves with the air gap.

    What no unit explains is a gap of the machine file that is wrong, where the record shows another one, or a
    whirl beyond the gap, where it shows the same; only then the motion is asked for, as it costs a fit.
    """
    suspects: dict[int, list[tuple[str, float]]] = {}
    for plane, gap in zip(record.planes, nominal_gaps(machine, record).tolist(), strict=True):
        for name in plane.names:
            ratio = float(np.ptp(record.reading(name))) / gap
            if ratio > 0 and not PLAUSIBLE_MOTION[0] <= ratio <= PLAUSIBLE_MOTION[1]:
                suspects.setdefault(round(math.log10(ratio / 1.5)), []).append((name, ratio))
    if suspects and not _sinks(record):
        return []  # nothing falls: the search for the drop says so
    every = (bearing.air_gap for bearing in machine.touchdown_bearings)
    estimated = next((gap for gap in every if gap.status == "estimated"), None)
    ratios = [ratio for one in suspects.values() for _, ratio in one]
    motion = moved() if ratios and not any(map(_explaining, ratios)) else None
    if motion is not None:
        gaps = check_gaps(motion, record, machine)
        whirls = [whirl for drop in drops_of(motion) for whirl in whirls_of(motion, drop)]
        falls = float(np.median(motion.falls)) / GRAVITY  # which tells the unit, however far it whirls
        if whirls and not gaps and 1.0 / _NO_FALL < falls < _NO_FALL:
            longest = max(whirls, key=lambda whirl: abs(whirl.turns))
            return [found("beyond", ratio=max(ratios), how=longest.words)]
        if gaps and estimated is None:
            return [replace(one, severity="stop") for one in gaps]
    source = "" if estimated is None else f" ({estimated.source or 'estimated'})"
    return [_unit_finding(one, record, machine, source) for one in suspects.values()]


def _unit_finding(
    suspects: list[tuple[str, float]], record: Record, machine: Machine, source: str
) -> Finding:
    """Readings and machine file contradict each other: the unit of the one, or the gap of the other."""
    ratio = float(np.median([value for _, value in suspects]))
    words = " or ".join(f"{factor:.4g} ({_FACTORS[factor]})" for factor in _explaining(ratio))
    gaps = (f"{1e6 * float(b.air_gap):.0f} µm" for b in machine.touchdown_bearings)
    return found(
        "unit",
        channel=(name for name, _ in suspects),
        kind=None if words and not source else "wrong air gap",
        record=record.name,
        span=np.median([np.ptp(record.reading(name)) for name, _ in suspects]),
        ratio=ratio,
        sizes=", ".join(dict.fromkeys(gaps)),
        file=machine.source_path.name if machine.source_path else "the machine file",
        source=source,
        guess=f"a unit factor of {words} would explain it" if words else "no unit factor explains it",
    )


def _sinks(record: Record) -> bool:
    """Whether the readings leave the range they begin in, as in a drop of whatever size."""
    count = max(len(record.time) // 20, 8)
    first, second = record.signals[:count], record.signals[len(record.time) // 2 :]
    shift = np.abs(np.mean(second, axis=0) - np.mean(first, axis=0))
    left = np.maximum(shift, np.ptp(second, axis=0) / _ORBITS)  # or it whirls about where it began
    return float(np.median(left / np.maximum(np.ptp(first, axis=0), 1e-15))) > 1.0


def _explaining(ratio: float) -> list[float]:
    """Unit factors that would explain a motion of `ratio` air gaps, the likeliest first.

    A drop spans one to two and a half gaps, a whirl up to seven.
    """
    fitting = [factor for factor in _FACTORS if 0.7 <= ratio / factor <= 7.0]
    return sorted(fitting, key=lambda factor: abs(math.log(ratio / factor / 1.5)))


def check_gaps(motion: Motion, record: Record, machine: Machine) -> list[Finding]:
    """Compare the air gaps that the record shows by itself with those of the machine file."""
    near = sorted(planes_at_bearings(machine, record))
    stated = {number: expected_gap(machine, record.planes[number]) for number in near}
    remedy = "correct air_gap in the machine file, after a lift check where in doubt"
    return _gap_findings(motion, record, stated, "the machine file says {}", remedy)


def check_given_gap(motion: Motion, record: Record, gap: float) -> list[Finding]:
    """Compare the air gaps that the record shows by itself with one that was given by hand [m]."""
    given = dict.fromkeys(range(len(record.planes)), (gap, 0.0))
    return _gap_findings(motion, record, given, "{} was given", "leave that gap out, or correct it")


def _gap_findings(
    motion: Motion, record: Record, stated: Mapping[int, tuple[float, float]], says: str, remedy: str
) -> list[Finding]:
    """The planes whose own gap is none that is stated, by number, with its standard error [m]."""

    def written(gap: float, off: float) -> str:
        ends = f" ({1e6 * (gap - NINETY * off):.0f} to {1e6 * (gap + NINETY * off):.0f})" if off else ""
        return f"{1e6 * gap:.0f} µm{ends}"

    walls = {number: motion.paths[number].wall for number in stated}
    walls = {number: wall for number, wall in walls.items() if wall.contradicts(stated[number])}
    if not walls:
        return []
    gaps = "; of ".join(
        f"{written(wall.gap, wall.gap_error)} at {record.planes[number].bearing}, "
        + says.format(written(*stated[number]))
        for number, wall in walls.items()
    )
    names = (name for number in walls for name in record.planes[number].names)
    return [found("air-gap", channel=names, gaps=gaps, way_out=remedy)]


def check_noise(motion: Motion, record: Record) -> list[Finding]:
    """Name noise that hides impacts, where no machine file says what else is in the levitated readings."""
    return [
        found("noise", channel=plane.names, size=path.noise)
        for plane, path in zip(record.planes, motion.paths, strict=True)
        if path.noise > LOUD
    ]


def check_fall(motion: Motion) -> list[Finding]:
    """Compare how fast the planes fall with gravity: without a machine, what shows a unit that is wrong."""
    ratio = float(np.median(motion.falls)) / GRAVITY
    factor = min(_FACTORS, key=lambda one: abs(math.log(ratio / one))) if math.isfinite(ratio) else 1.0
    if min(motion.falls) < _NO_FALL * GRAVITY or factor <= 1.0:
        return []
    pairs = zip(motion.paths, motion.falls, strict=True)
    fast = ", ".join(f"{path.name} with {fall:.3g} m/s²" for path, fall in pairs)
    gaps = " and ".join(f"{1e3 * path.gap:.2g} mm" for path in motion.paths)
    words, clock = _FACTORS[factor], math.sqrt(ratio)
    return [found("unit-of-fall", ratio=ratio, fast=fast, gaps=gaps, factor=factor, words=words, clock=clock)]


def check_slow_fall(distance: float, acceleration: float) -> list[Finding]:
    """Name the unit in which a shaft that moves too slowly [m, m/s²] would fall through a usual gap.

    Readings at standstill may look like that too: nothing else tells them apart without a machine.
    """
    fitting = [
        factor
        for factor in _FACTORS
        if factor < 1.0
        and SLOWEST_FALL < acceleration / factor / GRAVITY < _FASTEST_FALL
        and USUAL_GAP[0] < distance / factor < USUAL_GAP[1]
    ]
    if not fitting:
        return []
    factor = min(fitting, key=lambda one: abs(math.log(acceleration / one / GRAVITY)))
    return [
        found(
            "unit-of-no-fall",
            distance=1e6 * distance,
            acceleration=acceleration,
            factor=factor,
            words=_FACTORS[factor],
            fallen=1e6 * distance / factor,
            falls=acceleration / factor,
            least=SLOWEST_FALL * GRAVITY,
            most=_FASTEST_FALL * GRAVITY,
        )
    ]


def check_rotation_line(record: Record, end: float, speed: float) -> list[Finding]:
    """Compare the strongest line of the levitated readings with the shaft speed, the fall with gravity."""
    line = strongest_line(record, end)
    if line is None:
        return []
    frequency, resolution, at_half = line
    expected = abs(speed) / (2 * np.pi)
    if expected < SLOW and record.speed_by_hand:
        return []  # a rotor at standstill shows hum and what its controller does
    near = max(_MERGED * resolution, 0.01 * expected)
    if abs(frequency - expected) <= near:
        return []
    if abs(frequency - 2.0 * expected) <= near and at_half > _NO_HALF:
        return []  # the second harmonic of a rotor whose first is there too
    mains = min((*MAINS, *OTHER_SUPPLIES), key=lambda supply: abs(frequency - supply))
    if abs(frequency - mains) < resolution and abs(2.0 * frequency - expected) > near:  # else 1X and its 2X
        beside = strongest_line(record, end, without=mains)
        if beside is not None and min(abs(beside[0] - k * expected) for k in (1, 2)) <= near:
            return []  # hum, which has its own name, above the line of the rotor
    if frequency * (end - float(record.time[0])) < _FEWEST_TURNS:
        return []
    return [_other_frequency(record, end, frequency, expected)]


def _other_frequency(record: Record, end: float, frequency: float, expected: float) -> Finding:
    """Say which of clock and speed is wrong: by a clock that is off by a factor a rotor falls by its square.

    The fall alone is known to about a third, by what remains of the lift; near a factor of 1 both stay open.
    """
    ratio = frequency / expected
    why = next((text for factor, text in _UNITS_OF_SPEED.items() if abs(ratio * factor - 1) < 0.05), "")
    # the orbit, which a released rotor keeps, may be faster than its fall
    waves = np.exp(2j * np.pi * frequency * (record.time - end))
    design = np.column_stack([np.ones(len(waves)), waves.real, waves.imag])
    late = (record.time < end) & (record.time > end - _LAST_TURNS / frequency)
    away = np.abs(
        record.signals - design @ np.linalg.lstsq(design[late], record.signals[late], rcond=None)[0]
    )
    reach = np.percentile(away, 98, axis=0)
    falls = [fall_accelerations(a, r, record.sampling_rate)[0] for a, r in zip(away.T, reach, strict=True)]
    share = float(np.median(falls)) / GRAVITY
    possible = _POSSIBLE_FALL[0] < share < _POSSIBLE_FALL[1]
    fallen = math.log(share / _USUAL_FALL) if possible else 0.0
    for_clock = abs(fallen) - abs(fallen - 2.0 * math.log(ratio))
    of_clock = not possible or for_clock > 0.0
    return found(
        "line",
        channel=None if of_clock else "speed",
        time=float(record.time[0]),
        kind="wrong sampling rate" if of_clock else "wrong speed unit" if why else "wrong speed",
        turns=frequency,
        expected=expected,
        ratio=ratio,
        guess=f" ({why})" if why else "",
        share=share,
        which="clock" if of_clock else "speed",
        doubt="" if possible and abs(for_clock) > _CLEAR else ", though the fall hardly tells the two apart",
    )


def strongest_line(
    record: Record, end: float, without: float | None = None
) -> tuple[float, float, float] | None:
    """Strongest line before `end` and the resolution [Hz], and the power at half of it over that at it.

    None where none stands out; a line ``without`` [Hz] is taken off before.
    """
    keep = record.time < end
    count = int(keep.sum())
    if count < 64:
        return None
    window = np.hanning(count)[:, None]
    part = record.signals[keep] - np.mean(record.signals[keep], axis=0)
    if without is not None:
        turned = 2.0 * np.pi * without * record.time[keep]
        waves = np.column_stack([np.cos(turned), np.sin(turned)])
        part = part - waves @ np.linalg.lstsq(waves, part, rcond=None)[0]
    scale = np.maximum(np.std(part, axis=0), 1e-12)
    power = np.sum(np.abs(np.fft.rfft(window * part / scale, 8 * count, axis=0)) ** 2, axis=1)
    frequencies = np.fft.rfftfreq(8 * count, 1.0 / record.sampling_rate)
    resolution = record.sampling_rate / count
    power[frequencies < 2 * resolution] = 0.0
    best = int(np.argmax(power))
    if power[best] < 50.0 * float(np.median(power[power > 0])):
        return None
    half = np.abs(frequencies - 0.5 * frequencies[best]) < resolution
    return float(frequencies[best]), resolution, float(np.max(power[half], initial=0.0) / power[best])


def check_levitated(levitated: LevitatedModel, record: Record) -> list[Finding]:
    """Look for another frequency than that of the speed, loud hum, drift and noise before the drop."""
    span = levitated.end - levitated.start
    findings = _other_clock(levitated, record, span)
    if findings:
        return findings  # what the wrong frequency leaves is no noise
    inside = (record.time >= levitated.start) & (record.time <= levitated.end)
    left = record.signals[inside] - levitated.readings(record.time[inside])
    course = np.vander((record.time[inside] - levitated.start) / span, 3)
    slow = course @ np.linalg.lstsq(course, np.nan_to_num(left), rcond=None)[0]
    drifts = np.var(slow, axis=0) > _SLOW * np.nanvar(left, axis=0)
    hum, none = levitated.hum, np.zeros(len(drifts))
    hums = none if hum is None else np.abs(levitated.amplitudes[levitated.tones.index(hum)])
    for index, name in enumerate(record.channel_names):
        noise = float(levitated.noise[index])
        if hums[index] > LOUD:
            findings.append(found("hum", channel=name, mains=hum, size=hums[index]))
        if noise > LOUD and drifts[index]:
            findings.append(found("drift", channel=name, size=np.ptp(slow[:, index]), lasts=span))
        elif noise > LOUD:
            findings.append(found("noise", channel=name, size=noise))
    return findings


def _other_clock(levitated: LevitatedModel, record: Record, span: float) -> list[Finding]:
    """An orbit that does not turn with the measured speed: clock or tacho is off by a few per cent.

    The fit of the levitated part looks for the orbit near the speed; it ends at the border where none is.
    """
    if record.measured_speed is None:
        return []
    when, readings = record.measured_speed
    readings = readings[(when >= levitated.start) & (when <= levitated.end)]
    if not len(readings) or span <= 0.0:
        return []
    speed = float(np.median(np.abs(readings))) / (2.0 * np.pi)
    off = levitated.frequency - speed
    if abs(off) < _AT_BORDER * min(0.5 / span, 0.02 * speed):
        return []
    return [found("line-aside", turns=levitated.frequency, expected=speed, off=100.0 * off / speed)]


def hum_instead_of_a_drop(record: Record, gap: float) -> list[Finding]:
    """Mains hum so large that no drop is found in it: it moves all sensors alike, which no rotor does."""
    first = record.time < record.time[0] + _HUMMED
    time, part = record.time[first], record.signals[first]
    for mains in MAINS:
        waves = np.exp(2j * np.pi * mains * time)
        tone = 2.0 * np.mean((part - np.mean(part, axis=0)) * waves.conj()[:, None], axis=0)
        size = float(np.mean(np.abs(tone)))
        if size > _DROWNED * gap and abs(np.sum(tone)) > _TOGETHER * np.sum(np.abs(tone)):
            return [found("hum-hides", channel=record.channel_names, mains=mains, size=size)]
    return []


def check_length(record: Record, drop: float, has_tail: bool) -> list[Finding]:
    """See whether the record reaches far enough behind the drop."""
    findings = []
    end = float(record.time[-1])
    if end - drop < _LONG_ENOUGH:
        findings.append(found("short", time=end, lasts=1e3 * (end - drop), covers=1e3 * _LONG_ENOUGH))
    measured = record.measured_speed
    if measured is not None and abs(float(measured[1][-1])) > 2 * np.pi and not has_tail:
        findings.append(found("turning", time=end, speed=abs(float(measured[1][-1]))))
    return findings


def first_motion(record: Record) -> tuple[int, Array]:
    """Sample by which the rotor has begun to fall, whatever units and polarities, and the level before (S,).

    Every channel is scaled by its own largest motion; half of the channels must have moved by a quarter of
    it.
    """
    first, stride = max(int(0.01 * record.sampling_rate), 8), stride_of(len(record.signals))
    level = np.mean(record.signals[:first], axis=0)
    away = np.abs(record.signals[::stride] - level)
    moved = np.median(away / np.maximum(np.max(away, axis=0), 1e-15), axis=1) > 0.25
    return stride * int(np.argmax(moved)), level
