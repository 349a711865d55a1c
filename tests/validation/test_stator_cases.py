"""Contact of rotor and housing beside the touchdown bearings, by `simulate_drop`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of
from rigid_machine import rigid_model

from rotordrop.simulate.case import CentredStart, DropCase
from rotordrop.simulate.drop import simulate_drop

pytestmark = pytest.mark.acceptance


def sealed(v: Mapping[str, Any]) -> dict[str, float]:
    """Peak forces of the log, from the accepted steps."""
    seal = (
        f'[[clearances]]\nname = "seal"\nnode = 2\ngap = "{v["seal_gap"]} m"\n'
        f'stiffness = "{v["seal_stiffness"]} N/m"\nfriction = 0.0\ndamping = "0 s/m"'
    )
    case = DropCase(
        speed=0.0, duration=0.01, output_step=1e-5, tolerance=1e-9, largest_step=2e-5, start=CentredStart()
    )
    drop = simulate_drop(rigid_model(dict(v), more=seal), case)
    rub = drop.contacts_at("seal")
    assert rub is not None
    return {
        "peak force on the touchdown bearing": float(np.max(drop.contacts.peak_force)),
        "peak force on the seal": float(np.max(rub.peak_force)),
    }


CASES: dict[str, Compute] = {"ST01": sealed}

test_case, test_a_changed_input_is_noticed = checks_of(
    CASES,
    [
        ("ST01", {"seal_gap": 2.705e-4}),
        ("ST01", {"seal_stiffness": 4.05e7}),
        ("ST01", {"c": 2.51e-4}),
    ],
)
