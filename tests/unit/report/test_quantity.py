"""Numbers in a report: one unit per kind, as many digits as the interval justifies, never a bare number."""

import math
from dataclasses import replace

import pytest

from rotordrop.jobs.results import quantity_json
from rotordrop.known import Known
from rotordrop.report.quantity import Quantity, with_error, written
from rotordrop.severity.numbers import SEVERITY

THIN = "\u202f"


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (275.04e-6, "length", "275.0 µm"),
        (2840.4, "force", f"2{THIN}840 N"),
        (1.7408e9, "pressure", f"1{THIN}741 MPa"),
        (1.02e8, "stiffness", "102.0 N/µm"),
        (2 * math.pi * 60, "speed", f"60.00 Hz (3{THIN}600 rpm)"),
        (math.pi / 30 * 8600, "speed", f"143.3 Hz (8{THIN}600 rpm)"),
        (-math.pi / 2, "angle", "−90.00°"),
        (8.18e-3, "time", "8.180 ms"),
        (3.78e9, "contact_stiffness", "3.780 GN/mⁿ"),
        (0.1, "dimensionless", "0.1000"),
        (1316, "count", f"1{THIN}316"),
        (0.948, "share", "94.80 %"),
        (math.nan, "force", "–"),
    ],
)
def test_a_kind_has_one_unit(value, kind, text):
    assert Quantity(value=value, kind=kind).text == text


@pytest.mark.parametrize(
    ("value", "kind", "told", "text", "interval"),
    [
        (3333.086, "force", {"interval_90": (3180.4, 3490.2)}, "3\u202f333 N", "3\u202f180 to 3\u202f490 N"),
        (275.0432e-6, "length", {"interval_90": (274.61e-6, 275.49e-6)}, "275.04 µm", "274.61 to 275.49 µm"),
        (275e-6, "length", {"lower": 270e-6, "upper": 275e-6}, "275.0 µm", "limits 270.0 to 275.0 µm"),
        (40.0, "mass", {"standard_error": 0.5}, "40.00 kg", "± 0.50 kg (standard error)"),
        (4.2e-11, "dimensionless", {"interval_90": (0.0, 8.572e-11)}, "4.20 × 10⁻¹¹", "0 to 8.57 × 10⁻¹¹"),
        (240.0, "force", {"interval_90": (230.0, math.inf)}, "240.0 N", "230.0 N or more"),
        (240.0, "force", {"interval_90": (-math.inf, 250.0)}, "240.0 N", "250.0 N or less"),
        (240.0, "force", {"interval_90": (230.0, 250.0)}, "240 N", "230 to 250 N"),
    ],
)
def test_the_interval_says_how_many_digits_are_meant(value, kind, told, text, interval):
    shown = Quantity(value=value, kind=kind, **told)
    assert (shown.text, shown.interval_text) == (text, interval)


def test_an_identified_value_brings_its_interval_along():
    known = Known(value=1e8, interval_90=(0.9e8, 1.1e8), standard_error=0.06e8, status="at its bound")
    quantity = Quantity.of(known, "stiffness")
    assert quantity.interval_text == "90 to 110 N/µm"
    assert Quantity.of(None, "stiffness").text == "–"


@pytest.mark.parametrize(
    ("value", "places", "text"),
    [(-0.0004, 2, "0.00"), (-12.34, 1, "−12.3"), (1234567.0, 0, f"1{THIN}234{THIN}567"), (0.0, 0, "0")],
)
def test_written_numbers(value, places, text):
    assert written(value, places) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (28.7613, 0.0113, "28.761 ± 0.011 Hz"),
        (59.13, 0.314, "59.13 ± 0.31 Hz"),
        (59.13, None, "about 59.1 Hz"),
        (59.13, math.inf, "about 59.1 Hz"),
    ],
)
def test_a_number_has_the_digits_of_its_error(value, error, text):
    assert with_error(value, error, "Hz") == text


def test_a_range_that_stands_for_its_number_has_its_level():
    known = Known(value=2.0, interval_90=(1.0, 3.0))
    assert Quantity.of(known, "force", range_only=True).levelled == "90 %: 1.0 to 3.0 N"
    assert (
        Quantity.of(replace(known, interval_90=(0.0, 3.0)), "force", range_only=True).text == "3.0 N or less"
    )
    assert Quantity.of(known, "force").levelled == "2.0 N"
    assert quantity_json(Quantity.of(known, "force", range_only=True))["SI"] == ["90 %: 1.0 to 3.0 N", ""]


def test_a_share_of_a_life_that_no_number_of_drops_uses_up_has_no_digits():
    life = next(one for one in SEVERITY if one.field.endswith("16281"))

    def shown(value, high, *, uncertain=False):
        known = Known(value=value, interval_90=(0.0, high))
        return replace(Quantity.of(known, life.shown_as, range_only=uncertain), places=life.places)

    assert (shown(7.9e-11, 8.5e-11).text, shown(7.9e-11, 8.5e-11).interval_text) == ("< 0.001 %", "")
    assert shown(7.9e-11, 8.5e-11, uncertain=True).text == "< 0.001 %"
    assert shown(2e-6, 4e-4).interval_text == "0.000 to 0.040 %"  # what may be more is not called less
    assert shown(1.2e-3, 1.5e-3).text == "0.120 %"
