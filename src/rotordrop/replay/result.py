"""The estimate of a replay: identified values, loads with the intervals of the draws, published steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.parameter import Step
from rotordrop.elements.table import parameter, rows
from rotordrop.estimate.agreement import FrictionSweep
from rotordrop.estimate.allowances import MODEL_FORCE_SIGMA, MODEL_MEAN_FORCE_SIGMA, MODEL_STRESS_SIGMA
from rotordrop.estimate.bearing_drop import (
    AirGap,
    BearingDrop,
    Motion,
    Origin,
    Peak,
    deepest,
    simulated_bearings,
)
from rotordrop.estimate.bearing_values import equivalent_stiffness, published_values, static_friction
from rotordrop.estimate.estimate import FittedParameter
from rotordrop.evidence.air_gap import AirGap as IdentifiedGap
from rotordrop.evidence.evidence import Evidence, known
from rotordrop.known import NINETY, Correlation, Known, Status
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.replay.open_loop import FEWEST_DRAWS, Draws, interval
from rotordrop.replay.problem import ReplayProblem
from rotordrop.replay.start import expand_initial_state
from rotordrop.replay.supports import SupportFit
from rotordrop.simulate.result import DropResult

Array = NDArray[np.float64]
NO_INTERVAL: Status = "the record does not determine it"


@dataclass(frozen=True, kw_only=True)
class Impacts:
    """Best unknowns by the first impacts with their covariance, and the steps behind them."""

    problem: ReplayProblem
    z: Array
    """Whitened unknowns, shape (P + u,)."""
    covariance: Array
    """Shape (P + u, P + u)."""
    support: SupportFit | None
    """Fit of the supports over the growing windows; None when they were taken over."""
    friction: FrictionSweep | None
    """Sweep of the friction; None when it was taken over."""
    values: dict[str, Known]
    """Identified values by path."""
    correlations: tuple[Correlation, ...] = ()
    """Correlations of support values."""


@dataclass(frozen=True, kw_only=True)
class Replayed:
    """The whole drop replayed with the identified values, and the record; N samples, B bearings."""

    result: DropResult
    """Simulation from power-off."""
    middle: Array
    """Rotor at the bearings as the sensors would show it, shape (T, B, 2) [m]."""
    lower: Array
    """The same for the lower limit of the air gap."""
    upper: Array
    """The same for the upper limit of the air gap."""
    time: Array
    """Samples of the record in the simulated window, shape (N,) [s from power-off]."""
    measured: Array
    """Measured displacement at the bearings, along the straight rotor, from rest, shape (N, B, 2) [m]."""
    draws: Draws | None


def replay_bearings(
    machine: Machine,
    evidence: Evidence,
    gap: IdentifiedGap,
    parameters: tuple[FittedParameter, ...],
    replayed: Replayed,
) -> tuple[BearingDrop, ...]:
    """Everything about every bearing: histories of the replay, loads with intervals, identified values."""
    return tuple(
        _bearing(machine.touchdown_bearings[b], evidence, gap, parameters, replayed, simulated, b)
        for b, simulated in enumerate(simulated_bearings(replayed.result))
    )


def _bearing(
    bearing: TouchdownBearing,
    evidence: Evidence,
    gap: IdentifiedGap,
    parameters: tuple[FittedParameter, ...],
    replayed: Replayed,
    simulated: BearingDrop,
    b: int,
) -> BearingDrop:
    measured = Motion(
        label="measured", time=replayed.time, displacement=replayed.measured[:, b], role="measured"
    )

    def shown(label: str, displacement: Array, role: Any = "simulated") -> Motion:
        return Motion(label=label, time=replayed.result.time, displacement=displacement[:, b], role=role)

    contact, draws = known(evidence.contacts)[b], _enough(replayed.draws)
    seen = deepest(measured, contact.start, contact.end, 0.0)
    values = published_values(bearing.name, parameters)
    values["friction.static"] = static_friction(
        float(bearing.friction.static) / float(bearing.friction.dynamic), values["friction.dynamic"]
    )
    values["equivalent_stiffness_N_per_m"] = equivalent_stiffness(
        evidence.model.machine,
        b,
        float(evidence.model.load_shares[b]),
        values["support.stiffness_N_per_m"],
        values.get("preload_N"),
    )
    inferred = numbers_of(bearing).stress_sigma
    means = {
        name: mean_of_draws(
            simulated.values[name],
            None if draws is None else sample(draws)[:, b],
            math.hypot(model, inferred) if name == "mean_stress_Pa" else model,
        )
        for name, sample, model in MEANS
        if name in simulated.values
    }
    reason = (
        f"no interval: {0 if replayed.draws is None else len(replayed.draws)} draws, at least {FEWEST_DRAWS} "
        "are needed"
    )
    loads = ("peak_force_N", "peak_stress_Pa", *means)
    return replace(
        simulated,
        motions=(measured, shown("simulated", replayed.middle)),
        at_gap_limits=(
            measured,
            shown("simulated, lower gap", replayed.lower, "simulated, lower gap"),
            shown("simulated, upper gap", replayed.upper),
        ),
        air_gap=AirGap(lower=float(gap.lower[b]), upper=float(gap.upper[b])),
        peak_force=_peak(
            simulated.peak_force, None if draws is None else draws.peak_force[:, b], MODEL_FORCE_SIGMA
        ),
        peak_stress=_peak(
            simulated.peak_stress,
            None if draws is None else draws.peak_stress[:, b],
            math.hypot(MODEL_STRESS_SIGMA, inferred),
        ),
        values={**values, **means},
        missing={} if draws is not None else dict.fromkeys(loads, reason),
        first_contact=replace(seen, indentation=contact.indentation),
    )


MEANS: tuple[tuple[str, Callable[[Draws], Array], float], ...] = (
    ("mean_stress_Pa", lambda draws: draws.mean_stress, MODEL_STRESS_SIGMA),
    ("mean_force_0p15_0p2_N", lambda draws: draws.mean_force, MODEL_MEAN_FORCE_SIGMA),
)


def _enough(draws: Draws | None) -> Draws | None:
    return draws if draws is not None and len(draws) >= FEWEST_DRAWS else None


def _peak(peak: Peak, sample: Array | None, model: float) -> Peak:
    """The peak of the replay; the interval of the draws holds it too."""
    return replace(peak, known=with_draws(peak.known, sample, model), origin=Origin.REPLAY)


def mean_of_draws(value: Known, sample: Array | None, model: float) -> Known:
    """A mean over chaotic motion: the middle of the draws, of which the replay is only one."""
    if sample is None:
        return replace(value, status=NO_INTERVAL)
    return with_draws(replace(value, value=float(np.median(sample))), sample, model)


def with_draws(value: Known, sample: Array | None, model: float) -> Known:
    """A number with the interval of its draws, widened by what every model leaves out, and holding itself."""
    if sample is None:
        return replace(value, status=NO_INTERVAL)
    low, high = interval(sample)
    middle = float(np.median(sample))
    beside = NINETY * model * value.value
    low, high = middle - math.hypot(middle - low, beside), middle + math.hypot(high - middle, beside)
    return replace(
        value,
        standard_error=math.hypot(float(np.std(sample, ddof=1)), model * value.value),
        interval_90=(max(min(low, value.value - beside), 0.0), max(high, value.value + beside)),
    )


def replay_parameters(machine: Machine, impacts: Impacts, gap: IdentifiedGap) -> tuple[FittedParameter, ...]:
    """Every identified value of every bearing; gap and friction from steps of their own."""
    parameters = []
    for b, bearing in enumerate(machine.touchdown_bearings):
        value, error = float(gap.value[b]), float(gap.standard_error[b])
        values = {
            parameter("air_gap"): Known(
                value=value,
                status="determined",
                standard_error=error,
                interval_90=(value - NINETY * error, value + NINETY * error),
                lower=float(gap.lower[b]),
                upper=float(gap.upper[b]),
                unit="m",
            )
        }
        for row in rows("bearing"):
            if row.step is Step.IMPACTS:
                values[row] = impacts.values[row.path_of(bearing.name)]
        values[parameter("friction.dynamic")] = _friction(bearing, impacts.friction)
        parameters += [
            FittedParameter(row=row, owner=bearing.name, prior=_start(value), estimate=value)
            for row, value in values.items()
        ]
    return tuple(parameters)


def _start(value: Known) -> Known | None:
    if value.start is None:
        return None
    return Known(value=value.start, status="determined", unit=value.unit, interval_90=value.bounds)


def _friction(bearing: TouchdownBearing, sweep: FrictionSweep | None) -> Known:
    if sweep is not None:
        return sweep.value
    law = bearing.friction
    return Known(
        value=float(law.dynamic),
        status="taken over",
        standard_error=law.dynamic.standard_error,
        interval_90=law.dynamic.interval_90,
        unit="1",
    )


def identified_machine(machine: Machine, impacts: Impacts, gap: IdentifiedGap) -> Machine:
    """The machine with air gaps, supports, friction and contact as identified."""
    values: dict[str, Known] = {}
    for unknown in impacts.problem.unknowns:
        if unknown.parameter.path != "preload" and unknown.parameter.step is not Step.SWEEP:
            values[unknown.path] = _estimated(impacts.values[unknown.path])
    for b, bearing in enumerate(machine.touchdown_bearings):
        values[f"{bearing.name}.air_gap"] = Known(
            value=float(gap.value[b]), status="estimated", standard_error=float(gap.standard_error[b])
        )
        if impacts.friction is not None:
            dynamic = impacts.friction.value
            ratio = float(bearing.friction.static) / float(bearing.friction.dynamic)
            values[f"{bearing.name}.friction.dynamic"] = _estimated(dynamic)
            values[f"{bearing.name}.friction.static"] = Known(value=ratio * dynamic.value)
    return machine.with_values(values)


def _estimated(value: Known) -> Known:
    return Known(value=value.value, status="estimated", interval_90=value.interval_90)


def steps_document(
    evidence: Evidence, impacts: Impacts, gap: IdentifiedGap, replayed: Replayed
) -> dict[str, Any]:
    """Initial state, speed law, settled rest and search of a replay, ready for the published document."""
    names = replayed.result.bearing_names
    speed, end = evidence.speed, float(replayed.result.speed[-1])
    profile = speed.profile_time_constant
    slowing = speed.aero_time_constant
    return {
        "speed": {
            "aero_time_constant_s": slowing.as_json() if np.isfinite(slowing.value) else None,
            "profile_time_constant_s": profile if np.isfinite(profile) else None,
            "friction_loss_Hz": speed.friction_loss / (2.0 * np.pi),
            "simulated_end_Hz": end / (2.0 * np.pi),
        },
        "initial_state": _initial(evidence, names),
        "identification": _identification(impacts, replayed.draws),
        "settled": {
            name: {
                "radius_m": float(gap.rest.radius[b]),
                "sideways_m": float(gap.rest.sideways[b]),
                "sway_m": float(gap.rest.sway[b]),
                "indentation_m": float(gap.sag.indentation[b]),
                "race_deflection_m": float(gap.sag.race[b]),
                "support_deflection_m": float(gap.sag.support[b]),
                "vertical_zero_sigma_m": float(gap.zero_sigma[b]),
            }
            for b, name in enumerate(names)
        },
    }


def _initial(evidence: Evidence, names: tuple[str, ...]) -> dict[str, Any]:
    initial = known(evidence.fall)
    along = initial.deviation_of(evidence.record) + initial.settled
    # The paper's start for comparison: two rigid modes from the samples around power-off.
    expanded = expand_initial_state(
        evidence.record.time, along, initial.drop_instant, evidence.model, initial.sensing
    )

    def by_bearing(values: Array) -> dict[str, list[float]]:
        return {name: [float(v) for v in values[b]] for b, name in enumerate(names)}

    return {
        "displacement_m": by_bearing(initial.displacement),
        "velocity_m_per_s": by_bearing(initial.velocity),
        "remanent_force_N": initial.remanent_force.tolist(),
        "remanence_time_constant_s": initial.decay,
        "misfit": initial.misfit,
        "modal_expansion": {
            "displacement_m": by_bearing(expanded.at_bearings),
            "velocity_m_per_s": by_bearing(expanded.velocity_at_bearings),
        },
    }


def _identification(impacts: Impacts, draws: Draws | None) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    support, friction = impacts.support, impacts.friction
    if support is not None:
        entry["support"] = {
            "starts": support.starts,
            "agreeing": support.agreeing,
            "windows_s": list(support.windows),
            "misfit": support.best.misfit,
            "simulations": support.simulations,
            "ended_early": support.ended_early or None,
            "correlations": [asdict(pair) for pair in impacts.correlations],
        }
    if friction is not None:
        entry["friction_sweep"] = {
            "dynamic": friction.coefficients.tolist(),
            "disagreement_m": friction.disagreement.tolist(),
            "window_s": list(friction.window),
        }
    if draws is not None:
        entry["draws"] = {"count": len(draws), "rejected": draws.rejected}
    return entry
