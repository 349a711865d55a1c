"""Speed and times of a case: texts with units, floats in SI units, and nothing in between."""

import math
from dataclasses import replace

import pytest

from rotordrop import DropCase, example_machine
from rotordrop.errors import UsageError


def test_texts_are_read_with_their_units():
    case = DropCase(speed="3600 rpm", duration="50 ms", output_step="10 us")
    assert case.speed == pytest.approx(2.0 * math.pi * 60.0)
    assert (case.duration, case.output_step) == pytest.approx((0.05, 1e-5))
    assert replace(case, speed=1.5).speed == 1.5
    assert DropCase(speed=0).speed == 0.0


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (60, r"speed = 60 has no unit; write '60 Hz' or '60 rpm'"),
        ("60", "'60' has no unit; a speed needs one, for example '60 Hz'"),
        ("60 mm", "'60 mm' is not a speed"),
        (None, r"speed is None; expected a text such as '60 Hz', or a number \[rad/s\]"),
    ],
)
def test_a_number_nobody_said_the_unit_of_is_refused(value, message):
    with pytest.raises(UsageError, match=message):
        DropCase(speed=value)


def test_values_of_a_machine_may_be_texts():
    machine = example_machine("small")
    changed = machine.with_values({"NDE.air_gap": "200 um"})
    assert changed.bearing("NDE").air_gap.value == pytest.approx(2e-4)
    with pytest.raises(UsageError, match="'350' has no unit; a length needs one"):
        machine.with_values({"NDE.air_gap": "350"})


def test_a_machine_is_shown_in_one_line():
    assert repr(example_machine("paper")).startswith("<Machine ")
    assert len(repr(example_machine("paper"))) < 300
