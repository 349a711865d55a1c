"""The true drop of a hidden machine, with whatever structures it has."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import SimulationError
from rotordrop.physics.columns import KernelParameters
from rotordrop.rotor.machine_summary import rotor_on_race
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate import _histories
from rotordrop.simulate._loop import FINISHED
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.certificate import Certificate, peaks_of, refined_peak
from rotordrop.simulate.drop import FIRST_STEP, error_scale, simulate_drop, tableau_of
from rotordrop.simulate.levitation import start_of_drop
from rotordrop.simulate.result import ContactLog, DropResult
from rotordrop_bench import _hidden_rhs as H
from rotordrop_bench._hidden_loop import integrate_hidden
from rotordrop_bench.violations import UnbalanceJump

Array = NDArray[np.float64]

TYPICAL = np.array([*[1e-4] * 2, *[0.1] * 2, *[1e-4] * 2, *[0.1] * 2, 1.0, 1.0, 10.0, np.inf])
"""Typical size of each state of the structure of a bearing, in its unit; the cage follows its race."""


def simulate_hidden(
    model: DropModel, rows: Array, case: DropCase, jump: UnbalanceJump | None = None
) -> DropResult:
    """Simulate the drop of a machine with structures.

    Parameters
    ----------
    model : DropModel
        The true machine as far as a model of a drop has it.
    rows : ndarray, shape (B, C)
        Structures of its bearings.
    case : DropCase
        Speed [rad/s], start, duration [s], accuracy.
    jump : UnbalanceJump, optional
        An unbalance that comes during the drop.
    """
    change = math.inf
    if jump is not None:
        change = _first_contact(model, rows, case) if jump.time is None else float(jump.time)
    before, times, states, counters = _integrated(model, rows, case, jump, change)
    return _result(model, rows, case, before, times, states, counters)


def _first_contact(model: DropModel, rows: Array, case: DropCase) -> float:
    """When the rotor first touches a bearing [s]; never, where it does not."""
    before, times, states, _ = _integrated(model, rows, case, None, math.inf)
    delta = _histories_of(rows, before, times, states)[..., H.H_DELTA]
    touching = np.flatnonzero(np.any(delta > 0.0, axis=1))
    return float(times[touching[0]]) if len(touching) else math.inf


def _integrated(
    model: DropModel, rows: Array, case: DropCase, jump: UnbalanceJump | None, change: float
) -> tuple[KernelParameters, Array, Array, Array]:
    start, before = start_of_drop(model, case)
    after = before if jump is None else _with_jump(model, before, jump)
    own = len(rows) * H.N_STATES
    times = case.output_times
    states = np.empty((len(times), len(start) + own))
    counters = np.zeros(3)
    controlled = error_scale(model)
    unwatched = np.full(len(start) - len(controlled), np.inf)
    outcome = integrate_hidden(
        np.concatenate([start, np.zeros(own)]),
        times,
        before,
        after,
        change,
        rows,
        tableau_of(case),
        np.concatenate([controlled, unwatched, np.tile(TYPICAL, len(rows))]),
        case.tolerance,
        FIRST_STEP,
        case.largest_step,
        case.most_steps,
        states,
        counters,
    )
    if outcome != FINISHED:
        raise SimulationError(
            f"the drop of the hidden machine {model.machine.name!r} stopped at {counters[2]:.6g} s of "
            f"{case.duration:g} s; a violation is too extreme for it: give a milder one"
        )
    return before, times, states, counters


def _with_jump(model: DropModel, parameters: KernelParameters, jump: UnbalanceJump) -> KernelParameters:
    angle = float(jump.phase) + 0.5 * math.pi
    row = float(jump.amount) * model.basis.node_row(jump.node)
    return parameters._replace(
        unbalance_cos=parameters.unbalance_cos + math.cos(angle) * row,
        unbalance_sin=parameters.unbalance_sin + math.sin(angle) * row,
    )


def _histories_of(rows: Array, parameters: KernelParameters, times: Array, states: Array) -> Array:
    out = np.empty((len(times), len(rows), H.N_HISTORIES))
    H.hidden_histories(times, states, parameters, rows, out)
    return out


def _result(
    model: DropModel,
    rows: Array,
    case: DropCase,
    parameters: KernelParameters,
    times: Array,
    states: Array,
    counters: Array,
) -> DropResult:
    layout, n_b = model.layout, len(rows)
    histories = _histories_of(rows, parameters, times, states)
    force = histories[..., H.H_FORCE_X : H.H_FORCE_Y + 1]
    contacts = _contact_log(times, histories)
    plain = states[:, : layout.size]
    return DropResult(
        time=times,
        displacement=_histories.node_displacements(plain, parameters.bearing_shape),
        race_displacement=states[:, layout.race].reshape(-1, n_b, 2),
        support_displacement=states[:, layout.support].reshape(-1, n_b, 2),
        indentation=histories[..., H.H_DELTA],
        contact_force=histories[..., H.H_CONTACT],
        friction_force=histories[..., H.H_FRICTION],
        bearing_force=force,
        max_ball_load=histories[..., H.H_LOAD],
        max_stress=histories[..., H.H_STRESS],
        line_contacts=tuple(rotor_on_race(model.machine, b) for b in model.machine.touchdown_bearings),
        speed=states[:, layout.rotor_speed],
        race_speed=states[:, layout.race_spin],
        state=plain,
        contacts=contacts,
        bearing_names=model.bearing_names,
        state_names=layout.names(model.bearing_names),
        shapes=model.basis.shapes,
        machine_name=model.machine.name,
        initial_speed=case.speed,
        tolerance=case.tolerance,
        reduction=model.basis.description,
        steps=int(counters[0]),
        rejected_steps=int(counters[1]),
        outcome=f"The drop of the hidden machine was simulated to {counters[2]:.6g} s in {int(counters[0])} "
        f"steps with {len(contacts)} contacts.",
        finished=True,
        certificate=Certificate(
            energy_residual=math.nan,
            energy_scale=math.nan,
            peak_force=peaks_of(times, np.linalg.norm(force, axis=-1)),
        ),
    )


def _contact_log(times: Array, histories: Array) -> ContactLog:
    """Contacts from the output grid: ends by straight lines between its times, peaks by parabolas."""
    found: list[tuple[float, ...]] = []
    for b in range(histories.shape[1]):
        delta, force = histories[:, b, H.H_DELTA], histories[:, b, H.H_CONTACT]
        touches = np.concatenate([[False], delta > 0.0, [False]])
        first, behind = np.flatnonzero(np.diff(touches.astype(int))).reshape(-1, 2).T
        for i, j in zip(first, behind, strict=True):
            peak, moment = refined_peak(times[i:j], force[i:j]) if j - i > 2 else (force[i:j].max(), times[i])
            at = i + int(np.argmax(force[i:j]))
            azimuth = math.atan2(histories[at, b, H.H_NORMAL_Y], histories[at, b, H.H_NORMAL_X])
            end = _crossing(times, delta, j - 1) if j < len(times) else math.nan
            impulse = float(np.trapezoid(force[i:j], times[i:j]))
            start = _crossing(times, delta, i - 1) if i > 0 else float(times[0])
            found.append((b, start, end, float(peak), float(moment), azimuth, impulse, math.nan))
    log = np.array(sorted(found, key=lambda row: row[1])).reshape(-1, 8).T
    return ContactLog(
        bearing=log[0].astype(np.int64),
        start=log[1],
        end=log[2],
        peak_force=log[3],
        peak_time=log[4],
        azimuth=log[5],
        impulse=log[6],
        dissipated_energy=log[7],
        sliding_energy=np.full(log.shape[1], np.nan),
    )


def _crossing(times: Array, delta: Array, i: int) -> float:
    """Time between samples i and i + 1 at which the indentation is zero [s]."""
    share = delta[i] / (delta[i] - delta[i + 1])
    return float(times[i] + share * (times[i + 1] - times[i]))


def true_drop(model: DropModel, rows: Array | None, case: DropCase, jump: UnbalanceJump | None) -> DropResult:
    """The drop by the simulation that everybody uses where no structure acts, else with its structures."""
    if rows is None and jump is None:
        return simulate_drop(model, case)
    assert rows is not None
    return simulate_hidden(model, rows, case, jump)
