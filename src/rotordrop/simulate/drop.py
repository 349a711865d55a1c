"""Simulate one drop of a rotor onto its touchdown bearings (Neisi 2020, sections 2, 3.1 and 5)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.machine import Machine
from rotordrop.machine.plausibility import doubts
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import magnitude, sine_cosine
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.statics import rotor_on_race
from rotordrop.simulate import _histories as H
from rotordrop.simulate import _loop
from rotordrop.simulate import _sampled as S
from rotordrop.simulate._rhs import N_PLACES
from rotordrop.simulate._tableau import Tableau, dp5, tsit5
from rotordrop.simulate.case import DropCase, MagnetEvent, StateStart, UnbalanceJump
from rotordrop.simulate.certificate import COMPARABLE_WINDOW, Certificate, peaks_of
from rotordrop.simulate.heat import WarmDrop, warms
from rotordrop.simulate.levitation import start_of_drop
from rotordrop.simulate.magnets import MagnetHistory, table_of_events
from rotordrop.simulate.result import ContactLog, DropResult, stop_of

Parts = Sequence[tuple[slice, KernelParameters]]
"""Samples of a drop and the parameters they were integrated with, in order."""

TYPICAL = np.full(L.N_KINDS, np.inf)
"""Typical size of a state by its kind, in its unit; angle and audit follow without control."""
TYPICAL[[L.POSITION, L.VELOCITY, L.SPIN, L.INTERNAL, L.HEAT]] = 1e-4, 0.1, 10.0, 1.0, 10.0
FIRST_STEP = 1e-6
LOG_ROWS_PER_SECOND = 20_000


def simulate_drop(machine: Machine | DropModel, case: DropCase, *, certify: bool = False) -> DropResult:
    """Simulate a rotor that falls onto its touchdown bearings.

    Parameters
    ----------
    machine : Machine or DropModel
        The machine, or a model built before with `build_drop_model`.
    case : DropCase
        Speed [rad/s], start, duration [s], accuracy.
    certify : bool
        Also repeat the drop with a ten times tighter tolerance and with eight more modes per plane, and put
        the changes of the peak force into the certificate (three times the cost).

    Returns
    -------
    DropResult
        Histories, contacts, outcome and certificate.

    Raises
    ------
    SimulationError
        If start and machine do not fit.
    """
    model = machine if isinstance(machine, DropModel) else model_for(machine, case)
    result = _simulate(model, case)
    if certify:
        result = replace(result, certificate=_certified(model, case, result))
    return result


def model_for(machine: Machine, case: DropCase) -> DropModel:
    """Build the model of a machine that a case asks for, with magnets in the loop or without."""
    return build_drop_model(machine, case.reduction, loops=case.magnets is not None)


def tableau_of(case: DropCase) -> Tableau:
    """Coefficients of the pair a case asks for."""
    return tsit5() if case.integrator == "tsit5" else dp5()


def error_scale(model: DropModel) -> Array:
    """Typical size of every state, shape (n,), in its unit; infinite where the step control does not look.

    Modal amplitudes are scaled so that a mode counts by what it moves at the bearings.
    """
    layout = model.layout
    reach = np.max(np.abs(model.parameters.bearing_shape), axis=0)
    floor = 0.05 * np.max(reach)
    modal = 1.0 / np.maximum(reach, floor)
    scale = TYPICAL[layout.kinds]
    for part in (layout.modal_x, layout.modal_y):
        scale[part] *= modal
        scale[layout.velocity_of(part)] *= modal
    return scale


def _simulate(model: DropModel, case: DropCase) -> DropResult:
    start, parameters = start_of_drop(model, case)
    times = case.output_times
    states = np.empty((len(times), model.layout.size))
    log = np.zeros((100 + int(LOG_ROWS_PER_SECOND * case.duration), _loop.N_LOG_COLUMNS))
    counters, books = np.zeros(5), np.zeros((model.layout.n_bearings + 1, N_PLACES))
    stepped: Callable[..., int] = _loop.integrate
    events = np.zeros((0, S.N_EVENT_COLUMNS))
    if case.magnets is not None:
        events = table_of_events(model, case.magnets)
        stepped = partial(S.integrate_sampled, events)
    warming = WarmDrop(cold=parameters) if warms(parameters).size else None
    outcome = _loop.integrate_drop(
        start,
        times,
        parameters,
        tableau_of(case),
        error_scale(model),
        case.tolerance,
        FIRST_STEP,
        case.largest_step,
        case.most_steps,
        states,
        log,
        counters,
        books,
        None if case.jump is None else (case.jump.time, _with_jump(model, parameters, case.jump)),
        None if warming is None else warming.stretches,
        stepped,
    )
    parts = [(slice(None), parameters)] if warming is None else list(warming.of_times(times))
    result = _result(model, case, parts, times, states, log[: int(counters[3])], counters, outcome)
    magnets = None if case.magnets is None else _magnets(model, case.magnets, events, result.state)
    return replace(result, lost=books, heat=None if warming is None else warming.heat, magnets=magnets)


def _magnets(
    model: DropModel, planned: tuple[MagnetEvent, ...], events: Array, states: Array
) -> MagnetHistory:
    return MagnetHistory(
        names=tuple(amb.name for amb in model.machine.ambs),
        current=states[:, model.layout.magnets].reshape(len(states), -1, 2, 2),
        force=H.magnet_forces(states, model.parameters),
        events=tuple(map(str, planned)),
        event_time=events[:, S.EVENT_TIME].copy(),
    )


def _with_jump(model: DropModel, parameters: KernelParameters, jump: UnbalanceJump) -> KernelParameters:
    nodes = len(model.fe.node_positions)
    if not 1 <= jump.node <= nodes:
        raise SimulationError(f"the unbalance comes at node {jump.node}; give one of the nodes 1 to {nodes}")
    sine, cosine = sine_cosine(jump.phase + 0.5 * math.pi)  # the phase counts from +y
    row = jump.amount * model.basis.node_row(jump.node)
    return parameters._replace(
        unbalance_cos=parameters.unbalance_cos + cosine * row,
        unbalance_sin=parameters.unbalance_sin + sine * row,
    )


def _result(
    model: DropModel,
    case: DropCase,
    parts: Parts,
    times: Array,
    states: Array,
    log: Array,
    counters: Array,
    outcome: int,
) -> DropResult:
    parameters = parts[0][1]
    layout, n_b = model.layout, model.layout.n_bearings
    reached = int(np.sum(times <= counters[4]))
    times, states = times[:reached], states[:reached]
    histories = np.empty((reached, n_b, H.N_HISTORIES))
    for part, one in parts:
        H.bearing_histories(times[part], states[part], one, histories[part])
    displacement = H.node_displacements(states, parameters.bearing_shape)
    force = histories[..., H.H_BEARING_FORCE_X : H.H_BEARING_FORCE_Y + 1]
    owner = _loop.bearings_logged(log, parameters)
    further = (
        *(stop_of(model.bearing_names[b]) for b in parameters.stops),
        *(one.name for one in model.machine.clearances if one.stiffness is not None),
        *(f"{model.bearing_names[b]}.face" for b in parameters.faces),
    )
    others = log[owner < 0]
    contacts = _contact_log(log[owner >= 0], owner[owner >= 0])
    stresses = [H.H_INNER_STRESS, H.H_OUTER_STRESS]  # they differ where balls have inertia
    return DropResult(
        time=times,
        displacement=displacement,
        race_displacement=layout.bore(states),
        support_displacement=states[:, layout.support].reshape(reached, n_b, 2),
        indentation=histories[..., H.H_DELTA],
        contact_force=histories[..., H.H_CONTACT_FORCE],
        friction_force=histories[..., H.H_FRICTION_FORCE],
        bearing_force=force,
        max_ball_load=histories[..., H.H_BALL_LOAD],
        max_stress=histories[..., H.H_STRESS],
        race_stress=histories[..., stresses] if len(parameters.ball_table) else None,
        face_force=H.face_forces(states, parameters) if layout.moves_axially else None,
        line_contacts=tuple(rotor_on_race(model.machine, b) for b in model.machine.touchdown_bearings),
        speed=states[:, layout.rotor_speed],
        race_speed=states[:, layout.race_spin],
        state=states,
        contacts=contacts,
        further_contacts=_contact_log(
            others, others[:, _loop.LOG_CONTACT].astype(np.int64) - len(parameters.contact_at)
        )
        if further
        else None,
        further_names=further,
        bearing_names=model.bearing_names,
        state_names=layout.names(model.machine.touchdown_bearings),
        shapes=model.basis.shapes,
        machine_name=model.machine.name,
        initial_speed=case.speed,
        tolerance=case.tolerance,
        reduction=model.basis.description,
        steps=int(counters[0]),
        rejected_steps=int(counters[1]),
        outcome=_sentence(model.machine, outcome, case, counters, len(contacts)),
        finished=outcome == _loop.FINISHED,
        certificate=_energy_certificate(model, parts, times, states, force),
    )


def _contact_log(log: Array, owner: NDArray[np.int64]) -> ContactLog:
    return ContactLog(
        bearing=owner,
        start=log[:, _loop.LOG_START].copy(),
        end=log[:, _loop.LOG_END].copy(),
        peak_force=log[:, _loop.LOG_PEAK_FORCE].copy(),
        peak_time=log[:, _loop.LOG_PEAK_TIME].copy(),
        azimuth=log[:, _loop.LOG_AZIMUTH].copy(),
        impulse=log[:, _loop.LOG_IMPULSE].copy(),
        dissipated_energy=log[:, _loop.LOG_DISSIPATED].copy(),
        sliding_energy=log[:, _loop.LOG_SLIDING].copy(),
    )


def _sentence(machine: Machine, outcome: int, case: DropCase, counters: Array, contacts: int) -> str:
    reached = float(counters[4])
    if outcome == _loop.FINISHED:
        taken = f"in {int(counters[0])} steps with {contacts} contacts"
        return f"The drop was simulated to {reached:.6g} s {taken}."
    few = f"{case.most_steps} steps were not enough", "Raise most_steps, loosen the tolerance or use"
    return given_up(machine, outcome, reached, *few)


def given_up(machine: Machine, outcome: int, reached: float, too_few: str, remedy: str) -> str:
    """Why the loop gave up at the time it ``reached`` [s], and the way out; of steps as the caller says."""
    why, way_out = {
        _loop.STEP_TOO_SMALL: (
            "the step fell below 1e-14 s",
            "Check for a friction law with a tiny smoothing speed or an extreme stiffness",
        ),
        _loop.TOO_MANY_STEPS: (too_few, f"{remedy} a smaller reduction"),
    }.get(outcome, ("a value became infinite", "Check the start and the machine's parameters"))
    odd = "".join(f" {doubt.message}." for doubt in doubts(machine))
    return f"The simulation stopped at {reached:.6g} s: {why}. {way_out}.{odd}"


def _energy_certificate(
    model: DropModel, parts: Parts, times: Array, states: Array, force: Array
) -> Certificate:
    layout = model.layout
    chosen = np.unique(np.linspace(0, len(states) - 1, 200).astype(int))
    stored = np.empty(len(states))
    for part, one in parts:
        there = chosen[np.isin(chosen, np.arange(len(states))[part])]
        of_part = np.empty(len(there))
        H.stored_energies(times[there], states[there], one, True, of_part)
        stored[there] = of_part
    stored = stored[chosen]
    balance = stored + states[chosen, layout.dissipated] - states[chosen, layout.work_in]
    return Certificate(
        energy_residual=float(np.max(np.abs(balance - balance[0]))),
        energy_scale=float(np.max(np.abs(stored - stored[0]))),
        peak_force=peaks_of(times, magnitude(force[..., 0], force[..., 1])),
    )


def _certified(model: DropModel, case: DropCase, result: DropResult) -> Certificate:
    tighter = _simulate(model, replace(case, tolerance=0.1 * case.tolerance))
    certificate = replace(
        result.certificate,
        peak_change_tolerance=_peak_change(result, tighter, COMPARABLE_WINDOW),
        peak_change_tolerance_whole=_peak_change(result, tighter, np.inf),
    )
    basis = model.basis.reduction
    # a start given as a state belongs to the modes of its own model
    if basis.modes is None or isinstance(case.start, StateStart):
        return certificate
    richer = Reduction(modes=basis.modes + 8, attachment=basis.attachment)
    finer = _simulate(model_for(model.machine, replace(case, reduction=richer)), case)
    return replace(
        certificate,
        peak_change_truncation=_peak_change(result, finer, COMPARABLE_WINDOW),
        peak_change_truncation_whole=_peak_change(result, finer, np.inf),
    )


def _peak_change(one: DropResult, other: DropResult, until: float) -> Array:
    first = peaks_of(one.time, one.bearing_force_magnitude, until)
    second = peaks_of(other.time, other.bearing_force_magnitude, until)
    return np.abs(first - second) / np.maximum(second, 1e-9)
