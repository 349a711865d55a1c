"""The verbs init and schema: files that are right, and none that overwrite another."""

import json
from pathlib import Path

import jsonschema
import pytest

from rotordrop.cli.app import run
from rotordrop.machine import example_machine, load_machine
from rotordrop.machine.schema import machine_schema


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_template_is_a_commented_machine_that_passes_the_check(capsys):
    assert run(["init"]) == 0
    assert capsys.readouterr().err == "written: machine.toml\n"
    assert load_machine("machine.toml").touchdown_bearings
    assert run(["check", "machine.toml"]) == 0
    assert sum("#" in line for line in Path("machine.toml").read_text(encoding="utf-8").splitlines()) > 30


def test_nothing_is_overwritten_unasked(capsys):
    Path("machine.toml").write_text("mine")
    assert run(["init"]) == 6
    assert "machine.toml exists already; name another file or add --force" in capsys.readouterr().err
    assert Path("machine.toml").read_text() == "mine"
    assert run(["init", "--force"]) == 0
    assert load_machine("machine.toml")


@pytest.mark.parametrize("name", ["paper", "lp400"])
def test_an_example_is_copied_whole(name):
    assert run(["init", "--example", name, "there"]) == 0
    assert load_machine("there/machine.toml") == example_machine(name)


def test_the_schema_goes_to_the_screen_or_to_a_file(capsys):
    assert run(["init", "--schema", "machine"]) == 0
    assert json.loads(capsys.readouterr().out) == machine_schema()
    assert run(["init", "--schema", "machine", "machine.schema.json"]) == 0
    assert json.loads(Path("machine.schema.json").read_text()) == machine_schema()
    assert machine_schema()["title"] == "rotordrop machine file"


def test_the_schema_of_an_estimate_knows_its_fields(capsys):
    assert run(["init", "--schema", "estimate"]) == 0
    schema = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(schema)
    value = {"value": 2907.0}
    bearing = {"$defs": schema["$defs"], **schema["$defs"]["Bearing"]["properties"]["peak_force_N"]}
    jsonschema.validate(value | {"time_s": 0.009, "interval_90": [2800.0, 3000.0]}, bearing)
    for broken in (2907.0, {"peek": 2907.0}, value | {"time_s": "now"}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(broken, bearing)
    for part in ("Drop", "Bearing"):
        assert schema["$defs"][part]["additionalProperties"] is False
