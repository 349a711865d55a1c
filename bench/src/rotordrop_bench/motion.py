"""The true motion of the rotor at any time: levitated before power-off, simulated afterwards."""

from __future__ import annotations

import numpy as np

from rotordrop.arrays import Array
from rotordrop.simulate.levitation import levitated_orbit, levitated_static
from rotordrop.simulate.result import DropResult
from rotordrop_bench.event import DropConditions, HiddenMachine


def true_motion(
    hidden: HiddenMachine, result: DropResult, conditions: DropConditions, time: Array
) -> tuple[Array, Array, Array]:
    """Modal amplitudes (N, 2m), rotor angle [rad] and speed [rad/s] at times from the true power-off [s].

    Before power-off the levitated orbit, afterwards the simulated drop, between its samples by cubics.
    """
    from scipy.interpolate import CubicHermiteSpline

    layout = hidden.model.layout
    m = layout.n_modes
    floating = time < 0.0
    orbit = levitated_orbit(hidden.model, conditions.speed, conditions.start.orbit)
    static, _ = levitated_static(hidden.model, conditions.start.offset)
    angle = conditions.start.rotor_angle + conditions.speed * time
    turn = np.exp(1j * angle[floating])[:, None]
    amplitudes = np.empty((len(time), 2 * m))
    amplitudes[floating] = static.T.ravel() + (turn * orbit.T.ravel()).real
    n_q = layout.n_coordinates
    states = result.state
    path = CubicHermiteSpline(result.time, states[:, : 2 * m], states[:, n_q : n_q + 2 * m])
    amplitudes[~floating] = path(time[~floating])
    angle[~floating] = np.interp(time[~floating], result.time, states[:, layout.rotor_angle])
    speed = np.interp(time, result.time, result.speed)
    return amplitudes, angle, speed


def housing_motion(result: DropResult, time: Array) -> Array:
    """Displacement of the supports [m], shape (N, B, 2), at times from power-off [s]; at rest before it."""
    moved = result.support_displacement.reshape(len(result.time), -1)
    found = [np.interp(time, result.time, column) for column in moved.T]
    return np.stack(found, axis=-1).reshape(len(time), *result.support_displacement.shape[1:])
