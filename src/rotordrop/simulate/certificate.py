"""How much a simulated drop can be trusted: energy balance, step error, truncation of the rotor's modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotordrop.arrays import Array

COMPARABLE_WINDOW = 0.02
"""Window [s] over which histories are compared point by point; later the drop is chaotic."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Error certificate of one simulated drop."""

    energy_residual: float
    """Largest imbalance of stored, dissipated and supplied energy [J]."""
    energy_scale: float
    """Energy it is to be compared with: the largest change of stored energy [J]."""
    peak_force: Array
    """Peak magnitude of the ball force [N], shape (B,)."""
    peak_change_tolerance: Array | None = None
    """Relative change of the peak in the first 20 ms when the tolerance is ten times tighter [1], shape (B,).
    """
    peak_change_truncation: Array | None = None
    """Relative change of the peak in the first 20 ms with eight more modes per plane [1], shape (B,)."""

    def sentence(self) -> str:
        """The certificate in words."""
        parts = [f"energy balanced to {self.energy_residual:.2g} J of {self.energy_scale:.3g} J"]
        if self.peak_change_tolerance is not None:
            parts.append(
                f"peak force in the first 20 ms moves {100 * np.max(self.peak_change_tolerance):.2g} % "
                "at a ten times tighter tolerance"
            )
        if self.peak_change_truncation is not None:
            parts.append(
                f"and {100 * np.max(self.peak_change_truncation):.2g} % with eight more modes per plane"
            )
        return ", ".join(parts)


def refined_peak(time: Array, values: Array) -> tuple[float, float]:
    """Peak of a sampled history and its time [s], by a parabola through the largest sample and its
    neighbours.

    Parameters
    ----------
    time : ndarray, shape (T,)
        Equidistant times [s].
    values : ndarray, shape (T,)
        History, for instance a force [N].
    """
    i = int(np.argmax(values))
    if i == 0 or i == len(values) - 1:
        return float(values[i]), float(time[i])
    left, middle, right = (float(values[j]) for j in (i - 1, i, i + 1))
    curvature = left - 2.0 * middle + right
    if curvature >= 0.0:
        return middle, float(time[i])
    shift = 0.5 * (left - right) / curvature
    return middle - 0.25 * (left - right) * shift, float(time[i] + shift * (time[i + 1] - time[i]))


def peaks_of(time: Array, force: Array, until: float = np.inf) -> Array:
    """Refined peaks [N], shape (B,), of force histories (T, B) up to a time [s]."""
    inside = time <= until
    return np.array([refined_peak(time[inside], force[inside, b])[0] for b in range(force.shape[1])])
