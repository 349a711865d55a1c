"""Velocities and accelerations from displacements."""

from __future__ import annotations

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.recording import Array


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
