"""Other values by path: what changes, what follows, what is refused; mistyped units are doubted by name."""

import math
import re

import pytest
from tests.scaled_machines import TWELVE_NUMBERS, scaled_machine

from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine import example_machine, example_names, example_path, loads_machine
from rotordrop.machine.plausibility import doubts, unusual_values
from rotordrop.machine.simple import SimpleMachine, simple_machine

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


def test_what_follows_another_value_follows_unless_given(machine):
    support = machine.with_values({"NDE.support.stiffness": 3e8}).touchdown_bearings[0].support
    assert support.stiffness_horizontal.value == 3e8
    assert support.damping.value == pytest.approx(2 * 0.025 * math.sqrt(3e8 * 40.0), rel=1e-14)
    assert support.damping_horizontal.value == support.damping.value
    own = machine.with_values({"NDE.support.stiffness_horizontal": 5e7})
    support = own.with_values({"NDE.support.stiffness": 3e8}).touchdown_bearings[0].support
    assert (support.stiffness.value, support.stiffness_horizontal.value) == (3e8, 5e7)
    support = machine.with_values({"NDE.support.damping": 1234.0}).touchdown_bearings[0].support
    assert (support.damping.value, support.damping_horizontal.value) == (1234.0, 1234.0)
    assert support.damping_ratio is None
    friction = machine.with_values({"DE.friction.dynamic": 0.2}).touchdown_bearings[1].friction
    assert friction.static.value == pytest.approx(0.26)
    given = example_machine("paper").with_values({"DE.friction.dynamic": 0.2}).touchdown_bearings[1].friction
    assert given.static.value == 0.13


def test_a_force_takes_the_place_of_a_preload_class_and_a_position_keeps_its_node(small_text):
    machine = loads_machine(small_text)
    assert machine.touchdown_bearings[1].bearing.preload.value == 1026.0
    bearing = machine.with_values({"DE.preload": 500.0}).touchdown_bearings[1].bearing
    assert (bearing.preload.value, bearing.preload_class) == (500.0, None)
    assert machine.touchdown_bearings[1].node == 8
    assert machine.with_values({"DE.air_gap": 3e-4}).touchdown_bearings[1].node == 8


def test_an_estimate_keeps_what_is_known_of_it_and_the_machine_itself_does_not_change(machine):
    estimate = Known(value=2e8, status="estimated", interval_90=(1e8, 3e8), source="drop 1")
    read = machine.with_values({"NDE.support.stiffness": estimate}).touchdown_bearings[0].support.stiffness
    assert (read.interval_90, read.source, read.unit) == ((1e8, 3e8), "drop 1", "N/m")
    before = machine.model_dump()
    machine.with_values({"NDE.support.stiffness": 1.0, "unbalance.0.amount": 0.0})
    assert machine.model_dump() == before
    other = machine.with_values({"unbalance.0.phase": 1.0})
    assert other.unbalances[0].phase.value == 1.0
    assert other.unbalances[1] == machine.unbalances[1]


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
        ("NDE.air_gap", "350", "'350' has no unit; a length needs one"),
        ("NDE.friction.dynamic", math.nan, "is not a finite number"),
    ],
)
def test_refusals_name_path_and_value(machine, path, value, told):
    with pytest.raises(UsageError, match=told):
        machine.with_values({path: value})


@pytest.mark.parametrize(
    "described", [example_machine("lp400"), simple_machine(SimpleMachine(**TWELVE_NUMBERS))]
)
def test_another_node_is_another_place_whether_node_or_position_was_given(described):
    """It was taken back without a word, and a rotor exchanged under its bearings stood on other nodes."""
    first, last = described.touchdown_bearings
    moved = described.changed(touchdown_bearings=(first.changed(node=last.node - 2), last))
    assert [bearing.node for bearing in moved.touchdown_bearings] == [last.node - 2, last.node]
    assert first.changed(air_gap="300 um").node == first.node


def test_what_is_left_out_goes_with_the_rotor(small_text, changed):
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
    other = heavy.with_values({"DE.air_gap": 3e-4, "NDE.support.stiffness": 3e8})
    assert other.bearing("DE").support == heavy.bearing("DE").support
    assert other.bearing("NDE").support.stiffness.value == 3e8
    assert other.bearing("NDE").support.mass.value == heavy.bearing("NDE").support.mass.value
    narrow = light.bearing("DE")
    wide = loads_machine(
        changed(('bearing = { designation = "XCB71914-E" }', 'bearing = { designation = "B71960-C" }'))
    ).bearing("NDE")
    ratio = wide.race.width.value / narrow.race.width.value
    assert ratio > 2.0
    found = wide.contact.stiffness.value / narrow.contact.stiffness.value
    assert found == pytest.approx(ratio ** (8.0 / 9.0), rel=1e-9)


