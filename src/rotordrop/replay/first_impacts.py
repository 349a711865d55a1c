"""The recorded drop run again with other parameters, from just before the first contact, and its unknowns.

The fit of the fall leaves some sixty unknowns with their covariance. A few combinations of them matter to the
impacts: the fit of the supports follows those.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Role, Step
from rotordrop.errors import IdentificationError
from rotordrop.evidence.evidence import Evidence, known
from rotordrop.evidence.initial_state import (
    MAGNET_FORCES,
    InitialState,
    build_free_fall,
    kernel_state,
)
from rotordrop.evidence.sensing import build_sensing
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.replay.least_squares import Unknowns
from rotordrop.rotor.parameters import DropModel, sag_of_model, static_sag
from rotordrop.rotor.unknowns import Unknown, bearing_unknowns
from rotordrop.simulate._loop import Control
from rotordrop.simulate._run import PHASE, Run, Setup, error_scale, follow

LEADING = ("support.stiffness", "support.mass", "support.damping", "contact.stiffness")
"""What the first window shows; by the first two the fit tells minima apart."""
TOLERANCE = 1e-7
LARGEST_STEP = 1e-3
MOST_STEPS = 400_000
LEAD = 1e-4
"""Time before the end of the free fall at which the simulation starts [s]: the fall is linear and known in
closed form, so only what follows it has to be integrated again and again."""

DIRECTIONS = 16
"""Directions of the initial state's uncertainty that are fitted along; chosen, not measured."""

LEADING_DIRECTIONS = 8
"""How many of them while many starts run; chosen, not measured."""

TANGENT = 1e-3
"""Step of the tangent of the start state, in standard deviations of each unknown of the fall."""

MODEL_NOISE = 0.1e-6
"""What the reduced rotor leaves out, beside the sensor noise [m]."""

STEP = 1e-4
BOUND_FACTOR = np.log(6.0)
"""The search may leave the prior mean by this much, in logarithms, on both sides; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class Directions:
    """Directions of the fall's unknowns, one standard deviation each, that which matters most first."""

    unknowns: Array
    """Change of the unknowns of the fall, shape (u, K)."""
    states: Array
    """Change of the state at the start of the simulation, shape (n, K)."""
    unbalances: Array
    """Change of the modal unbalance, shape (2, m, K)."""


class Trial(NamedTuple):
    """Values of all unknowns of a drop."""

    theta: Array
    """Parameters of the bearings, in the measure they are estimated in, shape (P,)."""
    fall: Array
    """Unknowns of the fall, shape (u,)."""


