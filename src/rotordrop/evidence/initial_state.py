"""State of the rotor at power-off: that of the levitated rotor, with the forces that the fall says it had.

Until power-off the rotor keeps its levitated motion, and the fit of the fall (`rotordrop.evidence.fall`) says
which forces held it there. Level and orbit before the drop give where it was and how fast; the unbalance
follows from what the magnets do not hold of the orbit; the sag is that under the static lift. What the modes
do beside that, little, comes from the samples of the fall.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotordrop.arrays import Array, ComplexArray
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import IdentificationError
from rotordrop.evidence.contacts import local_polynomial
from rotordrop.evidence.events import RINGING, DropInstant, PowerOff
from rotordrop.evidence.fall import REMANENT_TIME
from rotordrop.evidence.free_rotor import Held, held_by, motion_of
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.measured_speed import RotorAngle
from rotordrop.evidence.rest import AirGap, Rest
from rotordrop.evidence.sensing import Sensing
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.record.axes import along_sensors
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import DropModel, pushes
from rotordrop.rotor.unknowns import smallest_gap
from rotordrop.units import fall_speed

MAGNET_FORCES = slice(L.REMANENT_X, L.REMANENT_Y + 1)

BENDING_SIGMA = 1.1e-3
"""Free bending of the rotor at power-off beside sag and orbit, over the air gap [1]; chosen, not measured."""

END_WINDOW = 1e-3
"""Time before the end of the fall at which place and velocity are read where nothing says what held the rotor
[s] (chosen): long enough against noise, short against the fall."""

ROUGH_RATE = 0.1
"""Standard deviation of that velocity over that of a fall through the gap [1]: in three hidden drops of lp400
at 60, 100 and 250 Hz it was off by up to 0.14, the ringing of the released sag being in it."""

RUNOUT_SIGMA = 0.3e-6
"""Runout of a sensor track at 1X [m], a quality of its surface whatever the size of the machine (chosen)."""

SIDEWAYS_REST_SIGMA = 5e-3
"""How far beside the lowest point the resting rotor may lie, over the air gap [1]: a race turns on its balls
before the shaft slides in it, and the starting friction of a ball bearing holds up this slope (chosen)."""

CLEARANCE_KEPT = 0.03
"""The fall ends when the rotor has come this close to the air gap, over the gap [1]: a zero of the sensors
that is off looks like another gap (chosen)."""

FEWEST_SAMPLES = 12
"""Samples of the fall from which its bending is told from noise [1] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class FreeFall:
    """The free rotor of a drop with its forces; m modes per plane, A magnets, U unbalance planes, n states.

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
    magnets: Array
    """Mode shapes where the remanent forces act, shape (A, m)."""
    system: Array
    """System matrix without the decay of the remanent forces [1/s], shape (n, n)."""

    @property
    def n_modes(self) -> int:
        """Modes per plane."""
        return self.model.basis.size

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
        return slice(self.one + 1, self.one + 1 + 2 * len(self.magnets))

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

    def orbit(self) -> tuple[ComplexArray, ComplexArray]:
        """Amplitudes of the modes on the orbits that turning forces hold, complex.

        Forward, with the spin, per unbalance [1/kg m] and per force at a magnet [1/N], (m, U + A); backward,
        against it, per force at a magnet [1/N], (m, A).
        """
        w, basis = self.speed, self.model.basis
        free = motion_of(basis, w)
        stiff, loss = -free[basis.size :, : basis.size], -free[basis.size :, basis.size :]
        still = -w * w * np.eye(basis.size) + stiff
        forward = np.column_stack([w * w * self.planes.T, self.magnets.T])
        return (
            np.asarray(np.linalg.solve(still + 1j * w * loss, forward)),
            np.asarray(np.linalg.solve(still - 1j * w * loss, self.magnets.T)),
        )


def build_free_fall(
    model: DropModel, speed: float, unbalance_nodes: tuple[int, ...], magnets: Array | None = None
) -> FreeFall:
    """Linear model of a falling rotor at a constant speed [rad/s] with unbalance at nodes counted from 1.

    Remanent forces act by mode shapes (A, m); by default by those of the magnetic bearings.
    """
    magnets = model.parameters.magnet_shape if magnets is None else magnets
    m, n_a, n_u = model.basis.size, len(magnets), len(unbalance_nodes)
    planes = np.array([model.basis.node_row(node) for node in unbalance_nodes]).reshape(n_u, m)
    inside = np.zeros((2 * m + n_a + n_u,) * 2, dtype=np.complex128)
    inside[: 2 * m, : 2 * m] = motion_of(model.basis, speed)
    inside[m : 2 * m, 2 * m :] = np.column_stack([magnets.T, speed**2 * planes.T])
    turning = np.arange(2 * m + n_a, len(inside))
    inside[turning, turning] = 1j * speed
    # real and imaginary parts by themselves, in the order of the states
    whole = np.block([[inside.real, -inside.imag], [inside.imag, inside.real]])
    x, y = np.arange(len(inside)), len(inside) + np.arange(len(inside))
    forces = np.column_stack([x, y])[2 * m :].ravel()
    order = np.concatenate([x[:m], y[:m], x[m : 2 * m], y[m : 2 * m], forces])
    system = np.insert(np.insert(whole[np.ix_(order, order)], 4 * m, 0.0, axis=0), 4 * m, 0.0, axis=1)
    system[2 * m : 4 * m, 4 * m] = pushes(model.parameters, speed).T.ravel()
    return FreeFall(
        model=model, speed=speed, nodes=unbalance_nodes, planes=planes, magnets=magnets, system=system
    )


def kernel_state(fall: FreeFall, state: Array, angle: float) -> tuple[Array, Array, Array]:
    """A state (n,) of the fall as the drop model takes it, at a rotor angle [rad].

    Gives the state of the drop model at that angle, the remanent forces (A, 2) [N], and the modal unbalance
    of the kernel, cosine and sine, (2, m) [kg m / sqrt(kg)], turned back by the angle.
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


