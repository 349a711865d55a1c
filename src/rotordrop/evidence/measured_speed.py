"""Shaft speed from the readings of a tacho: where it stands at the drop, and how it falls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.series import SIGMA_OF_MEDIAN, median_of_five

if TYPE_CHECKING:
    from rotordrop.record.record import Record


BY_HAND_ERROR = 5e-3
"""Relative standard error of a speed given by hand [1]: a name plate or a display says no more."""

_FEW = 5
"""Readings without which those after the drop count too, and that a straight line needs [1] (chosen)."""
_BEFORE, _AFTER = 0.5, 0.2
"""Time before the drop whose readings count, and after it where they then do [s] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class SpeedAtDrop:
    """Speed when the rotor was let go."""

    value: float
    standard_error: float
    """Speed at the drop and its standard error [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class RotorAngle:
    """Angle of the rotor over a whole record, from the measured speed.

    Up to power-off the rotor turns evenly. Afterwards the angle is the integral of the readings, shifted so
    that they begin with the speed before; without readings it is known the less the more friction may have
    taken.
    """

    power_off: float
    """End of the even turning, in record time [s]."""
    turning: float
    """Speed until then [rad/s]."""
    knots: Array
    """Times from power-off on between which the speed changes evenly [s]; the first is power-off, shape (K,).
    """
    speed: Array
    """Speed there [rad/s], shape (K,)."""
    slowing_error: float = 0.0
    """Standard deviation of the deceleration after power-off where no speed was read [rad/s²]."""

    def at(self, time: Array) -> tuple[Array, Array]:
        """Angle [rad] at record times (N,), ``turning · time`` before power-off, and its deviation."""
        steps = np.diff(self.knots)
        turned = np.concatenate([[0.0], np.cumsum(0.5 * steps * (self.speed[1:] + self.speed[:-1]))])
        slope = np.append(np.diff(self.speed) / steps, 0.0)
        k = np.clip(np.searchsorted(self.knots, time, side="right") - 1, 0, len(self.knots) - 1)
        since = time - self.knots[k]
        after = turned[k] + since * (self.speed[k] + 0.5 * since * slope[k])
        angle = self.turning * self.power_off + np.where(
            time < self.power_off, self.turning * (time - self.power_off), after
        )
        free = np.maximum(time - self.power_off, 0.0)
        return angle, 0.5 * self.slowing_error * free**2


def rotor_angle(
    record: Record, power_off: float, turning: float, *, strongest_slowing: float = 0.0
) -> RotorAngle:
    """Angle of the rotor over a record, from power-off [s] and its speed before, without sign [rad/s].

    Where no speed was read after it, any slowing up to `strongest_slowing` [rad/s²] is equally likely.
    """
    measured = record.measured_speed
    later = measured is not None and np.flatnonzero((measured[0] > power_off) & np.isfinite(measured[1]))
    if measured is None or not np.any(later):
        slowing = 0.5 * strongest_slowing
        end = max(float(record.time[-1]), power_off + 1e-3)
        return RotorAngle(
            power_off=power_off,
            turning=turning,
            knots=np.array([power_off, end]),
            speed=np.array([turning, turning - slowing * (end - power_off)]),
            slowing_error=strongest_slowing / float(np.sqrt(12.0)),
        )
    time, readings = measured
    clean = np.abs(_without_outliers(readings[later]))
    begin = abs(speed_at_drop(record, power_off).value)
    return RotorAngle(
        power_off=power_off,
        turning=turning,
        knots=np.concatenate([[power_off], time[later]]),
        speed=np.concatenate([[turning], turning + clean - begin]),
    )


def speed_at_drop(record: Record, drop: float) -> SpeedAtDrop:
    """Speed at the drop, an instant in record time [s], from the readings before it, outliers aside.

    The readings before are taken as constant unless they clearly drift. Those after are left out of the value
    where there are any before: friction changes the speed within milliseconds of the first contact.

    Raises
    ------
    RecordError
        When the record has no speed near the drop.
    """
    time, readings = require_speed(record)
    if record.speed_by_hand:
        value = float(np.median(readings))
        return SpeedAtDrop(value=value, standard_error=BY_HAND_ERROR * abs(value))
    good = np.isfinite(readings)
    before = good & (time <= drop) & (time >= drop - _BEFORE)
    after = good & (time > drop) & (time <= drop + _AFTER)
    used = before if int(before.sum()) >= _FEW else before | after
    if int(used.sum()) < 2:
        raise RecordError(
            f"{record.name}: {int(used.sum())} speed readings within {_BEFORE:g} s of the drop at "
            f"{drop:.6g} s; the speed was read from {time[0]:.6g} s to {time[-1]:.6g} s"
        )
    when, values = time[used] - drop, readings[used]
    solution, scatter, covariance = _robust(np.ones((len(when), 1)), values)
    if len(when) >= _FEW:  # a straight line where its slope is beyond doubt
        line = _robust(np.column_stack([np.ones_like(when), when]), values)
        if abs(line[0][1]) > 4.0 * line[1] * float(np.sqrt(line[2][1, 1])):
            solution, scatter, covariance = line
    error = float(scatter * np.sqrt(covariance[0, 0]))
    return SpeedAtDrop(value=float(solution[0]), standard_error=error)


def require_speed(record: Record) -> tuple[Array, Array]:
    """Give the speed readings, time [s] and value [rad/s], or say that they are missing and what to do."""
    if record.speed_time is None or record.speed_readings is None:
        raise RecordError(
            f"{record.name} has no shaft speed beside {', '.join(record.channel_names)}; name its channel in "
            'a profile ([speed] channel = "..."), or give it by hand ([speed] constant = "60 Hz")'
        )
    return record.speed_time, record.speed_readings


def _robust(design: Array, values: Array) -> tuple[Array, float, Array]:
    """Least squares with Huber weights; gives solution, scatter and the unscaled covariance."""
    weights = np.ones(len(values))
    scatter = 0.0
    solution: Array = np.zeros(design.shape[1])
    for _ in range(12):
        found = np.linalg.lstsq(design * weights[:, None], values * weights, rcond=None)[0]
        solution = np.asarray(found, dtype=np.float64)
        rest = values - design @ solution
        scatter = float(SIGMA_OF_MEDIAN * np.median(np.abs(rest)))
        limit = 1.5 * max(scatter, 1e-9)
        weights = np.sqrt(np.minimum(1.0, limit / np.maximum(np.abs(rest), limit)))
    weighted = design * weights[:, None]
    return solution, scatter, np.asarray(np.linalg.pinv(weighted.T @ weighted), dtype=np.float64)


def _without_outliers(readings: Array) -> Array:
    middle = median_of_five(readings)
    rest = readings - middle
    limit = 6.0 * SIGMA_OF_MEDIAN * float(np.median(np.abs(rest))) + 1e-6 * float(np.max(np.abs(readings)))
    return np.where(np.abs(rest) > limit, middle, readings)
