"""Other values by path: what changes, what follows, what is refused."""

import math

import pytest
from tests.scaled_machines import TWELVE_NUMBERS

from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine import example_machine, loads_machine
from rotordrop.machine.simple import SimpleMachine, simple_machine


@pytest.fixture(scope="module")
def machine():
    return example_machine("lp400")


CONTRACT = [
    *(f"NDE.{name}" for name in ("air_gap", "bore_radius", "damping_time", "preload")),
    *(f"DE.support.{name}{end}" for name in ("mass", "stiffness", "damping") for end in ("", "_horizontal")),
    *(f"DE.contact.{name}" for name in ("stiffness", "exponent", "damping")),
    *(f"DE.friction.{name}" for name in ("static", "dynamic", "stribeck_speed", "smoothing_speed")),
    *(f"DE.race.{name}" for name in ("mass", "inertia", "drag_coefficient", "drag_speed")),
    "speed.aero_time_constant",
    "speed.nominal",
    "unbalance.0.amount",
    "unbalance.1.phase",
    "sensors.S_NDE_A.gain",
    "ambs.NDE.damping",
    "NDE.bearing.conformity_inner",
    "gravity",
]


def look_up(machine, path):
    head, *rest = path.split(".")
    names = {bearing.name: bearing for bearing in machine.touchdown_bearings}
    if head == "unbalance":
        part, rest = machine.unbalances[int(rest[0])], rest[1:]
    elif head in ("sensors", "ambs"):
        part, rest = next(p for p in getattr(machine, head) if p.name == rest[0]), rest[1:]
    else:
        part = names.get(head) or getattr(machine, head)
    if rest == ["preload"]:
        rest = ["bearing", "preload"]
    for name in rest:
        part = getattr(part, name)
    return part


@pytest.mark.parametrize("path", CONTRACT)
def test_the_value_at_the_path_changes_and_nothing_else_of_what_was_given(machine, path):
    old = look_up(machine, path)
    new = 0.99 * (float(old) if old is not None else 7.0) + (
        1e-3 if old is not None and float(old) == 0 else 0.0
    )
    other = machine.with_values({path: new})
    assert float(look_up(other, path)) == new
    assert look_up(other, path).status == "given"
    assert other.rotor is machine.rotor  # read again with every value, it would take longer than a simulation
    for kept in set(CONTRACT) - {path}:
        before, after = look_up(machine, kept), look_up(other, kept)
        if before is not None and before.status == "given":
            assert after == before, kept


def test_the_horizontal_support_follows_the_vertical_one(machine):
    support = machine.with_values({"NDE.support.stiffness": 3e8}).touchdown_bearings[0].support
    assert support.stiffness_horizontal.value == 3e8
    assert support.damping.value == pytest.approx(2 * 0.025 * math.sqrt(3e8 * 40.0), rel=1e-14)
    assert support.damping_horizontal.value == support.damping.value


def test_a_horizontal_value_of_its_own_stays(machine):
    own = machine.with_values({"NDE.support.stiffness_horizontal": 5e7})
    support = own.with_values({"NDE.support.stiffness": 3e8}).touchdown_bearings[0].support
    assert (support.stiffness.value, support.stiffness_horizontal.value) == (3e8, 5e7)


def test_damping_takes_the_place_of_its_ratio(machine):
    support = machine.with_values({"NDE.support.damping": 1234.0}).touchdown_bearings[0].support
    assert (support.damping.value, support.damping_horizontal.value) == (1234.0, 1234.0)
    assert support.damping_ratio is None


def test_static_friction_follows_dynamic_friction_unless_given(machine):
    friction = machine.with_values({"DE.friction.dynamic": 0.2}).touchdown_bearings[1].friction
    assert friction.static.value == pytest.approx(0.26)
    given = example_machine("paper").with_values({"DE.friction.dynamic": 0.2}).touchdown_bearings[1].friction
    assert given.static.value == 0.13


def test_a_force_takes_the_place_of_a_preload_class(small_text):
    machine = loads_machine(small_text)
    assert machine.touchdown_bearings[1].bearing.preload.value == 1026.0
    bearing = machine.with_values({"DE.preload": 500.0}).touchdown_bearings[1].bearing
    assert (bearing.preload.value, bearing.preload_class) == (500.0, None)


def test_a_bearing_given_by_position_keeps_its_node(small_text):
    machine = loads_machine(small_text)
    assert machine.touchdown_bearings[1].node == 8
    assert machine.with_values({"DE.air_gap": 3e-4}).touchdown_bearings[1].node == 8


