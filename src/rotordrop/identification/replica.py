"""The recorded drop run again with other parameters, from just before the first contact."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError
from rotordrop.evidence.evidence import Evidence, known
from rotordrop.evidence.initial_state import (
    MAGNET_FORCES,
    FreeFall,
    InitialState,
    build_free_fall,
    kernel_state,
)
from rotordrop.evidence.sensing import Sensing, build_sensing
from rotordrop.identification.parameter_vector import ParameterVector, with_bearing
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.rotor.parameters import DropModel, sag_of_model, static_sag
from rotordrop.simulate import _loop
from rotordrop.simulate._tableau import tsit5
from rotordrop.simulate.drop import FIRST_STEP, error_scale

Array = NDArray[np.float64]

TOLERANCE = 1e-7
LARGEST_STEP = 1e-3
MOST_STEPS = 400_000
LOG_ROWS = 400
LEAD = 1e-4
"""Time before the end of the free fall at which the simulation starts [s]: the fall is linear and known in
closed form, so only what follows it has to be integrated again and again."""


@dataclass(frozen=True, kw_only=True)
class Replica:
    """A recorded drop that can be simulated again and again; T samples, S sensors, B bearings."""

    model: DropModel
    """The model, with unbalance, remanent force and speed of this drop."""
    sensing: Sensing
    """What the sensors see of it."""
    initial: InitialState
    """Initial state of the drop, of the model's own reduction."""
    radius: Array
    """Settled radius [m]: air gap and static sag together, as the tail gives them, shape (B,)."""
    race_sag: Array
    """Part of the static sag that race and balls take [m], shape (B,)."""
    start: float
    """Time from power-off at which the simulation starts [s]."""
    state: Array
    """State there, shape (n,)."""
    time: Array
    """Samples after that [s from power-off], shape (T,)."""
    deviation: Array
    """Measured displacements along the sensors, from the rest position [m], shape (T, S)."""
    noise: Array
    """Noise of these [m], shape (S,)."""
    scale: Array

    def bearing_rows(self, vector: ParameterVector, theta: Array, rest_error: Array | None = None) -> Array:
        """Bearing parameters for values of the unknowns; the air gap follows from settled radius and sag.

        Parameters
        ----------
        vector, theta
            Unknown parameters and their values.
        rest_error : ndarray, shape (B, 2), optional
            Error of the rest position (x, y) [m]: a vertical sensor zero that looks like a gap.
        """
        rows = self.model.parameters.bearing.copy()
        vector.set(theta, rows)
        loads = np.asarray(self.model.load_shares)
        down = 0.0 if rest_error is None else rest_error[:, 1]
        rows[:, L.AIR_GAP] = self.radius - down - static_sag(rows, self.race_sag, loads).total
        return rows

    def states(
        self, rows: Array, time: Array, state: Array | None = None, unbalance: Array | None = None
    ) -> tuple[Array, Array]:
        """States at times after the start, shape (T, n), and the contact log.

        Parameters
        ----------
        rows : ndarray, shape (B, columns)
            Bearing parameters.
        time : ndarray, shape (T,)
            Times [s from power-off].
        state : ndarray, shape (n,), optional
            State at the start; the replica's own by default.
        unbalance : ndarray, shape (2, m), optional
            Modal unbalance, cosine and sine; the replica's own by default.

        Raises
        ------
        IdentificationError
            If the simulation does not get through, for instance with a value out of all proportion.
        """
        times = np.concatenate([[self.start], time])
        out = np.empty((len(times), len(self.state)))
        log = np.zeros((LOG_ROWS, _loop.N_LOG_COLUMNS))
        counters = np.zeros(5)
        parameters = with_bearing(self.model.parameters, rows)
        if unbalance is not None:
            parameters = parameters._replace(unbalance_cos=unbalance[0], unbalance_sin=unbalance[1])
        outcome = _loop.integrate_drop(
            self.state if state is None else state,
            times,
            parameters,
            tsit5(),
            self.scale,
            TOLERANCE,
            FIRST_STEP,
            LARGEST_STEP,
            MOST_STEPS,
            out,
            log,
            counters,
        )
        if outcome != _loop.FINISHED:
            raise IdentificationError(
                f"a drop simulated for the fit stopped at {1e3 * counters[4]:.3g} ms (outcome {outcome}); "
                f"expected {1e3 * times[-1]:.3g} ms. Check the machine's guesses for support and contact."
            )
        return out[1:], log[: min(int(counters[3]), LOG_ROWS)]

    def along(self, states: Array) -> Array:
        """Displacement along the sensors [m], shape (T, S), of states (T, n)."""
        return np.asarray(states[:, : self.sensing.rows.shape[1]] @ self.sensing.rows.T)

    def predicted(self, states: Array, unknowns: Array | None = None) -> Array:
        """Deviation from rest that the sensors would read [m], shape (T, S)."""
        u = self.initial.unknowns
        values = self.initial.mean if unknowns is None else unknowns
        settled = (
            self.initial.settled + self.sensing.from_bearings.reshape(len(self.noise), -1) @ values[u.rest]
        )
        return np.asarray((1.0 + values[u.gain]) * (self.along(states) - settled))

    def until(self, time: float) -> int:
        """Number of samples up to a time from power-off [s]."""
        return int(np.searchsorted(self.time, time + 1e-9))

    def start_state(self, unknowns: Array) -> tuple[Array, Array]:
        """State (n,) at the start and modal unbalance (2, m) for other values of the unknowns of the fall."""
        fall = self.initial.fall
        state, _, unbalance = kernel_state(
            fall, self.initial.state_at(self.start, unknowns), fall.speed * self.start
        )
        return state, unbalance


