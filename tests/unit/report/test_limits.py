"""One verdict line: limits kept, passed, open, or none given."""

import pytest
from tests.published import bearing, published, value

from rotordrop.errors import UsageError
from rotordrop.report.compare_page import ComparedDrop, limit_statement, read_limits


def drop(name, stress, half, safety=8.0):
    numbers = {
        "peak_stress_Pa": value(stress, stress - half, stress + half),
        "severity.static_safety": value(safety, safety - 0.1, safety + 0.1),
    }
    return ComparedDrop(name, published(bearings={"NDE": bearing(numbers)}))


DROPS = (drop("a", 1.9e9, 2e7), drop("b", 2.0e9, 2e7, safety=2.0))


@pytest.mark.parametrize(
    ("limits", "level", "text"),
    [
        ([], "notice", "No limit given"),
        (["peak_stress=2.2 GPa"], "good", "kept by all drops (passed by b at NDE with 0.0 % at most)"),
        (["peak_stress=1.95 GPa"], "bad", "passed by b at NDE (> 99 %)"),
        (["peak_stress=2 GPa"], "warning", "open, passed by b at NDE with a probability of 50 %"),
        (["static_safety = 3"], "bad", "passed by b at NDE (> 99 %)"),  # from above
    ],
)
def test_limits_are_kept_passed_open_or_not_given(limits, level, text):
    said = limit_statement(DROPS, read_limits(limits))
    assert said.level == level and text in said.text and "passed by a" not in said.text


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ("peak_strss=2 GPa", r"did you mean 'peak_stress'"),
        ("peak_stress", r"expected a number and its limit"),
        ("peak_stress=2 kN", r"2 kN"),
    ],
)
def test_what_is_no_limit_is_refused(limit, message):
    with pytest.raises(UsageError, match=message):
        read_limits([limit])
