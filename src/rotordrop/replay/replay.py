"""The paper's route: identify step by step, then replay the drop open loop (Neisi 2020, section 3, Fig. 4).

A replay cannot follow a chaotic drop for long: after some contacts its force is that of *a* drop like the
recorded one. Its intervals come from draws over everything uncertain; the tracked twin gives narrower ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimate.agreement import Agreement
from rotordrop.estimate.assumptions import evidence_assumptions
from rotordrop.estimate.estimate import Estimate, ReplaySteps, Verdict
from rotordrop.estimate.fixed_values import Document, fixed_correlations, machine_with_fixed, read_fixed
from rotordrop.estimate.later_motion import later_motion
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.record_facts import RecordFacts
from rotordrop.evidence.air_gap import AirGap, identify_air_gap
from rotordrop.evidence.evidence import Evidence, known, read_evidence
from rotordrop.evidence.initial_state import covariance_root
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop.replay.agreement import compare_orbits, horizon
from rotordrop.replay.friction import sweep_friction
from rotordrop.replay.open_loop import FEWEST_DRAWS, Draws, draw_drops, seen_at_bearings, whole_drop
from rotordrop.replay.problem import replay_problem
from rotordrop.replay.result import (
    Impacts,
    Replayed,
    identified_machine,
    replay_bearings,
    replay_parameters,
    steps_document,
)
from rotordrop.replay.supports import (
    LONGEST_WINDOW,
    fit_supports,
    identified_values,
    refit_with_friction,
    support_correlations,
)
from rotordrop.rotor.parameters import build_drop_model

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

DURATION = 0.2
"""Length of the replay, that of Neisi 2020 [s]."""

IDENTIFIED_UNTIL = 0.06
"""Part of the drop that supports and friction are identified from at most [s]; longer than all windows."""

FOLLOWED_UNTIL = 7.5e-3
"""Draws must follow the record this long after the later of the first contacts [s]; chosen, not measured."""

FRICTION_DRAWS = 6
STAGES = {"supports": 0.06, "friction": 0.6, "replay": 0.68, "draws": 0.7}


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
    fitted as well; the friction from a number; the intervals from draws.
    """
    say = progress or (lambda text, share: None)
    document, origin = ({}, "") if method.fixed is None else read_fixed(method.fixed)
    start = machine_with_fixed(machine, document, origin) if origin else machine
    say("air gap, speed, initial state, first contact", 0.0)
    evidence = read_evidence(build_drop_model(start), record, tail, name=name)
    impacts = _taken_over(evidence, document) if origin else _first_impacts(evidence, method, say)
    gap = _gap_with_supports(evidence, impacts)
    say("replay of the whole drop", STAGES["replay"])
    replayed = _replayed(impacts, evidence, gap, _draws(impacts, evidence, method, say))
    result, draws = replayed.result, replayed.draws
    parameters = replay_parameters(start, impacts, gap)
    noise = float(np.mean(known(evidence.fall).noise))
    later = later_motion(result.bearing_names, *evidence.measured(np.inf), DURATION, noise)
    return Estimate(
        name=name,
        method=method,
        machine=machine,
        record=record,
        drop_instant=evidence.power_off,
        speed=evidence.speed.initial,
        until=DURATION,
        verdict=Verdict.OPEN_LOOP,
        bearings=replay_bearings(start, evidence, gap, parameters, replayed),
        parameters=parameters,
        agreement=_agreement(replayed, gap),
        replay=ReplaySteps(
            speed=evidence.speed,
            contacts=known(evidence.contacts),
            friction=impacts.friction,
            correlations=impacts.correlations,
            speed_time=result.time,
            speed_simulated=result.speed,
            fixed=origin,
            draws=None if draws is None else len(draws),
            rejected=None if draws is None else draws.rejected,
            identified=identified_machine(start, impacts, gap),
            document=steps_document(evidence, impacts, gap, replayed),
        ),
        later=later,
        findings=facts.findings,
        warnings=facts.warnings_with(
            *_warnings(evidence, impacts, draws), *(one.sentence() for one in later if one.larger)
        ),
        notes=_notes(evidence, gap),
        simulated_record=facts.simulated,
    )


def _taken_over(evidence: Evidence, document: Document) -> Impacts:
    """Supports and friction of an earlier estimate, with the errors stated there."""
    problem = replay_problem(evidence, until=IDENTIFIED_UNTIL)
    z, covariance = np.zeros(problem.size), np.eye(problem.size)
    for pair in fixed_correlations(document):
        if pair.first in problem.paths and pair.second in problem.paths:
            i, k = problem.paths.index(pair.first), problem.paths.index(pair.second)
            covariance[i, k] = covariance[k, i] = pair.value
    return Impacts(
        problem=problem,
        z=z,
        covariance=covariance,
        support=None,
        friction=None,
        values=identified_values(problem, z, covariance),
    )


