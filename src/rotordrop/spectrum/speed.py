"""The rotor speed of a coast-down as a smooth function of time, from a noisy or coarse recording."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.known import NINETY, Known, Status
from rotordrop.series import SIGMA_OF_MEDIAN, noise_by_differences
from rotordrop.units import format_moment


@dataclass(frozen=True, kw_only=True)
class FrequencyPath:
    """Frequency over time."""

    time: Array
    """[s], rising, shape (K,)."""
    frequency: Array
    """[Hz], shape (K,)."""

    def frequency_at(self, time: ArrayLike) -> Array:
        """Frequency [Hz] at times [s]; that of the nearest end beyond the path."""
        return np.interp(np.asarray(time, dtype=np.float64), self.time, self.frequency)

    def phase_over(self, time: Array) -> Array:
        """Phase [rad] over rising times [s], counted from the first of them."""
        frequency = self.frequency_at(time)
        steps = 0.5 * (frequency[1:] + frequency[:-1]) * np.diff(time)
        return 2.0 * math.pi * np.concatenate([[0.0], np.cumsum(steps)])


LOG_TIME_UNIT = 0.3
"""Time [s] after power-off below which the speed may bend fast (the races spin up); later it bends ever
slower."""

MOST_BLOCKS = 800
"""Blocks of equal logarithmic time, at most, whose means the curve is drawn through: what is left of the
curvature within a block moves the speed by about 5e-6 of itself."""

OUTLIER = 6.0
"""Standard deviations [1] off the curve from which a recorded speed is left out (chosen)."""

TURNING_SHARE = 0.02
"""Share of the highest speed [1] above which the rotor counts as turning when the noise is judged
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class SpeedProfile:
    """Smooth rotor speed over time; gives speed, angle and change of speed at any time."""

    time: Array
    """Knots [s], shape (K,)."""
    speed: Array
    """Speed at the knots [rad/s], shape (K,)."""
    noise: float
    """Standard deviation of the recorded speed about the profile [rad/s]; 0 for an exact speed."""
    rejected: int
    """Recorded values left out as outliers [1]."""
    _curve: scipy.interpolate.PPoly
    _angle: scipy.interpolate.PPoly

    def speed_at(self, time: ArrayLike) -> Array:
        """Rotor speed [rad/s] at times [s]; constant beyond the ends of the profile."""
        return cast(Array, self._curve(self._inside(time)))

    def change_at(self, time: ArrayLike) -> Array:
        """Change of rotor speed [rad/s²] at times [s]."""
        return cast(Array, self._curve(self._inside(time), 1))

    def angle_at(self, time: ArrayLike) -> Array:
        """Rotor angle [rad] at times [s], counted from the start of the profile."""
        t = np.asarray(time, dtype=np.float64)
        inside = self._inside(t)
        beyond = (t - inside) * self._curve(inside)
        return cast(Array, self._angle(inside) + beyond)

    def _inside(self, time: ArrayLike) -> Array:
        return np.clip(np.asarray(time, dtype=np.float64), self.time[0], self.time[-1])


def exact_speed_profile(time: ArrayLike, speed: ArrayLike) -> SpeedProfile:
    """Take a speed without noise (a simulation's, a shaft encoder's) as it is.

    Times (K,) [s] rise, with the speed (K,) [rad/s].
    """
    t, omega = _checked(time, speed)
    return _profile(t, omega, noise=0.0, rejected=0)


