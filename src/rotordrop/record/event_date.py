"""When a recorded drop was, as its recorder says."""

from __future__ import annotations

from collections.abc import Mapping

from rotordrop.record.record import Record

EVENT_KEYS = (
    "start",
    "event_time",
    "event time",
    "trigger_time",
    "trigger time",
    "trigger",
    "date",
    "recorded",
    "time",
)
"""Header entries of recorders that say when the drop was."""


def event_date(record: Record) -> str:
    """When the recorder says the drop was; empty where its header does not tell."""
    told: Mapping[str, str] = {str(key).strip().lower(): str(value) for key, value in record.metadata.items()}
    for key in EVENT_KEYS:
        if any(sign.isdigit() for sign in told.get(key, "")):
            return told[key][:40]
    return ""
