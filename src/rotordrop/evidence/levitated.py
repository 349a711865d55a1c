"""What the sensors show while the rotor still levitates: level, orbit, runout, mains hum and noise.

The one fit of the levitated part of a record: power-off, fall and filter all start from it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array, ComplexArray
from rotordrop.errors import NoDropError
from rotordrop.evidence.colour import SlowNoise, slow_noise

if TYPE_CHECKING:
    from rotordrop.evidence.measured_speed import RotorAngle
    from rotordrop.record.record import Record


MAINS = (50.0, 60.0)
"""Public mains frequencies, one of which is always looked for [Hz]."""

OTHER_SUPPLIES = (50.0 / 3.0, 400.0)
"""Railway, ships and aircraft [Hz]: taken only where the line stands out of what surrounds it."""

_STANDS_OUT = 12.0
"""A line stands out when it explains this many times what neighbouring frequencies explain (chosen)."""

_APART = 1.5
"""Two tones are told apart when they differ by this many cycles over the window (chosen)."""

_FEWEST_TURNS, _FEWEST_SAMPLES = 1.5, 50
"""Levitated turns and samples that the fit needs (chosen): seven numbers of each channel come from them."""

SLOW, _ORBIT = 5.0, (0.1, 1.0)
"""Speed below which those turns are not needed, as at standstill [Hz], and turns without which a slow rotor
shows no tone at 1X and at 2X (chosen)."""

_STRETCH = 1e-3
"""Length of the stretches by which the end of the levitated part is looked at [s] (chosen)."""

_LEFT = 3.0
"""A last stretch that scatters this many times as much as most has left the levitated motion [1] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class LevitatedModel:
    """Readings of the levitated rotor: a constant, tones at 1X and 2X where it turned, and mains hum.

    The tones hold orbit and electrical runout together: one cannot tell them apart while the rotor is
    levitated. A linear rotor on a synchronous orbit has no 2X, so what is there is runout and turns on with
    the shaft after power-off.
    """

    frequency: float
    """Speed found from the 1X tone [Hz]."""
    tones: tuple[float, ...]
    """Frequencies of the model [Hz]: 1X, 2X and, where it can be told apart, the hum."""
    hum: float | None
    """Mains frequency among `tones` [Hz]."""
    mean: Array
    """Constant part [m], shape (S,)."""
    amplitudes: ComplexArray
    """Tone f reads ``Re(amplitude · exp(2πi f t))`` [m, zero to peak], t in record time, shape (F, S)."""
    noise: Array
    """Standard deviation of what is left [m]. This, means and amplitudes are NaN for a channel without
    readings, shape (S,)."""
    start: float
    end: float
    """Window the model was fitted to [s]."""
    slow_noise: SlowNoise = field(default_factory=SlowNoise)
    """The part of what is left that is not white."""

    def readings(self, time: Array) -> Array:
        """Readings of a rotor that went on levitating [m], shape (N, S)."""
        waves = np.exp(2j * np.pi * np.outer(time, self.tones))
        return np.asarray(self.mean + (waves @ self.amplitudes).real)

    def hum_readings(self, time: Array) -> Array:
        """The hum alone [m], shape (N, S)."""
        if self.hum is None:
            return np.zeros((len(time), len(self.mean)))
        row = self.tones.index(self.hum)
        return np.outer(np.exp(2j * np.pi * self.hum * time), self.amplitudes[row]).real

    def disturbance(self, time: Array, angle: RotorAngle) -> Array:
        """What is no motion: hum, and 2X runout by the rotor angle [m], shape (N, S).

        A rotor that slows down takes its runout with it: at 500 Hz the angle is 15 rad behind that of a
        constant speed 0.2 s after power-off, and a 2X at constant speed would be added, not taken off. Where
        the angle is not known the runout fades out of the prediction; `unknown_runout` says what is left.
        """
        at, spread = angle.at(time)
        waves = np.exp(2j * at - 2.0 * spread**2)
        return np.asarray(self.hum_readings(time) + np.outer(waves, self.amplitudes[1]).real)

    def unknown_runout(self, time: Array, angle: RotorAngle) -> Array:
        """Mean variance of the 2X runout that `disturbance` cannot take off [m²], shape (S,)."""
        spread = angle.at(time)[1]
        share = float(np.mean(1.0 - np.exp(-4.0 * spread**2))) if len(time) else 0.0
        return np.asarray(0.5 * share * np.abs(self.amplitudes[1]) ** 2)

    def of_channels(self, columns: Sequence[int]) -> LevitatedModel:
        """The same for some of the channels."""
        chosen = list(columns)
        return replace(
            self,
            mean=self.mean[chosen],
            amplitudes=self.amplitudes[:, chosen],
            noise=self.noise[chosen],
            slow_noise=self.slow_noise.of_channels(chosen),
        )


