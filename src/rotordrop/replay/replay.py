"""The paper's route: identify step by step, then replay the drop open loop (Neisi 2020, section 3, Fig. 4).

A replay cannot follow a chaotic drop for long: after some contacts its force is that of *a* drop like the
recorded one, and has no interval. The tracked twin says more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Role, Step
from rotordrop.elements.table import rows
from rotordrop.elements.touchdown_bearing import AIR_GAP, TouchdownBearing
from rotordrop.errors import IdentificationError
from rotordrop.estimate.agreement import compare_orbits
from rotordrop.estimate.assumptions import evidence_assumptions
from rotordrop.estimate.bearing_drop import (
    AirGap,
    BearingDrop,
    Motion,
    Origin,
    deepest,
    simulated_bearings,
)
from rotordrop.estimate.bearing_drop import Role as MotionRole
from rotordrop.estimate.bearing_values import bearing_values
from rotordrop.estimate.estimate import Estimate, FittedParameter, FrictionSweep, ReplaySteps, Verdict
from rotordrop.estimate.fixed_values import machine_with_fixed, read_fixed
from rotordrop.estimate.later_motion import later_motion
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.published import Drop, Identification, InitialState, Speed, later_warning
from rotordrop.estimate.record_facts import RecordFacts
from rotordrop.evidence.evidence import Evidence, known, read_evidence
from rotordrop.evidence.rest import AirGap as IdentifiedGap
from rotordrop.evidence.rest import identify_air_gap
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.progress import Progress
from rotordrop.record.record import Record
from rotordrop.replay.first_impacts import (
    FirstImpacts,
    Trial,
    drop_parameters,
    first_impacts,
    start_state,
    with_bearing,
)
from rotordrop.replay.modal_expansion import expand_initial_state
from rotordrop.replay.support_and_friction import (
    LONGEST_WINDOW,
    SupportFit,
    fit_support,
    identified_values,
    refit_with_friction,
    sweep_friction,
)
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult

DURATION = 0.2
"""Part of the drop that is replayed [s]: that of Neisi 2020."""
IDENTIFIED_UNTIL = 0.06
"""Part of the drop that supports and friction are identified from at most [s]."""

FRICTION_DRAWS = 6
"""Supports drawn about the fit, with each of which friction is swept too (chosen)."""
MEANS = "mean_stress_Pa", "mean_force_0p15_0p2_N"
STAGES = {"supports": 0.06, "friction": 0.85, "replay": 0.95}
"""Share of the time at which each step begins [1]."""


@dataclass(frozen=True, kw_only=True)
class Identified:
    """What the first impacts say: best unknowns with covariance, and the steps behind them."""

    problem: FirstImpacts
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


@dataclass(frozen=True, kw_only=True)
class Replayed:
    """The whole drop replayed with the identified values, beside the record; N samples, B bearings."""

    result: DropResult
    """Simulation from power-off."""
    middle: Array
    lower: Array
    upper: Array
    """Rotor at the bearings as the sensors would show it [m], for the air gap and for its two limits, shape
    (T, B, 2)."""
    time: Array
    """Samples of the record in the simulated window [s from power-off], shape (N,)."""
    measured: Array
    """Measured displacement at the bearings, along the straight rotor, from the rest position [m], shape (N,
    B, 2)."""


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

    The machine has guesses where nothing better is known; the settled tail is needed when the record does not
    reach standstill.

    Notes
    -----
    Source: Neisi 2020, Fig. 4. Differs from the paper: the initial state comes from a fit over the whole
    fall, with gravity sag and remanent lift; the supports from windows that grow, with everything uncertain
    marginalised; the friction from a number.
    """
    say = progress or (lambda text, share: None)
    fixed, origin = (None, "") if method.fixed is None else read_fixed(method.fixed)
    start = machine if fixed is None else machine_with_fixed(machine, fixed, origin)
    say("air gap, speed, initial state, first contact", 0.0)
    evidence = read_evidence(build_drop_model(start), record, tail, name=name)
    impacts = _identified(evidence, method, say) if fixed is None else _taken_over(evidence, fixed)
    # Within the fit the gap follows the sag of every trial, so that it has come to rest with the supports.
    rows_found = impacts.problem.rows(impacts.problem.trial(impacts.x))
    settled = replace(evidence.model, parameters=evidence.model.parameters._replace(bearing=rows_found))
    gap = identify_air_gap(known(evidence.rest), settled, known(evidence.sensing))
    say("replay of the whole drop", STAGES["replay"])
    replayed = _replay(impacts, evidence, gap)
    found = _parameters(start, impacts, gap)
    noise = float(np.mean(known(evidence.fall).noise))
    later = later_motion(replayed.result.bearing_names, *evidence.measured(np.inf), DURATION, noise)
    return Estimate(
        name=name,
        method=method,
        machine=machine,
        record=record,
        drop_instant=evidence.power_off,
        speed=evidence.speed.initial,
        until=DURATION,
        verdict=Verdict.OPEN_LOOP,
        bearings=tuple(
            _bearing(start.touchdown_bearings[b], evidence, gap, found, replayed, simulated, b)
            for b, simulated in enumerate(simulated_bearings(replayed.result))
        ),
        parameters=found,
        agreement=compare_orbits(
            replayed.time,
            replayed.measured,
            replayed.middle,
            gap.value,
            replayed.result.bearing_names,
            at=replayed.result.time,
        ),
        replay=ReplaySteps(
            speed=evidence.speed,
            contacts=known(evidence.contacts),
            friction=impacts.friction,
            correlations=() if impacts.support is None else impacts.support.correlations,
            speed_time=replayed.result.time,
            speed_simulated=replayed.result.speed,
            fixed=origin,
            identified=_identified_machine(start, impacts, gap),
            document=_document(evidence, impacts, gap, replayed),
        ),
        later=later,
        findings=facts.findings,
        warnings=facts.warnings_with(*_warnings(evidence, impacts), later_warning(later, DURATION)),
        notes=_notes(evidence, gap),
        simulated_record=facts.simulated,
    )


