"""Rotor, unbalance, contact, race, supports, magnets and controllers: what follows from what."""

import json
import math
import re

import pytest
from tests.unit.simulate.looped import CONTROLLER, MAGNET, looped_machine

from rotordrop.cli.app import run
from rotordrop.elements.contact import palmgren_stiffness
from rotordrop.elements.unbalance import BalanceGrade
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, loads_machine
from rotordrop.machine.saving import machine_text, save_machine


def test_mass_centre_and_sections_of_a_simple_rotor(small_text):
    rotor = loads_machine(small_text).rotor
    ends = 2 * 7850 * math.pi / 4 * 0.06**2 * 0.2
    core = 7850 * math.pi / 4 * (0.08**2 - 0.02**2) * 0.4
    assert rotor.mass == pytest.approx(ends + core + 5.0, rel=1e-12)
    assert rotor.centre_of_gravity == pytest.approx(0.4, abs=1e-12)
    by_nodes = small_text.replace(
        "[rotor]",
        '[rotor]\nnode_positions = { unit = "mm", values = [0, 100, 200, 300, 400, 500, 600, 700, 800] }',
        1,
    )
    for length, nodes in (("0.2 m", "[1, 3]"), ("0.4 m", "[3, 7]"), ("0.2 m", "[7, 9]")):
        count = 4 if length == "0.4 m" else 2
        by_nodes = by_nodes.replace(f'length = "{length}"\nelements = {count}', f"nodes = {nodes}", 1)
    one, other = loads_machine(small_text).rotor, loads_machine(by_nodes).rotor
    assert other.node_positions == pytest.approx(one.node_positions, abs=1e-15)
    assert [e.outer_diameter for e in other.elements] == [e.outer_diameter for e in one.elements]
    assert other.mass == pytest.approx(one.mass, rel=1e-12)


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


def test_a_grade_acts_in_the_magnets_gives_way_to_an_amount_and_needs_a_number(changed):
    grade = '[balance_grade]\ngrade = 1\nat_speed = "100 Hz"\n\n'
    own = '[[unbalances]]\nnode = 5\namount = "20 g mm"\nphase = "30 deg"\n\n[rotor]'
    (unbalance,) = loads_machine(changed(("[rotor]", grade + own))).unbalances
    assert float(unbalance.amount) == pytest.approx(20e-6)
    assert float(unbalance.phase) == pytest.approx(math.radians(30.0))
    assert [u.node for u in example_machine("lp400").unbalances] == [8, 22]
    assert sum(float(u.amount) for u in example_machine("lp400").unbalances) == pytest.approx(1.717e-5)
    with pytest.raises((UsageError, ValueError), match=r"grade = \[1\] is not a balance grade"):
        BalanceGrade.model_validate({"grade": [1], "at_speed": "100 Hz"})


def test_a_contact_has_the_stiffness_of_palmgren_for_its_length_or_its_exponent(changed):
    """δ = 3.84e-5 Q^0.9 / l^0.8 (mm, N): K = 1.34438e9 for 10 mm and 3.78e9 N/m^(10/9) for 32 mm."""
    assert palmgren_stiffness(0.010) == pytest.approx(1344376343.7, rel=1e-9)
    assert palmgren_stiffness(0.032) == pytest.approx(3.78e9, rel=1e-3)
    text = changed(
        (
            'bearing = { designation = "XCB71914-E" }',
            'bearing = { designation = "XCB71914-E" }\ncontact.length = "25 mm"',
        )
    )
    contact = loads_machine(text).touchdown_bearings[0].contact
    assert float(contact.stiffness) == pytest.approx(3035605380.78, rel=1e-9)
    assert contact.stiffness.status == "inferred"
    point = 'contact = { stiffness = "1e10 N/m^1.5", exponent = 1.5 }'
    text = changed(('air_gap = "250 um"', f'air_gap = "250 um"\n{point}'))
    assert float(loads_machine(text).touchdown_bearings[0].contact.exponent) == 1.5


