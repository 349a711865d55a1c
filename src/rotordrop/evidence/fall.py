"""How a rotor leaves its levitated motion when the magnetic bearings let go, and what lift remained.

Up to power-off the readings follow the levitated model. From then on the rotor is free, and its deviation
from the levitated motion is its answer to the force that has gone: the static lift of every magnetic bearing,
the synchronous force, and what remains of the lift for a few milliseconds. The deviation is linear in these
forces, so hum and electrical runout drop out, and so does the unbalance; the gravity sag needs no separate
treatment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.elements.table import parameter
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.machine import Machine
from rotordrop.record.axes import Plane
from rotordrop.record.recording import Array
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.reduction import Reduction, RotorBasis, reduce_rotor
from rotordrop.rotor.statics import rest_on
from rotordrop.rotor.unknowns import sensor_prior

if TYPE_CHECKING:
    from rotordrop.elements.sensor import Sensor
    from rotordrop.record.record import Record

ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

GRID = 1e-5
"""Step of the tabulated responses [s]."""

_MODES = 6


@dataclass(frozen=True, kw_only=True)
class FreeRotor:
    """A rotor without bearings, seen at the sensor planes, pushed at the magnetic bearings.

    Displacements and forces are complex, x + j y: ``q̈ + (D − jωG) q̇ + Λ q = force_rowsᵀ f``.
    """

    plane_rows: Array
    """Displacement at the sensor planes per modal amplitude [1/sqrt(kg)], shape (P, m)."""
    force_rows: Array
    """The same at the magnetic bearings, shape (A, m)."""
    stiffness: Array
    """Squares of the natural frequencies [rad²/s²], shape (m,)."""
    damping: Array
    gyroscopic: Array
    """Modal damping [1/s] and polar inertia [1], shape (m, m)."""
    lift: Array
    """Static lift of the magnetic bearings [N] (per unit of mass where `mass` is 1), shape (A,)."""
    mass: float
    """Mass that the synchronous force has to move at most [kg]."""
    description: str
    """The model in words."""


def free_rotor(machine: Machine, planes: tuple[Plane, ...]) -> FreeRotor:
    """Model the released rotor by its finite elements, or plane by plane where the AMB planes are unknown."""
    nodes = [amb.node for amb in machine.ambs]
    gravity = float(machine.gravity)
    if len(set(nodes)) < 2:
        return _points(len(planes), gravity)
    fe = build_rotor_fe(machine)
    compliance = [0.0 if amb.integral_action else 1.0 / float(amb.stiffness) for amb in machine.ambs]
    basis = reduce_rotor(fe, Reduction(modes=_MODES, attachment=False))
    return _pushed(
        basis,
        planes,
        nodes,
        lift=rest_on(fe, nodes, gravity, compliance)[1],
        mass=float(fe.total_mass),
        description=f"free rotor with {_MODES - 2} bending modes, released by {len(nodes)} magnetic bearings",
    )


def rotor_pushed_at_bearings(machine: Machine, planes: tuple[Plane, ...]) -> FreeRotor:
    """Model the free rotor with forces at the touchdown bearings, local flexibility there included."""
    fe = build_rotor_fe(machine)
    nodes = [bearing.node for bearing in machine.touchdown_bearings]
    basis = reduce_rotor(fe, Reduction(modes=_MODES + 2, attachment=True), nodes)
    return _pushed(
        basis,
        planes,
        nodes,
        lift=np.zeros(len(nodes)),
        mass=float(fe.total_mass),
        description=f"free rotor, {basis.description}, pushed at {len(nodes)} touchdown bearings",
    )


def _pushed(
    basis: RotorBasis,
    planes: tuple[Plane, ...],
    nodes: list[int],
    *,
    lift: Array,
    mass: float,
    description: str,
) -> FreeRotor:
    return FreeRotor(
        plane_rows=np.array([basis.node_row(plane.node) for plane in planes]),
        force_rows=np.array([basis.node_row(node) for node in nodes]),
        stiffness=basis.eigenvalues,
        damping=basis.damping,
        gyroscopic=basis.polar,
        lift=lift,
        mass=mass,
        description=description,
    )


def _points(count: int, gravity: float) -> FreeRotor:
    return FreeRotor(
        plane_rows=np.eye(count),
        force_rows=np.eye(count),
        stiffness=np.zeros(count),
        damping=np.zeros((count, count)),
        gyroscopic=np.zeros((count, count)),
        lift=np.full(count, gravity),
        mass=1.0,
        description="each sensor plane falling by itself (the AMB planes are not known)",
    )


def tabulate_response(rotor: FreeRotor, speed: float, exponent: complex, span: float) -> ComplexArray:
    """Displacement of the planes after a unit force ``exp(−exponent · t)`` at each magnetic bearing.

    Parameters
    ----------
    rotor : FreeRotor
        The rotor.
    speed : float
        Shaft speed [rad/s].
    exponent : complex
        0 for a step, 1/τ for a decaying force, −jω for a turning one [1/s].
    span : float
        Time covered from the release [s].

    Returns
    -------
    array, shape (K, P, A), complex
        Displacement [m/N] at 0, `GRID`, 2 `GRID`, …
    """
    m, inputs = len(rotor.stiffness), len(rotor.force_rows)
    system = np.zeros((2 * m + inputs, 2 * m + inputs), dtype=np.complex128)
    system[: 2 * m, : 2 * m] = _of_motion(rotor, speed)
    system[m : 2 * m, 2 * m :] = rotor.force_rows.T
    system[2 * m :, 2 * m :] = -exponent * np.eye(inputs)
    states = _stepped(system, np.eye(2 * m + inputs)[:, 2 * m :], span)
    return np.asarray(rotor.plane_rows @ states[:, :m])


def _of_motion(rotor: FreeRotor, speed: float) -> ComplexArray:
    """Derivative of displacements and velocities of the modes by themselves."""
    m = len(rotor.stiffness)
    system = np.zeros((2 * m, 2 * m), dtype=np.complex128)
    system[:m, m:] = np.eye(m)
    system[m:, :m] = -np.diag(rotor.stiffness)
    system[m:, m:] = -rotor.damping + 1j * speed * rotor.gyroscopic
    return system


def _stepped(system: ComplexArray, start: Array, span: float) -> ComplexArray:
    """States (K, N, C) at 0, `GRID`, 2 `GRID`, … from the columns of a start, by doubling."""
    from scipy.linalg import expm

    step = expm(GRID * system)
    states = start[None].astype(np.complex128)
    count = int(span / GRID) + 2
    while len(states) < count:
        states = np.concatenate([states, step @ states])
        step = step @ step
    return states[:count]


def response_to_start(rotor: FreeRotor, speed: float, span: float) -> ComplexArray:
    """Displacement of the planes (K, P, 2 M) by unit displacements and velocities of the modes."""
    m = len(rotor.stiffness)
    return np.asarray(rotor.plane_rows @ _stepped(_of_motion(rotor, speed), np.eye(2 * m), span)[:, :m])


@dataclass(frozen=True, kw_only=True)
class FallResponses:
    """What a released rotor answers to forces that stay, turn with it or fade, tabulated once for a span."""

    fixed: tuple[ComplexArray, ...]
    """Responses to a force that stays, turns with the shaft and against it [m/N], shape (K, P, A)."""
    free: ComplexArray
    """Displacement of the planes left to themselves, by displacements and velocities of the modes, shape (K,
    P, 2 M)."""
    system: ComplexArray
    inputs: Array
    """Derivative of those by themselves and by unit forces at the magnetic bearings."""

    @classmethod
    def of(cls, rotor: FreeRotor, speed: float, span: float) -> FallResponses:
        """Tabulate a rotor at a speed [rad/s] over a time from the release on [s]."""
        system = _of_motion(rotor, speed)
        return cls(
            fixed=tuple(tabulate_response(rotor, speed, s, span) for s in (0.0, -1j * speed, 1j * speed)),
            free=response_to_start(rotor, speed, span),
            system=system,
            inputs=np.vstack([np.zeros_like(rotor.force_rows.T), rotor.force_rows.T]),
        )

    def fading(self, decay: float, since: Array) -> ComplexArray:
        """Response (T, P, A) to forces that fade with a time constant [s], at times from the release [s].

        With x' = A x + B exp(−t/τ) and x(0) = 0, x = (exp(A t) − exp(−t/τ)) (A + 1/τ)⁻¹ B. Only the rows that
        are asked for are multiplied: the whole table is ten times as long, and a product of that size is
        handed to several threads, which on a busy computer cost ten times the work.
        """
        rate = 1.0 / decay
        share = np.linalg.solve(self.system + rate * np.eye(len(self.system)), self.inputs)
        fades = np.exp(-rate * GRID * np.arange(len(self.free)))[:, None, None]
        free = response_at(self.free, since)
        released = (free.reshape(-1, free.shape[-1]) @ share).reshape(*free.shape[:2], -1)
        return np.asarray(released - response_at(fades, since) * (self.free[0] @ share))


def response_at(table: ComplexArray | Array, since: Array) -> ComplexArray:
    """Look up a tabulated response at times since the release [s], shape (T,): zero before it."""
    place = np.clip(since / GRID, 0.0, len(table) - 1.001)
    low = place.astype(np.int64)
    share = (place - low)[:, None, None]
    return np.asarray(table[low] * (1.0 - share) + table[low + 1] * share)


REMANENT_SHARE = (0.2, 0.2)
"""Expected share of the static lift that remains at power-off, and its standard deviation."""

REMANENT_TIME = (REMANENCE_TIME, 0.7)
"""Expected time constant of the remanent lift [s], and the standard deviation of its logarithm."""

_SIDEWAYS_SHARE = 0.1
_BACKWARD_SHARE = 0.3
_GROWTH = 4e-4
"""Step by which the window of the fit grows [s]."""

_GOOD = 2.0
"""Mean square over the noise up to which a search counts as successful."""

_AHEAD = 10e-3
"""Responses are tabulated so far ahead of a window that may grow [s]."""

_STILL_FREE = 4.0
"""Mean square over the noise up to which the newest samples count as free fall."""

_STARTS = (0.0, -0.7, 0.6, -1.4, 1.2)
"""Where the search for the release begins, from the first guess [ms]; the later ones only when needed."""

_LEAD = 5e-3
"""Levitated samples kept before the earliest release [s]."""


@dataclass(frozen=True, kw_only=True)
class Fall:
    """The fall fitted by a released rotor."""

    instant: float
    """Release, in record time [s]."""
    standard_error: float
    """Standard error of `instant` from the noise and the fit [s]."""
    remanent_force: Array
    """Lift left at the release, x and y per magnetic bearing [N], shape (A, 2)."""
    remanent_time: float
    """Time constant of its decay [s]."""
    gain_errors: Array
    """How much more than the model each sensor reads, relative [1]; held near zero by the known gains, shape
    (S,)."""
    misfit: float
    """Mean square of the residual over the noise (1 is a perfect model)."""
    start: float
    end: float
    """Window of the fit [s]."""
    method: str
    """The model in words."""
    rotor: FreeRotor
    """The model."""
    predicted: Callable[[Array], Array]
    """Readings [m] of a fall that goes on without contact."""


@dataclass(frozen=True, kw_only=True)
class _Problem:
    """What stays the same while release and time constant are searched."""

    time: Array
    deviation: Array
    noise: Array
    directions: ComplexArray
    plane_of: NDArray[np.int64]
    rotor: FreeRotor
    origin: float
    responses: FallResponses
    prior_mean: Array
    prior_error: Array

    def columns(self, time: Array, release: float, decay: float) -> tuple[Array, Array]:
        """Fall of the sensors by the lost lift, shape (T, S), and what every unknown adds, (T, S, U)."""
        since = time - release
        fixed = self.responses.fixed
        step, forward, backward = (self._seen(response_at(table, since)) for table in fixed)
        left = self._seen(self.responses.fading(decay, since)) * self.rotor.lift
        fall = (-1j * step * self.rotor.lift).sum(axis=-1).real
        parts = [column for unit in (left, forward, backward) for column in (unit.real, -unit.imag)]
        expected = fall + parts[1].sum(axis=-1) * REMANENT_SHARE[0]
        own = expected[:, :, None] * np.eye(fall.shape[1])
        return fall, np.concatenate([*parts, own], axis=-1)

    def _seen(self, response: ComplexArray) -> ComplexArray:
        """Complex displacement of the planes as the sensors see it; the real part is the reading."""
        return response[:, self.plane_of, :] * self.directions.conj()[None, :, None]

    def solve(self, release: float, decay: float) -> tuple[Array, Array]:
        """Best unknown forces and gains, and the weighted residual with the priors."""
        fall, columns = self.columns(self.time, release, decay)
        weight = 1.0 / self.noise
        left = (columns * weight[None, :, None]).reshape(-1, columns.shape[-1])
        right = ((self.deviation - fall) * weight).reshape(-1)
        left = np.vstack([left, np.diag(1.0 / self.prior_error)])
        right = np.concatenate([right, self.prior_mean / self.prior_error])
        normal = left.T @ left
        unknown: Array = np.linalg.solve(normal, left.T @ right).astype(np.float64)
        return unknown, right - left @ unknown

    def named(self, search: Array) -> tuple[float, float]:
        """Release [s] and time constant [s] of the searched numbers."""
        return self.origin + 1e-3 * float(search[0]), float(np.exp(np.clip(search[1], -9.5, -3.5)))

    def newest_misfit(self, search: Array) -> float:
        """Mean square of the residual over the noise in the newest samples, in the worst sensor."""
        residual = self.solve(*self.named(search))[1][: self.deviation.size].reshape(self.deviation.shape)
        newest = self.time > self.time[-1] - _GROWTH
        return float(np.max(np.mean(residual[newest] ** 2, axis=0)))

    def residual(self, search: Array) -> Array:
        """Residual to be made small over release [ms from the origin] and logarithm of the time constant."""
        release, decay = self.named(search)
        prior = (search[1] - np.log(REMANENT_TIME[0])) / REMANENT_TIME[1]
        return np.append(self.solve(release, decay)[1], prior)


def fit_fall(
    record: Record, rotor: FreeRotor, levitated: LevitatedModel, window: tuple[float, float, float]
) -> Fall:
    """Find the release from the readings between the levitated part and the first contact.

    Release and time constant of the remanent lift are searched; remanent and synchronous forces and gain
    errors follow by linear least squares with priors (variable projection). The window grows until the newest
    samples no longer fall freely.

    Parameters
    ----------
    record : Record
        The record; its planes are those of ``rotor.plane_rows``.
    rotor : FreeRotor
        The released rotor.
    levitated : LevitatedModel
        Readings before the drop.
    window : tuple of float
        First guess of the release, a time that is surely in free fall, and the latest end of it [s].
    """
    origin, surely, latest = window
    record = record.window(origin - 2.0 * _LEAD, latest + _LEAD)
    tabulated: list[tuple[float, FallResponses]] = []

    def until(end: float) -> _Problem:
        if not tabulated or end > tabulated[-1][0]:
            ahead = max(end, min(latest, end + _AHEAD))
            tabulated.append((ahead, _responses(rotor, levitated, ahead - origin)))
        return _problem(record, rotor, levitated, (origin, end), tabulated[-1][1])

    first = until(min(surely, latest))
    # A short window has several minima: the lost lift begins a little earlier or later, and a turning force
    # with another phase takes up the rest. One that is wrong shows when the window grows, so every start
    # grows by itself, and the one that describes the longest fall at noise level is the release.
    grown = None
    for offset in _STARTS:
        found = _grown(first, _search(first, np.array([offset, np.log(REMANENT_TIME[0])])), until, latest)
        if grown is None or found.rank > grown.rank:
            grown = found
        if grown.is_whole(latest):
            break
    assert grown is not None
    return _fall(grown.problem, grown.best, levitated, record.gains)


def linearised(record: Record, levitated: LevitatedModel, fall: Fall) -> tuple[Array, Array]:
    """Residual of a fall over the noise and its derivatives by all that was sought.

    Returns
    -------
    residual : array, shape (T S + K,)
        Readings less prediction over the noise, sensor after sensor within each sample, then what was sought
        less what was expected over its deviation [1].
    jacobian : array, shape (T S + K, K)
        Its derivatives by forces, gains, release and time constant.
    """
    origin = fall.start + _LEAD - 1e-9  # the samples of the fit, whatever its first guess was
    responses = _responses(fall.rotor, levitated, fall.end - origin)
    problem = _problem(record, fall.rotor, levitated, (origin, fall.end), responses)
    best = np.array([1e3 * (fall.instant - origin), np.log(fall.remanent_time)])
    unknown, residual = problem.solve(*problem.named(best))
    weight = 1.0 / problem.noise

    def columns_at(search: Array) -> tuple[Array, Array]:
        dropped, columns = problem.columns(problem.time, *problem.named(search))
        return dropped + columns @ unknown, columns

    _, columns = columns_at(best)
    step = 1e-2
    searched = [
        (columns_at(best + step * unit)[0] - columns_at(best - step * unit)[0]) / (2.0 * step)
        for unit in np.eye(2)
    ]
    of_readings = np.concatenate([columns, np.stack(searched, axis=-1)], axis=-1) * weight[None, :, None]
    expected = np.concatenate([1.0 / problem.prior_error, [0.0, 1.0 / REMANENT_TIME[1]]])
    jacobian = -np.vstack([of_readings.reshape(-1, len(expected)), np.diag(expected)])
    late = (np.log(REMANENT_TIME[0]) - best[1]) / REMANENT_TIME[1]
    return np.concatenate([residual, [0.0, late]]), jacobian


@dataclass(frozen=True, kw_only=True)
class _Grown:
    """A search whose window has grown as far as the readings fall freely."""

    problem: _Problem
    best: tuple[Array, float, Array]

    @property
    def misfit(self) -> float:
        """Mean square of the residual over the noise, priors included."""
        return 2.0 * self.best[1] / self.problem.deviation.size

    @property
    def rank(self) -> tuple[bool, float, float]:
        """Better is larger: at noise level, over a longer fall, with less residual."""
        good = self.misfit <= _GOOD
        return good, float(self.problem.time[-1]) if good else 0.0, -self.misfit

    def is_whole(self, latest: float) -> bool:
        """Whether everything up to the latest end is explained at noise level."""
        return self.misfit <= _GOOD and float(self.problem.time[-1]) + _GROWTH > latest


def _grown(
    problem: _Problem,
    best: tuple[Array, float, Array],
    until: Callable[[float], _Problem],
    latest: float,
) -> _Grown:
    """Lengthen the window while its newest samples are those of a free fall."""
    while problem.time[-1] + _GROWTH <= latest:
        longer = until(float(problem.time[-1]) + _GROWTH)
        found = _search(longer, best[0])
        if longer.newest_misfit(found[0]) > _STILL_FREE:
            break
        problem, best = longer, found
    return _Grown(problem=problem, best=best)


def _search(problem: _Problem, start: Array) -> tuple[Array, float, Array]:
    """Search release and time constant from a start; gives them, the cost and the Jacobian."""
    from scipy.optimize import least_squares

    found = least_squares(problem.residual, start, x_scale=(0.1, 0.3), max_nfev=30, xtol=1e-6, ftol=1e-6)
    return found.x, float(found.cost), found.jac


def _fall(
    problem: _Problem, best: tuple[Array, float, Array], levitated: LevitatedModel, gain: Array
) -> Fall:
    search, _, jacobian = best
    release, decay = problem.named(search)
    unknown, residual = problem.solve(release, decay)
    misfit = float(np.mean(residual[: problem.deviation.size] ** 2))
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * max(misfit, 1.0)
    rotor, ambs = problem.rotor, len(problem.rotor.lift)

    def predicted(time: Array) -> Array:
        fall, columns = problem.columns(time, release, decay)
        return levitated.readings(time) + (fall + columns @ unknown) / gain

    return Fall(
        instant=release,
        standard_error=float(1e-3 * np.sqrt(covariance[0, 0])),
        remanent_force=np.column_stack([unknown[:ambs] * rotor.lift, unknown[ambs : 2 * ambs] * rotor.lift]),
        remanent_time=decay,
        gain_errors=unknown[-len(gain) :],
        misfit=misfit,
        start=float(problem.time[0]),
        end=float(problem.time[-1]),
        method=rotor.description,
        rotor=rotor,
        predicted=predicted,
    )


def _responses(rotor: FreeRotor, levitated: LevitatedModel, length: float) -> FallResponses:
    """Responses that reach over a fall of some length from the first guess of the release [s]."""
    return FallResponses.of(rotor, 2 * np.pi * levitated.frequency, length + 2 * _LEAD)


def _problem(
    record: Record,
    rotor: FreeRotor,
    levitated: LevitatedModel,
    window: tuple[float, float],
    responses: FallResponses,
) -> _Problem:
    origin, end = window
    keep = (record.time >= origin - _LEAD) & (record.time <= end)
    time = record.time[keep]
    deviation = record.signals[keep] - levitated.readings(time)
    gain, unit = record.gains, record.directions
    speed = 2 * np.pi * levitated.frequency
    amplitude = float(np.mean(np.abs(levitated.amplitudes[0])))
    mean, error = _priors(rotor, record.sensors, rotor.mass * amplitude * speed**2)
    return _Problem(
        time=time,
        deviation=deviation * gain,
        noise=np.maximum(levitated.noise * gain, 1e-12),
        directions=unit[:, 0] + 1j * unit[:, 1],
        plane_of=record.plane_of,
        rotor=rotor,
        origin=origin,
        responses=responses,
        prior_mean=mean,
        prior_error=error,
    )


def _priors(rotor: FreeRotor, sensors: tuple[Sensor, ...], turning: float) -> tuple[Array, Array]:
    """Expected values and standard deviations of the unknowns, in the order of the columns."""
    ambs, count = len(rotor.lift), len(sensors)
    share, spread = REMANENT_SHARE
    turning = max(turning, 1e-3 * float(np.sum(np.abs(rotor.lift))))
    mean = np.concatenate([np.zeros(ambs), np.full(ambs, share), np.zeros(4 * ambs + count)])
    forces = [_SIDEWAYS_SHARE, spread, turning, turning, _BACKWARD_SHARE * turning, _BACKWARD_SHARE * turning]
    return mean, np.concatenate([np.repeat(forces, ambs), [_gain_error(sensor) for sensor in sensors]])


def _gain_error(sensor: Sensor) -> float:
    """Standard deviation of the gain, as every estimate takes it."""
    return max(sensor_prior(parameter("gain", "sensor"), sensor.gain, smallest_gap=1.0).sigma, 1e-4)
