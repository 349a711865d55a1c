"""One verdict line: limits kept, passed, open, or none given."""

from __future__ import annotations

import pytest
from tests.published import bearing, published, value

from rotordrop.errors import UsageError
from rotordrop.report.compared_drop import ComparedDrop
from rotordrop.report.limits import limit_statement, read_limits


def drop(name, stress, half, safety=8.0):
    numbers = {
        "peak_stress_Pa": value(stress, stress - half, stress + half),
        "severity.static_safety": value(safety, safety - 0.1, safety + 0.1),
    }
    return ComparedDrop(name, published(bearings={"NDE": bearing(numbers)}))


DROPS = (drop("a", 1.9e9, 2e7), drop("b", 2.0e9, 2e7, safety=2.0))


def test_without_limits_it_says_so():
    assert limit_statement(DROPS, {}).text.startswith("No limit given")


@pytest.mark.parametrize(
    ("limit", "level", "text"),
    [
        ("2.2 GPa", "good", "kept by all drops (passed by b at NDE with 0.0 % at most)"),
        ("1.95 GPa", "bad", "passed by b at NDE (> 99 %)"),
        ("2 GPa", "warning", "open, passed by b at NDE with a probability of 50 %"),
    ],
)
def test_a_limit_on_the_stress(limit, level, text):
    said = limit_statement(DROPS, read_limits([f"peak_stress={limit}"]))
    assert said.level == level and text in said.text


def test_a_safety_factor_is_passed_from_above():
    said = limit_statement(DROPS, read_limits(["static_safety = 3"]))
    assert "passed by b at NDE (> 99 %)" in said.text and "passed by a" not in said.text


def test_the_number_of_drops_is_counted():
    assert limit_statement(DROPS, {}, 5).level == "good"
    said = limit_statement(DROPS, {}, 1)
    assert said.level == "bad" and "2 of 1 drops allowed" in said.text


def test_what_is_no_limit_is_refused():
    with pytest.raises(UsageError, match=r"did you mean 'peak_stress'"):
        read_limits(["peak_strss=2 GPa"])
    with pytest.raises(UsageError, match=r"expected a number and its limit"):
        read_limits(["peak_stress"])
    with pytest.raises(UsageError, match=r"2 kN"):
        read_limits(["peak_stress=2 kN"])