def _taken_over(evidence: Evidence, fixed: Drop) -> Identified:
    """Supports and friction of an earlier estimate, with their own uncertainty."""
    problem = first_impacts(evidence, evidence.model, until=IDENTIFIED_UNTIL)
    x, sigma, paths = problem.table.mean, problem.table.sigma, problem.paths
    covariance = np.diag(sigma**2)
    for pair in fixed.correlations:
        if pair.first in paths and pair.second in paths:
            i, k = paths.index(pair.first), paths.index(pair.second)
            covariance[i, k] = covariance[k, i] = pair.value * sigma[i] * sigma[k]
    values = identified_values(problem, x, covariance, given=True)
    return Identified(problem=problem, x=x, covariance=covariance, support=None, friction=None, values=values)


def _identified(evidence: Evidence, method: Replay, say: Progress) -> Identified:
    """Supports by least squares on the first impacts, then the sweep of the friction."""
    quick = build_drop_model(evidence.model.machine, "quick")
    coarse, fine = (
        first_impacts(evidence, model, until=IDENTIFIED_UNTIL) for model in (quick, evidence.model)
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
        np.clip(best.x + root @ random.standard_normal(len(best.x)), fine.table.lower, fine.table.upper)
        for _ in range(FRICTION_DRAWS)
    ]
    friction = sweep_friction(fine, best.x, evidence.earliest_contact, draws=points, threads=method.threads)
    longest = evidence.latest_first_contact + LONGEST_WINDOW
    problem, x, covariance = refit_with_friction(
        fine, best, friction.value, longest=longest, threads=method.threads
    )
    return Identified(
        problem=problem,
        x=x,
        covariance=covariance,
        support=support,
        friction=friction,
        values=identified_values(problem, x, covariance, active=best.active),
    )


def _replay(impacts: Identified, evidence: Evidence, gap: IdentifiedGap) -> Replayed:
    """The whole drop with the identified values, for the air gap and for its two limits."""
    problem, trial = impacts.problem, impacts.problem.trial(impacts.x)
    result = whole_drop(problem, trial)
    limits = [whole_drop(problem, trial, limit - gap.value) for limit in (gap.lower, gap.upper)]
    time, measured = evidence.measured(DURATION)
    middle, lower, upper = (seen_at_bearings(problem, trial, one) for one in (result, *limits))
    return Replayed(
        result=result,
        middle=middle,
        lower=lower,
        upper=upper,
        time=time,
        measured=measured,
    )


