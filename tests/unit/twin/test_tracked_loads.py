"""Intervals of forces and stresses: how wide, in which parts, and what they hold beside."""

from __future__ import annotations

import pytest

from rotordrop.known import NINETY
from rotordrop.twin.tracked_loads import widened_to, with_interval


def test_a_magnitude_has_no_interval_below_zero() -> None:
    assert with_interval(100.0, 200.0).interval_90 == pytest.approx((0.0, 100.0 + NINETY * 200.0))
    assert with_interval(-5.0, 1.0).interval_90 == pytest.approx((-5.0 - NINETY, -5.0 + NINETY))
    held = widened_to(with_interval(100.0, 10.0), 3.0, 0.15).interval_90
    assert held == pytest.approx((100.0 - NINETY * 10.0, 345.0))


def test_what_the_model_leaves_out_is_a_part_of_the_interval() -> None:
    known = with_interval(100.0, 5.0, 2.0, "N", left_out=3.0)
    assert known.allowance_90 == pytest.approx(2.0 * NINETY * 3.0)
    assert with_interval(100.0, 5.0).allowance_90 is None
    assert widened_to(known, 3.0, 0.15).allowance_90 is None  # the cross-check made it as wide as it is