def test_the_race_is_inferred_from_the_size_of_the_bearing_and_its_inertia_follows_a_mass(small_text):
    bearing = loads_machine(small_text).touchdown_bearings[0]
    outer, inner = 0.5 * (0.085 - 0.6 * 0.009525), 0.03025
    mass = 7800 * math.pi * (outer**2 - inner**2) * 2 * 0.016
    assert float(bearing.race.mass) == pytest.approx(mass, rel=1e-12)
    assert float(bearing.race.inertia) == pytest.approx(0.5 * mass * (outer**2 + inner**2), rel=1e-12)
    assert bearing.race.mass.status == "inferred"
    assert bearing.race.mass.range == pytest.approx((mass / 1.25, mass * 1.25))
    spread = math.exp(math.hypot(math.log(1.25), math.log(1.3)))
    assert bearing.race.inertia.range[1] == pytest.approx(float(bearing.race.inertia) * spread)
    machine = loads_machine(small_text)
    twice = machine.with_values({"NDE.race.mass": 2 * float(machine.touchdown_bearings[0].race.mass)})
    inertia = twice.touchdown_bearings[0].race.inertia
    assert float(inertia) == pytest.approx(2 * float(machine.touchdown_bearings[0].race.inertia), rel=1e-12)
    assert inertia.range[1] == pytest.approx(1.3 * float(inertia))


def test_magnets_have_stiffness_and_damping_from_gains_or_by_default(changed):
    text = changed(
        ("[[sensors]]", '[[ambs]]\nname = "N"\nnode = 2\n\n[[ambs]]\nname = "D"\nnode = 8\n\n[[sensors]]')
    )
    machine = loads_machine(text)
    stiffness = sum(float(amb.stiffness) for amb in machine.ambs)
    assert math.sqrt(stiffness / machine.rotor.mass) / (2 * math.pi) == pytest.approx(40.0, rel=1e-12)
    damping = sum(float(amb.damping) for amb in machine.ambs)
    assert damping / (2 * math.sqrt(stiffness * machine.rotor.mass)) == pytest.approx(0.3, rel=1e-12)
    assert {amb.stiffness.status for amb in machine.ambs} == {"default"}
    amb = looped_machine().ambs[0]
    by_current, by_way = amb.magnet.slopes
    assert amb.stiffness.value == pytest.approx(by_current * 14600.0 - by_way)
    assert amb.damping.value == pytest.approx(30.0 * by_current)
    assert amb.magnet.current_limit.value == 4.0
    machine = looped_machine(controller={"sensor": "S_DE_A"})
    sensor = next(one for one in machine.sensors if one.name == "S_DE_A")
    assert machine.measured_node(machine.ambs[0]) == sensor.node != machine.ambs[0].node


def test_every_default_says_why_once(small_text):
    for name in ("paper", "lp400"):
        machine = example_machine(name)
        for path, value, why in (*machine.defaults_in_use, *machine.inferred):
            assert path
            assert value
            assert len(why) > 8, path
    paths = [path for path, _, _ in example_machine("paper").defaults_in_use]
    assert paths.count("sensors.*.gain") == 1
    assert len(paths) == len(set(paths))
    machine = loads_machine(small_text)
    assert machine.rotor.elements[0].youngs_modulus == 210e9
    assert ("rotor.materials.steel", "210 GPa, 7850 kg/m³", "no material 'steel' is described") in (
        machine.defaults_in_use
    )


def test_a_bearing_is_found_by_name_and_sensors_belong_to_the_nearest(small_text):
    machine = example_machine("paper")
    assert machine.bearing("DE").node == 26
    with pytest.raises(UsageError, match="no touchdown bearing 'XE'; there are NDE, DE"):
        machine.bearing("XE")
    assert [s.bearing for s in loads_machine(small_text).sensors] == ["NDE", "NDE", "DE", "DE"]


