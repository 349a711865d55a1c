"""The rotor between power-off and first contact: a linear system with everything that still pushes it.

Between the magnetic bearings' last hold and the first contact the rotor is free, so its motion is a matrix
exponential: modes with gyroscopic coupling and damping, gravity, remanent forces that decay, unbalance that
turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import levitated_sag

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class FreeFall:
    """Linear model of the falling rotor; m modes per plane, A magnets, U unbalance planes, n states.

    The states are amplitudes in x, in y, their velocities in x, in y, the constant one (gravity), remanent
    forces (x, y) per magnetic bearing [N], and the turning unbalance (x, y) per plane [kg m].
    """

    model: DropModel
    """The rotor."""
    speed: float
    """Rotor speed [rad/s], constant during the fall."""
    nodes: tuple[int, ...]
    """Nodes of the unbalance planes, counted from 1."""
    planes: Array
    """Mode shapes at the unbalance planes, shape (U, m)."""
    system: Array
    """System matrix without the decay of the remanent forces [1/s], shape (n, n)."""

    @property
    def n_modes(self) -> int:
        """Modes per plane."""
        return len(self.model.parameters.eigenvalue)

    @property
    def n_magnets(self) -> int:
        """Number of magnetic bearings."""
        return len(self.model.parameters.magnet_shape)

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.system)

    @property
    def displacement(self) -> slice:
        """Amplitudes, those in x before those in y."""
        return slice(0, 2 * self.n_modes)

    @property
    def velocity(self) -> slice:
        """Velocities of the amplitudes."""
        return slice(2 * self.n_modes, 4 * self.n_modes)

    @property
    def one(self) -> int:
        """The constant one that carries gravity."""
        return 4 * self.n_modes

    @property
    def remanent(self) -> slice:
        """Remanent forces."""
        return slice(self.one + 1, self.one + 1 + 2 * self.n_magnets)

    @property
    def unbalance(self) -> slice:
        """Turning unbalances."""
        return slice(self.remanent.stop, self.size)

    def matrix(self, decay: float) -> Array:
        """System matrix [1/s], shape (n, n), with remanent forces that decay with a time constant [s]."""
        system = self.system.copy()
        forces = np.arange(self.remanent.start, self.remanent.stop)
        system[forces, forces] = -1.0 / decay
        return system

    def transition(self, decay: float, span: float) -> Array:
        """State at the end of a span [s] per state at its begin, shape (n, n)."""
        from scipy.linalg import expm

        return np.asarray(expm(self.matrix(decay) * span))

    def observed(self, rows: Array, decay: float, first: float, step: float, count: int) -> Array:
        """What sensors show of the initial state at evenly spaced times, shape (count, S, n).

        Parameters
        ----------
        rows : ndarray, shape (S, 2m)
            Displacement along each sensor per amplitude.
        decay : float
            Time constant of the remanent forces [s].
        first, step : float
            First time and distance of the times [s].
        count : int
            Number of times.
        """
        one = self.transition(decay, step)
        seen = np.zeros((rows.shape[0], self.size))
        seen[:, self.displacement] = rows
        seen = seen @ self.transition(decay, first)
        out = np.empty((count, *seen.shape))
        for k in range(count):
            out[k] = seen
            seen = seen @ one
        return out

    def synchronous(self) -> Array:
        """Displacement and velocity amplitudes of the orbit that turning forces hold, shape (4m, 2U + 2A).

        Columns come in pairs, a force along x and one along y at the instant looked at: first per unbalance
        plane [per kg m], then per magnetic bearing [per N].
        """
        p, m, w = self.model.parameters, self.n_modes, self.speed
        dynamic = np.diag(p.eigenvalue) - w * w * np.eye(m) + 1j * w * np.diag(p.damping) + w * w * p.polar
        forces = np.column_stack([w * w * self.planes.T, p.magnet_shape.T])
        if forces.shape[1] == 0 or w == 0.0:
            return np.zeros((4 * m, 2 * forces.shape[1]))
        response = np.linalg.solve(dynamic, forces.astype(np.complex128))
        columns = []
        for q in response.T:
            for turn in (1.0, 1j):
                c = q * turn
                columns.append(np.concatenate([c.real, c.imag, (1j * w * c).real, (1j * w * c).imag]))
        return np.column_stack(columns)


def build_free_fall(model: DropModel, speed: float, unbalance_nodes: tuple[int, ...]) -> FreeFall:
    """Linear model of a falling rotor from the model of the drop.

    Parameters
    ----------
    model : DropModel
        Rotor, magnetic bearings, gravity.
    speed : float
        Rotor speed [rad/s].
    unbalance_nodes : tuple of int
        Nodes at which unbalance may sit, counted from 1.
    """
    p = model.parameters
    m, n_a, n_u = len(p.eigenvalue), len(p.magnet_shape), len(unbalance_nodes)
    planes = np.array([model.basis.node_row(node) for node in unbalance_nodes]).reshape(n_u, m)
    system = np.zeros((4 * m + 1 + 2 * n_a + 2 * n_u,) * 2)
    x, y, vx, vy = (slice(k * m, (k + 1) * m) for k in range(4))
    system[x, vx] = system[y, vy] = np.eye(m)
    for place, rate in ((x, vx), (y, vy)):
        system[rate, place] = -np.diag(p.eigenvalue)
        system[rate, rate] = -np.diag(p.damping)
    system[vx, vy] = -speed * p.polar
    system[vy, vx] = speed * p.polar
    system[vy, 4 * m] = p.gravity
    for a in range(n_a):
        system[vx, 4 * m + 1 + 2 * a] = p.magnet_shape[a]
        system[vy, 4 * m + 2 + 2 * a] = p.magnet_shape[a]
    for u in range(n_u):
        i = 4 * m + 1 + 2 * n_a + 2 * u
        system[vx, i] = system[vy, i + 1] = speed**2 * planes[u]
        system[i, i + 1], system[i + 1, i] = -speed, speed
    return FreeFall(model=model, speed=speed, nodes=unbalance_nodes, planes=planes, system=system)


def sagging_amplitudes(model: DropModel) -> Array:
    """Amplitudes in y, shape (m,), of the levitated rotor's gravity sag; zero without known AMB planes."""
    if len({amb.node for amb in model.machine.ambs}) < 2:
        return np.zeros(len(model.parameters.eigenvalue))
    shape = levitated_sag(model.fe, model.machine)
    return np.asarray(model.basis.shapes.T @ (model.fe.mass @ shape))