@dataclass(frozen=True, kw_only=True)
class FirstImpacts:
    """The first impacts of a recorded drop, to be simulated again and again; a problem for a search.

    Its unknowns are parameters of the bearings, then directions of the initial state. T samples, S sensors, B
    bearings.
    """

    model: DropModel
    """The model, with unbalance, remanent force and speed of this drop."""
    initial: InitialState
    """Initial state of the drop, of the model's own reduction."""
    radius: Array
    """Settled radius [m]: air gap and static sag together, as the tail gives them, shape (B,)."""
    race_sag: Array
    """Part of the static sag that race and balls take [m], shape (B,)."""
    start: float
    """Time from power-off at which the simulation starts [s]."""
    time: Array
    """Samples after that [s from power-off], shape (T,)."""
    deviation: Array
    """Measured displacements along the sensors, from the rest position [m], shape (T, S)."""
    unknowns: tuple[Unknown, ...]
    """Supports, what else is uncertain, and one friction for all bearings."""
    directions: Directions
    """Directions of the initial state that are fitted along."""

    @cached_property
    def table(self) -> Unknowns:
        """Priors, steps and bounds of all unknowns."""
        rows = [
            (
                one.mean,
                one.sigma,
                one.begin if one.parameter.role is Role.SOUGHT else one.mean,
                *((STEP, 0.5, BOUND_FACTOR) if one.logarithmic else one.sigma * np.array([1e-2, 2.0, 5.0])),
                one.parameter.path in LEADING,
                one.parameter.path in LEADING[:2],
                one.parameter.role is Role.CONSIDERED,
            )
            for one in self.unknowns
        ]
        for k in range(self.directions.unknowns.shape[1]):
            rows.append((0.0, 1.0, 0.0, 0.02, 3.0, 6.0, k < LEADING_DIRECTIONS, False, False))
        mean, sigma, begin, step, reach, width, *flags = map(np.array, zip(*rows, strict=True))
        return Unknowns(
            mean=mean,
            sigma=sigma,
            begin=begin,
            step=step,
            reach=reach,
            lower=mean - width,
            upper=mean + width,
            leading=flags[0],
            decisive=flags[1],
            considered=flags[2],
        )

    @cached_property
    def error_scale(self) -> Array:
        """Scale of the integration error of every state, shape (n,)."""
        return error_scale(self.model)

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(one.path for one in self.unknowns)

    @property
    def supports(self) -> list[int]:
        """Indices of what is sought in the first impacts: stiffness, mass and damping of every support."""
        rows = [one.parameter for one in self.unknowns]
        return [k for k, row in enumerate(rows) if row.role is Role.SOUGHT and row.step is Step.IMPACTS]

    @property
    def friction(self) -> int:
        """Index of the friction that the sweep finds, one for all bearings."""
        return next(k for k, one in enumerate(self.unknowns) if one.parameter.step is Step.SWEEP)

    def trial(self, x: Array) -> Trial:
        """Parameters of the bearings, and unknowns of the fall."""
        count = len(self.unknowns)
        return Trial(x[:count], self.initial.mean + self.directions.unknowns @ x[count:])

    def rows(self, trial: Trial) -> Array:
        """Parameters of the bearings for values of the unknowns, shape (B, columns).

        The air gap follows from settled radius, sag and the error of the rest position: a vertical sensor
        zero looks like a gap.
        """
        rows = self.model.parameters.bearing.copy()
        for unknown, number in zip(self.unknowns, trial.theta, strict=True):
            value = unknown.kernel_value(float(number))
            for target in unknown.targets:
                rows[target.row, target.entry.column] = target.factor * value
        down = trial.fall[self.initial.unknowns.rest].reshape(-1, 2)[:, 1]
        sag = static_sag(rows, self.race_sag, np.asarray(self.model.load_shares)).total
        rows[:, L.AIR_GAP] = self.radius - down - sag
        return rows

    @cached_property
    def start_state(self) -> Array:
        """State at the start of the simulation, shape (n,)."""
        return start_state(self.initial, self.start, self.initial.mean)[0]

    def run(self, rows: Array, time: Array, state: Array, unbalance: Array) -> Array:
        """States (T, n) at times [s from power-off] after the start, from a state (n,) on.

        ``rows`` are the parameters of the bearings, ``unbalance`` (2, m) is that of the modes.

        Raises
        ------
        IdentificationError
            If the simulation does not get through, for instance with a value out of all proportion.
        """
        p = with_bearing(self.model.parameters, rows)
        setup = Setup(
            parameters=p._replace(unbalance_cos=unbalance[0], unbalance_sin=unbalance[1]),
            control=Control(self.error_scale, TOLERANCE, LARGEST_STEP, MOST_STEPS, -1.0, 0.0, 0.0, True),
        )
        run = Run.begun(setup, state, len(time), self.start)
        states = follow(setup, run, np.append(self.start, time), with_histories=False).states
        if run.status[PHASE] < 0:
            raise IdentificationError(
                f"a drop simulated for the fit stopped at {1e3 * run.time:.3g} ms (outcome "
                f"{-run.status[PHASE]:.0f}); expected {1e3 * time[-1]:.3g} ms. Check the machine's guesses "
                "for support and contact."
            )
        return states[1:]

    def predicted(self, states: Array, fall: Array) -> Array:
        """Deviation from rest that the sensors would read [m], shape (T, S), of states (T, n)."""
        sensing, unknowns = self.initial.sensing, self.initial.unknowns
        along = np.asarray(states[:, : sensing.rows.shape[1]] @ sensing.rows.T)
        moved = sensing.from_bearings.reshape(len(sensing.rows), -1) @ fall[unknowns.rest]
        return np.asarray((1.0 + fall[unknowns.gain]) * (along - (self.initial.settled + moved)))

    def until(self, time: float) -> int:
        """Number of samples up to a time from power-off [s]."""
        return int(np.searchsorted(self.time, time + 1e-9))

    def difference(self, x: Array, count: int) -> Array:
        """Simulated minus measured displacement along the sensors [m], shape (count, S)."""
        trial, moved, p = self.trial(x), x[len(self.unknowns) :], self.model.parameters
        state = self.start_state + self.directions.states @ moved
        unbalance = np.stack([p.unbalance_cos, p.unbalance_sin]) + self.directions.unbalances @ moved
        states = self.run(self.rows(trial), self.time[:count], state, unbalance)
        return self.predicted(states, trial.fall) - self.deviation[:count]

    def residual(self, x: Array, window: float) -> Array:
        """Weighted residual up to a time from power-off [s], shape (r,)."""
        noise = np.hypot(self.initial.noise, MODEL_NOISE)
        return np.asarray((self.difference(x, self.until(window)) / noise).ravel())


