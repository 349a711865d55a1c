"""How a rotor leaves its levitated motion when the magnetic bearings let go, and what lift remained.

Up to power-off the readings follow the levitated model. From then on the rotor is free, and its deviation
from the levitated motion is its answer to the force that has gone: the static lift of every magnetic bearing,
the synchronous force, and what remains of the lift for a few milliseconds. The deviation is linear in these
forces, so hum and electrical runout drop out, and so does the unbalance; the gravity sag needs no separate
treatment.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array, ComplexArray
from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.evidence.free_rotor import GROWN, POWERS, FreeRotor, Responses
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.sensing import sensor_sigmas
from rotordrop.units import GRAVITY

if TYPE_CHECKING:
    from rotordrop.record.record import Record

REMANENT_SHARE = (0.2, 0.2)
"""Expected share of the static lift that remains at power-off, and its standard deviation (chosen, not
measured)."""

REMANENT_TIME = (REMANENCE_TIME, 0.7)
"""Expected time constant of the remanent lift [s], and the standard deviation of its logarithm."""

_SIDEWAYS_SHARE = 0.1
"""Standard deviation of the remanent force sideways over the static lift [1]; chosen, not measured."""

_BACKWARD_SHARE = 0.3
"""That of the turning force against the spin over the one with it [1]; chosen, not measured."""

HELD_MOVES, LOOSE = 0.5, 2.0
"""How fast a held end of a rotor moves over a free fall at most, where the other end falls, and the factor to
which the loop of its magnet is known [1] (chosen): a rod held at its end by nothing rises there by half."""

_GROWTH = 4e-4
"""Step by which the window of the fit grows [s] (chosen)."""

_GOOD = 2.0
"""Mean square over the noise up to which a search counts as successful (chosen)."""

_AHEAD = 10e-3
"""Responses are tabulated so far ahead of a window that may grow [s] (chosen)."""

_STILL_FREE = 4.0
"""Mean square over the noise up to which the newest samples count as free fall (chosen): beyond, a contact
has begun."""

_STARTS = (0.0, -0.7, 0.6, -1.4, 1.2)
"""Where the search for the release begins, from the first guess [ms]; the later ones only when needed."""

_OTHERS = (-0.7, 0.6)
"""Where the search begins anew once the whole fall is explained [ms]: of ten clean drops that were doubted
three had the lowest minimum elsewhere, 0.7 to 1.2 ms later; the second of these leads there in all three."""

_LOWER = 1.0
"""Half a chi square by which another minimum has to be lower to be taken [1]: searches that end in the same
one differ by less."""

_SPACING = 40e-6
"""Time between samples at least, where noise is not white [s] (chosen): more of them bring little, and
its covariance is a full matrix."""

_LEAD = 5e-3
"""Levitated samples kept before the earliest release [s] (chosen)."""

_STEP = 1e-2
"""Step of the derivatives by release [ms] and logarithm of the time constant."""


@dataclass(frozen=True, kw_only=True)
class FallProblem:
    """Readings of a fall, and the released rotor that is to explain them.

    Release and time constant of the remanent lift are searched; the other unknowns follow linearly. Their
    order: remanent forces in x and in y over static lift, turning forces with the spin and against it (real,
    then imaginary parts), per place where the rotor was held; of every magnet that stays on, forces that grow
    with powers of the time, in x and then in y [N]; relative gain errors of the sensors.
    """

    time: Array
    deviation: Array
    noise: Array
    """Samples: times [s], deviation from the levitated motion along the sensors (T, S) and noise (S,) [m]."""
    record: Record
    levitated: LevitatedModel
    rotor: FreeRotor
    """Whose they are, what the rotor did before, and the model."""
    origin: float
    """First guess of the release [s], from which the searched release counts."""
    responses: Responses
    prior_mean: Array
    prior_error: Array

    def columns(self, time: Array, release: float, decay: float) -> tuple[Array, Array]:
        """Fall of the sensors by the lost lift, shape (T, S), and what every unknown adds, (T, S, U)."""
        since, lift = time - release, self.rotor.lift
        free, fixed = self.responses.at(since)
        step, forward, backward = np.split(self.seen(fixed), 3, axis=-1)
        left = self.seen(self.responses.fading(decay, since, free)) * lift
        # over two or three places `sum` takes five times as long
        fall = np.einsum("tsa->ts", step.imag * lift - step.real * self.rotor.aside)
        parts = [column for unit in (left, forward, backward) for column in (unit.real, -unit.imag)]
        expected = fall + np.einsum("tsa->ts", parts[1]) * REMANENT_SHARE[0]
        # a gain that is off shows as a share of the fall that is expected, so the problem stays linear
        own = expected[:, :, None] * np.eye(fall.shape[1])
        held = self.seen(self.responses.growing(since))
        return fall, np.concatenate([*parts, held.real, -held.imag, own], axis=-1)

    def seen(self, response: ComplexArray) -> ComplexArray:
        """Complex displacement of the planes as the sensors see it; the real part is the reading."""
        unit = self.record.directions
        return response[:, self.record.plane_of, :] * (unit[:, 0] - 1j * unit[:, 1])[None, :, None]

    def solve(self, release: float, decay: float) -> tuple[Array, Array]:
        """Best unknown forces and gains, and the weighted residual with the priors."""
        fall, columns = self.columns(self.time, release, decay)
        left = self.over_noise(columns).reshape(-1, columns.shape[-1])
        right = self.over_noise(self.deviation - fall).reshape(-1)
        left = np.vstack([left, np.diag(1.0 / self.prior_error)])
        right = np.concatenate([right, self.prior_mean / self.prior_error])
        unknown: Array = np.linalg.solve(left.T @ left, left.T @ right).astype(np.float64)
        return unknown, right - left @ unknown

    def over_noise(self, values: Array) -> Array:
        """Values along the sensors (T, S, ...) [m] over their noise [1], what is new in each sample."""
        slow, apart = self.levitated.slow_noise, float(self.time[1] - self.time[0])
        return slow.over_noise(values, self.noise, self.record.gains, apart)

    def named(self, search: Array) -> tuple[float, float]:
        """Release [s] and time constant [s] of the searched numbers."""
        # 0.07 to 30 ms: beyond, a lift that fades is none at all, or one that stays
        return self.origin + 1e-3 * float(search[0]), float(np.exp(np.clip(search[1], -9.5, -3.5)))

    def newest_misfit(self, search: Array) -> float:
        """Mean square of the residual over the noise in the newest samples, in the worst sensor."""
        residual = self.solve(*self.named(search))[1][: self.deviation.size].reshape(self.deviation.shape)
        newest = self.time > self.time[-1] - _GROWTH
        return float(np.max(np.mean(residual[newest] ** 2, axis=0)))

    def residual(self, search: Array) -> Array:
        """Residual to be made small over release [ms from the origin] and logarithm of the time constant."""
        prior = (search[1] - np.log(REMANENT_TIME[0])) / REMANENT_TIME[1]
        return np.append(self.solve(*self.named(search))[1], prior)

    def searched(self, start: Array) -> tuple[Array, float, Array]:
        """Release and time constant searched from a start, with the cost and the Jacobian."""
        from scipy.optimize import least_squares

        found = least_squares(self.residual, start, x_scale=(0.1, 0.3), max_nfev=30, xtol=1e-6, ftol=1e-6)
        return found.x, float(found.cost), found.jac


@dataclass(frozen=True, kw_only=True, eq=False)
class Fall:
    """The fall fitted by a released rotor."""

    problem: FallProblem
    """What was fitted."""
    search: Array
    jacobian: Array
    """Where the search ended, and the derivatives of the residual there."""

    @cached_property
    def _solved(self) -> tuple[Array, Array]:
        return self.problem.solve(self.instant, self.remanent_time)

    @property
    def rotor(self) -> FreeRotor:
        """The model."""
        return self.problem.rotor

    @property
    def unknown(self) -> Array:
        """Forces and gains, in the order of `FallProblem`."""
        return self._solved[0]

    @property
    def instant(self) -> float:
        """Release, in record time [s]."""
        return self.problem.named(self.search)[0]

    @property
    def standard_error(self) -> float:
        """Standard error of `instant` from the noise and the fit [s]."""
        covariance = np.linalg.pinv(self.jacobian.T @ self.jacobian) * max(self.misfit, 1.0)
        return float(1e-3 * np.sqrt(covariance[0, 0]))

    @property
    def remanent_force(self) -> Array:
        """Lift left at the release, x and y per place where the rotor was held [N], shape (A, 2)."""
        lift = self.rotor.lift
        return self.unknown[: 2 * len(lift)].reshape(2, -1).T * lift[:, None]

    @property
    def remanent_time(self) -> float:
        """Time constant of its decay [s]."""
        return self.problem.named(self.search)[1]

    @property
    def gain_errors(self) -> Array:
        """How much more than the model each sensor reads, relative [1]; held near zero by the known gains,
        shape (S,).
        """
        return self.unknown[-self.problem.deviation.shape[1] :]

    @property
    def misfit(self) -> float:
        """Mean square of the residual over the noise (1 is a perfect model)."""
        return float(np.mean(self._solved[1][: self.problem.deviation.size] ** 2))

    @property
    def falls_freely(self) -> bool:
        """Whether the newest samples of the window are still those of a free fall."""
        return self.newest_misfit <= _STILL_FREE

    @property
    def newest_misfit(self) -> float:
        """Mean square of the residual over the noise in the newest samples, in the worst sensor."""
        return self.problem.newest_misfit(self.search)

    @property
    def start(self) -> float:
        """Begin of the window of the fit [s]."""
        return float(self.problem.time[0])

    @property
    def end(self) -> float:
        """Its end [s]."""
        return float(self.problem.time[-1])

    def read_as(self, record: Record, levitated: LevitatedModel, end: float) -> Fall:
        """The fall read another way up to a time [s], searched once, from where this search ended.

        Nobody knows how the rotor was let go but by its fall, so the readings as they should be have their
        release near; `fit_fall` looks everywhere, which costs ten times as much.
        """
        known, speed = self.problem, 2 * np.pi * levitated.frequency
        span, responses = end - known.origin + 2 * _LEAD, known.responses
        if levitated.frequency != known.levitated.frequency or not responses.reaches(span):
            responses = Responses.of(self.rotor, speed, span)
        problem = _problem(record, self.rotor, levitated, (known.origin, end), responses)
        search, _, jacobian = problem.searched(self.search)
        return Fall(problem=problem, search=search, jacobian=jacobian)

    def predicted(self, time: Array) -> Array:
        """Readings [m] of a fall that goes on without contact."""
        fall, columns = self.problem.columns(time, self.instant, self.remanent_time)
        moved = (fall + columns @ self.unknown) / self.problem.record.gains
        return self.problem.levitated.readings(time) + moved

    @cached_property
    def linearised(self) -> tuple[Array, Array]:
        """Residual over the noise (T S + K,) and its derivatives (T S + K, K) by all that was sought.

        The residual is that of the readings, sensor after sensor within each sample, then of what was sought
        against what was expected; the derivatives are those by forces, gains, release [ms] and logarithm of
        the time constant.
        """
        problem, best = self.problem, self.search
        unknown, residual = self._solved

        def fall_at(search: Array) -> Array:
            dropped, columns = problem.columns(problem.time, *problem.named(search))
            return np.asarray(dropped + columns @ unknown)

        columns = problem.columns(problem.time, *problem.named(best))[1]
        steps = _STEP * np.eye(2)
        searched = [(fall_at(best + step) - fall_at(best - step)) / (2.0 * _STEP) for step in steps]
        of_readings = problem.over_noise(np.concatenate([columns, np.stack(searched, axis=-1)], axis=-1))
        expected = np.concatenate([1.0 / problem.prior_error, [0.0, 1.0 / REMANENT_TIME[1]]])
        jacobian = -np.vstack([of_readings.reshape(-1, len(expected)), np.diag(expected)])
        late = (np.log(REMANENT_TIME[0]) - best[1]) / REMANENT_TIME[1]
        return np.concatenate([residual, [0.0, late]]), jacobian

    @cached_property
    def covariance(self) -> Array:
        """Covariance of all that was sought, in the order of `linearised`, shape (K, K)."""
        jacobian = self.linearised[1]
        scale = 1.0 / np.linalg.norm(jacobian, axis=0)
        scaled = jacobian * scale
        return np.linalg.inv(scaled.T @ scaled) * np.outer(scale, scale) * max(self.misfit, 1.0)


def fit_fall(
    record: Record, rotor: FreeRotor, levitated: LevitatedModel, window: tuple[float, float, float]
) -> Fall:
    """Find the release from the readings between the levitated part and the first contact.

    The window holds the first guess of the release, a time that is surely in free fall, and the latest end of
    it [s]. Release and time constant of the remanent lift are searched; remanent and synchronous forces and
    gain errors follow by linear least squares with priors (variable projection). The window grows until the
    newest samples no longer fall freely.
    """
    origin, surely, latest = window
    record = record.window(origin - 2.0 * _LEAD, latest + _LEAD)
    speed = 2 * np.pi * levitated.frequency
    tabulated: list[tuple[float, Responses]] = []

    def until(end: float) -> FallProblem:
        if not tabulated or end > tabulated[-1][0]:
            ahead = max(end, min(latest, end + _AHEAD))
            tabulated.append((ahead, Responses.of(rotor, speed, ahead - origin + 2 * _LEAD)))
        return _problem(record, rotor, levitated, (origin, end), tabulated[-1][1])

    first = until(min(surely, latest))
    # A short window has several minima: the lost lift begins a little earlier or later, and a turning force
    # with another phase takes up the rest. One that is wrong shows when the window grows, so every start
    # grows by itself, and the one that describes the longest fall at noise level is the release.
    grown = None
    for offset in _STARTS:
        found = _grown(first, first.searched(np.array([offset, np.log(REMANENT_TIME[0])])), until, latest)
        if grown is None or found.rank > grown.rank:
            grown = found
        if grown.is_whole(latest):
            # a wrong one may explain all of it at noise level too, with forces that no magnet has
            starts = (np.array([other, np.log(REMANENT_TIME[0])]) for other in _OTHERS)
            better = min((grown.problem.searched(start) for start in starts), key=lambda one: one[1])
            if better[1] < grown.best[1] - _LOWER:
                grown = _grown(grown.problem, better, until, latest)
            break
    assert grown is not None
    search, _, jacobian = grown.best
    return Fall(problem=grown.problem, search=search, jacobian=jacobian)


@dataclass(frozen=True, kw_only=True)
class _Grown:
    """A search whose window has grown as far as the readings fall freely."""

    problem: FallProblem
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
    problem: FallProblem,
    best: tuple[Array, float, Array],
    until: Callable[[float], FallProblem],
    latest: float,
) -> _Grown:
    """Lengthen the window while its newest samples are those of a free fall."""
    while problem.time[-1] + _GROWTH <= latest:
        longer = until(float(problem.time[-1]) + _GROWTH)
        found = longer.searched(best[0])
        if longer.newest_misfit(found[0]) > _STILL_FREE:
            break
        problem, best = longer, found
    return _Grown(problem=problem, best=best)


def _problem(
    record: Record,
    rotor: FreeRotor,
    levitated: LevitatedModel,
    window: tuple[float, float],
    responses: Responses,
) -> FallProblem:
    origin, end = window
    keep = np.flatnonzero((record.time >= origin - _LEAD) & (record.time <= end))
    if len(levitated.slow_noise.channel):
        keep = keep[:: max(1, math.floor(_SPACING * record.sampling_rate))]
    time = record.time[keep]
    speed = 2 * np.pi * levitated.frequency
    amplitude = float(np.mean(np.abs(levitated.amplitudes[0])))
    turning = max(rotor.mass * amplitude * speed**2, 1e-3 * float(np.sum(np.abs(rotor.lift))))
    ambs, (share, spread) = len(rotor.lift), REMANENT_SHARE
    forces = [_SIDEWAYS_SHARE, spread, turning, turning, _BACKWARD_SHARE * turning, _BACKWARD_SHARE * turning]
    gains = np.maximum(sensor_sigmas("gain", record.sensors, 1.0), 1e-4)
    grown = np.tile(np.repeat(held_forces(rotor), POWERS), 2)
    expected = np.zeros(len(forces) * ambs + len(grown) + len(gains))
    expected[ambs : 2 * ambs] = share
    return FallProblem(
        time=time,
        deviation=(record.signals[keep] - levitated.readings(time)) * record.gains,
        noise=np.maximum(levitated.noise * record.gains, 1e-12),
        record=record,
        levitated=levitated,
        rotor=rotor,
        origin=origin,
        responses=responses,
        prior_mean=expected,
        prior_error=np.concatenate([np.repeat(forces, ambs), grown, gains]),
    )


def held_forces(rotor: FreeRotor) -> Array:
    """Size of what a magnet that stays on adds to its force in `GROWN`, shape (H,) [N].

    A free rotor whose other end falls moves there by a part of the fall; the spring answers to the way, the
    damper to the speed, and neither is known better than to a factor of two.
    """
    speed = HELD_MOVES * GRAVITY * GROWN
    return np.array(
        [LOOSE * (stiffness * 0.5 * speed * GROWN + damping * speed) for _, stiffness, damping in rotor.held]
    )
