"""The rotor speed of a coast-down as a smooth function of time, from a noisy or coarse recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, PPoly, make_smoothing_spline

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.series import SIGMA_OF_MEDIAN
from rotordrop.units import format_moment

LOG_TIME_UNIT = 0.3
"""Time [s] after power-off below which the speed may bend fast (the races spin up); later it bends ever
slower."""

MOST_BLOCKS = 800
"""Blocks of equal logarithmic time, at most, whose means the curve is drawn through: what is left of the
curvature within a block moves the speed by about 5e-6 of itself."""

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
    _curve: PPoly
    _angle: PPoly

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


def fit_speed_profile(
    time: ArrayLike, speed: ArrayLike, *, power_off: float | None = None, outlier_limit: float = 6.0
) -> SpeedProfile:
    """Draw a smooth curve through a recorded speed, without following its noise or its steps.

    Before power-off the speed is taken as constant. After it a smoothing spline is drawn over logarithmic
    time, so that the fast first second keeps its shape while the long tail is averaged over seconds; how
    much to smooth is found by generalised cross-validation. Values far off the curve are left out and
    counted.

    Times (K,) [s] rise, with the recorded speed (K,) [rad/s]; the coast-down starts at power-off [s], the
    first time if not given; the limit of outliers counts in standard deviations [1].

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
    smooth, noise, rejected = _smooth_without_outliers(log_time, omega[after], outlier_limit)
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
    curve = CubicSpline(time, speed)
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


def _smooth_without_outliers(log_time: Array, speed: Array, limit: float) -> tuple[CubicSpline, float, int]:
    # A first look through a running median keeps one missing or double tacho pulse from bending the curve.
    padded = np.pad(speed, 2, mode="edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    # Standstill, where a tacho often reads exactly zero, must not make the noise look small.
    turning = np.abs(median) > TURNING_SHARE * float(np.abs(median).max())
    least = 1e-12 * float(np.abs(speed).max())
    keep = np.abs(speed - median) <= limit * max(_spread((speed - median)[turning]), least)
    for _ in range(2):
        place, mean, count = _block_means(log_time[keep], speed[keep])
        smooth = make_smoothing_spline(place, mean, w=count)
        residual = speed - smooth(log_time)
        spread = _spread(residual[keep & turning])
        before, keep = keep, np.abs(residual) <= limit * max(spread, least)
        if np.array_equal(before, keep):  # the same curve would be drawn again
            break
    return smooth, spread, int((~keep).sum())


def _spread(values: Array) -> float:
    """Standard deviation [unit of the values], by the median so that outliers do not count."""
    scaled = SIGMA_OF_MEDIAN * float(np.median(np.abs(values - np.median(values))))
    return scaled if scaled > 0.0 else float(np.std(values))