def first_impacts(evidence: Evidence, model: DropModel, *, until: float) -> FirstImpacts:
    """Make the first impacts of a recorded drop, up to a time from power-off [s], ready to be run again.

    The model may be of a coarser reduction than that of the initial state.
    """
    initial = known(evidence.fall)
    if model.basis is not initial.fall.model.basis:
        initial = _transferred(initial, model)
    start = max(initial.end - LEAD, 0.0)
    time = evidence.record.time - initial.drop_instant
    keep = (time > start + 1e-9) & (time <= until)
    # what is sought, then what is not known exactly either, and one friction for all bearings
    every = [u for b in range(len(model.machine.touchdown_bearings)) for u in bearing_unknowns(model, b)]
    impacts = [one for one in every if one.parameter.step is Step.IMPACTS]
    frictions = [one for one in every if one.parameter.step is Step.SWEEP]
    friction = replace(frictions[0], owner="", targets=tuple(t for one in frictions for t in one.targets))
    return FirstImpacts(
        model=replace(model, parameters=drop_parameters(model, initial, start)),
        initial=initial,
        radius=known(evidence.rest).radius,
        race_sag=sag_of_model(model).race,
        start=start,
        time=time[keep],
        deviation=initial.deviation_of(evidence.record)[keep],
        unknowns=(*sorted(impacts, key=lambda one: one.parameter.role is not Role.SOUGHT), friction),
        directions=influential_directions(initial, start),
    )


def with_bearing(parameters: KernelParameters, rows: Array) -> KernelParameters:
    """The same kernel parameters with other rows of bearings; the rotor radius follows the air gap."""
    rows[:, L.ROTOR_RADIUS] = rows[:, L.BORE_RADIUS] - rows[:, L.AIR_GAP]
    return parameters._replace(bearing=rows)


def start_state(initial: InitialState, time: float, fall: Array) -> tuple[Array, Array, Array]:
    """State (n,), remanent forces (A, 2) [N] and modal unbalance (2, m) at a time from power-off [s]."""
    return kernel_state(initial.fall, initial.state_at(time, fall), initial.fall.speed * time)


