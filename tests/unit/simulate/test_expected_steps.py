"""What a drop costs is known before it is simulated, and why."""

import pytest

from rotordrop.machine import example_machine
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.expected_steps import MANY_STEPS, expected_steps

SLOW = {
    "damping time": ({"NDE.damping_time": 1e-3}, "the bearing damping of NDE on the mass of its race"),
    "support mass": ({"DE.support.mass": 1e-3}, "the bearing damping of DE on the mass of its support"),
    "race inertia": ({"NDE.race.inertia": 1e-7}, "friction on the inertia of NDE's race"),
}


@pytest.mark.parametrize(("values", "cause"), SLOW.values(), ids=SLOW)
def test_the_cause_is_named_and_the_steps_are_as_many_as_are_taken(values, cause):
    machine = example_machine("paper").with_values(values)
    expected = expected_steps(machine, 0.01)
    assert expected.cause.startswith(cause)
    taken = simulate_drop(machine, DropCase(speed=377.0, duration=0.01, reduction="quick")).steps
    assert 0.2 * taken < expected.steps < 2.0 * taken


@pytest.mark.parametrize("name", ["paper", "small"])
def test_an_ordinary_drop_is_far_from_a_warning(name):
    assert expected_steps(example_machine(name), 0.2).steps < 0.02 * MANY_STEPS