def whole_drop(problem: FirstImpacts, trial: Trial, gap_change: Array | None = None) -> DropResult:
    """Simulate the whole drop from power-off, its air gaps (B,) changed by so much [m]."""
    initial = replace(problem.initial, mean=trial.fall)
    rows = problem.rows(trial)
    if gap_change is not None:
        rows[:, 0] += gap_change
    parameters = with_bearing(drop_parameters(problem.model, initial, 0.0), rows)
    case = DropCase(
        speed=initial.fall.speed,
        duration=DURATION,
        start=StateStart(state=start_state(initial, 0.0, trial.fall)[0]),
    )
    result = simulate_drop(replace(problem.model, parameters=parameters), case)
    if not result.finished:
        raise IdentificationError(f"a simulation with the identified values ended early. {result.outcome}")
    return result


def seen_at_bearings(problem: FirstImpacts, trial: Trial, result: DropResult) -> Array:
    """Displacement of a simulated drop as the sensors would show it at the bearings [m], shape (T, B, 2).

    With fitted gains, counted from the rest position, like the measured one.
    """
    initial = problem.initial
    return initial.sensing.at_bearings(problem.predicted(result.state, trial.fall) + initial.settled)


def _parameters(machine: Machine, impacts: Identified, gap: IdentifiedGap) -> tuple[FittedParameter, ...]:
    """Every identified value of every bearing, in the order of the steps that find them."""
    found = []
    for b, bearing in enumerate(machine.touchdown_bearings):
        value, error, friction = float(gap.value[b]), float(gap.standard_error[b]), bearing.friction.dynamic
        at_rest = Known(
            value=value,
            status="determined",
            standard_error=error,
            interval_90=(value - NINETY * error, value + NINETY * error),
            lower=float(gap.lower[b]),
            upper=float(gap.upper[b]),
            unit="m",
        )
        swept = Known(
            value=float(friction),
            status="taken over",
            standard_error=friction.standard_error,
            interval_90=friction.interval_90,
            unit="1",
        )
        if impacts.friction is not None:
            swept = impacts.friction.value
        steps = ((Step.TAIL, at_rest), (Step.IMPACTS, None), (Step.SWEEP, swept))
        for row, alone in (
            (row, alone) for step, alone in steps for row in rows("bearing") if row.step is step
        ):
            # a bearing with clearance has no preload to find, and what is derived follows from the others
            estimate = alone or impacts.values.get(row.path_of(bearing.name))
            if estimate is None or row.role is Role.DERIVED:
                continue
            prior = None
            if (start := estimate.start) is not None:
                prior = Known(
                    value=start, status="determined", unit=estimate.unit, interval_90=estimate.bounds
                )
            found.append(FittedParameter(row=row, owner=bearing.name, prior=prior, estimate=estimate))
    return tuple(found)


def _bearing(
    bearing: TouchdownBearing,
    evidence: Evidence,
    gap: IdentifiedGap,
    found: tuple[FittedParameter, ...],
    replayed: Replayed,
    simulated: BearingDrop,
    b: int,
) -> BearingDrop:
    """One bearing: histories of the replay, loads, identified values."""
    contact = known(evidence.contacts)[b]
    measured = Motion(
        label="measured", time=replayed.time, displacement=replayed.measured[:, b], role="measured"
    )

    def shown(label: str, displacement: Array, role: MotionRole = "simulated") -> Motion:
        return Motion(label=label, time=replayed.result.time, displacement=displacement[:, b], role=role)

    values = bearing_values(evidence.model.machine, b, float(evidence.model.load_shares[b]), found)
    means = {name: simulated.values[name] for name in MEANS if name in simulated.values}
    return replace(
        simulated,
        motions=(measured, shown("simulated", replayed.middle)),
        at_gap_limits=(
            measured,
            shown("simulated, lower gap", replayed.lower, "simulated, lower gap"),
            shown("simulated, upper gap", replayed.upper),
        ),
        air_gap=AirGap(lower=float(gap.lower[b]), upper=float(gap.upper[b])),
        peak_force=replace(simulated.peak_force, origin=Origin.REPLAY),
        peak_stress=replace(simulated.peak_stress, origin=Origin.REPLAY),
        values={**values, **means},
        first_contact=replace(
            deepest(measured, contact.start, contact.end, 0.0), indentation=contact.indentation
        ),
    )


