"""Units: what stock parsers get wrong, and what the messages say instead."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotordrop.errors import UsageError
from rotordrop.units import (
    GRAVITY,
    KINDS,
    fall_speed,
    fall_time,
    format_amount,
    format_chance,
    format_moment,
    format_quantity,
    parse_quantity,
)


@pytest.mark.parametrize(
    ("kind", "value", "texts"),
    [
        ("speed", 2 * math.pi * 60, "60 Hz; 3600 RPM; 60 rev/s"),
        ("frequency", 60.0, "3600 rpm; 60 Hz; 376.99111843077515 rad/s"),
        ("length", 254e-6, "10 mil"),
        ("speed", math.pi / 180, "1 deg/s"),
        ("frequency", 1500.0, "1.5 kHz"),
        ("speed", 100 * math.pi, "3000 r/min; 3000 U/min"),
        ("angle", math.pi / 4, "45 deg"),
        ("angle", -math.pi / 4, "-45°"),
        ("length", 280e-6, "280 um; 280 µm; 280 μm; 280 micron"),
        ("length", 0.27e-3, "0.27 mm"),
        ("length", 0.0254, "1 in"),
        ("length", 127e-6, "5 thou"),
        ("stiffness", 1e8, "1e8 N/m; 100 N/um"),
        ("stiffness", 4.4482216152605 / 0.0254, "1 lbf/in"),
        ("damping", 5000.0, "5 kN s/m; 5000 Ns/m; 5 N·s/mm"),
        ("unbalance", 5e-5, "50 g mm; 50 gmm"),
        ("inertia", 0.42, "0.42 kg m²"),
        ("density", 7850.0, "7.85 g/cm^3"),
        ("pressure", 210e9, "210 GPa"),
        ("pressure", 6894.757293168361, "1 psi"),
        ("acceleration", 29.41995, "3 g_n"),
        ("force", 9.80665, "1 kgf"),
        ("mass", 2000.0, "2 t"),
        ("mass", 0.45359237, "1 lb"),
        ("rotational_drag", 0.1, "0.1 N m s; 0.1 N m s/rad"),
        ("rotational_drag", 60 / (2 * math.pi), "1 N m/rpm"),
        ("contact_damping", 0.1, "0.1 s/m"),
        ("voltage_sensitivity", 8000.0, "8 mV/um"),
        ("temperature", 293.15, "20 degC; 68 °F"),
        ("dimensionless", 0.15, "15 %; 0.15"),
        ("contact_stiffness", 1.05e9, "1.05e9 N/m^1.11; 1.05e9 N/m^(10/9)"),
        ("contact_stiffness", 1000**1.5, "1 N/mm^1.5"),
        ("contact_stiffness", 2000.0, "2 kN/m"),
        ("speed", 300 * math.pi, "9000 1/min; 9000 min^-1; 9000 min-1; 9000 min⁻¹; 9000 U/min"),
        ("frequency", 150.0, "9000 1/min; 9000 min^-1; 9000 min-1; 9000 min⁻¹; 9000 U/min"),
    ],
)
def test_value_in_si(kind, value, texts):
    for text in texts.split("; "):
        assert parse_quantity(text, kind) == pytest.approx(value, rel=1e-15), text
    assert parse_quantity(0.15, "dimensionless") == 0.15


@pytest.mark.parametrize(
    ("kind", "units"),
    [
        ("length", "m; mm; um; µm; mil"),
        ("time", "s; ms; us; µs"),
        ("frequency", "Hz; kHz; rpm"),
        ("speed", "rad/s; Hz; rpm"),
        ("angle", "rad; deg"),
        ("pressure", "GPa; MPa"),
        ("velocity", "mm/s"),
        ("unbalance", "g mm"),
        ("voltage_sensitivity", "mV/um"),
        ("density", "kg/m^3"),
        ("contact_stiffness", "N/m^1.111"),
    ],
)
def test_usual_units_are_those_of_the_unit_library(kind, units):
    """Brackets leave the short way, which needs no library."""
    for unit in units.split("; "):
        assert parse_quantity(f"3.25 {unit}", kind) == pytest.approx(
            parse_quantity(f"3.25 ({unit})", kind), rel=1e-14
        )


ENDLESS = (
    "m**9**9**9**9",
    "(9**9**9**9)m",
    "m^9^9",
    "m**999",
    20_000 * "(" + "m",
    10**6 * "a",
    14 * "(m (m ",
)
"""Units that would be computed for ever are refused at once."""


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("0,27 mm", "length", r"'0,27 mm' has a decimal comma; use 0\.27 mm"),
        ("1,000 N", "force", r"'1,000 N' has a decimal comma; use 1\.000 N"),
        ("3 g", "acceleration", r"'3 g' is not an acceleration; g is the gram; write '3 g_n'"),
        ("280", "length", r"'280' has no unit; a length needs one, for example '280 um'"),
        (280, "length", r"280 has no unit; a length needs one"),
        (280e-6, "length", r"0\.00028 has no unit"),
        ("60", "speed", r"'60' has no unit; a speed needs one, for example '60 Hz'"),
        ("280 kg", "length", r"'280 kg' is not a length; write for example '280 um'"),
        ("1e8 N", "stiffness", r"'1e8 N' is not a stiffness; write for example '1e8 N/m'"),
        ("60 1/s", "speed", r"'60 1/s' is not a speed; say what is counted: 'Hz', 'rpm' or 'rad/s'"),
        ("3000 1/s", "speed", r"say what is counted"),
        ("60 Hz", "angle", r"'60 Hz' is not an angle; write for example '45 deg'"),
        ("45 lb/in", "stiffness", r"lb is a mass here; write 'lbf'"),
        ("60 hz", "speed", r"'hz' is not a unit known here; did you mean 'Hz'\?"),
        ("210 Gpa", "pressure", r"'Gpa' is not a unit known here; did you mean 'GPa'\?"),
        ("3 bananas", "mass", r"'bananas' is not a unit known here; write for example '105 kg'"),
        ("um", "length", r"'um' does not begin with a number; write for example '280 um'"),
        ("", "length", r"'' does not begin with a number"),
        ("nan m", "length", r"'nan m' does not begin with a number"),
        ("1e999 m", "length", r"'1e999 m' is too large to be a length"),
        ("3 m; 4", "length", r"'m; 4' is not a unit known here"),
        ("3 m + 4 mm", "length", r"'m \+ 4 mm' is not a unit known here"),
        ("1e9 N/m^3", "contact_stiffness", r"'1e9 N/m\^3' is not .*; write N/m\^n with n from 1 to 2"),
        (True, "length", r"True is not a length; write a number with a unit, '280 um'"),
        (None, "mass", r"None is not a mass"),
        ("3 red", "colour", r"kind of quantity is 'colour'; expected one of length, mass"),
        *((f"1 {unit}", "length", "write for example '280 um'") for unit in ENDLESS),
        ("٣ m", "length", "does not begin with a number"),
    ],
)
def test_refusal_names_the_value_and_the_way_out(text, kind, message):
    with pytest.raises(UsageError, match=message):
        parse_quantity(text, kind)


@pytest.mark.parametrize("kind", KINDS)
def test_the_example_of_each_kind_is_accepted_and_one_si_unit_is_one(kind):
    assert math.isfinite(parse_quantity(KINDS[kind].example, kind))
    if unit := KINDS[kind].unit.replace("^n", "^1.5"):
        assert parse_quantity(f"1 {unit}", kind) == pytest.approx(1.0, rel=1e-12)


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=20) | st.from_regex(r"\A-?[0-9]{1,3}(e[0-9])? ?[a-zA-Z/^*()0-9 .+-]{0,12}\Z"))
def test_any_text_gives_a_finite_number_or_a_usage_error(text):
    for kind in ("length", "speed", "contact_stiffness", "dimensionless"):
        try:
            value = parse_quantity(text, kind)
        except UsageError:
            continue
        assert math.isfinite(value)


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (280e-6, "length", "280 µm"),
        (0.99996e-3, "length", "1.00 mm"),
        (1.115523, "length", "1.12 m"),
        (0.0, "length", "0 m"),
        (2 * math.pi * 60, "speed", "60.0 Hz (3600 rpm)"),
        (60.0, "frequency", "60.0 Hz"),
        (7000.0, "frequency", "7.00 kHz"),
        (1.66e9, "pressure", "1660 MPa"),
        (1e8, "stiffness", "100 MN/m"),
        (0.0, "force", "0 N"),
        (-513.2, "force", "-513 N"),
        (12345.0, "force", "12.3 kN"),
        (math.pi / 4, "angle", "45.0°"),
        (5e-5, "unbalance", "50.0 g mm"),
        (0.15, "dimensionless", "0.150"),
        (3.2e-10, "length", "3.20e-4 µm"),
        (math.nan, "length", "nan m"),
    ],
)
def test_a_value_is_written_as_engineers_read_it(value, kind, text):
    assert format_quantity(value, kind) == text


@given(st.floats(1e-9, 1e3), st.sampled_from(["length", "mass", "velocity", "angle", "unbalance", "time"]))
@settings(max_examples=100, deadline=None)
def test_what_is_written_reads_back(value, kind):
    text = format_quantity(value, kind, digits=6)
    assert parse_quantity(text, kind) == pytest.approx(value, rel=1e-5)


WRITTEN = {
    format_moment: {-0.00002: "0 ms", -0.00006: "−0.1 ms", 0.21449: "214.5 ms", 57.1: "57.1 s"},
    format_chance: {1.0: "> 99 %", 0.996: "> 99 %", 0.93: "93 %", 0.006: "1 %", 0.005: "< 1 %", 0.0: "< 1 %"},
    format_amount: {0.0: "0", 127.6: "128", 1111.0: "1110", 9.36e-14: "< 0.001", 0.0993: "0.0993"},
}


@pytest.mark.parametrize("function", WRITTEN)
def test_moments_chances_and_factors_are_written_as_one_says_them(function):
    assert {number: function(number) for number in WRITTEN[function]} == WRITTEN[function]


@pytest.mark.parametrize("gravity", [GRAVITY, 1.62])
def test_a_fall_takes_as_long_and_ends_as_fast_as_gravity_makes_it(gravity):
    took, speed = fall_time(2e-4, gravity), fall_speed(2e-4, gravity)
    assert 0.5 * gravity * took**2 == pytest.approx(2e-4, rel=1e-14)
    assert speed == pytest.approx(gravity * took, rel=1e-14)
