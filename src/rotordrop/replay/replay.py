"""The paper's route: identify step by step, then replay the drop open loop (Neisi 2020, section 3, Fig. 4).

A replay cannot follow a chaotic drop for long: after some contacts its force is that of *a* drop like the
recorded one. What it can say is said with draws over everything uncertain; the tracked twin says more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Step
from rotordrop.estimate.agreement import Agreement, compare_orbits, spread_horizon
from rotordrop.estimate.assumptions import evidence_assumptions
from rotordrop.estimate.estimate import Estimate, ReplaySteps, Verdict
from rotordrop.estimate.fixed_values import machine_with_fixed, read_fixed
from rotordrop.estimate.later_motion import later_motion
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.published import Drop
from rotordrop.estimate.record_facts import RecordFacts
from rotordrop.evidence.evidence import Evidence, known, read_evidence
from rotordrop.evidence.initial_state import InitialState
from rotordrop.evidence.rest import AirGap, identify_air_gap
from rotordrop.identification.friction import FrictionSweep, sweep_friction
from rotordrop.identification.replica import build_replica
from rotordrop.identification.support import (
    LONGEST_WINDOW,
    ImpactFit,
    SupportFit,
    fit_support,
    identified_values,
    impact_problem,
    refit_with_friction,
)
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop.replay.replay_estimate import Replayed, replay_bearings, replay_parameters, steps_document
from rotordrop.replay.uncertainty import (
    FEWEST_DRAWS,
    Draws,
    best_candidate,
    draw_drops,
    seen_at_bearings,
    whole_drop,
)
from rotordrop.rotor.parameters import build_drop_model

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

DURATION = 0.2
IDENTIFIED_UNTIL = 0.06
"""Part of the drop that supports and friction are identified from at most [s]."""

KEPT_UNTIL = 7.5e-3
"""Draws must keep to the record this long after the later of the first contacts [s]."""

FRICTION_DRAWS = 6
STAGES = {"supports": 0.06, "friction": 0.6, "replay": 0.68, "draws": 0.7}


@dataclass(frozen=True, kw_only=True)
class Impacts:
    """What the first impacts say: best unknowns with covariance, and the steps behind them."""

    problem: ImpactFit
    """The drop with its unknowns."""
    x: Array
    covariance: Array
    """Best unknowns and their covariance."""
    support: SupportFit | None
    """Fit of the supports; None when they were taken over."""
    friction: FrictionSweep | None
    """Sweep of the friction; None when it was taken over."""
    values: dict[str, Known]
    """Identified values by path."""


def replay_drop(
    machine: Machine,
    record: Record,
    tail: Record | None,
    method: Replay,
    facts: RecordFacts,
    *,
    name: str,
    progress: Progress | None = None,
) -> Estimate:
    """Estimate force and stress of a recorded drop by the paper's flowchart.

    Parameters
    ----------
    machine : Machine
        The machine, with guesses where nothing better is known.
    record : Record
        The recorded drop.
    tail : Record or None
        The settled tail; needed when the record does not reach standstill.
    method : Replay
        Options of the route.
    facts : RecordFacts
        What the record itself gives.
    name : str
        Name of the drop.
    progress : callable, optional
        Called with a text and the share done.

    Notes
    -----
    Source: Neisi 2020, Fig. 4. Differs from the paper: the initial state comes from a fit over the whole
    fall, with gravity sag and remanent lift; the supports from windows that grow, with everything uncertain
    marginalised; the friction from a number; the intervals from draws.
    """
    say = progress or (lambda text, share: None)
    fixed, origin = (None, "") if method.fixed is None else read_fixed(method.fixed)
    start = machine if fixed is None else machine_with_fixed(machine, fixed, origin)
    say("air gap, speed, initial state, first contact", 0.0)
    evidence = read_evidence(build_drop_model(start), record, tail, name=name)
    initial = known(evidence.fall)
    impacts = _first_impacts(evidence, method, say) if fixed is None else _taken_over(evidence, fixed)
    gap = _steady_gap(evidence, impacts)
    say("replay of the whole drop", STAGES["replay"])
    replayed = _replay(impacts, evidence, gap, _draws(impacts, evidence, method, say))
    found = replay_parameters(start, impacts.values, gap, impacts.friction)
    later = later_motion(
        replayed.result.bearing_names, *evidence.measured(np.inf), DURATION, float(np.mean(initial.noise))
    )
    return Estimate(
        name=name,
        method=method,
        machine=machine,
        record=record,
        drop_instant=evidence.power_off,
        speed=evidence.speed.initial,
        until=DURATION,
        verdict=Verdict.OPEN_LOOP,
        bearings=replay_bearings(start, evidence, gap, found, replayed),
        parameters=found,
        agreement=_agreement(replayed, gap),
        replay=_steps(start, evidence, impacts, gap, replayed, origin),
        later=later,
        findings=facts.findings,
        warnings=facts.warnings_with(
            *_warnings(evidence, initial, impacts, replayed.draws),
            *(one.sentence() for one in later if one.larger),
        ),
        notes=_notes(evidence, gap),
        simulated_record=facts.simulated,
    )


def _steps(
    machine: Machine, evidence: Evidence, impacts: Impacts, gap: AirGap, replayed: Replayed, origin: str
) -> ReplaySteps:
    result, draws = replayed.result, replayed.draws
    return ReplaySteps(
        speed=evidence.speed,
        contacts=known(evidence.contacts),
        friction=impacts.friction,
        correlations=() if impacts.support is None else impacts.support.correlations,
        speed_time=result.time,
        speed_simulated=result.speed,
        fixed=origin,
        draws=None if draws is None else len(draws),
        rejected=None if draws is None else draws.rejected,
        identified=_identified_machine(machine, impacts, gap),
        document=steps_document(
            evidence,
            gap,
            impacts.support,
            impacts.friction,
            draws,
            result.bearing_names,
            float(result.speed[-1]),
        ),
    )


def _taken_over(evidence: Evidence, fixed: Drop) -> Impacts:
    """Supports and friction of an earlier estimate, with their own uncertainty."""
    problem = impact_problem(build_replica(evidence, evidence.model, until=IDENTIFIED_UNTIL))
    covariance = np.diag(problem.prior_sigma**2)
    paths = problem.vector.paths
    for pair in fixed.correlations:
        if pair.first in paths and pair.second in paths:
            i, k = paths.index(pair.first), paths.index(pair.second)
            covariance[i, k] = covariance[k, i] = pair.value * problem.prior_sigma[i] * problem.prior_sigma[k]
    return Impacts(
        problem=problem,
        x=problem.prior_mean,
        covariance=covariance,
        support=None,
        friction=None,
        values=identified_values(problem, problem.prior_mean, covariance, given=True),
    )


def _first_impacts(evidence: Evidence, method: Replay, say: Progress) -> Impacts:
    """Supports by least squares on the first impacts, then the sweep of the friction."""
    quick = build_drop_model(evidence.model.machine, "quick")
    coarse, fine = (
        impact_problem(build_replica(evidence, model, until=IDENTIFIED_UNTIL))
        for model in (quick, evidence.model)
    )
    begin, end = STAGES["supports"], STAGES["friction"]
    support = fit_support(
        coarse,
        fine,
        evidence.latest_first_contact,
        starts=method.starts,
        threads=method.threads,
        progress=lambda text, share: say(f"supports: {text}", begin + (end - begin) * share),
    )
    say("friction sweep", end)
    best = support.search.best
    root = np.linalg.cholesky(support.covariance)
    random = np.random.Generator(np.random.Philox(11))
    points = [
        np.clip(best.x + root @ random.standard_normal(len(best.x)), *fine.bounds)
        for _ in range(FRICTION_DRAWS)
    ]
    friction = sweep_friction(fine, best.x, evidence.earliest_contact, draws=points, threads=method.threads)
    longest = evidence.latest_first_contact + LONGEST_WINDOW
    problem, x, covariance = refit_with_friction(
        fine, best, friction.value, longest=longest, threads=method.threads
    )
    return Impacts(
        problem=problem,
        x=x,
        covariance=covariance,
        support=support,
        friction=friction,
        values=identified_values(problem, x, covariance, active=best.active),
    )


def _steady_gap(evidence: Evidence, impacts: Impacts) -> AirGap:
    """Air gap with the sag of the identified supports.

    Within the fit the gap follows the sag of every trial, so that it has come to rest with the supports.
    """
    model, problem = evidence.model, impacts.problem
    rows = problem.replica.bearing_rows(problem.vector, impacts.x[: len(problem.vector)])
    settled = replace(model, parameters=model.parameters._replace(bearing=rows))
    return identify_air_gap(known(evidence.rest), settled, known(evidence.sensing))


def _replay(impacts: Impacts, evidence: Evidence, gap: AirGap, draws: Draws | None) -> Replayed:
    """The whole drop with the identified values, for the air gap and for its two limits."""
    problem = impacts.problem
    central = best_candidate(problem, impacts.x)
    simulated = whole_drop(problem, central, duration=DURATION)
    lower, upper = (
        whole_drop(problem, central, duration=DURATION, gap_change=limit - gap.value)
        for limit in (gap.lower, gap.upper)
    )
    time, measured = evidence.measured(DURATION)
    return Replayed(
        result=simulated,
        middle=seen_at_bearings(problem, central, simulated),
        lower=seen_at_bearings(problem, central, lower),
        upper=seen_at_bearings(problem, central, upper),
        time=time,
        measured=measured,
        draws=draws,
    )


def _draws(impacts: Impacts, evidence: Evidence, method: Replay, say: Progress) -> Draws | None:
    if method.draws < 2:
        return None
    begin = STAGES["draws"]
    return draw_drops(
        impacts.problem,
        impacts.x,
        impacts.covariance,
        window=evidence.latest_first_contact + KEPT_UNTIL if impacts.support is not None else 0.0,
        duration=DURATION,
        count=method.draws,
        threads=method.threads,
        progress=lambda text, share: say(text, begin + (1.0 - begin) * share),
    )


def _agreement(replayed: Replayed, gap: AirGap) -> Agreement:
    simulated = np.empty_like(replayed.measured)
    for b in range(simulated.shape[1]):
        for axis in range(2):
            simulated[:, b, axis] = np.interp(
                replayed.time, replayed.result.time, replayed.middle[:, b, axis]
            )
    draws = replayed.draws
    expected = None if draws is None else spread_horizon(draws.spread_time, draws.spread, gap.value)
    return compare_orbits(replayed.time, replayed.measured, simulated, gap.value, expected_horizon=expected)


def _identified_machine(machine: Machine, impacts: Impacts, gap: AirGap) -> Machine:
    """The machine with air gaps, supports, friction and contact as identified."""
    values: dict[str, Known] = {}
    vector = impacts.problem.vector
    for unknown in vector.unknowns:
        if unknown.parameter.estimated_by is not None or unknown.parameter.step is Step.SWEEP:
            continue
        value = impacts.values[unknown.path]
        values[unknown.path] = Known(value=value.value, status="estimated", interval_90=value.interval_90)
    for b, bearing in enumerate(machine.touchdown_bearings):
        values[f"{bearing.name}.air_gap"] = Known(
            value=float(gap.value[b]), status="estimated", standard_error=float(gap.standard_error[b])
        )
        if impacts.friction is not None:
            dynamic = impacts.friction.value
            values[f"{bearing.name}.friction.dynamic"] = Known(
                value=dynamic.value, status="estimated", interval_90=dynamic.interval_90
            )
            values[f"{bearing.name}.friction.static"] = Known(value=bearing.friction.ratio * dynamic.value)
    return machine.with_values(values)


def _notes(evidence: Evidence, gap: AirGap) -> tuple[str, ...]:
    zero = ", ".join(f"{1e6 * z:.3g}" for z in gap.zero_sigma)
    return (
        *evidence_assumptions(evidence),
        "the settled tail cannot tell air gap from vertical sensor zero: a zero that is 1 µm off reads as 1 "
        "µm of "
        f"air gap (standard error {zero} µm); the fall height, and so the force, is hardly touched by it",
        "an open-loop replay is one drop like the recorded one: after some contacts its force is statistics "
        "only",
    )


def _warnings(
    evidence: Evidence, initial: InitialState, impacts: Impacts, draws: Draws | None
) -> tuple[str, ...]:
    said = [*evidence.power_off.notes, *initial.notes]
    if impacts.support is not None:
        search = impacts.support.search
        if search.ended_early:
            said.append(f"supports: {search.ended_early}")
        if search.best.misfit > 2.0:
            said.append(
                f"the first impacts are followed to {search.best.misfit**0.5:.2g} times the noise only; "
                "expected about 1: the machine description misses something"
            )
        said += [
            f"{path}: {value.status}"
            for path, value in impacts.values.items()
            if ".support." in path and value.status != "determined"
        ]
    if draws is not None and len(draws) < FEWEST_DRAWS:
        said.append(f"{len(draws)} draws keep to the record; {FEWEST_DRAWS} are needed for intervals")
    return tuple(said)
