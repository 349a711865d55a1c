"""What is saved reads back as the same machine, to the last bit."""

import math
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.scaled_machines import scaled_machine

from rotordrop.errors import OutputError
from rotordrop.known import Known
from rotordrop.machine import Machine, example_machine, example_names, load_machine, loads_machine
from rotordrop.machine.saving import machine_text, save_machine

PATHS = {
    "NDE.air_gap": (1e-6, 1e-2),
    "DE.support.stiffness": (1e3, 1e12),
    "NDE.support.damping": (0.0, 1e6),
    "NDE.support.mass_horizontal": (1e-3, 1e4),
    "DE.contact.stiffness": (1e3, 1e12),
    "DE.friction.dynamic": (0.0, 1.0),
    "NDE.friction.static": (0.0, 1.0),
    "NDE.race.inertia": (1e-9, 1.0),
    "DE.preload": (0.0, 1e5),
    "DE.bearing.contact_angle": (0.0, math.radians(59.0)),
    "DE.damping_time": (0.0, 1e-3),
    "speed.nominal": (1e-3, 1e5),
    "speed.aero_time_constant": (1e-3, 1e4),
    "speed.aero_quadratic": (0.0, 1.0),
    "unbalance.0.amount": (0.0, 1.0),
    "unbalance.1.phase": (-math.pi, math.pi),
    "sensors.S_DE_A.offset": (-1e-3, 1e-3),
    "sensors.S_NDE_B.sensitivity": (1.0, 1e6),
    "ambs.DE.stiffness": (1.0, 1e9),
    "rotor.modal_damping": (0.0, 1.0),
    "gravity": (0.0, 100.0),
}


@st.composite
def known(draw, limits):
    """A value with any of what can be known about it."""
    numbers = st.floats(*limits, allow_nan=False).filter(lambda number: number == 0.0 or abs(number) > 1e-18)
    low, value, high = sorted(draw(st.tuples(numbers, numbers, numbers)))
    return Known(
        value=value,
        status=draw(st.sampled_from(["given", "guess", "estimated", "default", "inferred"])),
        range=draw(st.sampled_from([None, (low, high) if low < high else None])),
        interval_90=draw(st.sampled_from([None, (low, high)])),
        standard_error=draw(st.sampled_from([None, abs(high)])),
        lower=draw(st.sampled_from([None, low])),
        upper=draw(st.sampled_from([None, high])),
        source=draw(st.none() | st.text(st.characters(exclude_categories=["Cs"]), max_size=20)),
    )


values = st.fixed_dictionaries({}, optional={path: known(limits) for path, limits in PATHS.items()})


@settings(max_examples=60, deadline=None)
@given(name=st.sampled_from(example_names()), chosen=values)
def test_any_machine_with_any_knowledge_comes_back(name, chosen):
    machine = example_machine(name).with_values(chosen)
    text = machine_text(machine)
    again = loads_machine(text)
    assert again == machine
    assert machine_text(again) == text
    assert again.defaults_in_use == machine.defaults_in_use
    assert again.inferred == machine.inferred


lengths = st.floats(1e-3, 2.0)


@settings(max_examples=60, deadline=None)
@given(
    sections=st.lists(st.tuples(lengths, st.integers(1, 5), lengths, lengths), min_size=1, max_size=6),
    name=st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
    mass=st.floats(1e-3, 1e4),
)
def test_any_shaft_comes_back(sections, name, mass):
    def metres(value):
        return Known(value=value)

    machine = Machine.model_validate(
        {
            "name": name,
            "speed": {"nominal": "100 Hz"},
            "rotor": {
                "sections": [
                    {
                        "length": metres(length),
                        "elements": count,
                        "outer_diameter": metres(outer),
                        "layer_diameter": metres(outer + layer),
                        "layer_density": "5000 kg/m^3",
                        "part": name,
                    }
                    for length, count, outer, layer in sections
                ],
                "discs": [{"node": 1, "mass": Known(value=mass)}],
            },
            "touchdown_bearings": [
                {
                    "name": "only",
                    "position": "0 m",
                    "air_gap": "0.2 mm",
                    "bore_radius": "35 mm",
                    "bearing": {"designation": "XCB71914-E", "preload": "medium"},
                }
            ],
        }
    )
    again = loads_machine(machine_text(machine))
    assert again == machine
    assert again.rotor.node_positions == machine.rotor.node_positions
    assert again.rotor.elements == machine.rotor.elements


def test_an_estimate_is_written_with_interval_and_source(tmp_path):
    estimate = Known(value=1.21e8, status="estimated", interval_90=(1.17e8, 1.25e8), source="drop of 12 May")
    machine = example_machine("lp400").with_values({"NDE.support.stiffness": estimate})
    save_machine(machine, tmp_path / "calibrated.toml")
    raw = tomllib.loads((tmp_path / "calibrated.toml").read_text(encoding="utf-8"))
    assert raw["touchdown_bearings"][0]["support"]["stiffness"] == {
        "value": "1.21e8 N/m",
        "interval": ["1.17e8 N/m", "1.25e8 N/m"],
        "source": "drop of 12 May",
    }
    read = load_machine(tmp_path / "calibrated.toml").touchdown_bearings[0].support
    assert (read.stiffness.status, read.stiffness.interval_90) == ("estimated", (1.17e8, 1.25e8))
    assert read.stiffness_horizontal.value == 1.21e8


def test_defaults_are_not_written(tmp_path, small_text):
    machine = loads_machine(small_text)
    raw = tomllib.loads(machine_text(machine))
    assert "gravity" not in raw
    assert set(raw["touchdown_bearings"][0]) == {"name", "node", "air_gap", "bore_radius", "bearing"}
    assert raw["touchdown_bearings"][1]["bearing"] == {"designation": "XCB71914-E", "preload": "heavy"}


def test_engineers_units_are_written_where_they_are_exact():
    raw = tomllib.loads(machine_text(example_machine("paper")))
    assert raw["speed"]["nominal"] == "550 Hz"
    assert raw["touchdown_bearings"][0]["bore_radius"] == "35 mm"
    assert raw["touchdown_bearings"][0]["contact"]["stiffness"] == "8.3e8 N/m^n"
    assert raw["rotor"]["node_positions"]["unit"] == "mm"
    assert raw["rotor"]["materials"]["steel"]["youngs_modulus"] == "206 GPa"


def test_a_machine_with_a_shaft_table_is_saved_on_its_own(tmp_path):
    save_machine(example_machine("lp400"), tmp_path / "alone.toml")
    assert load_machine(tmp_path / "alone.toml") == example_machine("lp400")


def test_nothing_is_left_where_saving_is_impossible(tmp_path):
    with pytest.raises(OutputError, match=r"the folder .* does not exist"):
        save_machine(example_machine("paper"), tmp_path / "nowhere" / "machine.toml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "clearance",
    ['"C3", bore_diameter = "80 mm"', '"38 um"', '{ guess = "38 um", range = ["25 um", "51 um"] }'],
)
def test_a_clearance_comes_back_as_class_or_length(clearance):
    bearing = (
        f'{{ rows = 1, ball_diameter = "13.494 mm", ball_count = 14, pitch_diameter = "102.5 mm", '
        f"clearance = {clearance} }}"
    )
    machine = scaled_machine(60.0, bearing=bearing)
    assert loads_machine(machine_text(machine)) == machine
    assert float(machine.touchdown_bearings[0].bearing.clearance) == pytest.approx(38e-6)
