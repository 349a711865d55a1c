"""JSON Schema of what ``rotordrop look --json`` writes."""

from __future__ import annotations

from typing import Any

from rotordrop.json_schema import DIALECT, FLAG, MAYBE, NUMBER, PAIR, TEXT, TEXTS, closed, listed


def look_schema() -> dict[str, Any]:
    """JSON Schema of a look at a record: SI units, times in record time, positive turns with the spin."""
    content = closed(
        record=TEXT,
        sha256=TEXT,
        channels=listed(name=TEXT, plane=TEXT, angle_rad=NUMBER),
        sampling_rate_Hz=NUMBER,
        start_s=NUMBER,
        end_s=NUMBER,
        speed_rad_per_s=MAYBE,
        standstill_s=MAYBE,
        findings=listed(
            kind=TEXT,
            severity={"enum": ["stop", "warning", "note"]},
            channel={"type": ["string", "null"]},
            time_s=MAYBE,
            message=TEXT,
            remedy=TEXT,
        ),
        drops=listed(release_s=NUMBER, end_s=NUMBER, permanent_contact_s=MAYBE, lifted=FLAG),
        planes=listed(
            plane=TEXT,
            air_gap_m=NUMBER,
            largest_displacement_m=NUMBER,
            largest_displacement_time_s=NUMBER,
            beyond_air_gap_m=NUMBER,
            position_index=NUMBER,
            velocity_index=MAYBE,
        ),
        impacts=listed(
            plane=TEXT,
            time_s=NUMBER,
            azimuth_rad=NUMBER,
            depth_m=NUMBER,
            approach_m_per_s=NUMBER,
            rebound_m_per_s=NUMBER,
        ),
        whirls=listed(
            plane=TEXT,
            start_s=NUMBER,
            end_s=NUMBER,
            turns=NUMBER,
            frequency_Hz=NUMBER,
            sense={"enum": ["forward", "backward"]},
        ),
        synchronous=listed(
            plane=TEXT,
            amplitude_m=NUMBER,
            amplitude_interval_90_m=PAIR,
            phase_rad=NUMBER,
            phase_interval_90_rad=PAIR,
            turns=NUMBER,
        ),
        timeline=listed(time_s=NUMBER, event=TEXT),
        notes=TEXTS,
    )
    head = {"$schema": DIALECT, "title": "rotordrop look"}
    return {**head, **content}