def drop_parameters(model: DropModel, initial: InitialState, time: float) -> KernelParameters:
    """Kernel parameters of one drop from a time on: its speed, remanent forces and modal unbalance."""
    p = model.parameters
    magnet, spin, flags = p.magnet.copy(), p.spin.copy(), p.flags.copy()
    _, magnet[:, MAGNET_FORCES], unbalance = start_state(initial, time, initial.mean)
    spin[L.INITIAL_SPEED] = initial.fall.speed
    spin[L.POWER_OFF_DELAY] = 0.0
    spin[L.REMANENCE_TIME_CONSTANT] = initial.decay
    flags[L.SPIN_MODE] = aerodynamics.EXPONENTIAL_IN_TIME
    flags[L.MAGNETS_ACT] = 1
    return p._replace(
        magnet=magnet, spin=spin, flags=flags, unbalance_cos=unbalance[0], unbalance_sin=unbalance[1]
    )


def _transferred(initial: InitialState, model: DropModel) -> InitialState:
    """The same initial state in the coordinates of another reduction of the same rotor."""
    old = initial.fall
    fall = build_free_fall(model, old.speed, old.nodes)
    project = model.basis.shapes.T @ model.fe.mass @ old.model.basis.shapes
    old_m, m = old.n_modes, fall.n_modes
    whole = np.zeros((initial.unknowns.size - old.size + fall.size, initial.unknowns.size))
    for k in range(4):
        whole[k * m : (k + 1) * m, k * old_m : (k + 1) * old_m] = project
    whole[4 * m :, 4 * old_m :] = np.eye(len(whole) - 4 * m)
    return replace(
        initial,
        fall=fall,
        sensing=build_sensing(model, initial.sensors),
        unknowns=replace(initial.unknowns, n_states=fall.size),
        mean=whole @ initial.mean,
        covariance=whole @ initial.covariance @ whole.T,
    )


def influential_directions(initial: InitialState, start: float, count: int = DIRECTIONS) -> Directions:
    """Directions of the fall's unknowns that move the drop after a start [s from power-off] most.

    They follow from the covariance and from the tangent of the start state, so they are the same whichever
    square root of the covariance stands between: along secants over its columns they would not be, because
    the remanent force decays with one of the unknowns.
    """
    root = initial.square_root()
    states, unbalances = [], []
    for k, sigma in enumerate(np.sqrt(np.diag(initial.covariance))):
        step = np.zeros(len(initial.mean))
        step[k] = TANGENT * sigma
        above, below = (start_state(initial, start, initial.mean + s) for s in (step, -step))
        states.append((above[0] - below[0]) / (2.0 * step[k]))
        unbalances.append((above[2] - below[2]) / (2.0 * step[k]))
    changes, turned_mass = np.column_stack(states) @ root, np.stack(unbalances, axis=-1) @ root
    seen_by_sensors = [root[initial.unknowns.gain] / 5e-3, root[initial.unknowns.rest] / 5e-6]
    effects = np.vstack([*_effects(initial, changes, turned_mass), *seen_by_sensors])
    leading = np.linalg.svd(effects)[2][:count].T
    unknowns = root @ leading
    largest = np.argmax(np.abs(unknowns) / np.sqrt(np.diag(initial.covariance))[:, None], axis=0)
    signs = np.sign(unknowns[largest, np.arange(count)])
    leading = leading * signs
    return Directions(unknowns=unknowns * signs, states=changes @ leading, unbalances=turned_mass @ leading)


def _effects(initial: InitialState, changes: Array, unbalances: Array) -> list[Array]:
    """What directions change at the bearings, in the low modes and by unbalance, over what is seen of it."""
    layout, p, speed = initial.fall.model.layout, initial.fall.model.parameters, initial.fall.speed
    reach = np.max(np.abs(p.bearing_shape), axis=0)[:, None]
    effects = []
    for place in (layout.modal_x, layout.modal_y):
        rate = layout.velocity_of(place)
        effects += [p.bearing_shape @ changes[place] / 1e-6, p.bearing_shape @ changes[rate] / 3e-4]
        effects += [(reach * changes[place])[2:5] / 1e-6, (reach * changes[rate])[2:5] / 1e-3]
    answer = speed**2 / np.maximum(np.abs(p.eigenvalue - speed**2), 0.2 * speed**2)
    return effects + [(reach * answer[:, None] * part)[:5] / 1e-6 for part in unbalances]
