"""The machines that ship with rotordrop say what their sources say."""

import math

import pytest

from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, load_machine
from rotordrop.machine.examples import example_path


@pytest.fixture(scope="module", params=["paper", "lp400"])
def machine(request):
    return example_machine(request.param)


def test_the_rotor_has_the_published_mass_and_shares(machine):
    assert machine.rotor.mass == pytest.approx(59.49996, abs=2e-6)
    left, right = (machine.rotor.node_positions[b.node - 1] for b in machine.touchdown_bearings)
    far = machine.rotor.mass * (machine.rotor.centre_of_gravity - left) / (right - left)
    assert far == pytest.approx(41.7, abs=0.05)
    assert machine.rotor.mass - far == pytest.approx(17.8, abs=0.05)


def test_elements_join_neighbouring_nodes(machine):
    rotor = machine.rotor
    assert len(rotor.elements) == len(rotor.node_positions) - 1 == 35
    ends = [z + e.length for z, e in zip(rotor.node_positions, rotor.elements, strict=False)]
    assert ends == pytest.approx(rotor.node_positions[1:], abs=1e-15)


def test_layers_sit_on_laminations_and_magnets_only(machine):
    parts = {e.part for e in machine.rotor.elements if e.layer_diameter is not None}
    assert parts == {"NDE AMB laminations", "DE AMB laminations", "generator core + magnets/band"}


def test_node_positions_are_those_of_the_paper_to_the_micrometre(machine):
    assert machine.rotor.node_positions[3] == pytest.approx(0.07, abs=1e-15)
    assert machine.rotor.node_positions[25] == pytest.approx(0.856591, abs=1e-15)
    assert machine.rotor.node_positions[-1] == pytest.approx(1.115523, abs=1e-15)


def test_reference_machine_bearings():
    nde, de = example_machine("paper").touchdown_bearings
    assert (nde.name, nde.node, de.name, de.node) == ("NDE", 4, "DE", 26)
    assert float(nde.air_gap) == pytest.approx(275e-6, abs=1e-18)
    assert float(de.air_gap) == pytest.approx(285e-6, abs=1e-18)
    assert float(nde.support.stiffness) == 1e8
    assert float(de.support.stiffness) == 4e8
    assert float(de.support.damping) == pytest.approx(2 * 0.025 * math.sqrt(4e8 * 40.0), rel=1e-14)
    assert float(nde.bearing.preload) == 530.0
    assert float(nde.contact.stiffness) == 8.3e8
    assert float(nde.contact.exponent) == pytest.approx(10 / 9, rel=1e-15)


def test_the_owner_of_the_recorded_machine_knows_friction_as_a_range_only():
    friction = example_machine("lp400").touchdown_bearings[0].friction
    assert friction.dynamic.status == "guess"
    assert friction.dynamic.range == (0.05, 0.2)
    assert friction.static.range == pytest.approx((0.065, 0.26))


def test_sensors_of_the_recorded_machine_sit_inboard():
    sensors = example_machine("lp400").sensors
    assert [s.name for s in sensors] == ["S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B"]
    assert [s.node for s in sensors] == [5, 5, 25, 25]
    assert [round(math.degrees(float(s.angle))) for s in sensors] == [135, 45, 135, 45]
    assert {float(s.sensitivity) for s in sensors} == {8000.0}


def test_the_path_of_the_file_is_known():
    assert example_machine("paper").source_path == example_path("paper")
    assert load_machine(example_path("paper")) == example_machine("paper")


def test_an_unknown_example_names_those_there_are():
    with pytest.raises(UsageError, match="no example machine 'paber'; there are paper, lp400"):
        example_machine("paber")
