"""The fit of the fall: Gauss–Newton with priors over everything that moves the free rotor and its sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.evidence.fall import REMANENT_SHARE, REMANENT_TIME
from rotordrop.evidence.free_fall import FreeFall, sagging_amplitudes
from rotordrop.evidence.sensing import Sensing
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import smallest_gap

Array = NDArray[np.float64]

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
