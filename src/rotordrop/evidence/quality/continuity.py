"""Whether readings follow each other as those of a moving rotor do, or samples are lost.

A rotor has position and velocity from one sample to the next, whatever machine it belongs to. Where parabolas
before and after a place describe the motion, they meet there; where all channels jump by one time times their
velocities, samples are missing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.series import noise_by_differences

if TYPE_CHECKING:
    from rotordrop.record.record import Record

_FEWEST = 8
"""Fewest samples on either side of a place through which a parabola says how the rotor moves [1]: five remain
to tell whether it does. Twice as many, and so on, where noise hides what is missing."""

_AS_PARABOLA = 1.6e-3
"""Longest such side [s]: of an orbit of 100 Hz a parabola leaves 1 % over that time; whether one describes
the motion is asked of each by itself."""

_PART = 16384

_SMOOTH = 2.4
"""Standard deviations by which the mean square of the residual of those parabolas may lie above that of noise
where they describe the motion [1]: in a contact of less than a millisecond they do not, and nothing is said
of a jump there."""

_KINK = 0.6
"""Part of a sample by which the kink of a hard impact may lie aside of the middle of two samples [1]: a half,
and what the parabolas leave open."""

_LOST = 6.0
"""Standard deviations of a time that is missing in all channels, beyond what the parabolas may leave out,
from which it is named [1]: at 100,000 places looked at, five have one chance in 30; 4.5 at most in 57 clean
drops of all rotors."""

_LEFT_OUT = 7.0 / 18.0
"""Square of a jump, in its standard deviations, that a course in the third power of time makes which leaves
one noise variance to the parabolas on both sides together [1]: its value at their ends squared, 7 over the
samples, against twice the 9 over the samples of a parabola's."""

_SURELY = 2.0
"""Standard deviations of that noise by which it may hide what the parabolas leave out [1]."""

_SAME_WAY = 3.0
"""Standard deviations up to which channels agree on the missing time [1], and within which what is missing is
a whole number of samples."""


def check_continuity(record: Record) -> list[Finding]:
    """Find samples that are lost under a clock that runs on, by where the motion would go on."""
    signals, rate = record.signals, record.sampling_rate
    counts = [_FEWEST << k for k in range(12) if k == 0 or _FEWEST << k <= _AS_PARABOLA * rate]
    if len(signals) < 4 * counts[-1] or not np.isfinite(signals).all():
        return []
    steps = [np.median(np.diff(np.unique(c))) if np.ptp(c) > 0.0 else 0.0 for c in signals.T]
    own = np.array([noise_by_differences(column, 4) for column in signals.T])
    noise = np.maximum(np.hypot(own, np.array(steps) / np.sqrt(12.0)), 1e-12)
    worst: tuple[float, Finding | None] = (_LOST, None)
    for begin in range(0, len(signals), _PART):  # a coast-down of a minute must not be held many times
        part = signals[begin : begin + _PART + 2 * counts[-1]] / noise
        for count in (one for one in counts if 2 * one < len(part)):
            sizes, jump, velocity = _losses(part - np.median(part, axis=0), count)
            row = int(np.argmax(sizes))
            if sizes[row] > worst[0]:
                fast = int(np.argmax(np.abs(velocity[row])))
                missing = abs(jump[row, fast] / velocity[row, fast])
                size = 1e6 * float(np.max(np.abs(jump[row]) * noise))
                words = {"size": size, "missing": missing, "lasts": 1e3 * missing / rate, "sure": sizes[row]}
                worst = float(sizes[row]), found("lost", words, time=float(record.time[begin + count + row]))
    return [] if worst[1] is None else [worst[1]]


def _losses(part: Array, count: int) -> tuple[Array, Array, Array]:
    """Missing time over its standard deviation, where channels jump by it times their velocity, shape (N,).

    Beside it the jump of the motion between the parabolas through so many samples before and after every
    place, and the velocity over it per sample, shape (N, S), all in the noise of the readings. Channels that
    parabolas do not describe on both sides have no voice; more than half must have one. Over a gap the motion
    goes on with one acceleration: it has the mean velocity of both sides. What is no parabola within the
    noise jumps too, by as much as the readings on both sides leave room for.
    """
    free, powers = count - 3, np.vander(np.arange(count) - 0.5 * (count - 1), 3, increasing=True)
    basis, upper = np.linalg.qr(powers)
    # the parabola half a sample before and beyond its samples, and its slope there
    places = np.array([[1, -0.5 * count, 0.25 * count**2], [1, 0.5 * count, 0.25 * count**2]])
    weights = np.vstack([places, [[0, 1, -count], [0, 1, count]]]) @ np.linalg.inv(upper)
    fitted = np.array([[np.correlate(c, one, "valid") for one in basis.T] for c in part.T])
    squares = np.array([np.convolve(c**2, np.ones(count), "valid") for c in part.T])
    begins, ends, into, out = (np.tensordot(row, fitted, (0, 1)).T for row in weights)
    excess = (squares - np.sum(fitted**2, axis=1)).T - free
    # where a channel holds one reading it is stuck, which has its own name
    held = np.cumsum(np.vstack([np.zeros(part.shape[1]), part[1:] == part[:-1]]), axis=0)
    smooth = excess < _SMOOTH * np.sqrt(2.0 * free)
    smooth &= held[count - 1 :] - held[: len(smooth)] < count // 2
    smooth = smooth[count:] & smooth[:-count]
    error = float(np.sqrt(2.0) * np.linalg.norm(weights[1]))
    jump, velocity = begins[count:] - ends[:-count], 0.5 * (into[count:] + out[:-count])
    gone, mean, turned = (one * smooth / error for one in (jump, velocity, into[count:] - out[:-count]))
    weight, seeing = np.sum(mean**2, axis=1), np.sum(smooth, axis=1)
    missing = np.sum(gone * mean, axis=1) / np.maximum(weight, 1e-300)
    aside = np.sum((gone - missing[:, None] * mean) ** 2, axis=1)
    whole = np.abs(missing - np.round(missing)) * np.sqrt(weight) < _SAME_WAY
    fits = (seeing > max(part.shape[1] // 2, 1)) & whole & (missing > 0.5) & (aside < _SAME_WAY**2 * seeing)
    # noise that happens to be small hides no less
    beyond = np.maximum(np.sum((excess[count:] + excess[:-count]) * smooth, axis=1), 0.0)
    hidden = np.sqrt(_LEFT_OUT * (beyond + _SURELY * np.sqrt(4.0 * free * seeing)))
    sure = missing * np.sqrt(weight) - _KINK * np.linalg.norm(turned, axis=1) - hidden
    return np.maximum(sure, 0.0) * fits, jump, velocity
