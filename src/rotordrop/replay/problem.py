"""The recorded drop as a function of its unknowns, simulated from just before the first contact.

The unknowns are parameters of the touchdown bearings, then the unknowns of the fall. Both are whitened:
before the impacts are read, each is normal with mean zero and standard deviation one.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Role, Step
from rotordrop.errors import IdentificationError
from rotordrop.evidence.evidence import Evidence, known
from rotordrop.evidence.free_fall import MAGNET_FORCES, kernel_state
from rotordrop.evidence.initial_state import InitialState
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.static_sag import sag_of_model, static_sag
from rotordrop.rotor.unknowns import Unknown, bearing_unknowns
from rotordrop.simulate import _loop
from rotordrop.simulate._tableau import tsit5
from rotordrop.simulate.drop import FIRST_STEP, error_scale

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TOLERANCE = 1e-7
LARGEST_STEP = 1e-3
MOST_STEPS = 400_000
LOG_ROWS = 400
LEAD = 1e-4
"""The simulation starts this long before the end of the free fall [s]; the fall before it is known in closed
form and need not be integrated again."""

MODEL_NOISE = 0.1e-6
"""Error of the reduced rotor, added to the sensor noise [m]; chosen, not measured."""

LOGARITHM_STEP = 1e-4
"""Step of the finite differences of a logarithm [1]; with 1e-3 fewer intervals held the truth."""

STEP = 0.02
"""Step of the other finite differences in prior standard deviations: above the integration error [1]."""

WIDEST = 6.0
"""Bound of an unknown without bounds of its own, in prior standard deviations [1]; chosen, not measured."""

BOUND_FACTOR = 6.0
"""A logarithmic parameter may leave its prior mean by this factor in the search [1]; chosen, not measured."""

DIRECTIONS = 40
"""Directions of the fall that the last fit follows: with 16, the others bias stiff supports by 2 % [1]."""

RANKING_WINDOW = 5e-3
"""Part of the drop after the later first contact by which the directions of the fall are ranked [s]."""


@dataclass(frozen=True, kw_only=True)
class ReplayProblem:
    """A recorded drop and its whitened unknowns; P parameters, u unknowns of the fall, S sensors, B bearings.

    A vector of unknowns ``z`` has shape (P + u,).
    """

    model: DropModel
    """Model with unbalance, remanent force and speed of this drop."""
    initial: InitialState
    """State at power-off from the fit of the fall."""
    radius: Array
    """Distance of the resting rotor from the bearing centres, air gap and static sag, shape (B,) [m]."""
    race_sag: Array
    """Part of the static sag by race and balls, shape (B,) [m]."""
    start: float
    """Time at which the simulation starts [s from power-off]."""
    state: Array
    """State there, shape (n,)."""
    time: Array
    """Samples after the start, shape (T,) [s from power-off]."""
    deviation: Array
    """Measured displacements along the sensors, from the rest position, shape (T, S) [m]."""
    noise: Array
    """Standard deviation of these, error of the reduced model included, shape (S,) [m]."""
    unknowns: tuple[Unknown, ...]
    """Parameters of the bearings; the friction is one unknown for all bearings."""
    directions: Array
    """Change of the unknowns of the fall per whitened one, the most influential first, shape (u, u)."""
    states: Array
    """Change of the state at the start, shape (n, u)."""
    unbalances: Array
    """Change of the modal unbalance, shape (2, m, u)."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the parameters."""
        return tuple(unknown.path for unknown in self.unknowns)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.unknowns) + len(self.initial.mean)

    @property
    def mean(self) -> Array:
        """Prior mean of the parameters in the measure they are estimated in, shape (P,)."""
        return np.array([unknown.mean for unknown in self.unknowns])

    @property
    def sigma(self) -> Array:
        """Prior standard deviation of the parameters, shape (P,)."""
        return np.array([unknown.sigma for unknown in self.unknowns])

    @property
    def friction(self) -> int:
        """Index of the friction coefficient."""
        return next(k for k, unknown in enumerate(self.unknowns) if unknown.parameter.step is Step.SWEEP)

    def has_role(self, role: Role) -> Mask:
        """Which unknowns are parameters of a role, shape (P + u,)."""
        roles = [unknown.parameter.role is role for unknown in self.unknowns]
        return np.array(roles + [False] * len(self.initial.mean))

    def fitted(self, directions: int) -> Mask:
        """Parameters that are not considered and so many directions of the fall, shape (P + u,).

        A fit would move a considered parameter to hide what the model lacks; it stays at its prior, and its
        uncertainty enters the covariance of the others.
        """
        place = np.arange(self.size) - len(self.unknowns)
        return np.asarray(~self.has_role(Role.CONSIDERED) & (place < directions))

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the search, shape (P + u,) each."""
        width = np.full(self.size, WIDEST)
        for k, unknown in enumerate(self.unknowns):
            width[k] = np.log(BOUND_FACTOR) / unknown.sigma if unknown.logarithmic else 5.0
        return -width, width

    def guess(self) -> Array:
        """Unknowns with the sought parameters at the values of the machine file."""
        begin = np.array([unknown.begin for unknown in self.unknowns])
        z = np.zeros(self.size)
        z[: len(begin)] = (begin - self.mean) / self.sigma
        return np.where(self.has_role(Role.SOUGHT), z, 0.0)

    def theta(self, z: Array) -> Array:
        """Parameters in the measure they are estimated in, shape (P,)."""
        return self.mean + self.sigma * z[: len(self.unknowns)]

    def fall(self, z: Array) -> Array:
        """Unknowns of the fall, shape (u,)."""
        return self.initial.mean + self.directions @ z[len(self.unknowns) :]

    def rest_error(self, z: Array) -> Array:
        """Error of the rest position (x, y) at the bearings [m], shape (B, 2)."""
        return self.fall(z)[self.initial.unknowns.rest].reshape(-1, 2)

    def with_friction(self, theta: float, sigma: float) -> ReplayProblem:
        """The problem with another prior of the friction, as the logarithm of the coefficient."""
        unknowns = list(self.unknowns)
        unknowns[self.friction] = replace(unknowns[self.friction], mean=theta, start=theta, sigma=sigma)
        return replace(self, unknowns=tuple(unknowns))

    def bearing_rows(self, z: Array) -> Array:
        """Bearing parameters of the kernel, shape (B, columns); the air gap follows from rest and sag.

        A vertical sensor zero that is off looks like an air gap, so the rest error lowers the gap.
        """
        rows = self.model.parameters.bearing.copy()
        for unknown, theta in zip(self.unknowns, self.theta(z), strict=True):
            for target in unknown.targets:
                rows[target.row, target.entry.column] = target.factor * unknown.kernel_value(float(theta))
        sag = static_sag(rows, self.race_sag, np.asarray(self.model.load_shares)).total
        rows[:, L.AIR_GAP] = self.radius - self.rest_error(z)[:, 1] - sag
        rows[:, L.ROTOR_RADIUS] = rows[:, L.BORE_RADIUS] - rows[:, L.AIR_GAP]
        return rows

    def simulated(self, z: Array, count: int) -> Array:
        """States at the first samples, shape (count, n).

        Raises
        ------
        IdentificationError
            If the simulation does not reach the last of them, for instance with values out of proportion.
        """
        moved = z[len(self.unknowns) :]
        unbalance = self.model.parameters.unbalance_cos, self.model.parameters.unbalance_sin
        cosine, sine = np.stack(unbalance) + self.unbalances @ moved
        parameters = self.model.parameters._replace(
            bearing=self.bearing_rows(z), unbalance_cos=cosine, unbalance_sin=sine
        )
        times = np.concatenate([[self.start], self.time[:count]])
        out, counters = np.empty((len(times), len(self.state))), np.zeros(5)
        outcome = _loop.integrate_drop(
            self.state + self.states @ moved,
            times,
            parameters,
            tsit5(),
            error_scale(self.model),
            TOLERANCE,
            FIRST_STEP,
            LARGEST_STEP,
            MOST_STEPS,
            out,
            np.zeros((LOG_ROWS, _loop.N_LOG_COLUMNS)),
            counters,
        )
        if outcome != _loop.FINISHED:
            raise IdentificationError(
                f"a drop simulated for the fit stopped at {1e3 * counters[4]:.3g} ms (outcome {outcome}); "
                f"expected {1e3 * times[-1]:.3g} ms. Check the machine's guesses for support and contact."
            )
        return out[1:]

    def predicted(self, states: Array, z: Array) -> Array:
        """Deviation from rest that the sensors would read of states (T, n) [m], shape (T, S)."""
        sensing, fall, at = self.initial.sensing, self.fall(z), self.initial.unknowns
        settled = self.initial.settled + sensing.from_bearings.reshape(len(self.noise), -1) @ fall[at.rest]
        along = states[:, : sensing.rows.shape[1]] @ sensing.rows.T
        return np.asarray((1.0 + fall[at.gain]) * (along - settled))

    def samples_until(self, time: float) -> int:
        """Number of samples up to a time [s from power-off]."""
        return int(np.searchsorted(self.time, time + 1e-9))

    def residual(self, z: Array, window: float) -> Array:
        """Readings over their noise, simulated less measured, up to a time from power-off [s], shape (r,)."""
        count = self.samples_until(window)
        apart = self.predicted(self.simulated(z, count), z) - self.deviation[:count]
        return np.asarray((apart / self.noise).ravel())

    def misfit(self, z: Array, window: float) -> float:
        """Sum of squares of the residual; infinite where the simulation does not get through."""
        try:
            residual = self.residual(z, window)
        except IdentificationError:
            return float("inf")
        return float(residual @ residual)

    def jacobian(self, z: Array, window: float, chosen: Mask, pool: Executor | None = None) -> Array:
        """Change of the residual per chosen unknown, shape (r, number chosen)."""
        here = self.residual(z, window)
        step = np.full(self.size, STEP)
        for k, unknown in enumerate(self.unknowns):
            step[k] = LOGARITHM_STEP / unknown.sigma if unknown.logarithmic else 0.5 * STEP

        def column(k: int) -> Array:
            inward = -step[k] if z[k] + step[k] > self.bounds[1][k] else step[k]
            try:
                return slope(k, inward)
            except IdentificationError:
                # A column of zeros would say that the unknown has no effect, and leave it at its prior with
                # the error of one that was fitted.
                return slope(k, -inward)

        def slope(k: int, by: float) -> Array:
            moved = z.copy()
            moved[k] += by
            return np.asarray((self.residual(moved, window) - here) / by)

        each: Callable[..., object] = map if pool is None else pool.map
        return np.column_stack(list(each(column, np.flatnonzero(chosen))))  # type: ignore[call-overload]


def replay_problem(evidence: Evidence, *, until: float) -> ReplayProblem:
    """The problem of a recorded drop.

    Parameters
    ----------
    evidence : Evidence
        What the record says up to the first contact and at rest.
    until : float
        Last time that is compared [s from power-off].
    """
    model, initial = evidence.model, known(evidence.fall)
    start = max(initial.end - LEAD, 0.0)
    state, remanent, unbalance = _start_state(initial, initial.mean, start)
    time = evidence.record.time - initial.drop_instant
    compared = (time > start + 1e-9) & (time <= until)
    root = initial.square_root()
    states, unbalances = _start_slopes(initial, start)
    problem = ReplayProblem(
        model=replace(model, parameters=drop_parameters(model, initial, remanent, unbalance)),
        initial=initial,
        radius=known(evidence.rest).radius,
        race_sag=sag_of_model(model).race,
        start=start,
        state=state,
        time=time[compared],
        deviation=initial.deviation_of(evidence.record)[compared],
        noise=np.hypot(initial.noise, MODEL_NOISE),
        unknowns=_parameters(model),
        directions=root,
        states=states @ root,
        unbalances=unbalances @ root,
    )
    return _ranked(problem, evidence.latest_first_contact + RANKING_WINDOW)


def drop_parameters(
    model: DropModel, initial: InitialState, remanent: Array, unbalance: Array
) -> L.KernelParameters:
    """Kernel parameters of one drop: speed, remanent forces (A, 2) [N], modal unbalance (2, m)."""
    p = model.parameters
    magnet, spin, flags = p.magnet.copy(), p.spin.copy(), p.flags.copy()
    magnet[:, MAGNET_FORCES] = remanent
    spin[L.INITIAL_SPEED] = initial.fall.speed
    spin[L.POWER_OFF_DELAY] = 0.0
    spin[L.REMANENCE_TIME_CONSTANT] = initial.decay
    flags[L.SPIN_MODE] = aerodynamics.EXPONENTIAL_IN_TIME
    flags[L.MAGNETS_ACT] = 1
    return p._replace(
        magnet=magnet, spin=spin, flags=flags, unbalance_cos=unbalance[0], unbalance_sin=unbalance[1]
    )


def _parameters(model: DropModel) -> tuple[Unknown, ...]:
    """Sought parameters of the first impacts, then all others, then one friction for all bearings."""
    bearings = range(len(model.machine.touchdown_bearings))
    unknowns = [unknown for b in bearings for unknown in bearing_unknowns(model, b)]
    impacts = [unknown for unknown in unknowns if unknown.parameter.step is Step.IMPACTS]
    impacts.sort(key=lambda unknown: unknown.parameter.role is not Role.SOUGHT)
    frictions = [unknown for unknown in unknowns if unknown.parameter.step is Step.SWEEP]
    targets = tuple(target for unknown in frictions for target in unknown.targets)
    return (*impacts, replace(frictions[0], owner="", targets=targets))


def _start_state(initial: InitialState, unknowns: Array, start: float) -> tuple[Array, Array, Array]:
    """State, remanent forces and modal unbalance at the start for values of the unknowns of the fall."""
    fall = initial.fall
    return kernel_state(fall, initial.state_at(start, unknowns), fall.speed * start)


def _start_slopes(initial: InitialState, start: float) -> tuple[Array, Array]:
    """Change of the start state (n, u) and of the modal unbalance (2, m, u) per unknown of the fall."""
    states, unbalances = [], []
    for k, sigma in enumerate(np.sqrt(np.diag(initial.covariance))):
        step = np.zeros(len(initial.mean))
        step[k] = 1e-3 * sigma
        (above, _, more), (below, _, less) = (
            _start_state(initial, initial.mean + by, start) for by in (step, -step)
        )
        states.append((above - below) / (2.0 * step[k]))
        unbalances.append((more - less) / (2.0 * step[k]))
    return np.column_stack(states), np.stack(unbalances, axis=-1)


def _ranked(problem: ReplayProblem, window: float) -> ReplayProblem:
    """The problem whose directions of the fall are sorted by what they change of the first impacts.

    Directions of a covariance do not depend on which square root of it they are turned from.
    """
    directions = np.arange(problem.size) >= len(problem.unknowns)
    effects = problem.jacobian(problem.guess(), window, directions)
    turn = np.linalg.eigh(effects.T @ effects)[1][:, ::-1]
    largest = np.argmax(np.abs(turn), axis=0)
    turn = turn * np.sign(turn[largest, np.arange(len(turn))])
    return replace(
        problem,
        directions=problem.directions @ turn,
        states=problem.states @ turn,
        unbalances=problem.unbalances @ turn,
    )