def _first_impacts(evidence: Evidence, method: Replay, say: Progress) -> Impacts:
    """Supports by least squares on the first impacts, the sweep of the friction, then the supports again."""
    problem = replay_problem(evidence, until=IDENTIFIED_UNTIL)
    begin, end = STAGES["supports"], STAGES["friction"]
    support = fit_supports(
        problem,
        evidence.latest_first_contact,
        starts=method.starts,
        threads=method.threads,
        progress=lambda text, share: say(f"supports: {text}", begin + (end - begin) * share),
    )
    say("friction sweep", end)
    random = np.random.Generator(np.random.Philox(11))
    root = covariance_root(support.sweep_covariance)
    draws = [
        np.clip(support.best.z + root @ random.standard_normal(problem.size), *problem.bounds)
        for _ in range(FRICTION_DRAWS)
    ]
    friction = sweep_friction(
        problem, support.best.z, evidence.earliest_contact, draws=draws, threads=method.threads
    )
    longest = evidence.latest_first_contact + LONGEST_WINDOW
    problem, again = refit_with_friction(problem, support, friction.value, longest, threads=method.threads)
    return Impacts(
        problem=problem,
        z=again.best.z,
        covariance=again.covariance,
        support=support,
        friction=friction,
        values=identified_values(problem, again.best.z, again.covariance, again.best.at_bound),
        correlations=support_correlations(problem, again.covariance),
    )


def _gap_with_supports(evidence: Evidence, impacts: Impacts) -> AirGap:
    """Air gap with the sag of the identified supports; within the fit it follows the sag of every trial."""
    model = evidence.model
    rows = impacts.problem.bearing_rows(impacts.z)
    identified = replace(model, parameters=model.parameters._replace(bearing=rows))
    return identify_air_gap(known(evidence.rest), identified, known(evidence.sensing))


def _draws(impacts: Impacts, evidence: Evidence, method: Replay, say: Progress) -> Draws | None:
    if method.draws < 2:
        return None
    begin = STAGES["draws"]
    return draw_drops(
        impacts.problem,
        impacts.z,
        impacts.covariance,
        window=evidence.latest_first_contact + FOLLOWED_UNTIL if impacts.support is not None else 0.0,
        duration=DURATION,
        count=method.draws,
        threads=method.threads,
        progress=lambda text, share: say(text, begin + (1.0 - begin) * share),
    )


def _replayed(impacts: Impacts, evidence: Evidence, gap: AirGap, draws: Draws | None) -> Replayed:
    """The whole drop with the identified values, for the air gap and for its two limits."""
    problem, z = impacts.problem, impacts.z
    middle, lower, upper = (
        whole_drop(problem, z, duration=DURATION, gap_change=limit - gap.value)
        for limit in (gap.value, gap.lower, gap.upper)
    )
    time, measured = evidence.measured(DURATION)
    return Replayed(
        result=middle,
        middle=seen_at_bearings(problem, z, middle),
        lower=seen_at_bearings(problem, z, lower),
        upper=seen_at_bearings(problem, z, upper),
        time=time,
        measured=measured,
        draws=draws,
    )


def _agreement(replayed: Replayed, gap: AirGap) -> Agreement:
    """Agreement of replay and record at the times of the record."""
    flat = replayed.middle.reshape(len(replayed.middle), -1)
    columns = [np.interp(replayed.time, replayed.result.time, column) for column in flat.T]
    draws = replayed.draws
    return compare_orbits(
        replayed.time,
        replayed.measured,
        np.column_stack(columns).reshape(replayed.measured.shape),
        gap.value,
        expected_horizon=None if draws is None else horizon(draws.spread_time, draws.spread, gap.value),
    )


def _notes(evidence: Evidence, gap: AirGap) -> tuple[str, ...]:
    zero = ", ".join(f"{1e6 * z:.3g}" for z in gap.zero_sigma)
    return (
        *evidence_assumptions(evidence),
        "the settled tail cannot tell air gap from vertical sensor zero: a zero that is 1 µm off reads as 1 "
        f"µm of air gap (standard error {zero} µm); the fall height, and so the force, is hardly touched "
        "by it",
        "an open-loop replay is one drop like the recorded one: after some contacts its force is statistics "
        "only",
    )


def _warnings(evidence: Evidence, impacts: Impacts, draws: Draws | None) -> tuple[str, ...]:
    warnings = [*evidence.power_off.notes, *known(evidence.fall).notes]
    if impacts.support is not None:
        if impacts.support.ended_early:
            warnings.append(f"supports: {impacts.support.ended_early}")
        if (misfit := impacts.support.best.misfit) > 2.0:
            warnings.append(
                f"the first impacts are followed to {misfit**0.5:.2g} times the noise only; expected about "
                "1: the machine description misses something"
            )
        warnings += [
            f"{path}: {value.status}"
            for path, value in impacts.values.items()
            if ".support." in path and value.status != "determined"
        ]
    if draws is not None and len(draws) < FEWEST_DRAWS:
        warnings.append(f"{len(draws)} draws follow the record; {FEWEST_DRAWS} are needed for intervals")
    return tuple(warnings)
