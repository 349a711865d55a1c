"""Pendulum cases: small swings in the clearance circle, exact period of large ones."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pytest
from cases import Compute, check, checks_of, load_case
from tests.reference.closed_forms import period

from rotordrop.physics.pendulum import period_ratio, small_frequency

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]


def small_swing(inputs: Inputs) -> dict[str, float]:
    return {f"f0 at c={c * 1e6:.0f} um": float(small_frequency(c, inputs["g"])) for c in inputs["c"]}


def large_swing(inputs: Inputs) -> dict[str, float]:
    quarter_turn = float(period(0.5, math.radians(90.0), inputs["g"]))
    ratios = {f"T/T0 at {deg} deg": float(period_ratio(math.radians(deg))) for deg in (10, 30, 45, 90)}
    return ratios | {"period l=0.5 m, 90 deg": quarter_turn, "Code_Aster V5.02.100 value": quarter_turn}


CASES: dict[str, Compute] = {"P01": small_swing, "P02a": large_swing}


test_case, test_a_changed_input_is_noticed = checks_of(CASES, [(name, {"g": 9.8101}) for name in CASES])


def test_small_swing_formula_fails_the_large_swing() -> None:
    case = load_case("P02a")
    numbers = large_swing(case.inputs) | {"T/T0 at 10 deg": 1.0}
    with pytest.raises(AssertionError, match=r"T/T0 at 10 deg: 1 -, expected 1\.0019"):
        check(case, numbers)
