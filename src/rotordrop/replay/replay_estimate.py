"""From the steps of a replay to its estimate: identified values, loads with the intervals of the draws."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Step
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.elements.table import parameter, rows
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
from rotordrop.estimate.bearing_values import equivalent_stiffness, published_values
from rotordrop.estimate.estimate import FittedParameter
from rotordrop.evidence.evidence import Evidence, known
from rotordrop.evidence.rest import AirGap as IdentifiedGap
from rotordrop.identification.friction import FrictionSweep
from rotordrop.identification.modal_expansion import expand_initial_state
from rotordrop.identification.support import SupportFit
from rotordrop.known import NINETY, Known, Status
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.replay.uncertainty import FEWEST_DRAWS, Draws, interval
from rotordrop.simulate.result import DropResult

Array = NDArray[np.float64]
NO_INTERVAL: Status = "the record does not determine it"


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
    draws: Draws | None
    """Draws behind the intervals."""


def replay_bearings(
    machine: Machine,
    evidence: Evidence,
    gap: IdentifiedGap,
    found: tuple[FittedParameter, ...],
    replayed: Replayed,
) -> tuple[BearingDrop, ...]:
    """Everything about every bearing: histories of the replay, loads with intervals, identified values."""
    return tuple(
        _bearing(machine.touchdown_bearings[b], evidence, gap, found, replayed, simulated, b)
        for b, simulated in enumerate(simulated_bearings(replayed.result))
    )


def _bearing(
    bearing: TouchdownBearing,
    evidence: Evidence,
    gap: IdentifiedGap,
    found: tuple[FittedParameter, ...],
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
    values = published_values(bearing.name, found)
    values["friction.static"] = bearing.friction.static_of(values["friction.dynamic"])
    values["equivalent_stiffness_N_per_m"] = equivalent_stiffness(
        evidence.model.machine,
        b,
        float(evidence.model.load_shares[b]),
        values["support.stiffness_N_per_m"],
        values.get("preload_N"),
    )
    inferred = numbers_of(bearing).stress_sigma
    means = {
        name: _mean(
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
    """The replay's own peak; the interval of the draws holds it too."""
    return replace(peak, known=with_draws(peak.known, sample, model), origin=Origin.REPLAY)


def _mean(value: Known, sample: Array | None, model: float) -> Known:
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


def replay_parameters(
    machine: Machine,
    fitted: Mapping[str, Known],
    gap: IdentifiedGap,
    friction: FrictionSweep | None,
) -> tuple[FittedParameter, ...]:
    """Every identified value of every bearing; gap and friction from steps of their own."""
    found = []
    for b, bearing in enumerate(machine.touchdown_bearings):
        values = {parameter("air_gap"): _air_gap(gap, b)}
        values |= {
            row: fitted[row.path_of(bearing.name)] for row in rows("bearing") if row.step is Step.IMPACTS
        }
        values[parameter("friction.dynamic")] = _friction(bearing, friction)
        found += [
            FittedParameter(row=row, owner=bearing.name, prior=_start(value), estimate=value)
            for row, value in values.items()
        ]
    return tuple(found)


def _start(value: Known) -> Known | None:
    if value.start is None:
        return None
    return Known(value=value.start, status="determined", unit=value.unit, interval_90=value.bounds)


def _air_gap(gap: IdentifiedGap, b: int) -> Known:
    value, error = float(gap.value[b]), float(gap.standard_error[b])
    return Known(
        value=value,
        status="determined",
        standard_error=error,
        interval_90=(value - NINETY * error, value + NINETY * error),
        lower=float(gap.lower[b]),
        upper=float(gap.upper[b]),
        unit="m",
    )


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


def steps_document(
    evidence: Evidence,
    gap: IdentifiedGap,
    support: SupportFit | None,
    friction: FrictionSweep | None,
    draws: Draws | None,
    names: tuple[str, ...],
    end_speed: float,
) -> dict[str, Any]:
    """Initial state, speed law, settled rest and search of a replay, ready for the published document."""
    return {
        "speed": _speed(evidence, end_speed),
        "initial_state": _initial(evidence, names),
        "identification": _identification(support, friction, draws),
        "settled": {name: _settled(gap, b) for b, name in enumerate(names)},
    }


def _speed(evidence: Evidence, end_speed: float) -> dict[str, Any]:
    fit = evidence.speed
    known = np.isfinite(fit.aero_time_constant.value)
    profile = fit.profile_time_constant
    return {
        "aero_time_constant_s": fit.aero_time_constant.as_json() if known else None,
        "profile_time_constant_s": profile if np.isfinite(profile) else None,
        "friction_loss_Hz": fit.friction_loss / (2.0 * np.pi),
        "simulated_end_Hz": end_speed / (2.0 * np.pi),
    }


def _settled(gap: IdentifiedGap, b: int) -> dict[str, float]:
    return {
        "radius_m": float(gap.rest.radius[b]),
        "sideways_m": float(gap.rest.sideways[b]),
        "sway_m": float(gap.rest.sway[b]),
        "indentation_m": float(gap.sag.indentation[b]),
        "race_deflection_m": float(gap.sag.race[b]),
        "support_deflection_m": float(gap.sag.support[b]),
        "vertical_zero_sigma_m": float(gap.zero_sigma[b]),
    }


def _initial(evidence: Evidence, names: tuple[str, ...]) -> dict[str, Any]:
    initial = known(evidence.fall)
    along = initial.deviation_of(evidence.record) + initial.settled
    # The paper's start, beside ours: two rigid modes from the samples around power-off.
    expanded = expand_initial_state(
        evidence.record.time, along, initial.drop_instant, evidence.model, initial.sensing
    )

    def by_bearing(values: Any) -> dict[str, list[float]]:
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


def _identification(
    support: SupportFit | None, friction: FrictionSweep | None, draws: Draws | None
) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    if support is not None:
        entry["support"] = {
            "starts": len(support.coarse.starts),
            "agreeing": support.coarse.agreeing,
            "windows_s": [fit.window for fit in (*support.coarse.by_window, *support.search.by_window)],
            "misfit": support.search.best.misfit,
            "simulations": support.coarse.evaluations + support.search.evaluations,
            "ended_early": support.search.ended_early or None,
            "correlations": [asdict(pair) for pair in support.correlations],
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
