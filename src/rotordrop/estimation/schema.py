"""The published JSON Schema of an estimate document; it knows every key and refuses any other."""

from __future__ import annotations

from typing import Any

from rotordrop.model.parameter_table import LOADS, published
from rotordrop.units import si_unit

_NUMBER: dict[str, Any] = {"type": "number"}
_COUNT: dict[str, Any] = {"type": "integer"}
_TEXT: dict[str, Any] = {"type": "string"}
_FLAG: dict[str, Any] = {"type": "boolean"}
_TEXTS: dict[str, Any] = {"type": "array", "items": _TEXT}
_NUMBERS: dict[str, Any] = {"type": "array", "items": _NUMBER}
_PAIR: dict[str, Any] = {**_NUMBERS, "minItems": 2, "maxItems": 2}
_PAIRS: dict[str, Any] = {"type": "array", "items": _PAIR}
_OPTIONAL: dict[str, Any] = {"type": ["number", "null"]}
_VALUE_REF: dict[str, Any] = {"$ref": "#/$defs/value"}


def _closed(optional: dict[str, Any], **needed: Any) -> dict[str, Any]:
    """An object with these keys, those that must be there, and no other."""
    return {
        "type": "object",
        "properties": {**optional, **needed},
        "required": list(needed),
        "additionalProperties": False,
    }


