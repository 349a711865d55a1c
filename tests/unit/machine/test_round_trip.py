"""What is saved reads back to the last bit; schema and template agree with what is read."""

import importlib.util
import json
import math
import re
import tomllib
from pathlib import Path
from typing import get_args

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.scaled_machines import scaled_machine

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.contact import Contact
from rotordrop.elements.description import Description
from rotordrop.elements.friction import Friction
from rotordrop.elements.race import Race
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.sleeve import Sleeve
from rotordrop.elements.support import Support
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.errors import MachineFileError
from rotordrop.known import Known
from rotordrop.machine import Machine, example_machine, example_names, load_machine, loads_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.machine.examples import example_path, template_text
from rotordrop.machine.saving import machine_text, save_machine
from rotordrop.machine.schema import machine_schema

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


GAP = 'air_gap = "250 um"'
lengths = st.floats(1e-3, 2.0)


@settings(max_examples=60, deadline=None)
@given(
    sections=st.lists(st.tuples(lengths, st.integers(1, 5), lengths, lengths), min_size=1, max_size=6),
    name=st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
    mass=st.floats(1e-3, 1e4),
)
def test_any_shaft_comes_back(sections, name, mass):
    def section(length, count, outer, layer):
        diameters = {"outer_diameter": Known(value=outer), "layer_diameter": Known(value=outer + layer)}
        shaft = {"length": Known(value=length), "elements": count, "part": name}
        return shaft | diameters | {"layer_density": "5000 kg/m^3"}

    rotor = {
        "sections": [section(*sizes) for sizes in sections],
        "discs": [{"node": 1, "mass": Known(value=mass)}],
    }
    only = {"name": "only", "position": "0 m", "air_gap": "0.2 mm", "bore_radius": "35 mm"}
    only |= {"bearing": {"designation": "XCB71914-E", "preload": "medium"}}
    described = {"name": name, "speed": {"nominal": "100 Hz"}, "rotor": rotor, "touchdown_bearings": [only]}
    machine = Machine.model_validate(described)
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


def test_defaults_are_not_written_and_engineers_units_where_they_are_exact(tmp_path, small_text):
    machine = loads_machine(small_text)
    raw = tomllib.loads(machine_text(machine))
    assert "gravity" not in raw
    assert set(raw["touchdown_bearings"][0]) == {"name", "node", "air_gap", "bore_radius", "bearing"}
    assert raw["touchdown_bearings"][1]["bearing"] == {"designation": "XCB71914-E", "preload": "heavy"}
    raw = tomllib.loads(machine_text(example_machine("paper")))
    assert raw["speed"]["nominal"] == "550 Hz"
    assert raw["touchdown_bearings"][0]["bore_radius"] == "35 mm"
    assert raw["touchdown_bearings"][0]["contact"]["stiffness"] == "8.3e8 N/m^n"
    assert raw["rotor"]["node_positions"]["unit"] == "mm"
    assert raw["rotor"]["materials"]["steel"]["youngs_modulus"] == "206 GPa"


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


NAMES = ("drop 1, after the repair", "müller's “drop”", "calibrated on x")


@pytest.fixture
def origin():
    return CalibrationOrigin(
        drops=tuple(CalibrationDrop(name=name, sha256=str(k) * 64) for k, name in enumerate(NAMES)),
        consistent=False,
    )


def test_other_values_leave_names_and_origin_of_the_calibration(origin, tmp_path):
    """A comma in a file name split it in two when names stood in a sentence."""
    machine = example_machine("lp400").calibrated_on(origin)
    save_machine(machine, tmp_path / "machine.toml")
    again = load_machine(tmp_path / "machine.toml")
    assert again == machine
    assert again.calibration is not None
    assert tuple(drop.name for drop in again.calibration.drops) == NAMES
    assert again.calibration.drops[1].sha256 == "1" * 64
    assert again.calibration.consistent is False
    machine = example_machine("lp400").calibrated_on(origin).with_values({"NDE.air_gap": 3e-4})
    assert machine.calibration == origin
    assert example_machine("lp400").calibration is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("consistent = true\ndrops = []", r"calibration.drops: .* one entry is needed"),
        ('drops = [{name = "a"}]', r"'consistent' is missing"),
        ('consistent = "yes"\ndrops = [{name = "a"}]', r"'yes' .* expected a valid boolean"),
        ('consistent = true\ndrops = [{name = "a"}, {name = "a"}]', r"'a' stands twice .*; names must"),
    ],
)
def test_a_calibration_that_says_nothing_is_refused(text, message):
    with pytest.raises(MachineFileError, match=message):
        loads_machine(f"{machine_text(example_machine('paper'))}\n[calibration]\n{text}\n")


@pytest.fixture(scope="module")
def validator():
    schema = machine_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def told(validator, text):
    return [error.message for error in validator.iter_errors(tomllib.loads(text))]


@pytest.mark.parametrize("name", example_names())
def test_the_examples_fit_the_schema(validator, name):
    assert told(validator, example_path(name).read_text(encoding="utf-8")) == []


