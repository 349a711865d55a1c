"""The published JSON Schema of an estimate document; it knows every key and refuses any other."""

from __future__ import annotations

from typing import Any

from rotordrop.elements.table import LOADS, published
from rotordrop.json_schema import (
    COUNT,
    DIALECT,
    FLAG,
    MAYBE,
    NUMBER,
    NUMBERS,
    PAIR,
    PAIRS,
    TEXT,
    TEXTS,
    by_name,
    closed,
    numbers,
)
from rotordrop.severity.numbers import SEVERITY
from rotordrop.units import si_unit

_VALUE_REF: dict[str, Any] = {"$ref": "#/$defs/value"}


_VALUE = closed(
    {
        "standard_error": {**NUMBER, "description": "Standard error in the same unit."},
        "interval_90": {
            **PAIR,
            "description": "Interval that holds the true value with 90 % probability.",
        },
        "allowance_90": {
            **NUMBER,
            "description": "Half width of the interval by what the model leaves out alone.",
        },
        "lower": {**NUMBER, "description": "Lower limit set by the record."},
        "upper": {**NUMBER, "description": "Upper limit set by the record."},
        "status": {**TEXT, "description": "Verdict, or why there is no interval."},
        "start": NUMBER,
        "bounds": PAIR,
        "unit": TEXT,
        "time_s": {**NUMBER, "description": "When, from power-off."},
    },
    value={**NUMBER, "description": "Value in the unit of the field name."},
)
_STATISTICS = closed(
    {**numbers("preload_stress", "preload_share")},
    rule=TEXT,
    weighted_by_time=FLAG,
    count=COUNT,
    beyond_whiskers=COUNT,
    above_three_sigma=COUNT,
    **numbers(
        *("mean", "median", "lower_quartile", "upper_quartile", "lower_whisker", "upper_whisker"),
        *("standard_deviation", "minimum", "maximum", "three_sigma_limit"),
    ),
)
_IMPACT = closed(
    {},
    end_s=MAYBE,
    **numbers("start_s", "peak_time_s", "azimuth_rad"),
    **dict.fromkeys(("peak_force_N", "impulse_N_s", "dissipated_energy_J"), _VALUE_REF),
)


def _numbers_of_bearing() -> dict[str, Any]:
    """Parameters and loads of a bearing: a field with a point in it is one of a group."""
    properties: dict[str, Any] = {}
    described = {field: f"{row.label} [{row.unit}]" for field, row in published().items()}
    described |= {load.field: f"{load.label} [{si_unit(load.kind)}]" for load in LOADS}
    described |= {one.field: f"{one.label} [{si_unit(one.kind) or '1'}]" for one in SEVERITY}
    for path, text in described.items():
        group, _, leaf = path.rpartition(".")
        at = properties.setdefault(group, closed({}))["properties"] if group else properties
        at[leaf] = {**_VALUE_REF, "description": text}
    return properties


