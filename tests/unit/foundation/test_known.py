"""A value keeps what is known about it."""

from __future__ import annotations

import dataclasses
import json

import pytest

from rotordrop.known import Known


def test_an_estimated_value_is_a_number():
    value = Known(value=2.8e-4, unit="m")
    assert float(value) == 2.8e-4
    assert value.status == "given"


def test_it_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Known(value=1.0).value = 2.0  # type: ignore[misc]


def test_json_holds_what_is_known_and_nothing_else():
    value = Known(
        value=1e8, status="at its bound", standard_error=2e6, interval_90=(0.9e8, 1.1e8), bounds=(1e6, 1e8)
    )
    assert json.loads(json.dumps(value.as_json())) == {
        "value": 1e8,
        "status": "at its bound",
        "standard_error": 2e6,
        "interval_90": [0.9e8, 1.1e8],
        "bounds": [1e6, 1e8],
    }


def test_a_guess_keeps_its_range_and_source():
    guess = Known(value=0.15, status="guess", range=(0.05, 0.3), source="maker's leaflet")
    assert guess.as_json() == {
        "value": 0.15,
        "status": "guess",
        "range": [0.05, 0.3],
        "source": "maker's leaflet",
    }
