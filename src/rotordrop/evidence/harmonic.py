"""The first half of a contact: free flight, then the harmonic motion of a mass on its race."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array

_FEWEST = 9
"""Samples of a flight and half a contact that five unknowns are fitted to, at least [1] (chosen)."""

_PHASES = (0.3 * math.pi, 1.1 * math.pi)
"""Phase of the harmonic motion at its deepest point: a quarter of a period, earlier where the contact is
damped, later where the rotor is pressed on, at most about half a period [rad] (chosen)."""

_COARSE, _FINE, _REFINED = (25, 9), (7, 7), 3
"""Times and phases tried, the same about the best of them, and how often; every step is a third of the one
before (chosen for time)."""

_LINEAR = 3
"""Unknowns in which the motion is linear: place and velocity at the touch, and pull."""


@dataclass(frozen=True, kw_only=True)
class HalfContact:
    """How a rotor enters a contact."""

    begin: float
    """When it touches, in samples before the deepest point (negative)."""
    velocity: float
    """Velocity with which it touches [m/s], positive towards the race."""
    velocity_error: float
    """Standard error by what the fit leaves over [m/s]; that of its form comes on top."""
    pull: float
    """Acceleration towards the race without the contact [m/s²]."""
    frequency: float
    """Angular frequency of the rotor on its race [rad/s]."""


def half_contact(outward: Array, rate: float, noise: float) -> HalfContact | None:
    """Fit a flight and the half contact at its end.

    Parameters
    ----------
    outward : array, shape (N,)
        Distance towards the race [m], from somewhere in the flight to the deepest point, the last sample. The
        end of a contact is the begin of the one that runs backwards in time.
    rate : float
        Samples per second [Hz].
    noise : float
        Standard deviation of a reading [m].

    Returns
    -------
    HalfContact or None
        None where there are too few samples, or none of the flight.

    Notes
    -----
    With τ from the touch on: ``x = r + v τ + a τ²/2`` before it, ``x = r + v sin(ωτ)/ω + a (1 − cos ωτ)/ω²``
    after it: a mass on an undamped spring that a constant force pulls along.
    """
    count = len(outward)
    if count < _FEWEST:
        return None
    time, place = np.arange(1.0 - count, 1.0) / rate, outward - outward[-1]
    earliest, latest = float(time[0]) + (_LINEAR + 1) / rate, -1.0 / rate
    begins, step = np.linspace(earliest, latest, _COARSE[0], retstep=True)
    phases, turn = np.linspace(*_PHASES, _COARSE[1], retstep=True)
    for _ in range(_REFINED + 1):
        tried = np.meshgrid(np.clip(begins, earliest, latest), np.clip(phases, *_PHASES), indexing="ij")
        at, phase = (one.ravel() for one in tried)
        left = _left_over(time, place, at, -phase / at)
        best = int(np.argmin(left))
        begins = at[best] + step * np.linspace(-1.0, 1.0, _FINE[0])
        phases = phase[best] + turn * np.linspace(-1.0, 1.0, _FINE[1])
        step, turn = step / 3.0, turn / 3.0
    begin, frequency = float(at[best]), float(-phase[best] / at[best])
    motion = _motions(time, np.array([begin]), np.array([frequency]))[0]
    found = np.linalg.lstsq(motion, place, rcond=None)[0]
    spread = max(noise, math.sqrt(float(np.mean((place - motion @ found) ** 2)) * count / max(count - 5, 1)))
    small = 1e-3 * abs(begin), 1e-3 * frequency
    beside = _motions(
        time,
        np.array([begin + small[0], begin - small[0], begin, begin]),
        np.array([frequency, frequency, frequency + small[1], frequency - small[1]]),
    )
    moved = beside @ found
    slopes = np.column_stack(
        [motion, (moved[0] - moved[1]) / (2.0 * small[0]), (moved[2] - moved[3]) / (2.0 * small[1])]
    )
    size = np.linalg.norm(slopes, axis=0)
    spreads = spread * np.sqrt(np.diag(np.linalg.pinv((slopes / size).T @ (slopes / size)))) / size
    return HalfContact(
        begin=begin * rate,
        velocity=float(found[1]),
        velocity_error=float(spreads[1]),
        pull=float(found[2]),
        frequency=frequency,
    )


def _motions(time: Array, begin: Array, frequency: Array) -> Array:
    """Motion per place, velocity and pull at the touch, shape (K, N, 3), for K touches and frequencies."""
    since = time - begin[:, None]
    free, on = np.minimum(since, 0.0), frequency[:, None] * np.maximum(since, 0.0)
    scale = frequency[:, None]
    moved = (free + np.sin(on) / scale, 0.5 * free**2 + (1.0 - np.cos(on)) / scale**2)
    return np.stack([np.ones_like(since), *moved], axis=-1)


def _left_over(time: Array, place: Array, begin: Array, frequency: Array) -> Array:
    """Sum of squares that the best motion leaves, for K touches and frequencies, shape (K,)."""
    columns = np.linalg.qr(_motions(time, begin, frequency))[0]
    explained = np.einsum("kni,n->ki", columns, place)
    return np.asarray(np.sum((place - np.einsum("kni,ki->kn", columns, explained)) ** 2, axis=1))
