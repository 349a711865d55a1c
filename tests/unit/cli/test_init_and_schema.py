"""The verbs init and schema: files that are right, and none that overwrite another."""

import io
import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, load_machine


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


def test_an_example_is_copied_wholly_or_not_at_all(capsys):
    Path("lp400").mkdir()
    Path("lp400/drop_060.h5").write_text("mine")
    assert run(["init", "--example", "lp400"]) == 6
    assert "drop_060.h5 exists already; name another folder or add --force" in capsys.readouterr().err
    assert [file.name for file in Path("lp400").iterdir()] == ["drop_060.h5"]


def test_an_unknown_example_is_named_with_those_there_are(capsys):
    assert run(["init", "--example", "lp500"]) == 64
    assert "there is no example machine 'lp500'; there are paper, lp400" in capsys.readouterr().err


def test_the_schema_accepts_the_template_and_refuses_a_wrong_key(capsys):
    assert run(["init", "--schema", "machine"]) == 0
    schema = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(schema)
    run(["init"])
    machine = tomllib.loads(Path("machine.toml").read_text(encoding="utf-8"))
    jsonschema.validate(machine, schema)
    with pytest.raises(jsonschema.ValidationError, match="nmae"):
        jsonschema.validate(machine | {"nmae": "x"}, schema)


def test_the_schema_goes_to_a_file():
    assert run(["init", "--schema", "machine", "machine.schema.json"]) == 0
    assert json.loads(Path("machine.schema.json").read_text())["title"] == "rotordrop machine file"


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


def test_numbers_that_nobody_can_be_asked_for_are_named(capsys, monkeypatch):
    """Without a terminal the first question ended the command with the exit code of Ctrl-C."""
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert run(["init", "--simple", "--set", "mass=60 kg", "--set", "length=1.1 m"]) == UsageError.exit_code
    said = capsys.readouterr().err
    assert "--simple needs centre, bearings, sensors, sensor_angle, designation" in said
    assert "the input is no terminal" in said
    assert not Path("machine.toml").exists()
