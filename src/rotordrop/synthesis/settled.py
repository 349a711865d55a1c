"""Where the rotor lies after the drop, at standstill, and the small swing it keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import SimulationError
from rotordrop.model import layout as L
from rotordrop.model.parameters import DropModel
from rotordrop.physics.pendulum import small_frequency
from rotordrop.simulation._rhs import drop_derivative
from rotordrop.simulation._sensitivity import drop_jacobian
from rotordrop.simulation.levitation import rigid_amplitudes

Array = NDArray[np.float64]

MOST_ITERATIONS = 100
SMALLEST_CHANGE = 1e-15


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Remaining swing of the rotor ends in the clearance circles.

    Attributes
    ----------
    amplitude, phase : ndarray, shape (B,)
        Angle of the swing at the first instant and its phase [rad].
    decay_time : float
        Time constant of its decay [s].
    """

    amplitude: Array
    phase: Array
    decay_time: float


def settled_coordinates(model: DropModel) -> Array:
    """Coordinates (modal amplitudes, races, supports), shape (n_q,), of the rotor at rest in its bearings.

    Newton's iteration on the equations of motion at standstill; the rotor lies straight down.
    """
    layout = model.layout
    state = layout.zeros()
    state[layout.modal_y] = _guess(model)
    parameters = model.parameters._replace(flags=np.zeros(L.N_FLAGS, dtype=np.int64))
    n_q, rows = layout.n_coordinates, slice(layout.n_coordinates, 2 * layout.n_coordinates)
    size = layout.rotor_angle + 1
    jacobian, change, work = (
        np.zeros((size, size)),
        layout.zeros(),
        np.empty((2, parameters.ball_cos.shape[1])),
    )
    for _ in range(MOST_ITERATIONS):
        drop_derivative(0.0, state, parameters, change, work)
        drop_jacobian(0.0, state, parameters, jacobian)
        step = np.linalg.solve(jacobian[rows, :n_q], -change[rows])
        moved = float(np.max(np.abs(step)))
        state[:n_q] += step * min(1.0, 2e-6 / max(moved, 1e-30))
        if moved < SMALLEST_CHANGE or moved < 1e-12 * float(np.max(np.abs(state[:n_q]))):
            return state[:n_q]
    raise SimulationError(
        f"no position of rest was found for the rotor of {model.machine.name!r} in {MOST_ITERATIONS} "
        "iterations; check contact and support stiffness"
    )


def _guess(model: DropModel) -> Array:
    """Straight rotor, pressed into the contacts by its weight."""
    p = model.parameters.bearing
    depth = (model.load_shares / p[:, L.CONTACT_STIFFNESS]) ** (1.0 / p[:, L.CONTACT_EXPONENT])
    down = p[:, L.AIR_GAP] + depth
    nodes = [bearing.node for bearing in model.machine.touchdown_bearings]
    positions = np.asarray(model.fe.node_positions)[np.array(nodes) - 1]
    return rigid_amplitudes(model, positions, -down[:, None])[:, 0]


def swinging_amplitudes(model: DropModel, coordinates: Array, swing: Swing, time: Array) -> Array:
    """Modal amplitudes, shape (N, 2m), of a settled rotor whose ends swing like pendulums."""
    layout = model.layout
    rest = coordinates[layout.modal_y]
    depth = np.abs(model.parameters.bearing_shape @ rest)
    decay = np.exp(-time / swing.decay_time)[:, None]
    turn = 2.0 * np.pi * np.array([small_frequency(d, float(model.machine.gravity)) for d in depth])
    angle = swing.amplitude * decay * np.cos(turn * time[:, None] + swing.phase)
    nodes = [bearing.node for bearing in model.machine.touchdown_bearings]
    positions = np.asarray(model.fe.node_positions)[np.array(nodes) - 1]
    per_end = rigid_amplitudes(model, positions, np.eye(len(nodes)))
    x = (depth * np.sin(angle)) @ per_end.T
    y = rest + (depth * (1.0 - np.cos(angle))) @ per_end.T
    return np.hstack([x, y])