_BEARING = closed(
    {
        **_numbers_of_bearing(),
        "not_stated": {**by_name(TEXT), "description": "Numbers that are not stated, and why."},
    },
    origin={**TEXT, "description": "Who found force and stress of this bearing."},
    peak_force_N=_VALUE_REF,
    peak_stress_Pa=_VALUE_REF,
    stress_statistics_Pa=_STATISTICS,
    impacts={"type": "array", "items": _IMPACT},
)
_CHECK = closed({}, name=TEXT, passed=FLAG, message=TEXT, note=TEXT)
_CONSISTENCY = closed(
    {},
    consistent=FLAG,
    sentence=TEXT,
    nis=MAYBE,
    process_noise_factor=MAYBE,
    checks={"type": "array", "items": _CHECK},
)
_STRUCTURE = closed(
    {},
    name={**TEXT, "description": "Something the machine has beyond the usual model."},
    log_likelihood_rise={
        **MAYBE,
        "description": "Of the readings, by it; null where the model without it needed larger impulses.",
    },
    sentence=TEXT,
)
_CROSS_CHECK = closed(
    {},
    name=TEXT,
    agrees=FLAG,
    replaced={**FLAG, "description": "Whether the estimate has given way to the cross-check."},
    **numbers("estimate", "cross_check", "known_relative_accuracy"),
)
_LATER = closed(
    {},
    bearing=TEXT,
    larger={**FLAG, "description": "Whether the rotor went further out after the estimated part."},
    **numbers("first", "first_time", "later", "later_time", "resolved"),
)
_PARAMETER = closed(
    {},
    path=TEXT,
    scope=TEXT,
    prior={"oneOf": [_VALUE_REF, {"type": "null"}]},
    estimate=_VALUE_REF,
)
_JOINT = closed(
    {},
    paths=TEXTS,
    mean={**NUMBERS, "description": "In the measures of the estimate, mostly logarithms."},
    covariance={**NUMBERS, "description": "Lower triangle, row by row, of the errors of the mean."},
    prior_mean=NUMBERS,
    prior_standard_deviation=NUMBERS,
)
_SENSOR = closed({}, gain_error=_VALUE_REF, offset_m=_VALUE_REF, noise_m=NUMBER)
_UNBALANCE = closed(
    {},
    node={**COUNT, "description": "Node of the plane, counted from 1."},
    amount_kg_m=_VALUE_REF,
    phase_rad={
        "oneOf": [_VALUE_REF, {"type": "null"}],
        "description": "Heavy spot when the mark of the shaft passes, from +y, positive with the spin; null "
        "where the record has no mark or tells no direction.",
    },
    sentence=TEXT,
)
_SPEED = closed(
    {},
    aero_time_constant_s={"oneOf": [_VALUE_REF, {"type": "null"}]},
    profile_time_constant_s=MAYBE,
    **numbers("friction_loss_Hz", "simulated_end_Hz"),
)
_STATE = {"displacement_m": by_name(NUMBERS), "velocity_m_per_s": by_name(NUMBERS)}
_INITIAL = closed(
    {},
    **_STATE,
    remanent_force_N={"type": "array"},
    modal_expansion=closed({}, **_STATE),
    **numbers("remanence_time_constant_s", "misfit"),
)
_IDENTIFICATION = closed(
    {
        "support": closed(
            {},
            starts=COUNT,
            agreeing=COUNT,
            windows_s=NUMBERS,
            misfit=NUMBER,
            simulations=COUNT,
            ended_early={"type": ["string", "null"]},
            correlations={"type": "array", "items": closed({}, first=TEXT, second=TEXT, value=NUMBER)},
        ),
        "friction_sweep": closed({}, dynamic=NUMBERS, disagreement_m=NUMBERS, window_s=PAIR),
        "draws": closed({}, count=COUNT, rejected=COUNT),
    }
)
_SETTLED = closed(
    {},
    **numbers(
        *("radius_m", "sideways_m", "sway_m", "indentation_m", "race_deflection_m"),
        *("support_deflection_m", "vertical_zero_sigma_m"),
    ),
)
_FIRST_CONTACT = closed(
    {},
    **numbers(
        *("start_s", "end_s", "duration_s", "timing_error_s", "impact_speed_m_per_s", "indentation_m"),
        *("mass_kg", "half_period_stiffness_N_per_m", "half_period_stiffness_error_N_per_m"),
        "gravity_corrected_stiffness_N_per_m",
    ),
)
_AGREEMENT = closed(
    {},
    windows={
        "type": "array",
        "items": closed({}, name=TEXT, start=NUMBER, end=NUMBER, rms=by_name(NUMBER)),
    },
    bearings=by_name(
        closed(
            {},
            measured_contacts_s=PAIRS,
            simulated_contacts_s=PAIRS,
            measured_bounce_m=MAYBE,
            simulated_bounce_m=MAYBE,
            horizon_s=NUMBER,
        )
    ),
    orbit_disagreement_m=NUMBER,
    expected_horizon_s=MAYBE,
)
_ADVICE = closed(
    {},
    measurement={**TEXT, "description": "What to measure of the machine."},
    paths=TEXTS,
    half_widths_N={**by_name(NUMBER), "description": "Half the 90 % interval of the peak force by bearing."},
    narrowed_N={**by_name(NUMBER), "description": "The same once the measurement is known."},
    sentence=TEXT,
)
_DROP = closed(
    {
        "fixed": {"type": ["string", "null"]},
        "speed": _SPEED,
        "initial_state": _INITIAL,
        "identification": _IDENTIFICATION,
        "settled": by_name(_SETTLED),
        "first_contact": by_name(_FIRST_CONTACT),
        "agreement": _AGREEMENT,
    },
    format=TEXT,
    verdict={**TEXT, "description": "What model and record say of each other, in a sentence."},
    consistent={**FLAG, "description": "Whether single numbers hold within their intervals."},
    rotordrop_version=TEXT,
    fingerprint={**TEXT, "description": "Hash of a probe drop as this computer computes it."},
    machine=TEXT,
    record=TEXT,
    record_sha256=TEXT,
    recorded={**TEXT, "description": "When the recorder says the drop was; empty where it does not."},
    simulated_record={**FLAG, "description": "Whether the record is known to be simulated."},
    method={"enum": ["tracked", "replay"]},
    quick=FLAG,
    drop_instant_s={**NUMBER, "description": "Power-off in record time."},
    drop_instant_interval_90_s=PAIR,
    speed_Hz={**NUMBER, "description": "Rotor speed at power-off."},
    estimated_until_s={**NUMBER, "description": "End of the part that the numbers are of."},
    warnings=TEXTS,
    notes=TEXTS,
    consistency=_CONSISTENCY,
    bearings=by_name({"$ref": "#/$defs/bearing"}),
    structure={"type": "array", "items": _STRUCTURE},
    advice={"type": "array", "items": _ADVICE},
    cross_check={"type": "array", "items": _CROSS_CHECK},
    later_motion={"type": "array", "items": _LATER},
    parameters={"type": "array", "items": _PARAMETER},
    joint={
        "oneOf": [_JOINT, {"type": "null"}],
        "description": "How the errors of what belongs to the machine hang together.",
    },
    sensors=by_name(_SENSOR),
    unbalance={"type": "array", "items": _UNBALANCE},
)


def estimate_schema() -> dict[str, Any]:
    """JSON Schema of the document that ``rotordrop estimate --json`` writes; times are from power-off."""
    return {
        "$schema": DIALECT,
        "title": "rotordrop estimate",
        "description": "Force and stress of touchdown bearings from one or several recorded drops.",
        "oneOf": [
            {"$ref": "#/$defs/drop"},
            closed(
                {},
                format=TEXT,
                rotordrop_version=TEXT,
                fingerprint=TEXT,
                machine=TEXT,
                drops=by_name({"$ref": "#/$defs/drop"}),
            ),
        ],
        "$defs": {"value": _VALUE, "bearing": _BEARING, "drop": _DROP},
    }
