"""The cross-coupled stiffness that a rotor bears, against the closed form of a rigid rotor."""

import math

import numpy as np
import pytest

from rotordrop.elements.rotor import Rotor
from rotordrop.machine import example_machine
from rotordrop.rotor.assembly import rotor_fe
from rotordrop.rotor.campbell import stability_map, stability_of
from rotordrop.rotor.suspension import spring

STIFFNESS, DAMPING = 1e5, 30.0


@pytest.fixture(scope="module")
def rigid():
    """A cylinder that is 10,000 times stiffer than its springs."""
    return rotor_fe(
        Rotor.model_validate(
            {
                "material": "steel",
                "modal_damping": 0.0,
                "materials": {
                    "steel": {
                        "youngs_modulus": "206 GPa",
                        "poisson_ratio": 0.3,
                        "density": "7850 kg/m^3",
                    }
                },
                "sections": [{"length": "500 mm", "elements": 4, "outer_diameter": "200 mm"}],
            }
        )
    )


@pytest.mark.parametrize("damping", [DAMPING, 4.0 * DAMPING])
def test_a_rigid_rotor_bears_the_damping_of_its_springs_times_its_frequency(rigid, damping):
    """-m ω² + 2 k + i (2 c ω - q) = 0 at the limit, so q = 2 c ω with ω² = 2 k / m."""
    supports = [spring(node, STIFFNESS, damping) for node in (1, 5)]
    found = stability_of(rigid, 500.0, supports, 3)
    expected = 2.0 * damping * math.sqrt(2.0 * STIFFNESS / rigid.total_mass)
    assert found.limit == pytest.approx(expected, rel=1e-3)
    assert np.interp(found.limit, found.coupling, found.decrement) == pytest.approx(0.0, abs=1e-3)


def test_against_the_spin_it_is_the_backward_whirl_that_is_driven(rigid):
    """The limit of a rotor that does not turn is the same: only its direction differs."""
    supports = [spring(node, STIFFNESS, DAMPING) for node in (1, 5)]
    turning, still = (stability_of(rigid, speed, supports, 3).limit for speed in (500.0, 0.0))
    assert still == pytest.approx(turning, rel=1e-3)


def test_the_map_of_a_machine_begins_at_its_own_damping_and_ends_unstable():
    found = stability_map(example_machine("small"))
    assert found.suspension == "AMBs"
    assert found.decrement[0] > 0.0 > found.decrement[-1]
    assert 0.0 < found.limit < found.coupling[-1]
