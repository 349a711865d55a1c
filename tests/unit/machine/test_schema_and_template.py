"""The published schema and the template agree with what is read."""

import importlib.util
import json
import re
import tomllib
from pathlib import Path
from typing import get_args

import jsonschema
import pytest

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.contact import Contact
from rotordrop.elements.description import Description
from rotordrop.elements.friction import Friction
from rotordrop.elements.race import Race
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.sleeve import Sleeve
from rotordrop.elements.support import Support
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine, example_names, loads_machine
from rotordrop.machine.examples import example_path
from rotordrop.machine.saving import machine_text
from rotordrop.machine.schema import machine_schema
from rotordrop.machine.template import template_text


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


def test_the_template_fits_the_schema_and_can_be_read(validator):
    assert told(validator, template_text()) == []
    machine = loads_machine(template_text())
    assert len(machine.touchdown_bearings) == 2
    assert told(validator, machine_text(machine)) == []


def test_the_schema_is_plain_json():
    assert json.loads(json.dumps(machine_schema(), allow_nan=False)) == machine_schema()


def test_every_reference_in_the_schema_leads_somewhere():
    schema = machine_schema()
    references = set(re.findall(r'"#/\$defs/([^"]+)"', json.dumps(schema)))
    assert references == references & set(schema["$defs"])
    assert {"length", "length_number", "Support", "Rotor"} <= references


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('air_gap = "250 um"', 'airgap = "250 um"'),
        ('air_gap = "250 um"', "air_gap = 250"),
        ('air_gap = "250 um"', 'air_gap = { guess = "250 um", interval = ["2 um", "3 um"] }'),
        ("node = 2", "node = 0"),
        ("node = 2", 'node = 2\nposition = "0.1 m"'),
        ('length = "0.2 m"', ""),
        ('preload = "heavy"', 'preload = "hevy"'),
    ],
)
def test_what_is_refused_does_not_fit_the_schema(validator, changed, old, new):
    assert told(validator, changed()) == []
    assert told(validator, changed((old, new))) != []


def test_the_schema_says_what_keys_mean_and_what_holds_when_they_are_left_out():
    schema = machine_schema()
    stiffness = schema["$defs"]["Support"]["properties"]["stiffness"]["description"]
    assert "Default 100 MN/m" in stiffness
    assert "[N/m]" in stiffness
    assert "2.5 % of critical" in schema["$defs"]["Support"]["properties"]["damping"]["description"]
    assert schema["$defs"]["BallBearing"]["properties"]["arrangement"]["default"] == "X"


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


@pytest.mark.parametrize(
    "mount",
    [
        '{ kind = "ribon" }',
        '{ kind = "stop", stiffness = "5e8 N/m" }',
        '{ kind = "stop", gap = "0.2 mm", slip_force = "1 kN" }',
        '{ kind = "maxwell" }',
        '{ slip_force = "1 kN" }',
    ],
)
def test_a_mount_that_is_refused_does_not_fit_the_schema(validator, mount):
    raw = machine_with(f"[[touchdown_bearings]]\nmount = [{mount}]")
    assert list(validator.iter_errors(raw))
    with pytest.raises(ValueError, match="mount"):
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


@pytest.mark.parametrize("kind", ["spring", "ribbon", "maxwell", "stop"])
def test_the_page_of_the_machine_file_shows_a_mount_as_files_write_it(sections, kind):
    (section,) = (text for text in sections if f'| **`kind`** | `"{kind}"` |' in text)
    assert section.startswith("`[[touchdown_bearings.mount]]`")
