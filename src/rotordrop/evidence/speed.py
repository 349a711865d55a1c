"""Rotor speed after power-off: exponential profile and its aerodynamic part (Neisi 2020, eq. 13).

A recorded speed holds the friction of the touchdown bearings already. In the first second they take speed
once, to spin up the races; the air takes it all the time. So the record is fitted by ``n0 e^(−t/τ) − Δ (1 −
e^(−t/s))``: τ is the aerodynamic time constant that the simulation uses beside its own friction, Δ what
friction took.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.measured_speed import require_speed, speed_at_drop
from rotordrop.known import NINETY, Known
from rotordrop.record.record import Record

LONGEST = 2.0
"""Part of the record after the drop that is fitted [s]; the law in time holds for about a second."""

SEPARABLE = 0.6
"""Shortest record after the drop from which friction and air can be told apart [s] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class SpeedFit:
    """Speed at power-off and how it falls."""

    initial: float
    """Speed at power-off [rad/s]."""
    initial_error: float
    """Its standard error [rad/s]."""
    profile_time_constant: float
    """Time constant of a plain exponential through the record [s], friction included (the paper's profile).
    """
    aero_time_constant: Known
    """Time constant of the aerodynamic part [s]."""
    friction_loss: float
    """Speed that friction took at the touchdown bearings [rad/s]."""
    residual: float
    """Scatter of the speed readings about the fit [rad/s]."""
    note: str = ""
    """What to know about this fit; empty when nothing."""


def identify_speed(record: Record, power_off: float, *, turning: float | None = None) -> SpeedFit:
    """Speed at power-off [s, record time] and time constants from the speed readings of a record.

    The speed by the orbit of the levitated rotor [rad/s] is taken when the readings do not contradict it.

    Raises
    ------
    RecordError
        If the record has no speed near the drop.

    Notes
    -----
    Source: Neisi 2020, section 2.2 and eq. (13). Differs from the paper: what friction took is kept apart, so
    that it is not counted twice.
    """
    at_drop = speed_at_drop(record, power_off)
    initial, error = at_drop.value, max(at_drop.standard_error, 1e-4 * at_drop.value)
    # the orbit tells the speed better than its readings, where it does not contradict them
    if turning is not None and abs(turning - initial) < 5.0 * error + 2e-3 * initial:
        initial, error = turning, 1e-4 * turning
    time, readings = require_speed(record)
    since = time - power_off
    used = (since > 0.0) & (since <= LONGEST) & np.isfinite(readings)
    t, n = since[used], readings[used]
    short = len(t) < 8 or t[-1] < 0.1 or initial == 0.0
    plain = np.inf
    if not short:
        fall = np.log(np.maximum(n, 1e-3 * initial) / initial)
        rate = -float(fall @ t) / float(t @ t)
        plain = 1.0 / rate if rate > 1e-6 else np.inf
    if not short and t[-1] >= SEPARABLE:
        return _separated(t, n, initial, error, plain)
    undetermined = Known(value=plain, status="the record does not determine it", unit="s")
    return SpeedFit(
        initial=initial,
        initial_error=error,
        profile_time_constant=plain,
        aero_time_constant=undetermined if short else replace(undetermined, lower=plain),
        friction_loss=0.0,
        residual=0.0 if short else at_drop.scatter,
        note="the record does not show the speed fall; it is taken as constant"
        if short
        else f"{t[-1]:.2g} s of speed do not separate air from friction: all is taken as air",
    )


def _separated(t: Array, n: Array, initial: float, error: float, plain: float) -> SpeedFit:
    from scipy.optimize import least_squares

    def model(x: Array) -> Array:
        start, rate, loss, spin_up = x
        return np.asarray(start * np.exp(-rate * t) - loss * (1.0 - np.exp(-t / spin_up)))

    scatter = max(float(np.std(np.diff(n)) / np.sqrt(2.0)), 1e-4 * initial)

    def residual(x: Array) -> Array:
        return np.concatenate(
            [(model(x) - n) / scatter, [(x[0] - initial) / max(error, 1e-4 * initial), np.log(x[3] / 0.1)]]
        )

    rate = 0.0 if np.isinf(plain) else 1.0 / plain
    begin = np.array([initial, 0.9 * rate + 1e-4, 0.005 * initial + 1e-3, 0.1])
    found = least_squares(
        residual, begin, bounds=([0.5 * initial, 1e-6, 0.0, 0.01], [1.5 * initial, 10.0, 0.5 * initial, 0.6])
    )
    scale = max(float(found.fun @ found.fun) / max(len(t) - 4, 1), 1.0)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * scale
    sigma = float(np.sqrt(covariance[1, 1]))
    slow, mid, fast = (max(float(found.x[1]) + k * NINETY * sigma, 1e-6) for k in (-1, 0, 1))
    return SpeedFit(
        initial=initial,
        initial_error=error,
        profile_time_constant=plain,
        aero_time_constant=Known(
            value=1.0 / mid,
            status="determined" if sigma < 0.3 * mid else "the record does not determine it",
            standard_error=sigma / mid**2,
            interval_90=(1.0 / fast, 1.0 / slow),
            unit="s",
        ),
        friction_loss=float(found.x[2]),
        residual=float(np.std(model(found.x) - n)),
    )
