"""From the motion of the shaft to the numbers in a recording: sensors, disturbances, filter, quantisation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.reduction import RotorBasis

USUAL_FULL_SCALE = 600e-6
"""Largest reading of an eddy-current system [m]; chosen, not measured."""
OVERSAMPLING = 5
"""How much denser than the samples a signal is made before a filter or a lag; chosen, not measured."""
MAINS, SPEED_INTERVAL = 50.0, 0.01
"""Frequency of the hum [Hz]; time between two readings of the speed [s]."""
FILTER_ORDER = 4
"""Order of the Butterworth filter before the sampling; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class SensorChain:
    """How good the measuring chain is; the defaults are those of an ordinary eddy-current system."""

    sampling_rate: float = 20e3
    """Samples per second [Hz]."""
    gain_error: float = 0.01
    """Largest deviation of a gain from 1 [1]."""
    offset: float = 10e-6
    """Largest offset of a sensor [m]."""
    normal: bool = False
    """Whether these two are standard deviations of normal errors instead, as in an estimator's prior."""
    noise: float = 0.45e-6
    """Noise [m rms]."""
    hum: float = 0.1e-6
    """Amplitude of the mains hum [m]."""
    runout_1x: float = 0.3e-6
    runout_2x: float = 0.15e-6
    """Largest amplitude of electrical runout at once and twice per turn [m]."""
    bits: int = 16
    """Bits of the converter; 0 for none."""
    full_scale: float | None = None
    """Largest reading [m], in both directions; readings beyond are clipped. By default 0.6 mm, or twice the
    widest air gap where that is more."""
    anti_alias_frequency: float | None = None
    """Corner frequency of a Butterworth filter of fourth order before the sampling [Hz]."""
    flicker: float = 0.0
    """Noise with a power that falls as one over the frequency, beside the white one [m rms]."""
    clock_error: float = 0.0
    """How much longer the seconds of the recorder are than true ones [1]."""
    speed_delay: float = 0.0
    """How late the speed signal is [s]."""
    speed_noise: float = 2.0 * math.pi * 0.02
    """Noise of a speed reading [rad/s rms]."""
    speed_resolution: float = 2.0 * math.pi * 0.01
    """Step of the speed readings [rad/s]."""

    def __post_init__(self) -> None:
        corner = self.anti_alias_frequency
        if corner is not None and not 0.0 < corner < 0.5 * OVERSAMPLING * self.sampling_rate:
            raise UsageError(
                f"the corner frequency {corner!r} Hz does not fit a sampling rate of "
                f"{self.sampling_rate:g} Hz"
            )


_SIZES = ("gain_error", "offset", "noise", "hum", "runout_1x", "runout_2x", "speed_noise", "speed_resolution")
_NONE: dict[str, Any] = dict.fromkeys(_SIZES, 0.0)
PERFECT = SensorChain(bits=0, **_NONE)
"""Sensors without any error."""


def fitted_to(chain: SensorChain, machine: Machine) -> SensorChain:
    """The chain with a full scale that sees what a machine's rotor can do."""
    if chain.full_scale is not None:
        return chain
    widest = max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    return replace(chain, full_scale=max(USUAL_FULL_SCALE, 2.0 * widest))


@dataclass(frozen=True, kw_only=True)
class SensorErrors:
    """Errors of the sensors of one machine, the same in all its recordings; shape (S,) throughout."""

    gain: Array
    """Reading over true displacement [1]."""
    offset: Array
    """Reading of the centred rotor [m]."""
    runout_1x: NDArray[np.complex128]
    runout_2x: NDArray[np.complex128]
    """Complex amplitude of the runout [m] at rotor angle zero."""
    plane_shift: Array
    """How much nearer to the middle of the rotor the sensor stands than stated [m]."""
    cross_axis: Array
    """Reading per displacement a quarter turn ahead of the sensor's direction [1]."""
    follows_housing: Array
    """Share of the motion of the bearing's housing that the sensor moves with [1]."""
    time_constant: Array
    """Time constant of first order with which the reading follows [s]."""
    curvature: Array
    """Share by which it reads too little, over the square of the displacement [1/m²]."""