def _by_name(entry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": entry}


def _numbers(*names: str) -> dict[str, Any]:
    return dict.fromkeys(names, _NUMBER)


_VALUE = _closed(
    {
        "standard_error": {**_NUMBER, "description": "Standard error in the same unit."},
        "interval_90": {
            **_PAIR,
            "description": "Interval that holds the true value with 90 % probability.",
        },
        "lower": {**_NUMBER, "description": "Lower limit set by the record."},
        "upper": {**_NUMBER, "description": "Upper limit set by the record."},
        "status": {**_TEXT, "description": "Verdict, or why there is no interval."},
        "start": _NUMBER,
        "bounds": _PAIR,
        "unit": _TEXT,
        "time_s": {**_NUMBER, "description": "When, from power-off."},
    },
    value={**_NUMBER, "description": "Value in the unit of the field name."},
)
_STATISTICS = _closed(
    {**_numbers("preload_stress", "preload_share")},
    rule=_TEXT,
    weighted_by_time=_FLAG,
    count=_COUNT,
    beyond_whiskers=_COUNT,
    above_three_sigma=_COUNT,
    **_numbers(
        *("mean", "median", "lower_quartile", "upper_quartile", "lower_whisker", "upper_whisker"),
        *("standard_deviation", "minimum", "maximum", "three_sigma_limit"),
    ),
)
_IMPACT = _closed(
    {},
    end_s=_OPTIONAL,
    **_numbers("start_s", "peak_time_s", "azimuth_rad"),
    **dict.fromkeys(("peak_force_N", "impulse_N_s", "dissipated_energy_J"), _VALUE_REF),
)


def _numbers_of_bearing() -> dict[str, Any]:
    """Parameters and loads of a bearing: a field with a point in it is one of a group."""
    properties: dict[str, Any] = {}
    described = {field: f"{row.label} [{row.unit}]" for field, row in published().items()}
    described |= {load.field: f"{load.label} [{si_unit(load.kind)}]" for load in LOADS}
    for path, text in described.items():
        group, _, leaf = path.rpartition(".")
        at = properties.setdefault(group, _closed({}))["properties"] if group else properties
        at[leaf] = {**_VALUE_REF, "description": text}
    return properties


_BEARING = _closed(
    {
        **_numbers_of_bearing(),
        "not_stated": {**_by_name(_TEXT), "description": "Numbers that are not stated, and why."},
    },
    origin={**_TEXT, "description": "Who found force and stress of this bearing."},
    peak_force_N=_VALUE_REF,
    peak_stress_Pa=_VALUE_REF,
    stress_statistics_Pa=_STATISTICS,
    impacts={"type": "array", "items": _IMPACT},
)
_CHECK = _closed({}, name=_TEXT, passed=_FLAG, message=_TEXT, note=_TEXT)
_CONSISTENCY = _closed(
    {},
    consistent=_FLAG,
    sentence=_TEXT,
    nis=_OPTIONAL,
    process_noise_factor=_OPTIONAL,
    checks={"type": "array", "items": _CHECK},
)
_CROSS_CHECK = _closed(
    {},
    name=_TEXT,
    agrees=_FLAG,
    replaced={**_FLAG, "description": "Whether the estimate has given way to the cross-check."},
    **_numbers("estimate", "cross_check", "known_relative_accuracy"),
)
_LATER = _closed(
    {},
    bearing=_TEXT,
    larger={**_FLAG, "description": "Whether the rotor went further out after the estimated part."},
    **_numbers("first", "first_time", "later", "later_time", "resolved"),
)
_PARAMETER = _closed(
    {},
    path=_TEXT,
    scope=_TEXT,
    prior={"oneOf": [_VALUE_REF, {"type": "null"}]},
    estimate=_VALUE_REF,
)
_SENSOR = _closed({}, gain_error=_VALUE_REF, offset_m=_VALUE_REF, noise_m=_NUMBER)
_SPEED = _closed(
    {},
    aero_time_constant_s={"oneOf": [_VALUE_REF, {"type": "null"}]},
    profile_time_constant_s=_OPTIONAL,
    **_numbers("friction_loss_Hz", "simulated_end_Hz"),
)
_STATE = {"displacement_m": _by_name(_NUMBERS), "velocity_m_per_s": _by_name(_NUMBERS)}
_INITIAL = _closed(
    {},
    **_STATE,
    remanent_force_N={"type": "array"},
    modal_expansion=_closed({}, **_STATE),
    **_numbers("remanence_time_constant_s", "misfit"),
)
_IDENTIFICATION = _closed(
    {
        "support": _closed(
            {},
            starts=_COUNT,
            agreeing=_COUNT,
            windows_s=_NUMBERS,
            misfit=_NUMBER,
            simulations=_COUNT,
            ended_early={"type": ["string", "null"]},
            correlations={"type": "array", "items": _closed({}, first=_TEXT, second=_TEXT, value=_NUMBER)},
        ),
        "friction_sweep": _closed({}, dynamic=_NUMBERS, disagreement_m=_NUMBERS, window_s=_PAIR),
        "draws": _closed({}, count=_COUNT, rejected=_COUNT),
    }
)
_SETTLED = _closed(
    {},
    **_numbers(
        *("radius_m", "sideways_m", "sway_m", "indentation_m", "race_deflection_m"),
        *("support_deflection_m", "vertical_zero_sigma_m"),
    ),
)
_FIRST_CONTACT = _closed(
    {},
    **_numbers(
        *("start_s", "end_s", "duration_s", "timing_error_s", "impact_speed_m_per_s", "indentation_m"),
        *("mass_kg", "half_period_stiffness_N_per_m", "half_period_stiffness_error_N_per_m"),
        "gravity_corrected_stiffness_N_per_m",
    ),
)
_AGREEMENT = _closed(
    {},
    windows={
        "type": "array",
        "items": _closed({}, name=_TEXT, start=_NUMBER, end=_NUMBER, rms=_by_name(_NUMBER)),
    },
    bearings=_by_name(
        _closed(
            {},
            measured_contacts_s=_PAIRS,
            simulated_contacts_s=_PAIRS,
            measured_bounce_m=_OPTIONAL,
            simulated_bounce_m=_OPTIONAL,
            horizon_s=_NUMBER,
        )
    ),
    orbit_disagreement_m=_NUMBER,
    expected_horizon_s=_OPTIONAL,
)
_DROP = _closed(
    {
        "fixed": {"type": ["string", "null"]},
        "speed": _SPEED,
        "initial_state": _INITIAL,
        "identification": _IDENTIFICATION,
        "settled": _by_name(_SETTLED),
        "first_contact": _by_name(_FIRST_CONTACT),
        "agreement": _AGREEMENT,
    },
    format=_TEXT,
    verdict={**_TEXT, "description": "What model and record say of each other, in a sentence."},
    consistent={**_FLAG, "description": "Whether single numbers hold within their intervals."},
    rotordrop_version=_TEXT,
    fingerprint={**_TEXT, "description": "Hash of a probe drop as this computer computes it."},
    machine=_TEXT,
    record=_TEXT,
    record_sha256=_TEXT,
    simulated_record={**_FLAG, "description": "Whether the record is known to be simulated."},
    method={"enum": ["tracked", "replay"]},
    quick=_FLAG,
    drop_instant_s={**_NUMBER, "description": "Power-off in record time."},
    drop_instant_interval_90_s=_PAIR,
    speed_Hz={**_NUMBER, "description": "Rotor speed at power-off."},
    estimated_until_s={**_NUMBER, "description": "End of the part that the numbers are of."},
    warnings=_TEXTS,
    notes=_TEXTS,
    consistency=_CONSISTENCY,
    bearings=_by_name({"$ref": "#/$defs/bearing"}),
    cross_check={"type": "array", "items": _CROSS_CHECK},
    later_motion={"type": "array", "items": _LATER},
    parameters={"type": "array", "items": _PARAMETER},
    sensors=_by_name(_SENSOR),
)


def estimate_schema() -> dict[str, Any]:
    """JSON Schema of the document that ``rotordrop estimate --json`` writes; times are from power-off."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "rotordrop estimate",
        "description": "Force and stress of touchdown bearings from one or several recorded drops.",
        "oneOf": [
            {"$ref": "#/$defs/drop"},
            _closed(
                {},
                format=_TEXT,
                rotordrop_version=_TEXT,
                fingerprint=_TEXT,
                machine=_TEXT,
                drops=_by_name({"$ref": "#/$defs/drop"}),
            ),
        ],
        "$defs": {"value": _VALUE, "bearing": _BEARING, "drop": _DROP},
    }
