"""What the sensors show while the rotor still levitates, and velocities from displacements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.measurement.recording import Array

if TYPE_CHECKING:
    from rotordrop.measurement.record import Record

MAINS = (50.0, 60.0)
"""Mains frequencies looked for [Hz]."""

_APART = 1.5
"""Two tones are told apart when they differ by this many cycles over the window."""

_FEWEST_TURNS = 2.0


@dataclass(frozen=True, kw_only=True)
class LevitatedModel:
    """Readings of the levitated rotor: a constant, tones at 1X and 2X, and mains hum.

    The tones hold orbit and electrical runout together: one cannot tell them apart while the rotor is
    levitated.

    Attributes
    ----------
    frequency : float
        Speed found from the 1X tone [Hz].
    tones : tuple of float
        Frequencies of the model [Hz]: 1X, 2X and, where it can be told apart, the hum.
    hum : float or None
        Mains frequency among `tones` [Hz].
    mean : array, shape (S,)
        Constant part [m].
    amplitudes : array, shape (F, S), complex
        Tone f reads ``Re(amplitude · exp(2πi f t))`` [m, zero to peak], t in record time.
    noise : array, shape (S,)
        Standard deviation of what is left [m].
    start, end : float
        Window the model was fitted to [s].
    """

    frequency: float
    tones: tuple[float, ...]
    hum: float | None
    mean: Array
    amplitudes: np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
    noise: Array
    start: float
    end: float

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


def fit_levitated(record: Record, end: float, *, speed: float, start: float | None = None) -> LevitatedModel:
    """Fit the readings before the drop by a constant, 1X, 2X and hum.

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
    RecordError
        When fewer than two revolutions lie before the drop.
    """
    start = float(record.time[0]) if start is None else start
    keep = (record.time >= start) & (record.time <= end)
    time, signals = record.time[keep], record.signals[keep]
    span = float(time[-1] - time[0]) if len(time) > 1 else 0.0
    nominal = abs(speed) / (2 * np.pi)
    if span * nominal < _FEWEST_TURNS:
        raise RecordError(
            f"{record.name}: {max(span, 0.0) * 1e3:.3g} ms of levitated rotor before {end:.6g} s are "
            f"{max(span * nominal, 0.0):.2g} revolutions; at least {_FEWEST_TURNS:g} are needed: record with "
            "more "
            "pre-trigger"
        )
    hum = _choose_hum(time, signals, nominal, span)
    frequency = _refined(time, signals, nominal, hum, span)
    return _fit(time, signals, frequency, hum)


def _choose_hum(time: Array, signals: Array, frequency: float, span: float) -> float | None:
    """The mains frequency that explains more, if it can be told apart from 1X and 2X."""
    possible = [
        mains for mains in MAINS if all(abs(mains - k * frequency) * span > _APART for k in (0, 1, 2))
    ]
    if not possible:
        return None
    return min(possible, key=lambda mains: float(np.sum(_fit(time, signals, frequency, mains).noise ** 2)))


def _refined(time: Array, signals: Array, nominal: float, hum: float | None, span: float) -> float:
    """Find the frequency of the 1X tone by golden section around the speed reading."""
    from scipy.optimize import minimize_scalar

    reach = min(0.5 / span, 0.02 * nominal)

    def misfit(frequency: float) -> float:
        return float(np.sum(_fit(time, signals, frequency, hum).noise ** 2))

    found = minimize_scalar(
        misfit, bounds=(nominal - reach, nominal + reach), method="bounded", options={"xatol": 1e-5 * nominal}
    )
    return float(found.x)


def _fit(time: Array, signals: Array, frequency: float, hum: float | None) -> LevitatedModel:
    tones = (frequency, 2 * frequency) + ((hum,) if hum is not None else ())
    waves = np.exp(2j * np.pi * np.outer(time, tones))
    design = np.hstack([np.ones((len(time), 1)), waves.real, -waves.imag])
    solution = np.linalg.lstsq(design, signals, rcond=None)[0]
    rest = signals - design @ solution
    count = len(tones)
    free = max(len(time) - design.shape[1], 1)
    return LevitatedModel(
        frequency=frequency,
        tones=tones,
        hum=hum,
        mean=solution[0],
        amplitudes=solution[1 : 1 + count] + 1j * solution[1 + count :],
        noise=np.sqrt(np.sum(rest**2, axis=0) / free),
        start=float(time[0]),
        end=float(time[-1]),
    )


def without_hum(record: Record, model: LevitatedModel) -> Record:
    """Take the mains hum found in the levitated part off the whole record."""
    if model.hum is None:
        return record
    note = f"mains hum of {model.hum:g} Hz taken off"
    return replace(
        record, signals=record.signals - model.hum_readings(record.time), notes=(*record.notes, note)
    )


def velocity(values: Array, rate: float, *, width: float = 1e-3, order: int = 2) -> Array:
    """Velocity by a Savitzky–Golay filter along the first axis.

    Parameters
    ----------
    values : array, shape (N, ...)
        Displacement [m].
    rate : float
        Sampling rate [Hz].
    width : float
        Width of the window [s].
    order : int
        Order of the local polynomial.

    Returns
    -------
    array, shape (N, ...)
        Velocity [m/s]; less certain within half a window of the ends.
    """
    from scipy.signal import savgol_filter

    samples = max(round(width * rate) // 2 * 2 + 1, order + 2 - order % 2)
    if samples > len(values):
        raise RecordError(
            f"a velocity window of {width:g} s has {samples} samples; the record has {len(values)}"
        )
    return np.asarray(savgol_filter(values, samples, order, deriv=1, delta=1.0 / rate, axis=0))


def acceleration(values: Array, rate: float, *, width: float = 1e-3) -> Array:
    """Acceleration [m/s²] by a Savitzky–Golay filter of order 3 along the first axis, shape of `values`."""
    from scipy.signal import savgol_filter

    samples = max(round(width * rate) // 2 * 2 + 1, 5)
    return np.asarray(savgol_filter(values, samples, 3, deriv=2, delta=1.0 / rate, axis=0))


def local_polynomial(
    time: Array, values: Array, at: float, *, width: float = 2e-3, order: int = 2
) -> tuple[Array, Array, Array]:
    """Displacement and velocity at one instant from a polynomial through the samples on both sides.

    Parameters
    ----------
    time : array, shape (N,)
        Time [s].
    values : array, shape (N, ...)
        Displacement [m].
    at : float
        The instant [s].
    width : float
        Samples up to half of this away are used [s].
    order : int
        Order of the polynomial.

    Returns
    -------
    value, slope, slope_error : array
        Displacement [m], velocity [m/s] and its standard error [m/s], shape of one sample.
    """
    near = np.abs(time - at) <= width / 2
    if int(near.sum()) <= order + 1:
        raise RecordError(
            f"{int(near.sum())} samples within {width / 2:g} s of {at:.6g} s; a polynomial of order {order} "
            "needs "
            f"at least {order + 2}: widen the window"
        )
    scaled = (time[near] - at) / (width / 2)
    design = np.vander(scaled, order + 1, increasing=True)
    flat = values[near].reshape(int(near.sum()), -1)
    solution = np.linalg.lstsq(design, flat, rcond=None)[0]
    rest = flat - design @ solution
    scatter = np.sqrt(np.sum(rest**2, axis=0) / (len(flat) - order - 1))
    spread = float(np.sqrt(np.linalg.inv(design.T @ design)[1, 1]))
    shape = values.shape[1:]
    return (
        solution[0].reshape(shape),
        (solution[1] / (width / 2)).reshape(shape),
        (scatter * spread / (width / 2)).reshape(shape),
    )
