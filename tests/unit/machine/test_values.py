"""A physical value: with unit, as a guess with range, as an estimate with interval and source."""

import math

import pytest

from rotordrop.elements.values import LEFT_OUT, Physical
from rotordrop.errors import UsageError
from rotordrop.known import Known

STIFFNESS = Physical("stiffness", above=0.0)
ANGLE = Physical("angle", least=0.0, most=math.pi)


def test_a_number_with_unit_is_given():
    assert STIFFNESS.read("100 kN/mm") == Known(value=1e8, status="given", unit="N/m")


def test_a_guess_has_a_range():
    read = STIFFNESS.read({"guess": "1e8 N/m", "range": ["5e7 N/m", "2e8 N/m"], "source": "drawing"})
    assert read == Known(value=1e8, status="guess", range=(5e7, 2e8), source="drawing", unit="N/m")


def test_an_estimate_has_interval_error_and_source():
    read = STIFFNESS.read({"value": "1e8 N/m", "interval": ["9e7 N/m", "1.1e8 N/m"], "source": "drop 3"})
    assert (read.status, read.interval_90, read.source) == ("estimated", (9e7, 1.1e8), "drop 3")
    assert STIFFNESS.read({"value": "1e8 N/m", "standard_error": "2e6 N/m"}).standard_error == 2e6


def test_limits_of_an_estimate_are_kept_apart_from_its_interval():
    read = Physical("length").read({"value": "280 um", "lower": "275 um", "upper": "285 um"})
    assert (read.lower, read.upper) == pytest.approx((275e-6, 285e-6), rel=1e-15)
    assert read.interval_90 is None


def test_a_value_with_a_source_only_stays_given():
    assert STIFFNESS.read({"value": "1e8 N/m", "source": "drawing"}).status == "given"


def test_numbers_without_dimension_need_no_unit():
    assert Physical("dimensionless").read(0.15).value == 0.15
    assert Physical("dimensionless").read(1).value == 1.0


def test_an_angle_may_be_zero_but_not_negative():
    assert ANGLE.read("0 deg").value == 0.0
    with pytest.raises(UsageError, match=r"-5\.00° is not allowed here; it must not be negative"):
        ANGLE.read("-5 deg")
    with pytest.raises(UsageError, match=r"200° is not allowed here; at most 180°"):
        ANGLE.read("200 deg")


def test_what_was_left_out_passes_unread():
    assert STIFFNESS.read(LEFT_OUT) is LEFT_OUT


def test_saved_numbers_in_si_come_back_exactly():
    for value in (1.0000000000000002, 123456789.12345679, 3e-17, 1.0000000000000002e-19):
        assert STIFFNESS.read(f"{value!r} N/m").value == value


@pytest.mark.parametrize(
    ("written", "told"),
    [
        (1e8, r"100000000\.0 has no unit; a stiffness needs one, for example '1e8 N/m'"),
        ("1e8", "'1e8' has no unit"),
        ("1e8 N", "'1e8 N' is not a stiffness"),
        ("1,5e8 N/m", r"decimal comma; use 1\.5"),
        ("0 N/m", "0 N/m is not allowed here; a stiffness must be positive"),
        ({"guess": "1e8 N/m", "value": "1e8 N/m"}, "either 'guess' or 'value', and only one"),
        ({"range": ["1 N/m", "2 N/m"]}, "either 'guess' or 'value', and only one"),
        ({"guess": "1e8 N/m", "interval": ["1e7 N/m", "1e9 N/m"]}, "a guess has a range, not 'interval'"),
        ({"guess": "1e8 N/m", "standard_error": "1e7 N/m"}, "a guess has a range, not 'standard_error'"),
        ({"guess": "1e8 N/m", "range": "1e7 N/m"}, "range = '1e7 N/m' is not a pair"),
        ({"guess": "1e8 N/m", "range": ["2e8 N/m", "1e7 N/m"]}, "runs backwards"),
        (
            {"guess": "1e8 N/m", "range": ["2e8 N/m", "3e8 N/m"]},
            "100 MN/m lies outside its own range, 200 MN/m",
        ),
        ({"value": "1e8 N/m", "sorce": "x"}, "'sorce' does not belong to a value"),
        ({"value": "1e8 N/m", "source": 3}, "source = 3 is not a text"),
        ({"value": "1e8 N/m", "status": "sure"}, "status = 'sure' is not known; it is one of given, guess"),
        (True, "True is not a stiffness"),
        (Known(value=math.inf), "is not a finite number"),
        (Known(value=math.nan), "is not a finite number"),
    ],
)
def test_refusals_name_the_value_and_the_way_out(written, told):
    with pytest.raises(UsageError, match=told):
        STIFFNESS.read(written)


def test_what_may_be_zero_may_be_as_good_as_zero():
    assert Physical("quadratic_drag", least=0.0).read("1e-32 N m s^2").value == 1e-32
    with pytest.raises(UsageError, match="'1e-32 m' is no length that a machine has"):
        Physical("length", above=0.0).read("1e-32 m")
