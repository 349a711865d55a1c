"""What gravity says about the sensors while the rotor flies between two impacts.

Between impacts nothing holds a dropped rotor: the magnets are off and their remanence has faded. Whatever it
rings in its bending modes and turns by its unbalance, as a whole it falls with g. How fast the readings fall
then is a calibration of every sensor, far sharper than the first fall, in which lift remains. A flight whose
readings the free rotor does not explain at noise level is cut shorter or left out, so a touch that was not
seen does not pass for a gain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.quality.fall import WRONG_GAIN
from rotordrop.evidence.quality.finding import Finding, Severity, found
from rotordrop.known import NINETY
from rotordrop.record.axes import planar_of
from rotordrop.series import runs_of
from rotordrop.units import fall_time

if TYPE_CHECKING:
    from rotordrop.evidence.free_rotor import FreeRotor
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

SHORTEST, LONGEST = 0.35, 1.7
"""Flights that are looked at, over the time of a free fall through the gap [1]: a shorter one says little, of
a longer one the beginning does."""

MOST_FLIGHTS = 6
"""Flights that are looked at, the longest ones [1] (chosen)."""

AFLOAT = 0.85
"""A rotor farther from the race than this share of its reach touches nothing [1]."""

_FADED = 3.0
"""Time after the first guess of the drop by which a flight can begin, over that of the remanence [1]."""

_AT_NOISE = 1.4
"""Mean square of the residual over the noise up to which the free rotor explains a flight [1]."""

_SHORTENED = 0.1
"""Share by which a flight is cut that it does not explain [1]."""

_ENOUGH_RATE = 25e3
"""Rate above which samples are left out, which the free rotor does not need [Hz]."""

_MODEL = 0.02
"""What the rotor of the file leaves out of a flight, as an error of gravity [1]."""

_CONTRADICT = 4.0
"""Chi square per degree of freedom by which flights differ, or channels beside one gain, where something
touched the rotor in one of them at least [1]."""

_OF_REACH = 80.0
"""Percentile of the distance from the levitated place that stands for the race [%]: few rotors fly long."""

_REFUTED = 0.12
"""Error of a gain that flights exclude [1], at which a fall that suspects one is no longer heard."""

_LARGEST = 1.0
"""Largest error of a gain that is sought [1]: what is more shows in every fall."""

_SEPARABLE = 1e-9
"""Least singular value over the largest one that still tells unknowns apart [1]."""

SURE = 5.0
"""Standard deviations from which on a gain is named [1], with what the flights differ by in them."""


@dataclass(frozen=True, kw_only=True)
class Weighed:
    """How fast every sensor saw the rotor fall in its flights, over what gravity lets it."""

    share: Array
    """Reading over true displacement [1]; 1 with right gains, angles and clock, shape (S,)."""
    covariance: Array
    """Its covariance [1], shape (S, S)."""
    flights: int
    """How many there are."""
    scatter: float
    """Mean square by which the flights differ, over what their errors let them [1]."""


def weighed(
    record: Record, machine: Machine, rotor: FreeRotor, levitated: LevitatedModel, drop: float
) -> Weighed | None:
    """Weigh the rotor in its flights; None where it never flew."""
    if len({amb.node for amb in machine.ambs}) < 2 or record.speed is None or float(machine.gravity) <= 0.0:
        return None
    if machine.pushed:  # by what is not known well enough to weigh sensors with
        return None
    gravity, count = float(machine.gravity), len(record.sensors)
    gap = min(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    seen: list[tuple[Array, Array]] = []
    for window in _flights(record, levitated, drop, fall_time(gap, gravity)):
        one = _weighed_in(record, rotor, levitated, window, gravity, fall_time(gap, gravity))
        if one is not None:
            share, covariance = one
            seen.append((share, np.linalg.inv(covariance + _MODEL**2 * np.eye(count)).astype(np.float64)))
    if not seen:
        return None
    error: Array = np.linalg.inv(np.sum([inverse for _, inverse in seen], axis=0)).astype(np.float64)
    mean = error @ np.sum([inverse @ share for share, inverse in seen], axis=0)
    # sensors read alike in every flight; where the flights differ by more than their errors, something
    # touched the rotor in them, and they know as much less (Birge's ratio)
    apart = sum(float((share - mean) @ inverse @ (share - mean)) for share, inverse in seen)
    scatter = apart / max((len(seen) - 1) * count, 1)
    return Weighed(share=mean, covariance=error * max(scatter, 1.0), flights=len(seen), scatter=scatter)


def gains_hold(seen: Weighed) -> bool:
    """Whether the flights exclude a gain that is off, so that a first fall that suspects one is overruled."""
    error = np.sqrt(np.diag(seen.covariance))
    return bool(np.all(np.abs(seen.share - 1.0) + 2.0 * error < _REFUTED))


def check_flights(seen: Weighed, record: Record) -> list[Finding]:
    """Name a gain of all channels, by which the rotor falls with something other than g.

    A touch that was not seen looks like a gain of one channel, not of all.
    """
    off, every = seen.share - 1.0, np.ones(len(seen.share))
    precision = np.linalg.inv(seen.covariance)
    weight = float(every @ precision @ every)
    size = float(every @ precision @ off) / weight
    left = (float(off @ precision @ off) - size**2 * weight) / (len(off) - 1)
    sure = abs(size) * (weight / max(left, 1.0)) ** 0.5
    if sure < SURE or not WRONG_GAIN <= abs(size) <= _LARGEST:
        return []
    names, error = ", ".join(record.channel_names), NINETY * abs(size) / sure
    words = f"{names} reading {1.0 + size:.3g} ± {error:.2g} (90 %) of what it should"
    odd = max(left, seen.scatter) > _CONTRADICT
    doubt = "; but the flights contradict each other, and something touched the rotor in one at least"
    severity: Severity | None = "note" if odd else None
    said = {"count": seen.flights, "words": words, "doubt": doubt if odd else ""}
    return [found("gain-in-flight", said, channel=names, severity=severity)]


def _flights(record: Record, levitated: LevitatedModel, drop: float, fall: float) -> list[tuple[int, int]]:
    """First samples and counts of the longest stretches with the rotor away from all races."""
    path = planar_of((record.signals - levitated.mean) * record.gains, record.planes)
    away = np.hypot(path[..., 0], path[..., 1])
    fallen = record.time > drop
    away = away / np.percentile(away[fallen], _OF_REACH, axis=0)
    landed = np.flatnonzero(fallen & np.any(away > AFLOAT, axis=1))
    if not len(landed):
        return []
    afloat = np.all(away < AFLOAT, axis=1)
    afloat[: max(int(landed[0]), int(np.searchsorted(record.time, drop + _FADED * REMANENCE_TIME)))] = False
    starts, lengths = runs_of(afloat)
    rate = record.sampling_rate
    found = [
        (start, min(length, int(LONGEST * fall * rate)))
        for start, length in zip(starts.tolist(), lengths.tolist(), strict=True)
        if length >= SHORTEST * fall * rate
    ]
    return sorted(found, key=lambda window: -window[1])[:MOST_FLIGHTS]


def _weighed_in(
    record: Record,
    rotor: FreeRotor,
    levitated: LevitatedModel,
    window: tuple[int, int],
    gravity: float,
    fall: float,
) -> tuple[Array, Array] | None:
    """Share of gravity by every sensor in one flight, cut until the free rotor explains it."""
    first, count = window
    thin = max(round(record.sampling_rate / _ENOUGH_RATE), 1)
    while count >= SHORTEST * fall * record.sampling_rate:
        inside = slice(first, first + count, thin)
        share, covariance, residual = _fitted(record, rotor, levitated, inside, gravity)
        if float(np.mean(residual**2)) < _AT_NOISE:
            return share, covariance
        half, cut = len(residual) // 2, max(int(_SHORTENED * count), thin)
        first += cut if np.sum(residual[:half] ** 2) > np.sum(residual[half:] ** 2) else 0
        count -= cut
    return None


def _fitted(
    record: Record,
    rotor: FreeRotor,
    levitated: LevitatedModel,
    inside: slice,
    gravity: float,
) -> tuple[Array, Array, Array]:
    """Fit a flight by the motion left in the rotor, its unbalance and gravity.

    Returns
    -------
    share : array, shape (S,)
        Share of gravity seen by every sensor [1].
    covariance : array, shape (S, S)
        Its covariance [1].
    residual : array, shape (T, S)
        Residual over the noise, scaled by the degrees of freedom [1].
    """
    from rotordrop.evidence.free_rotor import response_at

    assert record.speed is not None
    since = record.time[inside] - record.time[inside.start]
    speed = float(record.speed[inside.start])
    unit, gains, of_plane = record.directions, record.gains, record.plane_of
    noise = np.maximum(levitated.noise * gains, 1e-12)
    toward = (unit[:, 0] - 1j * unit[:, 1])[None, :, None]
    left = response_at(rotor.table_of_start(speed, float(since[-1])), since)[:, of_plane] * toward
    turning = np.exp(1j * speed * since)[:, None, None] * np.eye(len(record.planes))[of_plane] * toward
    parts = [column for seen in (left, turning) for column in (seen.real, -seen.imag)]
    seen = np.where(np.abs(unit[:, 1]) < 1e-3, 1e-3, unit[:, 1])  # a level sensor weighs next to nothing
    falls = -0.5 * gravity * since[:, None, None] ** 2 * np.diag(seen)
    columns = np.concatenate([*parts, falls], axis=-1) / noise[None, :, None]
    readings = record.signals[inside] * gains / noise
    flat = columns.reshape(-1, columns.shape[-1])
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    u, s, vt = np.linalg.svd(flat / size, full_matrices=False)
    inverse = np.where(s > _SEPARABLE * s[0], 1.0 / np.maximum(s, 1e-300), 0.0)
    best = vt.T @ (inverse * (u.T @ readings.ravel()))
    residual = readings.ravel() - (flat / size) @ best
    residual *= np.sqrt(len(residual) / max(len(residual) - int(np.sum(inverse > 0.0)), 1))
    last = slice(-len(unit), None)
    spread = (vt.T[last] * inverse) / size[last, None]
    return best[last] / size[last], spread @ spread.T, residual.reshape(readings.shape)
