"""Initial state of the drop from a fit over the whole fall: the better of the two starts.

From power-off to the first contact the rotor is a linear system: modes with gyroscopic coupling and damping,
gravity, remanent forces that decay, unbalance that turns. Its motion is a matrix exponential. Its rigid and
bending modes, the remanent lift of the magnets and the unbalance are found together, by maximum posterior
probability, from the samples of the fall and from the orbit before it. The computed gravity sag of the
levitated rotor, whose release rings at the first bending mode, comes in as prior; the bending part of the
orbit follows from the forces that hold it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import IdentificationError
from rotordrop.evidence.events import DropInstant, PowerOff
from rotordrop.evidence.fall import REMANENT_SHARE, REMANENT_TIME
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.rest import AirGap, SettledRest
from rotordrop.evidence.sensing import Sensing
from rotordrop.evidence.speed import SpeedFit
from rotordrop.known import NINETY
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.record.axes import along_sensors
from rotordrop.record.record import Record
from rotordrop.record.recording import Array
from rotordrop.record.speed import RotorAngle
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import levitated_sag
from rotordrop.rotor.unknowns import smallest_gap


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


BENDING_MODES = 3
BENDING_SIGMA = 1.1e-3
"""Free bending of the rotor at power-off beside sag and orbit, at the sensors, over the air gap [1]."""

HIGHER_SIGMA = 7e-5
"""The same for modes beyond the third bending mode [1]."""

POSITION_SIGMA = 0.36
"""How far off the centre a rotor levitates, over the air gap [1]: a magnet need not hold it in the middle."""

VELOCITY_SIGMA = 0.7
"""Velocity at power-off over that of a free fall through the air gap [1]."""

RUNOUT_SIGMA = 0.3e-6
"""Runout of a sensor track at 1X [m], a quality of its surface whatever the size of the machine."""

SIDEWAYS_SHARE = 0.05
"""Sideways remanent force over static lift, standard deviation [1]."""

TURNING_FORCE_SIGMA = 0.5
"""Synchronous force of a magnetic bearing over the weight of the rotor [1]."""

ORBIT_SIGMA = 0.15e-6
"""Error of the orbit before the drop, carried on to power-off [m]."""

SIDEWAYS_REST_SIGMA = 5e-3
"""How far beside the lowest point the resting rotor may lie, over the air gap [1]: a race turns on its balls
before the shaft slides in it, and the starting friction of a ball bearing holds up this slope."""

ITERATIONS = 8


@dataclass(frozen=True, kw_only=True)
class Unknowns:
    """Where the unknowns of the fall are in one vector; S sensors, B bearings.

    Order: states of the fall at power-off, gain errors, runout (cosine, sine) per sensor, logarithm of the
    remanent time constant, power-off relative to the first guess [ms], synchronous forces of the magnetic
    bearings, error of the rest position (x, y) per bearing.
    """

    n_states: int
    n_sensors: int
    n_magnets: int
    n_bearings: int

    @property
    def states(self) -> slice:
        """States of the fall at power-off."""
        return slice(0, self.n_states)

    @property
    def gain(self) -> slice:
        """Relative gain errors of the sensors."""
        return slice(self.n_states, self.n_states + self.n_sensors)

    @property
    def runout(self) -> slice:
        """Runout at 1X: cosine of every sensor, then sine [m]."""
        return slice(self.n_states + self.n_sensors, self.decay)

    @property
    def decay(self) -> int:
        """Logarithm of the remanent time constant."""
        return self.n_states + 3 * self.n_sensors

    @property
    def shift(self) -> int:
        """Power-off relative to the first guess [ms]."""
        return self.decay + 1

    @property
    def turning(self) -> slice:
        """Synchronous forces of the magnetic bearings (x, y) at power-off [N]."""
        return slice(self.shift + 1, self.shift + 1 + 2 * self.n_magnets)

    @property
    def rest(self) -> slice:
        """Error of the rest position (x, y) per bearing [m]."""
        return slice(self.size - 2 * self.n_bearings, self.size)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.shift + 1 + 2 * self.n_magnets + 2 * self.n_bearings


def unbalance_nodes(machine: Machine) -> tuple[int, ...]:
    """Nodes at which unbalance is looked for: those of the machine file, else the touchdown bearings."""
    named = tuple(dict.fromkeys(unbalance.node for unbalance in machine.unbalances))
    return named or tuple(bearing.node for bearing in machine.touchdown_bearings)


def _unbalance_sigma(machine: Machine, nodes: tuple[int, ...], mass: float) -> Array:
    if machine.unbalances:
        sums = [sum(float(u.amount) for u in machine.unbalances if u.node == node) for node in nodes]
        return np.asarray(np.maximum(np.array(sums), 1e-7))
    usual = 2.5e-3 * mass / float(machine.speed.nominal)
    return np.full(len(nodes), usual / np.sqrt(len(nodes)))


@dataclass(frozen=True, kw_only=True)
class FallReadings:
    """What is compared: deviations from rest, and the orbit before the drop, along the sensors."""

    time: Array
    deviation: Array
    noise: Array
    orbit: Array
    orbit_velocity: Array
    orbit_acceleration: Array


class FallFit:
    """Gauss–Newton with priors over the unknowns of the fall."""

    def __init__(
        self,
        fall: FreeFall,
        sensing: Sensing,
        readings: FallReadings,
        settled: Array,
        model: DropModel,
        instant_error: float,
    ) -> None:
        self.fall, self.sensing, self.readings, self.settled = fall, sensing, readings, settled
        self.unknowns = Unknowns(
            n_states=fall.size,
            n_sensors=len(sensing.names),
            n_magnets=fall.n_magnets,
            n_bearings=sensing.to_bearings.shape[0],
        )
        self.prior_mean, sigma = self._prior(model, instant_error)
        self.prior_root = self._prior_root(sigma)
        m = fall.n_modes
        self.velocity_rows = np.zeros((len(sensing.names), fall.size))
        self.velocity_rows[:, fall.velocity] = sensing.rows
        self.place_rows = np.zeros_like(self.velocity_rows)
        self.place_rows[:, : 2 * m] = sensing.rows

    def _prior(self, model: DropModel, instant_error: float) -> tuple[Array, Array]:
        u, fall, m = self.unknowns, self.fall, self.fall.n_modes
        mean, sigma = np.zeros(u.size), np.ones(u.size)
        sag = sagging_amplitudes(model)
        mean[m + 2 : 2 * m] = sag[2:]
        mean[fall.one], sigma[fall.one] = 1.0, 1e-9
        gap = smallest_gap(model.machine)
        position, velocity = _modal_sigmas(model, self.sensing.rows, fall.speed, gap)
        sigma[fall.displacement] = np.tile(position, 2)
        sigma[fall.velocity] = np.tile(velocity, 2)
        weight = float(np.sum(model.load_shares))
        lift = weight / max(fall.n_magnets, 1)
        mean[fall.remanent] = np.tile([0.0, REMANENT_SHARE[0] * lift], fall.n_magnets)
        sigma[fall.remanent] = np.tile([SIDEWAYS_SHARE * lift, REMANENT_SHARE[1] * lift], fall.n_magnets)
        nodes = unbalance_nodes(model.machine)
        sigma[fall.unbalance] = np.repeat(_unbalance_sigma(model.machine, nodes, model.fe.total_mass), 2)
        sigma[u.gain] = self.sensing.gain_sigma
        sigma[u.runout] = RUNOUT_SIGMA
        mean[u.decay], sigma[u.decay] = np.log(REMANENT_TIME[0]), REMANENT_TIME[1]
        sigma[u.shift] = 1e3 * max(instant_error, 1e-6)
        sigma[u.turning] = TURNING_FORCE_SIGMA * weight
        zero = np.sqrt(np.sum((self.sensing.to_bearings[:, 1, :] * self.sensing.offset_sigma) ** 2, axis=1))
        sigma[u.rest] = np.column_stack([np.full(len(zero), SIDEWAYS_REST_SIGMA * gap), zero]).ravel()
        return mean, sigma

    def _prior_root(self, sigma: Array) -> Array:
        """Rows of the prior: states beside what unbalance and magnets hold on the orbit."""
        u, fall = self.unknowns, self.fall
        # What unbalance and turning magnet forces hold on the orbit is no free bending: the prior is on the
        # difference, so a flexible rotor that circles far out at power-off pays nothing for it.
        root = np.diag(1.0 / sigma)
        states = slice(0, 4 * fall.n_modes)
        orbit = fall.synchronous() / sigma[states, None]
        split = fall.unbalance.stop - fall.unbalance.start
        root[states, fall.unbalance] -= orbit[:, :split]
        root[states, u.turning] -= orbit[:, split:]
        return root

    def solve(self) -> tuple[Array, Array, float]:
        """Estimate, covariance and mean square of the weighted residual of the samples."""
        current = self.prior_mean.copy()
        count = self.readings.deviation.size
        for _ in range(ITERATIONS):
            residual, jacobian = self.linearised(current)
            scale = 1.0 / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
            step = np.linalg.lstsq(jacobian * scale, residual, rcond=None)[0] * scale
            step[self.unknowns.decay] = np.clip(step[self.unknowns.decay], -0.3, 0.3)
            step[self.unknowns.shift] = np.clip(step[self.unknowns.shift], -0.05, 0.05)
            current = current + step
            sigma = 1.0 / np.maximum(np.diag(self.prior_root), 1e-300)
            if float(np.max(np.abs(step) / sigma)) < 1e-6:
                break
        residual, jacobian = self.linearised(current)
        scale = 1.0 / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        scaled = jacobian * scale
        covariance = np.linalg.inv(scaled.T @ scaled) * np.outer(scale, scale)
        misfit = float(np.mean(residual[:count] ** 2))
        return current, covariance, misfit

    def linearised(self, current: Array) -> tuple[Array, Array]:
        """Weighted residual (samples, orbit, prior) and the Jacobian of the prediction."""
        samples = self._samples(current)
        orbit = self._orbit(current)
        prior = self.prior_root @ (self.prior_mean - current)
        return (
            np.concatenate([samples[0], orbit[0], prior]),
            np.vstack([samples[1], orbit[1], self.prior_root]),
        )

    def _samples(self, current: Array) -> tuple[Array, Array]:
        u, e, fall = self.unknowns, self.readings, self.fall
        states, decay = current[u.states], float(np.exp(current[u.decay]))
        since = e.time - 1e-3 * current[u.shift]
        step, count = float(e.time[1] - e.time[0]), len(e.time)
        seen = fall.observed(self.sensing.rows, decay, float(since[0]), step, count)
        place = seen @ states
        later = fall.observed(self.sensing.rows, 1.01 * decay, float(since[0]), step, count) @ states
        moved = np.gradient(place, step, axis=0)
        wave = np.exp(1j * fall.speed * since)
        gain, runout = current[u.gain], current[u.runout].reshape(2, -1)
        predicted = (1.0 + gain) * (place - self._settled(current))
        predicted += wave.real[:, None] * runout[0] + wave.imag[:, None] * runout[1]
        jacobian = np.zeros((count, u.n_sensors, u.size))
        jacobian[..., u.states] = (1.0 + gain)[None, :, None] * seen
        self._sensor_columns(jacobian, current, place, wave)
        jacobian[..., u.decay] = (1.0 + gain) * (later - place) / np.log(1.01)
        jacobian[..., u.shift] = -1e-3 * (1.0 + gain) * moved
        weight = 1.0 / e.noise
        residual = (e.deviation - predicted) * weight
        jacobian *= weight[None, :, None]
        return residual.ravel(), jacobian.reshape(-1, u.size)

    def _orbit(self, current: Array) -> tuple[Array, Array]:
        u, e = self.unknowns, self.readings
        states, gain, speed = current[u.states], current[u.gain], self.fall.speed
        runout = current[u.runout].reshape(2, -1)
        place, rate = self.place_rows @ states, self.velocity_rows @ states
        delay = 1e-3 * current[u.shift]
        jacobian = np.zeros((2, u.n_sensors, u.size))
        jacobian[0, :, u.states] = (1.0 + gain)[:, None] * self.place_rows
        jacobian[1, :, u.states] = (1.0 + gain)[:, None] * self.velocity_rows
        self._sensor_columns(jacobian[:1], current, place[None], np.ones(1, dtype=np.complex128))
        sensors = np.arange(u.n_sensors)
        jacobian[1, sensors, u.gain.start + sensors] = rate
        jacobian[1, sensors, u.runout.start + u.n_sensors + sensors] = speed
        # A later power-off carries the measured orbit on; the unknown state is the one at power-off.
        jacobian[0, :, u.shift] = -1e-3 * e.orbit_velocity
        jacobian[1, :, u.shift] = -1e-3 * e.orbit_acceleration
        first = (
            e.orbit + delay * e.orbit_velocity - (1.0 + gain) * (place - self._settled(current)) - runout[0]
        )
        second = e.orbit_velocity + delay * e.orbit_acceleration - (1.0 + gain) * rate - speed * runout[1]
        sigma = np.array([ORBIT_SIGMA, max(ORBIT_SIGMA * speed, 1e-4)])
        residual = np.stack([first, second]) / sigma[:, None]
        return residual.ravel(), (jacobian / sigma[:, None, None]).reshape(-1, u.size)

    def _sensor_columns(
        self, jacobian: Array, current: Array, place: Array, wave: NDArray[np.complex128]
    ) -> None:
        """Fill the columns of gain, runout and rest position of a Jacobian (T, S, n)."""
        u, sensors = self.unknowns, np.arange(self.unknowns.n_sensors)
        gain, settled = current[u.gain], self._settled(current)
        for k in sensors:
            jacobian[:, k, u.gain.start + k] = place[:, k] - settled[k]
            jacobian[:, k, u.runout.start + k] = wave.real
            jacobian[:, k, u.runout.start + u.n_sensors + k] = wave.imag
        at_rest = self.sensing.from_bearings.reshape(u.n_sensors, -1)
        jacobian[..., u.rest] = -(1.0 + gain)[:, None] * at_rest

    def _settled(self, current: Array) -> Array:
        """Displacement along the sensors at rest [m], with the error of the rest position."""
        at_rest = self.sensing.from_bearings.reshape(self.unknowns.n_sensors, -1)
        return np.asarray(self.settled + at_rest @ current[self.unknowns.rest])


def _modal_sigmas(model: DropModel, rows: Array, speed: float, gap: float) -> tuple[Array, Array]:
    """Prior standard deviations of amplitudes and their velocities, shape (m,), beside sag and orbit.

    A mode is bounded by what it may move at the sensors and the bearings, wherever it moves most: a mode that
    hardly shows there could otherwise take up anything. Without the AMB planes the sag is not known, and the
    bending has room for it.
    """
    eigenvalues = model.parameters.eigenvalue
    m = len(eigenvalues)
    seen = np.vstack([np.hypot(rows[:, :m], rows[:, m:]), np.abs(model.parameters.bearing_shape)])
    reach = np.max(seen, axis=0)
    reach = np.maximum(reach, 0.05 * reach.max())
    natural = np.sqrt(np.maximum(eigenvalues, 0.0))
    free = 1.0 if len({amb.node for amb in model.machine.ambs}) >= 2 else 30.0
    low = np.arange(m) < 2 + BENDING_MODES
    position = np.where(low, free * BENDING_SIGMA, HIGHER_SIGMA) * gap / reach
    velocity = position * np.maximum(abs(speed), np.where(low, 0.3, 0.05) * natural)
    weight = np.sqrt(model.fe.total_mass)
    falling = math.sqrt(2.0 * gap * float(model.machine.gravity))
    position[:2], velocity[:2] = POSITION_SIGMA * gap * weight, VELOCITY_SIGMA * falling * weight
    return position, velocity


CLEARANCE_KEPT = 0.03
"""The fall ends when the rotor has come this close to the air gap, over the gap [1]: a zero of the sensors
that is off looks like another gap."""

FEWEST_SAMPLES = 12


@dataclass(frozen=True, kw_only=True)
class InitialState:
    """Initial state with its uncertainty; m modes per plane, B bearings, A magnetic bearings, n unknowns."""

    fall: FreeFall
    """Linear model of the falling rotor."""
    sensing: Sensing
    """What the sensors see of it."""
    sensors: tuple[Sensor, ...]
    """The sensors of the record."""
    rest_along: Array
    """Displacements along the sensors at rest [m], from which deviations count, shape (S,)."""
    levitated: LevitatedModel
    """Readings before the drop: hum and 2X runout are taken off with it."""
    angle: RotorAngle
    """Rotor angle over the record."""
    unknowns: Unknowns
    """Where each unknown is in `mean`."""
    mean: Array
    covariance: Array
    """Estimate and covariance of all unknowns at power-off."""
    settled: Array
    """Displacement along the sensors at rest, from the settled radius [m], shape (S,)."""
    drop_instant: float
    drop_instant_error: float
    """Power-off in record time [s] and its standard error."""
    end: float
    """End of the free fall, from power-off [s]."""
    noise: Array
    """Noise of the displacements along the sensors [m], shape (S,)."""
    misfit: float
    """Mean square of the residual over the noise [1]; 1 is a perfect model."""
    samples: int
    """Samples of the fall that were used."""
    notes: tuple[str, ...] = ()
    """What to know about this state."""

    @property
    def decay(self) -> float:
        """Time constant of the remanent force [s]."""
        return float(np.exp(self.mean[self.unknowns.decay]))

    @property
    def remanent_force(self) -> Array:
        """Remanent force at power-off [N], shape (A, 2)."""
        return self.mean[self.fall.remanent].reshape(-1, 2).copy()

    @property
    def displacement(self) -> Array:
        """Displacement at the bearing nodes at power-off [m], shape (B, 2)."""
        return self._at_bearings(self.fall.displacement)

    @property
    def velocity(self) -> Array:
        """Velocity at the bearing nodes at power-off [m/s], shape (B, 2)."""
        return self._at_bearings(self.fall.velocity)

    def _at_bearings(self, part: slice) -> Array:
        amplitudes = self.mean[part].reshape(2, -1)
        return np.asarray(self.fall.model.parameters.bearing_shape @ amplitudes.T)

    def state_at(self, time: float, unknowns: Array | None = None) -> Array:
        """State of the fall at a time from power-off [s], shape (n_states,)."""
        values = self.mean if unknowns is None else unknowns
        decay = float(np.exp(values[self.unknowns.decay]))
        return self.fall.transition(decay, time) @ values[self.unknowns.states]

    def deviation_of(self, record: Record) -> Array:
        """Displacements along the sensors from rest, hum and 2X runout taken off [m], shape (N, S)."""
        return deviations(record, self.rest_along, self.levitated, self.angle)

    def refined(self, instant: DropInstant) -> DropInstant:
        """Power-off as this fit leaves it."""
        error = self.drop_instant_error
        return replace(
            instant,
            value=self.drop_instant,
            standard_error=error,
            interval_90=(self.drop_instant - NINETY * error, self.drop_instant + NINETY * error),
            method=f"{instant.method}; refined by the fit of the initial state",
        )

    def square_root(self) -> Array:
        """Matrix L with L Lᵀ the covariance, shape (n, n); a draw is ``mean + L @ standard_normal``."""
        return covariance_root(self.covariance)


def covariance_root(covariance: Array) -> Array:
    """Matrix L with L Lᵀ the covariance, shape (n, n): symmetric once each unknown has unit variance.

    Of all square roots this one is determined by the covariance alone. Eigenvectors as columns would not be:
    those of equal eigenvalues are arbitrary in their subspace, so draws would differ from one linear algebra
    library to the next. Unlike a triangular root it needs no variance in every direction.
    """
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * ((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T))


def settled_along(rest: SettledRest, sensing: Sensing) -> Array:
    """Displacement along the sensors [m], shape (S,), of the rotor at the lowest point of its bearings."""
    return np.asarray(-sensing.from_bearings[..., 1] @ rest.radius + sensing.settled_bend)


def end_of_fall(time: Array, place: Array, gaps: Array) -> float:
    """Last time of the free fall [s from the first sample's clock].

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    place : ndarray, shape (N, B, 2)
        Displacement at the bearings [m].
    gaps : ndarray, shape (B,)
        Air gaps [m].
    """
    radius = np.hypot(place[..., 0], place[..., 1])
    near = np.any(radius > (1.0 - CLEARANCE_KEPT) * gaps, axis=1) & (time > 0.0)
    if not near.any():
        raise IdentificationError(
            f"the rotor comes within {1e6 * float(np.min(gaps - radius.max(axis=0))):.0f} µm of the air gap "
            f"{', '.join(f'{1e6 * g:.0f}' for g in gaps)} µm at most in the record; expected a contact. "
            "Check the settled tail, the unit and the gain of the sensors."
        )
    return float(time[int(np.argmax(near)) - 1])


def fit_initial_state(
    record: Record,
    model: DropModel,
    release: DropInstant | PowerOff,
    speed: SpeedFit,
    angle: RotorAngle,
    gap: AirGap,
    sensing: Sensing,
) -> InitialState:
    """Initial state by a fit over the fall, with covariance.

    Parameters
    ----------
    record : Record
        Readings from before power-off to the first contact at least.
    model : DropModel
        The rotor.
    release : DropInstant or PowerOff
        Power-off with the levitated motion before it.
    speed, angle : SpeedFit, RotorAngle
        Speed at power-off, and the angle over the record.
    gap : AirGap
        Air gaps, to see where the fall ends, and the rest position, from which displacements count, so that
        zero errors of the sensors drop out.
    sensing : Sensing
        What the sensors see of the rotor.

    Raises
    ------
    IdentificationError
        If the record begins with the fall, the rotor never comes near the air gap, or the fall has too few
        samples.

    Notes
    -----
    Source: own method after Neisi 2020, section 3.1. Differs from the paper: the paper expands the state at
    one instant in the rigid modes.
    """
    if not isinstance(release, DropInstant):
        raise IdentificationError(
            f"{record.name} begins with the fall; expected the levitated rotor before it. Record with "
            "pre-trigger."
        )
    levitated, rest, time = release.levitated, gap.rest, record.time - release.value
    settled = settled_along(rest, sensing)
    end = end_of_fall(time, sensing.at_bearings(record.along - rest.along + settled), gap.value)
    inside = (time > 0.0) & (time <= end)
    _check_samples(record, inside, end)
    # Deviations from rest, not readings, are compared: zeros of the sensors are in both and drop out, and
    # what is left of them is an error of the rest position, which is one of the unknowns.
    fall = build_free_fall(model, speed.initial, unbalance_nodes(model.machine))
    readings = _fall_readings(record, release, angle, rest, inside)
    problem = FallFit(fall, sensing, readings, settled, model, release.standard_error)
    mean, covariance, misfit = problem.solve()
    shift = problem.unknowns.shift
    return InitialState(
        fall=fall,
        sensing=sensing,
        sensors=record.sensors,
        rest_along=rest.along,
        levitated=levitated,
        angle=angle,
        unknowns=problem.unknowns,
        mean=mean,
        covariance=covariance * max(misfit, 1.0),
        settled=settled,
        drop_instant=release.value + 1e-3 * float(mean[shift]),
        drop_instant_error=float(1e-3 * np.sqrt(covariance[shift, shift])),
        end=end - 1e-3 * float(mean[shift]),
        noise=readings.noise,
        misfit=misfit,
        samples=int(inside.sum()),
        notes=_notes(misfit),
    )


def _check_samples(record: Record, inside: NDArray[np.bool_], end: float) -> None:
    if int(inside.sum()) < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{record.name}: {int(inside.sum())} samples between power-off and the first contact at "
            f"{1e3 * end:.3g} ms; at "
            f"least {FEWEST_SAMPLES} are needed for the initial state. Sample faster, or check the air gap."
        )
    if not np.isfinite(record.signals[inside]).all():
        raise IdentificationError(f"{record.name}: readings are missing between power-off and first contact")


def _notes(misfit: float) -> tuple[str, ...]:
    if misfit <= 2.0:
        return ()
    return (
        f"the fall deviates from a free rotor by {misfit**0.5:.1f} times the sensor noise; expected about 1. "
        "Check nodes and angles of the sensors",
    )


def deviations(record: Record, rest: Array, levitated: LevitatedModel, angle: RotorAngle) -> Array:
    """Displacements along the sensors from rest (S,), hum and 2X runout taken off [m], shape (N, S).

    A levitated rotor on its orbit shows no 2X of its own: what is there is runout and turns on with the
    shaft.
    """
    return record.along - levitated.disturbance(record.time, angle) * record.gains - rest


def _fall_readings(
    record: Record, release: DropInstant, angle: RotorAngle, rest: SettledRest, inside: NDArray[np.bool_]
) -> FallReadings:
    levitated = release.levitated
    turning = 2.0 * np.pi * levitated.tones[0]
    turned = np.exp(1j * turning * release.value) * levitated.amplitudes[0]
    orbit = along_sensors((levitated.mean + turned.real)[None, :], record.sensors)[0]
    return FallReadings(
        time=(record.time - release.value)[inside],
        deviation=deviations(record, rest.along, levitated, angle)[inside],
        noise=np.maximum(levitated.noise * record.gains, 1e-9),
        orbit=orbit - rest.along,
        orbit_velocity=(1j * turning * turned).real * record.gains,
        orbit_acceleration=(-(turning**2) * turned).real * record.gains,
    )