def test_the_schema_is_plain_and_the_template_fits_it(validator):
    assert told(validator, template_text()) == []
    machine = loads_machine(template_text())
    assert len(machine.touchdown_bearings) == 2
    assert told(validator, machine_text(machine)) == []
    schema = machine_schema()
    assert json.loads(json.dumps(schema, allow_nan=False)) == schema
    references = set(re.findall(r'"#/\$defs/([^"]+)"', json.dumps(schema)))
    assert references == references & set(schema["$defs"])
    assert {"length", "length_number", "Support", "Rotor"} <= references


REFUSED = [
    ('name = "small"', 'name = "small"\nnmae = "x"', "nmae"),
    (GAP, 'airgap = "250 um"', "airgap"),
    (GAP, "air_gap = 250", "no unit"),
    (GAP, 'air_gap = { guess = "250 um", interval = ["2 um", "3 um"] }', "interval"),
    ("node = 2", "node = 0", "node 0"),
    ("node = 2", 'node = 2\nposition = "0.1 m"', "position"),
    ('length = "0.2 m"', "", "length"),
    ('preload = "heavy"', 'preload = "hevy"', "hevy"),
    (GAP, f'{GAP}\nmount = [{{ kind = "ribon" }}]', "mount"),
    (GAP, f'{GAP}\nmount = [{{ kind = "stop", stiffness = "5e8 N/m" }}]', "mount"),
    (GAP, f'{GAP}\nmount = [{{ kind = "stop", gap = "0.2 mm", slip_force = "1 kN" }}]', "mount"),
    (GAP, f'{GAP}\nmount = [{{ kind = "maxwell" }}]', "mount"),
    (GAP, f'{GAP}\nmount = [{{ slip_force = "1 kN" }}]', "mount"),
]


@pytest.mark.parametrize(("old", "new", "why"), REFUSED)
def test_what_is_refused_does_not_fit_the_schema(validator, changed, old, new, why):
    assert told(validator, changed()) == []
    assert told(validator, changed((old, new))) != []
    with pytest.raises(MachineFileError, match=why):
        loads_machine(changed((old, new)))


@pytest.mark.parametrize(
    "part", [TouchdownBearing, BallBearing, Contact, Friction, Race, Support, Sensor, Machine]
)
def test_the_template_names_every_key(part):
    internal = {"preload_class", "clearance_class", "node_positions", "ball_count_range"}
    words = set(re.findall(r"\w+", template_text()))
    assert set(part.model_fields) - internal <= words


DOCS = Path(__file__).parents[3] / "docs"
BLOCKS = re.findall(r"```toml\n(.*?)```", (DOCS / "how_to.md").read_text(encoding="utf-8"), re.DOTALL)


def machine_with(block):
    """The reference machine with what a block of the documentation says, of its DE where of a bearing."""
    raw = tomllib.loads(example_path("paper").read_text(encoding="utf-8"))
    said = tomllib.loads(block)
    told = said.pop("touchdown_bearings", ())
    for changed in [told] if isinstance(told, dict) else told:
        bearing = raw["touchdown_bearings"][-1]
        if changed.get("kind") == "sleeve":
            del bearing["race"]
        bearing |= changed
    return raw | said


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.split("\n")[0][:40])
def test_what_the_documentation_shows_can_be_read_and_fits_the_schema(validator, block):
    raw = machine_with(block)
    assert [error.message for error in validator.iter_errors(raw)] == []
    Machine.model_validate(raw)


def test_a_ball_bearing_needs_its_table_and_a_sleeve_does_not(validator):
    raw = machine_with('[[touchdown_bearings]]\nkind = "sleeve"')
    del raw["touchdown_bearings"][-1]["bearing"]
    assert not list(validator.iter_errors(raw))
    raw["touchdown_bearings"][-1]["kind"] = "ball bearing"
    assert [error.message for error in validator.iter_errors(raw)] == ["'bearing' is a required property"]


def held_by(kind):
    """A description and all those that its fields hold."""
    found = {kind}
    waiting = [field.annotation for field in kind.model_fields.values()]
    while waiting:
        one = waiting.pop()
        if isinstance(one, type) and issubclass(one, Description):
            found |= held_by(one)
        waiting += get_args(one)
    return found


@pytest.fixture(scope="module")
def sections():
    """Sections of the page of the machine file, and the keys in the table of each."""
    spec = importlib.util.spec_from_file_location("reference_page", DOCS / "reference_page.py")
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    return {
        text: set(re.findall(r"^\| \**`(\w+)`", text, re.MULTILINE))
        for text in page.machine_page().split("\n## ")[1:]
    }


@pytest.mark.parametrize("part", sorted({*held_by(Machine), Sleeve}, key=lambda part: part.__name__))
def test_the_page_of_the_machine_file_has_a_table_of_every_part(sections, part):
    written_elsewhere = {"preload_class", "clearance_class", "along", "grade_mm_s"}
    about = "At the top" if part is Machine else "\n\n" + part.__doc__.split("\n")[0] + "\n"
    (told,) = (keys for text, keys in sections.items() if about in text)
    assert set(part.model_fields) - written_elsewhere <= told