def drawn_errors(chain: SensorChain, sensors: int, random: np.random.Generator) -> SensorErrors:
    """Draw the errors of a machine's sensors within the limits of the chain."""
    drawn = random.standard_normal if chain.normal else lambda count: random.uniform(-1.0, 1.0, count)
    gain = 1.0 + chain.gain_error * drawn(sensors)
    offset = chain.offset * drawn(sensors)
    random.uniform(-1.0, 1.0, sensors)  # what was drawn of directions once
    size = random.uniform(0.3, 1.0, (2, sensors))
    turn = np.exp(2j * np.pi * random.uniform(0.0, 1.0, (2, sensors)))
    nothing = ("plane_shift", "cross_axis", "follows_housing", "time_constant", "curvature")
    return SensorErrors(
        gain=gain,
        offset=offset,
        runout_1x=chain.runout_1x * size[0] * turn[0],
        runout_2x=chain.runout_2x * size[1] * turn[1],
        **{name: np.zeros(sensors) for name in nothing},
    )


def along_sensors(model: DropModel, errors: SensorErrors, amplitudes: Array, supports: Array) -> Array:
    """Displacement along every true sensor before its gain [m], shape (N, S).

    From modal amplitudes (N, 2m), x amplitudes, then y; a bracket follows its support's motion (N, B, 2).
    """
    machine = model.machine
    angle = [float(sensor.angle) for sensor in machine.sensors]
    polarity = np.array([sensor.polarity for sensor in machine.sensors])
    c, s = np.array([(math.cos(a), math.sin(a)) for a in angle]).T
    across = errors.cross_axis
    directions = polarity[:, None] * np.column_stack([c - across * s, s + across * c])
    positions = np.asarray(machine.rotor.node_positions)
    shapes = [shape_at(positions, model.basis, place) for place in true_places(machine, errors)]
    rows = [np.concatenate([x * shape, y * shape]) for shape, (x, y) in zip(shapes, directions, strict=True)]
    names = [bearing.name for bearing in machine.touchdown_bearings]
    at = [names.index(sensor.bearing) for sensor in machine.sensors]
    moved = np.einsum("nsa,sa->ns", supports[:, at], directions)
    return np.asarray(amplitudes @ np.array(rows).T - errors.follows_housing * moved)


def true_places(machine: Machine, errors: SensorErrors) -> Array:
    """Distance of every sensor from node 1 [m], shape (S,)."""
    positions = np.asarray(machine.rotor.node_positions)
    places = positions[[sensor.node - 1 for sensor in machine.sensors]]
    middle = 0.5 * (positions[0] + positions[-1])
    return np.asarray(places + errors.plane_shift * np.copysign(1.0, middle - places))


def shape_at(positions: Array, basis: RotorBasis, place: float) -> Array:
    """Displacement per modal amplitude, shape (m,), anywhere along the rotor [m], by cubics."""
    if not positions[0] <= place <= positions[-1]:
        raise UsageError(
            f"a sensor plane at {1e3 * place:.4g} mm lies outside the rotor, which reaches from "
            f"{1e3 * positions[0]:.4g} to {1e3 * positions[-1]:.4g} mm; shift it less"
        )
    i = int(np.clip(np.searchsorted(positions, place, side="right") - 1, 0, len(positions) - 2))
    length = positions[i + 1] - positions[i]
    s = (place - positions[i]) / length
    left, right = basis.node_row(i + 1), basis.node_row(i + 2)
    slope_left, slope_right = basis.slope_row(i + 1), basis.slope_row(i + 2)
    return np.asarray(
        (1.0 - 3.0 * s**2 + 2.0 * s**3) * left
        + length * (s - 2.0 * s**2 + s**3) * slope_left
        + (3.0 * s**2 - 2.0 * s**3) * right
        + length * (s**3 - s**2) * slope_right
    )


