"""Loads on the rotor and the acceleration of the ground: their value at a time and a speed."""

from __future__ import annotations

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.physics._compile import lean_kernel
from rotordrop.physics.elementary import power, sine_cosine


@lean_kernel
def load_now(row: Array, points: Array, t: float, omega: float) -> tuple[float, float]:
    """Force [N], or acceleration of the ground [m/s²], along x and y at a time [s] and a rotor speed [rad/s].

    A course over time is straight between its points and constant outside; else the value goes with a power
    of the speed or is a sine. Source: by definition of the keys of a machine file.
    """
    first, end = int(row[L.LOAD_FIRST]), int(row[L.LOAD_END])
    if end > first:
        if t <= points[first, 0]:
            return points[first, 1], points[first, 2]
        for i in range(first + 1, end):
            if t < points[i, 0]:
                share = (t - points[i - 1, 0]) / (points[i, 0] - points[i - 1, 0])
                x = points[i - 1, 1] + share * (points[i, 1] - points[i - 1, 1])
                y = points[i - 1, 2] + share * (points[i, 2] - points[i - 1, 2])
                return x, y
        return points[end - 1, 1], points[end - 1, 2]
    factor = 1.0
    if row[L.LOAD_EXPONENT] > 0.0:
        share = abs(omega) / row[L.LOAD_NOMINAL]
        factor = power(share, row[L.LOAD_EXPONENT]) if share > 0.0 else 0.0
    if row[L.LOAD_TURN] > 0.0:
        factor, _ = sine_cosine(row[L.LOAD_TURN] * t + row[L.LOAD_PHASE])
    return factor * row[L.LOAD_X], factor * row[L.LOAD_Y]
