"""How many modes a rotor gets: by the frequency of its contact, not by a constant."""

import math
from pathlib import Path

import pytest

from rotordrop.machine import example_machine, load_machine
from rotordrop.rotor.assembly import build_rotor_fe, free_free_modes
from rotordrop.rotor.reduction import contact_frequency, reduction_for_contact

LONG = Path(__file__).parents[2] / "machines" / "long_rotor.toml"
NAMES = ("NDE", "DE")


@pytest.mark.parametrize(("name", "coarse"), [("lp400", 6), ("small", 6), ("long", 7)])
def test_the_modes_reach_beyond_the_contact(name, coarse):
    machine = load_machine(LONG) if name == "long" else example_machine(name)
    assert reduction_for_contact(machine, least=2, reach=1e-3).modes == 3
    basis = reduction_for_contact(machine, least=6, reach=2.25)
    assert basis.modes == coarse
    frequency = free_free_modes(build_rotor_fe(machine)).frequency
    assert frequency[basis.modes - 1] >= 2.25 * contact_frequency(machine)


def test_a_contact_four_times_as_stiff_is_less_than_twice_as_fast():
    """The balls stand in series with it."""
    machine = example_machine("lp400")
    stiff = {f"{n}.contact.stiffness": 4.0 * float(machine.bearing(n).contact.stiffness) for n in NAMES}
    assert 1.0 < contact_frequency(machine.with_values(stiff)) / contact_frequency(machine) < 2.0


def test_the_frequency_is_that_of_two_masses_on_a_spring():
    """Of a very light support only its own mass counts: a quarter of it swings twice as fast."""
    machine = example_machine("lp400")
    light, lighter = (
        contact_frequency(machine.with_values({f"{n}.support.mass": mass for n in NAMES}))
        for mass in (4e-3, 1e-3)
    )
    assert lighter / light == pytest.approx(math.sqrt(4.0), rel=1e-3)
    assert light > contact_frequency(machine)