@dataclass(frozen=True, kw_only=True)
class Unknowns:
    """Where the unknowns of the fall are in one vector; S sensors, B bearings.

    Order: states of the fall at power-off, gain errors, logarithm of the remanent time constant, error of the
    rest position (x, y) per bearing.
    """

    n_states: int
    n_sensors: int
    n_bearings: int

    @property
    def states(self) -> slice:
        """States of the fall at power-off."""
        return slice(0, self.n_states)

    @property
    def gain(self) -> slice:
        """Relative gain errors of the sensors."""
        return slice(self.n_states, self.decay)

    @property
    def decay(self) -> int:
        """Logarithm of the remanent time constant."""
        return self.n_states + self.n_sensors

    @property
    def rest(self) -> slice:
        """Error of the rest position (x, y) per bearing [m]."""
        return slice(self.decay + 1, self.size)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.decay + 1 + 2 * self.n_bearings


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
    """Power-off in record time [s]."""
    end: float
    """End of the free fall, from power-off [s]."""
    noise: Array
    """Noise of the displacements along the sensors [m], shape (S,)."""
    misfit: float
    """Mean square of the residual of the fall over the noise [1]; 1 is a perfect model."""
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
        """Displacements along the sensors from rest, hum and 2X runout taken off [m], shape (N, S).

        A levitated rotor on its orbit shows no 2X of its own: what is there is runout and turns on with the
        shaft.
        """
        disturbance = self.levitated.disturbance(record.time, self.angle) * record.gains
        return record.along - disturbance - self.rest_along

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


def end_of_fall(time: Array, place: Array, gaps: Array) -> float:
    """Last time of the free fall [s], by displacements (N, B, 2) [m] at times from power-off (N,) [s]."""
    radius = np.hypot(place[..., 0], place[..., 1])
    near = np.any(radius > (1.0 - CLEARANCE_KEPT) * gaps, axis=1) & (time > 0.0)
    if not near.any():
        raise IdentificationError(
            f"the rotor comes within {1e6 * float(np.min(gaps - radius.max(axis=0))):.0f} µm of the air gap "
            f"{', '.join(f'{1e6 * g:.0f}' for g in gaps)} µm at most in the record; expected a contact. "
            "Check the settled tail, the unit and the gain of the sensors."
        )
    return float(time[int(np.argmax(near)) - 1])