def build_replica(evidence: Evidence, model: DropModel, *, until: float) -> Replica:
    """Make a recorded drop ready to be run again and again.

    Parameters
    ----------
    evidence : Evidence
        The record, its initial state and its rest.
    model : DropModel
        The model to run; may be of a coarser reduction than that of the initial state.
    until : float
        Last time that will be compared [s from power-off].
    """
    initial, radius = known(evidence.fall), known(evidence.rest).radius
    own = initial if model.basis is initial.fall.model.basis else transferred(initial, model)
    start = max(initial.end - LEAD, 0.0)
    fall = own.fall
    state, remanent, unbalance = kernel_state(fall, own.state_at(start), fall.speed * start)
    time = evidence.record.time - initial.drop_instant
    keep = (time > start + 1e-9) & (time <= until)
    return Replica(
        model=replace(model, parameters=drop_parameters(model, own, remanent, unbalance)),
        sensing=own.sensing,
        initial=own,
        radius=radius,
        race_sag=sag_of_model(model).race,
        start=start,
        state=state,
        time=time[keep],
        deviation=own.deviation_of(evidence.record)[keep],
        noise=own.noise,
        scale=error_scale(model),
    )


def drop_parameters(
    model: DropModel, initial: InitialState, remanent: Array, unbalance: Array
) -> KernelParameters:
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


def transferred(initial: InitialState, model: DropModel) -> InitialState:
    """The same initial state in the coordinates of another reduction of the same rotor."""
    old: FreeFall = initial.fall
    fall = build_free_fall(model, old.speed, old.nodes)
    project = model.basis.shapes.T @ model.fe.mass @ old.model.basis.shapes
    old_m, m = old.n_modes, fall.n_modes
    turn = np.zeros((fall.size, old.size))
    for k in range(4):
        turn[k * m : (k + 1) * m, k * old_m : (k + 1) * old_m] = project
    turn[4 * m :, 4 * old_m :] = np.eye(fall.size - 4 * m)
    rest = np.eye(initial.unknowns.size - old.size)
    whole = np.block([[turn, np.zeros((fall.size, len(rest)))], [np.zeros((len(rest), old.size)), rest]])
    return replace(
        initial,
        fall=fall,
        sensing=build_sensing(model, initial.sensors),
        unknowns=replace(initial.unknowns, n_states=fall.size),
        mean=whole @ initial.mean,
        covariance=whole @ initial.covariance @ whole.T,
    )
