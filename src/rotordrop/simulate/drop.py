"""Simulate one drop of a rotor onto its touchdown bearings (Neisi 2020, sections 2, 3.1 and 5)."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.machine import Machine
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import cos_each, magnitude, sin_each
from rotordrop.require import require
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.statics import rotor_on_race
from rotordrop.simulate import _histories as H
from rotordrop.simulate import _loop
from rotordrop.simulate import _sampled as S
from rotordrop.simulate._run import ENDED, PHASE, Run, Window, energies, follow, given_up, setup_of
from rotordrop.simulate.case import DropCase, MagnetEvent, StateStart, UnbalanceJump
from rotordrop.simulate.levitation import start_of_drop
from rotordrop.simulate.magnets import MagnetHistory, table_of_events
from rotordrop.simulate.result import (
    COMPARABLE_WINDOW,
    Certificate,
    ContactLog,
    DropResult,
    peaks_of,
    stop_of,
)


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
    require(machine, "machine", Machine, DropModel)
    require(case, "case", DropCase)
    require(certify, "certify", bool)
    model = machine if isinstance(machine, DropModel) else model_for(machine, case)
    result = _simulate(model, case)
    if certify:
        result = replace(result, certificate=_certified(model, case, result))
    return result


def model_for(machine: Machine, case: DropCase) -> DropModel:
    """Build the model of a machine that a case asks for, with magnets in the loop or without."""
    return build_drop_model(machine, case.reduction, loops=case.magnets is not None)


def _simulate(model: DropModel, case: DropCase) -> DropResult:
    start, parameters = start_of_drop(model, case)
    times, magnets = case.output_times, None
    more: dict[str, Any] = {}
    if case.magnets is not None:
        events = table_of_events(model, case.magnets)
        more["stepped"] = partial(S.integrate_sampled, events)
    if case.jump is not None:
        more["jump"] = case.jump.time, _with_jump(model, parameters, case.jump)
    setup = setup_of(model, case, parameters, case.most_steps, **more)
    run = Run.begun(setup, start, len(times) - 1)
    window = follow(setup, run, times)
    if case.magnets is not None:
        magnets = _magnets(model, case.magnets, events, window.states)
    heat = None if setup.warming is None else setup.warming.heat_of(run.rows["heat"], run.memory)
    return _result(model, case, parameters, run, window, heat=heat, magnets=magnets)


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
    angle = jump.phase + 0.5 * math.pi  # the phase counts from +y
    sine, cosine = sin_each(angle), cos_each(angle)
    row = jump.amount * model.basis.node_row(jump.node)
    return parameters._replace(
        unbalance_cos=parameters.unbalance_cos + cosine * row,
        unbalance_sin=parameters.unbalance_sin + sine * row,
    )


def _result(
    model: DropModel, case: DropCase, p: KernelParameters, run: Run, window: Window, **parts: Any
) -> DropResult:
    layout, n_b, states, histories = model.layout, model.layout.n_bearings, window.states, window.histories
    named, log = H.named(model, states, histories), window.log[: int(run.progress[_loop.LOGGED])]
    owner = _loop.bearings_logged(log, p)
    further = (
        *(stop_of(model.bearing_names[b]) for b in p.stops),
        *(one.name for one in model.machine.clearances if one.stiffness is not None),
        *(f"{model.bearing_names[b]}.face" for b in p.faces),
    )
    others = log[owner < 0]
    contacts = _contact_log(log[owner >= 0], owner[owner >= 0])
    stresses = [H.H_INNER_STRESS, H.H_OUTER_STRESS]  # they differ where balls have inertia
    return DropResult(
        time=window.times,
        **named,
        support_displacement=states[:, layout.support].reshape(-1, n_b, 2),
        friction_force=histories[..., H.H_FRICTION_FORCE],
        max_ball_load=histories[..., H.H_BALL_LOAD],
        race_stress=histories[..., stresses] if len(p.ball_table) else None,
        face_force=H.face_forces(states, p) if layout.moves_axially else None,
        line_contacts=tuple(rotor_on_race(model.machine, b) for b in model.machine.touchdown_bearings),
        state=states,
        contacts=contacts,
        lost=run.books,
        further_contacts=_contact_log(
            others, others[:, _loop.LOG_CONTACT].astype(np.int64) - len(p.contact_at)
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
        steps=int(run.progress[_loop.ACCEPTED]),
        rejected_steps=int(run.progress[_loop.REJECTED]),
        outcome=_sentence(model.machine, case, run, len(contacts)),
        finished=bool(run.status[PHASE] == ENDED),
        certificate=_energy_certificate(window, named["bearing_force"]),
        **parts,
    )


def _contact_log(log: Array, owner: NDArray[np.int64]) -> ContactLog:
    # the columns behind that of the contact are the fields behind that of the bearing
    names = [one.name for one in fields(ContactLog)][1:]
    return ContactLog(bearing=owner, **dict(zip(names, log[:, _loop.LOG_START :].T.copy(), strict=True)))


def _sentence(machine: Machine, case: DropCase, run: Run, contacts: int) -> str:
    if run.status[PHASE] == ENDED:
        taken = f"in {int(run.progress[_loop.ACCEPTED])} steps with {contacts} contacts"
        return f"The drop was simulated to {run.time:.6g} s {taken}."
    few = f"{case.most_steps} steps were not enough", "Raise most_steps, loosen the tolerance or use"
    return given_up(machine, run, *few)


def _energy_certificate(window: Window, force: Array) -> Certificate:
    chosen = np.unique(np.linspace(0, len(window.times) - 1, 200).astype(int))
    stored, balance = np.concatenate(
        [
            energies(p, window.times[there], window.states[there])
            for part, p in window.parts
            if len(there := chosen[(chosen >= part.start) & (chosen < part.stop)])
        ],
        axis=1,
    )
    return Certificate(
        energy_residual=float(np.max(np.abs(balance - balance[0]))),
        energy_scale=float(np.max(np.abs(stored - stored[0]))),
        peak_force=peaks_of(window.times, magnitude(force[..., 0], force[..., 1])),
    )


def _certified(model: DropModel, case: DropCase, result: DropResult) -> Certificate:
    tighter = _simulate(model, replace(case, tolerance=0.1 * case.tolerance))
    certificate = replace(
        result.certificate,
        peak_change_tolerance=_peak_change(result, tighter),
    )
    basis = model.basis.reduction
    # a start given as a state belongs to the modes of its own model
    if basis.modes is None or isinstance(case.start, StateStart):
        return certificate
    richer = Reduction(modes=basis.modes + 8, attachment=basis.attachment)
    finer = _simulate(model_for(model.machine, replace(case, reduction=richer)), case)
    return replace(
        certificate,
        peak_change_truncation=_peak_change(result, finer),
    )


def _peak_change(one: DropResult, other: DropResult) -> Array:
    first = peaks_of(one.time, one.bearing_force_magnitude, COMPARABLE_WINDOW)
    second = peaks_of(other.time, other.bearing_force_magnitude, COMPARABLE_WINDOW)
    return np.abs(first - second) / np.maximum(second, 1e-9)
