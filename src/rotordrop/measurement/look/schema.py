"""JSON Schema of what ``rotordrop look --json`` writes."""

from __future__ import annotations

from typing import Any

_NUMBER = {"type": "number"}
_MAYBE = {"type": ["number", "null"]}
_PAIR = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}
_TEXT = {"type": "string"}


def _listed(**fields: Any) -> dict[str, Any]:
    return {"type": "array", "items": _table(**fields)}


def _table(**fields: Any) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": fields,
        "required": list(fields),
        "additionalProperties": False,
    }


def look_schema() -> dict[str, Any]:
    """JSON Schema of a look at a record: SI units, times in record time, positive turns with the spin."""
    content = _table(
        record=_TEXT,
        sha256=_TEXT,
        channels=_listed(name=_TEXT, plane=_TEXT, angle_rad=_NUMBER),
        sampling_rate_Hz=_NUMBER,
        start_s=_NUMBER,
        end_s=_NUMBER,
        speed_rad_per_s=_MAYBE,
        standstill_s=_MAYBE,
        findings=_listed(
            kind=_TEXT,
            severity={"enum": ["stop", "warning", "note"]},
            channel={"type": ["string", "null"]},
            time_s=_MAYBE,
            message=_TEXT,
            remedy=_TEXT,
        ),
        drops=_listed(
            release_s=_NUMBER, end_s=_NUMBER, permanent_contact_s=_MAYBE, lifted={"type": "boolean"}
        ),
        planes=_listed(
            plane=_TEXT,
            air_gap_m=_NUMBER,
            largest_displacement_m=_NUMBER,
            largest_displacement_time_s=_NUMBER,
            beyond_air_gap_m=_NUMBER,
            position_index=_NUMBER,
            velocity_index=_MAYBE,
        ),
        impacts=_listed(
            plane=_TEXT,
            time_s=_NUMBER,
            azimuth_rad=_NUMBER,
            depth_m=_NUMBER,
            approach_m_per_s=_NUMBER,
            rebound_m_per_s=_NUMBER,
        ),
        whirls=_listed(
            plane=_TEXT,
            start_s=_NUMBER,
            end_s=_NUMBER,
            turns=_NUMBER,
            frequency_Hz=_NUMBER,
            sense={"enum": ["forward", "backward"]},
        ),
        synchronous=_listed(
            plane=_TEXT,
            amplitude_m=_NUMBER,
            amplitude_interval_90_m=_PAIR,
            phase_rad=_NUMBER,
            phase_interval_90_rad=_PAIR,
            turns=_NUMBER,
        ),
        timeline=_listed(time_s=_NUMBER, event=_TEXT),
        notes={"type": "array", "items": _TEXT},
    )
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "rotordrop look"}
    return {**head, **content}
