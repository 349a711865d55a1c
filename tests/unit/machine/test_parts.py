"""Rotor, unbalance, contact, race, supports and magnets: what follows from what."""

import math

import pytest

from rotordrop.elements.contact import palmgren_stiffness
from rotordrop.elements.unbalance import BalanceGrade
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, loads_machine


def test_mass_and_centre_of_gravity_of_a_simple_rotor(small_text):
    rotor = loads_machine(small_text).rotor
    ends = 2 * 7850 * math.pi / 4 * 0.06**2 * 0.2
    core = 7850 * math.pi / 4 * (0.08**2 - 0.02**2) * 0.4
    assert rotor.mass == pytest.approx(ends + core + 5.0, rel=1e-12)
    assert rotor.centre_of_gravity == pytest.approx(0.4, abs=1e-12)


def test_sections_by_node_and_by_length_make_the_same_rotor(small_text):
    by_nodes = small_text.replace(
        "[rotor]",
        '[rotor]\nnode_positions = { unit = "m", values = [0, .1, .2, .3, .4, .5, .6, .7, .8] }'.replace(
            " .", " 0."
        ),
        1,
    )
    for length, nodes in (("0.2 m", "[1, 3]"), ("0.4 m", "[3, 7]"), ("0.2 m", "[7, 9]")):
        count = 4 if length == "0.4 m" else 2
        by_nodes = by_nodes.replace(f'length = "{length}"\nelements = {count}', f"nodes = {nodes}", 1)
    one, other = loads_machine(small_text).rotor, loads_machine(by_nodes).rotor
    assert other.node_positions == pytest.approx(one.node_positions, abs=1e-15)
    assert [e.outer_diameter for e in other.elements] == [e.outer_diameter for e in one.elements]
    assert other.mass == pytest.approx(one.mass, rel=1e-12)


def test_steel_is_known_but_mentioned(small_text):
    machine = loads_machine(small_text)
    assert machine.rotor.elements[0].youngs_modulus == 210e9
    assert ("rotor.materials.steel", "210 GPa, 7850 kg/m³", "no material 'steel' is described") in (
        machine.defaults_in_use
    )


@pytest.mark.parametrize("written", ['"G 2.5"', '"2.5 mm/s"', "2.5", '"G2.5"'])
def test_a_balance_grade_shares_its_unbalance_by_weight(changed, written):
    text = changed(("[rotor]", f'[balance_grade]\ngrade = {written}\nat_speed = "100 Hz"\n\n[rotor]'))
    machine = loads_machine(text)
    total = 2.5e-3 * machine.rotor.mass / (2 * math.pi * 100)
    amounts = [float(u.amount) for u in machine.unbalances]
    assert [u.node for u in machine.unbalances] == [2, 8]
    assert sum(amounts) == pytest.approx(total, rel=1e-12)
    moment = sum(
        a * machine.rotor.node_positions[u.node - 1] for a, u in zip(amounts, machine.unbalances, strict=True)
    )
    assert moment / total == pytest.approx(machine.rotor.centre_of_gravity, rel=1e-12)
    for unbalance in machine.unbalances:
        assert (unbalance.amount.status, unbalance.phase.status) == ("inferred", "inferred")
        assert unbalance.phase.range == pytest.approx((-math.pi, math.pi))
        assert "says nothing of the phase" in unbalance.phase.source


def test_an_unbalance_by_amount_goes_before_the_grade(changed):
    grade = '[balance_grade]\ngrade = 1\nat_speed = "100 Hz"\n\n'
    own = '[[unbalances]]\nnode = 5\namount = "20 g mm"\nphase = "30 deg"\n\n[rotor]'
    (unbalance,) = loads_machine(changed(("[rotor]", grade + own))).unbalances
    assert float(unbalance.amount) == pytest.approx(20e-6)
    assert float(unbalance.phase) == pytest.approx(math.radians(30.0))


def test_the_grade_planes_are_the_magnets_where_there_are_two():
    assert [u.node for u in example_machine("lp400").unbalances] == [8, 22]
    assert sum(float(u.amount) for u in example_machine("lp400").unbalances) == pytest.approx(1.717e-5)


def test_a_grade_without_a_number_is_refused():
    with pytest.raises((UsageError, ValueError), match=r"grade = \[1\] is not a balance grade"):
        BalanceGrade.model_validate({"grade": [1], "at_speed": "100 Hz"})


