"""The paper's route: identify step by step, then replay the drop open loop (Neisi 2020, section 3, Fig. 4).

A replay cannot follow a chaotic drop for long: after some contacts its force is that of *a* drop like the
recorded one. What it can say is said with draws over everything uncertain; the tracked twin says more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import Estimated, IdentifiedValue
from rotordrop.estimation.agreement import Agreement, compare_orbits, spread_horizon
from rotordrop.estimation.fixed_values import (
    Document,
    fixed_correlations,
    machine_with_fixed,
    read_fixed,
)
from rotordrop.estimation.recorded_fall import RecordedFall, measured_drop, recorded_fall
from rotordrop.estimation.replay_document import replay_document as replay_document
from rotordrop.estimation.replay_values import peak_time, replay_values
from rotordrop.estimation.replayed import ReplayDrop as ReplayDrop
from rotordrop.estimation.replayed import Replayed as Replayed
from rotordrop.estimation.uncertainty import (
    FEWEST_DRAWS,
    Candidate,
    Draws,
    best_candidate,
    draw_drops,
    seen_at_bearings,
    whole_drop,
)
from rotordrop.identification.air_gap import AirGap, identify_air_gap
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
from rotordrop.machine import Machine
from rotordrop.measurement.record import Record
from rotordrop.model.parameter import Step
from rotordrop.model.parameters import build_drop_model
from rotordrop.simulation.result import DropResult

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
    """What the first impacts say: best unknowns with covariance, and the steps behind them.

    Attributes
    ----------
    problem : ImpactFit
        The drop with its unknowns.
    x, covariance : ndarray, shapes (n,), (n, n)
        Best unknowns and their covariance.
    support : SupportFit or None
        Fit of the supports; None when they were taken over.
    friction : FrictionSweep or None
        Sweep of the friction; None when it was taken over.
    values : dict
        Identified values by path.
    """

    problem: ImpactFit
    x: Array
    covariance: Array
    support: SupportFit | None
    friction: FrictionSweep | None
    values: dict[str, IdentifiedValue]


def replay_drop(
    machine: Machine,
    record: Record,
    tail: Record | None = None,
    fixed: str | Path | Document | None = None,
    progress: Progress | None = None,
    *,
    draws: int = FEWEST_DRAWS,
    starts: int = 8,
    threads: int | None = None,
) -> ReplayDrop:
    """Estimate force and stress of a recorded drop by the paper's flowchart.

    Parameters
    ----------
    machine : Machine
        The machine, with guesses where nothing better is known.
    record : Record
        The recorded drop.
    tail : Record, optional
        The settled tail; needed when the record does not reach standstill.
    fixed : path or mapping, optional
        An earlier estimate whose supports and friction are used as they are (Neisi 2020, section 5.1).
    progress : callable, optional
        Called with a text and the share done.
    draws : int
        Draws behind the intervals of force and stress; fewer than 64 give no interval.
    starts : int
        Starts of the search for the supports.
    threads : int, optional
        Threads; all cores by default.

    Returns
    -------
    ReplayDrop
        Everything the steps found.

    Notes
    -----
    Source: Neisi 2020, Fig. 4. Differs from the paper: the initial state comes from a fit over the whole
    fall, with gravity sag and remanent lift; the supports from windows that grow, with everything uncertain
    marginalised; the friction from a number; the intervals from draws.
    """
    say = progress or (lambda text, share: None)
    document, origin = ({}, "") if fixed is None else read_fixed(fixed)
    known = machine_with_fixed(machine, document, origin) if origin else machine
    say("air gap, speed, initial state, first contact", 0.0)
    fall = recorded_fall(known, record, tail)
    impacts = _taken_over(fall, document) if origin else _first_impacts(fall, starts, threads, say)
    gap = _steady_gap(fall, impacts)
    say("replay of the whole drop", STAGES["replay"])
    simulated, middle, lower, upper = _replay(impacts, gap)
    drawn = _draws(impacts, fall, draws, threads, say)
    when, measured = measured_drop(fall, DURATION)
    return ReplayDrop(
        machine=machine,
        identified=_identified_machine(known, impacts, gap),
        record=record,
        drop_instant=fall.instant,
        gap=gap,
        speed=fall.speed,
        initial=fall.initial,
        expanded=fall.expanded,
        contacts=fall.contacts,
        support=impacts.support,
        friction=impacts.friction,
        simulated=simulated,
        middle=middle,
        lower=lower,
        upper=upper,
        measured_time=when,
        measured=measured,
        agreement=_agreement(when, measured, middle, gap, drawn),
        draws=drawn,
        values=replay_values(impacts.values, known, gap, fall.contacts, impacts.friction, simulated, drawn),
        peak_times={name: peak_time(simulated, b) for b, name in enumerate(simulated.bearing_names)},
        fixed=origin,
        warnings=_warnings(fall, gap, impacts, drawn),
    )


def _taken_over(fall: RecordedFall, document: Document) -> Impacts:
    """Supports and friction of an earlier estimate, with their own uncertainty."""
    problem = impact_problem(
        build_replica(fall.record, fall.rest, fall.initial, fall.model, until=IDENTIFIED_UNTIL)
    )
    covariance = np.diag(problem.prior_sigma**2)
    paths = problem.vector.paths
    for (first, second), correlation in fixed_correlations(document).items():
        if first in paths and second in paths:
            i, k = paths.index(first), paths.index(second)
            covariance[i, k] = covariance[k, i] = (
                correlation * problem.prior_sigma[i] * problem.prior_sigma[k]
            )
    return Impacts(
        problem=problem,
        x=problem.prior_mean,
        covariance=covariance,
        support=None,
        friction=None,
        values=identified_values(problem, problem.prior_mean, covariance, given=True),
    )


def _first_impacts(fall: RecordedFall, starts: int, threads: int | None, say: Progress) -> Impacts:
    """Supports by least squares on the first impacts, then the sweep of the friction."""
    quick = build_drop_model(fall.model.machine, "quick")
    coarse, fine = (
        impact_problem(build_replica(fall.record, fall.rest, fall.initial, model, until=IDENTIFIED_UNTIL))
        for model in (quick, fall.model)
    )
    begin, end = STAGES["supports"], STAGES["friction"]
    support = fit_support(
        coarse,
        fine,
        fall.later_contact,
        starts=starts,
        threads=threads,
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
    friction = sweep_friction(fine, best.x, fall.first_contact, draws=points, threads=threads)
    longest = fall.later_contact + LONGEST_WINDOW
    problem, x, covariance = refit_with_friction(fine, best, friction.value, longest=longest, threads=threads)
    return Impacts(
        problem=problem,
        x=x,
        covariance=covariance,
        support=support,
        friction=friction,
        values=identified_values(problem, x, covariance, active=best.active),
    )


def _steady_gap(fall: RecordedFall, impacts: Impacts) -> AirGap:
    """Air gap with the sag of the identified supports.

    Within the fit the gap follows the sag of every trial, so that it has come to rest with the supports.
    """
    model, problem = fall.model, impacts.problem
    rows = problem.replica.bearing_rows(problem.vector, impacts.x[: len(problem.vector)])
    settled = replace(model, parameters=model.parameters._replace(bearing=rows))
    return identify_air_gap(fall.rest, settled, fall.initial.sensing)


def _replay(impacts: Impacts, gap: AirGap) -> tuple[DropResult, Replayed, Replayed, Replayed]:
    """The whole drop with the identified values, for the air gap and for its two limits."""
    problem = impacts.problem
    central = best_candidate(problem, impacts.x)
    simulated = whole_drop(problem, central, duration=DURATION)
    at_limits = (
        whole_drop(problem, central, duration=DURATION, gap_change=limit - gap.value)
        for limit in (gap.lower, gap.upper)
    )
    lower, upper = (_beside_record(problem, central, result) for result in at_limits)
    return simulated, _beside_record(problem, central, simulated), lower, upper


def _beside_record(problem: ImpactFit, central: Candidate, result: DropResult) -> Replayed:
    return Replayed(
        time=result.time,
        displacement=seen_at_bearings(problem, central, result),
        force=result.bearing_force_magnitude,
        stress=result.max_stress,
    )


def _draws(
    impacts: Impacts, fall: RecordedFall, count: int, threads: int | None, say: Progress
) -> Draws | None:
    if count < 2:
        return None
    begin = STAGES["draws"]
    return draw_drops(
        impacts.problem,
        impacts.x,
        impacts.covariance,
        window=fall.later_contact + KEPT_UNTIL if impacts.support is not None else 0.0,
        duration=DURATION,
        count=count,
        threads=threads,
        progress=lambda text, share: say(text, begin + (1.0 - begin) * share),
    )


def _agreement(time: Array, measured: Array, middle: Replayed, gap: AirGap, draws: Draws | None) -> Agreement:
    simulated = np.empty_like(measured)
    for b in range(measured.shape[1]):
        for axis in range(2):
            simulated[:, b, axis] = np.interp(time, middle.time, middle.displacement[:, b, axis])
    expected = None if draws is None else spread_horizon(draws.spread_time, draws.spread, gap.value)
    return compare_orbits(time, measured, simulated, gap.value, expected_horizon=expected)


def _identified_machine(machine: Machine, impacts: Impacts, gap: AirGap) -> Machine:
    """The machine with air gaps, supports, friction and contact as identified."""
    values: dict[str, Estimated] = {}
    vector = impacts.problem.vector
    for unknown in vector.unknowns:
        if unknown.parameter.path == "preload" or unknown.parameter.step is Step.SWEEP:
            continue
        value = impacts.values[unknown.path]
        values[unknown.path] = Estimated(value=value.value, status="estimated", interval_90=value.interval_90)
    for b, bearing in enumerate(machine.touchdown_bearings):
        values[f"{bearing.name}.air_gap"] = Estimated(
            value=float(gap.value[b]), status="estimated", standard_error=float(gap.standard_error[b])
        )
        if impacts.friction is not None:
            dynamic = impacts.friction.value
            ratio = float(bearing.friction.static) / float(bearing.friction.dynamic)
            values[f"{bearing.name}.friction.dynamic"] = Estimated(
                value=dynamic.value, status="estimated", interval_90=dynamic.interval_90
            )
            values[f"{bearing.name}.friction.static"] = Estimated(value=ratio * dynamic.value)
    return machine.with_values(values)


def _warnings(fall: RecordedFall, gap: AirGap, impacts: Impacts, draws: Draws | None) -> tuple[str, ...]:
    zero = ", ".join(f"{1e6 * z:.3g}" for z in gap.zero_sigma)
    said = [
        *fall.instant.notes,
        *fall.initial.notes,
        *([fall.speed.note] if fall.speed.note else []),
        "the settled tail cannot tell air gap from vertical sensor zero: a zero that is 1 µm off reads as 1 "
        "µm of "
        f"air gap (standard error {zero} µm); the fall height, and so the force, is hardly touched by it",
    ]
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
    said.append(
        "an open-loop replay is one drop like the recorded one: after some contacts its force is statistics "
        "only"
    )
    return tuple(said)