def test_an_unbalance_by_grade_becomes_one_of_its_own(machine):
    other = machine.with_values({"unbalance.0.phase": 1.0})
    assert other.unbalances[0].phase.value == 1.0
    assert other.unbalances[1] == machine.unbalances[1]


def test_an_estimate_keeps_what_is_known_about_it(machine):
    estimate = Known(value=2e8, status="estimated", interval_90=(1e8, 3e8), source="drop 1")
    read = machine.with_values({"NDE.support.stiffness": estimate}).touchdown_bearings[0].support.stiffness
    assert (read.interval_90, read.source, read.unit) == ((1e8, 3e8), "drop 1", "N/m")


def test_the_machine_itself_does_not_change(machine):
    before = machine.model_dump()
    machine.with_values({"NDE.support.stiffness": 1.0, "unbalance.0.amount": 0.0})
    assert machine.model_dump() == before


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        ("NDE.suport.stiffness", 1.0, "'suport' is not known; did you mean 'support'"),
        ("NDE.support.stifness", 1.0, "'stifness' is not known; did you mean 'stiffness'"),
        ("NDE.support", 1.0, "'NDE.support' is not a single physical value; .* NDE, DE"),
        ("XE.air_gap", 1.0, "'XE' is not known"),
        ("unbalance.7.amount", 1.0, "no value 'unbalance.7.amount': there are 2 of them"),
        ("unbalance.first.amount", 1.0, "unbalances are counted from 0"),
        ("NDE.air_gap", -1e-6, r"cannot set NDE\.air_gap = -1e-06 \(SI units\): .*must be positive"),
        ("NDE.air_gap", 0.04, "the air gap 40 mm must be smaller than the bore radius 35 mm"),
        ("NDE.friction.dynamic", math.nan, "is not a finite number"),
    ],
)
def test_refusals_name_path_and_value(machine, path, value, told):
    with pytest.raises(UsageError, match=told):
        machine.with_values({path: value})


@pytest.mark.parametrize(
    "described", [example_machine("lp400"), simple_machine(SimpleMachine(**TWELVE_NUMBERS))]
)
def test_another_node_is_another_place_whether_node_or_position_was_given(described) -> None:
    """It was taken back without a word, and a rotor exchanged under its bearings stood on other nodes."""
    first, last = described.touchdown_bearings
    moved = described.changed(touchdown_bearings=(first.changed(node=last.node - 2), last))
    assert [bearing.node for bearing in moved.touchdown_bearings] == [last.node - 2, last.node]
    assert first.changed(air_gap="300 um").node == first.node


def test_what_is_left_out_of_a_support_goes_with_the_rotor(small_text, changed):
    light = loads_machine(small_text)
    heavy = loads_machine(changed(('mass = "5 kg"', 'mass = "5000 kg"')))
    size = heavy.rotor.mass / light.rotor.mass
    assert size > 100.0
    one, other = (machine.bearing("DE").support for machine in (light, heavy))
    assert other.mass.value == pytest.approx(size * one.mass.value, rel=1e-12)
    assert other.stiffness.value == pytest.approx(size ** (1 / 3) * one.stiffness.value, rel=1e-12)
    assert one.mass.value / light.rotor.mass == pytest.approx(40.0 / 60.0, rel=1e-12)
    assert other.mass.range[1] / other.mass.value == pytest.approx(10.0)
    for name in ("mass", "stiffness"):
        assert getattr(other, f"{name}_horizontal").value == getattr(other, name).value
    critical = 2.0 * math.sqrt(other.mass.value * other.stiffness.value)
    assert other.damping.value == pytest.approx(0.025 * critical, rel=1e-12)


def test_another_value_of_a_bearing_leaves_its_support_under_the_same_rotor(changed):
    heavy = loads_machine(changed(('mass = "5 kg"', 'mass = "5000 kg"')))
    other = heavy.with_values({"DE.air_gap": 3e-4, "NDE.support.stiffness": 3e8})
    assert other.bearing("DE").support == heavy.bearing("DE").support
    assert other.bearing("NDE").support.stiffness.value == 3e8
    assert other.bearing("NDE").support.mass.value == heavy.bearing("NDE").support.mass.value


def test_a_contact_left_out_goes_with_the_width_of_the_race(small_text, changed):
    narrow = loads_machine(small_text).bearing("DE")
    wide = loads_machine(
        changed(('bearing = { designation = "XCB71914-E" }', 'bearing = { designation = "B71960-C" }'))
    ).bearing("NDE")
    ratio = wide.race.width.value / narrow.race.width.value
    assert ratio > 2.0
    found = wide.contact.stiffness.value / narrow.contact.stiffness.value
    assert found == pytest.approx(ratio ** (8.0 / 9.0), rel=1e-9)