def fit_levitated(record: Record, end: float, *, speed: float, start: float | None = None) -> LevitatedModel:
    """Fit the readings before the drop by a constant, 1X, 2X and hum.

    A window that reaches into the fall ends before it.

    Parameters
    ----------
    record : Record
        The record.
    end : float
        End of the window, shortly before the drop [s].
    speed : float
        Shaft speed [rad/s]; refined from the readings.
    start : float, optional
        Begin of the window [s]; the begin of the record by default.

    Raises
    ------
    NoDropError
        When too few revolutions or samples lie before the drop.
    """
    from scipy.optimize import minimize_scalar

    from rotordrop.evidence.quality.channels import damaged_samples

    start = float(record.time[0]) if start is None else start
    keep = (record.time >= start) & (record.time <= end)
    time, signals = record.time[keep], record.signals[keep]
    span = float(time[-1] - time[0]) if len(time) > 1 else 0.0
    nominal = abs(speed) / (2 * np.pi)
    if (span * nominal < _FEWEST_TURNS and nominal >= SLOW) or len(time) < _FEWEST_SAMPLES:
        raise NoDropError(
            record.name,
            f"{max(span, 0.0) * 1e3:.3g} ms of levitated rotor before {end:.6g} s are "
            f"{max(span * nominal, 0.0):.2g} revolutions",
            f"at least {_FEWEST_TURNS:g} are needed: record with more pre-trigger",
            begins_late=True,
        )
    hum = _choose_hum(time, signals, nominal, span)
    # the speed reading says where 1X is to be looked for, the readings of the sensors where it is
    reach = min(0.5 / span, 0.02 * nominal)
    refined = minimize_scalar(
        lambda frequency: _misfit(time, signals, frequency, hum),
        bounds=(nominal - reach, nominal + reach),
        method="bounded",
        options={"xatol": 1e-5 * nominal},
    )
    found = _fit(time, signals, float(refined.x), hum)
    # the last readings may be of the fall already; a slow clock leaves no sample to some stretches
    count = max(min(round(float(time[-1] - time[0]) / _STRETCH), len(time) // 2), 1)
    rest = np.square((signals - found.readings(time)) / found.noise)
    edges = np.linspace(0, len(time), count + 1).astype(int)
    scatter = np.sqrt([np.nanmean(rest[a:b]) for a, b in itertools.pairwise(edges)])
    stay = np.flatnonzero(scatter <= _LEFT * np.nanmedian(scatter))
    stays = float(time[edges[stay[-1] + 1] - 1])
    if stays < found.end:
        return fit_levitated(record, stays, speed=speed, start=start)
    left = np.where(damaged_samples(signals), np.nan, signals - found.readings(time))
    return replace(found, slow_noise=slow_noise(left, record.sampling_rate, found.tones))


def _choose_hum(time: Array, signals: Array, frequency: float, span: float) -> float | None:
    """The supply frequency that explains most, if it can be told apart from 1X and 2X."""

    def told_apart(supply: float) -> bool:
        return all(abs(supply - k * frequency) * span > _APART for k in (0, 1, 2))

    def misfit(supply: float | None) -> float:
        return _misfit(time, signals, frequency, supply)

    candidates = [mains for mains in MAINS if told_apart(mains)]
    for supply in filter(told_apart, OTHER_SUPPLIES):
        # a line explains far more than the frequencies around it: slow wander of the rotor does not
        nearby = [supply + k * _APART / span for k in (-3, -2, -1, 1, 2, 3)]
        without = misfit(None)
        around = [without - misfit(other) for other in filter(told_apart, nearby)]
        if around and without - misfit(supply) > _STANDS_OUT * float(np.median(around)):
            candidates.append(supply)
    return min(candidates, key=misfit, default=None)


def _misfit(time: Array, signals: Array, frequency: float, hum: float | None) -> float:
    return float(np.nansum(_fit(time, signals, frequency, hum).noise ** 2))


def _fit(time: Array, signals: Array, frequency: float, hum: float | None) -> LevitatedModel:
    tones = (frequency, 2 * frequency) + ((hum,) if hum is not None else ())
    waves = np.exp(2j * np.pi * np.outer(time, tones))
    # what a part of a turn does not show has the amplitude zero
    waves[:, :2] *= (time[-1] - time[0]) * frequency >= np.array(_ORBIT)
    design = np.hstack([np.ones((len(time), 1)), waves.real, -waves.imag])
    solution, noise = _solved(design, signals)
    count = len(tones)
    return LevitatedModel(
        frequency=frequency,
        tones=tones,
        hum=hum,
        mean=solution[0],
        amplitudes=solution[1 : 1 + count] + 1j * solution[1 + count :],
        noise=noise,
        start=float(time[0]),
        end=float(time[-1]),
    )


def _solved(design: Array, signals: Array) -> tuple[Array, Array]:
    """Coefficients (K, S) and scatter (S,) by least squares; channel by channel if some are missing."""
    known = np.isfinite(signals)
    if known.all():
        solution = np.linalg.lstsq(design, signals, rcond=None)[0]
        rest = signals - design @ solution
        free = max(len(design) - design.shape[1], 1)
        return np.asarray(solution), np.asarray(np.sqrt(np.sum(rest**2, axis=0) / free))
    solution = np.full((design.shape[1], signals.shape[1]), np.nan)
    noise = np.full(signals.shape[1], np.nan)
    for c in np.flatnonzero(np.count_nonzero(known, axis=0) > 2 * design.shape[1]):
        own, scatter = _solved(design[known[:, c]], signals[known[:, c], c : c + 1])
        solution[:, c], noise[c] = own[:, 0], scatter[0]
    return np.asarray(solution), np.asarray(noise, dtype=np.float64)