def _document(
    evidence: Evidence, impacts: Identified, gap: IdentifiedGap, replayed: Replayed
) -> dict[str, Any]:
    """Initial state, speed law, settled rest and search of a replay, ready for the published document."""
    names, initial = replayed.result.bearing_names, known(evidence.fall)
    # The paper's start, beside ours: two rigid modes from the samples around power-off.
    expanded = expand_initial_state(
        evidence.record.time,
        initial.deviation_of(evidence.record) + initial.settled,
        initial.drop_instant,
        evidence.model,
        initial.sensing,
    )

    def by_bearing(values: Array) -> dict[str, list[float]]:
        return dict(zip(names, values.tolist(), strict=True))

    settled = {f"{key}_m": getattr(gap.rest, key) for key in ("radius", "sideways", "sway")} | {
        "indentation_m": gap.sag.indentation,
        "race_deflection_m": gap.sag.race,
        "support_deflection_m": gap.sag.support,
        "vertical_zero_sigma_m": gap.zero_sigma,
    }
    return {
        "speed": Speed.of_result(
            evidence.speed, simulated_end_Hz=float(replayed.result.speed[-1]) / (2.0 * np.pi)
        ),
        "initial_state": InitialState.of_result(
            initial,
            displacement_m=by_bearing(initial.displacement),
            velocity_m_per_s=by_bearing(initial.velocity),
            modal_expansion={
                "displacement_m": by_bearing(expanded.at_bearings),
                "velocity_m_per_s": by_bearing(expanded.velocity_at_bearings),
            },
        ),
        "identification": Identification.of_result(impacts),
        "settled": {
            name: {key: float(values[b]) for key, values in settled.items()} for b, name in enumerate(names)
        },
    }


def _identified_machine(machine: Machine, impacts: Identified, gap: IdentifiedGap) -> Machine:
    """The machine with air gaps, supports, friction and contact as identified."""
    values: dict[str, Known] = {
        one.path: Known(
            value=impacts.values[one.path].value,
            status="estimated",
            interval_90=impacts.values[one.path].interval_90,
        )
        for one in impacts.problem.unknowns
        if one.parameter.estimated_by is None and one.parameter.step is Step.IMPACTS
    }
    for b, bearing in enumerate(machine.touchdown_bearings):
        values[AIR_GAP.path_of(bearing.name)] = Known(
            value=float(gap.value[b]), status="estimated", standard_error=float(gap.standard_error[b])
        )
        if impacts.friction is not None:
            dynamic = impacts.friction.value
            values[f"{bearing.name}.friction.dynamic"] = Known(
                value=dynamic.value, status="estimated", interval_90=dynamic.interval_90
            )
            values[f"{bearing.name}.friction.static"] = Known(value=bearing.friction.ratio * dynamic.value)
    return machine.with_values(values)


def _warnings(evidence: Evidence, impacts: Identified) -> tuple[str, ...]:
    said = [*evidence.power_off.notes, *known(evidence.fall).notes]
    if impacts.support is not None:
        search = impacts.support.search
        if search.ended_early:
            said.append(f"supports: {search.ended_early}")
        if search.best.misfit > 2.0:
            said.append(
                f"the first impacts are followed to {search.best.misfit**0.5:.2g} times the noise only; "
                "expected about 1: the machine description misses something"
            )
        supports = [impacts.problem.paths[k] for k in impacts.problem.supports]
        status = {path: impacts.values[path].status for path in supports}
        said += [f"{path}: {found}" for path, found in status.items() if found != "determined"]
    return tuple(said)


def _notes(evidence: Evidence, gap: IdentifiedGap) -> tuple[str, ...]:
    zero = ", ".join(f"{1e6 * z:.3g}" for z in gap.zero_sigma)
    return (
        *evidence_assumptions(evidence),
        "the settled tail cannot tell air gap from vertical sensor zero: a zero that is 1 µm off reads as "
        f"1 µm of air gap (standard error {zero} µm); the fall height, and so the force, is hardly touched "
        "by it",
    )
