"""Numbers of the paper that any implementation should reproduce or flag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest
from cases import Compute, check, load_case

from rotordrop.machine import example_machine
from rotordrop.rotor.statics import bearing_load_shares

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]


def static_loads(inputs: Inputs) -> dict[str, float]:
    """Weight shares of the example machine's finite-element rotor, in the order of its bearings."""
    machine = example_machine(inputs["machine"])
    shares = bearing_load_shares(machine) / float(machine.gravity) * inputs["g"]
    return {
        f"static load {b.name}": float(s) for b, s in zip(machine.touchdown_bearings, shares, strict=True)
    }


CASES: dict[str, Compute] = {"X01": static_loads}


def test_case() -> None:
    case = load_case("X01")
    check(case, static_loads(case.inputs))


def test_perturbed_gravity_fails_the_case() -> None:
    case = load_case("X01").with_inputs(g=9.80665)
    with pytest.raises(AssertionError, match=r"X01 .*\n.*static load NDE.*tolerance 1e-06"):
        check(case, static_loads(case.inputs))


def test_printed_loads_one_agrees_and_one_is_flagged() -> None:
    """The paper prints 409 N and 177 N for mass shares of 41.7 and 17.8 kg: the second contradicts itself."""
    expected = {e.name: e for e in load_case("X01").expected}
    assert expected["static load DE"].holds(409.0)
    assert not expected["static load NDE"].holds(177.0)
    assert expected["static load NDE"].deviation(177.0) == pytest.approx(0.0136, abs=5e-4)
