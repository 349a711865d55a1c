"""What the sensors say before the drop: noise, hum, runout and orbit of the levitated phase."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class LevitatedPhase:
    """What the levitated phase of a record tells about each channel.

    Attributes
    ----------
    level : ndarray, shape (C,)
        Mean reading [m].
    synchronous, twice : ndarray, shape (C,), complex
        Amplitude at 1X and 2X [m zero-to-peak], ``Re(c e^(jω(t − t_off)))``.
    hum : ndarray, shape (C,), complex
        Amplitude at the mains frequency [m zero-to-peak], same phase reference.
    hum_frequency : float
        Mains frequency [Hz].
    noise : ndarray, shape (C,)
        Standard deviation of what is left [m].
    samples : int
        Number of samples looked at; 0 when the record has no levitated part.
    """

    level: Array
    synchronous: NDArray[np.complex128]
    twice: NDArray[np.complex128]
    hum: NDArray[np.complex128]
    hum_frequency: float
    noise: Array
    samples: int


MINIMUM_CYCLES = 2.0
MAINS_FREQUENCY = 50.0


def levitated_phase(
    time: Array, readings: Array, omega: float, mains: float = MAINS_FREQUENCY
) -> LevitatedPhase:
    """Fit level, 1X, 2X and hum to the readings before power-off by linear least squares.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s]; only negative times are used.
    readings : ndarray, shape (N, C)
        Readings [m]; missing ones (NaN) are left out.
    omega : float
        Rotor speed [rad/s].
    mains : float
        Mains frequency [Hz].
    """
    before = time < -0.5e-3
    t, values = time[before], readings[before]
    channels = readings.shape[1]
    none = np.zeros(channels, dtype=np.complex128)
    if len(t) < 50 or (t[-1] - t[0]) * omega < MINIMUM_CYCLES * 2.0 * np.pi:
        return LevitatedPhase(
            level=np.full(channels, np.nan),
            synchronous=none,
            twice=none,
            hum=none,
            hum_frequency=mains,
            noise=np.full(channels, np.nan),
            samples=0,
        )
    angles = [omega * t, 2.0 * omega * t]
    span = t[-1] - t[0]
    hum_apart = abs(mains - omega / (2.0 * np.pi)) * span > 1.0 and mains * span > MINIMUM_CYCLES
    if hum_apart:
        angles.append(2.0 * np.pi * mains * t)
    columns = [np.ones_like(t)] + [f(a) for a in angles for f in (np.cos, np.sin)]
    design = np.column_stack(columns)
    coefficients, noise = _fitted(design, values)
    amplitude = [coefficients[1 + 2 * i] - 1j * coefficients[2 + 2 * i] for i in range(len(angles))]
    return LevitatedPhase(
        level=coefficients[0],
        synchronous=amplitude[0],
        twice=amplitude[1],
        hum=amplitude[2] if hum_apart else none,
        hum_frequency=mains,
        noise=noise,
        samples=len(t),
    )


def _fitted(design: Array, values: Array) -> tuple[Array, Array]:
    """Coefficients and standard deviation of what is left, channel by channel where readings are missing."""
    if np.isfinite(values).all():
        coefficients, *_ = np.linalg.lstsq(design, values, rcond=None)
        left = values - design @ coefficients
        return np.asarray(coefficients), np.asarray(np.std(left, axis=0, ddof=design.shape[1]))
    coefficients = np.full((design.shape[1], values.shape[1]), np.nan)
    noise = np.full(values.shape[1], np.nan)
    for c in range(values.shape[1]):
        heard = np.isfinite(values[:, c])
        if np.count_nonzero(heard) > 2 * design.shape[1]:
            one, few = design[heard], values[heard, c : c + 1]
            found, left = _fitted(one, few)
            coefficients[:, c], noise[c] = found[:, 0], left[0]
    return np.asarray(coefficients), np.asarray(noise)


def without_hum_and_runout(time: Array, readings: Array, theta: Array, phase: LevitatedPhase) -> Array:
    """Readings [m] less the hum and the 2X runout of the levitated phase; 1X stays.

    ``theta`` (N,) is the rotor angle since power-off [rad]. A linear rotor on a synchronous orbit has no 2X,
    so 2X in the levitated phase is electrical or mechanical runout of the sensor track.
    """
    if phase.samples == 0:
        return readings
    hum = np.outer(np.exp(2j * np.pi * phase.hum_frequency * time), phase.hum).real
    runout = np.outer(np.exp(2j * theta), phase.twice).real
    return np.asarray(readings - hum - runout)