def readings(
    along: Array,
    time: Array,
    angle: Array,
    chain: SensorChain,
    errors: SensorErrors,
    random: np.random.Generator,
) -> Array:
    """Readings of the sensors [m], shape (N, S), at the sampling rate.

    From the true displacement along them (M, S) [m], M = N without filter or lag, else five times as dense,
    at record times (M,) [s] and rotor angles (M,) [rad].
    """
    turn = np.exp(1j * angle)[:, None]
    along = along - errors.curvature * along**3
    signal = errors.gain * along + errors.offset
    signal = signal + (errors.runout_1x * turn + errors.runout_2x * turn**2).real
    signal = lagging(signal, errors.time_constant, chain.sampling_rate * oversampling(chain, errors))
    phase = random.uniform(0.0, 2.0 * np.pi, along.shape[1])
    signal = signal + chain.hum * np.cos(2.0 * np.pi * MAINS * time[:, None] + phase)
    if chain.anti_alias_frequency is not None:
        from scipy.signal import butter, sosfilt, sosfilt_zi

        rate = OVERSAMPLING * chain.sampling_rate
        sections = butter(FILTER_ORDER, chain.anti_alias_frequency, fs=rate, output="sos")
        start = sosfilt_zi(sections)[:, :, None] * signal[0]
        signal = np.asarray(sosfilt(sections, signal, axis=0, zi=start)[0])
    signal = signal[:: oversampling(chain, errors)]
    signal = signal + chain.noise * random.standard_normal(signal.shape)
    if chain.flicker > 0.0:
        signal = signal + chain.flicker * flicker_noise(random, signal.shape)
    return quantised(signal, chain)


def flicker_noise(random: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Noise (N, S) of rms 1 whose power falls as one over the frequency, from the first line on."""
    lines = np.fft.rfft(random.standard_normal(shape), axis=0)
    lines[0] = 0.0
    lines[1:] /= np.sqrt(np.arange(1, len(lines)))[:, None]
    noise = np.fft.irfft(lines, n=shape[0], axis=0)
    return np.asarray(noise / np.sqrt(np.mean(noise**2, axis=0)))


def oversampling(chain: SensorChain, errors: SensorErrors) -> int:
    """How much denser than the samples a signal is made before it passes filter or lag."""
    filtered = chain.anti_alias_frequency is not None or bool(np.any(errors.time_constant > 0.0))
    return OVERSAMPLING if filtered else 1


def lagging(signal: Array, time_constant: Array, rate: float) -> Array:
    """Signals (N, S) that follow with a lag of first order [s]; exact for straight lines between samples."""
    from scipy.signal import lfilter, lfilter_zi

    signal = signal.copy()
    for i in np.flatnonzero(time_constant > 0.0):
        step = 1.0 / (rate * time_constant[i])
        keeps = math.exp(-step)
        newest = 1.0 - (1.0 - keeps) / step
        upper, lower = [newest, 1.0 - keeps - newest], [1.0, -keeps]
        settled = lfilter_zi(upper, lower) * signal[0, i]
        signal[:, i] = lfilter(upper, lower, signal[:, i], zi=settled)[0]
    return signal


def quantised(signal: Array, chain: SensorChain) -> Array:
    """Readings after clipping and rounding to the steps of the converter [m]."""
    if chain.bits == 0:
        return signal
    step = 2.0 * (chain.full_scale or USUAL_FULL_SCALE) / 2.0**chain.bits
    top = 2 ** (chain.bits - 1)
    return np.asarray(step * np.clip(np.round(signal / step), -top, top - 1))


def speed_readings(
    time: Array, speed: Array, chain: SensorChain, random: np.random.Generator
) -> tuple[Array, Array]:
    """Times [s] and readings [rad/s] of the tacho, shape (K,): one per interval, with noise, rounded."""
    interval = max(1, round(SPEED_INTERVAL * chain.sampling_rate))
    first = int(random.integers(0, interval))
    chosen = np.arange(first, len(time), interval)
    values = speed[chosen] + chain.speed_noise * random.standard_normal(len(chosen))
    if chain.speed_resolution > 0.0:
        values = chain.speed_resolution * np.round(values / chain.speed_resolution)
    return time[chosen], values