DOUBTED = [
    ("speed.nominal", 56_549.0, "nominal speed", None, "9000 Hz"),
    ("NDE.friction.dynamic", 10.0, "dynamic friction", None, "percent"),
    ("NDE.friction.static", 15.0, "static friction", None, r"15\.0"),
    ("rotor.modal_damping", 0.5, "modal damping", None, "percent"),
    ("gravity", 9810.0, "gravity", None, "9810 m/s²"),
    ("gravity", 0.0, "gravity", None, "0 m/s²"),
    ("NDE.race.inertia", 1e-9, "race inertia", None, r"64\.5 µm"),
    ("NDE.race.mass", 100.0, "race mass", None, "100 kg"),
    ("NDE.support.mass", 1e-9, "support mass", None, "slow to compute"),
    ("DE.support.stiffness", 0.7, "support stiffness", None, "check the unit"),
    ("DE.support.stiffness", 2e11, "support stiffness", None, "check the unit"),
    ("NDE.contact.stiffness", 1e3, "contact stiffness", None, "deep in the race"),
    ("NDE.contact.stiffness", 1e14, "contact stiffness", None, "deep in the race"),
    ("NDE.contact.damping", 1e6, "contact damping", None, "1000000 s/m"),
    ("NDE.air_gap", 2.5e-5, "air gap", 30e-6, "25.0 µm is unusual"),
    ("DE.air_gap", 2.5e-3, "air gap", 1.5e-3, "2.50 mm is unusual"),
    ("NDE.bore_radius", 0.03, "rotor radius", 0.0347, "29.7 mm, but the shaft there has 34.7 mm"),
    ("DE.friction.static", 0.08, "friction", 0.1, "static friction 0.08 is smaller than dynamic .* 0.1"),
    ("DE.friction.smoothing_speed", 1e-3, "smoothing speed", 5e-3, "smoothed below 1.00 mm/s"),
    ("NDE.damping_time", 1e-4, "bearing damping", 2.5e-5, "100 µs, outside 2.5 to 25 µs"),
    ("NDE.damping_time", 1e-6, "bearing damping", 2.5e-6, "1.00 µs, outside 2.5 to 25 µs"),
    ("NDE.preload", 1100.0, "preload", 1026.0, "1.10 kN exceeds the heavy class of XCB71914E"),
]
"""Path and value on the paper's machine, kind of the doubt, the limit it compares with, words."""


@pytest.mark.parametrize(("path", "value", "kind", "limit", "told"), DOUBTED)
def test_a_mistyped_or_unusual_value_is_doubted_by_its_name(path, value, kind, limit, told):
    found = doubts(example_machine("paper").with_values({path: value}))
    (doubt,) = [doubt for doubt in found if doubt.kind == kind]
    part = path.split(".")[0]
    place = {"speed": "machine", "gravity": "machine", "rotor": "machine rotor"}.get(part, part)
    assert doubt.bearing == place and doubt.message.startswith(f"{place}: ")
    assert re.search(told, doubt.message)
    assert limit is None or doubt.limit == pytest.approx(limit)
    assert limit is None or kind == "rotor radius" or doubt.value == pytest.approx(value)


WRITTEN = {
    "E in MPa": ('youngs_modulus = "210 MPa"', "youngs modulus", "210 GPa"),
    "E in GPa for Pa": ('youngs_modulus = "206000 GPa"', "youngs modulus", "check the unit"),
    "density in g/cm^3": ('density = "7.85 kg/m^3"', "density", "7850 kg/m^3"),
    "no metal": ("poisson_ratio = 0.01", "poisson ratio", "metals"),
}


@pytest.mark.parametrize(("entry", "kind", "told"), WRITTEN.values(), ids=WRITTEN)
def test_a_mistyped_material_is_doubted_by_its_name(entry, kind, told):
    values = {"youngs_modulus": '"210 GPa"', "poisson_ratio": "0.3", "density": '"7850 kg/m^3"'}
    key, value = entry.split(" = ")
    lines = "\n".join(f"{name} = {text}" for name, text in {**values, key: value}.items())
    text = example_path("paper").read_text(encoding="utf-8")
    machine = loads_machine(f"{text}\n[rotor.materials.odd]\n{lines}\n")
    (doubt,) = doubts(machine)
    assert (doubt.bearing, doubt.kind) == ("odd", kind)
    assert told in doubt.message


def test_a_thin_shaft_and_sensors_almost_in_line_are_doubted():
    text = example_path("small").read_text(encoding="utf-8").replace('"44 mm"', '"1.1 mm"')
    (doubt,) = [doubt for doubt in doubts(loads_machine(text)) if doubt.kind == "outer diameter"]
    assert "between nodes 4 and 5 has a diameter of 1.10 mm on a rotor of" in doubt.message
    machine = example_machine("paper")
    first, second = (sensor for sensor in machine.sensors if sensor.node == machine.sensors[0].node)
    apart = first.angle.value - 0.06
    (doubt,) = doubts(machine.with_values({f"sensors.{second.name}.angle": apart}))
    assert "3.44° apart" in doubt.message


@pytest.mark.parametrize("mass", [1.0, 5.0, 60.0, 600.0, 6000.0])
def test_a_machine_of_any_size_is_not_doubted(mass):
    assert list(unusual_values(scaled_machine(mass))) == []


@pytest.mark.parametrize("name", example_names())
def test_the_examples_look_normal(name):
    assert doubts(example_machine(name)) == ()


def test_a_beam_that_stands_for_a_rotor_has_no_seats_to_compare():
    told = {"mass": "59.5 kg", "length": "1.117 m", "centre": "621 mm", "bearings": ("70 mm", "857 mm")}
    told |= {"sensors": ("100 mm", "827 mm"), "sensor_angle": "135 deg", "designation": "XCB71914-E"}
    told |= {"gap": "0.25 mm", "speed": "33000 rpm", "grade": "G 1", "support": "1e8 N/m"}
    assert doubts(simple_machine(SimpleMachine(**told))) == ()