def fit_speed_profile(time: ArrayLike, speed: ArrayLike, *, power_off: float | None = None) -> SpeedProfile:
    """Draw a smooth curve through a recorded speed, without following its noise or its steps.

    Before power-off the speed is taken as constant. After it a smoothing spline is drawn over logarithmic
    time, so that the fast first second keeps its shape while the long tail is averaged over seconds; how
    much to smooth is found by generalised cross-validation. Values far off the curve are left out and
    counted.

    Times (K,) [s] rise, with the recorded speed (K,) [rad/s]; the coast-down starts at power-off [s], the
    first time if not given.

    Source: own method; the error of the speed it leaves is about a tenth of the noise of a speed recorded 20
    times per second.
    """
    t, omega = _checked(time, speed)
    start = float(t[0]) if power_off is None else power_off
    before, after = t < start, t >= start
    if after.sum() < 8:
        raise RecordError(
            f"speed profile: {int(after.sum())} recorded speeds after power-off at {format_moment(start)}, "
            f"at least 8 are needed"
        )
    log_time = np.log1p((t[after] - start) / LOG_TIME_UNIT)
    smooth, noise, rejected = _smooth_without_outliers(log_time, omega[after])
    blocks, _, _ = _block_means(log_time, omega[after])
    knots = np.unique(np.concatenate([log_time[:1], blocks, np.linspace(0.0, log_time[-1], 400)]))
    knot_time = start + LOG_TIME_UNIT * np.expm1(knots)
    knot_speed = smooth(knots)  # a rotor that coasts down stops; it does not turn back
    knot_speed = np.maximum(knot_speed, 0.0) if omega[after][0] >= 0.0 else np.minimum(knot_speed, 0.0)
    if before.any():
        level = float(np.median(omega[before]))
        lead = np.linspace(t[0], start, 20, endpoint=False)
        knot_time = np.concatenate([lead, knot_time])
        knot_speed = np.concatenate([np.full(lead.size, level), knot_speed])
    return _profile(knot_time, knot_speed, noise=noise, rejected=rejected)


def _profile(time: Array, speed: Array, *, noise: float, rejected: int) -> SpeedProfile:
    curve = scipy.interpolate.CubicSpline(time, speed)
    return SpeedProfile(
        time=time, speed=speed, noise=noise, rejected=rejected, _curve=curve, _angle=curve.antiderivative()
    )


def _checked(time: ArrayLike, speed: ArrayLike) -> tuple[Array, Array]:
    t = np.asarray(time, dtype=np.float64)
    omega = np.asarray(speed, dtype=np.float64)
    if t.shape != omega.shape or t.ndim != 1:
        raise RecordError(
            f"speed profile: time has shape {t.shape} and speed {omega.shape}, expected two equal (K,)"
        )
    valid = np.isfinite(t) & np.isfinite(omega)
    t, omega = t[valid], omega[valid]
    if t.size < 8:
        raise RecordError(f"speed profile: {t.size} valid recorded speeds, at least 8 are needed")
    backwards = np.flatnonzero(np.diff(t) <= 0.0)
    if backwards.size:
        at = backwards[0]
        raise RecordError(
            f"speed profile: time does not rise at value {at + 1} ({t[at]:.6f} s, then {t[at + 1]:.6f} s)"
        )
    return t, omega


def _block_means(log_time: Array, speed: Array) -> tuple[Array, Array, Array]:
    """Means of neighbouring values, and how many there are: late in a coast-down a second holds one bend."""
    block = (log_time * (MOST_BLOCKS / max(float(log_time[-1]), 1e-300))).astype(np.intp)
    first = np.flatnonzero(np.diff(block, prepend=-1))
    count = np.diff(np.append(first, len(block))).astype(np.float64)
    return np.add.reduceat(log_time, first) / count, np.add.reduceat(speed, first) / count, count


