"""A mistyped unit is doubted by name, and machines of every size are not."""

import pytest
from tests.scaled_machines import scaled_machine

from rotordrop.machine import example_machine, example_path, loads_machine
from rotordrop.machine.plausibility import doubts, unusual_values

MISTYPED = {
    "nominal speed in Hz for rpm": ({"speed.nominal": 56_549.0}, "machine", "nominal speed", "9000 Hz"),
    "friction in percent": ({"NDE.friction.dynamic": 10.0}, "NDE", "dynamic friction", "percent"),
    "friction 15": ({"NDE.friction.static": 15.0}, "NDE", "static friction", "15.0"),
    "damping in percent": ({"rotor.modal_damping": 0.5}, "machine rotor", "modal damping", "percent"),
    "gravity in mm/s^2": ({"gravity": 9810.0}, "machine", "gravity", "9810 m/s²"),
    "no gravity": ({"gravity": 0.0}, "machine", "gravity", "0 m/s²"),
    "race inertia": ({"NDE.race.inertia": 1e-9}, "NDE", "race inertia", "64.5 µm"),
    "race mass": ({"NDE.race.mass": 100.0}, "NDE", "race mass", "100 kg"),
    "support mass": ({"NDE.support.mass": 1e-9}, "NDE", "support mass", "slow to compute"),
    "support in N/m for N/mm": ({"DE.support.stiffness": 0.7}, "DE", "support stiffness", "check the unit"),
    "support in N/mm for N/m": ({"DE.support.stiffness": 2e11}, "DE", "support stiffness", "check the unit"),
    "contact too soft": ({"NDE.contact.stiffness": 1e3}, "NDE", "contact stiffness", "deep in the race"),
    "contact too stiff": ({"NDE.contact.stiffness": 1e14}, "NDE", "contact stiffness", "deep in the race"),
    "contact damping": ({"NDE.contact.damping": 1e6}, "NDE", "contact damping", "1000000 s/m"),
}


@pytest.mark.parametrize(("values", "place", "kind", "told"), MISTYPED.values(), ids=MISTYPED)
def test_a_mistyped_value_is_doubted_by_its_name(values, place, kind, told):
    found = doubts(example_machine("paper").with_values(values))
    (doubt,) = [doubt for doubt in found if doubt.kind == kind]
    assert doubt.bearing == place
    assert doubt.message.startswith(f"{place}: ")
    assert told in doubt.message


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


def test_a_thin_shaft_is_doubted_with_its_nodes():
    text = example_path("small").read_text(encoding="utf-8").replace('"44 mm"', '"1.1 mm"')
    (doubt,) = [doubt for doubt in doubts(loads_machine(text)) if doubt.kind == "outer diameter"]
    assert "between nodes 4 and 5 has a diameter of 1.10 mm on a rotor of" in doubt.message


def test_sensors_almost_in_line_are_doubted():
    machine = example_machine("paper")
    first, second = (sensor for sensor in machine.sensors if sensor.node == machine.sensors[0].node)
    apart = first.angle.value - 0.06
    (doubt,) = doubts(machine.with_values({f"sensors.{second.name}.angle": apart}))
    assert "3.44° apart" in doubt.message


@pytest.mark.parametrize("mass", [1.0, 5.0, 60.0, 600.0, 6000.0])
def test_a_machine_of_any_size_is_not_doubted(mass):
    assert list(unusual_values(scaled_machine(mass))) == []
