"""The published JSON Schema of an estimate document."""

from __future__ import annotations

from typing import Any

from rotordrop.model.parameter_table import LOADS, published
from rotordrop.units import si_unit

_NUMBER = {"type": "number"}
_VALUE: dict[str, Any] = {
    "type": "object",
    "properties": {
        "value": {**_NUMBER, "description": "Value in the unit of the field name."},
        "standard_error": {**_NUMBER, "description": "Standard error in the same unit."},
        "interval_90": {
            "type": "array",
            "items": _NUMBER,
            "minItems": 2,
            "maxItems": 2,
            "description": "Interval that holds the true value with 90 % probability.",
        },
        "lower": {**_NUMBER, "description": "Lower limit set by the record."},
        "upper": {**_NUMBER, "description": "Upper limit set by the record."},
        "status": {"type": "string", "description": "Verdict, or why there is no interval."},
        "start": _NUMBER,
        "bounds": {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2},
        "unit": {"type": "string"},
        "time_s": {**_NUMBER, "description": "When, from power-off."},
    },
    "required": ["value"],
}
_REFERENCE = {"$ref": "#/$defs/value"}


def _values() -> dict[str, Any]:
    """Parameters and loads of a bearing: a field with a point in it is one of a group."""
    properties: dict[str, Any] = {}
    described = {field: f"{row.label} [{row.unit}]" for field, row in published().items()}
    described |= {load.field: f"{load.label} [{si_unit(load.kind)}]" for load in LOADS}
    for path, text in described.items():
        group, _, leaf = path.rpartition(".")
        at = properties
        if group:
            empty = {"type": "object", "properties": {}, "additionalProperties": False}
            at = properties.setdefault(group, empty)["properties"]
        at[leaf] = {**_REFERENCE, "description": text}
    return properties


_BEARING: dict[str, Any] = {
    "type": "object",
    "properties": {
        **_values(),
        "stress_statistics_Pa": {"type": "object"},
        "impacts": {"type": "array", "items": {"type": "object"}},
    },
    "required": ["peak_force_N", "peak_stress_Pa"],
}
_DROP: dict[str, Any] = {
    "type": "object",
    "properties": {
        "drop_instant_s": {**_NUMBER, "description": "Power-off in record time."},
        "fingerprint": {
            "type": "string",
            "description": "Hash of a probe drop: whether two computers compute the same bits.",
        },
        "speed_Hz": {**_NUMBER, "description": "Rotor speed at power-off."},
        "method": {"enum": ["tracked", "replay"]},
        "warnings": {"type": "array", "items": {"type": "string"}},
        "bearings": {"type": "object", "additionalProperties": {"$ref": "#/$defs/bearing"}},
    },
    "required": ["drop_instant_s", "speed_Hz", "method", "warnings", "bearings"],
}


def estimate_schema() -> dict[str, Any]:
    """JSON Schema of the document that ``rotordrop estimate --json`` writes; times are from power-off."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "rotordrop estimate",
        "description": "Force and stress of touchdown bearings from one or several recorded drops.",
        "oneOf": [
            {"$ref": "#/$defs/drop"},
            {
                "type": "object",
                "properties": {
                    "machine": {"type": "string"},
                    "fingerprint": {"type": "string"},
                    "drops": {"type": "object", "additionalProperties": {"$ref": "#/$defs/drop"}},
                },
                "required": ["machine", "drops"],
            },
        ],
        "$defs": {"value": _VALUE, "bearing": _BEARING, "drop": _DROP},
    }