def _smooth_without_outliers(log_time: Array, speed: Array) -> tuple[Model, float, int]:
    # A first look through a running median keeps one missing or double tacho pulse from bending the curve.
    padded = np.pad(speed, 2, mode="edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    # Standstill, where a tacho often reads exactly zero, must not make the noise look small.
    turning = np.abs(median) > TURNING_SHARE * float(np.abs(median).max())
    least = 1e-12 * float(np.abs(speed).max())
    keep = np.abs(speed - median) <= OUTLIER * max(_spread((speed - median)[turning]), least)
    for _ in range(2):
        place, mean, count = _block_means(log_time[keep], speed[keep])
        smooth = scipy.interpolate.make_smoothing_spline(place, mean, w=count)
        residual = speed - smooth(log_time)
        spread = _spread(residual[keep & turning])
        before, keep = keep, np.abs(residual) <= OUTLIER * max(spread, least)
        if np.array_equal(before, keep):  # the same curve would be drawn again
            break
    return smooth, spread, int((~keep).sum())


def _spread(values: Array) -> float:
    """Standard deviation [unit of the values], by the median so that outliers do not count."""
    scaled = SIGMA_OF_MEDIAN * float(np.median(np.abs(values - np.median(values))))
    return scaled if scaled > 0.0 else float(np.std(values))


Model = Callable[[Array], Array]
Law = Callable[[Array, Array], Array]
"""Speed [rad/s] by the parameters of a law and the time since its start [s]."""

MOST_VALUES = 2000
CLOSE_ENOUGH = 1e-4
"""Residual over the highest speed [1] below which a law holds even where the speed has less noise."""


@dataclass(frozen=True, kw_only=True)
class FittedLaw:
    """A law of the speed, fitted to a recorded coast-down."""

    initial_speed: Known
    """[rad/s] at ``start``."""
    start: float
    end: float
    """Window of the fit [s]."""
    residual_rms: float
    """Size of the recorded speed about the law [rad/s]."""
    noise: float
    """What of it is noise of the recording [rad/s]; the rest says that the law is another."""
    statement: str
    """Whether the law holds, in a sentence."""
    _law: Law
    _parameters: Array

    def speed_at(self, time: ArrayLike) -> Array:
        """Fitted speed [rad/s] at times [s] from ``start`` on; standstill is kept."""
        return self._law(self._parameters, np.asarray(time, dtype=np.float64) - self.start)


@dataclass(frozen=True, kw_only=True)
class ExponentialFit(FittedLaw):
    """Exponential coast-down ``ω = ω_0 e^(−(t − t_0)/τ)`` fitted to a recorded speed."""

    time_constant: Known
    """τ [s]."""


@dataclass(frozen=True, kw_only=True)
class DragFit(FittedLaw):
    """Deceleration ``−(constant + linear ω + quadratic ω²)`` fitted to a recorded speed."""

    constant: Known
    """Dry part [rad/s²]: friction of balls and races, which a recorded speed always contains."""
    linear: Known
    """Laminar drag per polar inertia of rotor and races [1/s]; times that inertia it is the machine file's
    ``aero_linear``."""
    quadratic: Known
    """Turbulent drag per polar inertia of rotor and races [1/rad]; times that inertia it is the machine
    file's ``aero_quadratic``."""


def fit_exponential(time: ArrayLike, speed: ArrayLike, *, start: float) -> ExponentialFit:
    """Fit one time constant to a recorded coast-down and say how far from exponential it is.

    Times (K,) [s] rise, with the recorded speed (K,) [rad/s], which is fitted from ``start`` [s] on.

    Source: Neisi 2020, eq. (13). The intervals are widened where neighbouring residuals are alike, because a
    wrong law does not scatter like noise.
    """
    t, omega = _window(time, speed, start)
    guess = max(_half_time(t, omega, start) / math.log(2.0), 1e-6)
    scale = np.array([max(float(omega[0]), 1e-9), guess])
    lower = np.array([0.0, 1e-6])
    units = {"initial_speed": "rad/s", "time_constant": "s"}
    return ExponentialFit(**_fitted("One time constant", _exponential, t, omega, start, scale, lower, units))


def fit_drag(time: ArrayLike, speed: ArrayLike, *, start: float) -> DragFit:
    """Fit dry, linear and quadratic drag to a recorded coast-down, each with its interval.

    Let the window start after the races have spun up (about a second after the drop): until then the rotor
    hands spin to the races, which is no drag.

    Times (K,) [s] rise, with the recorded speed (K,) [rad/s], which is fitted from ``start`` [s] on.

    Source: drag laws behind Neisi 2020, eq. (13). Differs from the paper: the deceleration is a function of
    speed, with a dry part that the recorded speed contains besides the aerodynamic ones.
    """
    t, omega = _window(time, speed, start)
    # each of the three drags alone would stop about half of the rotor's speed in the half time
    half, first = max(_half_time(t, omega, float(t[0])), 1e-6), float(omega[0])
    scale = np.array([first, 0.05 * first / half, 0.5 / half, 0.1 / (half * first)])
    units = {"initial_speed": "rad/s", "constant": "rad/s²", "linear": "1/s", "quadratic": "1/rad"}
    said = "Dry, linear and quadratic drag"
    return DragFit(**_fitted(said, _drag_solution, t, omega, start, scale, np.zeros(4), units))


def _fitted(
    said: str,
    law: Law,
    time: Array,
    speed: Array,
    start: float,
    scale: Array,
    lower: Array,
    units: Mapping[str, str],
) -> dict[str, Any]:
    """A law fitted to recorded speeds [rad/s] from a first guess, by the fields of `FittedLaw` and the units
    of its parameters.
    """
    expected = _reading(time, speed)

    def model(p: Array) -> Array:
        return expected(law(p, time - start))

    parameters, errors = _fit(model, speed, scale, lower=lower)
    residual = speed - model(parameters)
    rms, noise = float(np.sqrt(np.mean(residual**2))), neighbour_noise(speed)
    follows = not rms > max(1.5 * noise, CLOSE_ENOUGH * float(speed.max()))
    found = {
        name: _positive(value, error, guess, unit)
        for (name, unit), value, error, guess in zip(
            units.items(), parameters.tolist(), errors.tolist(), scale.tolist(), strict=True
        )
    }
    return found | {
        "start": start,
        "end": float(time[-1]),
        "residual_rms": rms,
        "noise": noise,
        "statement": f"{said}: residual {rms / math.tau:.2g} Hz rms, noise of the speed "
        f"{noise / math.tau:.2g} Hz; the speed {'follows' if follows else 'does not follow'} this law.",
        "_law": law,
        "_parameters": parameters,
    }


def _positive(value: float, error: float, guess: float, unit: str) -> Known:
    status: Status = "determined"
    if value <= 0.01 * error:
        status = "at its bound"
    elif error > 0.5 * abs(value):
        status = "the record does not determine it"
    return Known(
        value=value,
        status=status,
        standard_error=error,
        interval_90=(max(value - NINETY * error, 0.0), value + NINETY * error),
        start=guess,
        bounds=(0.0, math.inf),
        unit=unit,
    )


def _exponential(parameters: Array, time: Array) -> Array:
    """Speed [rad/s] by initial speed and time constant at times [s] from its beginning."""
    return cast(Array, parameters[0] * np.exp(-time / parameters[1]))


def find_standstill(time: ArrayLike, speed: ArrayLike) -> Known:
    """Find when the rotor stops [s], by carrying its last slow turning to zero speed.

    Dry and linear drag bring the rotor to rest at a definite time, which is fitted to the recorded speed from
    a twentieth of its highest value on, with allowance for a tacho that cannot read below zero. What stops is
    the mean turning: a rotor that still swings in the race rocks a little about its axis. A record that ends
    before, or a rotor that only creeps ever slower, is said to determine nothing; ``lower`` is then the time
    up to which it surely turned.

    Times (K,) [s] rise, with the recorded speed (K,) [rad/s].
    """
    t, omega = _window(time, speed, -math.inf)
    turning = np.flatnonzero(omega > 0.05 * float(omega.max()))
    t, omega = t[turning[-1] :], omega[turning[-1] :]
    noise = max(neighbour_noise(omega), 1e-9 * float(omega.max()))
    last_seen = float(t[np.flatnonzero(omega > 5.0 * noise)[-1]])
    if t.size < 8:
        return Known(value=float(t[-1]), status="the record does not determine it", lower=last_seen, unit="s")
    expected = _reading(t, omega)
    span = float(t[-1] - t[0])
    scale = np.array([max(last_seen - float(t[0]), 1e-3 * span), 3.0 / span, float(omega[0])])

    def model(p: Array) -> Array:
        left = np.maximum(p[0] - (t - t[0]), 0.0)
        return expected(p[2] * np.expm1(p[1] * left) / np.expm1(p[1] * p[0]))

    upper = np.array([4.0 * span, 300.0 / span, np.inf])
    found, errors = _fit(model, omega, scale, lower=np.array([1e-3 * span, 1e-3 / span, 0.0]), upper=upper)
    error = float(errors[0])
    value = float(t[0]) + float(found[0])
    determined = value + NINETY * error < t[-1] and error < 0.2 * found[0]
    status: Status = "determined" if determined else "the record does not determine it"
    return Known(
        value=value if determined else float(t[-1]),
        status=status,
        standard_error=error if determined else None,
        # what is seen after it may rock or turn
        interval_90=(value - NINETY * error, max(value, last_seen) + NINETY * error) if determined else None,
        lower=last_seen,
        unit="s",
    )


def neighbour_noise(speed: ArrayLike) -> float:
    """Noise of a smooth recorded speed [rad/s], from second differences of neighbouring values."""
    values = np.asarray(speed, dtype=np.float64)
    turning = values[values > 0.02 * float(values.max())] if values.size else values
    if turning.size < 4:
        return 0.0
    return noise_by_differences(turning, 2)


def _fit(
    model: Model, measured: Array, scale: Array, *, lower: Array, upper: Array | float = math.inf
) -> tuple[Array, Array]:
    """Least squares in scaled parameters, with errors from the residual and its run of equal signs."""
    bounds = lower / scale, upper / scale
    solution = scipy.optimize.least_squares(
        lambda q: model(q * scale) - measured,
        np.clip(np.ones(scale.size), *bounds),
        bounds=bounds,
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
    )
    residual = solution.fun
    freedom = max(residual.size - scale.size, 1)
    variance = float(residual @ residual) / freedom * inflation(residual)
    covariance = variance * np.linalg.pinv(solution.jac.T @ solution.jac)
    return solution.x * scale, np.sqrt(np.maximum(np.diag(covariance), 1e-300)) * scale


def inflation(residual: Array) -> float:
    """How much fewer independent residuals there are than residuals [1]."""
    power = float(residual @ residual)
    if power == 0.0:
        return 1.0
    likeness = min(max(float(residual[1:] @ residual[:-1]) / power, 0.0), 0.98)
    return (1.0 + likeness) / (1.0 - likeness)


def _window(time: ArrayLike, speed: ArrayLike, start: float) -> tuple[Array, Array]:
    t = np.asarray(time, dtype=np.float64)
    omega = np.asarray(speed, dtype=np.float64)
    inside = (t >= start) & np.isfinite(omega)
    t, omega = t[inside], omega[inside]
    if t.size < 8 or float(omega.max()) <= 0.0:
        raise RecordError(
            f"speed fit: {t.size} recorded speeds between {format_moment(start)} and the end, at least 8 and "
            "a turning rotor are needed"
        )
    block = -(-t.size // MOST_VALUES)
    whole = t.size // block * block
    return t[:whole].reshape(-1, block).mean(1), omega[:whole].reshape(-1, block).mean(1)


def _reading(time: Array, speed: Array) -> Model:
    """What a tacho shows on average at a true speed: noise that cannot fall below zero lifts slow
    readings.
    """
    noise = neighbour_noise(speed)
    zeros = int(np.sum(speed == 0.0))
    cut_off = float(speed.min()) >= 0.0 and 2 < zeros < 0.9 * time.size and noise > 0.0
    if not cut_off:
        return lambda omega: omega

    def mean_reading(omega: Array) -> Array:
        z = omega / noise
        density = np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
        return cast(Array, omega * scipy.special.ndtr(z) + noise * density)

    return mean_reading


def _half_time(time: Array, speed: Array, start: float) -> float:
    below = np.flatnonzero(speed <= 0.5 * speed[0])
    return float((time[below[0]] if below.size else time[-1]) - start)


def _drag_solution(parameters: Array, time: Array) -> Array:
    """Speed [rad/s] under dry, linear and quadratic drag at times [s] from its beginning; standstill is kept.

    The solution of Riccati's equation with constant coefficients: ``root`` turns from tanh over t/2 to tan as
    dry and quadratic drag outweigh the linear one.
    """
    first, dry, linear, quadratic = (float(p) for p in parameters)
    balance = linear**2 - 4.0 * dry * quadratic
    rate = math.sqrt(abs(balance))
    half = 0.5 * rate * time
    stop = linear * first + 2.0 * dry  # of the root at standstill, times the first speed
    if rate * float(np.max(time, initial=0.0)) < 1e-6:
        root = 0.5 * time
    elif balance > 0.0:
        root = np.tanh(half) / rate
    else:
        # beyond standstill the tangent may pass its pole
        root = np.tan(np.minimum(half, math.atan2(rate * first, stop))) / rate
    speed = (first - stop * root) / (1.0 + (2.0 * quadratic * first + linear) * root)
    return np.maximum(speed, 0.0)