def test_palmgren_line_contact():
    """δ = 3.84e-5 Q^0.9 / l^0.8 (mm, N): K = 1.34438e9 for 10 mm and 3.78e9 N/m^(10/9) for 32 mm."""
    assert palmgren_stiffness(0.010) == pytest.approx(1344376343.7, rel=1e-9)
    assert palmgren_stiffness(0.032) == pytest.approx(3.78e9, rel=1e-3)


def test_a_contact_length_gives_the_stiffness(changed):
    text = changed(
        (
            'bearing = { designation = "XCB71914-E" }',
            'bearing = { designation = "XCB71914-E" }\ncontact.length = "25 mm"',
        )
    )
    contact = loads_machine(text).touchdown_bearings[0].contact
    assert float(contact.stiffness) == pytest.approx(3035605380.78, rel=1e-9)
    assert contact.stiffness.status == "inferred"


def test_the_race_is_inferred_from_the_size_of_the_bearing(small_text):
    bearing = loads_machine(small_text).touchdown_bearings[0]
    outer, inner = 0.5 * (0.085 - 0.6 * 0.009525), 0.03025
    mass = 7800 * math.pi * (outer**2 - inner**2) * 2 * 0.016
    assert float(bearing.race.mass) == pytest.approx(mass, rel=1e-12)
    assert float(bearing.race.inertia) == pytest.approx(0.5 * mass * (outer**2 + inner**2), rel=1e-12)
    assert bearing.race.mass.status == "inferred"
    assert bearing.race.mass.range == pytest.approx((mass / 1.25, mass * 1.25))
    spread = math.exp(math.hypot(math.log(1.25), math.log(1.3)))
    assert bearing.race.inertia.range[1] == pytest.approx(float(bearing.race.inertia) * spread)


def test_the_inferred_inertia_follows_a_given_mass(small_text):
    machine = loads_machine(small_text)
    twice = machine.with_values({"NDE.race.mass": 2 * float(machine.touchdown_bearings[0].race.mass)})
    inertia = twice.touchdown_bearings[0].race.inertia
    assert float(inertia) == pytest.approx(2 * float(machine.touchdown_bearings[0].race.inertia), rel=1e-12)
    assert inertia.range[1] == pytest.approx(1.3 * float(inertia))


def test_magnets_without_stiffness_give_the_rotor_40_hz(changed):
    text = changed(
        ("[[sensors]]", '[[ambs]]\nname = "N"\nnode = 2\n\n[[ambs]]\nname = "D"\nnode = 8\n\n[[sensors]]'),
    )
    machine = loads_machine(text)
    stiffness = sum(float(amb.stiffness) for amb in machine.ambs)
    assert math.sqrt(stiffness / machine.rotor.mass) / (2 * math.pi) == pytest.approx(40.0, rel=1e-12)
    damping = sum(float(amb.damping) for amb in machine.ambs)
    assert damping / (2 * math.sqrt(stiffness * machine.rotor.mass)) == pytest.approx(0.3, rel=1e-12)
    assert {amb.stiffness.status for amb in machine.ambs} == {"default"}


def test_sensors_belong_to_the_nearest_bearing(small_text):
    assert [s.bearing for s in loads_machine(small_text).sensors] == ["NDE", "NDE", "DE", "DE"]


def test_every_default_says_why():
    for name in ("paper", "lp400"):
        machine = example_machine(name)
        for path, value, why in (*machine.defaults_in_use, *machine.inferred):
            assert path
            assert value
            assert len(why) > 8, path


def test_defaults_shared_by_all_sensors_are_mentioned_once():
    paths = [path for path, _, _ in example_machine("paper").defaults_in_use]
    assert paths.count("sensors.*.gain") == 1
    assert len(paths) == len(set(paths))


def test_a_stiffness_with_another_exponent_needs_that_exponent(changed):
    point = 'contact = { stiffness = "1e10 N/m^1.5", exponent = 1.5 }'
    text = changed(('air_gap = "250 um"', f'air_gap = "250 um"\n{point}'))
    assert float(loads_machine(text).touchdown_bearings[0].contact.exponent) == 1.5


def test_a_bearing_is_found_by_name():
    machine = example_machine("paper")
    assert machine.bearing("DE").node == 26
    with pytest.raises(UsageError, match="no touchdown bearing 'XE'; there are NDE, DE"):
        machine.bearing("XE")


def test_descriptions_are_frozen():
    machine = example_machine("paper")
    with pytest.raises(ValueError, match="frozen"):
        machine.touchdown_bearings[0].air_gap = None
