"""The published schema and the template agree with what is read."""

import json
import re
import tomllib

import jsonschema
import pytest

from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.contact import Contact
from rotordrop.elements.friction import Friction
from rotordrop.elements.race import Race
from rotordrop.elements.sensor import Sensor
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