def test_a_part_may_stand_between_nodes_where_none_is_given_by_its_node(small_text):
    """The rotor gets a node there and stays the same; numbers of nodes that a file gives would go astray."""
    by_node = loads_machine(small_text)
    nodes = by_node.rotor.node_positions
    text = re.sub(r"node = (\d+)", lambda found: f'position = "{nodes[int(found[1]) - 1]!r} m"', small_text)
    assert loads_machine(text).rotor.node_positions == pytest.approx(nodes)
    moved = loads_machine(text.replace('"0.7 m"', '"0.72 m"'))
    assert moved.rotor.node_positions == pytest.approx(sorted((*nodes, 0.72)))
    assert moved.rotor.mass == pytest.approx(by_node.rotor.mass, rel=1e-12)
    at = [moved.rotor.node_positions[one.node - 1] for one in (*moved.touchdown_bearings, *moved.rotor.discs)]
    assert at == pytest.approx([nodes[1], 0.72, nodes[4]])


STATE_SPACE = {
    "kind": "state_space",
    "a": [[1.0, 0.0], [0.5, 0.25]],
    "b": [1e-4, 1.0],
    "c": [3e5, -20.0],
    "d": 2e4,
}


def with_tables(magnet=None, controller=None):
    paper = example_machine("paper")
    tables = {"magnet": magnet, "controller": controller}
    return paper.changed(ambs=tuple(amb.changed(**tables) for amb in paper.ambs))


@pytest.mark.parametrize("controller", [CONTROLLER, STATE_SPACE])
def test_a_machine_with_a_loop_comes_back_from_its_file(controller):
    machine = with_tables(MAGNET, controller)
    assert loads_machine(machine_text(machine)) == machine


@pytest.mark.parametrize(
    ("magnet", "controller", "told"),
    [
        (None, CONTROLLER, "a controller needs its magnet"),
        (MAGNET, CONTROLLER | {"proportional": "7 kA/m"}, r"7.*kA/m does not hold .*k_s/k_i .* 7.27"),
        (MAGNET | {"gap": "0.25 mm"}, CONTROLLER | {"proportional": "40 kA/m"}, "gap of 250 µm, .* by 285"),
        (MAGNET, {"derivative": "3 A s/m"}, 'of kind "pid" needs a gain'),
        (MAGNET, CONTROLLER | {"a": [[1.0]]}, "'a' does not belong to a controller of kind 'pid'"),
        (MAGNET, STATE_SPACE | {"integral": "1 A/(m s)"}, "'integral' does not belong to .* 'state_space'"),
        (MAGNET, STATE_SPACE | {"b": [1.0]}, "a has 2 rows, b 1 and c 2 entries"),
        (MAGNET, CONTROLLER | {"delay": "400 us"}, "delay of 400 µs is longer than 7 sample times, 350 µs"),
        (MAGNET, CONTROLLER | {"sensor": "S9"}, "measures with sensor 'S9', which does not exist"),
        (MAGNET | {"turns": -3}, CONTROLLER, "must be positive"),
    ],
)
def test_tables_that_do_not_fit_are_refused(magnet, controller, told):
    with pytest.raises(ValueError, match=told):
        with_tables(magnet, controller)


def test_controllers_of_another_beat_are_refused():
    paper = example_machine("paper")
    one, other = paper.ambs
    ambs = (
        one.changed(magnet=MAGNET, controller=CONTROLLER),
        other.changed(magnet=MAGNET, controller=CONTROLLER | {"sample_time": "60 us"}),
    )
    with pytest.raises(ValueError, match="AMBs DE and NDE have another sample time or delay"):
        paper.changed(ambs=ambs)


def test_check_says_how_a_loop_operates_and_when_it_cannot(tmp_path):
    save_machine(looped_machine(), tmp_path / "good.toml")
    assert run(["check", str(tmp_path / "good.toml"), "--json", str(tmp_path / "out.json")]) == 0
    numbers = json.loads((tmp_path / "out.json").read_text())
    assert numbers["control_loop"]["stable"]
    assert numbers["magnets"]["DE"]["negative_stiffness_N_per_m"] == pytest.approx(2.6796e6, rel=1e-4)
    machine = looped_machine({"turns": 120}, {"delay": "150 us"})
    save_machine(machine, tmp_path / "bad.toml")
    assert run(["check", str(tmp_path / "bad.toml"), "--json", str(tmp_path / "out.json")]) == 0
    assert not json.loads((tmp_path / "out.json").read_text())["control_loop"]["stable"]
