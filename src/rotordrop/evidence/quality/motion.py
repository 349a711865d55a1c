"""What a record shows if units, clock and speed are right: a levitated rotor, and a fall one gap deep."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import NoDropError, NothingFallsError
from rotordrop.evidence.events import expected_gap, fall_accelerations, nominal_gaps, planes_at_bearings
from rotordrop.evidence.levitated import MAINS, OTHER_SUPPLIES, LevitatedModel
from rotordrop.evidence.paths import SLOWEST_FALL
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.known import NINETY, Known
from rotordrop.machine.plausibility import USUAL_GAP
from rotordrop.series import median_of_five
from rotordrop.units import GRAVITY, format_quantity

if TYPE_CHECKING:
    from rotordrop.evidence.paths import Motion
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

PLAUSIBLE_MOTION = (0.4, 4.0)
"""Range of a channel over a drop, in air gaps; outside it a unit or gain must be wrong
(chosen)."""

_FACTORS = {
    1e6: "µm taken for m, or the like",
    1e3: "µm taken for mm, or nm for µm",
    1 / 0.0254: "mil taken for mm, or the like",
    25.4: "mil and µm mixed up",
    1 / 25.4: "mil and µm mixed up",
    1e-3: "mm taken for µm, or µm for nm",
    1e-6: "m taken for µm, or the like",
}
_NO_FALL = 7.0
"""Acceleration of all planes over gravity from which on what is seen is no fall in the unit as read [1]:
orbits made it 0.4 to 4.2 in 29 drops, and 25.4 times that where mil and µm are mixed up."""

_FASTEST_FALL = 2.0
"""Acceleration of a plane over gravity up to which a unit makes a likely fall of a motion [1] (chosen)."""

_WHICH_UNIT = (
    "which unit is it? That of the file or the profile was taken; give the right one in a profile, "
    '[units] "CHANNEL" = "mil", or the right sampling rate, [time] step'
)
"""What to do where the fall contradicts the unit."""

_FEWEST_TURNS = 4.0
"""Turns of a line before the drop from which it is a speed [1]."""

_MERGED = 0.75
"""Distance over the resolution by which the peak of a line and of another beside it may lie off the line [1]:
half of it where both merge, and what the grid of frequencies leaves open."""

_NO_HALF = 1e-3
"""Power at half the strongest line over that at it, below which the half is no line [1]."""

_USUAL_FALL = 0.7
"""Acceleration of a channel in a fall over gravity [1]: remanence holds back, sensors stand at 45 degrees."""

_POSSIBLE_FALL = (5e-3, 200.0)
"""Acceleration over gravity outside of which what is seen is no fall by any clock [1]."""

_CLEAR = 0.25
"""Logarithm of a factor from which on the fall tells a wrong clock from a wrong speed [1]."""

_LONG_ENOUGH = 0.2
"""Part of a drop that an estimate covers [s]."""
_LOUD = 3e-6
"""Hum, drift and noise from which on they are worth a word [m] (chosen): 1 % of a usual air gap."""

_SLOW = 0.75
"""Share of what is left of levitated readings that a parabola in time explains, from which it drifts [1]."""

_AT_BORDER = 0.95
"""Share of the range searched for the orbit at whose end none was found near the speed [1]."""

_HUMMED, _DROWNED, _TOGETHER = 0.1, 0.15, 0.9
"""Time from the beginning that is looked at for hum [s]; its amplitude over the air gap, and the sum over the
channels over the sum of their amplitudes, from which hum hides a drop [1]: an orbit has 0.7 at sensors
that are 90° apart."""


def check_units(record: Record, machine: Machine, other_gaps: Sequence[Finding] = ()) -> list[Finding]:
    """Compare how far every channel moves with the air gap.

    What no unit explains is a gap of the machine file that is wrong, where the record shows other ones.
    """
    suspects: dict[int, list[tuple[str, float]]] = {}
    for plane, gap in zip(record.planes, nominal_gaps(machine, record).tolist(), strict=True):
        for name in plane.names:
            ratio = float(np.ptp(record.reading(name))) / gap
            if ratio > 0 and not PLAUSIBLE_MOTION[0] <= ratio <= PLAUSIBLE_MOTION[1]:
                suspects.setdefault(round(math.log10(ratio / 1.5)), []).append((name, ratio))
    if suspects and not _sinks(record):
        return []  # nothing falls: the search for the drop says so
    explained = any(_nearest(ratio) for found in suspects.values() for _, ratio in found)
    if not suspects or explained or not other_gaps or _estimated_gap(machine) is not None:
        return [_unit_finding(found, record, machine) for found in suspects.values()]
    return [replace(one, severity="stop") for one in other_gaps]


def check_gaps(motion: Motion, record: Record, machine: Machine) -> list[Finding]:
    """Compare the air gaps that the record shows by itself with those of the machine file."""
    return _gap_findings(
        motion,
        record,
        {p: expected_gap(machine, record.planes[p]) for p in sorted(planes_at_bearings(machine, record))},
        "the machine file says {}",
        "correct air_gap in the machine file, after a lift check where in doubt",
    )


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

    found = [number for number, gap in stated.items() if motion.paths[number].wall.contradicts(gap)]
    if not found:
        return []
    walls = {number: motion.paths[number].wall for number in found}
    words = (
        f"{written(wall.gap, wall.gap_error)} at {record.planes[number].bearing}, "
        + says.format(written(*stated[number]))
        for number, wall in walls.items()
    )
    return [
        Finding(
            kind=Kind.WRONG_AIR_GAP,
            message="where the rotor turns back and rests, the record shows an air gap of "
            f"{'; of '.join(words)}; 90 % intervals",
            remedy=f"{remedy}; if it is right, correct unit or sensitivity of the sensors",
            severity="warning",
            channel=", ".join(name for number in found for name in record.planes[number].names),
        )
    ]


def check_fall(motion: Motion) -> list[Finding]:
    """Compare how fast the planes fall with gravity: without a machine, what shows a unit that is wrong."""
    ratio = float(np.median(motion.falls)) / GRAVITY
    factor = min(_FACTORS, key=lambda one: abs(math.log(ratio / one))) if math.isfinite(ratio) else 1.0
    if min(motion.falls) < _NO_FALL * GRAVITY or factor <= 1.0:
        return []
    fast = ", ".join(
        f"{path.name} with {fall:.3g} m/s²" for path, fall in zip(motion.paths, motion.falls, strict=True)
    )
    gaps = " and ".join(f"{1e3 * path.gap:.2g} mm" for path in motion.paths)
    return [
        Finding(
            kind=Kind.WRONG_UNIT,
            message=f"the shaft falls {ratio:.2g} times as fast as gravity lets it ({fast}), through gaps "
            f"of {gaps}; a unit factor of {factor:.4g} ({_FACTORS[factor]}) would explain it, and so would a "
            f"clock that is {math.sqrt(ratio):.2g} times too fast",
            remedy=_WHICH_UNIT,
            severity="stop",
        )
    ]


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
        Finding(
            kind=Kind.WRONG_UNIT,
            message=f"the shaft moves away by {1e6 * distance:.3g} µm with {acceleration:.2g} m/s², which is "
            f"no fall; a unit factor of {factor:.4g} ({_FACTORS[factor]}) would make it one of "
            f"{1e6 * distance / factor:.0f} µm with {acceleration / factor:.2g} m/s², and a fall shows "
            f"{SLOWEST_FALL * GRAVITY:.2g} to {_FASTEST_FALL * GRAVITY:.2g} m/s² "
            "where an orbit has a part in it",
            remedy=_WHICH_UNIT,
            severity="stop",
        )
    ]


def _sinks(record: Record) -> bool:
    """Whether the readings leave the range they begin in, as in a drop of whatever size."""
    count = max(len(record.time) // 20, 8)
    first, second = record.signals[:count], record.signals[len(record.time) // 2 :]
    shift = np.abs(np.mean(second, axis=0) - np.mean(first, axis=0))
    return float(np.median(shift / np.maximum(np.ptp(first, axis=0), 1e-15))) > 1.0


def _nearest(ratio: float) -> float | None:
    """Unit factor that would explain a motion of `ratio` air gaps instead of one to two and a half."""
    fitting = [factor for factor in _FACTORS if 0.7 <= ratio / factor <= 2.7]
    return min(fitting, key=lambda factor: abs(math.log(ratio / factor / 1.5))) if fitting else None


def _estimated_gap(machine: Machine) -> Known | None:
    """An air gap of the machine file that an earlier estimate wrote there."""
    gaps = (bearing.air_gap for bearing in machine.touchdown_bearings)
    return next((gap for gap in gaps if gap.status == "estimated"), None)


def _unit_finding(found: list[tuple[str, float]], record: Record, machine: Machine) -> Finding:
    """Readings and machine file contradict each other: the unit of the one, or the gap of the other."""
    ratio = float(np.median([value for _, value in found]))
    factor, estimated = _nearest(ratio), _estimated_gap(machine)
    guess = (
        f"a unit factor of {factor:.4g} ({_FACTORS[factor]}) would explain it"
        if factor
        else "no unit factor explains it"
    )
    file = machine.source_path.name if machine.source_path else "the machine file"
    sizes = ", ".join(dict.fromkeys(f"{1e6 * float(b.air_gap):.0f} µm" for b in machine.touchdown_bearings))
    source = "" if estimated is None else f" ({estimated.source or 'estimated'})"
    span = float(np.median([np.ptp(record.reading(name)) for name, _ in found]))
    return Finding(
        kind=Kind.WRONG_UNIT if factor and estimated is None else Kind.WRONG_AIR_GAP,
        message=f"the readings of {record.name} span {format_quantity(span, 'length')}, {ratio:.3g} × the "
        f"air gap of {sizes} in {file}{source}, a drop 1 to 2.5 ×; {guess}, and a wrong air gap in {file} "
        "would too",
        remedy="correct unit or sensitivity in the profile or the machine file, or its air_gap"
        if estimated is None
        else "use the machine file from before that estimate; if it says the same, correct unit or "
        "sensitivity in the profile or the machine file",
        severity="stop",
        channel=", ".join(name for name, _ in found),
    )


def check_speed(record: Record, machine: Machine) -> list[Finding]:
    """Look for missing, impossible or jumping speed readings."""
    if record.speed_readings is None or record.speed_time is None:
        return [
            Finding(
                kind=Kind.NO_SPEED,
                message=f"the record has no shaft speed beside {', '.join(record.channel_names)}",
                remedy='name its channel in a profile ([speed] channel = "..."), or give it by hand '
                '([speed] constant = "60 Hz")',
                severity="stop",
            )
        ]
    readings = record.speed_readings
    bad = np.flatnonzero(~np.isfinite(readings))
    if len(bad):
        return [_speed_finding(record, f"{len(bad)} speed readings are not finite", int(bad[0]), "stop")]
    if len(readings) >= 5:
        middle = median_of_five(readings)
        usual = np.maximum(np.abs(middle), 0.1 * float(np.max(np.abs(middle))))
        off = np.flatnonzero(np.abs(readings - middle) > 0.2 * usual)
        if len(off):
            seen = format_quantity(float(readings[off[0]]), "speed")
            near = format_quantity(float(middle[off[0]]), "speed")
            words = (
                f"{len(off)} readings jump, the first to {seen} among {near}: tacho pulses missing or double"
            )
            return [_speed_finding(record, words, int(off[0]), "warning")]
    return []


def _speed_finding(record: Record, words: str, at: int, severity: str) -> Finding:
    assert record.speed_time is not None
    return Finding(
        kind=Kind.SPEED_READINGS,
        message=words,
        remedy="check the tacho; the speed at the drop is taken from a robust fit",
        severity="stop" if severity == "stop" else "warning",
        channel="speed",
        time=float(record.speed_time[at]),
    )


def check_rotation_line(record: Record, end: float, speed: float) -> list[Finding]:
    """Compare the strongest line of the levitated readings with the shaft speed, the fall with gravity."""
    line = strongest_line(record, end)
    if line is None:
        return []
    frequency, resolution, at_half = line
    expected = abs(speed) / (2 * np.pi)
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
    return [_other_frequency(record, frequency, expected)]


def _other_frequency(record: Record, frequency: float, expected: float) -> Finding:
    """Say which of clock and speed is wrong: by a clock that is off by a factor a rotor falls by its square.

    The fall alone is known to about a third, by what remains of the lift; near a factor of 1 both stay open.
    """
    ratio = frequency / expected
    named = {
        60.0: "rpm taken for Hz",
        1 / 60.0: "Hz taken for rpm",
        2 * np.pi: "rad/s and Hz mixed up",
        1 / (2 * np.pi): "rad/s and Hz mixed up",
    }
    why = next((text for factor, text in named.items() if abs(ratio * factor - 1) < 0.05), "")
    share = _fall_share(record)
    falls = _POSSIBLE_FALL[0] < share < _POSSIBLE_FALL[1]
    fallen = math.log(share / _USUAL_FALL) if falls else 0.0
    of_clock = not falls or abs(fallen - 2.0 * math.log(ratio)) < abs(fallen)
    kind = Kind.WRONG_RATE if of_clock else Kind.WRONG_SPEED_UNIT if why else Kind.WRONG_SPEED
    guess = f" ({why})" if why else ""
    open_ = "" if falls and abs(math.log(ratio)) > _CLEAR else ", though the fall hardly tells the two apart"
    return Finding(
        kind=kind,
        message=f"the levitated rotor turns at {frequency:.4g} Hz in the displacements and at "
        f"{expected:.4g} Hz by the speed channel, a factor {ratio:.4g}{guess}; it falls with "
        f"{share:.2g} × gravity, so the {'clock' if of_clock else 'speed'} is wrong{open_}",
        remedy="correct the sampling interval (time.step) or the speed unit (speed.unit) in the profile",
        severity="stop",
        channel=None if of_clock else "speed",
        time=float(record.time[0]),
    )


def _fall_share(record: Record) -> float:
    """Acceleration of the fall by the clock of the record, median of the channels, over gravity [1]."""
    level = first_motion(record)[1]
    away = np.abs(record.signals - level)
    reach = np.percentile(away, 98, axis=0)
    found = [fall_accelerations(a, r, record.sampling_rate)[0] for a, r in zip(away.T, reach, strict=True)]
    middle = float(np.median(found))
    return middle / GRAVITY


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
    findings = _other_clock(levitated, record)
    if findings:
        return findings  # what the wrong frequency leaves is no noise
    inside = (record.time >= levitated.start) & (record.time <= levitated.end)
    left = record.signals[inside] - levitated.readings(record.time[inside])
    course = np.vander((record.time[inside] - levitated.start) / (levitated.end - levitated.start), 3)
    slow = course @ np.linalg.lstsq(course, np.nan_to_num(left), rcond=None)[0]
    drifts = np.var(slow, axis=0) > _SLOW * np.nanvar(left, axis=0)
    for index, name in enumerate(record.channel_names):
        if levitated.hum is not None:
            size = float(np.abs(levitated.amplitudes[levitated.tones.index(levitated.hum), index]))
            if size > _LOUD:
                findings.append(
                    Finding(
                        kind=Kind.HUM,
                        message=f"mains hum of {levitated.hum:g} Hz with {format_quantity(size, 'length')} "
                        "zero to peak",
                        remedy="ground the sensor driver; the hum found before the drop can be taken off",
                        severity="warning",
                        channel=name,
                    )
                )
        noise = float(levitated.noise[index])
        if noise > _LOUD and drifts[index]:
            findings.append(
                Finding(
                    kind=Kind.DRIFT,
                    message=f"it wanders by {format_quantity(float(np.ptp(slow[:, index])), 'length')} in "
                    f"{levitated.end - levitated.start:.3g} s before the drop, beside orbit and hum",
                    remedy="let driver and sensor warm up, or look for a loose mount; where the rotor lies "
                    "is off by as much",
                    severity="warning",
                    channel=name,
                )
            )
        elif noise > _LOUD:
            findings.append(
                Finding(
                    kind=Kind.NOISE,
                    message=f"{format_quantity(noise, 'length')} rms remain beside 1X, 2X and hum before the "
                    "drop",
                    remedy="look for other lines in the spectrum, or filter the sensor",
                    severity="warning",
                    channel=name,
                )
            )
    return findings


def _other_clock(levitated: LevitatedModel, record: Record) -> list[Finding]:
    """An orbit that does not turn with the measured speed: clock or tacho is off by a few per cent.

    The fit of the levitated part looks for the orbit near the speed; it ends at the border where none is.
    """
    if record.measured_speed is None:
        return []
    when, readings = record.measured_speed
    readings = readings[(when >= levitated.start) & (when <= levitated.end)]
    span = levitated.end - levitated.start
    if not len(readings) or span <= 0.0:
        return []
    speed = float(np.median(np.abs(readings))) / (2.0 * np.pi)
    reach = min(0.5 / span, 0.02 * speed)
    off = levitated.frequency - speed
    if abs(off) < _AT_BORDER * reach:
        return []
    return [
        Finding(
            kind=Kind.WRONG_RATE,
            message=f"before the drop the orbit turns at {levitated.frequency:.5g} Hz or farther from the "
            f"{speed:.5g} Hz of the speed channel, {100.0 * off / speed:+.1f} % or more: the sampling "
            "interval is off, or the speed is; the readings do not tell which",
            remedy="correct the sampling interval (time.step) or the speed channel in the profile",
            severity="warning",
        )
    ]


def hum_instead_of_a_drop(record: Record, gap: float) -> list[Finding]:
    """Mains hum so large that no drop is found in it: it moves all sensors alike, which no rotor does."""
    first = record.time < record.time[0] + _HUMMED
    time, part = record.time[first], record.signals[first]
    for mains in MAINS:
        waves = np.exp(2j * np.pi * mains * time)
        found = 2.0 * np.mean((part - np.mean(part, axis=0)) * waves.conj()[:, None], axis=0)
        size = float(np.mean(np.abs(found)))
        if size > _DROWNED * gap and abs(np.sum(found)) > _TOGETHER * np.sum(np.abs(found)):
            return [
                Finding(
                    kind=Kind.HUM,
                    message=f"mains hum of {mains:g} Hz with {format_quantity(size, 'length')} zero to peak "
                    "in all channels together hides the drop",
                    remedy="ground the sensor driver, then record again",
                    severity="stop",
                    channel=", ".join(record.channel_names),
                )
            ]
    return []


def check_length(record: Record, drop: float, has_tail: bool) -> list[Finding]:
    """See whether the record reaches far enough behind the drop."""
    findings = []
    after = float(record.time[-1]) - drop
    if after < _LONG_ENOUGH:
        findings.append(
            Finding(
                kind=Kind.SHORT,
                message=f"it ends {after * 1e3:.4g} ms after the drop; the analysis covers "
                f"{_LONG_ENOUGH * 1e3:.0f} ms",
                remedy="record longer, or analyse a shorter time",
                severity="warning",
                time=float(record.time[-1]),
            )
        )
    measured = record.measured_speed
    if measured is not None and abs(float(measured[1][-1])) > 2 * np.pi and not has_tail:
        findings.append(
            Finding(
                kind=Kind.ENDS_TURNING,
                message=f"the shaft still turns at {format_quantity(abs(float(measured[1][-1])), 'speed')} "
                "at "
                f"{record.time[-1]:.6g} s",
                remedy="give the readings at standstill as the settled tail: the air gap is found from them",
                severity="warning",
                time=float(record.time[-1]),
            )
        )
    return findings


def no_drop(error: NoDropError) -> Finding:
    """What the search for a drop did not find, as a finding."""
    return Finding(
        kind=Kind.NO_PRETRIGGER if error.begins_late else Kind.NO_DROP,
        message=error.seen,
        remedy=error.remedy,
        severity="stop",
    )


def nothing_falls(error: NothingFallsError) -> Finding:
    """What a record without a machine shows in place of a drop, as a finding."""
    return Finding(kind=Kind.NO_DROP, message=error.seen, remedy=error.remedy, severity="stop")


def first_motion(record: Record) -> tuple[int, Array]:
    """Sample by which the rotor has begun to fall, whatever units and polarities, and the level before (S,).

    Every channel is scaled by its own largest motion; half of the channels must have moved by a quarter of
    it.
    """
    first = max(int(0.01 * record.sampling_rate), 8)
    level = np.mean(record.signals[:first], axis=0)
    away = np.abs(record.signals - level)
    moved = np.median(away / np.maximum(np.max(away, axis=0), 1e-15), axis=1) > 0.25
    return int(np.argmax(moved)), level