def initial_state_of(
    record: Record,
    model: DropModel,
    release: PowerOff,
    speed: float,
    angle: RotorAngle,
    gap: AirGap,
    sensing: Sensing,
) -> InitialState:
    """State at power-off with its covariance, by the levitated motion and the fit of the fall.

    The record reaches from before power-off to the first contact at least; the speed is that at power-off
    [rad/s]. The gap says where the fall ends, and its rest is where displacements count from, so that zero
    errors of the sensors drop out.

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
    rest, time = gap.rest, record.time - release.value
    end = end_of_fall(time, sensing.at_bearings(record.along - rest.along + rest.settled), gap.value)
    inside = (time > 0.0) & (time <= end)
    if int(inside.sum()) < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{record.name}: {int(inside.sum())} samples between power-off and the first contact at "
            f"{1e3 * end:.3g} ms; at "
            f"least {FEWEST_SAMPLES} are needed for the initial state. Sample faster, or check the air gap."
        )
    if not np.isfinite(record.signals[inside]).all():
        raise IdentificationError(f"{record.name}: readings are missing between power-off and first contact")
    held = held_by(model.machine, record.whole.planes, model.fe)
    if held.by_magnets:
        levitated = _Levitated(record, release, model, speed, held, rest, sensing)
        found, mean, covariance = levitated.state()
    else:
        found, mean, covariance = _by_end_of_fall(record, time, end, model, speed, rest, sensing)
    covariance[found.one, found.one] = 1e-18  # what has no error at all has no direction to be drawn in
    return InitialState(
        fall=found,
        sensing=sensing,
        sensors=record.sensors,
        rest_along=rest.along,
        levitated=release.levitated,
        angle=angle,
        unknowns=Unknowns(
            n_states=found.size, n_sensors=len(record.sensors), n_bearings=len(sensing.to_bearings)
        ),
        mean=mean,
        covariance=covariance,
        settled=rest.settled,
        drop_instant=release.value,
        end=end,
        noise=np.maximum(release.levitated.noise * record.gains, 1e-9),
        misfit=release.fall.misfit,
        notes=()
        if release.fall.misfit <= 2.0
        else (
            f"the fall deviates from a free rotor by {release.fall.misfit**0.5:.1f} times the sensor noise; "
            "expected about 1. Check nodes and angles of the sensors",
        ),
    )


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


class _Levitated:
    """The levitated rotor at power-off as a function of what is not known of it.

    Unknown are, in this order: what the fit of the fall sought, except gains; the gain of every sensor; free
    bending (displacement and velocity, each real then imaginary); unbalances (x, y); rest position (x, y).
    """

    def __init__(
        self,
        record: Record,
        release: DropInstant,
        model: DropModel,
        speed: float,
        held: Held,
        rest: Rest,
        sensing: Sensing,
    ) -> None:
        self.release, self.sensing, self.model = release, sensing, model
        nodes = unbalance_nodes(model.machine)
        magnets = np.array([model.basis.node_row(node) for node in held.nodes])
        self.found = build_free_fall(model, speed, nodes, magnets)
        self.sag = model.basis.shapes.T @ (model.fe.mass @ held.sag)
        self.settled = rest.settled
        self.level = along_sensors(release.levitated.mean, record.sensors) - rest.along
        turned = np.exp(2j * np.pi * release.levitated.tones[0] * release.value)
        self.tone = release.levitated.amplitudes[0] * turned * record.gains
        columns = [record.sensors.index(sensor) for sensor in record.whole.sensors]
        self.forward, self.backward = self.found.orbit()
        m, rows = model.basis.size, sensing.rows
        self.seen = rows[:, :m] - 1j * rows[:, m:]
        self.rigid = np.linalg.pinv(np.column_stack([self.seen[:, :2].real, -self.seen[:, :2].imag]))
        self._count(len(magnets), len(sensing.names), len(nodes), release.fall.rotor.basis.size - 2)
        shapes = release.fall.rotor.basis.shapes[:, 2:]
        self.bending = model.basis.shapes.T @ (model.fe.mass @ shapes)
        self.prior = self._fitted(columns, held)

    def _count(self, magnets: int, sensors: int, unbalances: int, bending: int) -> None:
        """Places of the unknowns."""
        bearings = self.sensing.to_bearings.shape[0]
        sizes = (2 * magnets, 2 * magnets, 2 * magnets, 1, 1, sensors, 4 * bending, 2 * unbalances)
        edges = np.cumsum((0, *sizes, 2 * bearings)).tolist()
        (
            self.remanent,
            self.with_spin,
            self.against,
            self.instant,
            self.decay,
            self.gain,
            self.bend,
            self.unbalance,
            self.rest,
        ) = (slice(a, b) for a, b in pairwise(edges))
        self.size = edges[-1]

    def _fitted(self, columns: list[int], held: Held) -> tuple[Array, Array]:
        """Mean and covariance by the fit of the fall, with bending that its samples show, and by priors."""
        fall, machine, sensing = self.release.fall, self.model.machine, self.sensing
        gap, problem = smallest_gap(machine), self.release.fall.problem
        residual, jacobian = fall.linearised
        forces, count = 6 * len(fall.rotor.lift), len(columns)
        gains = [self.gain.start + column for column in columns]
        places = [*range(forces), *gains, self.instant.start, self.decay.start]
        mean, sigma = np.zeros(self.size), np.zeros(self.size)
        mean[places] = [*fall.unknown, 0.0, math.log(fall.remanent_time)]
        sigma[self.gain] = sensing.gain_sigma
        sigma[self.bend] = self._bending_sigma(gap)
        amounts = _unbalance_sigma(machine, self.found.nodes, self.model.fe.total_mass)
        sigma[self.unbalance] = np.repeat(amounts, 2)
        sigma[self.rest] = _rest_sigma(self.model, sensing)
        bend = range(self.bend.start, self.bend.stop)
        # the samples of the fall once more, to first order, with the bending beside what was sought
        free = problem.seen(problem.responses.at(problem.time - fall.instant)[0])
        parts = np.split(free, [2, free.shape[-1] // 2, free.shape[-1] // 2 + 2], axis=-1)
        added = np.concatenate([c for part in parts[1::2] for c in (part.real, -part.imag)], axis=-1)
        added = problem.over_noise(added).reshape(-1, added.shape[-1])
        whole = np.zeros((len(jacobian), len(places) + len(bend)))
        whole[:, : len(places)], whole[: len(added), len(places) :] = jacobian, -added
        rows = np.vstack([whole, np.eye(whole.shape[1])[len(places) :] / sigma[bend][:, None]])
        scale = 1.0 / np.linalg.norm(rows, axis=0)
        rows = rows * scale
        spread = np.linalg.inv(rows.T @ rows) * np.outer(scale, scale)
        sought = [*places, *bend]
        covariance = np.diag(sigma**2)
        covariance[np.ix_(sought, sought)] = spread * max(fall.misfit, 1.0)
        mean[sought] -= spread @ (whole.T @ residual)
        assert len(fall.unknown) == forces + count
        # a remanent force is sought as a share of the lift, x before y, and wanted in newtons, (x, y) each
        lift = fall.rotor.lift
        turn = np.eye(self.size)
        share, newtons = np.arange(2 * len(lift)), np.arange(2 * len(lift)).reshape(-1, 2)
        turn[self.remanent, self.remanent] = 0.0
        for axis in range(2):
            turn[newtons[:, axis], share[axis * len(lift) :][: len(lift)]] = lift
        return turn @ mean, turn @ covariance @ turn.T

    def _bending_sigma(self, gap: float) -> Array:
        """Prior deviations of the free bending, in the order of the unknowns: bounded by what it moves."""
        basis = self.release.fall.rotor.basis
        nodes = [b.node for b in self.model.machine.touchdown_bearings]
        rows = [basis.node_row(node) for node in nodes] + list(self.release.fall.rotor.plane_rows)
        reach = np.max(np.abs(np.array(rows)), axis=0)
        reach = np.maximum(reach, 0.05 * reach.max())[2:]
        place = BENDING_SIGMA * gap / reach
        rate = place * np.maximum(abs(self.found.speed), 0.3 * np.sqrt(basis.eigenvalues[2:]))
        return np.concatenate([place, place, rate, rate])

    def _complex(self, values: Array) -> ComplexArray:
        """Complex numbers of real parts followed by imaginary ones."""
        return np.asarray(values[: len(values) // 2] + 1j * values[len(values) // 2 :])

    def _orbits(self, x: Array) -> tuple[ComplexArray, ComplexArray]:
        """Modal amplitudes that turn with the spin and against it; a force that went held them before."""
        pairs = x[self.unbalance].reshape(-1, 2)
        turning = np.concatenate([pairs[:, 0] + 1j * pairs[:, 1], -self._complex(x[self.with_spin])])
        return self.forward @ turning, -self.backward @ self._complex(x[self.against])

    def _tone_left(self, x: Array) -> Array:
        """1X before the drop less that of the orbits, along the sensors, (real, imaginary) [m], (2 S,)."""
        forward, backward = self._orbits(x)
        later = np.exp(1j * self.found.speed * 1e-3 * x[self.instant])
        left = self.tone * later - (self.seen @ forward + np.conj(self.seen @ backward))
        return np.concatenate([left.real, left.imag])

    def _outcome(self, x: Array) -> Array:
        """State at the first guess of power-off, and gains, decay and rest: what replays the drop."""
        forward, backward = self._orbits(x)
        bend = x[self.bend].reshape(2, -1)
        shape = 1j * self.sag + self.bending @ self._complex(bend[0])
        at_rest = self.sensing.from_bearings.reshape(len(self.level), -1) @ x[self.rest]
        place = self.settled + at_rest + self.level / (1.0 + x[self.gain])
        # the level before the drop fixes the rigid motions once sag and bending are taken off what it shows
        shape[:2] += self._complex(self.rigid @ (place - (self.seen @ shape).real))
        shape = shape + forward + backward
        rate = 1j * self.found.speed * (forward - backward) + self.bending @ self._complex(bend[1])
        moved = [shape.real, shape.imag, rate.real, rate.imag, [1.0]]
        state = np.concatenate([*moved, x[self.remanent], x[self.unbalance]])
        decay = float(np.exp(x[self.decay][0]))
        # a release later or earlier than guessed: one step along the fall, short against all that moves
        state = state - 1e-3 * float(x[self.instant][0]) * (self.found.matrix(decay) @ state)
        return np.concatenate([state, x[self.gain], x[self.decay], x[self.rest]])

    def state(self) -> tuple[FreeFall, Array, Array]:
        """Rotor, unknowns of the fall and their covariance.

        The orbit before the drop, less what magnets held of it, is that of the unbalance: one update by the
        1X of the sensors, whose runout counts as noise.
        """
        mean, covariance = self.prior
        sigma = np.sqrt(np.diag(covariance))
        seen = -_slopes(self._tone_left, mean, sigma)
        spread = seen @ covariance @ seen.T + RUNOUT_SIGMA**2 * np.eye(len(seen))
        gain = np.linalg.solve(spread, seen @ covariance).T
        mean = mean + gain @ self._tone_left(mean)
        covariance = covariance - gain @ seen @ covariance
        slopes = _slopes(self._outcome, mean, sigma)
        return self.found, self._outcome(mean), slopes @ covariance @ slopes.T


def _slopes(function: Callable[[Array], Array], at: Array, sigma: Array) -> Array:
    """Derivatives of a nearly linear function by central differences, shape (F, X)."""
    steps = np.maximum(1e-2 * sigma, 1e-12)
    unit = np.eye(len(at))
    return np.column_stack(
        [(function(at + h * e) - function(at - h * e)) / (2.0 * h) for h, e in zip(steps, unit, strict=True)]
    )


def _by_end_of_fall(
    record: Record,
    time: Array,
    end: float,
    model: DropModel,
    speed: float,
    rest: Rest,
    sensing: Sensing,
) -> tuple[FreeFall, Array, Array]:
    """The state from which a straight rotor without remanent forces comes to the end of the fall.

    Without AMB planes nothing says what held the orbit, and no magnet carries a remanent force.
    """
    found = build_free_fall(model, speed, unbalance_nodes(model.machine))
    count, m, near = len(sensing.names), found.n_modes, max(end - END_WINDOW, 0.5 * end)
    level, rate, error = local_polynomial(time, record.along - rest.along, near, width=2.0 * (end - near))
    at_rest = sensing.from_bearings.reshape(count, -1)
    rigid = [0, 1, m, m + 1]
    straight = np.linalg.pinv(sensing.rows[:, rigid])
    back = found.transition(REMANENT_TIME[0], -near)
    gain, rests = slice(2 * count, 3 * count), slice(3 * count + 1, 3 * count + 1 + at_rest.shape[1])

    def outcome(x: Array) -> Array:
        state = np.zeros(found.size)
        place = rest.settled + at_rest @ x[rests] + (level + x[:count]) / (1.0 + x[gain])
        state[rigid] = straight @ place
        state[[2 * m + k for k in rigid]] = straight @ ((rate + x[count : 2 * count]) / (1.0 + x[gain]))
        state[found.one] = 1.0
        state[found.unbalance] = x[rests.stop :]
        return np.concatenate([back @ state, x[gain], x[3 * count : rests.stop]])

    falling = fall_speed(smallest_gap(model.machine), float(model.machine.gravity))
    rates = np.hypot(error, ROUGH_RATE * falling)
    unbalance = np.repeat(_unbalance_sigma(model.machine, found.nodes, model.fe.total_mass), 2)
    known = [sensing.gain_sigma, [REMANENT_TIME[1]], _rest_sigma(model, sensing), unbalance]
    sigma = np.concatenate([np.full(count, RINGING), rates, *known])
    mean = np.zeros(len(sigma))
    mean[3 * count] = math.log(REMANENT_TIME[0])
    slopes = _slopes(outcome, mean, sigma) * sigma
    return found, outcome(mean), slopes @ slopes.T


def _rest_sigma(model: DropModel, sensing: Sensing) -> Array:
    """Prior deviation of the error of the rest position (x, y) per bearing [m], shape (2 B,)."""
    height = sensing.height_sigma
    sideways = np.full(len(height), SIDEWAYS_REST_SIGMA * smallest_gap(model.machine))
    return np.column_stack([sideways, height]).ravel()