def kernel_state(fall: FreeFall, state: Array, angle: float) -> tuple[Array, Array, Array]:
    """A state of the fall as the drop model takes it.

    Parameters
    ----------
    state : ndarray, shape (n,)
        State of the fall.
    angle : float
        Rotor angle there, which the unbalance columns are turned back by [rad].

    Returns
    -------
    state : ndarray
        State of the drop model, rotor angle zero.
    remanent : ndarray, shape (A, 2)
        Remanent forces there [N].
    unbalance : ndarray, shape (2, m)
        Modal unbalance of the kernel, cosine and sine [kg m / sqrt(kg)].
    """
    layout = fall.model.layout
    m = fall.n_modes
    whole = fall.model.at_rest()
    whole[layout.modal_x] = state[:m]
    whole[layout.modal_y] = state[m : 2 * m]
    whole[layout.velocity_of(layout.modal_x)] = state[2 * m : 3 * m]
    whole[layout.velocity_of(layout.modal_y)] = state[3 * m : 4 * m]
    whole[layout.rotor_speed] = fall.speed
    whole[layout.rotor_angle] = angle
    c, s = np.cos(angle), np.sin(angle)
    pairs = state[fall.unbalance].reshape(-1, 2)
    back = np.column_stack([c * pairs[:, 0] + s * pairs[:, 1], -s * pairs[:, 0] + c * pairs[:, 1]])
    return whole, state[fall.remanent].reshape(-1, 2).copy(), back.T @ fall.planes


MAGNET_FORCES = slice(L.REMANENT_X, L.REMANENT_Y + 1)
