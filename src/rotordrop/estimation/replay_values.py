"""Identified values of a replayed drop, by the field names of the estimate's document."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import NINETY, IdentifiedValue
from rotordrop.estimation.tracked_values import MODEL_FORCE_SIGMA, MODEL_MEAN_FORCE_SIGMA, MODEL_STRESS_SIGMA
from rotordrop.estimation.uncertainty import FEWEST_DRAWS, Draws, drop_numbers, interval
from rotordrop.identification.air_gap import AirGap
from rotordrop.identification.first_contact import FirstContact
from rotordrop.identification.friction import FrictionSweep
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.model.parameter import Step
from rotordrop.model.parameter_table import rows
from rotordrop.simulation.certificate import refined_peak
from rotordrop.simulation.result import DropResult

Array = NDArray[np.float64]
Values = dict[str, IdentifiedValue]

MODEL_SIGMA = {
    "peak_force_N": MODEL_FORCE_SIGMA,
    "mean_force_0p15_0p2_N": MODEL_MEAN_FORCE_SIGMA,
    "peak_stress_Pa": MODEL_STRESS_SIGMA,
    "mean_stress_Pa": MODEL_STRESS_SIGMA,
}
"""Relative standard deviation by what every model here leaves out, beside the draws [1]."""

LOADS = tuple(MODEL_SIGMA)


def replay_values(
    fitted: Mapping[str, IdentifiedValue],
    machine: Machine,
    gap: AirGap,
    contacts: tuple[FirstContact, ...],
    friction: FrictionSweep | None,
    simulated: DropResult,
    draws: Draws | None,
) -> dict[str, Values]:
    """Identified values per bearing.

    Parameters
    ----------
    fitted : mapping
        Values of the impact fit by path, such as ``"NDE.support.stiffness"``.
    machine : Machine
        The machine that was replayed.
    gap, contacts, friction
        Results of the steps; ``friction`` is None when it was taken over.
    simulated : DropResult
        The replayed drop.
    draws : Draws or None
        Draws behind the intervals.
    """
    found: dict[str, Values] = {}
    for b, bearing in enumerate(machine.touchdown_bearings):
        values: Values = {
            "air_gap_m": _air_gap(gap, b),
            "equivalent_stiffness_N_per_m": IdentifiedValue(
                value=contacts[b].equivalent_stiffness,
                status="the record does not determine it",
                standard_error=contacts[b].standard_error,
                unit="N/m",
            ),
        }
        for row in rows("bearing"):
            if row.step is Step.IMPACTS and row.path_of(bearing.name) in fitted:
                values[row.field] = fitted[row.path_of(bearing.name)]
        values |= _friction(bearing, friction)
        values |= _loads(simulated, draws, b)
        found[bearing.name] = values
    return found


def peak_time(result: DropResult, bearing: int) -> float:
    """Time of the peak force [s]."""
    return refined_peak(result.time, result.bearing_force_magnitude[:, bearing])[1]


def _air_gap(gap: AirGap, b: int) -> IdentifiedValue:
    value, error = float(gap.value[b]), float(gap.standard_error[b])
    return IdentifiedValue(
        value=value,
        standard_error=error,
        interval_90=(value - NINETY * error, value + NINETY * error),
        lower=float(gap.lower[b]),
        upper=float(gap.upper[b]),
        unit="m",
    )


def _friction(bearing: TouchdownBearing, sweep: FrictionSweep | None) -> Values:
    law = bearing.friction
    ratio = float(law.static) / float(law.dynamic)
    if sweep is not None:
        dynamic = sweep.value
    else:
        dynamic = IdentifiedValue(
            value=float(law.dynamic),
            status="prior",
            standard_error=law.dynamic.standard_error,
            interval_90=law.dynamic.interval_90,
            unit="1",
        )
    low, high = dynamic.interval_90 or (dynamic.value, dynamic.value)
    static = IdentifiedValue(
        value=ratio * dynamic.value,
        status="prior",
        standard_error=None if dynamic.standard_error is None else ratio * dynamic.standard_error,
        interval_90=(0.85 * ratio * low, 1.15 * ratio * high),
        unit="1",
    )
    return {"friction.static": static, "friction.dynamic": dynamic}


def _loads(simulated: DropResult, draws: Draws | None, b: int) -> Values:
    force, stress = drop_numbers(simulated)
    values = (force[0, b], force[1, b], stress[0, b], stress[1, b])
    samples: tuple[Array | None, ...] = (None,) * 4
    if draws is not None and len(draws) >= FEWEST_DRAWS:
        samples = (
            draws.peak_force[:, b],
            draws.mean_force[:, b],
            draws.peak_stress[:, b],
            draws.mean_stress[:, b],
        )
    found = {}
    for field, value, sample in zip(LOADS, values, samples, strict=True):
        if np.isfinite(value):
            found[field] = _load(float(value), sample, MODEL_SIGMA[field], field.rsplit("_", 1)[1])
    return found


def _load(value: float, sample: Array | None, model: float, unit: str) -> IdentifiedValue:
    """A force or stress with the interval of its draws, widened by what every model here leaves out."""
    if sample is None:
        return IdentifiedValue(value=value, status="the record does not determine it", unit=unit)
    low, high = interval(sample)
    middle = float(np.median(sample))
    beside = NINETY * model * value
    return IdentifiedValue(
        value=value,
        standard_error=math.hypot(float(np.std(sample, ddof=1)), model * value),
        interval_90=(middle - math.hypot(middle - low, beside), middle + math.hypot(high - middle, beside)),
        unit=unit,
    )
